//! Eq. (21): the densities are ratios of marginal likelihoods, the probabilities sum to one.

use faer::{Mat, MatRef};
use gp_core::{GpError, LikelihoodOptions, Method, Posterior, log_marginal_likelihood};
use kernels::Covariance;
use mtgp::context::{
    ContextModel, ContextPosterior, ContextPrior, JointTorques, chi_squared_upper_tail,
    context_evidence,
};
use mtgp::{MtgpError, MultiTaskCovariance, TaskCovariance, with_task};

use crate::icm_draws::{Draw, four_tasks_of_rank_two};

const M: usize = 4;

pub fn dense(draw: &Draw) -> Posterior<MultiTaskCovariance> {
    let (covariance, x) = (draw.truth.clone(), draw.data.inputs());
    let options = LikelihoodOptions::dense();
    Posterior::new(covariance, draw.noise_std, x, &draw.targets, options).unwrap()
}

/// Five states away from the samples, and torques that no context made.
fn new_samples() -> (Mat<f64>, Vec<f64>) {
    let x = Mat::from_fn(5, 3, |row, col| {
        1.8 * (1.3 * row as f64 + 0.9 * col as f64).sin()
    });
    (x, vec![0.3, -0.8, 0.5, 1.1, -0.2])
}

fn both(above: MatRef<'_, f64>, below: MatRef<'_, f64>) -> Mat<f64> {
    let n = above.nrows();
    Mat::from_fn(n + below.nrows(), above.ncols(), |row, col| {
        if row < n {
            above[(row, col)]
        } else {
            below[(row - n, col)]
        }
    })
}

/// log p(D ∪ D*) − log p(D), from two marginal likelihoods.
fn ratio<C: Covariance>(
    covariance: &C,
    noise_std: f64,
    old: (MatRef<'_, f64>, &[f64]),
    new: (MatRef<'_, f64>, &[f64]),
) -> f64 {
    let value = |x, t: &[f64]| log_marginal_likelihood(covariance, noise_std, x, t).unwrap();
    let all = both(old.0, new.0);
    value(all.as_ref(), &[old.1, new.1].concat()) - value(old.0, old.1)
}

/// 1e-8 for values up to 100, which κ(K) below 1e6 leaves: n ε κ is near 1e-9 of the value.
pub fn assert_close(name: &str, a: f64, b: f64) {
    let error = (a - b).abs();
    assert!(
        error <= 1e-10 * b.abs().max(100.0),
        "{name}: {a} {b} {error:e}"
    );
}

#[test]
fn evidence_of_two_joints_is_the_ratio_of_marginal_likelihoods() {
    let draws = [four_tasks_of_rank_two(1, 10), four_tasks_of_rank_two(2, 12)];
    let (x, torques) = new_samples();
    let posteriors = [dense(&draws[0]), dense(&draws[1])];
    let joints = posteriors.each_ref().map(|model| JointTorques {
        model,
        torques: &torques,
    });
    let evidence = context_evidence(&joints, x.as_ref()).unwrap();
    assert_eq!(evidence.n_torques(), 10);

    let expected: Vec<f64> = (0..M)
        .map(|context| {
            let rows = with_task(x.as_ref(), context);
            let of_joint = |draw: &Draw| {
                let old = (draw.data.inputs(), draw.targets.as_slice());
                ratio(&draw.truth, draw.noise_std, old, (rows.as_ref(), &torques))
            };
            draws.iter().map(of_joint).sum()
        })
        .collect();
    for (value, expected) in evidence.log_densities().iter().zip(&expected) {
        assert_close("density", *value, *expected);
    }

    // The same with a prior, by the definition.
    let weights = [0.1, 0.2, 0.3, 0.4];
    let prior = ContextPrior::from_weights(&weights).unwrap();
    let posterior = evidence.posterior(&prior).unwrap();
    let shift = expected.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let joint = |context: usize| weights[context] * (expected[context] - shift).exp();
    let log_sum = shift + (0..M).map(joint).sum::<f64>().ln();
    for (context, log) in posterior.log_probabilities().iter().enumerate() {
        let expected = weights[context].ln() + expected[context] - log_sum;
        assert_close("log posterior", *log, expected);
    }
}

#[test]
fn torques_of_which_four_are_one_say_a_quarter() {
    let draw = four_tasks_of_rank_two(1, 10);
    let (x, torques) = new_samples();
    let model = dense(&draw);
    let joint = JointTorques {
        model: &model,
        torques: &torques,
    };
    let all = context_evidence(&[joint, joint], x.as_ref()).unwrap(); // 10 torques
    let quarter = all.clone().of_correlated(4.0);
    let tail = |squares: f64, n| chi_squared_upper_tail(squares, n);
    for context in 0..M {
        let (value, of_all) = (
            quarter.log_densities()[context],
            all.log_densities()[context],
        );
        assert_eq!(value, of_all / 4.0);
        // 10/4 = 2.5 independent ones, rounded to 3: the mean of 10 squares is that of 3.
        let squares = all.squares()[context];
        assert_close("p", quarter.p_values()[context], tail(0.3 * squares, 3));
        assert_eq!(all.p_values()[context], tail(squares, 10));
    }
    assert_eq!(quarter.scores(), all.scores());
    let least = all.clone().of_correlated(1e9).p_values();
    assert_close("one", least[0], tail(0.1 * all.squares()[0], 1));
}

#[test]
fn a_joint_without_torques_is_left_out() {
    let draw = four_tasks_of_rank_two(1, 8);
    let (x, torques) = new_samples();
    let model = dense(&draw);
    let joint = JointTorques {
        model: &model,
        torques: &torques,
    };
    let once = context_evidence(&[joint], x.as_ref()).unwrap();
    let twice = context_evidence(&[joint, joint], x.as_ref()).unwrap();
    for (one, two) in once.log_densities().iter().zip(twice.log_densities()) {
        assert_eq!(2.0 * one, *two);
    }
    // Without a sample, nothing is learned.
    let joint = JointTorques {
        model: &model,
        torques: &[],
    };
    let nothing = context_evidence(&[joint], x.subrows(0, 0)).unwrap();
    assert_eq!(nothing.log_densities(), [0.0; M]);
    let none = context_evidence(&[], x.as_ref()).unwrap_err();
    assert_eq!(none, MtgpError::NoJoints);
}

#[test]
fn a_few_pivots_give_the_densities_of_the_dense_path() {
    let draw = four_tasks_of_rank_two(3, 40);
    let (x, torques) = new_samples();
    let options = LikelihoodOptions {
        method: Method::Certified,
        ..LikelihoodOptions::dense()
    };
    let (covariance, inputs) = (draw.truth.clone(), draw.data.inputs());
    let few = Posterior::new(covariance, draw.noise_std, inputs, &draw.targets, options).unwrap();
    let evidence = |model: &Posterior<MultiTaskCovariance>| {
        let torques = &torques;
        context_evidence(&[JointTorques { model, torques }], x.as_ref()).unwrap()
    };
    let (few, all) = (evidence(&few), evidence(&dense(&draw)));
    for (a, b) in few.log_densities().iter().zip(all.log_densities()) {
        assert!((a - b).abs() <= 1e-5 * b.abs(), "{a} {b}");
    }
}

#[test]
fn fixed_task_matrices_and_separate_models_have_their_own_ratio() {
    let draw = four_tasks_of_rank_two(5, 6);
    let (x, torques) = new_samples();
    let n_tasks = M;
    for task in [
        TaskCovariance::Identity { n_tasks },
        TaskCovariance::Ones { n_tasks },
    ] {
        let truth = MultiTaskCovariance::new(draw.truth.input().clone(), task);
        let draw = Draw {
            truth,
            ..four_tasks_of_rank_two(5, 6)
        };
        let model = dense(&draw);
        let joint = JointTorques {
            model: &model,
            torques: &torques,
        };
        let evidence = context_evidence(&[joint], x.as_ref()).unwrap();
        for (context, value) in evidence.log_densities().iter().enumerate() {
            let rows = with_task(x.as_ref(), context);
            let old = (draw.data.inputs(), draw.targets.as_slice());
            let new = (rows.as_ref(), torques.as_slice());
            assert_close("fixed", *value, ratio(&draw.truth, 0.05, old, new));
        }
    }

    // Contexts with a model each: the samples of one context, its covariance alone.
    let input = draw.truth.input();
    let of_task = |task: usize| {
        let rows: Vec<usize> = (0..draw.targets.len())
            .filter(|&row| draw.data.tasks()[row] == task)
            .collect();
        let x = Mat::from_fn(rows.len(), 3, |row, col| {
            draw.data.covariates()[(rows[row], col)]
        });
        let targets: Vec<f64> = rows.iter().map(|&row| draw.targets[row]).collect();
        (x, targets)
    };
    let models: Vec<_> = (0..M)
        .map(|task| {
            let (x, targets) = of_task(task);
            Posterior::dense(input.clone(), 0.05, x.as_ref(), &targets)
        })
        .map(|posterior| posterior.unwrap())
        .collect();
    let joint = JointTorques {
        model: &models,
        torques: &torques,
    };
    let evidence = context_evidence(&[joint], x.as_ref()).unwrap();
    for (context, value) in evidence.log_densities().iter().enumerate() {
        let (x_old, targets) = of_task(context);
        let old = (x_old.as_ref(), targets.as_slice());
        let expected = ratio(input, 0.05, old, (x.as_ref(), &torques));
        assert_close("separate", *value, expected);
    }
}

#[test]
fn probabilities_sum_to_one_a_thousand_nats_apart() {
    let prior = ContextPrior::uniform(3).unwrap();
    let posterior = ContextPosterior::new(&[-2e3, -1e3, -3e3], &prior).unwrap();
    assert_eq!(posterior.probabilities(), [0.0, 1.0, 0.0]);
    for (log, expected) in posterior.log_probabilities().iter().zip([-1e3, 0.0, -2e3]) {
        assert!((log - expected).abs() <= 3e3 * f64::EPSILON, "{log}");
    }
    assert_eq!(posterior.most_probable(), 1);

    let close = ContextPosterior::new(&[1e3, 1e3, -1e3], &prior).unwrap();
    let sum: f64 = close.probabilities().iter().sum();
    assert!((sum - 1.0).abs() <= 4.0 * f64::EPSILON, "{sum}");
    assert!((close.probabilities()[0] - 0.5).abs() <= 1e3 * f64::EPSILON);
}

#[test]
fn the_order_of_contexts_does_not_matter() {
    let (densities, weights) = ([3.0, -1.0, 2.5], [0.2, 0.7, 0.1]);
    let prior = ContextPrior::from_weights(&weights).unwrap();
    let posterior = ContextPosterior::new(&densities, &prior).unwrap();
    let order = [2, 0, 1];
    let prior = ContextPrior::from_weights(&order.map(|idx| 10.0 * weights[idx])).unwrap();
    let permuted = ContextPosterior::new(&order.map(|idx| densities[idx]), &prior).unwrap();
    for (place, &idx) in order.iter().enumerate() {
        let (a, b) = (
            permuted.probabilities()[place],
            posterior.probabilities()[idx],
        );
        assert!((a - b).abs() <= 8.0 * f64::EPSILON, "{a} {b}");
    }
}

#[test]
fn data_and_priors_that_say_nothing_are_refused() {
    let draw = four_tasks_of_rank_two(1, 4);
    let model = dense(&draw);
    let (mut x, mut torques) = new_samples();
    let refused = |x: &Mat<f64>, torques: &[f64]| {
        let joint = JointTorques {
            model: &model,
            torques,
        };
        context_evidence(&[joint], x.as_ref()).unwrap_err()
    };
    let short = refused(&x, &torques[1..]).to_string();
    assert_eq!(short, "4 new torques of a joint, expected 5");
    torques[2] = f64::NAN;
    assert!(matches!(
        refused(&x, &torques),
        MtgpError::Gp(GpError::NonFiniteTarget { row: 2, .. })
    ));
    torques[2] = 1e200;
    assert!(matches!(
        refused(&x, &torques),
        MtgpError::Gp(GpError::NonFiniteLikelihood { n_samples: 5 })
    ));
    x[(1, 2)] = f64::NAN;
    assert!(matches!(
        refused(&x, &torques),
        MtgpError::Gp(GpError::NonFiniteInput {
            row: 1,
            column: 2,
            ..
        })
    ));
    let narrow = Mat::zeros(5, 2);
    assert!(matches!(
        refused(&narrow, &torques),
        MtgpError::Gp(GpError::WrongCovariates {
            found: 2,
            expected: 3
        })
    ));

    for weights in [[0.5, -0.5, 1.0], [0.0; 3], [1.0, f64::NAN, 0.0]] {
        let error = ContextPrior::from_weights(&weights).unwrap_err();
        assert!(
            matches!(error, MtgpError::NotProbabilities { .. }),
            "{error}"
        );
    }
    assert_eq!(ContextPrior::uniform(0), Err(MtgpError::NoTasks));
    let prior = ContextPrior::from_weights(&[1.0, 0.0]).unwrap();
    for densities in [[f64::NAN, 0.0], [f64::NEG_INFINITY, 0.0]] {
        let posterior = ContextPosterior::new(&densities, &prior);
        assert_eq!(posterior, Err(MtgpError::NoUsableDensity));
    }
    assert_eq!(model.n_contexts(), M);
}
