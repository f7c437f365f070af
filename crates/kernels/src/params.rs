//! Names, bounds and unconstrained coordinates of hyperparameters, in θ order.
//!
//! Nearly every hyperparameter is a standard deviation or a length scale, so it is
//! positive; two kinds carry a further bound of sec. 3.
//! Entries of a factor of a matrix may have either sign.
//! An optimiser without bounds works on z ∈ R, where a smooth increasing map
//! takes z to the natural value θ inside its bound.

use std::fmt;
use std::ops::Range;

/// Lower bound on the noise variance σ², in squared target units.
///
/// Source: sec. 3, "σ² ≥ 10⁻⁴".
pub const NOISE_VAR_FLOOR: f64 = 1e-4;

/// Upper bound on each weight u of the linear term.
///
/// Source: sec. 3, "u ∈ (0, 100]".
pub const LINEAR_STD_CEILING: f64 = 100.0;

/// The smooth map from an unconstrained coordinate z to a natural value θ.
///
/// ```text
/// Positive                θ = eᶻ                    θ > 0
/// Below { ceiling: c }    θ = c / (1 + e⁻ᶻ)         0 < θ < c
/// SquareAbove { floor: f }  θ = √(f + eᶻ)           θ² > f
/// Free { scale: s }       θ = s z                   any sign
/// ```
/// The first three behave as a logarithm far from their bound, and approach the
/// bound without reaching it.
/// # Source
/// Bounds: sec. 3. The reparametrisation stands in for L-BFGS-B's box.
// DEVIATION(sec. 3): the chapter's L-BFGS has box bounds; argmin's has none, so the
// bounds are approached by these maps instead of reached.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Transform {
    /// Any positive value.
    Positive,
    /// A positive value below a ceiling.
    Below {
        /// The ceiling, in the units of θ.
        ceiling: f64,
    },
    /// A positive value whose square is above a floor.
    SquareAbove {
        /// The floor, in the squared units of θ.
        floor: f64,
    },
    /// Any value of either sign.
    Free {
        /// The size that θ is expected to have, in its units: finite and above zero.
        scale: f64,
    },
}

impl Transform {
    /// Natural value θ at the unconstrained coordinate z.
    pub fn natural(self, z: f64) -> f64 {
        match self {
            Self::Positive => z.exp(),
            Self::Below { ceiling } => ceiling / (1.0 + (-z).exp()),
            Self::SquareAbove { floor } => (floor + z.exp()).sqrt(),
            Self::Free { scale } => scale * z,
        }
    }

    /// Unconstrained coordinate z of the natural value θ.
    ///
    /// A value on or beyond its bound has no coordinate: the result is then
    /// infinite or NaN. [`Transform::clamp_inside`] moves it inside first.
    pub fn unconstrained(self, theta: f64) -> f64 {
        match self {
            Self::Positive => theta.ln(),
            Self::Below { ceiling } => (theta / (ceiling - theta)).ln(),
            Self::SquareAbove { floor } => (theta * theta - floor).ln(),
            Self::Free { scale } => theta / scale,
        }
    }

    /// Derivative dθ/dz at the unconstrained coordinate z.
    pub fn derivative(self, z: f64) -> f64 {
        let theta = self.natural(z);
        match self {
            Self::Positive => theta,
            // dθ/dz = θ (1 − θ/c), with 1 − θ/c = 1/(1 + eᶻ) free of cancellation.
            Self::Below { .. } => theta / (1.0 + z.exp()),
            Self::SquareAbove { .. } => 0.5 * z.exp() / theta,
            Self::Free { scale } => scale,
        }
    }

    /// The nearest value that is clearly inside the bound.
    ///
    /// "Clearly" is a tenth of the ceiling below it, or twice the floor in the
    /// square: there dθ/dz has not yet died out, so that a search can still move.
    pub fn clamp_inside(self, theta: f64) -> f64 {
        match self {
            Self::Positive => theta.max(f64::MIN_POSITIVE.sqrt()),
            Self::Below { ceiling } => theta.clamp(f64::MIN_POSITIVE.sqrt(), 0.9 * ceiling),
            Self::SquareAbove { floor } => theta.max((2.0 * floor).sqrt()),
            Self::Free { .. } => theta,
        }
    }

    /// Whether θ sits on its bound, to one part in a thousand.
    pub fn is_at_bound(self, theta: f64) -> bool {
        match self {
            Self::Positive | Self::Free { .. } => false,
            Self::Below { ceiling } => theta >= 0.999 * ceiling,
            Self::SquareAbove { floor } => theta * theta <= 1.001 * floor,
        }
    }

    /// Whether θ is a value that the hyperparameter may take.
    pub fn admits(self, theta: f64) -> bool {
        let is_positive = !matches!(self, Self::Free { .. });
        theta.is_finite() && (theta > 0.0 || !is_positive)
    }
}

/// Which part of a hyperparameter's name a value is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Component {
    /// The whole of it: a scalar.
    Whole,
    /// The entry of a vector, by covariate or joint.
    At(usize),
    /// The entry of a matrix, by row and column.
    Entry(usize, usize),
}

/// One hyperparameter: its name, component and bound.
#[derive(Debug, Clone, PartialEq)]
pub struct ParamSpec {
    /// Name of the hyperparameter, e.g. `length_scales`.
    pub name: &'static str,
    /// Which covariate, joint or entry it belongs to.
    pub component: Component,
    /// Its bound and unconstrained coordinate.
    pub transform: Transform,
}

impl fmt::Display for ParamSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.component {
            Component::Whole => f.write_str(self.name),
            Component::At(idx) => write!(f, "{}[{idx}]", self.name),
            Component::Entry(row, col) => write!(f, "{}[{row},{col}]", self.name),
        }
    }
}

/// The hyperparameters of a covariance, in the order of its parameter vector.
///
/// ```
/// use kernels::{Covariance, TorqueCovariance, TorqueForm};
/// let cov = TorqueCovariance::unit(2, TorqueForm::Coulomb);
/// let layout = cov.layout();
/// assert_eq!(layout.specs()[0].to_string(), "bias_std");
/// assert_eq!(layout.specs()[3].to_string(), "linear_std[2]");
/// assert_eq!(layout.range("coulomb_std"), Some(14..16));
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ParamLayout {
    specs: Vec<ParamSpec>,
}

impl ParamLayout {
    /// A layout without parameters.
    pub fn new() -> Self {
        Self::default()
    }

    /// Appends one scalar hyperparameter.
    #[must_use]
    pub fn with_scalar(mut self, name: &'static str, transform: Transform) -> Self {
        self.specs.push(ParamSpec {
            name,
            component: Component::Whole,
            transform,
        });
        self
    }

    /// Appends a vector of hyperparameters that share name and bound.
    #[must_use]
    pub fn with_vector(mut self, name: &'static str, count: usize, transform: Transform) -> Self {
        self.specs.extend((0..count).map(|idx| ParamSpec {
            name,
            component: Component::At(idx),
            transform,
        }));
        self
    }

    /// Appends some entries (row, column) of a matrix, which share name and bound.
    #[must_use]
    pub fn with_entries(
        mut self,
        name: &'static str,
        entries: impl IntoIterator<Item = (usize, usize)>,
        transform: Transform,
    ) -> Self {
        self.specs
            .extend(entries.into_iter().map(|(row, col)| ParamSpec {
                name,
                component: Component::Entry(row, col),
                transform,
            }));
        self
    }

    /// Appends all hyperparameters of another layout.
    #[must_use]
    pub fn followed_by(mut self, other: Self) -> Self {
        self.specs.extend(other.specs);
        self
    }

    /// The first `count` hyperparameters.
    #[must_use]
    pub fn first(mut self, count: usize) -> Self {
        self.specs.truncate(count);
        self
    }

    /// The hyperparameters, in θ order.
    pub fn specs(&self) -> &[ParamSpec] {
        &self.specs
    }

    /// Number of hyperparameters.
    pub fn len(&self) -> usize {
        self.specs.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.specs.is_empty()
    }

    /// Where the hyperparameters of one name sit in θ; `None` if there are none.
    pub fn range(&self, name: &str) -> Option<Range<usize>> {
        let start = self.specs.iter().position(|spec| spec.name == name)?;
        let count = self.specs[start..]
            .iter()
            .take_while(|spec| spec.name == name)
            .count();
        Some(start..start + count)
    }
}
