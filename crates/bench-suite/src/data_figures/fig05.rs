//! Figure 5: the torque of joint 6, and the same torque as a square wave and a smooth function.

use super::fig04::jumps;
use super::samples::{Samples, phases_over_pi, shown};
use super::section::{Section, csv, extent};
use crate::error::BenchError;
use crate::figure::axis::Axis;
use crate::figure::colour::DATA;
use crate::figure::line::Line;
use crate::figure::panel::{Panel, legend_row};
use crate::figure::picture::{Align, Font, Picture};

/// Joint and load shown, from 1.
const JOINT: usize = 6;
const LOAD: usize = 1;
/// Ends of the chapter's axis, N·m.
const AXIS: (f64, f64) = (-3.0, 1.0);

const WHOLE: Line = Line::solid(DATA[0], 1.8);
const SQUARE: Line = Line::dashed(DATA[1], 1.8, &[6.0, 3.0]);
const SMOOTH: Line = Line::solid(DATA[2], 2.2);

/// A torque and its two parts, N·m.
///
/// ```text
/// torque = square + smooth,    square = Coulomb friction, a function of sgn(q̇_6) alone
/// ```
struct Parts {
    torque: Vec<f64>,
    square: Vec<f64>,
    smooth: Vec<f64>,
}

impl Parts {
    fn of(samples: &Samples) -> Result<Self, BenchError> {
        let torque = samples.torques(shown::NEAR_FAST, LOAD, JOINT)?;
        let square = samples.coulomb(shown::NEAR_FAST, JOINT);
        let smooth = torque.iter().zip(&square).map(|(t, s)| t - s).collect();
        Ok(Self {
            torque,
            square,
            smooth,
        })
    }
}

/// Makes the figure.
///
/// # Errors
/// `Dynamics` or `Picture` as its parts say.
///
/// # Source
/// Fig. 5.
pub fn make(samples: &Samples) -> Result<Section, BenchError> {
    let parts = Parts::of(samples)?;
    let mut section = Section::default();
    section.show(
        "fig05",
        "A torque as a square wave and a smooth function",
        &draw(&parts),
    )?;
    section.file("fig05.csv", to_csv(&parts));

    let minus = |text: String| text.replace('-', "−");
    let (low, high) = extent(parts.torque.iter().copied());
    section.found(
        "axis from −3 to 1 N·m",
        minus(format!("the torque goes from {low:.2} to {high:.2} N·m")),
    );
    let (lower, upper) = extent(parts.square.iter().copied());
    section.found(
        "the torque is a square wave plus a smooth function",
        minus(format!(
            "the square wave has levels {lower:.3} and {upper:.3} N·m (not opposite: the friction is asymmetric), \
             a height of {:.3} N·m, and {} jumps a round",
            upper - lower,
            jumps(&parts.square).len()
        )),
    );
    let (low, high) = extent(parts.smooth.iter().copied());
    section.found(
        "the smooth function has no jump",
        minus(format!(
            "it goes from {low:.2} to {high:.2} N·m; its largest step between samples is {:.4} N·m",
            largest_step(&parts.smooth)
        )),
    );
    Ok(section)
}

fn largest_step(values: &[f64]) -> f64 {
    let steps = values.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    steps.fold(0.0, f64::max)
}

fn draw(parts: &Parts) -> Picture {
    let mut picture = Picture::new(840.0, 400.0);
    let title = "Torque of joint 6 along (p1,s4) with load c1 (the chapter's figure 5)";
    picture.text(24.0, 34.0, title, Font::Title, Align::Left);
    let entries = [
        (WHOLE, "torque"),
        (SQUARE, "square wave: Coulomb friction"),
        (SMOOTH, "smooth function: the rest"),
    ];
    legend_row(&mut picture, (78.0, 64.0), entries);
    let data = extent(
        parts
            .torque
            .iter()
            .chain(&parts.smooth)
            .chain(&parts.square)
            .copied(),
    );
    let phases = phases_over_pi();
    let panels: [&[(&Line, &[f64])]; 2] = [
        &[(&WHOLE, &parts.torque)],
        &[(&SMOOTH, &parts.smooth), (&SQUARE, &parts.square)],
    ];
    for (curves, x) in panels.into_iter().zip([78.0, 490.0]) {
        let panel = Panel::new(
            (x, 90.0, 320.0, 250.0),
            Axis::linear("Phase of path/π", (0.0, 2.0), 0.5),
            Axis::covering("Torque at joint 6/N·m", data, AXIS),
        );
        panel.frame(&mut picture);
        for (line, values) in curves {
            let points = phases.iter().copied().zip(values.iter().copied());
            panel.curve(&mut picture, line, points);
        }
    }
    picture
}

fn to_csv(parts: &Parts) -> String {
    let phases = phases_over_pi();
    let rows = (0..phases.len()).map(|k| {
        let numbers = vec![phases[k], parts.torque[k], parts.square[k], parts.smooth[k]];
        (Vec::new(), numbers)
    });
    csv("phase_over_pi,torque_nm,square_wave_nm,smooth_nm", rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parts_add_up_and_the_smooth_one_is_smooth() {
        let parts = Parts::of(&Samples::reference().unwrap()).unwrap();
        for k in 0..parts.torque.len() {
            let sum = parts.square[k] + parts.smooth[k];
            // One rounded subtraction and one rounded addition.
            let tolerance = f64::EPSILON * (parts.torque[k].abs() + parts.smooth[k].abs());
            assert!((sum - parts.torque[k]).abs() <= tolerance, "sample {k}");
        }
        let height = jumps(&parts.square)[0].abs();
        assert!(largest_step(&parts.smooth) < height / 20.0);
        assert!(largest_step(&parts.torque) > 0.9 * height);
    }

    #[test]
    fn the_square_wave_has_corkes_two_levels() {
        // |G| Tc of joint 6: 76.686 · 3.96e-3 and −76.686 · 10.5e-3 N·m (Corke 1996).
        let parts = Parts::of(&Samples::reference().unwrap()).unwrap();
        let levels = [76.686 * 3.96e-3, -76.686 * 10.5e-3, 0.0];
        for value in &parts.square {
            let error = levels.map(|level| (value - level).abs());
            assert!(error.iter().any(|e| *e < 1e-12), "{value}");
        }
    }
}
