//! The covariance between tasks, K^ρ of eq. (16), and its factor Λ.

use faer::{Mat, MatRef};
use kernels::{ParamLayout, Transform};

use crate::error::{MtgpError, require_count};
use crate::prior::described_tasks::DescribedTasks;
use crate::prior::task_matrix::{TaskMatrix, symmetric_weights};

/// The factor Λ of K^ρ = ΛΛᵀ: lower triangular with its columns cut off at the rank.
///
/// Its free entries are those on and below the diagonal, row by row:
/// (0,0), (1,0), (1,1), …; they may have either sign.
/// The sign of a whole column changes nothing in K^ρ.
/// # Shapes
/// (m, r) with m tasks and 1 ≤ r ≤ m; r(2m + 1 − r)/2 free entries.
/// # Source
/// Eq. (16) and the incomplete Cholesky decomposition of sec. 4.3.
#[derive(Debug, Clone, PartialEq)]
pub struct TaskFactor {
    lambda: Mat<f64>,
    /// Size of the entries when this was built, which a search counts in.
    scale: f64,
}

impl TaskFactor {
    /// The factor with the given matrix.
    ///
    /// # Shapes
    /// `lambda` (m, r).
    /// # Errors
    /// [`MtgpError::NoTasks`], [`MtgpError::BadRank`]; [`MtgpError::NonFinite`];
    /// [`MtgpError::AboveDiagonal`] for an entry other than zero above the diagonal.
    pub fn new(lambda: Mat<f64>) -> Result<Self, MtgpError> {
        require_rank(lambda.nrows(), lambda.ncols())?;
        for row in 0..lambda.nrows() {
            for column in 0..lambda.ncols() {
                let value = lambda[(row, column)];
                if !value.is_finite() {
                    let what = "task_factor";
                    return Err(MtgpError::NonFinite {
                        what,
                        row,
                        column,
                        value,
                    });
                }
                if column > row && value != 0.0 {
                    return Err(MtgpError::AboveDiagonal { row, column, value });
                }
            }
        }
        Ok(Self::with_scale(lambda))
    }

    /// The factor with the given free entries, row by row.
    ///
    /// # Errors
    /// [`MtgpError::NoTasks`], [`MtgpError::BadRank`]; [`MtgpError::CountMismatch`]
    /// unless there are r(2m + 1 − r)/2 entries; [`MtgpError::NonFinite`].
    pub fn from_entries(n_tasks: usize, rank: usize, entries: &[f64]) -> Result<Self, MtgpError> {
        require_rank(n_tasks, rank)?;
        let expected = Self::count(n_tasks, rank);
        require_count("entries of task_factor", entries.len(), expected)?;
        let mut lambda = Mat::zeros(n_tasks, rank);
        for ((row, col), value) in free_entries(n_tasks, rank).zip(entries) {
            lambda[(row, col)] = *value;
        }
        Self::new(lambda)
    }

    /// The factor of BBᵀ for any B, by an orthogonal triangular factorisation.
    ///
    /// ```text
    /// Bᵀ = Q R,   Λ = Rᵀ,   ΛΛᵀ = BBᵀ
    /// ```
    /// # Shapes
    /// `root` B, (m, r).
    /// # Errors
    /// As for [`TaskFactor::new`], except for entries above the diagonal.
    pub fn from_root(root: MatRef<'_, f64>) -> Result<Self, MtgpError> {
        require_rank(root.nrows(), root.ncols())?;
        Self::new(lower_trapezoidal(root))
    }

    /// Number of free entries r(2m + 1 − r)/2.
    pub fn count(n_tasks: usize, rank: usize) -> usize {
        rank * (2 * n_tasks + 1 - rank) / 2
    }

    fn with_scale(lambda: Mat<f64>) -> Self {
        let mean_square = lambda.squared_norm_l2() / lambda.nrows() as f64;
        let root = mean_square.sqrt();
        let scale = if root.is_normal() { root } else { 1.0 };
        Self { lambda, scale }
    }

    /// Λ, (m, r).
    pub fn lambda(&self) -> MatRef<'_, f64> {
        self.lambda.as_ref()
    }

    /// Number of tasks m.
    pub fn n_tasks(&self) -> usize {
        self.lambda.nrows()
    }

    /// Rank r of K^ρ, at most.
    pub fn rank(&self) -> usize {
        self.lambda.ncols()
    }

    /// The free entries, row by row.
    pub fn entries(&self) -> Vec<f64> {
        free_entries(self.n_tasks(), self.rank())
            .map(|(row, col)| self.lambda[(row, col)])
            .collect()
    }

    /// The task γ of each free entry, row by row.
    pub(crate) fn entry_tasks(&self) -> impl Iterator<Item = usize> + use<> {
        free_entries(self.n_tasks(), self.rank()).map(|(row, _)| row)
    }
}

/// Rᵀ of Bᵀ = QR, (m, r): BBᵀ = RᵀR.
pub(crate) fn lower_trapezoidal(root: MatRef<'_, f64>) -> Mat<f64> {
    let r = root.transpose().to_owned().qr().R().to_owned(); // (r, m)
    Mat::from_fn(root.nrows(), root.ncols(), |row, col| {
        if col <= row { r[(col, row)] } else { 0.0 }
    })
}

fn require_rank(n_tasks: usize, rank: usize) -> Result<(), MtgpError> {
    match n_tasks {
        0 => Err(MtgpError::NoTasks),
        _ if rank == 0 || rank > n_tasks => Err(MtgpError::BadRank { rank, n_tasks }),
        _ => Ok(()),
    }
}

/// Places (row, column) of the free entries, row by row.
fn free_entries(n_tasks: usize, rank: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..n_tasks).flat_map(move |row| (0..rank.min(row + 1)).map(move |col| (row, col)))
}

/// The covariance K^ρ between tasks.
///
/// # Source
/// Eq. (16); the first two kinds are the independent and the pooled model of A.3.
#[derive(Debug, Clone, PartialEq)]
pub enum TaskCovariance {
    /// K^ρ = I: the tasks share their hyperparameters and nothing else (iGP).
    Identity {
        /// Number of tasks m.
        n_tasks: usize,
    },
    /// K^ρ = 11ᵀ: the tasks are one function (pGP).
    Ones {
        /// Number of tasks m.
        n_tasks: usize,
    },
    /// K^ρ = ΛΛᵀ with Λ to be learned (mGP).
    Factor(TaskFactor),
    /// K^ρ by descriptors of the tasks (mGP(s)).
    Described(DescribedTasks),
}

impl TaskCovariance {
    /// Rank of K^ρ: m, 1 or, at most, the number of columns of Λ.
    pub fn rank(&self) -> usize {
        match self {
            Self::Identity { n_tasks } => *n_tasks,
            Self::Ones { .. } => 1,
            Self::Factor(factor) => factor.rank(),
            Self::Described(tasks) => tasks.n_tasks(),
        }
    }
}

/// The numbers are the free entries of Λ, row by row, or those of [`DescribedTasks`]; there are none of the fixed kinds.
///
/// The names of the former are `task_factor[γ,c]`, and they have no bound.
impl TaskMatrix for TaskCovariance {
    fn n_tasks(&self) -> usize {
        match self {
            Self::Identity { n_tasks } | Self::Ones { n_tasks } => *n_tasks,
            Self::Factor(factor) => factor.n_tasks(),
            Self::Described(tasks) => tasks.n_tasks(),
        }
    }

    fn k_task(&self) -> Mat<f64> {
        match self {
            Self::Identity { n_tasks } => Mat::identity(*n_tasks, *n_tasks),
            Self::Ones { n_tasks } => Mat::full(*n_tasks, *n_tasks, 1.0),
            Self::Factor(factor) => {
                let lambda = factor.lambda();
                Mat::from_fn(factor.n_tasks(), factor.n_tasks(), |row, col| {
                    (0..factor.rank().min(row + 1).min(col + 1))
                        .map(|k| lambda[(row, k)] * lambda[(col, k)])
                        .sum()
                })
            }
            Self::Described(tasks) => tasks.k_task(),
        }
    }

    fn layout(&self) -> ParamLayout {
        match self {
            Self::Identity { .. } | Self::Ones { .. } => ParamLayout::new(),
            Self::Factor(factor) => ParamLayout::new().with_entries(
                "task_factor",
                free_entries(factor.n_tasks(), factor.rank()),
                Transform::Free {
                    scale: factor.scale,
                },
            ),
            Self::Described(tasks) => tasks.layout(),
        }
    }

    fn n_params(&self) -> usize {
        match self {
            Self::Identity { .. } | Self::Ones { .. } => 0,
            Self::Factor(factor) => TaskFactor::count(factor.n_tasks(), factor.rank()),
            Self::Described(tasks) => tasks.n_params(),
        }
    }

    fn params(&self) -> Vec<f64> {
        match self {
            Self::Identity { .. } | Self::Ones { .. } => Vec::new(),
            Self::Factor(factor) => factor.entries(),
            Self::Described(tasks) => tasks.params(),
        }
    }

    /// The scale that a search counts in stays.
    fn set_params(&mut self, entries: &[f64]) {
        assert_eq!(entries.len(), self.n_params());
        match self {
            Self::Identity { .. } | Self::Ones { .. } => (),
            Self::Factor(factor) => {
                let places = free_entries(factor.n_tasks(), factor.rank());
                for ((row, col), value) in places.zip(entries) {
                    factor.lambda[(row, col)] = *value;
                }
            }
            Self::Described(tasks) => tasks.set_params(entries),
        }
    }

    /// ```text
    /// ∂/∂Λ Σ_γδ T_γδ K^ρ_γδ = (T + Tᵀ) Λ
    /// ```
    fn add_adjoint(&self, weights: MatRef<'_, f64>, gradient: &mut [f64]) {
        match self {
            Self::Identity { .. } | Self::Ones { .. } => {
                symmetric_weights(self, weights, gradient);
            }
            Self::Factor(factor) => {
                let symmetric = symmetric_weights(self, weights, gradient);
                let product = symmetric * factor.lambda(); // (m, r)
                let places = free_entries(factor.n_tasks(), factor.rank());
                for ((row, col), slope) in places.zip(gradient) {
                    *slope += product[(row, col)];
                }
            }
            Self::Described(tasks) => tasks.add_adjoint(weights, gradient),
        }
    }

    fn is_one_function(&self) -> bool {
        matches!(self, Self::Ones { .. })
    }
}
