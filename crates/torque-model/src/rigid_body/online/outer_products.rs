//! Sums of outer products of a few vectors, in vectors as wide as the machine's; every entry is summed in one order.
//!
//! A product is added in one rounding: one instruction where the machine has it, the same bits elsewhere.

use pulp::Simd;

/// Vectors at most.
pub(super) const BLOCK: usize = 8;

/// Σ_n f_nj r_n for every j.
///
/// # Shapes
/// `rows` (n, W), `factors` (n, 8) of which the first M count; (M, W), W a multiple of eight.
#[inline(always)]
#[allow(clippy::inline_always, reason = "compiled once per instruction set")]
pub(super) fn combine<S: Simd, const M: usize, const W: usize>(
    simd: S,
    rows: &[[f64; W]],
    factors: &[[f64; BLOCK]],
) -> [[f64; W]; M] {
    let width = W / S::F64_LANES;
    let (rows, _) = S::as_simd_f64s(rows.as_flattened());
    let mut all = [[0.0; W]; M];
    for part in 0..width {
        let mut sums = [simd.splat_f64s(0.0); M];
        for (row, factors) in rows.chunks_exact(width).zip(factors) {
            for (sum, factor) in sums.iter_mut().zip(factors) {
                *sum = simd.mul_add_f64s(row[part], simd.splat_f64s(*factor), *sum);
            }
        }
        for (all, sum) in all.iter_mut().zip(sums) {
            S::as_mut_simd_f64s(all).0[part] = sum;
        }
    }
    all
}

/// r_n ← r_n + s Σ_j f_nj d_j.
///
/// # Shapes
/// As in [`combine`]; `directions` (M, W).
#[inline(always)]
#[allow(clippy::inline_always, reason = "compiled once per instruction set")]
pub(super) fn add_outer<S: Simd, const M: usize, const W: usize>(
    simd: S,
    rows: &mut [[f64; W]],
    factors: &[[f64; BLOCK]],
    directions: &[[f64; W]; M],
    sign: f64,
) {
    let width = W / S::F64_LANES;
    let (rows, _) = S::as_mut_simd_f64s(rows.as_flattened_mut());
    for part in 0..width {
        let mut signed = [simd.splat_f64s(0.0); M];
        for (signed, direction) in signed.iter_mut().zip(directions) {
            let direction = S::as_simd_f64s(direction).0[part];
            *signed = simd.mul_f64s(direction, simd.splat_f64s(sign));
        }
        for (row, factors) in rows.chunks_exact_mut(width).zip(factors) {
            let mut entry = row[part];
            for (direction, factor) in signed.iter().zip(factors) {
                entry = simd.mul_add_f64s(*direction, simd.splat_f64s(*factor), entry);
            }
            row[part] = entry;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// r = (1, 2, …), f = (1, −1), d = (1, 1, …) and (0, 1, 2, …): by hand.
    struct Both;

    impl pulp::WithSimd for Both {
        type Output = ([[f64; 16]; 2], [[f64; 16]; 2]);

        #[inline(always)]
        #[allow(clippy::inline_always, reason = "compiled once per instruction set")]
        fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
            let count = |from: f64| std::array::from_fn(|k| from + k as f64);
            let mut rows: [[f64; 16]; 2] = [count(1.0), count(0.0)];
            let factors = [[1.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]; 2];
            let combined = combine::<S, 2, 16>(simd, &rows, &factors);
            add_outer(simd, &mut rows, &factors, &[[1.0; 16], count(0.0)], -1.0);
            (combined, rows)
        }
    }

    #[test]
    fn sums_by_hand_whatever_the_width() {
        let expected_sum: [f64; 16] = std::array::from_fn(|k| 1.0 + 2.0 * k as f64);
        let expected_rows: [[f64; 16]; 2] =
            [0.0, -1.0].map(|from| std::array::from_fn(|k| from + 2.0 * k as f64));
        for (combined, rows) in [
            pulp::Arch::new().dispatch(Both),
            pulp::Arch::Scalar.dispatch(Both),
        ] {
            assert_eq!(combined, [expected_sum, expected_sum.map(|sum| -sum)]);
            assert_eq!(rows, expected_rows);
        }
    }
}
