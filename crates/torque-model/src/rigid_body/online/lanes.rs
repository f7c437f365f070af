//! Eight numbers that are worked on side by side, whatever the machine's vectors, so that all round alike.

/// Eight numbers.
pub(super) type Lanes = [f64; N_LANES];
/// How many.
pub(super) const N_LANES: usize = 8;
/// As many zeros.
pub(super) const ZEROS: Lanes = [0.0; N_LANES];

/// a + b c
#[inline(always)]
#[allow(clippy::inline_always, reason = "compiled once per instruction set")]
pub(super) fn plus_scaled(a: Lanes, b: &Lanes, c: f64) -> Lanes {
    std::array::from_fn(|lane| a[lane] + b[lane] * c)
}

/// a + b c, number by number.
#[inline(always)]
#[allow(clippy::inline_always, reason = "compiled once per instruction set")]
pub(super) fn plus_product(a: Lanes, b: &Lanes, c: &Lanes) -> Lanes {
    std::array::from_fn(|lane| a[lane] + b[lane] * c[lane])
}

/// Sum of the eight, added in pairs.
#[inline(always)]
#[allow(clippy::inline_always, reason = "compiled once per instruction set")]
pub(super) fn total(a: &Lanes) -> f64 {
    let pair = |lane: usize| a[lane] + a[lane + 4];
    (pair(0) + pair(1)) + (pair(2) + pair(3))
}

/// Σ a b
///
/// # Shapes
/// Alike.
#[inline(always)]
#[allow(clippy::inline_always, reason = "compiled once per instruction set")]
pub(super) fn dot(a: &[Lanes], b: &[Lanes]) -> f64 {
    linalg::sums::dot_pairwise(a.as_flattened(), b.as_flattened())
}
