//! Joints that turn without end, and the circle that a covariance sees instead of their angle.

use faer::{Mat, MatRef};

/// Joints whose position is an angle of which only the place on the circle counts: a turn more is the same state.
///
/// ```text
/// x = (q, q̇, q̈)   ⟼   z = (q with cos q_j for q_j, q̇, q̈, sin q_j)      j over these joints
/// z·z′ has cos(q_j − q′_j),   |z − z′|² has (2 sin ½(q_j − q′_j))², the square of the chord
/// ```
/// A covariance of z with the same weight and length scale for cos q_j and sin q_j is 2π-periodic in q_j and does not
/// depend on where an encoder has its zero.
/// # Shapes
/// `x` (n, 3ℓ), z (n, 3ℓ + c) for c such joints.
/// # Source
/// Rasmussen & Williams 2006, eq. (4.31), after MacKay 1998.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ContinuousJoints {
    /// Ascending.
    joints: Vec<usize>,
}

impl ContinuousJoints {
    /// No joint: states are seen as they are.
    pub fn none() -> Self {
        Self::default()
    }

    /// Those of these indices, counted from 0, in any order.
    pub fn of(joints: impl IntoIterator<Item = usize>) -> Self {
        let mut joints: Vec<usize> = joints.into_iter().collect();
        joints.sort_unstable();
        joints.dedup();
        Self { joints }
    }

    /// Their indices, ascending.
    pub fn indices(&self) -> &[usize] {
        &self.joints
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.joints.is_empty()
    }

    /// Whether a joint is one of them.
    pub fn contains(&self, joint: usize) -> bool {
        self.joints.binary_search(&joint).is_ok()
    }

    /// z at the rows of x.
    ///
    /// # Panics
    /// If x has no column for one of the joints.
    pub fn embed<'a>(&self, x: MatRef<'a, f64>) -> Embedded<'a> {
        if self.is_empty() {
            return Embedded::AsGiven(x);
        }
        let d = x.ncols();
        Embedded::OnCircle(Mat::from_fn(
            x.nrows(),
            d + self.joints.len(),
            |row, col| match self.joints.get(col.wrapping_sub(d)) {
                Some(joint) => x[(row, *joint)].sin(),
                None if self.contains(col) => x[(row, col)].cos(),
                None => x[(row, col)],
            },
        ))
    }

    /// z at one state; allocates nothing.
    ///
    /// # Shapes
    /// `x` (3ℓ,), `z` (3ℓ + c,).
    /// # Panics
    /// On other shapes.
    pub fn embed_state(&self, x: &[f64], z: &mut [f64]) {
        let (as_given, sines) = z.split_at_mut(x.len());
        assert_eq!(sines.len(), self.joints.len(), "one sine per joint");
        as_given.copy_from_slice(x);
        for (sine, &joint) in sines.iter_mut().zip(&self.joints) {
            *sine = x[joint].sin();
            as_given[joint] = x[joint].cos();
        }
    }

    /// The columns of z that one of the 3ℓ columns of x makes: itself, and for an angle that of its sine.
    pub fn columns_of(&self, column: usize, n_covariates: usize) -> impl Iterator<Item = usize> {
        let sine = self.joints.binary_search(&column).ok();
        std::iter::once(column).chain(sine.map(|place| n_covariates + place))
    }

    /// Values of the columns of x, one for each column of z.
    pub(crate) fn repeated(&self, values: &[f64]) -> Vec<f64> {
        let of_sines = self.joints.iter().map(|joint| values[*joint]);
        values.iter().copied().chain(of_sines).collect()
    }

    /// Adds values of the columns of z to those of the columns of x that make them.
    pub(crate) fn add_folded(&self, of_embedded: &[f64], sums: &mut [f64]) {
        let (as_given, of_sines) = of_embedded.split_at(sums.len());
        for (sum, value) in sums.iter_mut().zip(as_given) {
            *sum += value;
        }
        for (joint, value) in self.joints.iter().zip(of_sines) {
            sums[*joint] += value;
        }
    }
}

/// States as a covariance sees them.
#[derive(Debug)]
pub enum Embedded<'a> {
    /// x, where no joint is continuous.
    AsGiven(MatRef<'a, f64>),
    /// z.
    OnCircle(Mat<f64>),
}

impl Embedded<'_> {
    /// The matrix.
    pub fn as_ref(&self) -> MatRef<'_, f64> {
        match self {
            Self::AsGiven(x) => *x,
            Self::OnCircle(z) => z.as_ref(),
        }
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "the same functions of the same numbers")]
mod tests {
    use super::*;

    #[test]
    fn a_state_alone_is_embedded_as_in_a_matrix() {
        let x = Mat::from_fn(4, 6, |row, col| 0.7 * (3 * row + col) as f64 - 4.0);
        for joints in [vec![], vec![1], vec![1, 0, 1]] {
            let continuous = ContinuousJoints::of(joints);
            let embedded = continuous.embed(x.as_ref());
            let z = embedded.as_ref();
            assert_eq!(z.ncols(), 6 + continuous.indices().len());
            for row in 0..4 {
                let state: Vec<f64> = x.row(row).iter().copied().collect();
                let mut alone = vec![0.0; z.ncols()];
                continuous.embed_state(&state, &mut alone);
                let of_row: Vec<f64> = z.row(row).iter().copied().collect();
                assert_eq!(alone, of_row);
            }
        }
    }

    #[test]
    fn columns_and_values_follow_the_embedding() {
        let second = ContinuousJoints::of([1]);
        let columns = |column| second.columns_of(column, 6).collect::<Vec<_>>();
        assert_eq!(columns(0), [0]);
        assert_eq!(columns(1), [1, 6]);
        assert_eq!(second.repeated(&[1.0, 2.0, 3.0]), [1.0, 2.0, 3.0, 2.0]);
        let mut sums = [10.0, 20.0, 30.0];
        second.add_folded(&[1.0, 2.0, 3.0, 4.0], &mut sums);
        assert_eq!(sums, [11.0, 26.0, 33.0]);
    }
}
