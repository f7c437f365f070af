//! Noise of a joint's torque: its scale, its profile over speed, and rows per independent row.
//!
//! ```text
//! ε ~ N(0, σ² h(q̇)²),   h constant on edge_i ≤ |q̇| < edge_{i+1}
//! ```

/// Edges of the profile's bins, rad/s; the last one has no end.
pub const SPEED_EDGES: [f64; 7] = [0.0, 0.01, 0.03, 0.06, 0.1, 0.3, 1.0];

/// Number of bins of the profile.
pub const N_BINS: usize = SPEED_EDGES.len();

/// Runs in which h = 1 that every bin has beside its own.
const PSEUDO_RUNS: f64 = 5.0;

/// Noise of one joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointNoise {
    /// σ, N·m.
    pub std: f64,
    /// h of each bin of |q̇|.
    pub profile: [f64; N_BINS],
    /// c: rows that tell as much as one independent row.
    pub correlation: f64,
}

impl JointNoise {
    /// Independent rows, the same at all speeds.
    pub fn white(std: f64) -> Self {
        Self {
            std,
            profile: [1.0; N_BINS],
            correlation: 1.0,
        }
    }

    /// Standard deviation of a measurement at a speed, N·m.
    #[inline]
    pub fn std_at(&self, qd: f64) -> f64 {
        self.std * self.profile[bin_of(qd)]
    }

    /// Its square, N²·m².
    #[inline]
    pub fn var_at(&self, qd: f64) -> f64 {
        self.std_at(qd).powi(2)
    }

    /// Variance of a row among rows `spacing` steps of the training data apart, inflated for what they share.
    ///
    /// ```text
    /// max(1, c/g) σ² h²
    /// ```
    pub fn weighted_var_at(&self, qd: f64, spacing: f64) -> f64 {
        (self.correlation / spacing).max(1.0) * self.var_at(qd)
    }
}

/// The bin of a speed.
#[inline]
pub fn bin_of(qd: f64) -> usize {
    let speed = qd.abs();
    let above = SPEED_EDGES[1..].iter().take_while(|edge| speed >= **edge);
    above.count()
}

/// Sums of squares in each bin, of one run.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct BinSquares {
    squares: [f64; N_BINS],
    counts: [usize; N_BINS],
}

impl BinSquares {
    pub fn add(&mut self, residual: f64, qd: f64) {
        let bin = bin_of(qd);
        self.squares[bin] += residual * residual;
        self.counts[bin] += 1;
    }
}

/// σ and h of the residuals of some runs; `None` without a residual.
///
/// ```text
/// σ² = mean e²,   h_i² = (Σ_r x_r + 5)/(number of runs with rows in bin i + 5),   x_r = mean_r,i e²/σ²
/// ```
/// A mean over runs, so that one run at one speed does not rule its bin; a bin without rows has h = 1.
pub(crate) fn profile(runs: &[BinSquares]) -> Option<(f64, [f64; N_BINS])> {
    let count: usize = runs.iter().flat_map(|run| run.counts).sum();
    if count == 0 {
        return None;
    }
    let total: f64 = runs.iter().flat_map(|run| run.squares).sum();
    let var = total / count as f64;
    if var <= 0.0 {
        return Some((0.0, [1.0; N_BINS]));
    }
    let of_bin = |bin: usize| {
        let seen = runs.iter().filter(|run| run.counts[bin] > 0);
        let ratios = seen.map(|run| run.squares[bin] / run.counts[bin] as f64 / var);
        let (sum, n) = ratios.fold((0.0, 0.0), |(sum, n), ratio| (sum + ratio, n + 1.0));
        ((sum + PSEUDO_RUNS) / (n + PSEUDO_RUNS)).sqrt()
    };
    Some((var.sqrt(), std::array::from_fn(of_bin)))
}
