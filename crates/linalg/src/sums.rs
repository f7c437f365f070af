//! Sums over slices, each in a fixed order of its own, most of them in eight lanes that vectorise.
//!
//! The number of lanes is fixed, whatever the machine's vectors, so a sum is rounded
//! in the same way everywhere.
//! Lanes are added one after another at the end, but for [`dot_pairwise`], which adds them in pairs:
//! the last bits differ, so one does not stand in for the other.

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

/// Σ_i a_i b_i, summed in eight interleaved parts that are then added pairwise.
///
/// Its error is at most (n/8 + 4) ε Σ|a_i b_i|.
/// # Panics
/// If the lengths differ.
#[inline(always)]
#[allow(
    clippy::inline_always,
    reason = "the loop around it is compiled once per instruction set"
)]
pub fn dot_pairwise(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let (a_lanes, a_rest) = a.as_chunks::<LANES>();
    let (b_lanes, b_rest) = b.as_chunks::<LANES>();
    let mut sums = [0.0; LANES];
    for (a, b) in a_lanes.iter().zip(b_lanes) {
        for lane in 0..LANES {
            sums[lane] += a[lane] * b[lane];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    let pair = |lane: usize| sums[lane] + sums[lane + 4];
    ((pair(0) + pair(1)) + (pair(2) + pair(3))) + rest
}

/// Σ_i a_i b_i as if summed in twice the working precision, then rounded.
///
/// For weights that are large and cancel.
/// # Source
/// Ogita, Rump & Oishi 2005, SIAM Journal on Scientific Computing 26, algorithm 5.3.
pub fn dot_compensated(pairs: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (mut sum, mut error) = (0.0_f64, 0.0_f64);
    for (a, b) in pairs {
        let product = a * b;
        let product_error = a.mul_add(b, -product);
        let next = sum + product;
        let part = next - sum;
        error += ((sum - (next - part)) + (product - part)) + product_error;
        sum = next;
    }
    sum + error
}

/// Σ_i a_i b_i, one product after another, as far as the shorter slice goes.
#[inline]
pub fn dot_in_sequence(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
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

    #[test]
    fn inner_products_of_every_length_are_exact_on_integers() {
        for n in 0..40_u32 {
            let a: Vec<f64> = (0..n).map(|i| f64::from(i) - 7.0).collect();
            let b: Vec<f64> = (0..n).map(|i| f64::from(3 * i) - 20.0).collect();
            let exact: f64 = a.iter().zip(&b).map(|(a, b)| a * b).sum();
            assert!((dot_pairwise(&a, &b) - exact).abs() < 0.5, "{n}");
            let compensated = dot_compensated(a.into_iter().zip(b));
            assert!((compensated - exact).abs() < 0.5, "{n}");
        }
    }

    #[test]
    fn compensation_keeps_what_cancellation_would_lose() {
        // 10¹⁶ + 1 − 10¹⁶ is 0 in working precision.
        let pairs = [(1e8, 1e8), (1.0, 1.0), (-1e8, 1e8)];
        assert!((dot_compensated(pairs.into_iter()) - 1.0).abs() < f64::EPSILON);
    }
}
