//! nMSE against the number of other loads and of own samples, a column a joint.

use super::Settings;
use super::curve::{Axis, CurveRecord, Learner};
use super::table::Means;
use crate::report::axes;
use crate::report::curves::Series;
use crate::report::fig10;
use crate::report::picture::{Align, Font, INK, PAPER, Pen, Picture};

/// Width and height of a panel.
const PANEL: (f64, f64) = (170.0, 176.0);
/// Left and top edge of the first panel.
const LEFT: f64 = 84.0;
const TOP: f64 = 72.0;
/// From one panel to the next.
const STEP: (f64, f64) = (220.0, 250.0);
/// Room below the last panel for the legend.
const BOTTOM: f64 = 96.0;
/// Room between the outermost places and the frame.
const INSET: f64 = 12.0;

/// Room that the last label needs to itself.
const LABEL_ROOM: f64 = 26.0;

/// Pen of a line, the same as in figures 10 and 11.
fn pen(learner: Learner) -> Pen {
    fig10::pen(match learner {
        Learner::Single => Series::Single,
        Learner::Independent => Series::Independent,
        Learner::Pooled => Series::Pooled,
        Learner::Transfer => Series::TransferBic,
    })
}

/// The picture.
pub(super) fn draw(records: &[CurveRecord], settings: &Settings) -> Picture {
    let means = Means(records);
    let width = (LEFT + STEP.0 * settings.joints.len() as f64).max(LEFT + 560.0);
    let height = TOP + STEP.1 + PANEL.1 + BOTTOM;
    let mut picture = Picture::new(width, height);
    let title = "nMSE of one load on extrap, geometric mean over the targets";
    picture.text(24.0, 34.0, title, Font::Title, Align::Left);
    for (row, axis) in Axis::ALL.into_iter().enumerate() {
        let y = TOP + STEP.1 * row as f64;
        picture.vertical_text(30.0, y + PANEL.1 / 2.0, "nMSE", Font::Label);
        for (column, &joint) in settings.joints.iter().enumerate() {
            let x = LEFT + STEP.0 * column as f64;
            let panel = Panel::new((x, y), axis, settings.counts(axis), |learner, count| {
                means.of((axis, count), learner, Some(joint))
            });
            panel.draw(&mut picture, axis, joint);
        }
    }
    for (idx, learner) in Learner::ALL.into_iter().enumerate() {
        let (x, y) = (LEFT + 130.0 * idx as f64, height - 30.0);
        picture.stroke(vec![(x, y), (x + 46.0, y)], pen(learner));
        picture.text(x + 56.0, y + 4.0, learner.name(), Font::Label, Align::Left);
    }
    picture
}

/// One plot: its place and its lines.
struct Panel {
    corner: (f64, f64),
    /// (number, place from 0 to 1).
    marks: Vec<(usize, f64)>,
    vertical: axes::Axis,
    /// (place, nMSE) of each learner.
    lines: Vec<(Learner, Vec<(f64, f64)>)>,
}

impl Panel {
    fn new(
        corner: (f64, f64),
        axis: Axis,
        counts: &[usize],
        nmse: impl Fn(Learner, usize) -> Option<f64>,
    ) -> Self {
        let log = |count: usize| match axis {
            Axis::Others => (1.0 + count as f64).ln(), // from no other load
            Axis::Samples => (count as f64).ln(),
        };
        let first = counts.first().map_or(0.0, |&count| log(count));
        let last = counts.last().map_or(1.0, |&count| log(count));
        let spread = if last > first { last - first } else { 1.0 };
        let marks: Vec<(usize, f64)> = (counts.iter())
            .map(|&count| (count, (log(count) - first) / spread))
            .collect();
        let line = |learner| {
            let points = marks.iter();
            let points = points.filter_map(|&(count, place)| Some((place, nmse(learner, count)?)));
            (learner, points.collect::<Vec<(f64, f64)>>())
        };
        let lines: Vec<_> = Learner::ALL.into_iter().map(line).collect();
        let values = lines.iter().flat_map(|(_, points)| points);
        let vertical = axes::Axis::log_around(values.map(|&(_, value)| value));
        Self {
            corner,
            vertical: vertical.unwrap_or(axes::Axis::Log { low: -1, high: 0 }),
            marks,
            lines,
        }
    }

    fn draw(&self, picture: &mut Picture, axis: Axis, joint: usize) {
        let ((x, y), (width, height)) = (self.corner, PANEL);
        picture.rectangle((x, y, width, height), PAPER, None);
        for (fraction, label) in self.vertical.ticks() {
            let tick_y = y + height * (1.0 - fraction);
            picture.line((x, tick_y), (x + width, tick_y));
            picture.text(x - 6.0, tick_y + 4.0, &label, Font::Remark, Align::Right);
        }
        for &(count, place) in &self.marks {
            let mark_x = self.across(place);
            picture.line((mark_x, y), (mark_x, y + height));
            let is_last = place >= 1.0;
            let room = self.across(1.0) - mark_x;
            if is_last || room >= LABEL_ROOM {
                let label = count.to_string();
                let below = y + height + 16.0;
                picture.text(mark_x, below, &label, Font::Remark, Align::Centre);
            }
        }
        picture.rectangle((x, y, width, height), "none", Some(INK));
        let middle = x + width / 2.0;
        let heading = format!("joint {joint}");
        picture.text(middle, y - 10.0, &heading, Font::Heading, Align::Centre);
        let below = y + height + 36.0;
        picture.text(middle, below, axis.label(), Font::Label, Align::Centre);
        for (learner, points) in &self.lines {
            self.line(picture, *learner, points);
        }
    }

    fn line(&self, picture: &mut Picture, learner: Learner, points: &[(f64, f64)]) {
        let at = |&(place, value): &(f64, f64)| {
            let up = self.vertical.place(value).fraction;
            (self.across(place), self.corner.1 + PANEL.1 * (1.0 - up))
        };
        let pen = pen(learner);
        picture.stroke(points.iter().map(at).collect(), pen);
        for point in points {
            let title = format!("{}: {:.2e}", learner.name(), point.1);
            picture.start_group(title);
            picture.disc(at(point), 2.5, pen.colour, pen.colour);
            picture.end_group();
        }
    }

    fn across(&self, place: f64) -> f64 {
        self.corner.0 + INSET + place * (PANEL.0 - 2.0 * INSET)
    }
}
