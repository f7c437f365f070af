//! Affine coordinates in which a density is about as wide in all directions.

use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::{Mat, MatRef};
use linalg::{SymmetricEigen, product, symmetric_eigen};

use super::log_density::LogDensity;
use crate::error::GpError;

/// Draws that the frame at hand counts as when it is refined.
const DRAWS_OF_OLD_FRAME: f64 = 30.0;

/// Coordinates y of a space of points z.
///
/// ```text
/// z = c + A y
/// ```
/// # Shapes
/// `centre` c (d,), `axes` A (d, d).
#[derive(Debug, Clone)]
pub(crate) struct Frame {
    centre: Vec<f64>,
    axes: Mat<f64>,
}

impl Frame {
    /// The frame with a centre and the image A y of every y.
    pub fn new(centre: Vec<f64>, image: impl Fn(&[f64]) -> Vec<f64>) -> Self {
        let d = centre.len();
        let mut axes = Mat::zeros(d, d);
        for col in 0..d {
            let mut unit = vec![0.0; d];
            unit[col] = 1.0;
            axes.col_as_slice_mut(col).copy_from_slice(&image(&unit));
        }
        Self { centre, axes }
    }

    /// z of y.
    pub fn outer(&self, y: &[f64]) -> Vec<f64> {
        let step = product(self.axes.as_ref(), column(y));
        let step = step.col_as_slice(0);
        self.centre.iter().zip(step).map(|(c, s)| c + s).collect()
    }

    /// y of z.
    pub fn inner(&self, z: &[f64]) -> Vec<f64> {
        let step: Vec<f64> = z.iter().zip(&self.centre).map(|(z, c)| z - c).collect();
        let y = PartialPivLu::new(self.axes.as_ref()).solve(column(&step));
        y.col_as_slice(0).to_vec()
    }

    /// Aᵀ g: a gradient by z becomes that by y.
    fn pull_back(&self, gradient: &mut [f64]) {
        let by_y = product(self.axes.transpose(), column(gradient));
        gradient.copy_from_slice(by_y.col_as_slice(0));
    }

    /// The frame about the mean of some draws, and with their width.
    ///
    /// ```text
    /// A′ = A M^½,   M C_g M = C_y
    /// ```
    /// C_y is the covariance of the draws in the coordinates y, C_g that of the gradients of the log
    /// density there, both with a few draws' weight for I.
    /// Of a normal density either alone would tell the width; of others, M is the one that brings the
    /// gradients nearest to those of a normal density, and takes half as many draws.
    /// The frame stays as it is if a draw is not finite.
    /// # Shapes
    /// `draws` y and `gradients` (n, d), one per row.
    /// # Source
    /// Seyboldt, Carlson & Carpenter 2024, "Preconditioning Hamiltonian Monte Carlo by minimizing
    /// Fisher divergence".
    pub fn refined(&self, draws: MatRef<'_, f64>, gradients: MatRef<'_, f64>) -> Self {
        let of_draws = regularised_covariance(draws);
        let of_gradients = regularised_covariance(gradients);
        let Some(root) = geometric_mean_root(of_draws.as_ref(), of_gradients.as_ref()) else {
            return self.clone();
        };
        Self {
            centre: self.outer(&column_means(draws)),
            axes: product(self.axes.as_ref(), root.as_ref()),
        }
    }
}

/// A density in the coordinates y.
pub(crate) struct Framed<'a, D> {
    pub density: &'a mut D,
    pub frame: &'a Frame,
}

impl<D: LogDensity> LogDensity for Framed<'_, D> {
    fn dimension(&self) -> usize {
        self.frame.centre.len()
    }

    fn evaluate(&mut self, y: &[f64], gradient: &mut [f64]) -> Result<f64, GpError> {
        let value = self.density.evaluate(&self.frame.outer(y), gradient)?;
        self.frame.pull_back(gradient);
        Ok(value)
    }
}

fn column(values: &[f64]) -> MatRef<'_, f64> {
    MatRef::from_column_major_slice(values, values.len(), 1)
}

fn column_means(rows: MatRef<'_, f64>) -> Vec<f64> {
    let n = rows.nrows() as f64;
    rows.col_iter()
        .map(|col| col.iter().sum::<f64>() / n)
        .collect()
}

/// (Σ (v − v̄)(v − v̄)ᵀ + k I)/(n + k) over the rows v.
fn regularised_covariance(rows: MatRef<'_, f64>) -> Mat<f64> {
    let means = column_means(rows);
    let centred = Mat::from_fn(rows.nrows(), rows.ncols(), |row, col| {
        rows[(row, col)] - means[col]
    });
    let mut sum = product(centred.transpose(), centred.as_ref());
    for idx in 0..sum.ncols() {
        sum[(idx, idx)] += DRAWS_OF_OLD_FRAME;
    }
    let weight = (rows.nrows() as f64 + DRAWS_OF_OLD_FRAME).recip();
    Mat::from_fn(sum.nrows(), sum.ncols(), |row, col| {
        weight * sum[(row, col)]
    })
}

/// M^½ of the M with M C_g M = C_y, the geometric mean of C_y and C_g⁻¹.
///
/// ```text
/// M = C_g^−½ (C_g^½ C_y C_g^½)^½ C_g^−½
/// ```
fn geometric_mean_root(of_y: MatRef<'_, f64>, of_g: MatRef<'_, f64>) -> Option<Mat<f64>> {
    let root = power(of_g, 0.5)?;
    let inverse_root = power(of_g, -0.5)?;
    let between = product(product(root.as_ref(), of_y).as_ref(), root.as_ref());
    let middle = power(between.as_ref(), 0.5)?;
    let mean = product(inverse_root.as_ref(), middle.as_ref());
    power(product(mean.as_ref(), inverse_root.as_ref()).as_ref(), 0.5)
}

/// A power of a positive definite matrix by its eigenvalues; `None` unless it is one.
fn power(matrix: MatRef<'_, f64>, exponent: f64) -> Option<Mat<f64>> {
    let order = matrix.nrows();
    let SymmetricEigen { values, vectors } = symmetric_eigen(matrix).ok()?;
    if values.iter().any(|value| *value <= 0.0) {
        return None;
    }
    let scaled = Mat::from_fn(order, order, |row, col| {
        vectors[(row, col)] * values[col].powf(exponent)
    });
    Some(product(scaled.as_ref(), vectors.transpose()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn geometric_mean_of_commuting_matrices_is_worked_by_hand() {
        // C_y = 9 and C_g = 4 along one axis: M = 3/2 with 3/2 · 4 · 3/2 = 9; along the other M = 1/4.
        let turn = |a: f64, b: f64| {
            let (cos, sin) = (0.6, 0.8);
            let entries = [
                [cos * cos * a + sin * sin * b, cos * sin * (a - b)],
                [cos * sin * (a - b), sin * sin * a + cos * cos * b],
            ];
            Mat::from_fn(2, 2, |row, col| entries[row][col])
        };
        let (of_y, of_g) = (turn(9.0, 0.25), turn(4.0, 4.0));
        let root = geometric_mean_root(of_y.as_ref(), of_g.as_ref()).unwrap();
        let expected = turn(1.5_f64.sqrt(), 0.5);
        for (row, col) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let error = (root[(row, col)] - expected[(row, col)]).abs();
            assert!(error < 64.0 * f64::EPSILON, "{error:e}");
        }
        assert!(geometric_mean_root(turn(1.0, -1.0).as_ref(), of_g.as_ref()).is_none());
    }

    #[test]
    fn coordinates_go_there_and_back() {
        let matrix = [[2.0, 0.5], [-1.0, 3.0]];
        let image = |y: &[f64]| {
            let row = |r: [f64; 2]| r[0] * y[0] + r[1] * y[1];
            vec![row(matrix[0]), row(matrix[1])]
        };
        let frame = Frame::new(vec![1.0, -2.0], image);
        assert_eq!(frame.outer(&[1.0, 2.0]), [4.0, 3.0]);
        let back = frame.inner(&[4.0, 3.0]);
        assert!((back[0] - 1.0).abs() + (back[1] - 2.0).abs() < 1e-14);
        let mut gradient = [1.0, 1.0];
        frame.pull_back(&mut gradient);
        // Exact in binary: columns (2, −1) and (0.5, 3).
        assert_eq!(gradient.to_vec(), [1.0, 3.5]);
    }
}
