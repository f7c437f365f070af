//! The length of a slice is the caller's business: a wrong one is a panic that says which.

/// # Panics
/// If a slice does not have the length that an algorithm needs.
#[inline]
pub(crate) fn check_len(what: &str, slice: &[f64], expected: usize) {
    assert_eq!(
        slice.len(),
        expected,
        "{what} has {} numbers, not {expected}",
        slice.len()
    );
}
