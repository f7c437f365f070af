//! The squared exponential through matrix products, against the sum of squares itself.

use faer::Mat;
use kernels::{Covariance, SeArd};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Largest error of v = 1 correlations relative to e^{−s/2} from direct differences.
fn worst_relative_error(x: &Mat<f64>, length_scale: f64) -> f64 {
    let (n, d) = (x.nrows(), x.ncols());
    let k = SeArd::new(1.0, vec![length_scale; d])
        .unwrap()
        .gram(x.as_ref());
    let mut worst = 0.0_f64;
    for row in 0..n {
        for col in 0..row {
            let s: f64 = (0..d)
                .map(|j| ((x[(row, j)] - x[(col, j)]) / length_scale).powi(2))
                .sum();
            let direct = (-0.5 * s).exp();
            if direct > 0.0 {
                worst = worst.max((k[(row, col)] - direct).abs() / direct);
            }
        }
    }
    worst
}

fn cloud(offset: f64) -> Mat<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut x = Mat::zeros(100, 18);
    for row in 0..100 {
        for col in 0..18 {
            x[(row, col)] = offset + 2.0 * rng.random::<f64>() - 1.0;
        }
    }
    x
}

#[test]
fn correlations_have_the_stated_relative_accuracy() {
    for length_scale in [3.0, 1.0, 0.3] {
        // |z|² ≤ 18/l², and eˣ adds 2 ε; the direct sum rounds s by (d + 2) ε s.
        let bound =
            2.0 * 20.0 * f64::EPSILON * 18.0 / (length_scale * length_scale) + 4.0 * f64::EPSILON;
        let worst = worst_relative_error(&cloud(0.0), length_scale);
        assert!(worst <= bound, "l = {length_scale}: {worst} above {bound}");
    }
}

#[test]
fn offset_of_the_inputs_costs_no_accuracy() {
    // Without centring |z|² would be 18·10⁸, and the error 1e-6.
    // The inputs themselves round to ε·10⁴, which both sides share; the mean rounds alike.
    let bound = 2.0 * 20.0 * f64::EPSILON * 18.0 * 4.0 + 18.0 * 4.0 * 1e4 * f64::EPSILON;
    let worst = worst_relative_error(&cloud(1e4), 1.0);
    assert!(worst <= bound, "{worst} above {bound}");
}
