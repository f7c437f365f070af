//! Minimisation of a smooth function under bounds, knowing nothing of Gaussian processes.

mod bounds;
mod lbfgs;
mod line_search;
mod metric;
mod resumed;
mod rounds;

pub(crate) use bounds::Reparametrised;
pub use lbfgs::{MinimizeOptions, Minimum, StopReason, minimize};
pub(crate) use metric::{Metric, Scaled};
pub(crate) use resumed::{Known, Resumed};
pub use rounds::{Rounds, minimize_in_metric};

/// A smooth function on R^p that may be undefined in places.
pub trait Objective {
    /// Value at `z`, with the gradient written to `gradient`.
    ///
    /// Where the function is undefined the value is +∞ (never NaN) and the
    /// gradient is ignored; a search backs away from such points.
    fn value_and_gradient(&mut self, z: &[f64], gradient: &mut [f64]) -> f64;

    /// Largest component of the gradient that a bound does not excuse.
    ///
    /// Convergence is judged by it. Without bounds it is the gradient's largest component.
    fn projected_gradient(&self, z: &[f64], gradient: &[f64]) -> f64 {
        let _ = z;
        gradient.iter().fold(0.0, |largest, g| g.abs().max(largest))
    }

    /// A point away from the bounds that hold `z` although the function falls inwards.
    ///
    /// `None` if there is no such bound.
    fn released(&self, z: &[f64], gradient: &[f64], tolerance: f64) -> Option<Vec<f64>> {
        let _ = (z, gradient, tolerance);
        None
    }

    /// Whether the work that the search may take is used up; the best point is then returned.
    fn is_spent(&self) -> bool {
        false
    }
}

impl<O: Objective> Objective for &mut O {
    fn value_and_gradient(&mut self, z: &[f64], gradient: &mut [f64]) -> f64 {
        (**self).value_and_gradient(z, gradient)
    }

    fn projected_gradient(&self, z: &[f64], gradient: &[f64]) -> f64 {
        (**self).projected_gradient(z, gradient)
    }

    fn released(&self, z: &[f64], gradient: &[f64], tolerance: f64) -> Option<Vec<f64>> {
        (**self).released(z, gradient, tolerance)
    }

    fn is_spent(&self) -> bool {
        (**self).is_spent()
    }
}
