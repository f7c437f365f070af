//! The squared-exponential term of eq. (5), one length scale per covariate.

use faer::{Mat, MatMut, MatRef};
use linalg::sums::weighted_squares;
use linalg::{Threads, column_mut, column_panels, for_each_column};

use crate::covariance::Covariance;
use crate::error::KernelError;
use crate::params::{ParamLayout, Transform};
use crate::positive::require_positive;
use crate::se_ard::adjoint::{CrossSums, LowerSums};
use crate::se_ard::correlations::{
    BLOCK, Scaled, add_covariances, add_scaled, column_means, correlations, cross_block, products,
};

/// Rows of the Gram matrix that are worked on together: a tile of 256 kB stays in the second cache.
const TILE_ROWS: usize = 512;

/// Covariance of a smooth function.
///
/// ```text
/// c(x, x′) = v² exp(−½ Σ_j ((x_j − x′_j)/l_j)²)
/// ```
/// θ = (`signal_std`, `length_scales[0]`, …): v in target units, l_j in the
/// units of covariate j.
/// # Source
/// Eq. (5), third term; Rasmussen & Williams 2006, eq. (5.1).
#[derive(Debug, Clone, PartialEq)]
pub struct SeArd {
    signal_std: f64,
    length_scales: Vec<f64>,
}

impl SeArd {
    /// The squared-exponential term with signal std v and one length scale per covariate.
    ///
    /// # Errors
    /// [`KernelError::NotPositive`] unless all are finite and above zero.
    pub fn new(signal_std: f64, length_scales: Vec<f64>) -> Result<Self, KernelError> {
        require_positive("signal_std", &[signal_std])?;
        require_positive("length_scales", &length_scales)?;
        Ok(Self {
            signal_std,
            length_scales,
        })
    }

    /// Standard deviation v, in target units.
    pub fn signal_std(&self) -> f64 {
        self.signal_std
    }

    /// Length scales l_j, in the units of each covariate.
    pub fn length_scales(&self) -> &[f64] {
        &self.length_scales
    }

    fn scaled(&self, x: MatRef<'_, f64>, centre: &[f64]) -> Scaled {
        assert_eq!(x.ncols(), self.length_scales.len());
        let mut z = Mat::zeros(x.nrows(), x.ncols());
        let mut sq_norms = vec![0.0; x.nrows()];
        for_each_column(x, |col, column| {
            let (centre, scale) = (centre[col], self.length_scales[col].recip());
            let target = z.col_as_slice_mut(col);
            pulp::Arch::new().dispatch(
                #[inline(always)]
                || {
                    for ((z, sq_norm), x) in target.iter_mut().zip(&mut sq_norms).zip(column) {
                        *z = (x - centre) * scale;
                        *sq_norm += *z * *z;
                    }
                },
            );
        });
        Scaled { z, sq_norms }
    }
}

/// Visits rows `first..` of the correlations with columns `first..first + width`, in tiles.
///
/// `visit` gets the first row of a tile and its correlations; entry (k, k) of the
/// whole is exactly 1.
fn for_each_tile(
    scaled: &Scaled,
    first: usize,
    width: usize,
    mut visit: impl FnMut(usize, MatMut<'_, f64>),
) {
    let n = scaled.sq_norms.len();
    let mut buffer = Mat::zeros(TILE_ROWS.min(n - first), width); // (TILE_ROWS, width)
    for row in (first..n).step_by(TILE_ROWS) {
        let height = TILE_ROWS.min(n - row);
        let mut tile = buffer.as_mut().subrows_mut(0, height);
        let columns = first..first + width;
        correlations(scaled, row..row + height, scaled, columns, tile.as_mut());
        if row == first {
            for k in 0..width {
                // A point's distance to itself is 0, whatever rounding says; NaN is kept.
                if !tile[(k, k)].is_nan() {
                    tile[(k, k)] = 1.0;
                }
            }
        }
        visit(row, tile);
    }
}

impl Covariance for SeArd {
    fn layout(&self) -> ParamLayout {
        ParamLayout::new()
            .with_scalar("signal_std", Transform::Positive)
            .with_vector(
                "length_scales",
                self.length_scales.len(),
                Transform::Positive,
            )
    }

    fn params(&self) -> Vec<f64> {
        let mut theta = vec![self.signal_std];
        theta.extend(&self.length_scales);
        theta
    }

    fn set_params(&mut self, theta: &[f64]) {
        self.signal_std = theta[0];
        self.length_scales.copy_from_slice(&theta[1..]);
    }

    fn add_gram(&self, x: MatRef<'_, f64>, out: MatMut<'_, f64>) {
        assert_eq!((out.nrows(), out.ncols()), (x.nrows(), x.nrows()));
        let signal_var = self.signal_std * self.signal_std;
        let scaled = self.scaled(x, &column_means(x));
        let panels = column_panels(out, BLOCK);
        Threads::at_hand(x.nrows()).for_each(panels, |(first, mut panel)| {
            for_each_tile(&scaled, first, panel.ncols(), |row, mut tile| {
                for k in 0..tile.ncols() {
                    let target = &mut column_mut(&mut panel, k)[row..];
                    add_scaled(target, column_mut(&mut tile, k), signal_var);
                }
            });
        });
    }

    fn add_cross(&self, x1: MatRef<'_, f64>, x2: MatRef<'_, f64>, mut out: MatMut<'_, f64>) {
        assert_eq!((out.nrows(), out.ncols()), (x1.nrows(), x2.nrows()));
        let signal_var = self.signal_std * self.signal_std;
        let (n1, n2) = (x1.nrows(), x2.nrows());
        let centre = column_means(x1);
        let (scaled1, scaled2) = (self.scaled(x1, &centre), self.scaled(x2, &centre));

        let block_size = cross_block(n1);
        let mut buffer = Mat::zeros(n1, block_size.min(n2)); // (n1, block_size)
        for first in (0..n2).step_by(block_size) {
            let width = block_size.min(n2 - first);
            let mut block = buffer.as_mut().subcols_mut(0, width);
            let columns = first..first + width;
            products(&scaled1, 0..n1, &scaled2, columns, block.as_mut());
            for k in 0..width {
                add_covariances(
                    column_mut(&mut block, k),
                    &scaled1.sq_norms,
                    scaled2.sq_norms[first + k],
                    signal_var,
                    column_mut(&mut out, first + k),
                );
            }
        }
    }

    fn add_diag(&self, x: MatRef<'_, f64>, out: &mut [f64]) {
        assert_eq!(out.len(), x.nrows());
        for value in out {
            *value += self.signal_std * self.signal_std;
        }
    }

    /// ```text
    /// W = Q ∘ E with E the correlations, K = v²E
    /// ∂/∂v   tr(QᵀK) = 2v Σ_ab W_ab
    /// ∂/∂l_j tr(QᵀK) = v²/l_j Σ_ab W_ab (z_aj − z_bj)²
    ///                = 2v²/l_j Σ_{a>b} W_ab (z_aj² + z_bj² − 2 z_aj z_bj)
    /// ```
    fn gram_adjoint(&self, x: MatRef<'_, f64>, adjoint: MatRef<'_, f64>, gradient: &mut [f64]) {
        let (n, d) = (x.nrows(), x.ncols());
        assert_eq!((adjoint.nrows(), adjoint.ncols()), (n, n));
        assert_eq!(gradient.len(), 1 + d);
        let scaled = self.scaled(x, &column_means(x));
        let starts = (0..n).step_by(BLOCK).collect();
        let parts = Threads::at_hand(n).map(starts, |first| {
            let mut sums = LowerSums::new(n, d, first);
            for_each_tile(&scaled, first, BLOCK.min(n - first), |row, tile| {
                sums.add_tile(&scaled.z, adjoint, row, tile);
            });
            sums
        });
        let sums = LowerSums::total(n, d, &parts);

        let signal_var = self.signal_std * self.signal_std;
        gradient[0] += 2.0 * self.signal_std * (sums.diagonal + 2.0 * sums.below);
        for (j, length_scale) in self.length_scales.iter().enumerate() {
            let squares = weighted_squares(scaled.z.col_as_slice(j), &sums.weights);
            gradient[1 + j] += 2.0 * signal_var / length_scale * (squares - 2.0 * sums.products[j]);
        }
    }

    /// ```text
    /// W = Q ∘ E
    /// Σ_ab Q_ab ∂c_ab/∂l_j = v²/l_j Σ_ab W_ab (z1_aj − z2_bj)²
    /// ```
    fn cross_adjoint(
        &self,
        x1: MatRef<'_, f64>,
        x2: MatRef<'_, f64>,
        adjoint: MatRef<'_, f64>,
        gradient: &mut [f64],
    ) {
        assert_eq!((adjoint.nrows(), adjoint.ncols()), (x1.nrows(), x2.nrows()));
        assert_eq!(gradient.len(), 1 + x1.ncols());
        let centre = column_means(x1);
        let (scaled1, scaled2) = (self.scaled(x1, &centre), self.scaled(x2, &centre));
        let sums = CrossSums::new(&scaled1, &scaled2, adjoint);

        let signal_var = self.signal_std * self.signal_std;
        gradient[0] += 2.0 * self.signal_std * sums.total;
        for (j, length_scale) in self.length_scales.iter().enumerate() {
            gradient[1 + j] += signal_var / length_scale * sums.squares[j];
        }
    }
}
