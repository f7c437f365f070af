//! A Cholesky factor that grows by its last row and loses its first.

use crate::sums::dot_in_sequence;

/// Factor of a positive definite matrix A that slides along a longer one, with e whitened by it.
///
/// ```text
/// A = LLᵀ,   z = L⁻¹e
/// ```
/// A new entry of e adds a row in O(w²); the oldest leaves in O(w²), as the rest of A is
/// L₂₂L₂₂ᵀ + l₂₁l₂₁ᵀ: an update by one positive term, which rotations do without loss.
/// # Source
/// Golub & Van Loan 2013, sec. 6.5.4; Gill, Golub, Murray & Saunders 1974, method C1.
#[derive(Debug, Clone)]
pub struct WindowFactor {
    capacity: usize,
    order: usize,
    l: Vec<f64>, // (capacity, capacity), row after row
    z: Vec<f64>, // (capacity,)
    leaving: Vec<f64>,
}

impl WindowFactor {
    /// A factor of order zero with room for `capacity` rows.
    pub fn new(capacity: usize) -> Self {
        Self {
            capacity,
            order: 0,
            l: vec![0.0; capacity * capacity],
            z: vec![0.0; capacity],
            leaving: vec![0.0; capacity],
        }
    }

    /// Order of A.
    #[inline]
    pub fn order(&self) -> usize {
        self.order
    }

    /// The next residual given those held, which it joins: whitened, and its standard deviation.
    ///
    /// ```text
    /// l = L⁻¹a,   v = σ² + (c − lᵀl)₊,   ((e − lᵀz)/√v, √v)
    /// ```
    /// # Shapes
    /// `covariances` a and then c, (order + 1,): the new row of A without σ².
    /// # Panics
    /// If the capacity is used up, or `covariances` has fewer entries.
    #[inline]
    pub fn append(&mut self, covariances: &[f64], noise_var: f64, residual: f64) -> (f64, f64) {
        let (order, capacity) = (self.order, self.capacity);
        let (above, row) = self.l.split_at_mut(order * capacity);
        for (col, covariance) in covariances[..order].iter().enumerate() {
            let known = &above[col * capacity..];
            let sum = dot_in_sequence(&row[..col], &known[..col]);
            row[col] = (covariance - sum) / known[col];
        }
        let unexplained = covariances[order] - dot_in_sequence(&row[..order], &row[..order]);
        // The comparison lets NaN through, which f64::max would turn into certainty.
        let latent_var = if unexplained < 0.0 { 0.0 } else { unexplained };
        let std = (noise_var + latent_var).sqrt();
        let z = (residual - dot_in_sequence(&row[..order], &self.z[..order])) / std;
        row[order] = std;
        self.z[order] = z;
        self.order += 1;
        (z, std)
    }

    /// Takes the newest residual out.
    #[inline]
    pub fn drop_last(&mut self) {
        self.order = self.order.saturating_sub(1);
    }

    /// Takes the oldest residual out.
    #[inline]
    pub fn drop_first(&mut self) {
        let (n, capacity) = (self.order, self.capacity);
        for row in 1..n {
            self.leaving[row] = self.l[row * capacity];
        }
        let mut leaving_z = self.z[0];
        for k in 1..n {
            // Rotates (L₂₂, l₂₁) so that l₂₁ vanishes at k, and (z₂, z₁) with it.
            let old = self.l[k * capacity + k];
            let pivot = old.hypot(self.leaving[k]);
            let (cos, sin) = (old / pivot, self.leaving[k] / pivot);
            for row in k..n {
                let (l, v) = (self.l[row * capacity + k], self.leaving[row]);
                self.l[(row - 1) * capacity + k - 1] = cos * l + sin * v;
                self.leaving[row] = cos * v - sin * l;
            }
            let z = self.z[k];
            self.z[k - 1] = cos * z + sin * leaving_z;
            leaving_z = cos * leaving_z - sin * z;
        }
        self.order = n.saturating_sub(1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A_ab = 1/(1 + |a − b|) + σ²δ_ab, positive definite.
    fn covariances(idx: usize, first: usize) -> Vec<f64> {
        (first..=idx)
            .map(|other| 1.0 / (1.0 + (idx - other) as f64))
            .collect()
    }

    fn log_density((z, std): (f64, f64)) -> f64 {
        -0.5 * (z * z + std::f64::consts::TAU.ln()) - std.ln()
    }

    #[test]
    fn first_density_by_hand() {
        let mut factor = WindowFactor::new(2);
        // Variance 3 + 1: z = 2/2.
        let value = log_density(factor.append(&[3.0], 1.0, 2.0));
        let expected = -0.5 - 2.0_f64.ln() - 0.5 * std::f64::consts::TAU.ln();
        assert!((value - expected).abs() <= 4.0 * f64::EPSILON, "{value}");
        // Covariance 2 with it, variance 2 + 1: l = 1, v = 2, mean z = 1.
        let value = log_density(factor.append(&[2.0, 2.0], 1.0, 1.0));
        let expected = -0.5 * (2.0 * std::f64::consts::TAU).ln();
        assert!((value - expected).abs() <= 4.0 * f64::EPSILON, "{value}");
    }

    #[test]
    fn a_factor_without_its_first_row_is_that_of_the_rest() {
        let residuals = [0.3, -1.0, 0.7, 2.0, -0.4, 0.1];
        let mut sliding = WindowFactor::new(4);
        for (idx, residual) in residuals.iter().enumerate() {
            let first = idx.saturating_sub(3);
            if sliding.order() == 4 {
                sliding.drop_first();
            }
            let value = log_density(sliding.append(&covariances(idx, first), 0.1, *residual));
            let mut fresh = WindowFactor::new(4);
            let mut expected = 0.0;
            for (other, residual) in residuals.iter().enumerate().take(idx + 1).skip(first) {
                expected = log_density(fresh.append(&covariances(other, first), 0.1, *residual));
            }
            assert!(
                (value - expected).abs() <= 1e-12,
                "{idx}: {value} {expected}"
            );
        }
    }
}
