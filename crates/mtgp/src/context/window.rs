//! The density of one joint's next torque given its last few, for every context.

use std::sync::Arc;

use gp_core::Posterior;
use linalg::WindowFactor;

use crate::context::outliers::Outliers;
use crate::error::MtgpError;
use crate::latent::{LatentPredictor, LatentSample};
use crate::prior::{MultiTaskCovariance, TaskRow};

/// One joint of a [`crate::context::ContextTracker`].
///
/// ```text
/// p_s(γ) = p(t_s | x_s, D, the last w torques and their states, c_γ)
/// ```
#[derive(Debug, Clone)]
pub(crate) struct SampleWindow {
    /// Shared by all copies of a tracker.
    predictor: Arc<LatentPredictor>,
    rows: Vec<TaskRow>,
    noise_var: f64,
    outliers: Outliers,
    /// w.
    window: usize,
    /// States of the window and of the next sample, (w + 1,), in a ring.
    samples: Vec<LatentSample>,
    first: usize,
    /// Residuals of the window under each context, (m,).
    factors: Vec<WindowFactor>,
    /// S between the next sample and those of the window, then its own, (w + 1, r, r).
    blocks: Vec<f64>,
    /// The same for one context, (w + 1,).
    covariances: Vec<f64>,
}

impl SampleWindow {
    /// # Errors
    /// As for [`LatentPredictor::new`].
    pub fn new(
        posterior: &Posterior<MultiTaskCovariance>,
        window: usize,
    ) -> Result<Self, MtgpError> {
        let predictor = LatentPredictor::new(posterior)?;
        let rows = posterior.covariance().task().rows();
        let rank = rows.first().map_or(0, |row| row.entries.len());
        Ok(Self {
            samples: vec![predictor.sample(); window + 1],
            factors: vec![WindowFactor::new(window + 1); rows.len()],
            blocks: vec![0.0; (window + 1) * rank * rank],
            covariances: vec![0.0; window + 1],
            noise_var: posterior.noise_std() * posterior.noise_std(),
            outliers: Outliers::NONE,
            predictor: Arc::new(predictor),
            rows,
            window,
            first: 0,
        })
    }

    /// Adds noise to that of the model.
    pub fn add_noise(&mut self, noise_std: f64) {
        self.noise_var += noise_std * noise_std;
    }

    /// Lets torques be off.
    pub fn expect_outliers(&mut self, outliers: Outliers) {
        self.outliers = outliers;
    }

    /// Number of contexts m.
    pub fn n_contexts(&self) -> usize {
        self.rows.len()
    }

    /// Number of covariates d.
    pub fn n_covariates(&self) -> usize {
        self.predictor.n_covariates()
    }

    /// Adds log p_s(γ) of the next torque to `log_densities`, and takes the torque in.
    pub fn push(&mut self, x: &[f64], torque: f64, log_densities: &mut [f64]) {
        self.make_room();
        let held = self.held();
        let place = self.place(held);
        self.predictor.visit(x, &mut self.samples[place]);
        self.fill_blocks(held);

        let size = self.blocks.len() / self.samples.len();
        let mean = &self.samples[place].mean;
        for (context, row) in self.rows.iter().enumerate() {
            for (covariance, block) in
                (self.covariances[..=held].iter_mut()).zip(self.blocks.chunks_exact(size))
            {
                *covariance = quadratic_form(&row.entries, block);
            }
            let residual = torque - row.dot(mean);
            let factor = &mut self.factors[context];
            let (z, std) = factor.append(&self.covariances[..=held], self.noise_var, residual);
            log_densities[context] += self.outliers.log_density(z) - std.ln();
        }
    }

    /// Forgets the last torque again.
    pub fn undo_push(&mut self) {
        for factor in &mut self.factors {
            factor.drop_last();
        }
    }

    /// Forgets the oldest torque if there are more than w.
    fn make_room(&mut self) {
        if self.held() > self.window {
            for factor in &mut self.factors {
                factor.drop_first();
            }
            self.first = self.place(1);
        }
    }

    /// Torques taken in and not forgotten.
    fn held(&self) -> usize {
        self.factors.first().map_or(0, WindowFactor::order)
    }

    /// Where the sample of a given age stands, the oldest being 0.
    fn place(&self, idx: usize) -> usize {
        (self.first + idx) % self.samples.len()
    }

    fn fill_blocks(&mut self, held: usize) {
        let size = self.blocks.len() / self.samples.len();
        let (place, n_places) = (self.place(held), self.samples.len());
        for (idx, block) in self
            .blocks
            .chunks_exact_mut(size)
            .enumerate()
            .take(held + 1)
        {
            let other = &self.samples[(self.first + idx) % n_places];
            self.predictor
                .covariance(&self.samples[place], other, block);
        }
    }
}

/// λᵀSλ
fn quadratic_form(entries: &[f64], block: &[f64]) -> f64 {
    let rows = block.chunks_exact(entries.len());
    let of_row = |(entry, row): (&f64, &[f64])| {
        let products = row.iter().zip(entries);
        entry * products.map(|(s, other)| s * other).sum::<f64>()
    };
    entries.iter().zip(rows).map(of_row).sum()
}
