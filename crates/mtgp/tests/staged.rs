//! Stages of A.3 on data whose truth is known, and on data that have little to say.

use faer::Mat;
use gp_core::search::Origin;
use gp_core::{FitOptions, log_marginal_likelihood};
use kernels::Covariance;
use mtgp::fit::{RankCandidate, RankCounts, fit_rank, fit_ranks_telling, rank_part};
use mtgp::{
    Criterion, MtgpError, MultiTaskCovariance, MultiTaskOptions, Stacked, StageOne, TaskCovariance,
    TaskFactor, TaskFit, choose_rank, fit_independent, fit_pooled,
};

use crate::icm_draws::{Draw, four_tasks_of_rank_two};

fn all_ranks(draw: &Draw, stage_one: &StageOne, options: &MultiTaskOptions) -> Vec<TaskFit> {
    let mut fits: Vec<TaskFit> = Vec::new();
    for rank in 1..=4 {
        let warm = fits.last();
        fits.push(fit_rank(&draw.data, &draw.targets, rank, stage_one, warm, options).unwrap());
    }
    fits
}

/// Eq. (8) of eq. (16) by the dense path.
fn likelihood_of(draw: &Draw, covariance: &MultiTaskCovariance, noise_std: f64) -> f64 {
    let (inputs, targets) = (draw.data.inputs(), &draw.targets);
    log_marginal_likelihood(covariance, noise_std, inputs, targets).unwrap()
}

#[test]
fn end_is_above_the_truth_and_bic_finds_the_true_rank() {
    let draw = four_tasks_of_rank_two(1, 30);
    let options = MultiTaskOptions::several();
    let stage_one = StageOne::new(&draw.data, &draw.targets, &options).unwrap();
    let fits = all_ranks(&draw, &stage_one, &options);

    let at_truth = likelihood_of(&draw, &draw.truth, draw.noise_std);
    assert!(
        fits[1].log_marginal() >= at_truth,
        "{} {at_truth}",
        fits[1].log_marginal()
    );
    let candidates: Vec<RankCandidate> = (fits.iter().enumerate())
        .map(|(idx, fit)| RankCandidate {
            rank: idx + 1,
            log_marginals: vec![fit.log_marginal()],
        })
        .collect();
    let counts = RankCounts {
        n_tasks: 4,
        n_input_params: vec![draw.truth.input().n_params()],
        n_observations: vec![120],
    };
    let choice = choose_rank(&candidates, &counts, Criterion::Bic).unwrap();
    assert_eq!(choice.rank, 2, "{:?}", choice.values);
}

#[test]
fn models_that_are_contained_in_another_have_no_higher_likelihood() {
    let draw = four_tasks_of_rank_two(2, 15);
    let options = MultiTaskOptions::several();
    let stage_one = StageOne::new(&draw.data, &draw.targets, &options).unwrap();
    let fits = all_ranks(&draw, &stage_one, &options);
    // A search stalls when an iteration gains less than `value_tolerance`, 10⁻⁵ nats, and
    // may be that far from the top a hundred times over.
    let slack = 1e-3;
    let pooled = stage_one.pooled.log_marginal();
    let independent = stage_one.independent.log_marginal();
    assert!(pooled <= fits[0].log_marginal() + slack);
    assert!(independent <= fits[3].log_marginal() + slack);
    for pair in fits.windows(2) {
        let (lower, higher) = (pair[0].log_marginal(), pair[1].log_marginal());
        assert!(lower <= higher + slack, "{lower} {higher}");
    }
}

#[test]
fn likelihoods_of_the_baselines_are_those_of_their_task_matrices() {
    let draw = four_tasks_of_rank_two(4, 12);
    let options = MultiTaskOptions {
        max_evaluations: 20,
        ..MultiTaskOptions::chapter()
    };
    let pooled = fit_pooled(&draw.data, &draw.targets, &options).unwrap();
    let independent = fit_independent(&draw.data, &draw.targets, &options).unwrap();
    let n_tasks = 4;
    let cases = [
        (&pooled, TaskCovariance::Ones { n_tasks }),
        (&independent, TaskCovariance::Identity { n_tasks }),
    ];
    for (fit, task) in cases {
        assert_eq!(fit.covariance().task(), &task);
        let dense = likelihood_of(&draw, fit.covariance(), fit.noise_std());
        let difference = (fit.log_marginal() - dense).abs();
        // n ε κ with κ = max K/σ² below 10⁶, on values below 10³.
        assert!(difference <= 1e-6, "{difference}");
    }
}

#[test]
fn rank_one_with_equal_entries_is_the_pooled_model() {
    let draw = four_tasks_of_rank_two(4, 12);
    let options = MultiTaskOptions {
        max_evaluations: 20,
        ..MultiTaskOptions::chapter()
    };
    let pooled = fit_pooled(&draw.data, &draw.targets, &options).unwrap();
    let ones = TaskFactor::new(Mat::full(4, 1, 1.0)).unwrap();
    let input = pooled.covariance().input().clone();
    let factor = MultiTaskCovariance::new(input, TaskCovariance::Factor(ones));
    let difference = likelihood_of(&draw, &factor, pooled.noise_std()) - pooled.log_marginal();
    assert!(difference.abs() <= 1e-6, "{difference}");
}

#[test]
fn stage_three_sets_out_from_the_first_stage_eq_28_and_the_first_noise() {
    let draw = four_tasks_of_rank_two(6, 12);
    let options = MultiTaskOptions {
        max_evaluations: 25,
        ..MultiTaskOptions::chapter()
    };
    let stage_one = StageOne::new(&draw.data, &draw.targets, &options).unwrap();
    let fit = fit_rank(&draw.data, &draw.targets, 2, &stage_one, None, &options).unwrap();

    let first = stage_one.winner();
    let part = rank_part(stage_one.k_aug.as_ref(), 2, options.rank_part).unwrap();
    let start = MultiTaskCovariance::new(
        first.covariance().input().clone(),
        TaskCovariance::Factor(part),
    );
    // σ₀² = 0.01 t̄², eq. (22).
    let power = draw.targets.iter().map(|t| t * t).sum::<f64>() / draw.targets.len() as f64;
    let expected = likelihood_of(&draw, &start, (0.01 * power).sqrt());
    let report = fit.report.winning_start();
    let found = report.initial_log_marginal.unwrap();
    assert!(
        (found - expected).abs() <= 1e-8 * expected.abs(),
        "{found} {expected}"
    );
    assert!(fit.log_marginal() > expected);
    assert_eq!(fit.report.origin(), stage_one.origin());

    let higher = stage_one
        .pooled
        .log_marginal()
        .max(stage_one.independent.log_marginal());
    assert_eq!(first.log_marginal(), higher);
}

#[test]
fn two_runs_agree_to_the_bit() {
    let draw = four_tasks_of_rank_two(7, 10);
    let options = MultiTaskOptions {
        max_evaluations: 60,
        ..MultiTaskOptions::several()
    };
    let run = || {
        let stage_one = StageOne::new(&draw.data, &draw.targets, &options).unwrap();
        let two = fit_rank(&draw.data, &draw.targets, 2, &stage_one, None, &options).unwrap();
        fit_rank(
            &draw.data,
            &draw.targets,
            3,
            &stage_one,
            Some(&two),
            &options,
        )
        .unwrap()
    };
    let (first, second) = (run(), run());
    assert_eq!(first.report, second.report);
    assert_eq!(first.covariance(), second.covariance());
    assert_eq!(first.noise_std().to_bits(), second.noise_std().to_bits());
}

#[test]
fn warm_start_begins_near_the_fit_it_is_from() {
    let draw = four_tasks_of_rank_two(8, 15);
    let options = MultiTaskOptions::several();
    let stage_one = StageOne::new(&draw.data, &draw.targets, &options).unwrap();
    let two = fit_rank(&draw.data, &draw.targets, 2, &stage_one, None, &options).unwrap();
    let three = fit_rank(
        &draw.data,
        &draw.targets,
        3,
        &stage_one,
        Some(&two),
        &options,
    )
    .unwrap();
    let again = fit_rank(
        &draw.data,
        &draw.targets,
        2,
        &stage_one,
        Some(&two),
        &options,
    )
    .unwrap();

    let warm = &three.report.last_stage().starts[1];
    assert_eq!(warm.origin, Origin::LowerRank);
    let at_start = warm.initial_log_marginal.unwrap();
    let chapter = three.report.last_stage().starts[0]
        .initial_log_marginal
        .unwrap();
    assert!(at_start > chapter, "{at_start} {chapter}");

    assert_eq!(again.report.origin(), Origin::Given);
    assert!(again.log_marginal() >= two.log_marginal());
}

#[test]
fn ranks_set_out_from_the_pooled_model_where_it_leads() {
    let mut draw = four_tasks_of_rank_two(10, 12);
    let data = &draw.data;
    // One function for all tasks.
    draw.targets = (0..48)
        .map(|row| {
            let x = data.covariates().row(row);
            (x[0] + 0.5 * x[1]).sin() + 0.3 * x[2]
        })
        .collect();
    let options = MultiTaskOptions {
        max_evaluations: 150,
        screening: 20,
        ..MultiTaskOptions::several()
    };
    let stage_one = StageOne::new(&draw.data, &draw.targets, &options).unwrap();
    assert_eq!(stage_one.origin(), Origin::Pooled);
    let fit = fit_rank(&draw.data, &draw.targets, 2, &stage_one, None, &options).unwrap();
    let starts = fit.report.last_stage().starts.iter();
    let origins: Vec<Origin> = starts.map(|start| start.origin).collect();
    assert_eq!(origins, [Origin::Pooled, Origin::LowerRank]);
    let (pooled, found) = (stage_one.pooled.log_marginal(), fit.log_marginal());
    assert!(found >= pooled - 1e-3, "{found} {pooled}");
}

/// Seven samples with which little can be learned, the last alone in its task.
struct PoorData {
    what: &'static str,
    x: Mat<f64>,
    torques: [f64; 7],
}

fn poor_data() -> [PoorData; 4] {
    let spread = Mat::from_fn(7, 3, |row, col| ((3 * row + 5 * col) % 7) as f64 - 3.0);
    let same = Mat::from_fn(7, 3, |_, col| col as f64);
    let torques = [1.0, -0.5, 0.3, 2.0, 1.1, -0.7, 0.4];
    let case = |what, x: &Mat<f64>, torques| PoorData {
        what,
        x: x.clone(),
        torques,
    };
    [
        case("task of one sample", &spread, torques),
        case("constant torque", &spread, [3.0; 7]),
        case("no torque", &spread, [0.0; 7]),
        case("one input", &same, torques),
    ]
}

#[test]
fn poor_data_have_finite_answers() {
    let options = MultiTaskOptions {
        max_evaluations: 60,
        screening: 10,
        ..MultiTaskOptions::several()
    };
    for PoorData { what, x, torques } in poor_data() {
        let data = Stacked::new(x.as_ref(), &[0, 0, 0, 1, 1, 1, 2], 3).unwrap();
        let stage_one = StageOne::new(&data, &torques, &options).unwrap();
        for rank in 1..=3 {
            let fit = fit_rank(&data, &torques, rank, &stage_one, None, &options).unwrap();
            assert!(fit.log_marginal().is_finite(), "{what} {rank}");
            for task in 0..3 {
                let prediction = fit.predict(task, x.as_ref()).unwrap();
                let values = prediction.mean.iter().chain(&prediction.var);
                assert!(
                    values.clone().all(|v| v.is_finite()),
                    "{what} {rank} {task}"
                );
            }
        }
        // Alone, the task of one sample cannot be learned, and says so.
        let alone = [0..3, 3..6, 6..7].map(|rows| {
            let x = x.subrows(rows.start, rows.len());
            gp_core::fit(x, &torques[rows], options.form, &FitOptions::chapter())
        });
        assert_eq!(alone.map(|fit| fit.is_ok()), [true, true, false], "{what}");
    }
}

#[test]
fn what_does_not_fit_together_is_refused() {
    let draw = four_tasks_of_rank_two(9, 6);
    let options = MultiTaskOptions {
        max_evaluations: 5,
        ..MultiTaskOptions::chapter()
    };
    let (data, targets) = (&draw.data, &draw.targets);
    let stage_one = StageOne::new(data, targets, &options).unwrap();
    let refuse = |rank: usize, targets: &[f64]| {
        fit_rank(data, targets, rank, &stage_one, None, &options).unwrap_err()
    };
    let (rank, n_tasks) = (5, 4);
    assert_eq!(refuse(5, targets), MtgpError::BadRank { rank, n_tasks });
    assert!(matches!(
        refuse(0, targets),
        MtgpError::BadRank { rank: 0, .. }
    ));
    assert!(matches!(
        refuse(2, &targets[1..]),
        MtgpError::CountMismatch { found: 23, .. }
    ));
    let fit = fit_rank(data, targets, 1, &stage_one, None, &options).unwrap();
    assert!(matches!(
        fit.predict(4, data.covariates()),
        Err(MtgpError::UnknownTask { task: 4, .. })
    ));
    assert!(matches!(
        fit.predict(0, data.inputs()),
        Err(MtgpError::Gp(_))
    ));

    let fewer_tasks = Stacked::new(data.covariates(), &[0; 24], 1).unwrap();
    let mismatch = fit_rank(&fewer_tasks, targets, 1, &stage_one, None, &options).unwrap_err();
    assert!(matches!(
        mismatch,
        MtgpError::CountMismatch {
            found: 4,
            expected: 1,
            ..
        }
    ));
}

#[test]
fn samples_of_a_part_are_those_of_all_and_of_every_task() {
    let draw = four_tasks_of_rank_two(10, 16);
    let (part, rows) = draw.data.spread(16).unwrap();
    assert_eq!(part.counts(), [4, 4, 4, 4]);
    for (of_part, &row) in rows.iter().enumerate() {
        assert_eq!(part.inputs().row(of_part), draw.data.inputs().row(row));
    }
    let (single, _) = draw.data.spread(1).unwrap();
    assert_eq!(single.counts(), [1, 1, 1, 1]);
}

#[test]
fn every_round_of_searches_is_told_before_it_begins() {
    let draw = four_tasks_of_rank_two(11, 94);
    let options = MultiTaskOptions {
        screening: 1,
        max_evaluations: 2,
        ..MultiTaskOptions::several()
    };
    let (data, targets) = (&draw.data, &draw.targets);
    let stage_one = StageOne::new(data, targets, &options).unwrap();
    let told = |options| {
        let mut told = Vec::new();
        let mut tell = |n_samples| told.push(n_samples);
        fit_ranks_telling(data, targets, &[1, 2], &stage_one, options, &mut tell).unwrap();
        told
    };
    assert_eq!(told(&options), [280, 376]);
    let whole = MultiTaskOptions {
        max_evaluations: 2,
        ..MultiTaskOptions::chapter()
    };
    assert_eq!(told(&whole), [376]);
}
