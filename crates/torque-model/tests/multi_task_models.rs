//! Models of three contexts to save, load and ask.

use faer::Mat;
use gp_core::{FitSummary, LikelihoodOptions, Method, Posterior, Provenance, TrainingRanges};
use kernels::{TorqueCovariance, TorqueParams};
use mtgp::latent::LatentFunctions;
use mtgp::prior::TaskRow;
use mtgp::{ModelParts, MultiTaskCovariance, MultiTaskModel, RankSelection, Stacked, TaskCovariance, TaskFactor, TaskProcess, with_task};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

pub const N_JOINTS: usize = 2;
pub const CONTEXTS: [&str; 3] = ["none", "brick", "c7, heavy"];

pub fn inputs(seed: u64, n: usize) -> Mat<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    Mat::from_fn(n, 3 * N_JOINTS, |_, _| rng.random_range(-1.0..1.0))
}

fn process(data: &Stacked, torques: &[f64], task: TaskCovariance, method: Method) -> TaskProcess {
    let input = TorqueCovariance::new(TorqueParams {
        bias_std: 0.8,
        linear_std: vec![0.7; 3 * N_JOINTS],
        signal_std: 1.1,
        length_scales: vec![2.5; 3 * N_JOINTS],
        coulomb_std: Some(vec![0.6; N_JOINTS]),
    });
    let prior = MultiTaskCovariance::new(input.unwrap(), task);
    let options = LikelihoodOptions {
        method,
        certificate: 1e-3,
    };
    let targets = data.stack(torques);
    let posterior = Posterior::new(prior, 0.1, data.inputs(), &targets, options).unwrap();
    TaskProcess {
        summary: FitSummary {
            log_marginal: -3.5,
            start: "A.3 from iGP".to_owned(),
            n_starts: 2,
            evaluations: 12,
            bounds_hit: vec!["noise_std".to_owned()],
            condition_lower_bound: 10.0,
            method: "dense".to_owned(),
            rank: posterior.rank(),
            error_bound: None,
        },
        posterior,
    }
}

/// A dense mGP-2 and a certified one, or iGP and pGP.
pub fn model(n: usize, has_fixed_tasks: bool) -> MultiTaskModel {
    let x = inputs(1, n);
    let tasks: Vec<usize> = (0..n).map(|row| (row * row + 1) % 3).collect();
    let tasks: Vec<usize> = if n < 6 {
        (0..n).map(|row| row % 3).collect()
    } else {
        tasks
            .iter()
            .enumerate()
            .map(|(row, task)| if row % 4 == 3 { 0 } else { *task })
            .collect()
    };
    let data = Stacked::new(x.as_ref(), &tasks, 3).unwrap();
    let torque = |row: usize| 2.0 * x[(row, 0)] * (1.0 + tasks[row] as f64) + x[(row, 3)].signum();
    let torques: Vec<f64> = (0..n).map(torque).collect();
    let factor = TaskFactor::from_entries(3, 2, &[1.1, -0.7, 0.6, 0.3, -0.8]).unwrap();
    let n_tasks = 3;
    let (first, second) = if has_fixed_tasks {
        (
            TaskCovariance::Identity { n_tasks },
            TaskCovariance::Ones { n_tasks },
        )
    } else {
        (
            TaskCovariance::Factor(factor.clone()),
            TaskCovariance::Factor(factor),
        )
    };
    let range = TrainingRanges::of(x.as_ref()).unwrap();
    MultiTaskModel::new(ModelParts {
        joint_names: vec!["base".to_owned(), "elbow".to_owned()],
        contexts: CONTEXTS.map(str::to_owned).to_vec(),
        learned: vec![
            (0, process(&data, &torques, first, Method::Dense)),
            (1, process(&data, &torques, second, Method::Certified)),
        ],
        ranges: range.clone(),
        context_ranges: vec![range; 3],
        selection: Some(RankSelection {
            criterion: "BIC".to_owned(),
            values: vec![(1, 5.0), (2, 4.5)],
        }),
        provenance: Provenance {
            data_sha256: [7; 32],
            robot_sha256: None,
            program: "test".to_owned(),
            context: String::new(),
        },
    })
    .unwrap()
}

#[test]
fn a_prediction_is_that_of_the_posterior_at_rows_of_the_task() {
    let model = model(60, false);
    let x = inputs(5, 7);
    for (task, context) in CONTEXTS.iter().enumerate() {
        let predictions = model.predict(context, x.as_ref()).unwrap();
        for (prediction, (joint_idx, process)) in predictions.iter().zip(model.learned()) {
            let rows = with_task(x.as_ref(), task);
            let expected = process.posterior.predict(rows.as_ref()).unwrap();
            assert_eq!(prediction.mean, expected.mean);
            assert_eq!(prediction.var, expected.var);
            assert_eq!(prediction.joint_idx, *joint_idx);
        }
    }
    let error = model.predict("c9", x.as_ref()).unwrap_err();
    let expected = "unknown context `c9`; the model has none, brick, c7, heavy";
    assert_eq!(error.to_string(), expected);
}

#[test]
fn the_predictor_says_what_the_model_says_in_every_context() {
    for has_fixed_tasks in [false, true] {
        for n in [5, 60, 200] {
            let model = model(n, has_fixed_tasks);
            let predictor = model.predictor();
            let mut scratch = predictor.scratch();
            let (mut mean, mut var) = ([0.0; 2], [0.0; 2]);
            let x = inputs(6, 20);
            for row in 0..x.nrows() {
                let state: Vec<f64> = x.row(row).iter().copied().collect();
                // Another context at every state.
                for (number, context) in CONTEXTS.iter().enumerate() {
                    let expected = model.predict(context, x.subrows(row, 1)).unwrap();
                    assert_eq!(predictor.number_of(context).unwrap(), number);
                    let result =
                        predictor.predict_into(number, &mut scratch, &state, &mut mean, &mut var);
                    assert!(result.is_ok());
                    for (joint, expected) in expected.iter().enumerate() {
                        let (m, v) = (expected.mean[0], expected.var[0]);
                        // |β| ≤ |t|/σ² and K has entries below 10: a few roundings of n |β| K.
                        let scale = n as f64 * 500.0 * 10.0;
                        let tolerance = 8.0 * f64::EPSILON * scale;
                        assert!(
                            (mean[joint] - m).abs() <= tolerance,
                            "{n}: {} {m}",
                            mean[joint]
                        );
                        assert!(
                            (var[joint] - v).abs() <= tolerance,
                            "{n}: {} {v}",
                            var[joint]
                        );
                    }
                }
            }
        }
    }
}

/// Λ with one more row, of the kinds that [`model`] makes.
fn new_rows(has_fixed_tasks: bool) -> Vec<TaskRow> {
    let row = |entries: &[f64]| TaskRow::in_span(entries.to_vec());
    if has_fixed_tasks {
        vec![row(&[0.4, -0.3, 1.2]), row(&[0.7])]
    } else {
        vec![row(&[0.9, -0.4]), row(&[0.2, 1.3])]
    }
}

#[test]
fn a_grown_model_predicts_the_old_contexts_to_the_bit_and_the_new_one_by_its_row() {
    let x = inputs(5, 7);
    for has_fixed_tasks in [false, true] {
        for n in [5, 60, 200] {
            let model = model(n, has_fixed_tasks);
            let rows = new_rows(has_fixed_tasks);
            let ranges = TrainingRanges::of(x.as_ref()).unwrap();
            let grown = model.with_context("new", &rows, ranges).unwrap();
            let grown = MultiTaskModel::from_bytes(&grown.to_bytes()).unwrap();
            for context in CONTEXTS {
                let before = model.predict(context, x.as_ref()).unwrap();
                assert_eq!(grown.predict(context, x.as_ref()).unwrap(), before);
            }
            let found = grown.predict("new", x.as_ref()).unwrap();
            for ((found, row), (_, process)) in found.iter().zip(&rows).zip(model.learned()) {
                let latent = LatentFunctions::new(&process.posterior, x.as_ref()).unwrap();
                let covariance = latent.covariance_of(row);
                let mean = latent.mean_of(&row.entries);
                // As for the predictor above.
                let tolerance = 8.0 * f64::EPSILON * n as f64 * 500.0 * 10.0;
                for idx in 0..x.nrows() {
                    let (m, v) = (found.mean[idx], found.var[idx]);
                    assert!((m - mean[idx]).abs() <= tolerance, "{m} {}", mean[idx]);
                    let expected = covariance[(idx, idx)];
                    assert!((v - expected).abs() <= tolerance, "{v} {expected}");
                }
            }
        }
    }
}

#[test]
fn a_model_that_holds_new_samples_is_read_back_and_predicts_to_the_bit_what_it_did() {
    let model = model(60, false);
    let x = inputs(5, 7);
    let ranges = TrainingRanges::of(x.as_ref()).unwrap();
    let torques = [0.3, -0.2].map(|scale| (0..7).map(|i| scale * f64::from(i)).collect());
    let grown = model.with_context("new", &new_rows(false), ranges).unwrap();
    let adapted = grown.with_samples("new", x.as_ref(), &torques).unwrap();
    let read = MultiTaskModel::from_bytes(&adapted.to_bytes()).unwrap();
    let elsewhere = inputs(6, 9);
    for context in CONTEXTS.iter().chain(&["new"]) {
        let found = read.predict(context, elsewhere.as_ref()).unwrap();
        assert_eq!(found, adapted.predict(context, elsewhere.as_ref()).unwrap());
        assert_ne!(found, grown.predict(context, elsewhere.as_ref()).unwrap());
    }
    // Closer to the torques than the row alone; half as much as the noise and the 60 other samples let it.
    let error = |model: &MultiTaskModel| -> f64 {
        let predictions = model.predict("new", x.as_ref()).unwrap();
        let of_joint = predictions.iter().zip(&torques);
        let errors = of_joint.flat_map(|(p, t): (_, &Vec<f64>)| p.mean.iter().zip(t));
        errors.map(|(mean, torque)| (mean - torque).powi(2)).sum()
    };
    assert!(
        error(&read) < 0.25 * error(&grown),
        "{} {}",
        error(&read),
        error(&grown)
    );

    let mut bytes = adapted.to_bytes();
    let last = bytes.len() - 1;
    bytes[last] ^= 1;
    assert!(MultiTaskModel::from_bytes(&bytes).is_err());
    let error = adapted
        .with_samples("c9", x.as_ref(), &torques)
        .unwrap_err();
    assert!(
        error.to_string().contains("unknown context `c9`"),
        "{error}"
    );
    let error = adapted.with_samples("new", x.as_ref(), &torques[..1]);
    assert!(error.unwrap_err().to_string().contains("torques of joints"));
}

#[test]
fn a_context_that_does_not_fit_is_refused() {
    let model = model(12, false);
    let ranges = TrainingRanges::of(inputs(5, 7).as_ref()).unwrap();
    let rows = new_rows(false);
    let refused = |name: &str, rows: &[TaskRow]| {
        let grown = model.with_context(name, rows, ranges.clone());
        grown.unwrap_err().to_string()
    };
    assert!(refused("brick", &rows).contains("two contexts are named brick"));
    assert!(refused("new", &rows[..1]).contains("rows of joints"));
    let longer = TaskRow::in_span(vec![1.0; 3]);
    assert!(refused("new", &[longer, rows[1].clone()]).contains("entries of a task's row"));
    let not_finite = TaskRow::in_span(vec![1.0, f64::NAN]);
    assert!(refused("new", &[rows[0].clone(), not_finite]).contains("NaN"));
    let own = TaskRow {
        own_std: 0.5,
        ..rows[0].clone()
    };
    assert!(refused("new", &[own, rows[1].clone()]).contains("columns of task_factor"));
}

#[test]
fn switching_the_context_allocates_nothing() {
    let model = model(200, false);
    let predictor = model.predictor();
    let mut scratch = predictor.scratch();
    let (mut mean, mut var) = ([0.0; 2], [0.0; 2]);
    let report = allocation_counter::measure(|| {
        for (value, context) in [(0.1, 2), (-1.0, 0), (1e200, 1), (f64::NAN, 2), (0.3, 1)] {
            let x = [value; 3 * N_JOINTS];
            let result = predictor.predict_into(context, &mut scratch, &x, &mut mean, &mut var);
            assert_eq!(result.is_ok(), f64::is_finite(value));
        }
    });
    assert_eq!(report.count_total, 0, "{report:?}");
}

#[test]
fn parts_that_do_not_fit_are_refused() {
    let refused = |change: fn(&mut ModelParts)| {
        let mut parts = model(12, false).parts().clone();
        change(&mut parts);
        MultiTaskModel::new(parts).unwrap_err().to_string()
    };
    let message = |what: &str| format!("inconsistent model: {what}");
    for (found, expected) in [
        (
            refused(|p| p.contexts.clear()),
            "2 joints, 0 contexts, 2 models",
        ),
        (
            refused(|p| p.contexts[1] = "none".to_owned()),
            "two contexts are named none",
        ),
        (
            refused(|p| p.joint_names[1] = "base".to_owned()),
            "two joints are named base",
        ),
        (
            refused(|p| p.learned.reverse()),
            "joint indices do not ascend",
        ),
        (refused(|p| p.learned[1].0 = 2), "a model for joint 2 of 2"),
        (
            refused(|p| p.contexts.push("c4".to_owned())),
            "joint 0's model is for 2 joints and 3 contexts, not 2 and 4",
        ),
        (
            refused(|p| _ = p.context_ranges.pop()),
            "ranges of 2 contexts, not 3",
        ),
    ] {
        assert_eq!(found, message(expected));
    }
}
