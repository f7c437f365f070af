//! Identities that hold for every robot, tried on random trees.

use puma_dyn::dynamics::{
    bias_acceleration, coriolis_torques, drive_parameters, full_regressor, gravity_torques,
    inertial_parameters, kinetic_energy, potential_energy,
};
use puma_dyn::nalgebra::DMatrix;
use puma_dyn::{
    Context, DynError, Effects, Friction, Model, TorqueTerms, Workspace, aba, crba,
    forward_kinematics, jacobian, regressor, rnea, torque_terms,
};

use crate::random_tree::{Case, Joints, cases};

/// Every method adds some hundred products per joint, none much larger than the largest torque.
const ROUNDING: f64 = 1000.0 * f64::EPSILON;

/// Every combination of switches that changes the answer.
const EFFECTS: [Effects; 3] = [
    Effects::RIGID_BODY,
    Effects::ALL,
    Effects {
        friction: Friction::Toolbox2008,
        rotor_inertia: false,
    },
];

/// What keeps energy: rotors store it, friction loses it.
const NO_FRICTION: Effects = Effects {
    friction: Friction::None,
    rotor_inertia: true,
};

impl Case {
    /// The `n` numbers that an algorithm writes for the state (q, q̇, q̈).
    fn computed(
        &mut self,
        n: usize,
        algorithm: impl FnOnce(&Model, &mut Workspace, &Context, [&[f64]; 3], &mut [f64]),
    ) -> Vec<f64> {
        let state = [&self.q[..], &self.qd, &self.qdd];
        let mut numbers = vec![0.0; n];
        algorithm(
            &self.model,
            &mut self.workspace,
            &self.context,
            state,
            &mut numbers,
        );
        numbers
    }

    fn rnea(&mut self, effects: Effects) -> Vec<f64> {
        let n = self.model.n_joints();
        self.computed(n, |model, workspace, context, [q, qd, qdd], tau| {
            rnea(model, workspace, effects, context, q, qd, qdd, tau);
        })
    }

    fn gravity(&mut self) -> Vec<f64> {
        let n = self.model.n_joints();
        self.computed(n, |model, workspace, context, [q, ..], tau| {
            gravity_torques(model, workspace, context, q, tau);
        })
    }

    fn coriolis(&mut self) -> Vec<f64> {
        let n = self.model.n_joints();
        self.computed(n, |model, workspace, context, [q, qd, _], tau| {
            coriolis_torques(model, workspace, context, q, qd, tau);
        })
    }

    fn terms(&mut self, effects: Effects) -> TorqueTerms {
        let mut terms = TorqueTerms::new(&self.model);
        self.computed(0, |model, workspace, context, [q, qd, qdd], _| {
            torque_terms(model, workspace, effects, context, q, qd, qdd, &mut terms);
        });
        terms
    }

    fn inertia_matrix(&mut self, effects: Effects) -> DMatrix<f64> {
        let n = self.model.n_joints();
        let matrix = self.computed(n * n, |model, workspace, context, [q, ..], matrix| {
            crba(model, workspace, effects, context, q, matrix);
        });
        DMatrix::from_row_slice(n, n, &matrix)
    }

    /// Accelerations that the torques `tau` produce.
    fn aba(&mut self, effects: Effects, tau: &[f64]) -> Vec<f64> {
        self.computed(tau.len(), |model, workspace, context, [q, qd, _], qdd| {
            aba(model, workspace, effects, context, q, qd, tau, qdd).expect("M > 0");
        })
    }

    fn energy(&self, effects: Effects, q: &[f64], qd: &[f64]) -> f64 {
        let (model, context) = (&self.model, &self.context);
        let mut workspace = Workspace::new(model);
        kinetic_energy(model, &mut workspace, effects, context, q, qd)
            + potential_energy(model, &mut workspace, context, q)
    }

    /// Positions after the time `t` at constant speed.
    fn moved(&self, t: f64) -> Vec<f64> {
        let joints = self.q.iter().zip(&self.qd);
        joints.map(|(q, qd)| q + qd * t).collect()
    }

    /// What the motors supply, if `tau` are their torques.
    fn power(&self, tau: &[f64]) -> f64 {
        tau.iter().zip(&self.qd).map(|(tau, qd)| tau * qd).sum()
    }

    /// The largest entry of any term: what rounding errors of their sum are relative to.
    fn scale(&mut self, effects: Effects) -> f64 {
        let terms = self.terms(effects);
        let entries = terms
            .named()
            .into_iter()
            .flat_map(|(_, term)| term.to_vec());
        entries.fold(0.0, |scale, entry| scale.max(entry.abs()))
    }
}

/// Matrix, row after row, times vector.
fn product(matrix: &[f64], vector: &[f64]) -> Vec<f64> {
    let row = |row: &[f64]| row.iter().zip(vector).map(|(a, b)| a * b).sum();
    matrix.chunks_exact(vector.len()).map(row).collect()
}

fn assert_equal(seed: u64, left: &[f64], right: &[f64], tolerance: f64) {
    assert_eq!(left.len(), right.len());
    for (left, right) in left.iter().zip(right) {
        let error = (left - right).abs();
        assert!(
            error <= tolerance,
            "seed {seed}: {left} {right}, {error:e} > {tolerance:e}"
        );
    }
}

/// Both sides of an identity between torques are the same to rounding, on every robot.
fn assert_holds(effects: &[Effects], sides: impl Fn(&mut Case, Effects) -> [Vec<f64>; 2]) {
    for mut case in cases(Joints::Mixed) {
        for &effects in effects {
            let [left, right] = sides(&mut case, effects);
            let tolerance = ROUNDING * case.scale(effects);
            assert_equal(case.seed, &left, &right, tolerance);
        }
    }
}

#[test]
fn the_terms_add_up_to_rnea() {
    assert_holds(&EFFECTS, |case, effects| {
        let (tau, terms) = (case.rnea(effects), case.terms(effects));
        let sums = (0..tau.len()).map(|joint| terms.total(joint)).collect();
        [sums, tau]
    });
}

#[test]
fn rnea_is_inertia_matrix_times_acceleration_plus_nonlinear_terms() {
    assert_holds(&EFFECTS, |case, effects| {
        let friction = case.terms(effects).friction;
        let matrix = case.inertia_matrix(effects);
        let (gravity, coriolis) = (case.gravity(), case.coriolis());
        let n = friction.len();
        let row = |i: usize| (0..n).map(|j| matrix[(i, j)] * case.qdd[j]).sum::<f64>();
        let sums = (0..n)
            .map(|i| row(i) + coriolis[i] + gravity[i] + friction[i])
            .collect();
        [sums, case.rnea(effects)]
    });
}

#[test]
fn regressor_times_parameters_is_the_rigid_body_torque() {
    assert_holds(&[Effects::RIGID_BODY], |case, effects| {
        let parameters = inertial_parameters(&case.model, &case.context);
        let n = case.model.n_joints() * parameters.len();
        let matrix = case.computed(n, |model, workspace, _, [q, qd, qdd], matrix| {
            regressor(model, workspace, q, qd, qdd, matrix);
        });
        [product(&matrix, &parameters), case.rnea(effects)]
    });
}

#[test]
fn bodies_and_drives_together_are_the_whole_torque() {
    assert_holds(&EFFECTS, |case, effects| {
        let mut parameters = inertial_parameters(&case.model, &case.context);
        parameters.extend(drive_parameters(&case.model, effects));
        let n = case.model.n_joints() * parameters.len();
        let matrix = case.computed(n, |model, workspace, _, [q, qd, qdd], matrix| {
            full_regressor(model, workspace, q, qd, qdd, matrix);
        });
        [product(&matrix, &parameters), case.rnea(effects)]
    });
}

#[test]
fn aba_inverts_rnea() {
    for mut case in cases(Joints::Mixed) {
        for effects in EFFECTS {
            let tau = case.rnea(effects);
            let (found, scale) = (case.aba(effects, &tau), case.scale(effects));
            // A rounding error δ of the torques becomes M⁻¹ δ.
            let smallest = case.inertia_matrix(effects).symmetric_eigenvalues().min();
            let seed = case.seed;
            assert!(smallest > 0.0, "seed {seed}: M is not positive definite");
            assert_equal(seed, &found, &case.qdd, ROUNDING * scale / smallest);
        }
    }
}

#[test]
fn aba_names_the_joint_that_feels_no_inertia() {
    // A point mass on the axis: the joint turns nothing.
    use puma_dyn::RobotDescription;
    use puma_dyn::robot::{Inertial, JointDescription, JointKind, LinkDescription};
    let mut robot = RobotDescription::new("spindle");
    let point = Inertial {
        mass: 1.0,
        centre: [0.0, 0.0, 0.5],
        inertia: [[0.0; 3]; 3],
    };
    robot.links.push(LinkDescription::new("base", None));
    robot.links.push(LinkDescription::new("tip", Some(point)));
    robot.joints.push(JointDescription::new(
        "twist",
        JointKind::Revolute,
        "base",
        "tip",
    ));
    let model = Model::new(&robot).unwrap();
    let (mut workspace, mut qdd) = (Workspace::new(&model), [0.0]);
    let effects = Effects::RIGID_BODY;
    let empty = Context::empty();
    let result = aba(
        &model,
        &mut workspace,
        effects,
        &empty,
        &[0.0],
        &[0.0],
        &[1.0],
        &mut qdd,
    );
    assert!(matches!(result, Err(DynError::SingularInertia { joint, .. }) if joint == "twist"));
}

/// Rate of change of a function of period 2π that has no more than N/2 − 1 harmonics.
///
/// f'(0) = Σ_k ½ (−1)^k cot(−k π / N) f(2 π k / N), exact to rounding (Trefethen 2000, *Spectral
/// Methods in MATLAB*, p. 21).
fn spectral_derivative(f: impl Fn(f64) -> f64) -> f64 {
    const N: u32 = 64;
    let term = |k: u32| {
        let sign = if k.is_multiple_of(2) { 1.0 } else { -1.0 };
        let half_angle = std::f64::consts::PI * f64::from(k) / f64::from(N);
        -0.5 * sign / half_angle.tan() * f(2.0 * half_angle)
    };
    (1..N).map(term).sum()
}

#[test]
fn power_of_the_joint_torques_is_the_rate_of_change_of_energy() {
    // With speeds of ±1 rad/s along a path of constant speed, energies are trigonometric
    // polynomials of degree 2 n_joints ≤ 16 < 31, so their rate is found to rounding.
    for mut case in cases(Joints::Turning) {
        case.qd.iter_mut().for_each(|qd| *qd = qd.signum());
        case.qdd.iter_mut().for_each(|qdd| *qdd = 0.0);
        let tau = case.rnea(NO_FRICTION);
        let (power, scale) = (case.power(&tau), case.scale(NO_FRICTION));

        let energy = |t: f64| case.energy(NO_FRICTION, &case.moved(t), &case.qd);
        let rate = spectral_derivative(energy);
        // The 63 weights add up to less than 64 ln 64 / π + …, below 150.
        let scale = energy(0.0).abs() + scale * qd_norm(&case.qd);
        let error = (power - rate).abs();
        assert!(
            error < 150.0 * ROUNDING * scale,
            "seed {}: {power} {rate}",
            case.seed
        );
    }
}

fn qd_norm(qd: &[f64]) -> f64 {
    qd.iter().map(|qd| qd.abs()).sum()
}

/// Central difference of eighth order with its coefficients (Fornberg 1988, table 1).
fn difference(f: impl Fn(f64) -> Vec<f64>, step: f64) -> Vec<f64> {
    let weights = [4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0];
    let mut sum = vec![0.0; f(0.0).len()];
    for (weight, k) in weights.into_iter().zip([1.0, 2.0, 3.0, 4.0]) {
        let (after, before) = (f(k * step), f(-k * step));
        for ((sum, after), before) in sum.iter_mut().zip(after).zip(before) {
            *sum += weight * (after - before) / step;
        }
    }
    sum
}

/// Truncation is step⁸ f⁽⁹⁾ / 630 with f⁽⁹⁾ ≤ reach ρ⁹; rounding is 2 EPS reach ops / step.
fn difference_tolerance(reach: f64, rate: f64, step: f64) -> f64 {
    reach * ((rate * step).powi(8) * rate / 630.0 + ROUNDING / step)
}

#[test]
fn energy_grows_by_power_with_sliding_joints_too() {
    let step = 5e-3;
    for mut case in cases(Joints::Mixed) {
        let tau = case.rnea(NO_FRICTION);
        let (power, scale) = (case.power(&tau), case.scale(NO_FRICTION));
        let Case { q, qd, qdd, .. } = &case;
        let energy = |t: f64| {
            let at = |i: usize| q[i] + t * (qd[i] + 0.5 * t * qdd[i]);
            let q: Vec<f64> = (0..q.len()).map(at).collect();
            let qd: Vec<f64> = qd.iter().zip(qdd).map(|(qd, qdd)| qd + t * qdd).collect();
            vec![case.energy(NO_FRICTION, &q, &qd)]
        };
        let rate = difference(energy, step)[0];
        let reach = energy(0.0)[0].abs() + scale;
        let tolerance = difference_tolerance(reach, 2.0 * qd_norm(qd), step);
        let error = (power - rate).abs();
        assert!(
            error < tolerance,
            "seed {}: {power} {rate} {tolerance:e}",
            case.seed
        );
    }
}

#[test]
fn the_jacobian_gives_the_velocity_of_every_frame() {
    let step = 5e-3;
    for case in cases(Joints::Mixed) {
        let Case { model, q, qd, .. } = &case;
        for frame in 0..model.frames().len() {
            let pose_at = |t: f64| {
                let pose = forward_kinematics(model, frame, &case.moved(t));
                [pose.translation.as_slice(), pose.rotation.as_slice()].concat()
            };
            let rates = difference(pose_at, step);
            let velocity = frame_velocity(model, frame, q, qd);
            // Ṙ = [ω]× R, column by column.
            let rotation = forward_kinematics(model, frame, q).rotation;
            let omega = puma_dyn::nalgebra::Vector3::from_row_slice(&velocity[3..]);
            let mut expected = velocity[..3].to_vec();
            for column in rotation.column_iter() {
                expected.extend_from_slice(omega.cross(&column).as_slice());
            }
            let tolerance = difference_tolerance(10.0, qd_norm(qd), step);
            assert_equal(case.seed, &rates, &expected, tolerance);
        }
    }
}

fn frame_velocity(model: &Model, frame: usize, q: &[f64], qd: &[f64]) -> Vec<f64> {
    let mut matrix = vec![0.0; 6 * qd.len()];
    jacobian(model, frame, q, &mut matrix);
    product(&matrix, qd)
}

#[test]
fn bias_acceleration_is_the_change_of_the_jacobian_times_speed() {
    let step = 5e-3;
    for mut case in cases(Joints::Mixed) {
        for frame in 0..case.model.frames().len() {
            let found = case.computed(6, |model, workspace, _, [q, qd, _], found| {
                let bias = bias_acceleration(model, workspace, frame, q, qd);
                found[..3].copy_from_slice(bias.linear.as_slice());
                found[3..].copy_from_slice(bias.angular.as_slice());
            });
            let velocity_at = |t: f64| frame_velocity(&case.model, frame, &case.moved(t), &case.qd);
            let expected = difference(velocity_at, step);
            let rate = qd_norm(&case.qd);
            let tolerance = difference_tolerance(10.0 * rate, rate, step);
            assert_equal(case.seed, &found, &expected, tolerance);
        }
    }
}

#[test]
fn the_order_of_the_joints_in_the_file_is_the_order_of_q() {
    for case in cases(Joints::Mixed) {
        let moving = case.description.joints.iter();
        let moving = moving.filter(|joint| joint.kind != puma_dyn::robot::JointKind::Fixed);
        let names: Vec<&String> = moving.map(|joint| &joint.name).collect();
        assert_eq!(case.model.joint_names().iter().collect::<Vec<_>>(), names);
    }
}
