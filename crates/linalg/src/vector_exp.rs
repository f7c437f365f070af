//! The exponential of every entry of a slice, in a loop that the compiler vectorises.
//!
//! The result does not depend on the width of the machine's vectors: it is made
//! of single additions and multiplications, which round alike in every lane, and
//! no fused multiply-add is used.

use std::f64::consts::LOG2_E;

/// Adding this number rounds a small double to an integer in its low bits: 1.5·2⁵².
const ROUNDER: f64 = 6_755_399_441_055_744.0;

/// ln 2 to 33 bits, so that its product with an exponent is exact.
const LN_2_HIGH: f64 = 6.931_471_803_691_238e-1;

/// ln 2 − `LN_2_HIGH`.
const LN_2_LOW: f64 = 1.908_214_929_270_587_7e-10;

/// Below this, eˣ is smaller than the least normal double and is returned as zero.
const UNDERFLOW: f64 = -708.0;

/// Above this, eˣ is returned as infinite.
const OVERFLOW: f64 = 709.0;

/// Replaces every x by eˣ, to within 2 units in the last place.
///
/// ```text
/// x = k ln 2 + r,  |r| ≤ ½ ln 2,   eˣ = 2ᵏ (1 + r + r²/2! + … + r¹³/13!)
/// ```
/// The series stops at a remainder of r¹⁴/14! ≤ 5·10⁻¹⁸.
/// Arguments below −708 give 0, above 709 infinity; NaN stays NaN.
#[inline]
pub fn exp_in_place(values: &mut [f64]) {
    pulp::Arch::new().dispatch(
        #[inline(always)]
        || {
            for value in values.iter_mut() {
                *value = exp(*value);
            }
        },
    );
}

/// eˣ, to be inlined into a loop that is compiled per instruction set.
#[inline(always)]
#[allow(
    clippy::inline_always,
    reason = "the loop around it is compiled once per instruction set"
)]
pub fn exp(x: f64) -> f64 {
    // k = round(x / ln 2), as a double and in the low bits of `shifted`.
    let shifted = x * LOG2_E + ROUNDER;
    let k = shifted - ROUNDER;
    let r = (x - k * LN_2_HIGH) - k * LN_2_LOW;

    let scaled = series(r) * f64::from_bits((shifted.to_bits() << 52).wrapping_add(ONE_BITS));

    let floored = if x < UNDERFLOW { 0.0 } else { scaled };
    if x > OVERFLOW { f64::INFINITY } else { floored }
}

/// Bits of 1.0, the exponent field that stands for 2⁰.
const ONE_BITS: u64 = 0x3ff0_0000_0000_0000;

/// 1 + r + r²(1/2! + r/3! + … + r¹¹/13!), in Horner's form.
#[inline(always)]
#[allow(
    clippy::inline_always,
    reason = "the loop around it is compiled once per instruction set"
)]
fn series(r: f64) -> f64 {
    let mut tail = 1.0 / 6_227_020_800.0; // 1/13!
    tail = tail * r + 1.0 / 479_001_600.0;
    tail = tail * r + 1.0 / 39_916_800.0;
    tail = tail * r + 1.0 / 3_628_800.0;
    tail = tail * r + 1.0 / 362_880.0;
    tail = tail * r + 1.0 / 40_320.0;
    tail = tail * r + 1.0 / 5_040.0;
    tail = tail * r + 1.0 / 720.0;
    tail = tail * r + 1.0 / 120.0;
    tail = tail * r + 1.0 / 24.0;
    tail = tail * r + 1.0 / 6.0;
    tail = tail * r + 0.5;
    1.0 + (r + r * r * tail)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Distance in units of the last place of the reference.
    fn ulps(value: f64, reference: f64) -> f64 {
        (value - reference).abs() / (reference * f64::EPSILON)
    }

    #[test]
    fn exponential_is_within_two_ulps_of_the_standard_library() {
        let arguments: Vec<f64> = (0..200_000)
            .map(|i| -707.9 + 0.007_083 * f64::from(i))
            .collect();
        let mut values = arguments.clone();
        exp_in_place(&mut values);
        for (value, x) in values.iter().zip(&arguments) {
            // ulps() divides by the lower end of the binade's spacing, so 2 is a strict bound.
            assert!(
                ulps(*value, x.exp()) <= 2.0,
                "exp({x}) = {value}, not {}",
                x.exp()
            );
        }
    }

    #[test]
    fn exponential_at_the_edges() {
        let mut values = [0.0, -0.0, -800.0, f64::NEG_INFINITY, 800.0, f64::NAN];
        exp_in_place(&mut values);
        assert_eq!(values[..5], [1.0, 1.0, 0.0, 0.0, f64::INFINITY]);
        assert!(values[5].is_nan());
    }
}
