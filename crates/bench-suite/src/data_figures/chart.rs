//! A flat chart: frame, grid, ticks, labels, and curves inside.

use super::curve::Line;
use super::scale::Scale;
use crate::report::picture::{Align, Font, GRID, INK, Pen, Picture};

/// Length of a legend's sample line, in points.
const SAMPLE: f64 = 34.0;
/// Average width of a letter of a label, in points.
const LETTER: f64 = 6.6;

/// A chart's place on the page and its axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// Left, top, width and height of the frame, in points.
    pub place: (f64, f64, f64, f64),
    /// Horizontal axis.
    pub horizontal: Scale,
    /// Vertical axis.
    pub vertical: Scale,
}

impl Chart {
    /// Draws the frame with its grid, ticks and axis labels.
    pub fn frame(&self, picture: &mut Picture) {
        let (x, y, width, height) = self.place;
        for (value, text) in self.horizontal.ticks() {
            let at = x + width * self.horizontal.fraction(value);
            rule(picture, (at, y), (at, y + height));
            picture.text(at, y + height + 16.0, &text, Font::Label, Align::Centre);
        }
        for (value, text) in self.vertical.ticks() {
            let at = y + height * (1.0 - self.vertical.fraction(value));
            rule(picture, (x, at), (x + width, at));
            picture.text(x - 7.0, at + 4.0, &text, Font::Label, Align::Right);
        }
        picture.rectangle(self.place, "none", Some(INK));
        let (middle, below) = (x + width / 2.0, y + height + 36.0);
        picture.text(
            middle,
            below,
            &self.horizontal.label,
            Font::Label,
            Align::Centre,
        );
        let texts = self.vertical.ticks();
        let longest = texts.iter().map(|(_, text)| text.chars().count()).max();
        let room = 7.0 + LETTER * longest.unwrap_or(0) as f64 + 14.0;
        picture.vertical_text(
            x - room,
            y + height / 2.0,
            &self.vertical.label,
            Font::Label,
        );
    }

    /// Draws a curve through points of the data.
    pub fn curve(
        &self,
        picture: &mut Picture,
        line: &Line,
        points: impl IntoIterator<Item = (f64, f64)>,
    ) {
        let points: Vec<(f64, f64)> = points
            .into_iter()
            .map(|point| self.on_page(point))
            .collect();
        line.draw(picture, &points);
    }

    /// Where a point of the data lies on the page.
    pub fn on_page(&self, (a, b): (f64, f64)) -> (f64, f64) {
        let (x, y, width, height) = self.place;
        (
            x + width * self.horizontal.fraction(a),
            y + height * (1.0 - self.vertical.fraction(b)),
        )
    }
}

/// Sample lines with their names in a row that starts at (x, y): outside every frame, so that no data is covered.
pub fn legend(picture: &mut Picture, (x, y): (f64, f64), entries: &[(&Line, &str)]) {
    let mut left = x;
    for (line, name) in entries {
        line.draw(picture, &[(left, y), (left + SAMPLE, y)]);
        picture.text(left + SAMPLE + 8.0, y + 4.0, name, Font::Label, Align::Left);
        left += SAMPLE + 8.0 + LETTER * name.chars().count() as f64 + 26.0;
    }
}

fn rule(picture: &mut Picture, from: (f64, f64), to: (f64, f64)) {
    let pen = Pen {
        colour: GRID,
        width: 0.8,
        dashes: None,
    };
    picture.stroke(vec![from, to], pen);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_of_the_data_are_corners_of_the_frame() {
        let chart = Chart {
            place: (10.0, 20.0, 100.0, 50.0),
            horizontal: Scale::new("a", (0.0, 2.0), 0.5),
            vertical: Scale::new("b", (-1.0, 1.0), 0.5),
        };
        assert_eq!(chart.on_page((0.0, -1.0)), (10.0, 70.0));
        assert_eq!(chart.on_page((2.0, 1.0)), (110.0, 20.0));
    }
}
