//! The part of a hyperparameter file that says how contexts are related: their names, Λ and their noise.
//!
//! ```toml
//! contexts = ["c1", "c2", "c3"]           # as in the data's column `context`
//! task_factor = [[1.1], [0.5, 0.8], …]    # Λ of eq. (16), a row for each context; zeros above the diagonal may be left out
//! noise_std = [0.1, 0.2, 0.1]             # one for each context, or a number for all
//! ```

use faer::Mat;
use mtgp::{MtgpError, TaskFactor};

use crate::noise_std::NoiseStd;

/// Λ as a matrix, (m, r).
///
/// # Panics
/// If it has not passed [`check`].
pub fn lambda(task_factor: &[Vec<f64>]) -> Mat<f64> {
    Mat::from_fn(task_factor.len(), rank(task_factor), |row, col| {
        task_factor[row].get(col).copied().unwrap_or_default()
    })
}

/// The free entries of Λ or of a gradient by it, row by row, as m rows of r with zeros above the diagonal.
///
/// # Panics
/// If there is not one entry for each place on or below the diagonal.
pub fn full_rows(n_contexts: usize, rank: usize, entries: &[f64]) -> Vec<Vec<f64>> {
    assert_eq!(entries.len(), TaskFactor::count(n_contexts, rank));
    let mut entries = entries.iter().copied();
    let full_row = |row: usize| {
        let mut values: Vec<f64> = entries.by_ref().take(rank.min(row + 1)).collect();
        values.resize(rank, 0.0);
        values
    };
    (0..n_contexts).map(full_row).collect()
}

/// The number of columns.
pub fn rank(task_factor: &[Vec<f64>]) -> usize {
    task_factor.iter().map(Vec::len).max().unwrap_or_default()
}

/// Refuses what is no Λ of these contexts, with row and column counted from 1.
pub fn check(
    contexts: Option<&[String]>,
    task_factor: Option<&[Vec<f64>]>,
    noise_std: &NoiseStd,
) -> Result<(), String> {
    let (contexts, task_factor) = match (contexts, task_factor) {
        (Some(contexts), Some(task_factor)) => (contexts, task_factor),
        (None, None) => return check_noise_count(noise_std, None),
        (Some(_), None) => return Err("`contexts` needs `task_factor`, a row for each".to_owned()),
        (None, Some(_)) => {
            return Err("`task_factor` needs `contexts`, the name of each row".to_owned());
        }
    };
    check_names(contexts)?;
    check_shape(contexts.len(), task_factor)?;
    check_noise_count(noise_std, Some(contexts.len()))?;
    match TaskFactor::new(lambda(task_factor)) {
        Ok(_) => Ok(()),
        Err(
            MtgpError::AboveDiagonal { row, column, value }
            | MtgpError::NonFinite {
                row, column, value, ..
            },
        ) => {
            let demand = if value.is_finite() {
                "which is above the diagonal and must be zero"
            } else {
                "but must be finite"
            };
            let (row, column) = (row + 1, column + 1);
            Err(format!(
                "`task_factor` row {row}, column {column} is {value}, {demand}"
            ))
        }
        Err(cause) => Err(format!("`task_factor`: {cause}")),
    }
}

fn check_names(contexts: &[String]) -> Result<(), String> {
    if contexts.is_empty() {
        return Err("`contexts` is empty".to_owned());
    }
    let is_repeated = |(idx, name): &(usize, &String)| contexts[..*idx].contains(name);
    match contexts.iter().enumerate().find(is_repeated) {
        Some((idx, name)) => Err(format!(
            "`contexts` entry {} is `{name}` again; each context has one row of `task_factor`",
            idx + 1
        )),
        None => Ok(()),
    }
}

fn check_shape(n_contexts: usize, task_factor: &[Vec<f64>]) -> Result<(), String> {
    let n_rows = task_factor.len();
    if n_rows != n_contexts {
        return Err(format!(
            "`task_factor` has {n_rows} rows; {n_contexts} are needed, one for each of `contexts`"
        ));
    }
    let rank = rank(task_factor);
    if rank == 0 || rank > n_contexts {
        return Err(format!(
            "`task_factor` has rank {rank}, its number of columns, which must be 1 to {n_contexts}, the number of contexts"
        ));
    }
    let is_short = |(row, entries): &(usize, &Vec<f64>)| entries.len() < rank.min(row + 1);
    match task_factor.iter().enumerate().find(is_short) {
        None => Ok(()),
        Some((row, entries)) => Err(format!(
            "`task_factor` row {} has {} entries; {} are needed",
            row + 1,
            entries.len(),
            rank.min(row + 1)
        )),
    }
}

fn check_noise_count(noise_std: &NoiseStd, n_contexts: Option<usize>) -> Result<(), String> {
    match (noise_std, n_contexts) {
        (NoiseStd::Shared(_), _) => Ok(()),
        (NoiseStd::OfContexts(_), None) => {
            Err("`noise_std` is a list, but there are no `contexts`".to_owned())
        }
        (NoiseStd::OfContexts(values), Some(n)) if values.len() == n => Ok(()),
        (NoiseStd::OfContexts(values), Some(n)) => Err(format!(
            "`noise_std` has {} entries; {n} are needed, one for each of `contexts`, or a number for all",
            values.len()
        )),
    }
}
