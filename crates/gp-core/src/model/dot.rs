//! Inner products in a fixed order of summation, whatever the width of the machine's vectors.

/// Partial sums kept side by side.
const LANES: usize = 8;

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
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
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
pub(crate) fn dot_compensated(pairs: impl Iterator<Item = (f64, f64)>) -> f64 {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inner_products_of_every_length_are_exact_on_integers() {
        for n in 0..40_u32 {
            let a: Vec<f64> = (0..n).map(|i| f64::from(i) - 7.0).collect();
            let b: Vec<f64> = (0..n).map(|i| f64::from(3 * i) - 20.0).collect();
            let exact: f64 = a.iter().zip(&b).map(|(a, b)| a * b).sum();
            assert!((dot(&a, &b) - exact).abs() < 0.5, "{n}");
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
