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
        Learner::OwnFunction => ("#56b4e9", None),
        Learner::NoPrior => ("#56b4e9", Some("2 3")),
        Learner::Alone => ("#d55e00", None),
        Learner::Pooled => ("#009e73", None),
        Learner::Nearest => ("#cc79a7", None),
        Learner::Physics => ("#000000", Some("9 4 2 4")),
    }
}

/// Where logarithms of samples and of nMSE lie on the page.
struct Axes {
    /// Of the largest number of samples.
    last: f64,
    /// Exponents of the ends of the vertical axis.
    low: f64,
    high: f64,
}

impl Axes {
    fn around(curves: &[Vec<(f64, f64)>], counts: &[usize]) -> Self {
        let (low, high) = extent(curves.iter().flatten().map(|(_, value)| *value));
        let low = low.floor();
        Self {
            last: extent(counts.iter().map(|&count| count as f64)).1.log10(),
            low,
            high: high.ceil().max(low + 1.0),
        }
    }

    fn at(&self, (x, y): (f64, f64)) -> (f64, f64) {
        let (left, top, width, height) = AXES;
        let across = if self.last > 0.0 { x / self.last } else { 0.0 };
        let down = (self.high - y) / (self.high - self.low);
        (left + across * width, top + down * height)
    }

    fn frame(&self, counts: &[usize], picture: &mut Picture) {
        let (left, top, width, height) = AXES;
        picture.rectangle(AXES, "none", Some("#999999"));
        let mut exponent = self.low;
        while exponent <= self.high {
            let (x, y) = self.at((0.0, exponent));
            picture.line((x, y), (left + width, y));
            let label = format!("1e{exponent:.0}").replace('-', "−");
            picture.text(left - 6.0, y + 4.0, &label, Font::Remark, Align::Right);
            exponent += 1.0;
        }
        let bottom = top + height;
        for &count in counts {
            let (x, _) = self.at(((count as f64).log10(), self.low));
            let label = count.to_string();
            picture.text(x, bottom + 16.0, &label, Font::Remark, Align::Centre);
        }
        let (middle, label) = (left + width / 2.0, "samples of the new load");
        picture.text(middle, bottom + 40.0, label, Font::Label, Align::Centre);
        let label = "nMSE on extrap, joints 2 to 6";
        picture.vertical_text(18.0, top + height / 2.0, label, Font::Label);
    }
}

/// The picture, of the first noise.
pub fn draw(scores: &[Score], settings: &Settings) -> Picture {
    let (left, top, width, height) = AXES;
    let mut picture = Picture::new(left + width + 180.0, top + height + 60.0);
    let curve = |learner| -> Vec<(f64, f64)> {
        let point = |&count: &usize| {
            let value = settings.mean(scores, (learner, 0, count), JOINTS)?;
            Some(((count as f64).log10(), value.log10().max(LOWEST)))
        };
        settings.counts.iter().filter_map(point).collect()
    };
    let curves: Vec<Vec<(f64, f64)>> = Learner::ALL.into_iter().map(curve).collect();
    let axes = Axes::around(&curves, &settings.counts);
    axes.frame(&settings.counts, &mut picture);
    for (idx, (learner, curve)) in Learner::ALL.into_iter().zip(curves).enumerate() {
        let (colour, dashes) = style(learner);
        let pen = || Pen {
            colour,
            width: 2.0,
            dashes,
        };
        picture.stroke(
            curve.into_iter().map(|point| axes.at(point)).collect(),
            pen(),
        );
        let (x, y) = (left + width + 12.0, top + 14.0 + 20.0 * idx as f64);
        picture.stroke(vec![(x, y - 4.0), (x + 28.0, y - 4.0)], pen());
        picture.text(x + 34.0, y, learner.name(), Font::Label, Align::Left);
    }
    picture
}
