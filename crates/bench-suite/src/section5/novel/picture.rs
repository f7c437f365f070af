//! nMSE of the new load against the number of its samples, both logarithmic.

use super::case::Settings;
use super::learners::{Learner, Score};
use super::table::JOINTS;
use crate::figure::axis::Axis;
use crate::figure::palette::line_of;
use crate::figure::panel::{Panel, legend_column};
use crate::figure::picture::Picture;

/// Left, top, width and height of the axes.
const PLACE: (f64, f64, f64, f64) = (78.0, 26.0, 420.0, 300.0);

/// Lowest nMSE that is drawn; physics without noise is below.
const LOWEST: f64 = 1e-8;

/// The picture, of the first noise.
pub fn draw(scores: &[Score], settings: &Settings) -> Picture {
    let (left, top, width, height) = PLACE;
    let mut picture = Picture::new(left + width + 190.0, top + height + 60.0);
    let curve = |learner| -> Vec<(f64, f64)> {
        let point = |&count: &usize| {
            let value = settings.mean(scores, (learner, 0, count), JOINTS)?;
            Some((count as f64, value.max(LOWEST)))
        };
        settings.counts.iter().filter_map(point).collect()
    };
    let curves: Vec<Vec<(f64, f64)>> = Learner::ALL.into_iter().map(curve).collect();
    let values = curves.iter().flatten().map(|(_, value)| *value);
    let counts = settings.counts.iter();
    let counts = counts.map(|&count| (count as f64, count.to_string()));
    let panel = Panel::new(
        PLACE,
        Axis::of_numbers("samples of the new load", counts),
        Axis::decades("nMSE on extrap, joints 2 to 6", values),
    );
    panel.frame(&mut picture);
    for (learner, curve) in Learner::ALL.into_iter().zip(curves) {
        panel.curve(&mut picture, &line_of(learner.name()), curve);
    }
    let entries = Learner::ALL.map(|learner| (line_of(learner.name()), learner.name()));
    legend_column(&mut picture, (left + width + 12.0, top + 10.0), entries);
    picture
}
