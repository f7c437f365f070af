//! Sums over slices in a fixed order, in eight lanes so that they vectorise.
//!
//! The number of lanes is fixed, whatever the machine's vectors, so a sum is rounded
//! in the same way everywhere.

/// Partial sums kept side by side.
const LANES: usize = 8;

/// Σ a
#[inline]
pub fn sum(values: &[f64]) -> f64 {
    pulp::Arch::new().dispatch(
        #[inline(always)]
        || sum_in_lanes(values),
    )
}

/// Σ a b
///
/// # Panics
/// If the slices differ in length.
#[inline]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    pulp::Arch::new().dispatch(
        #[inline(always)]
        || dot_in_lanes(a, b),
    )
}

/// Σ a b in eight lanes, whatever the machine's vectors, to be inlined into a function that is
/// compiled per instruction set.
///
/// # Panics
/// If the slices differ in length.
#[inline(always)]
#[allow(
    clippy::inline_always,
    reason = "the loop around it is compiled once per instruction set"
)]
pub fn dot_in_lanes(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let mut lanes = [0.0; LANES];
    let (a_chunks, b_chunks) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let rest = a_chunks.remainder().iter().zip(b_chunks.remainder());
    let rest: f64 = rest.map(|(a, b)| a * b).sum();
    for (a, b) in a_chunks.zip(b_chunks) {
        for ((lane, a), b) in lanes.iter_mut().zip(a).zip(b) {
            *lane += a * b;
        }
    }
    lanes.iter().sum::<f64>() + rest
}

/// Σ w a²
///
/// # Panics
/// If the slices differ in length.
#[inline]
pub fn weighted_squares(values: &[f64], weights: &[f64]) -> f64 {
    assert_eq!(values.len(), weights.len());
    pulp::Arch::new().dispatch(
        #[inline(always)]
        || {
            let mut lanes = [0.0; LANES];
            let (chunks, w_chunks) = (values.chunks_exact(LANES), weights.chunks_exact(LANES));
            let rest = chunks.remainder().iter().zip(w_chunks.remainder());
            let rest: f64 = rest.map(|(value, weight)| weight * value * value).sum();
            for (chunk, weights) in chunks.zip(w_chunks) {
                for ((lane, value), weight) in lanes.iter_mut().zip(chunk).zip(weights) {
                    *lane += weight * value * value;
                }
            }
            lanes.iter().sum::<f64>() + rest
        },
    )
}

/// Σ a, to be inlined into a function that is compiled per instruction set.
#[inline(always)]
#[allow(
    clippy::inline_always,
    reason = "the loop around it is compiled once per instruction set"
)]
pub fn sum_in_lanes(values: &[f64]) -> f64 {
    let mut lanes = [0.0; LANES];
    let chunks = values.chunks_exact(LANES);
    let rest: f64 = chunks.remainder().iter().sum();
    for chunk in chunks {
        for (lane, value) in lanes.iter_mut().zip(chunk) {
            *lane += value;
        }
    }
    lanes.iter().sum::<f64>() + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_of_integers_are_exact_at_every_remainder() {
        for n in 0..40_u32 {
            let values: Vec<f64> = (0..n).map(f64::from).collect();
            let weights: Vec<f64> = (0..n).map(|i| f64::from(i + 1)).collect();
            let exact = |term: &dyn Fn(u32) -> u32| f64::from((0..n).map(term).sum::<u32>());
            assert!(sum(&values).total_cmp(&exact(&|i| i)).is_eq());
            assert!(
                dot(&values, &weights)
                    .total_cmp(&exact(&|i| i * (i + 1)))
                    .is_eq()
            );
            let squares = weighted_squares(&values, &weights);
            assert!(squares.total_cmp(&exact(&|i| i * i * (i + 1))).is_eq());
        }
    }
}
