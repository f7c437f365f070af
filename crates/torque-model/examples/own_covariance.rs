//! A covariance of one's own: torques that repeat with every turn of a joint, learned like any other.
//!
//! ```text
//! cargo run --release -p torque-model --example own_covariance
//! ```
#![expect(clippy::print_stdout, reason = "an example shows what it found")]

use std::error::Error;

use faer::{Mat, MatMut, MatRef};
use gp_core::FitOptions;
use gp_core::fit::fit_covariance;
use gp_core::search::Start;
use kernels::{Covariance, ParamLayout, Transform};

/// c(x, x′) = v² cos(x₀ − x′₀): the functions a cos x₀ + b sin x₀, such as gravity's torque on a pendulum.
#[derive(Debug, Clone)]
struct Pendulum {
    std: f64,
}

impl Pendulum {
    fn at(x1: MatRef<'_, f64>, a: usize, x2: MatRef<'_, f64>, b: usize) -> f64 {
        (x1[(a, 0)] - x2[(b, 0)]).cos()
    }
}

impl Covariance for Pendulum {
    fn layout(&self) -> ParamLayout {
        ParamLayout::new().with_scalar("std", Transform::Positive)
    }

    fn params(&self) -> Vec<f64> {
        vec![self.std]
    }

    fn set_params(&mut self, theta: &[f64]) {
        self.std = theta[0];
    }

    fn add_gram(&self, x: MatRef<'_, f64>, out: MatMut<'_, f64>) {
        self.add_cross(x, x, out);
    }

    fn add_cross(&self, x1: MatRef<'_, f64>, x2: MatRef<'_, f64>, mut out: MatMut<'_, f64>) {
        for b in 0..x2.nrows() {
            for a in 0..x1.nrows() {
                out[(a, b)] += self.std * self.std * Self::at(x1, a, x2, b);
            }
        }
    }

    fn add_diag(&self, _x: MatRef<'_, f64>, out: &mut [f64]) {
        for var in out {
            *var += self.std * self.std;
        }
    }

    fn gram_adjoint(&self, x: MatRef<'_, f64>, adjoint: MatRef<'_, f64>, gradient: &mut [f64]) {
        // Only the lower triangle of Q is there; the upper one counts as much.
        for b in 0..x.nrows() {
            for a in b..x.nrows() {
                let weight = if a == b { 1.0 } else { 2.0 };
                gradient[0] += weight * adjoint[(a, b)] * 2.0 * self.std * Self::at(x, a, x, b);
            }
        }
    }

    fn cross_adjoint(
        &self,
        x1: MatRef<'_, f64>,
        x2: MatRef<'_, f64>,
        adjoint: MatRef<'_, f64>,
        gradient: &mut [f64],
    ) {
        for b in 0..x2.nrows() {
            for a in 0..x1.nrows() {
                gradient[0] += adjoint[(a, b)] * 2.0 * self.std * Self::at(x1, a, x2, b);
            }
        }
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    // Torques of a pendulum of 2 kg and 0.3 m, with a little of something else, within half a turn.
    let x = Mat::from_fn(30, 1, |row, _| -1.5 + 0.1 * row as f64);
    let torque = |q: f64| 2.0 * 9.81 * 0.3 * q.sin();
    let targets: Vec<f64> = (0..30)
        .map(|row| torque(x[(row, 0)]) + 0.02 * (7.0 * row as f64).sin())
        .collect();
    let starts = [Start::given(Pendulum { std: 1.0 }, 0.1)];
    let fit = fit_covariance(x.as_ref(), &targets, &starts, &FitOptions::chapter())?;
    println!(
        "v {:.3} N·m, σ {:.4} N·m",
        fit.covariance().std,
        fit.noise_std()
    );

    let elsewhere = Mat::from_fn(4, 1, |row, _| 2.0 + row as f64);
    let found = fit.posterior.predict(elsewhere.as_ref())?;
    println!("     q   true N·m  found N·m      ± N·m");
    for (row, (mean, var)) in found.mean.iter().zip(&found.var).enumerate() {
        let q = elsewhere[(row, 0)];
        println!("{q:6.2} {:10.4} {mean:10.4} {:10.4}", torque(q), var.sqrt());
    }
    Ok(())
}
