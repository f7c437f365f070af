//! Error bars against the truth: arms drawn, logged with correlated noise, and learned by the one learner that is shipped.

use faer::Mat;
use linalg::symmetric_eigen;
use puma_dyn::puma560;
use torque_model::learn::SharedParameters;
use torque_model::rigid_body::{FitSettings, ParameterPosterior, TermSet};
use torque_model::{Provenance, Robot, RobotModel, RobotSource, Samples};

use crate::simulated_arm::{FrictionKind, SimulatedArm};

/// Half the width of a 95 % interval, in standard deviations.
const HALF_WIDTH: f64 = 1.96;
/// Part of the prior's variance that is left of a combination which the data fix.
const FIXED: f64 = 0.1;
const DRAWS: u64 = 20;

/// How often the truth is inside the 95 % interval, and how far it is from the estimate.
#[derive(Debug, Default, Clone, Copy)]
struct Coverage {
    n: f64,
    n_inside: f64,
    squares: f64,
}

impl Coverage {
    /// `z`: error over standard deviation.
    fn add(&mut self, z: f64) {
        self.n += 1.0;
        self.squares += z * z;
        self.n_inside += f64::from(u8::from(z.abs() < HALF_WIDTH));
    }

    fn inside(&self) -> f64 {
        self.n_inside / self.n
    }

    fn rms(&self) -> f64 {
        (self.squares / self.n).sqrt()
    }
}

/// Coverage of each kind of number.
#[derive(Debug, Default)]
struct Tally {
    links: Coverage,
    /// Combinations of the links' parameters that the data fix.
    link_combinations: Coverage,
    friction: Coverage,
    friction_combinations: Coverage,
    /// The ten numbers of each load.
    loads: Coverage,
    load_combinations: Coverage,
    /// Measured torques of motions that were not learned.
    torques: Coverage,
}

impl Tally {
    fn parameters(&self) -> [(&'static str, Coverage); 6] {
        [
            ("links", self.links),
            ("combinations of links", self.link_combinations),
            ("friction", self.friction),
            ("combinations of friction", self.friction_combinations),
            ("loads", self.loads),
            ("combinations of loads", self.load_combinations),
        ]
    }

    fn add(&mut self, arm: &SimulatedArm, model: &RobotModel) {
        let posterior = model.rigid_body().unwrap();
        let (truth, unknowns) = (arm.unknowns(posterior), posterior.unknowns());
        let judge = |of: Vec<usize>, own: &mut Coverage, combined: &mut Coverage| {
            let std = posterior.std();
            let of: Vec<usize> = of.into_iter().filter(|k| std[*k] > 0.0).collect();
            for k in &of {
                own.add((truth[*k] - posterior.mean()[*k]) / std[*k]);
            }
            add_combinations(posterior, &truth, &of, combined);
        };
        let bodies = unknowns.bodies().collect();
        judge(bodies, &mut self.links, &mut self.link_combinations);
        for joint in 0..unknowns.n_joints() {
            let of_joint = unknowns.friction(joint).collect();
            judge(
                of_joint,
                &mut self.friction,
                &mut self.friction_combinations,
            );
        }
        for load in 0..unknowns.n_loads() {
            let of_load = unknowns.load(load).collect();
            judge(of_load, &mut self.loads, &mut self.load_combinations);
        }
        add_torques(model, &arm.log(1, &runs(5.0)), &mut self.torques);
    }
}

/// Principal directions of the posterior, in standard deviations of the prior, along which the data are what is known.
fn add_combinations(
    posterior: &ParameterPosterior,
    truth: &[f64],
    of: &[usize],
    coverage: &mut Coverage,
) {
    let std: Vec<f64> = of.iter().map(|k| posterior.parts().prior_std[*k]).collect();
    let covariance = posterior.covariance_of(of);
    let scaled = Mat::from_fn(of.len(), of.len(), |row, col| {
        covariance[(row, col)] / (std[row] * std[col])
    });
    let eigen = symmetric_eigen(scaled.as_ref()).unwrap();
    for (column, var) in eigen
        .values
        .iter()
        .enumerate()
        .filter(|(_, var)| **var < FIXED)
    {
        let errors = of.iter().map(|k| truth[*k] - posterior.mean()[*k]);
        let along = (errors.zip(&std).enumerate())
            .map(|(row, (error, std))| eigen.vectors[(row, column)] * error / std);
        coverage.add(along.sum::<f64>() / var.sqrt());
    }
}

fn add_torques(model: &RobotModel, log: &Samples, coverage: &mut Coverage) {
    let states = model.states_of(log).unwrap();
    for context in 0..log.contexts.len() {
        let rows: Vec<usize> = (0..log.n_rows())
            .filter(|row| log.context_of[*row] == context)
            .collect();
        let x = Mat::from_fn(rows.len(), states.ncols(), |row, col| {
            states[(rows[row], col)]
        });
        for (of_joint, torques) in model
            .predict(context, x.as_ref())
            .unwrap()
            .iter()
            .zip(&log.torques)
        {
            for (k, row) in rows.iter().enumerate() {
                let std = (of_joint.var[k] + of_joint.noise_var[k]).sqrt();
                coverage.add((torques.values[*row] - of_joint.mean[k]) / std);
            }
        }
    }
}

/// Two runs without a load and with each of two.
pub fn runs(seconds: f64) -> [(usize, f64); 6] {
    [0, 1, 2, 0, 1, 2].map(|context| (context, seconds))
}

/// What is fitted of a log whose first context is bare.
pub fn learned(log: &Samples, terms: Option<TermSet>, least_correlation: f64) -> RobotModel {
    let learner = SharedParameters {
        terms,
        settings: FitSettings {
            bare: vec![log.contexts[0].clone()],
            least_correlation,
            ..FitSettings::default()
        },
        ..SharedParameters::new(Robot::new(RobotSource::puma560(), "puma560").unwrap())
    };
    RobotModel::learn(log, &learner, Provenance::new("test", b"")).unwrap()
}

fn tally(
    kind: FrictionKind,
    seconds: f64,
    terms: Option<TermSet>,
    least_correlation: f64,
) -> Tally {
    let mut tally = Tally::default();
    for seed in 0..DRAWS {
        let arm = SimulatedArm::draw(seed, kind, 2);
        let model = learned(&arm.log(0, &runs(seconds)), terms, least_correlation);
        tally.add(&arm, &model);
    }
    tally
}

fn require(what: &str, coverage: Coverage, least: f64, most: f64) {
    let inside = coverage.inside();
    assert!(
        (least..=most).contains(&inside),
        "{what}: {inside} of {} inside, errors {} standard deviations",
        coverage.n,
        coverage.rms()
    );
}

#[test]
fn true_parameters_and_torques_are_inside_their_intervals() {
    // Correlation as the residuals have it, without a least one.
    let tally = tally(FrictionKind::OfTheModel, 10.0, Some(TermSet::Full), 0.0);
    for (what, coverage) in tally.parameters() {
        require(what, coverage, 0.90, 0.99);
    }
    require("torques", tally.torques, 0.90, 0.99);
    // 20 draws with some thirty combinations each: √(1/(2 · 600)) is 3 %.
    let rms = tally.link_combinations.rms();
    assert!((rms - 1.0).abs() < 0.1, "{rms} standard deviations");
}

#[test]
fn intervals_with_chosen_friction_are_not_too_narrow() {
    let least = FitSettings::default().least_correlation;
    let tally = tally(FrictionKind::OfTheModel, 3.0, None, least);
    for (what, coverage) in tally.parameters() {
        require(what, coverage, 0.90, 1.0);
    }
    require("torques", tally.torques, 0.90, 0.99);
    // They are wider than they need be by what the least correlation is above that of the noise, 0.1 to 0.2 s: √(0.1/0.3).
    let rms = tally.link_combinations.rms();
    assert!(rms > (0.1_f64 / 0.3).sqrt(), "{rms} standard deviations");
}

#[test]
fn links_and_loads_keep_their_error_bars_where_friction_is_another() {
    let least = FitSettings::default().least_correlation;
    let tally = tally(FrictionKind::Other, 10.0, Some(TermSet::Full), least);
    for (what, coverage) in tally.parameters() {
        if !what.contains("friction") {
            require(what, coverage, 0.90, 1.0);
        }
    }
    require("torques", tally.torques, 0.90, 0.99);
}

/// The unknowns are as many as the arm has, so that a wrong truth would not go unnoticed.
#[test]
fn without_noise_the_truth_is_found() {
    let mut arm = SimulatedArm::draw(3, FrictionKind::OfTheModel, 2);
    arm.noise_std = [1e-6; puma560::N_JOINTS];
    let model = learned(&arm.log(0, &runs(10.0)), Some(TermSet::Full), 0.0);
    let posterior = model.rigid_body().unwrap();
    let (truth, std) = (arm.unknowns(posterior), posterior.parts().prior_std.clone());
    let load = posterior.unknowns().load(0);
    for unknown in load {
        let error = (truth[unknown] - posterior.mean()[unknown]) / std[unknown];
        assert!(error.abs() < 1e-3, "{unknown}: {error}");
    }
}
