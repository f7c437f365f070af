//! What came of a run, joint by joint.

use puma_dyn::motion::{CompositeController, Tick};
use serde::Serialize;

use crate::text_table;

/// Sums along a run.
pub struct Tally {
    joints: Vec<Sums>,
    n: f64,
}

#[derive(Clone, Default)]
struct Sums {
    errors: f64,
    largest: f64,
    torques: f64,
    corrective: f64,
}

/// The whole run.
#[derive(Serialize)]
pub struct Summary {
    /// Number of ticks.
    ticks: f64,
    joints: Vec<Joint>,
}

/// One joint; rad and N·m, or m and N if it slides.
#[allow(
    clippy::struct_field_names,
    reason = "the names are those of the JSON summary"
)]
#[derive(Serialize)]
struct Joint {
    #[serde(rename = "joint")]
    name: String,
    kp: f64,
    kd: f64,
    rms_error: f64,
    largest_error: f64,
    rms_torque: f64,
    corrective_share: f64,
}

impl Tally {
    /// Before the first tick.
    pub fn new(n_joints: usize) -> Self {
        Self {
            joints: vec![Sums::default(); n_joints],
            n: 0.0,
        }
    }

    /// Takes a tick in.
    pub fn add(&mut self, tick: &Tick<'_>) {
        self.n += 1.0;
        for (joint, sums) in self.joints.iter_mut().enumerate() {
            let error = tick.desired.q[joint] - tick.q[joint];
            let corrective = tick.tau[joint] - tick.feed_forward[joint];
            sums.errors += error * error;
            sums.largest = sums.largest.max(error.abs());
            sums.torques += tick.tau[joint] * tick.tau[joint];
            sums.corrective += corrective * corrective;
        }
    }

    /// The result.
    pub fn summary(&self, names: &[String], controller: &CompositeController) -> Summary {
        let gains = controller.stiffness().iter().zip(controller.damping());
        let joints = names.iter().zip(&self.joints).zip(gains);
        let share = |sums: &Sums| {
            if sums.torques > 0.0 {
                (sums.corrective / sums.torques).sqrt()
            } else {
                0.0
            }
        };
        Summary {
            ticks: self.n,
            joints: joints
                .map(|((name, sums), (kp, kd))| Joint {
                    name: name.clone(),
                    kp: *kp,
                    kd: *kd,
                    rms_error: (sums.errors / self.n).sqrt(),
                    largest_error: sums.largest,
                    rms_torque: (sums.torques / self.n).sqrt(),
                    corrective_share: share(sums),
                })
                .collect(),
        }
    }
}

impl Summary {
    /// A table for people.
    pub fn to_text(&self) -> String {
        let header = [
            "joint",
            "Kp (N·m/rad)",
            "Kd (N·m·s/rad)",
            "RMS error (mrad)",
            "largest (mrad)",
            "RMS torque (N·m)",
            "corrective",
        ];
        let row = |joint: &Joint| {
            vec![
                joint.name.clone(),
                format!("{:.2}", joint.kp),
                format!("{:.3}", joint.kd),
                format!("{:.4}", 1e3 * joint.rms_error),
                format!("{:.4}", 1e3 * joint.largest_error),
                format!("{:.3}", joint.rms_torque),
                format!("{:.2} %", 1e2 * joint.corrective_share),
            ]
        };
        let rows: Vec<Vec<String>> = self.joints.iter().map(row).collect();
        text_table::render(&header, &rows)
    }
}
