//! A cube that is picked up: weighed from twenty rows of a motion of its own.

use puma_dyn::Payload;
use torque_model::rigid_body::FitSettings;
use torque_model::{Adapt, Provenance, RobotModel, Samples, adapt};

use crate::coverage::learned;
use crate::simulated_arm::SimulatedArm;

/// kg.
const MASS: f64 = 3.0;
/// N·m.
const NOISE: f64 = 0.1;
const SEEDS: u64 = 20;

/// Twenty rows, half a second apart, of a motion with the cube.
fn twenty_rows(arm: &SimulatedArm) -> Samples {
    let log = arm.log(1, &[(1, 10.0)]);
    let rows: Vec<usize> = (0..20).map(|row| 25 + 50 * row).collect();
    let mut few = log.rows(&rows);
    few.contexts.clear();
    few.context_of.clear();
    few
}

fn bare(arm: &SimulatedArm) -> RobotModel {
    let mut log = arm.log(0, &[(0, 10.0), (0, 10.0), (0, 10.0), (0, 10.0)]);
    log.contexts.truncate(1);
    learned(&log, None, FitSettings::default().least_correlation)
}

#[test]
fn a_cube_of_three_kilograms_is_weighed_to_one_percent_from_twenty_rows() {
    let cube = Payload::cuboid(MASS, [0.1; 3], [0.02, -0.01, 0.08], [0.0; 3]).unwrap();
    let (mut n_inside, mut worst) = (0, 0.0_f64);
    for seed in 0..SEEDS {
        let arm = SimulatedArm::as_described(seed, &[cube], NOISE);
        let model = bare(&arm);
        let grown = adapt(
            &model,
            "cube",
            &twenty_rows(&arm),
            Adapt::default(),
            Provenance::new("test", b""),
        )
        .unwrap();
        let posterior = grown.rigid_body().unwrap();
        let (truth, std) = (arm.load(1), posterior.std());
        let load = posterior.unknowns().load(0);
        worst = worst.max((posterior.mean()[load.start] / MASS - 1.0).abs());
        let z = load
            .zip(&truth)
            .map(|(k, truth)| (posterior.mean()[k] - truth) / std[k]);
        let z: Vec<f64> = z.collect();
        n_inside += z.iter().filter(|z| z.abs() < 1.96).count();
    }
    assert!(worst < 0.01, "{worst}");
    // 190 of 200 where they were independent; ten numbers that move together make 180 of them.
    assert!(n_inside >= 180, "{n_inside} of {}", 10 * SEEDS);
}
