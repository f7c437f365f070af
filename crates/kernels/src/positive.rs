//! The check that standard deviations and length scales are usable numbers.

use crate::error::KernelError;

/// Fails on the first value that is not finite and above zero.
pub(crate) fn require_positive(name: &str, values: &[f64]) -> Result<(), KernelError> {
    let is_bad = |value: &f64| !(value.is_finite() && *value > 0.0);
    match values.iter().position(is_bad) {
        None => Ok(()),
        Some(idx) if values.len() > 1 => Err(KernelError::NotPositive {
            name: format!("{name}[{idx}]"),
            value: values[idx],
        }),
        Some(idx) => Err(KernelError::NotPositive {
            name: name.to_owned(),
            value: values[idx],
        }),
    }
}
