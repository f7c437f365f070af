//! A robot's parameters for all joints and loads: learned, written, read, and asked in a loop.

use faer::Mat;
use torque_model::learn::SharedParameters;
use torque_model::rigid_body::{FitSettings, TermSet};
use torque_model::{
    Adapt, ContinuousJoints, JointModel, JointTorques, ModelFileError, ModelFileKind, Provenance,
    Robot, RobotModel, RobotSource, Samples, Timeline, adapt,
};

pub const FOLDER: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../../fixtures/torque-model/real_robot"
);

pub fn samples(name: &str) -> Samples {
    let reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .from_path(format!("{FOLDER}/{name}"));
    let mut reader = reader.unwrap();
    let header = reader.headers().unwrap().clone();
    let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    let column = |name: &str| header.iter().position(|of| of == name).unwrap();
    let number = |row: usize, name: &str| -> f64 { rows[row][column(name)].parse().unwrap() };
    let (mut contexts, mut runs) = (Vec::new(), Vec::new());
    let place = |names: &mut Vec<String>, name: &str| {
        names.iter().position(|of| of == name).unwrap_or_else(|| {
            names.push(name.to_owned());
            names.len() - 1
        })
    };
    let of = |names: &mut Vec<String>, label: &str| -> Vec<usize> {
        let labels = rows.iter().map(|row| &row[column(label)]);
        labels.map(|label| place(names, label)).collect()
    };
    let context_of = of(&mut contexts, "context");
    let run_of = of(&mut runs, "run");
    let torques = |joint_idx: usize| JointTorques {
        joint_idx,
        values: (0..rows.len())
            .map(|row| number(row, ["tau1", "tau2"][joint_idx]))
            .collect(),
    };
    Samples {
        joint_names: vec!["joint1".to_owned(), "joint2".to_owned()],
        contexts,
        context_of,
        x: Mat::from_fn(rows.len(), 6, |row, col| {
            number(row, ["q1", "q2", "qd1", "qd2", "qdd1", "qdd2"][col])
        }),
        torques: vec![torques(0), torques(1)],
        timeline: Timeline {
            run_of,
            run_names: runs,
            t: (0..rows.len()).map(|row| number(row, "t")).collect(),
            ..Timeline::default()
        },
        continuous: ContinuousJoints::none(),
    }
}

pub fn model() -> RobotModel {
    let urdf = std::fs::read_to_string(format!("{FOLDER}/planar2.urdf")).unwrap();
    let source = RobotSource {
        urdf: Some(urdf),
        sidecar: None,
        gravity: None,
    };
    let learner = SharedParameters {
        robot: Robot::new(source, "planar2.urdf").unwrap(),
        terms: Some(TermSet::Full),
        settings: FitSettings {
            bare: vec!["free".to_owned()],
            ..FitSettings::default()
        },
    };
    let mut samples = samples("c_train.csv");
    samples.joint_names = learner.robot.model.joint_names().to_vec();
    RobotModel::learn(&samples, &learner, Provenance::new("test", b"")).unwrap()
}

fn states(model: &RobotModel) -> Mat<f64> {
    let samples = samples("c_test.csv");
    model.states_of(&samples).unwrap().into_owned()
}

#[test]
fn the_loop_predicts_what_the_posterior_says() {
    let model = model();
    let x = states(&model);
    for context in 0..3 {
        let predictions = model.predict(context, x.as_ref()).unwrap();
        for (joint, of_joint) in predictions.iter().enumerate() {
            let posterior = model.rigid_body().unwrap();
            let (mean, var) = posterior.predict_joint(joint, context, x.as_ref()).unwrap();
            for row in 0..x.nrows() {
                // Sums of some forty terms in another order; variances are sums of squares.
                let scale = mean[row].abs() + 1.0;
                assert!((of_joint.mean[row] - mean[row]).abs() < 1e-11 * scale);
                assert!((of_joint.var[row] / var[row] - 1.0).abs() < 1e-9);
            }
        }
    }
}

#[test]
fn all_contexts_at_once_are_each_of_them() {
    let model = model();
    let x = states(&model);
    for (_, joint) in model.learned() {
        let JointModel::Shared(of_joint) = joint else {
            panic!("not of shared parameters");
        };
        let all = of_joint.predict_mean_of_all_contexts(x.as_ref()).unwrap();
        assert_eq!((all.nrows(), all.ncols()), (x.nrows(), 3));
        for context in 0..3 {
            let one = joint.predict(context, x.as_ref()).unwrap().mean;
            assert_eq!(all.col_as_slice(context), one);
        }
    }
}

#[test]
fn a_file_predicts_bit_for_bit() {
    let model = model();
    let bytes = model.to_bytes();
    assert_eq!(
        ModelFileKind::of(&bytes),
        Ok(ModelFileKind::SharedParameters)
    );
    let loaded = RobotModel::from_bytes(&bytes).unwrap();
    let x = states(&model);
    assert_eq!(
        loaded.predict(1, x.as_ref()).unwrap(),
        model.predict(1, x.as_ref()).unwrap()
    );
    assert_eq!(loaded.to_bytes(), bytes);
    let mut altered = bytes.clone();
    altered[bytes.len() / 2] ^= 1;
    assert!(matches!(
        RobotModel::from_bytes(&altered),
        Err(ModelFileError::Altered)
    ));
}

#[test]
fn a_loop_with_memory_allocates_nothing() {
    let model = model();
    let predictor = model.predictor();
    let mut memory = model.hysteresis();
    let mut scratch = predictor.scratch();
    let mut x = vec![0.1; predictor.n_covariates()];
    let (mut mean, mut var, mut noise) = ([0.0; 2], [0.0; 2], [0.0; 2]);
    let report = allocation_counter::measure(|| {
        for tick in 0..200 {
            let qd = [0.3, -0.2 + f64::from(tick) * 1e-3];
            memory.advance(&qd, 1e-3);
            x[2..4].copy_from_slice(&qd);
            x[6..].copy_from_slice(memory.states());
            let result = predictor.predict_into(2, &mut scratch, &x, &mut mean, &mut var);
            assert_eq!(result, Ok(()));
            predictor.noise_vars_into(&x, &mut noise);
            assert!(noise.iter().chain(&var).all(|var| *var > 0.0));
        }
    });
    assert_eq!(report.count_total, 0, "{report:?}");
}

#[test]
fn fits_are_the_same_bits_for_any_number_of_threads() {
    let on = |n_threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(n_threads)
            .build();
        pool.unwrap().install(|| model().to_bytes())
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn a_load_is_added_and_a_known_one_learns_more() {
    let model = model();
    let mut new = samples("c_new_load.csv");
    new.contexts.clear();
    new.context_of.clear();
    let provenance = || Provenance::new("test", b"new");
    let grown = adapt(&model, "C", &new, Adapt::default(), provenance()).unwrap();
    assert_eq!(grown.contexts(), ["free", "A", "B", "C"]);
    // 0.9 kg in truth, told from the torques of ten rows.
    let mass = |model: &RobotModel, context: usize| {
        let posterior = model.rigid_body().unwrap();
        let load = posterior
            .unknowns()
            .load(posterior.load_of(context).unwrap())
            .start;
        (posterior.mean()[load], posterior.std()[load])
    };
    let (value, std) = mass(&grown, 3);
    assert!(
        (value - 0.9).abs() < 3.0 * std && std < 0.5,
        "{value} ± {std}"
    );
    let again = adapt(&grown, "C", &new, Adapt::default(), provenance()).unwrap();
    assert_eq!(again.contexts().len(), 4);
    assert!(mass(&again, 3).1 < std);
    assert!(matches!(again.learned()[0].1, JointModel::Shared(_)));
}
