//! A new context, known by some torques: its row of Λ, and predictions with it.

mod own_function;
mod row;
mod row_prior;

pub use own_function::predict_mean_of_new_context;
pub use row::{
    Border, NewTorques, RowFit, fit_row, fit_row_from_population, log_density_of_row,
    log_density_of_row_with_gradient,
};
pub use row_prior::RowPopulation;
