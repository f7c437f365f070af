//! K^ρ from what is known of the tasks beforehand: the covariance of their descriptors.

use faer::{Mat, MatRef};
use kernels::{Constant, Covariance, LinearArd, ParamLayout, SeArd, Sum, Transform};

use crate::error::{MtgpError, require_count};
use crate::prior::task_matrix::{TaskMatrix, symmetric_weights};

/// The covariance between tasks by their descriptors.
type OfDescriptors = Sum<Sum<Constant, LinearArd>, SeArd>;

/// K^ρ of tasks that are described by d numbers each, such as a load by its mass and first moments.
///
/// ```text
/// K^ρ_γδ = a² + Σ_d u_d² s_γd s_δd + e² exp(−½ Σ_d ((s_γd − s_δd)/l_d)²)
/// ```
/// a² is what no descriptor changes, u what changes in proportion to one, e and l what changes in any
/// other smooth way.
/// Torques of an arm are affine in mass and first moments of its load, which the first two terms are.
/// It has 2 + 2d numbers whatever the number of tasks, and a task with descriptors alone has a covariance
/// with all others.
/// # Shapes
/// m tasks, descriptors (m, d).
/// # Source
/// Wang, Neskovic & Cooper 2007 and Bonilla, Agakov & Williams 2007, "Kernel multi-task learning using
/// task-specific features": K^ρ as a kernel of task descriptors; the terms are those of eq. (5).
#[derive(Debug, Clone, PartialEq)]
pub struct DescribedTasks {
    descriptors: Mat<f64>,
    covariance: OfDescriptors,
}

/// The hyperparameters of [`DescribedTasks`], all above zero.
#[derive(Debug, Clone, PartialEq)]
pub struct DescribedParams {
    /// a.
    pub bias_std: f64,
    /// u, per unit of each descriptor, (d,).
    pub linear_std: Vec<f64>,
    /// e.
    pub signal_std: f64,
    /// l, in the unit of each descriptor, (d,).
    pub length_scales: Vec<f64>,
}

impl DescribedTasks {
    /// The covariance of tasks with these descriptors.
    ///
    /// # Shapes
    /// `descriptors` (m, d).
    /// # Errors
    /// [`MtgpError::NoTasks`]; [`MtgpError::CountMismatch`] unless there is one u and one l for each descriptor;
    /// [`MtgpError::NonFinite`] for descriptors; [`MtgpError::Kernel`] for a hyperparameter that is not finite and above
    /// zero.
    pub fn new(descriptors: Mat<f64>, params: DescribedParams) -> Result<Self, MtgpError> {
        let d = descriptors.ncols();
        if descriptors.nrows() == 0 {
            return Err(MtgpError::NoTasks);
        }
        require_count("weights of descriptors", params.linear_std.len(), d)?;
        let n_lengths = params.length_scales.len();
        require_count("length scales of descriptors", n_lengths, d)?;
        require_finite(descriptors.as_ref())?;
        let covariance = of_params(params)?;
        Ok(Self {
            descriptors,
            covariance,
        })
    }

    /// s, (m, d).
    pub fn descriptors(&self) -> MatRef<'_, f64> {
        self.descriptors.as_ref()
    }

    /// Its hyperparameters.
    pub fn named_params(&self) -> DescribedParams {
        let theta = self.covariance.params();
        let d = self.descriptors.ncols();
        DescribedParams {
            bias_std: theta[0],
            linear_std: theta[1..=d].to_vec(),
            signal_std: theta[d + 1],
            length_scales: theta[d + 2..].to_vec(),
        }
    }

    /// With one more task, of which the descriptors are all that is known.
    ///
    /// The covariances between the others keep every bit.
    /// # Shapes
    /// `descriptor` (d,).
    /// # Errors
    /// [`MtgpError::CountMismatch`] or [`MtgpError::NonFinite`] unless there are d finite numbers.
    pub fn with_task(&self, descriptor: &[f64]) -> Result<Self, MtgpError> {
        let (m, d) = (self.descriptors.nrows(), self.descriptors.ncols());
        require_count("descriptors of a task", descriptor.len(), d)?;
        let grown = Mat::from_fn(m + 1, d, |task, col| {
            if task < m {
                self.descriptors[(task, col)]
            } else {
                descriptor[col]
            }
        });
        require_finite(grown.as_ref())?;
        Ok(Self {
            descriptors: grown,
            covariance: self.covariance.clone(),
        })
    }
}

fn of_params(params: DescribedParams) -> Result<OfDescriptors, kernels::KernelError> {
    let affine = Sum::new(
        Constant::new(params.bias_std)?,
        LinearArd::new(params.linear_std)?,
    );
    let smooth = SeArd::new(params.signal_std, params.length_scales)?;
    Ok(Sum::new(affine, smooth))
}

fn require_finite(descriptors: MatRef<'_, f64>) -> Result<(), MtgpError> {
    for (row, of_task) in descriptors.row_iter().enumerate() {
        if let Some((column, &value)) = (of_task.iter().enumerate()).find(|(_, s)| !s.is_finite()) {
            return Err(MtgpError::NonFinite {
                what: "descriptor",
                row,
                column,
                value,
            });
        }
    }
    Ok(())
}

/// The numbers are a, u, e and l, and have no bound but zero.
///
/// Their names begin with `task_`.
impl TaskMatrix for DescribedTasks {
    fn n_tasks(&self) -> usize {
        self.descriptors.nrows()
    }

    fn k_task(&self) -> Mat<f64> {
        self.covariance.gram(self.descriptors.as_ref())
    }

    fn layout(&self) -> ParamLayout {
        let d = self.descriptors.ncols();
        ParamLayout::new()
            .with_scalar("task_bias_std", Transform::Positive)
            .with_vector("task_linear_std", d, Transform::Positive)
            .with_scalar("task_signal_std", Transform::Positive)
            .with_vector("task_length_scales", d, Transform::Positive)
    }

    fn n_params(&self) -> usize {
        2 + 2 * self.descriptors.ncols()
    }

    fn params(&self) -> Vec<f64> {
        self.covariance.params()
    }

    fn set_params(&mut self, params: &[f64]) {
        assert_eq!(params.len(), self.n_params());
        self.covariance.set_params(params);
    }

    /// ```text
    /// ∂/∂θ Σ_γδ T_γδ K^ρ_γδ = ∂/∂θ ½ tr((T + Tᵀ) K^ρ)
    /// ```
    fn add_adjoint(&self, weights: MatRef<'_, f64>, gradient: &mut [f64]) {
        let half = faer::Scale(0.5) * symmetric_weights(self, weights, gradient);
        let descriptors = self.descriptors.as_ref();
        self.covariance
            .gram_adjoint(descriptors, half.as_ref(), gradient);
    }
}
