//! A confusion matrix as squares whose area is the part of a row's trials.

use super::counts::Confusion;
use crate::figure::colour::{BLUE, INK, VERMILION};
use crate::figure::picture::{Align, Font, Picture};

/// Side of a cell.
const CELL: f64 = 26.0;
/// Left and top margin.
const MARGIN: f64 = 56.0;

/// The picture: rows the load that was true, columns the one said.
pub fn draw(confusion: &Confusion) -> Picture {
    let m = confusion.counts.len();
    let side = m as f64 * CELL;
    let mut picture = Picture::new(MARGIN + side + 20.0, MARGIN + side + 20.0);
    let centre = |idx: usize| MARGIN + (idx as f64 + 0.5) * CELL;
    let middle = MARGIN + side / 2.0;
    picture.text(middle, 16.0, "load said", Font::Label, Align::Centre);
    picture.vertical_text(14.0, middle, "load that was true", Font::Label);
    picture.rectangle((MARGIN, MARGIN, side, side), "none", Some(INK));
    for (load, row) in confusion.counts.iter().enumerate() {
        let name = format!("c{}", load + 1);
        let at = centre(load);
        picture.text(at, MARGIN - 8.0, &name, Font::Remark, Align::Centre);
        picture.text(MARGIN - 6.0, at + 4.0, &name, Font::Remark, Align::Right);
        let total: usize = row.iter().sum();
        for (said, n) in row.iter().enumerate().filter(|(_, n)| **n > 0) {
            let part = *n as f64 / total as f64;
            let side = (CELL - 2.0) * part.sqrt();
            let colour = if said == load { BLUE } else { VERMILION };
            let other = said + 1;
            picture.start_group(format!("{name} taken for c{other}: {n} of {total}"));
            let corner = (centre(said) - side / 2.0, at - side / 2.0, side, side);
            picture.rectangle(corner, colour, None);
            picture.end_group();
        }
    }
    picture
}
