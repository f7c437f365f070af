//! Tracking errors against the gains, both logarithmic, a panel a trajectory.

use super::settings::Settings;
use super::source::Source;
use super::sweep::{Row, curve};
use crate::data_figures::section::extent;
use crate::report::picture::{Align, Font, Pen, Picture};

/// Width and height of a panel.
const PANEL: (f64, f64) = (240.0, 260.0);
/// Left and top of the first panel, and the gap between two.
const LEFT: f64 = 84.0;
const TOP: f64 = 56.0;
const GAP: f64 = 26.0;

fn pen(source: Source) -> Pen {
    let (colour, dashes) = match source {
        Source::Nothing => ("#999999", None),
        Source::Gravity => ("#999999", Some("6 4")),
        Source::Lr => ("#d55e00", None),
        Source::Gp => ("#009e73", None),
        Source::Igp => ("#cc79a7", None),
        Source::Mgp => ("#0072b2", None),
        Source::RigidBody => ("#e69f00", None),
        Source::NoFriction => ("#e69f00", Some("6 4")),
        Source::Exact => ("#000000", Some("2 3")),
    };
    Pen {
        colour,
        width: 2.0,
        dashes,
    }
}

/// The picture of the known loads.
pub fn draw(rows: &[Row], settings: &Settings, trajectories: &[(String, String)]) -> Picture {
    let (width, height) = PANEL;
    let n = trajectories.len() as f64;
    let right = LEFT + n * (width + GAP);
    let mut picture = Picture::new(right + 110.0, TOP + height + 60.0);
    let of = |trajectory: &str, source| {
        curve(rows, settings, (trajectory, source, false), |outcome| {
            outcome.error()
        })
    };
    let all = trajectories
        .iter()
        .flat_map(|(name, _)| Source::ALL.map(|source| of(name, source)).concat());
    let (low, high) = extent(all.map(|(_, error)| (1e3 * error).log10()));
    let (low, high) = (low.floor(), high.ceil().max(low.floor() + 1.0));
    let (first, last) = extent(settings.bandwidths.iter().map(|bandwidth| bandwidth.ln()));
    let title = "Tracking error against the gains";
    picture.text(24.0, 26.0, title, Font::Title, Align::Left);
    for (idx, (name, label)) in trajectories.iter().enumerate() {
        let left = LEFT + idx as f64 * (width + GAP);
        let at = |(x, y): (f64, f64)| {
            let across = if last > first {
                (x.ln() - first) / (last - first)
            } else {
                0.5
            };
            let up = ((1e3 * y).log10() - low) / (high - low);
            (left + across * width, TOP + (1.0 - up) * height)
        };
        frame(&mut picture, settings, (left, low, high), idx == 0, |x| {
            at((x, 1.0)).0
        });
        picture.text(
            left + width / 2.0,
            TOP - 8.0,
            label,
            Font::Label,
            Align::Centre,
        );
        for source in Source::ALL {
            let points = of(name, source).into_iter().map(at).collect();
            picture.stroke(points, pen(source));
        }
    }
    for (idx, source) in Source::ALL.into_iter().enumerate() {
        let y = TOP + 14.0 + 20.0 * idx as f64;
        let x = right - 8.0;
        picture.stroke(vec![(x, y - 4.0), (x + 28.0, y - 4.0)], pen(source));
        picture.text(x + 34.0, y, source.name(), Font::Label, Align::Left);
    }
    picture
}

fn frame(
    picture: &mut Picture,
    settings: &Settings,
    (left, low, high): (f64, f64, f64),
    is_first: bool,
    across: impl Fn(f64) -> f64,
) {
    let (width, height) = PANEL;
    let mut exponent = low;
    while exponent <= high {
        let y = TOP + (high - exponent) / (high - low) * height;
        picture.line((left, y), (left + width, y));
        if is_first {
            let label = format!("1e{exponent:.0}").replace('-', "−");
            picture.text(left - 6.0, y + 4.0, &label, Font::Remark, Align::Right);
        }
        exponent += 1.0;
    }
    picture.rectangle((left, TOP, width, height), "none", Some("#999999"));
    for &bandwidth in &settings.bandwidths {
        let place = (across(bandwidth), TOP + height + 16.0);
        let label = format!("{bandwidth}");
        picture.text(place.0, place.1, &label, Font::Remark, Align::Centre);
    }
    let label = "bandwidth ω/(rad/s), Kp = Iω²";
    let below = TOP + height + 40.0;
    picture.text(left + width / 2.0, below, label, Font::Label, Align::Centre);
    if is_first {
        let label = "RMS error over the joints/mrad";
        picture.vertical_text(26.0, TOP + height / 2.0, label, Font::Label);
    }
}
