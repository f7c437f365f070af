//! nMSE of the new load against the number of its samples, both logarithmic.

use super::Settings;
use super::learners::{Learner, Score};
use super::table::JOINTS;
use crate::data_figures::section::extent;
use crate::report::picture::{Align, Font, Pen, Picture};

/// Left, top, width and height of the axes.
const AXES: (f64, f64, f64, f64) = (78.0, 26.0, 420.0, 300.0);

/// Lowest exponent that is drawn; physics without noise is below.
const LOWEST: f64 = -8.0;

/// Colour and dashes of a learner's line.
fn style(learner: Learner) -> (&'static str, Option<&'static str>) {
    match learner {
        Learner::Mgp => ("#0072b2", None),
        Learner::RowOnly => ("#0072b2", Some("6 4")),
        Learner::NoPrior => ("#56b4e9", Some("2 3")),
        Learner::Alone => ("#d55e00", None),
        Learner::Pooled => ("#009e73", None),
        Learner::Nearest => ("#cc79a7", None),
        Learner::Physics => ("#000000", Some("9 4 2 4")),
    }
}

/// The picture, of the first noise.
pub fn draw(scores: &[Score], settings: &Settings) -> Picture {
    let (left, top, width, height) = AXES;
    let mut picture = Picture::new(left + width + 150.0, top + height + 60.0);
    let logs = |learner| -> Vec<(f64, f64)> {
        let point = |&count: &usize| {
            let value = settings.mean(scores, (learner, 0, count), JOINTS)?;
            Some(((count as f64).log10(), value.log10().max(LOWEST)))
        };
        settings.counts.iter().filter_map(point).collect()
    };
    let all: Vec<f64> = (Learner::ALL.into_iter())
        .flat_map(|learner| logs(learner).into_iter().map(|(_, value)| value))
        .collect();
    let (low, high) = extent(all);
    let (low, high) = (low.floor(), high.ceil().max(low.floor() + 1.0));
    let last = extent(settings.counts.iter().map(|&count| count as f64))
        .1
        .log10();
    let at = |(x, y): (f64, f64)| {
        let across = if last > 0.0 { x / last } else { 0.0 };
        (
            left + across * width,
            top + (high - y) / (high - low) * height,
        )
    };
    picture.rectangle(AXES, "none", Some("#999999"));
    let mut exponent = low;
    while exponent <= high {
        let (x, y) = at((0.0, exponent));
        picture.line((x, y), (left + width, y));
        let label = format!("1e{exponent:.0}").replace('-', "−");
        picture.text(left - 6.0, y + 4.0, &label, Font::Remark, Align::Right);
        exponent += 1.0;
    }
    for &count in &settings.counts {
        let (x, _) = at(((count as f64).log10(), low));
        picture.text(
            x,
            top + height + 16.0,
            &count.to_string(),
            Font::Remark,
            Align::Centre,
        );
    }
    let middle = left + width / 2.0;
    picture.text(
        middle,
        top + height + 40.0,
        "samples of c15",
        Font::Label,
        Align::Centre,
    );
    picture.vertical_text(
        18.0,
        top + height / 2.0,
        "nMSE on extrap, joints 2 to 6",
        Font::Label,
    );
    for (idx, learner) in Learner::ALL.into_iter().enumerate() {
        let (colour, dashes) = style(learner);
        let pen = || Pen {
            colour,
            width: 2.0,
            dashes,
        };
        picture.stroke(logs(learner).into_iter().map(at).collect(), pen());
        let y = top + 14.0 + 20.0 * idx as f64;
        let x = left + width + 12.0;
        picture.stroke(vec![(x, y - 4.0), (x + 28.0, y - 4.0)], pen());
        picture.text(x + 34.0, y, learner.name(), Font::Label, Align::Left);
    }
    picture
}
