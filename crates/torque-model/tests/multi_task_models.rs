//! Models of three contexts to save, load and ask.

use faer::Mat;
use gp_core::{LikelihoodOptions, Method, Posterior};
use kernels::{TorqueCovariance, TorqueParams};
use mtgp::latent::LatentFunctions;
use mtgp::prior::{TaskCovariance, TaskRow};
use mtgp::{MtgpError, MultiTaskCovariance, Stacked, TaskFactor, with_task};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use torque_model::{
    Adapt, FitSummary, JointModel, JointPrediction, JointTorques, ModelParts, Provenance,
    RankSelection, RobotModel, Samples, TaskProcess, Timeline, TorqueError, TrainingRanges, adapt,
    adapt_joint,
};

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
    let rank = posterior.rank();
    TaskProcess::of_tasks(
        posterior,
        FitSummary {
            log_marginal: -3.5,
            start: "A.3 from iGP".to_owned(),
            n_starts: 2,
            evaluations: 12,
            bounds_hit: vec!["noise_std".to_owned()],
            condition_lower_bound: 10.0,
            method: "dense".to_owned(),
            rank,
            error_bound: None,
        },
    )
}

/// A dense mGP-2 and a certified one, or iGP and pGP.
pub fn model(n: usize, has_fixed_tasks: bool) -> RobotModel {
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
    RobotModel::new(ModelParts {
        joint_names: vec!["base".to_owned(), "elbow".to_owned()],
        contexts: CONTEXTS.map(str::to_owned).to_vec(),
        learned: vec![
            (0, process(&data, &torques, first, Method::Dense).into()),
            (
                1,
                process(&data, &torques, second, Method::Certified).into(),
            ),
        ],
        ranges: range.clone(),
        context_ranges: vec![range; 3],
        selection: Some(RankSelection {
            criterion: "BIC".to_owned(),
            values: vec![(1, 5.0), (2, 4.5)],
        }),
        robot: None,
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
        assert_eq!(model.number_of(context), Ok(task));
        for (place, (_, process)) in model.tasks().enumerate() {
            let rows = with_task(x.as_ref(), task);
            let expected = process.posterior.predict(rows.as_ref()).unwrap();
            let found = model.predict_joint(place, task, x.as_ref()).unwrap();
            assert_eq!((found.mean, found.var), (expected.mean, expected.var));
        }
    }
    let error = model.number_of("c9").unwrap_err();
    let expected = "unknown context `c9`; the model has none, brick, c7, heavy";
    assert_eq!(error.to_string(), expected);
    assert_eq!(model.predictor().number_of("c9").unwrap_err(), error);
    let error = model.predict_joint(0, 3, x.as_ref()).unwrap_err();
    assert!(matches!(
        error,
        TorqueError::Mtgp(MtgpError::UnknownTask { task: 3, .. })
    ));
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
                    assert_eq!(predictor.number_of(context).unwrap(), number);
                    let result =
                        predictor.predict_into(number, &mut scratch, &state, &mut mean, &mut var);
                    assert!(result.is_ok());
                    for joint in 0..2 {
                        let expected = model.predict_joint(joint, number, x.subrows(row, 1));
                        let expected = expected.unwrap();
                        let (m, v) = (expected.mean[0], expected.var[0]);
                        let tolerance = tolerance(n);
                        let found = (mean[joint], var[joint]);
                        assert!((found.0 - m).abs() <= tolerance, "{n}: {found:?} {m}");
                        assert!((found.1 - v).abs() <= tolerance, "{n}: {found:?} {v}");
                    }
                }
            }
        }
    }
}

/// |β| ≤ |t|/σ² and K has entries below 10: a few roundings of n |β| K.
fn tolerance(n: usize) -> f64 {
    8.0 * f64::EPSILON * n as f64 * 500.0 * 10.0
}

/// The model with one more context, by a given row of Λ for every joint.
fn with_context(model: &RobotModel, name: &str, rows: &[TaskRow]) -> Result<RobotModel, String> {
    let mut parts = model.parts().clone();
    for ((_, joint), row) in parts.learned.iter_mut().zip(rows) {
        let grown = joint.tasks().unwrap().with_row(row);
        *joint = grown.map_err(|error| error.to_string())?.into();
    }
    parts.contexts.push(name.to_owned());
    parts.context_ranges.push(parts.ranges.clone());
    RobotModel::new(parts).map_err(|error| error.to_string())
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
            let grown = with_context(&model, "new", &rows).unwrap();
            let grown = RobotModel::from_bytes(&grown.to_bytes()).unwrap();
            for context in 0..CONTEXTS.len() {
                let before = model.predict(context, x.as_ref()).unwrap();
                assert_eq!(grown.predict(context, x.as_ref()).unwrap(), before);
            }
            let new = grown.number_of("new").unwrap();
            let found = grown.predict(new, x.as_ref()).unwrap();
            for ((found, row), (_, process)) in found.iter().zip(&rows).zip(model.tasks()) {
                let latent = LatentFunctions::new(&process.posterior, x.as_ref()).unwrap();
                let covariance = latent.covariance_of(row);
                let mean = latent.mean_of(&row.entries);
                let tolerance = tolerance(n);
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
    let torques: [Vec<f64>; 2] =
        [0.3, -0.2].map(|scale| (0..7).map(|i| scale * f64::from(i)).collect());
    let grown = with_context(&model, "new", &new_rows(false)).unwrap();
    let mut parts = grown.parts().clone();
    for ((_, joint), torques) in parts.learned.iter_mut().zip(&torques) {
        let of_joint = joint.tasks().unwrap();
        let adapted = of_joint.with_samples(3, x.as_ref(), torques).unwrap();
        assert_eq!(
            joint.summary().unwrap().rank + 7,
            adapted.posterior.rank(),
            "seven more points"
        );
        *joint = adapted.into();
    }
    let adapted = RobotModel::new(parts).unwrap();
    let read = RobotModel::from_bytes(&adapted.to_bytes()).unwrap();
    let elsewhere = inputs(6, 9);
    for context in 0..4 {
        let found = read.predict(context, elsewhere.as_ref()).unwrap();
        assert_eq!(found, adapted.predict(context, elsewhere.as_ref()).unwrap());
        assert_ne!(found, grown.predict(context, elsewhere.as_ref()).unwrap());
    }
    // Closer to the torques than the row alone; half as much as the noise and the 60 other samples let it.
    let error = |model: &RobotModel| -> f64 {
        let predictions = model.predict(3, x.as_ref()).unwrap();
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
    assert!(RobotModel::from_bytes(&bytes).is_err());
    let (_, process) = adapted.tasks().next().unwrap();
    let error = process
        .with_samples(9, x.as_ref(), &torques[0])
        .unwrap_err();
    assert!(error.to_string().contains("task 9"), "{error}");
    assert!(
        process
            .with_samples(3, x.as_ref(), &torques[0][..1])
            .is_err()
    );
}

#[test]
fn a_context_that_does_not_fit_is_refused() {
    let model = model(12, false);
    let rows = new_rows(false);
    let refused = |name: &str, rows: &[TaskRow]| with_context(&model, name, rows).unwrap_err();
    assert!(refused("brick", &rows).contains("two contexts are named brick"));
    assert!(refused("new", &rows[..1]).contains("3 contexts, not 2 and 4"));
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

/// Torques of a load that is between the second and the third, of some joints.
fn new_load(joints: &[usize]) -> Samples {
    let x = inputs(9, 30);
    let values: Vec<f64> = (0..30)
        .map(|row| 5.0 * x[(row, 0)] + x[(row, 3)].signum())
        .collect();
    let of_joint = |&joint_idx: &usize| JointTorques {
        joint_idx,
        values: values.clone(),
    };
    let names = vec!["base".to_owned(), "elbow".to_owned()];
    Samples::of_one_context(names, x, joints.iter().map(of_joint).collect()).unwrap()
}

#[test]
fn a_model_of_many_loads_learns_one_more_from_its_torques() {
    let model = model(60, false);
    let samples = new_load(&[0, 1]);
    let provenance = model.parts().provenance.clone();
    let adapt_by = |how: Adapt| adapt(&model, "new", &samples, how, provenance.clone()).unwrap();
    let row_only = Adapt {
        is_row_only: true,
        ..Adapt::default()
    };
    let by_row = adapt_by(row_only);
    let x = inputs(5, 7);
    for context in 0..3 {
        let before = model.predict(context, x.as_ref()).unwrap();
        assert_eq!(by_row.predict(context, x.as_ref()).unwrap(), before);
    }
    let conditioned = adapt_by(Adapt::default());
    assert_eq!(conditioned.contexts().last().unwrap(), "new");
    assert_eq!(conditioned.context_ranges()[3], samples.ranges().unwrap());
    let error = |model: &RobotModel| -> f64 {
        let found = model.predict(3, samples.x.as_ref()).unwrap();
        let errors = found[0].mean.iter().zip(&samples.torques[0].values);
        errors.map(|(mean, torque)| (mean - torque).powi(2)).sum()
    };
    // The row is in the span of two latent functions; conditioning is not bound to it.
    let errors = (error(&conditioned), error(&by_row));
    assert!(errors.0 < 0.25 * errors.1, "{errors:?}");

    // A joint at a time it is the same.
    let (_, process) = model.tasks().next().unwrap();
    let torques = &samples.torques[0].values;
    let alone = adapt_joint(process, samples.x.as_ref(), torques, Adapt::default()).unwrap();
    let (_, together) = conditioned.tasks().next().unwrap();
    let basis = |process: &TaskProcess| process.posterior.basis().weights.clone();
    assert_eq!(basis(&alone), basis(together));
}

#[test]
fn rows_that_are_close_in_time_teach_a_new_load_as_much_as_fewer_that_are_not() {
    let model = model(60, false);
    let provenance = model.parts().provenance.clone();
    let few = new_load(&[0, 1]);
    let few = few.rows(&(0..12).collect::<Vec<_>>());
    // Each row five times, every 0.06 s: 60 rows of 0.06 s are 12 of 0.3 s.
    let each: Vec<usize> = (0..60).map(|row| row / 5).collect();
    let repeated = few.rows(&each);
    let timed = Samples {
        timeline: Timeline {
            t: (0..60).map(|row| 0.06 * f64::from(row)).collect(),
            ..Timeline::default()
        },
        ..repeated.clone()
    };
    let how = Adapt {
        most_rows: Some(60),
        ..Adapt::default()
    };
    let adapted = |samples: &Samples| {
        let grown = adapt(&model, "new", samples, how, provenance.clone()).unwrap();
        grown.predict(3, inputs(5, 7).as_ref()).unwrap()
    };
    let (once, weighted, counted) = (adapted(&few), adapted(&timed), adapted(&repeated));
    let mut farthest = 0.0_f64;
    for joint in 0..2 {
        for row in 0..7 {
            let of = |found: &[JointPrediction]| (found[joint].mean[row], found[joint].var[row]);
            let (once, weighted) = (of(&once), of(&weighted));
            // A search for the row ends at 1e-8 of the log density, 1e-4 of the row where that is curved.
            let error = (weighted.0 - once.0).abs();
            let tolerance = 1e-3 * once.0.abs().max(1.0);
            assert!(error < tolerance, "{weighted:?} {once:?}");
            assert!(
                (weighted.1 / once.1 - 1.0).abs() < 1e-2,
                "{weighted:?} {once:?}"
            );
            farthest = farthest.max((of(&counted).0 - once.0).abs());
        }
    }
    // Taken for independent they speak five times as loud beside the known loads' rows.
    assert!(farthest > 0.1, "{farthest}");
}

#[test]
fn what_cannot_be_adapted_is_refused() {
    let model = model(12, false);
    let provenance = || model.parts().provenance.clone();
    let refused = |model: &RobotModel, name: &str, samples: &Samples| {
        adapt(model, name, samples, Adapt::default(), provenance()).unwrap_err()
    };
    let error = refused(&model, "new", &new_load(&[1]));
    let expected = "inconsistent model: torques of joints [1] for models of [0, 1]";
    assert_eq!(error.to_string(), expected);
    let error = refused(&model, "brick", &new_load(&[0, 1]));
    assert!(error.to_string().contains("two contexts are named brick"));

    let x = inputs(3, 20);
    let linear = gp_core::BayesLinear::fit(
        x.as_ref(),
        &(0..20).map(f64::from).collect::<Vec<_>>(),
        gp_core::LinearForm::Smooth,
    );
    let of_one = RobotModel::new(ModelParts {
        contexts: Vec::new(),
        context_ranges: Vec::new(),
        learned: vec![(0, JointModel::from(linear.unwrap()))],
        ..model.parts().clone()
    });
    let error = refused(&of_one.unwrap(), "new", &new_load(&[0]));
    let expected = "a model of one context cannot learn another";
    assert_eq!(error.to_string(), expected);
}

#[test]
fn parts_that_do_not_fit_are_refused() {
    let refused = |change: fn(&mut ModelParts)| {
        let mut parts = model(12, false).parts().clone();
        change(&mut parts);
        RobotModel::new(parts).unwrap_err().to_string()
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
