//! Peak memory of a likelihood with gradient.
//!
//! The matrix products keep a workspace of fixed size per thread, 64 MiB of addresses
//! of which few are ever touched; it is made before the measurement.

use allocation_counter::measure;
use gp_core::LikelihoodOptions;
use gp_core::evidence::evidence;

use crate::curves;

/// Most bytes allocated at one time, as a multiple of one (n, n) matrix of doubles.
fn peak_in_matrices(n: usize, options: LikelihoodOptions) -> f64 {
    let x = curves::inputs(n);
    let targets = curves::targets(&x);
    let covariance = curves::covariance(4.0);
    let run = || evidence(&covariance, 0.03, x.as_ref(), &targets, options).unwrap();
    run();
    let info = measure(|| {
        let _ = run();
    });
    info.bytes_max as f64 / (8.0 * (n * n) as f64)
}

#[test]
fn dense_path_takes_at_most_two_matrices_and_a_fifth() {
    let peak = peak_in_matrices(1500, LikelihoodOptions::dense());
    assert!(peak <= 2.2, "{peak}");
}

#[test]
fn low_rank_path_takes_a_small_part_of_one_matrix() {
    // Rank near 80: five or so (n, r) matrices of 80/1500 n² doubles each.
    let peak = peak_in_matrices(1500, LikelihoodOptions::automatic());
    assert!(peak <= 0.5, "{peak}");
}
