//! Peak memory of a likelihood with gradient: the prior takes panels, never a matrix.

use allocation_counter::measure;
use faer::Mat;
use gp_core::LikelihoodOptions;
use gp_core::evidence::evidence;
use kernels::{TorqueCovariance, TorqueForm};
use mtgp::{MultiTaskCovariance, Stacked, TaskCovariance, TaskFactor};

#[test]
fn dense_path_takes_at_most_two_matrices_and_a_fifth() {
    let (n, m) = (1500, 6);
    let x = Mat::from_fn(n, 6, |row, col| {
        (0.37 * row as f64 + 1.1 * col as f64).sin()
    });
    let tasks: Vec<usize> = (0..n).map(|row| row % m).collect();
    let data = Stacked::new(x.as_ref(), &tasks, m).unwrap();
    let torques: Vec<f64> = (0..n).map(|row| 2.0 * x[(row, 0)] + x[(row, 4)]).collect();
    let targets = data.stack(&torques);
    let entries = vec![0.7; TaskFactor::count(m, 3)];
    let factor = TaskFactor::from_entries(m, 3, &entries).unwrap();
    let input = TorqueCovariance::unit(2, TorqueForm::Coulomb);
    let prior = MultiTaskCovariance::new(input, TaskCovariance::Factor(factor));
    let options = LikelihoodOptions::dense();
    let run = || evidence(&prior, 0.1, data.inputs(), &targets, options).unwrap();
    // Workspace of the matrix products, which is made once a thread.
    run();
    let info = measure(|| {
        let _ = run();
    });
    let peak = info.bytes_max as f64 / (8.0 * (n * n) as f64);
    assert!(peak <= 2.2, "{peak}");
}
