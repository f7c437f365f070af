//! The data set against what is published about it, and its derivatives against spectral ones.

use std::f64::consts::PI;

use puma_dyn::chapter::{FigureOfEight, Tool, Trajectory};
use puma_dyn::dynamics::bias_acceleration;
use puma_dyn::{DynError, Scenario, Workspace, forward_kinematics, jacobian};

const REFERENCE: &str = include_str!("../../../fixtures/scenario.toml");

/// A run by the names of its path and speed.
fn run(scenario: &Scenario, path: &str, speed: &str) -> Trajectory {
    let (path_idx, speed_idx) = (
        scenario.path_idx(path).expect("a path"),
        scenario.speed_idx(speed).expect("a speed"),
    );
    scenario
        .trajectory(path_idx, speed_idx)
        .expect("a reachable path")
}

/// Smallest and largest of some numbers.
fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
        (low.min(v), high.max(v))
    })
}

/// Range of one joint's torque over loads c1 and c15.
fn torque_range(scenario: &Scenario, trajectory: &Trajectory, joint: usize) -> (f64, f64) {
    let torques = ["c1", "c15"]
        .map(|load| scenario.torques(trajectory, scenario.load_idx(load).expect("a load")));
    range(torques.iter().flatten().skip(joint - 1).step_by(6).copied())
}

#[test]
fn torque_ranges_are_those_of_an_independent_implementation() {
    // Stated to one or two decimals beside the scenario's values: half a unit of the last one.
    let scenario = Scenario::reference();
    let fast = run(&scenario, "p1", "s4");
    let slow = run(&scenario, "p4", "s1");
    for (trajectory, joint, expected, tolerance) in [
        (&fast, 3, (-36.6, 6.4), 0.05),
        (&slow, 3, (-28.7, 3.4), 0.05),
        (&fast, 6, (-2.32, 1.29), 0.005),
        (&slow, 6, (-0.92, 0.43), 0.005),
    ] {
        let found = torque_range(&scenario, trajectory, joint);
        let error = (found.0 - expected.0)
            .abs()
            .max((found.1 - expected.1).abs());
        assert!(error <= tolerance, "joint {joint}: {found:?} {expected:?}");
    }
}

#[test]
fn paths_leave_the_mechanical_ranges_and_are_reported_not_refused() {
    let scenario = Scenario::reference();
    let excesses = scenario.range_excesses().unwrap();
    let most = |joint_idx| {
        range(
            excesses
                .iter()
                .filter(|e| e.joint_idx == joint_idx)
                .flat_map(|e| [e.reached.0, e.reached.1]),
        )
    };
    // q1 up to 176°, q2 down to −148°.
    assert!(
        (most(0).1.to_degrees() - 176.0).abs() < 0.5,
        "{:?}",
        most(0)
    );
    assert!(
        (most(1).0.to_degrees() + 148.0).abs() < 0.5,
        "{:?}",
        most(1)
    );
    let text = excesses[0].to_string();
    assert!(
        text.starts_with("path p1: joint 1 moves over ")
            && text.ends_with("outside its mechanical range -160.0° … 160.0°"),
        "{text}"
    );
}

#[test]
fn first_three_principal_components_carry_the_published_half_of_the_variance() {
    // 54.6 % by an independent implementation; "about 50 %" in the chapter's fig. 3.
    let scenario = Scenario::reference();
    let states: Vec<f64> = scenario
        .trajectories()
        .unwrap()
        .into_iter()
        .flat_map(|t| t.states)
        .collect();
    let covariates = puma_dyn::nalgebra::DMatrix::from_row_slice(states.len() / 18, 18, &states);
    let standardised: Vec<_> = covariates
        .column_iter()
        .map(|column| {
            let centred = column.add_scalar(-column.mean());
            let norm = centred.norm();
            centred / norm
        })
        .collect();
    let standardised = puma_dyn::nalgebra::DMatrix::from_columns(&standardised);
    let mut eigenvalues: Vec<f64> = (standardised.transpose() * &standardised)
        .symmetric_eigenvalues()
        .iter()
        .copied()
        .collect();
    eigenvalues.sort_by(|a, b| b.total_cmp(a));
    let share = eigenvalues[..3].iter().sum::<f64>() / 18.0;
    assert!((share - 0.546).abs() < 5e-4, "{share}");
}

#[test]
fn the_fastest_run_is_the_slowest_with_rates_times_4_and_accelerations_times_16() {
    let scenario = Scenario::reference();
    for path in ["p1", "p4"] {
        let (slow, fast) = (run(&scenario, path, "s1"), run(&scenario, path, "s4"));
        for k in 0..slow.n_samples() {
            let ((q, qd, qdd), (q4, qd4, qdd4)) = (slow.state(k), fast.state(k));
            for j in 0..6 {
                // Exact: scaling by a power of two rounds nothing.
                let scaled = [q[j], 4.0 * qd[j], 16.0 * qdd[j]].map(f64::to_bits);
                assert_eq!(
                    scaled,
                    [q4[j], qd4[j], qdd4[j]].map(f64::to_bits),
                    "sample {k}, joint {}",
                    j + 1
                );
            }
        }
    }
}

#[test]
fn rates_and_accelerations_are_the_derivatives_of_the_trigonometric_interpolant() {
    // A smooth closed curve: its Fourier coefficients decay geometrically, so the interpolant through 4000 samples
    // is exact to rounding. 200 modes of 2001 suffice, and truncating the rest keeps ε·mode² from being amplified.
    let scenario = Scenario::reference();
    for (path, speed, duration) in [("p1", "s1", 20.0), ("p2", "s4", 5.0), ("p4", "s3", 10.0)] {
        let trajectory = run(&scenario, path, speed);
        let rate = 2.0 * PI / duration;
        for joint in 0..6 {
            let q: Vec<f64> = (0..trajectory.n_samples())
                .map(|k| trajectory.state(k).0[joint])
                .collect();
            let modes = fourier_modes(&q, 200);
            let last = modes.last().map(|&(a, b)| a.hypot(b)).unwrap();
            assert!(
                last < 1e-14,
                "{path} joint {}: mode 200 is {last:e}",
                joint + 1
            );
            for k in (0..q.len()).step_by(97) {
                let (first, second) = derivatives(&modes, 2.0 * PI * k as f64 / q.len() as f64);
                let (_, qd, qdd) = trajectory.state(k);
                // Σ modes² ε: rounding of each coefficient, amplified by its mode number once or twice.
                let error = (
                    (qd[joint] / rate - first).abs(),
                    (qdd[joint] / rate.powi(2) - second).abs(),
                );
                assert!(
                    error.0 < 1e-11 && error.1 < 1e-9,
                    "{path} joint {} sample {k}: {error:?}",
                    joint + 1
                );
            }
        }
    }
}

#[test]
fn the_wrist_follows_the_path_without_turning() {
    // The model's own forward kinematics, Jacobian and bias acceleration, which the data set does not use.
    let scenario = Scenario::reference();
    let (model, trajectory) = (scenario.model(), run(&scenario, "p3", "s2"));
    let path = FigureOfEight {
        centre: [0.55, 0.0, 0.44 - 0.6718],
        rotation: 10_f64.to_radians(),
        half_width: 0.10,
        half_height: 0.25,
    };
    let tool = Tool {
        offset: 0.15,
        pitch: -PI / 4.0,
        yaw: -10_f64.to_radians(),
    };
    let rate = 2.0 * PI / 15.0;
    let frame_idx = model.frame_idx("link6").unwrap();
    let mut workspace = Workspace::new(model);
    for k in (0..trajectory.n_samples()).step_by(97) {
        let (q, qd, qdd) = trajectory.state(k);
        let motion = path.motion(2.0 * PI * k as f64 / 4000.0);
        let expected = tool.wrist_pose(&motion.point);
        let pose = forward_kinematics(model, frame_idx, q);
        assert!(
            (pose.rotation - expected.rotation).amax() < 1e-13,
            "sample {k}: {pose:?}"
        );
        assert!(
            (pose.translation - expected.translation).amax() < 1e-13,
            "sample {k}: {pose:?}"
        );

        let mut rows = [0.0; 36];
        jacobian(model, frame_idx, q, &mut rows);
        let product = |i: usize, rates: &[f64]| -> f64 {
            rows[6 * i..6 * i + 6]
                .iter()
                .zip(rates)
                .map(|(a, b)| a * b)
                .sum()
        };
        let bias = bias_acceleration(model, &mut workspace, frame_idx, q, qd);
        for i in 0..6 {
            let (velocity, acceleration, bias) = match i {
                0..3 => (
                    motion.velocity[i] * rate,
                    motion.acceleration[i] * rate * rate,
                    bias.linear[i],
                ),
                _ => (0.0, 0.0, bias.angular[i - 3]),
            };
            // Rates below 10 rad/s through a well-conditioned Jacobian: some hundred roundings.
            assert!(
                (product(i, qd) - velocity).abs() < 1e-13,
                "sample {k}, row {i}"
            );
            assert!(
                (product(i, qdd) + bias - acceleration).abs() < 1e-12,
                "sample {k}, row {i}"
            );
        }
    }
}

/// Coefficients (a, b) of a·cos nφ + b·sin nφ for n = 1 … n_modes.
fn fourier_modes(samples: &[f64], n_modes: usize) -> Vec<(f64, f64)> {
    let n = samples.len();
    let turn: Vec<(f64, f64)> = (0..n)
        .map(|k| (2.0 * PI * k as f64 / n as f64).sin_cos())
        .collect();
    let mode = |mode: usize| {
        let sums = samples
            .iter()
            .enumerate()
            .fold((0.0, 0.0), |(a, b), (k, value)| {
                let (sin, cos) = turn[mode * k % n];
                (a + value * cos, b + value * sin)
            });
        (2.0 * sums.0 / n as f64, 2.0 * sums.1 / n as f64)
    };
    (1..=n_modes).map(mode).collect()
}

/// First and second derivative at φ of the sum of the modes.
fn derivatives(modes: &[(f64, f64)], phi: f64) -> (f64, f64) {
    modes
        .iter()
        .zip(1..)
        .fold((0.0, 0.0), |(first, second), (&(a, b), number)| {
            let n = f64::from(number);
            let (sin, cos) = (n * phi).sin_cos();
            (
                first + n * (b * cos - a * sin),
                second - n * n * (a * cos + b * sin),
            )
        })
}

#[test]
fn positions_are_continuous_all_around_the_path() {
    let scenario = Scenario::reference();
    for trajectory in scenario.trajectories().unwrap() {
        let n = trajectory.n_samples();
        assert_eq!((n, trajectory.states.len()), (4000, 4000 * 18));
        for k in 0..n {
            let ((q, _, _), (next, _, _)) = (trajectory.state(k), trajectory.state((k + 1) % n));
            for j in 0..6 {
                assert!(
                    (q[j] - next[j]).abs() < 0.02,
                    "{}{} sample {k} joint {}",
                    trajectory.path,
                    trajectory.speed,
                    j + 1
                );
            }
        }
    }
}

#[test]
fn a_joint_that_passes_half_a_turn_goes_on_instead_of_jumping() {
    let wide = REFERENCE.replacen("half_width = 0.10", "half_width = 0.20", 1);
    let trajectory = run(&Scenario::from_toml(&wide).unwrap(), "p4", "s1");
    let q1: Vec<f64> = (0..4000).map(|k| trajectory.state(k).0[0]).collect();
    let (low, high) = range(q1.iter().copied());
    assert!(low < 3.0 && high > PI, "{low} {high}");
    assert!(q1.windows(2).all(|pair| (pair[1] - pair[0]).abs() < 0.01));
}

#[test]
fn samples_are_regular_in_time_and_stop_before_the_first_point_comes_again() {
    let trajectory = run(&Scenario::reference(), "p2", "s3");
    assert!(trajectory.time[0].abs() <= 0.0);
    assert!((trajectory.time[1] - 10.0 / 4000.0).abs() < 1e-18);
    assert!((trajectory.time[3999] - 10.0 * 3999.0 / 4000.0).abs() < 1e-14);
}

#[test]
fn heavier_loads_are_two_hundred_grams_apart() {
    let scenario = Scenario::reference();
    assert_eq!(scenario.load_names().len(), 15);
    for load_idx in 0..15 {
        let mass = scenario.payload(load_idx).mass();
        assert!((mass - 0.2 * (load_idx + 1) as f64).abs() < 1e-15, "{mass}");
    }
}

/// What is replaced in the reference file, by what, and what the message says.
const FAULTS: &[(&str, &str, &str)] = &[
    ("half_width = 0.10", "half_widht = 0.10", "half_widht"),
    (
        "half_width = 0.10",
        "",
        "line 37: missing field `half_width`",
    ),
    (
        "half_width = 0.10",
        "half_width = -0.1",
        "path.half_width is -0.1, must be positive",
    ),
    (
        "half_width = 0.10",
        "half_width = \"wide\"",
        "invalid type: string \"wide\"",
    ),
    ("samples = 4000", "samples = 0", "path.samples is 0"),
    (
        "centre_z = [0.36, 0.40, ",
        "centre_z = [0.36, ",
        "path.centre_z has 3 entries, path.centre_x has 4",
    ),
    (
        "durations = [20.0,",
        "durations = [-20.0,",
        "path.durations is -20, must be positive",
    ),
    (
        "rotation = [-10.0",
        "rotation = [nan",
        "path.rotation is NaN, must be finite",
    ),
    (
        "name = \"puma560\"",
        "name = \"ur10\"",
        "robot.name is `ur10`",
    ),
    (
        "elbow = -1",
        "elbow = 2",
        "robot.elbow is 2, must be 1 or -1",
    ),
    (
        "arm = \"left\"",
        "arm = \"middle\"",
        "unknown variant `middle`",
    ),
    (
        "friction = \"modern\"",
        "friction = \"dry\"",
        "unknown variant `dry`",
    ),
    (
        "name = \"c2\"",
        "name = \"c1\"",
        "load name `c1` is used more than once",
    ),
    (
        "name = \"c2\"",
        "name = \"../c2\"",
        "load name `../c2` must be letters",
    ),
    (
        "mass = 0.4",
        "mass = -0.4",
        "load `c2`: payload `payload`: mass is -0.4",
    ),
];

#[test]
fn faults_of_a_scenario_file_are_named() {
    for &(from, to, message) in FAULTS {
        let text = REFERENCE.replacen(from, to, 1);
        assert_ne!(text, REFERENCE, "{from} is in the file");
        let error = Scenario::from_toml(&text).unwrap_err();
        assert!(matches!(error, DynError::Scenario { .. }), "{error:?}");
        assert!(error.to_string().contains(message), "{to}: {error}");
    }
}

#[test]
fn a_path_out_of_reach_names_path_and_sample() {
    let text = REFERENCE.replacen(
        "centre_x = [0.35, 0.45, 0.55, 0.65]",
        "centre_x = [0.35, 0.45, 0.55, 1.25]",
        1,
    );
    let scenario = Scenario::from_toml(&text).unwrap();
    assert!(scenario.trajectory(0, 0).is_ok());
    let error = scenario.trajectory(3, 0).unwrap_err();
    assert!(
        error
            .to_string()
            .contains("farther than the stretched arm's 0.8641 m (path p4, sample 0)"),
        "{error}"
    );
}

#[test]
fn unknown_names_list_the_known_ones() {
    let error = Scenario::reference().path_idx("p5").unwrap_err();
    assert_eq!(
        error.to_string(),
        "no path is named `p5`; known: p1, p2, p3, p4"
    );
}

#[test]
fn the_joint_angles_bring_the_tool_to_the_point_of_the_path_above_the_floor() {
    // The model's origin is the shoulder, 0.6718 m above the floor; the tool's tip is 0.15 m along z6.
    let scenario = Scenario::reference();
    let frame_idx = scenario.model().frames().len() - 1;
    for (path_idx, sample_idx) in [(0, 0), (0, 777), (2, 1500), (3, 3999)] {
        let trajectory = scenario.trajectory(path_idx, 1).expect("a reachable path");
        let (q, _, _) = trajectory.state(sample_idx);
        let wrist = forward_kinematics(scenario.model(), frame_idx, q);
        let tip = wrist.translation + 0.15 * wrist.rotation.column(2);
        let phase = 2.0 * PI * sample_idx as f64 / 4000.0;
        let [x, y, z] = scenario.path_point(path_idx, phase);
        let error = [tip.x - x, tip.y - y, tip.z + 0.6718 - z];
        // Inverse kinematics through acos near 1e-8 of its end would lose digits; here it does not.
        assert!(
            error.iter().all(|e| e.abs() < 1e-13),
            "p{}, sample {sample_idx}: {error:?}",
            path_idx + 1
        );
    }
}
