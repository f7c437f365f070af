//! Figure 6: the torque of joint 6 over the first two principal components, in perspective.

use super::principal::{PrincipalComponents, Scaling};
use super::samples::{Samples, label, phases_over_pi, shown};
use super::section::{Section, csv, extent};
use crate::error::BenchError;
use crate::figure::axis::Axis;
use crate::figure::colour::DATA;
use crate::figure::line::Line;
use crate::figure::perspective::View;
use crate::figure::picture::{Align, Font, Picture};
use crate::split::TrajectoryId;

/// Joint shown, from 1.
const JOINT: usize = 6;
// ASSUMPTION(fig. 6): the load is not named; the lightest, as in fig. 5.
/// Load shown, from 1.
const LOAD: usize = 1;
/// Trajectories shown, left and right.
const SHOWN: [TrajectoryId; 2] = [shown::NEAR_FAST, shown::FAR_SLOW];

const TORQUE: Line = Line::solid(DATA[0], 2.4);
const SHADOW: Line = Line::dashed(DATA[3], 1.0, &[1.5, 2.5]);

/// A trajectory and its points (PC1, PC2, τ).
type Curve = (TrajectoryId, Vec<[f64; 3]>);

/// Makes the figure.
///
/// # Errors
/// `Decomposition`, `Dynamics` or `Picture` as its parts say.
///
/// # Source
/// Fig. 6.
pub fn make(samples: &Samples) -> Result<Section, BenchError> {
    let components = PrincipalComponents::of(samples.states(), Scaling::Standardised)?;
    let mut curves = Vec::new();
    for id in SHOWN {
        let torques = samples.torques(id, LOAD, JOINT)?;
        let scores = samples.states_of(id).map(|x| components.scores(x, 2));
        let points = scores.zip(torques).map(|(s, torque)| [s[0], s[1], torque]);
        curves.push((id, points.collect()));
    }

    let mut section = Section::default();
    section.show(
        "fig06",
        "Torque over two principal components",
        &draw(&curves),
    )?;
    section.file("fig06.csv", to_csv(&curves));
    let printed = [
        ["−5 to 5", "−10 to 0", "−2 to 1"],
        ["0 to 2", "−0.5 to 1", "−0.8 to 0.2"],
    ];
    for ((id, points), printed) in curves.iter().zip(printed) {
        let axes = ["PC1", "PC2", "τ6/N·m"]
            .into_iter()
            .zip(printed)
            .enumerate();
        for (axis, (name, ticks)) in axes {
            let (low, high) = extent(points.iter().map(|p| p[axis]));
            let here = format!("{low:.2} to {high:.2}").replace('-', "−");
            section.found(
                format!("{}: {name} with ticks from {ticks}", label(*id)),
                here,
            );
        }
    }
    Ok(section)
}

fn draw(curves: &[Curve]) -> Picture {
    let mut picture = Picture::new(980.0, 460.0);
    let title =
        "Torque of joint 6 over the first two principal components (the chapter's figure 6)";
    picture.text(24.0, 34.0, title, Font::Title, Align::Left);
    for ((id, points), x) in curves.iter().zip([0.0, 490.0]) {
        panel(&mut picture, x, *id, points);
    }
    let remark =
        "Solid: torque with load c1. Dotted: the same states on the plane of the two components.";
    picture.text(24.0, 440.0, remark, Font::Remark, Align::Left);
    picture
}

fn panel(picture: &mut Picture, x: f64, id: TrajectoryId, points: &[[f64; 3]]) {
    let range = |axis: usize| extent(points.iter().map(|p| p[axis]));
    let (low, high) = range(2);
    // Room between the lowest torque and the plane, so that the projection can be told from the curve.
    let room = 0.3 * (high - low);
    let axes = [
        Axis::around("PC1", range(0)),
        Axis::around("PC2", range(1)),
        Axis::around("Torque at joint 6/N·m", (low - room, high)),
    ];
    let view = View::new(axes, [1.0, 1.0, 0.75], (x + 84.0, 70.0, 370.0, 310.0));
    view.frame(picture);
    picture.text(x + 260.0, 60.0, &label(id), Font::Heading, Align::Centre);
    let closed = || points.iter().chain(points.first()).copied();
    view.curve(
        picture,
        &SHADOW,
        closed().map(|[a, b, _]| [a, b, view.floor()]),
    );
    view.curve(picture, &TORQUE, closed());
}

fn to_csv(curves: &[Curve]) -> String {
    let phases = phases_over_pi();
    let rows = curves.iter().flat_map(|(id, points)| {
        let name = format!("p{}_s{}", id.path_idx + 1, id.speed_idx + 1);
        phases
            .iter()
            .zip(points)
            .map(move |(phase, p)| (vec![name.clone()], vec![*phase, p[0], p[1], p[2]]))
    });
    csv("trajectory,phase_over_pi,pc1,pc2,torque6_c1_nm", rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_carry_the_torques_of_figure_5() {
        let samples = Samples::reference().unwrap();
        let section = make(&samples).unwrap();
        let text = String::from_utf8(section.files[2].1.clone()).unwrap();
        let torques = samples.torques(shown::NEAR_FAST, 1, 6).unwrap();
        for (line, torque) in text.lines().skip(1).zip(torques) {
            assert!(line.starts_with("p1_s4,"), "{line}");
            let last: f64 = line.rsplit(',').next().unwrap().parse().unwrap();
            assert_eq!(last.to_bits(), torque.to_bits());
        }
        assert_eq!(text.lines().count(), 1 + 2 * 4000);
    }
}
