//! Standard normal numbers, written out so that they stay the same whatever a library does.

use rand_chacha::rand_core::Rng;

/// Independent standard normal numbers, two of each pair of uniform ones.
///
/// ```text
/// z₁, z₂ = √(−2 ln u₁) (cos 2πu₂, sin 2πu₂),   u₁ in (0, 1], u₂ in [0, 1)
/// ```
/// # Source
/// Box & Muller 1958.
pub fn normals(rng: &mut impl Rng) -> impl Iterator<Item = f64> {
    std::iter::repeat_with(move || {
        let radius = (-2.0 * (1.0 - uniform(rng)).ln()).sqrt();
        let (sin, cos) = (std::f64::consts::TAU * uniform(rng)).sin_cos();
        [radius * cos, radius * sin]
    })
    .flatten()
}

/// A multiple of 2⁻⁵³ in [0, 1).
fn uniform(rng: &mut impl Rng) -> f64 {
    (rng.next_u64() >> 11) as f64 * (-53.0_f64).exp2()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seed::stream;

    #[test]
    fn moments_are_those_of_the_standard_normal() {
        let n = 100_000;
        let z: Vec<f64> = normals(&mut stream("s", "normal")).take(n).collect();
        let moment = |power: i32| z.iter().map(|z| z.powi(power)).sum::<f64>() / n as f64;
        // Standard errors √(1/n), √(2/n), √(15/n), √(96/n); five of them each.
        let expected = [(1, 0.0, 1.0), (2, 1.0, 2.0), (3, 0.0, 15.0), (4, 3.0, 96.0)];
        for (power, value, var) in expected {
            let tolerance = 5.0 * (var / n as f64).sqrt();
            let found = moment(power);
            assert!((found - value).abs() <= tolerance, "{power}: {found}");
        }
    }
}
