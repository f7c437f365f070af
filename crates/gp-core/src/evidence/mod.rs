//! Eq. (8), densely or by a low-rank factor with a certificate, and what the data say of its hyperparameters.

mod dense;
mod fisher;
mod likelihood;
mod log_marginal;
mod low_rank;
mod options;
mod pivot_choice;
mod pivoted;
mod subsets;

pub use fisher::{add_prior_information, information};
pub use likelihood::Likelihood;
pub use log_marginal::{
    Evidence, LogMarginal, evidence, log_marginal_likelihood, log_marginal_likelihood_with_gradient,
};
pub use options::{Evaluation, LikelihoodOptions, Method, MethodUsed};
pub use subsets::spread_rows;

pub(crate) use fisher::information_in;
pub(crate) use likelihood::{layout_with_noise, split_noise, with_noise};
pub(crate) use low_rank::{LowRank, rounding_of_entries};
pub(crate) use pivot_choice::Choice;
pub(crate) use pivoted::{independent_rows, rows};
pub(crate) use subsets::subset;
