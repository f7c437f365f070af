//! Noise of measured torques: stationary, and correlated over a time.
//!
//! ```text
//! n_0 = s ε_0,   n_k = ρ n_{k−1} + s √(1 − ρ²) ε_k,   ρ = exp(−(t_k − t_{k−1})/T),   ε standard normal
//! ```
//! This is the Ornstein–Uhlenbeck process of standard deviation s and correlation time T at any times t_k:
//! cov(n_j, n_k) = s² exp(−|t_j − t_k|/T). With T = 0 it is white.
//!
//! # Source
//! Gillespie 1996, "Exact numerical simulation of the Ornstein–Uhlenbeck process and its integral"; Box & Muller
//! 1958, "A note on the generation of random normal deviates".

use std::f64::consts::TAU;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use crate::dynamics::check::check_len;
use crate::error::DynError;
use crate::robot::validate::finite_not_negative;

/// Noise of the torques of all joints, independent of each other.
#[derive(Debug, Clone, PartialEq)]
pub struct TorqueNoise {
    std: Vec<f64>,
    correlation_time: f64,
}

impl TorqueNoise {
    /// Noise of standard deviation `std` (n_joints,), N·m or N, and correlation time T, s.
    ///
    /// # Errors
    /// [`DynError::NonFinite`] or [`DynError::OutOfRange`] for a number that is negative or not finite, with the
    /// number of its joint.
    pub fn new(std: Vec<f64>, correlation_time: f64) -> Result<Self, DynError> {
        for (number, std) in (1..).zip(&std) {
            let joint = i32::to_string(&number);
            finite_not_negative("noise of joint", &joint, "standard deviation", *std)?;
        }
        finite_not_negative("noise", "torque", "correlation time", correlation_time)?;
        Ok(Self {
            std,
            correlation_time,
        })
    }

    /// Adds the noise of a run to its torques; the same for the same seed and label, whatever else is drawn.
    ///
    /// # Shapes
    /// `time` (n,), s, ascending; `torques` (n, n_joints) row after row, N·m or N.
    ///
    /// # Panics
    /// If `torques` has another length.
    pub fn add(&self, seed: u64, label: &str, time: &[f64], torques: &mut [f64]) {
        let n_joints = self.std.len();
        check_len("torques", torques, time.len() * n_joints);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(stream_of(label));
        let mut noise = vec![0.0; n_joints];
        for (idx, row) in torques.chunks_exact_mut(n_joints.max(1)).enumerate() {
            let (kept, fresh) = match idx.checked_sub(1) {
                Some(before) => self.shares(time[idx] - time[before]),
                None => (0.0, 1.0),
            };
            for ((tau, noise), std) in row.iter_mut().zip(&mut noise).zip(&self.std) {
                *noise = kept * *noise + fresh * std * normal(&mut rng);
                *tau += *noise;
            }
        }
    }

    /// ρ and √(1 − ρ²) of a step.
    fn shares(&self, step: f64) -> (f64, f64) {
        if self.correlation_time > 0.0 {
            let lag = step / self.correlation_time;
            ((-lag).exp(), (-(-2.0 * lag).exp_m1()).sqrt())
        } else {
            (0.0, 1.0)
        }
    }
}

/// FNV-1a of a label, 64 bits.
///
/// # Source
/// Fowler, Noll & Vo, *The FNV Non-Cryptographic Hash Algorithm*, for its two constants.
fn stream_of(label: &str) -> u64 {
    let offset_basis = 0xcbf2_9ce4_8422_2325;
    label.bytes().fold(offset_basis, |hash: u64, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    })
}

/// A standard normal number.
fn normal(rng: &mut ChaCha8Rng) -> f64 {
    // 53 bits in the middles of their intervals: never 0 or 1.
    let mut uniform = || ((rng.next_u64() >> 11) as f64 + 0.5) / (1_u64 << 53) as f64;
    (-2.0 * uniform().ln()).sqrt() * (TAU * uniform()).cos()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(noise: &TorqueNoise, seed: u64, label: &str, time: &[f64]) -> Vec<f64> {
        let mut torques = vec![0.0; time.len() * noise.std.len()];
        noise.add(seed, label, time, &mut torques);
        torques
    }

    fn covariance(values: &[f64], lag: usize) -> f64 {
        let pairs = values.iter().zip(&values[lag..]);
        pairs.map(|(a, b)| a * b).sum::<f64>() / (values.len() - lag) as f64
    }

    #[test]
    fn covariances_are_those_of_the_process() {
        let n = 200_000;
        let time: Vec<f64> = (0..n).map(|k| 0.01 * f64::from(k)).collect();
        for (correlation, n_effective) in [(0.0, 2e5), (0.05, 4e4)] {
            let noise = TorqueNoise::new(vec![2.0, 0.5], correlation).unwrap();
            let values = drawn(&noise, 3, "run", &time);
            for (joint, std) in [(0, 2.0), (1, 0.5)] {
                let of_joint: Vec<f64> = values.iter().skip(joint).step_by(2).copied().collect();
                for lag in [0_u32, 1, 5, 20] {
                    let exact = if correlation > 0.0 {
                        std * std * (-f64::from(lag) * 0.01 / correlation).exp()
                    } else {
                        std * std * f64::from(u32::from(lag == 0))
                    };
                    let found = covariance(&of_joint, lag as usize);
                    // Five standard errors √(2/n) of a variance, n the number of independent draws.
                    let tolerance = 5.0 * std * std * (2.0_f64 / n_effective).sqrt();
                    assert!((found - exact).abs() < tolerance, "{lag}: {found} {exact}");
                }
            }
            let across: f64 = values.chunks(2).map(|pair| pair[0] * pair[1]).sum();
            assert!((across / f64::from(n)).abs() < 5.0 / f64::sqrt(n_effective));
        }
    }

    #[test]
    fn uneven_steps_keep_the_variance_and_forget_by_their_length() {
        // n_1 after a step of T/2: its covariance with n_0 over many runs.
        let noise = TorqueNoise::new(vec![1.0], 0.4).unwrap();
        let runs = (0..40_000_u64).map(|seed| drawn(&noise, seed, "", &[0.0, 0.2, 3.2]));
        let mut sums = [0.0; 3];
        for run in runs {
            sums[0] += run[0] * run[1];
            sums[1] += run[1] * run[1];
            sums[2] += run[2] * run[2];
        }
        for (sum, exact) in sums.iter().zip([(-0.5_f64).exp(), 1.0, 1.0]) {
            assert!(
                (sum / 4e4 - exact).abs() < 5.0 * (2.0_f64 / 4e4).sqrt(),
                "{sum} {exact}"
            );
        }
    }

    #[test]
    fn seed_and_label_make_the_noise() {
        let noise = TorqueNoise::new(vec![1.0], 0.1).unwrap();
        let time = [0.0, 0.1, 0.2];
        let first = drawn(&noise, 1, "c1/p1_s1", &time);
        assert_eq!(first, drawn(&noise, 1, "c1/p1_s1", &time));
        assert_ne!(first, drawn(&noise, 2, "c1/p1_s1", &time));
        assert_ne!(first, drawn(&noise, 1, "c2/p1_s1", &time));
        // The published hash of "a".
        assert_eq!(stream_of("a"), 0xaf63_dc4c_8601_ec8c);
    }

    #[test]
    fn numbers_that_no_noise_has_are_refused() {
        let message = |std, time| {
            TorqueNoise::new(vec![1.0, std], time)
                .unwrap_err()
                .to_string()
        };
        assert!(message(-1.0, 0.0).contains("`2`: standard deviation is -1"));
        assert!(message(1.0, f64::NAN).contains("correlation time is NaN"));
    }
}
