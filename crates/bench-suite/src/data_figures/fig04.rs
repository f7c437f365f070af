//! Figure 4: torques of joints 3 and 6 against the phase, with the lightest and the heaviest load.

use super::samples::{Samples, label, phases_over_pi, shown};
use super::section::{Section, csv, extent};
use crate::error::BenchError;
use crate::figure::axis::Axis;
use crate::figure::colour::DATA;
use crate::figure::line::Line;
use crate::figure::panel::{Panel, legend_row};
use crate::figure::picture::{Align, Font, Picture};
use crate::split::TrajectoryId;

/// The loads shown, with their lines: solid for the lightest, dashed for the heaviest.
const LOADS: [(usize, &[f64]); 2] = [(1, &[]), (15, &[6.0, 3.0])];
// DEVIATION(fig. 4): the chapter draws both joints into one panel with two vertical axes; here each has its own.
/// One panel: trajectory, joint, and the ends of the chapter's axis, N·m.
const PANELS: [(TrajectoryId, usize, (f64, f64)); 4] = [
    (shown::NEAR_FAST, 3, (-40.0, 20.0)),
    (shown::NEAR_FAST, 6, (-4.0, 2.0)),
    (shown::FAR_SLOW, 3, (-40.0, 0.0)),
    (shown::FAR_SLOW, 6, (-1.5, 0.5)),
];
/// Width and height of a panel.
const PANEL: (f64, f64) = (320.0, 230.0);

/// Makes the figure.
///
/// # Errors
/// `Dynamics` or `Picture` as its parts say.
///
/// # Source
/// Fig. 4.
pub fn make(samples: &Samples) -> Result<Section, BenchError> {
    let mut panels = Vec::new();
    for (id, joint, axis) in PANELS {
        let of_load = |load| samples.torques(id, load, joint);
        let torques = [of_load(LOADS[0].0)?, of_load(LOADS[1].0)?];
        panels.push((id, joint, axis, torques));
    }

    let mut section = Section::default();
    section.show("fig04", "Torques against the phase", &draw(&panels))?;
    section.file("fig04.csv", to_csv(&panels));
    for (id, joint, (low, high), torques) in &panels {
        let found = extent(torques.iter().flatten().copied());
        section.found(
            signed(&format!(
                "{}, joint {joint}: axis from {low} to {high} N·m",
                label(*id)
            )),
            signed(&format!(
                "torques over {:.2} to {:.2} N·m",
                found.0, found.1
            )),
        );
    }
    for (id, joint, _, torques) in &panels {
        let (mean, rest) = offset(torques);
        section.found(
            format!(
                "{}, joint {joint}: loads differ most noticeably by a vertical offset",
                label(*id)
            ),
            signed(&format!(
                "c15 minus c1 has mean {mean:.2} N·m and standard deviation {rest:.2} N·m"
            )),
        );
    }
    for (id, joint, _, torques) in &panels {
        let jumps = jumps(&samples.coulomb(*id, *joint));
        let size = jumps.iter().map(|jump| jump.abs()).fold(0.0, f64::max);
        let (low, high) = extent(torques.iter().flatten().copied());
        section.found(
            format!(
                "{}, joint {joint}: a jump each time the joint's velocity crosses zero",
                label(*id)
            ),
            format!(
                "{} jumps a round of {size:.3} N·m, {:.0} % of the range of the torque",
                jumps.len(),
                100.0 * size / (high - low)
            ),
        );
    }
    Ok(section)
}

/// What a panel shows: trajectory, joint, the chapter's axis, and torques under the two loads.
type Shown = (TrajectoryId, usize, (f64, f64), [Vec<f64>; 2]);

/// Mean and standard deviation of the difference between the loads.
fn offset([light, heavy]: &[Vec<f64>; 2]) -> (f64, f64) {
    let difference: Vec<f64> = heavy.iter().zip(light).map(|(a, b)| a - b).collect();
    let n = difference.len() as f64;
    let mean = difference.iter().sum::<f64>() / n;
    let variance = difference.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / n;
    (mean, variance.sqrt())
}

/// Changes of a Coulomb torque over a closed path, one each time the joint turns back.
///
/// A sample exactly at rest belongs to neither side and is passed over.
pub fn jumps(coulomb: &[f64]) -> Vec<f64> {
    let moving: Vec<f64> = coulomb.iter().copied().filter(|c| *c != 0.0).collect();
    let next = moving.iter().cycle().skip(1);
    moving
        .iter()
        .zip(next)
        .map(|(before, after)| after - before)
        .filter(|jump| *jump != 0.0)
        .collect()
}

/// Thick for joint 3 and thin for joint 6, as in the chapter.
fn line(load_idx: usize, joint: usize) -> Line {
    let width = if joint == 3 { 2.2 } else { 1.4 };
    Line::dashed(DATA[load_idx], width, LOADS[load_idx].1)
}

fn draw(panels: &[Shown]) -> Picture {
    let mut picture = Picture::new(840.0, 760.0);
    let title = "Torques against the phase of the path (the chapter's figure 4)";
    picture.text(24.0, 34.0, title, Font::Title, Align::Left);
    let loads = [
        (line(0, 3), "load c1, 0.2 kg"),
        (line(1, 3), "load c15, 3.0 kg"),
    ];
    legend_row(&mut picture, (78.0, 64.0), loads);
    let phases = phases_over_pi();
    for (i, (_, joint, axis, torques)) in panels.iter().enumerate() {
        let data = extent(torques.iter().flatten().copied());
        let panel = Panel::new(
            ([78.0, 490.0][i % 2], [96.0, 428.0][i / 2], PANEL.0, PANEL.1),
            Axis::linear("Phase of path/π", (0.0, 2.0), 0.5),
            Axis::covering(&format!("Torque at joint {joint}/N·m"), data, *axis),
        );
        panel.frame(&mut picture);
        for (load_idx, torques) in torques.iter().enumerate() {
            let points = phases.iter().copied().zip(torques.iter().copied());
            panel.curve(&mut picture, &line(load_idx, *joint), points);
        }
    }
    for (row, y) in [(0, 386.0), (2, 718.0)] {
        let name = format!("({}) {}", ["a", "b"][row / 2], label(panels[row].0));
        picture.text(444.0, y, &name, Font::Heading, Align::Centre);
    }
    picture
}

fn to_csv(panels: &[Shown]) -> String {
    let phases = phases_over_pi();
    let rows = panels.iter().flat_map(|(id, joint, _, [light, heavy])| {
        let labels = vec![
            format!("p{}_s{}", id.path_idx + 1, id.speed_idx + 1),
            joint.to_string(),
        ];
        let numbers = phases.iter().zip(light).zip(heavy);
        numbers.map(move |((phase, a), b)| (labels.clone(), vec![*phase, *a, *b]))
    });
    csv(
        "trajectory,joint,phase_over_pi,torque_c1_nm,torque_c15_nm",
        rows,
    )
}

/// Minus signs for people.
fn signed(text: &str) -> String {
    text.replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jumps_worked_by_hand_close_the_round() {
        // Up by 3, back by 3 through rest, and none at the seam.
        assert_eq!(jumps(&[-1.0, 2.0, 2.0, 0.0, -1.0]), [3.0, -3.0]);
        assert_eq!(jumps(&[1.0, 1.0]), [0.0; 0]);
        // The seam itself can be a jump.
        assert_eq!(jumps(&[-1.0, 2.0]), [3.0, -3.0]);
    }

    #[test]
    fn torques_jump_where_their_coulomb_part_does_and_nowhere_else() {
        let samples = Samples::reference().unwrap();
        let (id, joint) = (shown::NEAR_FAST, 6);
        let torques = samples.torques(id, 1, joint).unwrap();
        let coulomb = samples.coulomb(id, joint);
        let size = jumps(&coulomb)[0].abs();
        for k in 1..torques.len() {
            let (step, jump) = (torques[k] - torques[k - 1], coulomb[k] - coulomb[k - 1]);
            // Between samples, 2π/4000 apart, the smooth part moves by far less than a jump.
            assert!(
                (step - jump).abs() < size / 20.0,
                "sample {k}: {step} {jump}"
            );
        }
    }
}
