//! Tracking errors against the gains, both logarithmic, a panel a trajectory.

use super::plant::Outcome;
use super::settings::Settings;
use super::source::Source;
use super::sweep::{Row, curve};
use crate::figure::axis::Axis;
use crate::figure::palette::line_of;
use crate::figure::panel::{Panel, legend_column};
use crate::figure::picture::{Align, Font, Picture};

/// Width and height of a panel.
const PANEL: (f64, f64) = (240.0, 260.0);
/// Left and top of the first panel, and the gap between two.
const LEFT: f64 = 84.0;
const TOP: f64 = 56.0;
const GAP: f64 = 26.0;

/// The picture of the known loads.
pub fn draw(rows: &[Row], settings: &Settings, trajectories: &[(String, String)]) -> Picture {
    let (width, height) = PANEL;
    let right = LEFT + trajectories.len() as f64 * (width + GAP);
    let mut picture = Picture::new(right + 120.0, TOP + height + 60.0);
    let title = "Tracking error against the gains";
    picture.text(24.0, 26.0, title, Font::Title, Align::Left);
    // (bandwidth, error in mrad) of each source.
    let of = |trajectory: &str, source| {
        let key = (trajectory, source, false);
        let points = curve(rows, settings, key, Outcome::error).into_iter();
        points.map(|(bandwidth, error)| (bandwidth, 1e3 * error))
    };
    let all = trajectories
        .iter()
        .flat_map(|(name, _)| Source::ALL.into_iter().flat_map(|source| of(name, source)));
    let errors = Axis::decades("RMS error over the joints/mrad", all.map(|point| point.1));
    let marks = settings.bandwidths.iter().map(|b| (*b, b.to_string()));
    let gains = Axis::of_numbers("bandwidth ω/(rad/s), Kp = Iω²", marks);
    for (idx, (name, label)) in trajectories.iter().enumerate() {
        let left = LEFT + idx as f64 * (width + GAP);
        let vertical = match idx {
            0 => errors.clone(),
            _ => errors.clone().without_texts(),
        };
        let panel = Panel::new((left, TOP, width, height), gains.clone(), vertical);
        panel.frame(&mut picture);
        panel.heading(&mut picture, label);
        for source in Source::ALL {
            panel.curve(&mut picture, &line_of(source.name()), of(name, source));
        }
    }
    let entries = Source::ALL.map(|source| (line_of(source.name()), source.name()));
    legend_column(&mut picture, (right - 8.0, TOP + 10.0), entries);
    picture
}
