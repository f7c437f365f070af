//! Eq. (21) on-line: where it must equal the batch, what a chain does, and that nothing is allocated.

use allocation_counter::measure;
use faer::{Mat, mat};
use gp_core::{LikelihoodOptions, Method, Posterior};
use mtgp::context::{
    ContextFilter, ContextPrior, ContextTracker, ContextTransition, JointTorques, Outliers,
    context_evidence,
};
use mtgp::{MtgpError, MultiTaskCovariance};

use crate::eq_21::{assert_close, dense};
use crate::icm_draws::four_tasks_of_rank_two;

const M: usize = 4;
const N_NEW: usize = 12;

type Model = Posterior<MultiTaskCovariance>;

/// States along a path, so that neighbours say nearly the same.
fn path() -> Mat<f64> {
    Mat::from_fn(N_NEW, 3, |row, col| {
        1.5 * (0.15 * row as f64 + 0.9 * col as f64).sin()
    })
}

/// Torques of two joints, the second of which has none at every third sample.
fn torques(row: usize) -> [Option<f64>; 2] {
    let value = |shift: f64| 0.8 * (0.2 * row as f64 + shift).cos();
    [Some(value(0.0)), (row % 3 != 1).then(|| value(1.0))]
}

fn pivots(seed: u64) -> Model {
    let draw = four_tasks_of_rank_two(seed, 20);
    let options = LikelihoodOptions {
        method: Method::Certified,
        ..LikelihoodOptions::dense()
    };
    let x = draw.data.inputs();
    Posterior::new(draw.truth, draw.noise_std, x, &draw.targets, options).unwrap()
}

fn models() -> [Model; 2] {
    [dense(&four_tasks_of_rank_two(1, 10)), pivots(2)]
}

fn state(x: &Mat<f64>, row: usize) -> Vec<f64> {
    x.row(row).iter().copied().collect()
}

/// log densities of the torques of some samples together, one joint.
fn batch(model: &Model, joint: usize, rows: &[usize]) -> Vec<f64> {
    let x = path();
    let rows: Vec<usize> = (rows.iter().copied())
        .filter(|&row| torques(row)[joint].is_some())
        .collect();
    let x = Mat::from_fn(rows.len(), 3, |idx, col| x[(rows[idx], col)]);
    let torques: Vec<f64> = rows.iter().filter_map(|&row| torques(row)[joint]).collect();
    if torques.is_empty() {
        return vec![0.0; M];
    }
    let torques = &torques;
    let evidence = context_evidence(&[JointTorques { model, torques }], x.as_ref());
    evidence.unwrap().log_densities().to_vec()
}

fn tracker(models: &[Model], window: usize, transition: ContextTransition) -> ContextTracker {
    let prior = ContextPrior::from_weights(&[1.0, 2.0, 3.0, 4.0]).unwrap();
    ContextTracker::new(models, window, &prior, transition).unwrap()
}

/// The log posterior after all samples, and the densities of each.
fn run(tracker: &mut ContextTracker) -> (Vec<f64>, Vec<Vec<f64>>) {
    let x = path();
    let mut densities = Vec::new();
    let mut last = Vec::new();
    for row in 0..N_NEW {
        last = tracker
            .step(&state(&x, row), &torques(row))
            .unwrap()
            .to_vec();
        densities.push(tracker.log_densities().to_vec());
    }
    (last, densities)
}

#[test]
fn a_window_over_all_samples_without_switching_is_the_batch() {
    let models = models();
    let mut tracker = tracker(&models, N_NEW, ContextTransition::none(M));
    let (last, _) = run(&mut tracker);
    let x = path();
    let prior = ContextPrior::from_weights(&[1.0, 2.0, 3.0, 4.0]).unwrap();

    // Joints miss different samples, so that each has its own states.
    let mut sums = vec![0.0; M];
    for (joint, model) in models.iter().enumerate() {
        let all: Vec<usize> = (0..x.nrows()).collect();
        for (sum, value) in sums.iter_mut().zip(batch(model, joint, &all)) {
            *sum += value;
        }
    }
    let expected = mtgp::context::ContextPosterior::new(&sums, &prior).unwrap();
    for (a, b) in last.iter().zip(expected.log_probabilities()) {
        assert_close("log posterior", *a, *b);
    }
}

#[test]
fn without_a_window_samples_are_independent_given_the_context() {
    let models = models();
    let mut tracker = tracker(&models, 0, ContextTransition::none(M));
    let (_, densities) = run(&mut tracker);
    for (row, densities) in densities.iter().enumerate() {
        for (context, value) in densities.iter().enumerate() {
            let of = |joint: usize| batch(&models[joint], joint, &[row])[context];
            assert_close("independent", *value, of(0) + of(1));
        }
    }
}

#[test]
fn a_short_window_conditions_on_the_last_samples_only() {
    let (models, window) = ([dense(&four_tasks_of_rank_two(3, 8))], 3);
    let mut tracker = tracker(&models, window, ContextTransition::none(M));
    let x = path();
    for row in 0..N_NEW {
        tracker.step(&state(&x, row), &torques(row)[..1]).unwrap();
        let rows: Vec<usize> = (row.saturating_sub(window)..=row).collect();
        let with = batch(&models[0], 0, &rows);
        let without = batch(&models[0], 0, &rows[..rows.len() - 1]);
        for (context, value) in tracker.log_densities().iter().enumerate() {
            assert_close("window", *value, with[context] - without[context]);
        }
    }
}

#[test]
fn the_filter_is_the_sum_over_all_paths_of_contexts() {
    let chain = [[0.9, 0.1, 0.0], [0.2, 0.5, 0.3], [0.0, 0.25, 0.75]];
    let prior = [0.5, 0.3, 0.2];
    let densities = [[-1.0, 0.5, 2.0], [0.3, -0.7, 1.0], [2.0, 1.0, -3.0]];
    let mut last = [0.0; 3];
    for (a, b, c) in (0..27).map(|idx| (idx / 9, idx / 3 % 3, idx % 3)) {
        let of_path = prior[a] * chain[a][b] * chain[b][c];
        let sum: f64 = densities[0][a] + densities[1][b] + densities[2][c];
        last[c] += of_path * sum.exp();
    }
    let sum: f64 = last.iter().sum();

    let matrix = Mat::from_fn(3, 3, |row, col| chain[row][col]);
    let transition = ContextTransition::from_matrix(matrix.as_ref()).unwrap();
    let prior = ContextPrior::from_weights(&prior).unwrap();
    let mut filter = ContextFilter::new(&prior, transition).unwrap();
    for densities in &densities {
        filter.step(densities).unwrap();
    }
    for (log, expected) in filter.log_probabilities().iter().zip(last) {
        let expected = (expected / sum).ln();
        assert!(
            (log - expected).abs() <= 64.0 * f64::EPSILON,
            "{log} {expected}"
        );
    }
    assert_eq!(filter.n_samples(), 3);
}

#[test]
fn a_switching_rate_is_a_chain_of_exponential_stays() {
    let transition = ContextTransition::switching(3, 0.5, 0.2).unwrap();
    let stay = (-0.1_f64).exp();
    let other = (1.0 - stay) / 2.0;
    let chain = mat![
        [stay, other, other],
        [other, stay, other],
        [other, other, stay]
    ];
    let expected = ContextTransition::from_matrix(chain.as_ref()).unwrap();
    let prior = ContextPrior::from_weights(&[0.7, 0.2, 0.1]).unwrap();
    let mut filters = [transition, expected].map(|t| ContextFilter::new(&prior, t).unwrap());
    for filter in &mut filters {
        filter.step(&[0.0; 3]).unwrap();
        filter.step(&[0.0; 3]).unwrap();
    }
    let [a, b] = filters.each_ref().map(ContextFilter::log_probabilities);
    for (a, b) in a.iter().zip(b) {
        assert!((a - b).abs() <= 16.0 * f64::EPSILON, "{a} {b}");
    }
    // A change that the densities ask for by a thousand nats is made, and unmade.
    let [filter, _] = &mut filters;
    filter.step(&[0.0, 1e3, 0.0]).unwrap();
    assert_eq!(filter.most_probable(), 1);
    filter.step(&[1e3, -1e3, 0.0]).unwrap();
    assert_eq!(filter.most_probable(), 0);
    let sum: f64 = filter.log_probabilities().iter().map(|log| log.exp()).sum();
    assert!((sum - 1.0).abs() <= 8.0 * f64::EPSILON, "{sum}");
}

#[test]
fn a_step_allocates_nothing_even_if_it_is_refused() {
    let models = models();
    let transition = ContextTransition::switching(M, 0.1, 1e-3).unwrap();
    let mut tracker = tracker(&models, 3, transition);
    let x = path();
    let states: Vec<Vec<f64>> = (0..N_NEW).map(|row| state(&x, row)).collect();
    let info = measure(|| {
        for (row, state) in states.iter().enumerate() {
            tracker.step(state, &torques(row)).unwrap();
            assert!(tracker.step(&[f64::NAN; 3], &torques(row)).is_err());
            assert!(tracker.step(state, &[Some(1e200), None]).is_err());
        }
    });
    assert_eq!(info.count_total, 0, "{info:?}");
}

#[test]
fn a_refused_sample_leaves_the_tracker_as_it_was() {
    let models = models();
    let transition = || ContextTransition::switching(M, 1.0, 1e-2).unwrap();
    let (expected, _) = run(&mut tracker(&models, 4, transition()));
    let mut tracker = tracker(&models, 4, transition());
    let x = path();
    let mut last = Vec::new();
    for row in 0..N_NEW {
        let state = state(&x, row);
        for bad in [f64::NAN, f64::INFINITY, 1e200] {
            assert!(tracker.step(&state, &[None, Some(bad)]).is_err());
            assert!(tracker.step(&[bad, 0.0, 0.0], &[Some(0.0); 2]).is_err());
        }
        assert!(tracker.step(&state[..2], &torques(row)).is_err());
        assert!(tracker.step(&state, &torques(row)[..1]).is_err());
        last = tracker.step(&state, &torques(row)).unwrap().to_vec();
    }
    for (a, b) in last.iter().zip(&expected) {
        assert_close("refused", *a, *b);
    }
}

#[test]
fn chains_and_priors_that_do_not_fit_are_refused() {
    let message = |chain: Mat<f64>| {
        let error = ContextTransition::from_matrix(chain.as_ref()).unwrap_err();
        error.to_string()
    };
    assert_eq!(
        message(mat![[1.0, 0.0], [0.5, 0.4]]),
        "row 1 of the transitions does not hold probabilities: its sum is 0.9"
    );
    assert_eq!(
        message(mat![[1.0, 0.0]]),
        "2 columns of transitions, expected 1"
    );
    let nan = ContextTransition::from_matrix(mat![[f64::NAN]].as_ref());
    assert!(matches!(nan, Err(MtgpError::NotProbabilities { .. })));
    for rate in [-1.0, f64::NAN, f64::INFINITY] {
        assert!(
            ContextTransition::switching(2, rate, 1.0).is_err(),
            "{rate}"
        );
    }
    let prior = ContextPrior::uniform(2).unwrap();
    assert!(ContextFilter::new(&prior, ContextTransition::none(3)).is_err());
    let none: [&Model; 0] = [];
    let empty = ContextTracker::new(none, 1, &prior, ContextTransition::none(2));
    assert_eq!(empty.unwrap_err(), MtgpError::NoJoints);
}

#[test]
fn a_torque_that_no_context_explains_does_not_unseat_the_one_that_is_right() {
    let models = [dense(&four_tasks_of_rank_two(1, 10))];
    let x = path();
    let chain = || ContextTransition::switching(M, 0.5, 1e-3).unwrap();
    let truth = models[0].covariance().rows_of(x.as_ref(), 2).unwrap();
    let mean = models[0].predict_mean(truth.as_ref()).unwrap();
    let believed = |mut tracker: ContextTracker, error: f64| {
        for (row, torque) in mean.iter().enumerate() {
            let is_last = row + 1 == N_NEW;
            let torque = torque + if is_last { error } else { 0.0 };
            tracker.step(&state(&x, row), &[Some(torque)]).unwrap();
        }
        tracker.filter().most_probable()
    };
    let plain = || tracker(&models, 0, chain());
    let tolerant = || plain().with_outliers(Outliers::new(0.01, 100.0).unwrap());
    assert_eq!(believed(plain(), 0.0), 2);
    assert_eq!(believed(tolerant(), 0.0), 2);
    // Far beyond what any context has: the nearest of them wins, or none gains anything.
    for error in [-30.0, 30.0] {
        assert_ne!(believed(plain(), error), 2, "{error}");
        assert_eq!(believed(tolerant(), error), 2, "{error}");
    }
}
