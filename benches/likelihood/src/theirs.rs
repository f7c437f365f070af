//! gprx 0.2 on the part of the model that it can express.
//!
//! Its linear kernel has one weight for all covariates and its custom kernels see distances only, so
//! neither the linear nor the Coulomb term of eq. (7) can be had; bias + squared exponential with a length
//! scale per covariate + noise can. Its storage, distance cache and `exp` are its defaults.

use std::collections::BTreeMap;
use std::time::Instant;

use anyhow::{Result, anyhow, ensure};
use gprx::kernel::{ConstantKernel, KernelSpec, RbfArdKernel};
use gprx::{FittedGpr, Fixed, GaussianLikelihood, Gpr, Interval};

use crate::contestant::{Answer, Contestant};
use crate::data::Samples;
use crate::hyperparameters::Hyperparameters;

/// An exact model of gprx, whose θ holds log v², log l, log b², log σ².
pub struct Gprx {
    fitted: FittedGpr<Fixed>,
    n: usize,
}

impl Gprx {
    pub fn new(samples: &Samples, at: &Hyperparameters) -> Result<Self> {
        ensure!(
            at.has_only_smooth_part(),
            "gprx has no linear kernel with a weight per covariate"
        );
        let (n, d) = (samples.x.nrows(), samples.x.ncols());
        let by_column: Vec<f64> = (0..d)
            .flat_map(|column| (0..n).map(move |row| samples.x[(row, column)]))
            .collect();
        let kernel = constant(at.signal_std)? * RbfArdKernel::new(&at.length_scales)?.into()
            + constant(at.bias_std)?;
        let fitted = Gpr::new(kernel, GaussianLikelihood::new(at.noise_std.powi(2))?)
            .with_optimizer(Fixed)
            .factor(&by_column, n, d, &samples.targets)
            .map_err(|(_, error)| anyhow!("{error}"))?;
        Ok(Self { fitted, n })
    }
}

/// A variance that is not held inside the crate's default interval.
fn constant(std: f64) -> Result<KernelSpec> {
    let anywhere = Interval::new(1e-30, 1e30).map_err(|error| anyhow!("{error}"))?;
    let one = ConstantKernel::new(1.0)?.with_bounds(anywhere);
    let mut constant = one.map_err(|error| anyhow!("{error}"))?;
    constant.set_params(&[2.0 * std.ln()])?;
    Ok(constant.into())
}

impl Contestant for Gprx {
    fn evaluate(&mut self, at: &Hyperparameters) -> Result<Answer> {
        let log_square = |std: f64| 2.0 * std.ln();
        let mut theta = vec![log_square(at.signal_std)];
        theta.extend(at.length_scales.iter().map(|scale| scale.ln()));
        theta.extend([log_square(at.bias_std), log_square(at.noise_std)]);
        ensure!(self.fitted.num_params() == theta.len());
        let mut gradient = vec![0.0; theta.len()];

        let clock = Instant::now();
        let negative = self.fitted.value_and_gradient_into(&theta, &mut gradient)?;
        let seconds = clock.elapsed().as_secs_f64();

        let d = at.length_scales.len();
        // dL/dσ = 2/σ dL/d log σ², dL/dl = 1/l dL/d log l; gprx minimises −L.
        let of_std = |component: f64, std: f64| vec![-2.0 * component / std];
        let of_scales = gradient[1..=d].iter().zip(&at.length_scales);
        let named = [
            ("signal_std", of_std(gradient[0], at.signal_std)),
            ("length_scales", of_scales.map(|(g, l)| -g / l).collect()),
            ("bias_std", of_std(gradient[d + 1], at.bias_std)),
            ("noise_std", of_std(gradient[d + 2], at.noise_std)),
        ];
        Ok(Answer {
            seconds,
            value: -negative,
            error_bound: None,
            rank: self.n,
            gradient: BTreeMap::from(named.map(|(name, values)| (name.to_owned(), values))),
        })
    }
}
