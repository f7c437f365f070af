//! Sec. 5, first extension: one K^ρ for all joints.

use faer::Mat;
use gp_core::Starts;
use kernels::{TorqueCovariance, TorqueForm};
use mtgp::fit::{RankCounts, fit_rank, fit_shared};
use mtgp::prior::TaskMatrix;
use mtgp::{
    MtgpError, MultiTaskCovariance, MultiTaskOptions, Stacked, StageOne, TaskCovariance,
    TaskFactor, TaskFit,
};

use crate::icm_draws::{Draw, drawn, four_tasks_of_rank_two};

/// A second joint with the K^ρ of the first and another c^x, at the same inputs.
fn two_joints(n_per_task: usize) -> (Stacked, Vec<Vec<f64>>, Mat<f64>) {
    let Draw {
        data,
        targets,
        truth,
        noise_std,
    } = four_tasks_of_rank_two(61, n_per_task);
    let entries = truth.task().params();
    let factor = TaskFactor::from_entries(4, 2, &entries).unwrap();
    let mut params = truth.input().named_params();
    params.signal_std = 3.0;
    params.length_scales = vec![2.5, 1.5, 3.0];
    let input = TorqueCovariance::new(params).unwrap();
    let other = MultiTaskCovariance::new(input, TaskCovariance::Factor(factor));
    // The inputs depend on the seed alone.
    let (same, of_second) = drawn(&other, noise_std, 61, n_per_task);
    assert_eq!(same.inputs(), data.inputs());
    (data, vec![targets, of_second], truth.task().k_task())
}

fn options() -> MultiTaskOptions {
    MultiTaskOptions {
        starts: Starts::Chapter,
        max_evaluations: 150,
        form: TorqueForm::Coulomb,
        ..MultiTaskOptions::several()
    }
}

fn separate(data: &Stacked, targets: &[Vec<f64>]) -> Vec<TaskFit> {
    let fit = |targets: &Vec<f64>| {
        let stage_one = StageOne::new(data, targets, &options()).unwrap();
        fit_rank(data, targets, 2, &stage_one, None, &options()).unwrap()
    };
    targets.iter().map(fit).collect()
}

#[test]
fn one_matrix_for_both_joints_climbs_and_costs_less() {
    let (data, targets, _) = two_joints(12);
    let fits = separate(&data, &targets);
    let starts: Vec<_> = fits.iter().map(TaskFit::start).collect();
    let shared = fit_shared(&data, &targets, 2, &starts, &options()).unwrap();
    assert!(shared.log_marginal() >= shared.initial_log_marginal);
    let [first, second] = [0, 1].map(|joint| shared.joints[joint].covariance().task());
    assert_eq!(first.k_task(), second.k_task());

    // With K^ρ the same in truth, the seven entries of a second Λ are worth what chance makes of
    // them: 7/2 nats on average; BIC asks ½ log n each.
    let apart: f64 = fits.iter().map(TaskFit::log_marginal).sum();
    let lost = apart - shared.log_marginal();
    assert!(lost < 20.0, "{lost}");
    let counts = RankCounts {
        n_tasks: 4,
        n_input_params: vec![9, 9],
        n_observations: vec![48, 48],
    };
    // Σ d_i + ℓ + 7, and 7 more for a Λ per joint.
    assert_eq!(counts.n_params_shared(2), 9 + 9 + 2 + 7);
    assert_eq!(counts.n_params(2), counts.n_params_shared(2) + 7);
}

#[test]
fn joints_starts_and_targets_must_match() {
    let (data, targets, _) = two_joints(4);
    let fits = separate(&data, &targets);
    let none = fit_shared(&data, &[], 2, &[], &options());
    assert!(matches!(none, Err(MtgpError::NoJoints)));
    let few = fit_shared(&data, &targets, 2, &[fits[0].start()], &options());
    assert!(matches!(
        few,
        Err(MtgpError::CountMismatch {
            found: 1,
            expected: 2,
            ..
        })
    ));
    let short = vec![targets[0].clone(), targets[1][1..].to_vec()];
    let starts: Vec<_> = fits.iter().map(TaskFit::start).collect();
    let short = fit_shared(&data, &short, 2, &starts, &options());
    assert!(matches!(
        short,
        Err(MtgpError::CountMismatch {
            found: 15,
            expected: 16,
            ..
        })
    ));
}
