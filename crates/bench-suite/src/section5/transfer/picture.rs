//! nMSE against the number of other loads and of own samples, a column a joint.

use super::curve::{Axis, CurveRecord, Learner};
use super::settings::Settings;
use super::table::Means;
use crate::figure::axis;
use crate::figure::palette::line_of;
use crate::figure::panel::{Panel, legend_row};
use crate::figure::picture::{Align, Font, Picture};

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
            let counts = settings.counts(axis);
            let nmse = |learner, count| means.of((axis, count), learner, Some(joint));
            let panel = plot(&mut picture, (x, y), (axis, counts), nmse);
            panel.heading(&mut picture, &format!("joint {joint}"));
        }
    }
    let entries = Learner::ALL.map(|learner| (line_of(learner.name()), learner.name()));
    legend_row(&mut picture, (LEFT, height - 30.0), entries);
    picture
}

/// One plot: how each learner scores along the axis.
fn plot(
    picture: &mut Picture,
    (x, y): (f64, f64),
    (axis, counts): (Axis, &[usize]),
    nmse: impl Fn(Learner, usize) -> Option<f64>,
) -> Panel {
    let number = |count: usize| match axis {
        Axis::Others => 1.0 + count as f64, // from no other load
        Axis::Samples => count as f64,
    };
    let line = |learner| -> (Learner, Vec<(f64, f64)>) {
        let point = |&count: &usize| Some((number(count), nmse(learner, count)?));
        (learner, counts.iter().filter_map(point).collect())
    };
    let lines = Learner::ALL.map(line);
    let marks = counts
        .iter()
        .map(|&count| (number(count), count.to_string()));
    let values = lines.iter().flat_map(|(_, points)| points);
    let mut panel = Panel::new(
        (x, y, PANEL.0, PANEL.1),
        axis::Axis::of_numbers(axis.label(), marks),
        axis::Axis::decades("", values.map(|(_, value)| *value)),
    );
    panel.inset = (INSET, INSET);
    panel.frame(picture);
    for (learner, points) in lines {
        let line = line_of(learner.name());
        panel.curve(picture, &line, points.iter().copied());
        for point in points {
            picture.start_group(format!("{}: {:.2e}", learner.name(), point.1));
            picture.disc(panel.on_page(point), 2.5, line.colour, line.colour);
            picture.end_group();
        }
    }
    panel
}
