//! A motion to be followed, at any time between its samples.

use crate::error::DynError;

/// Positions, speeds and accelerations of all joints at one time.
#[derive(Debug, Clone, PartialEq)]
pub struct JointState {
    /// (n_joints,), rad or m.
    pub q: Vec<f64>,
    /// (n_joints,), rad/s or m/s.
    pub qd: Vec<f64>,
    /// (n_joints,), rad/s² or m/s².
    pub qdd: Vec<f64>,
}

impl JointState {
    /// All joints at rest at zero.
    pub fn zero(n_joints: usize) -> Self {
        let zeros = || vec![0.0; n_joints];
        Self {
            q: zeros(),
            qd: zeros(),
            qdd: zeros(),
        }
    }
}

/// A sampled motion, joined by polynomials of degree five that have the samples' positions, speeds
/// and accelerations at both ends.
///
/// ```text
/// q(s) = Σ_k c_k s^k,   s = (t − t_k) / (t_{k+1} − t_k)
/// ```
/// # Source
/// Biagiotti & Melchiorri 2008, *Trajectory Planning for Automatic Machines and Robots*, sec. 2.1.7.
#[derive(Debug, Clone, PartialEq)]
pub struct ReferenceMotion {
    n_joints: usize,
    time: Vec<f64>,
    states: Vec<f64>,
}

impl ReferenceMotion {
    /// A motion from its samples.
    ///
    /// # Shapes
    /// `time` (n,), s; `states` (n, 3 n_joints) row after row: q, qd, qdd.
    /// # Errors
    /// [`DynError::Reference`] for fewer than two samples, times that do not ascend, numbers that are
    /// not finite, or another number of states.
    pub fn new(n_joints: usize, time: Vec<f64>, states: Vec<f64>) -> Result<Self, DynError> {
        let refuse = |reason: String| Err(DynError::Reference { reason });
        let (n, n_numbers) = (time.len(), states.len());
        if n_joints == 0 || n < 2 {
            return refuse(format!(
                "{n} samples of {n_joints} joints; two samples of one joint are the least"
            ));
        }
        if n_numbers != n * 3 * n_joints {
            return refuse(format!(
                "{n_numbers} numbers for {n} samples of {n_joints} joints"
            ));
        }
        let is_bad =
            |pair: &[f64]| !(pair[0].is_finite() && pair[1].is_finite()) || pair[1] <= pair[0];
        if let Some(idx) = time.windows(2).position(is_bad) {
            return refuse(format!(
                "times must ascend, but sample {} is at {} s and sample {} at {} s",
                idx + 1,
                time[idx],
                idx + 2,
                time[idx + 1]
            ));
        }
        if let Some(idx) = states.iter().position(|value| !value.is_finite()) {
            let (sample, value) = (idx / (3 * n_joints) + 1, states[idx]);
            return refuse(format!("sample {sample} has the number {value}"));
        }
        Ok(Self {
            n_joints,
            time,
            states,
        })
    }

    /// Number of joints.
    pub fn n_joints(&self) -> usize {
        self.n_joints
    }

    /// Time of the first sample, s.
    pub fn start(&self) -> f64 {
        self.time[0]
    }

    /// Time from the first to the last sample, s.
    pub fn duration(&self) -> f64 {
        self.time[self.time.len() - 1] - self.time[0]
    }

    /// The state at a time since the first sample; before and after the samples, at their ends.
    ///
    /// Allocates nothing.
    /// # Panics
    /// If `state` has another number of joints.
    pub fn at(&self, elapsed: f64, state: &mut JointState) {
        let n = self.n_joints;
        let time = self.time[0] + elapsed.clamp(0.0, self.duration());
        let after = self.time.partition_point(|sample| *sample <= time);
        let idx = after.clamp(1, self.time.len() - 1) - 1;
        let length = self.time[idx + 1] - self.time[idx];
        let s = (time - self.time[idx]) / length;
        let row = |idx: usize| &self.states[idx * 3 * n..(idx + 1) * 3 * n];
        let (from, to) = (row(idx), row(idx + 1));
        for joint in 0..n {
            let end = |row: &[f64]| [row[joint], row[n + joint], row[2 * n + joint]];
            let [q, qd, qdd] = quintic(end(from), end(to), length, s);
            (state.q[joint], state.qd[joint], state.qdd[joint]) = (q, qd, qdd);
        }
    }
}

/// Value and derivatives at `s` in [0, 1] of the polynomial with given value and derivatives at both ends.
fn quintic([p0, v0, a0]: [f64; 3], [p1, v1, a1]: [f64; 3], h: f64, s: f64) -> [f64; 3] {
    let (v0, v1, a0, a1) = (h * v0, h * v1, h * h * a0, h * h * a1);
    let rise = p1 - p0;
    let c2 = 0.5 * a0;
    let c3 = 10.0 * rise - 6.0 * v0 - 4.0 * v1 - 1.5 * a0 + 0.5 * a1;
    let c4 = -15.0 * rise + 8.0 * v0 + 7.0 * v1 + 1.5 * a0 - a1;
    let c5 = 6.0 * rise - 3.0 * (v0 + v1) - 0.5 * (a0 - a1);
    let q = p0 + s * (v0 + s * (c2 + s * (c3 + s * (c4 + s * c5))));
    let qd = v0 + s * (2.0 * c2 + s * (3.0 * c3 + s * (4.0 * c4 + s * 5.0 * c5)));
    let qdd = 2.0 * c2 + s * (6.0 * c3 + s * (12.0 * c4 + s * 20.0 * c5));
    [q, qd / h, qdd / (h * h)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polynomial_of_degree_five_comes_back() {
        // q = t⁵ − 2t³ + 4 over samples at 0, 0.5 and 2.
        let sample = |t: f64| {
            let q = t.powi(5) - 2.0 * t.powi(3) + 4.0;
            let qd = 5.0 * t.powi(4) - 6.0 * t * t;
            [q, qd, 20.0 * t.powi(3) - 12.0 * t]
        };
        let time = vec![0.0, 0.5, 2.0];
        let states = time.iter().flat_map(|t| sample(*t)).collect();
        let motion = ReferenceMotion::new(1, time, states).unwrap();
        let mut state = JointState::zero(1);
        for t in [0.0, 0.2, 0.5, 0.9, 1.7, 2.0] {
            motion.at(t, &mut state);
            let found = [state.q[0], state.qd[0], state.qdd[0]];
            for (found, expected) in found.iter().zip(sample(t)) {
                // Largest coefficient 15·24, some ten operations.
                let tolerance = 1e4 * f64::EPSILON * (1.0 + expected.abs());
                assert!(
                    (found - expected).abs() < tolerance,
                    "{t}: {found} {expected}"
                );
            }
        }
    }

    #[test]
    fn samples_that_are_no_motion_are_refused_with_their_place() {
        let refused = |time: &[f64], states: &[f64]| {
            ReferenceMotion::new(1, time.to_vec(), states.to_vec())
                .unwrap_err()
                .to_string()
        };
        assert!(refused(&[0.0], &[0.0; 3]).contains("two samples"));
        assert!(refused(&[0.0, 1.0], &[0.0; 5]).contains("5 numbers"));
        let twice = refused(&[0.0, 1.0, 1.0], &[0.0; 9]);
        assert!(
            twice.contains("sample 2 is at 1 s and sample 3 at 1 s"),
            "{twice}"
        );
        let mut states = [0.0; 6];
        states[4] = f64::NAN;
        assert!(refused(&[0.0, 1.0], &states).contains("sample 2 has the number NaN"));
    }
}
