//! Against Pinocchio, a program that is not ours: `fixtures/puma-dyn/*.csv`, made by `generate.py`.
//!
//! Both programs round differently at every step of the recursion, so an answer may differ by a
//! few units of rounding per joint of the largest number that enters it: `C · n · EPS · scale`,
//! with `scale` the largest value of that quantity in the file.

use puma_dyn::dynamics::{N_PARAMETERS, coriolis_torques, gravity_torques, inertial_parameters};
use puma_dyn::{
    Context, Effects, Friction, Model, Payload, Workspace, aba, crba, forward_kinematics, jacobian,
    load_urdf, puma560, regressor, rnea,
};

use crate::fixture::{self, Fixture, assert_close};

/// Roundings of one joint's part in the recursion, ours and theirs together.
const C: f64 = 16.0;

fn tolerance(file: &Fixture, first: &str, n: usize) -> f64 {
    C * file.joints.len() as f64 * f64::EPSILON * file.scale(first, n)
}

/// A robot with the order in which a file lists its joints.
struct Case {
    file: Fixture,
    model: Model,
    /// Column of each of the model's joints.
    columns: Vec<usize>,
}

impl Case {
    fn new(file: &str, model: Model) -> Self {
        let file = Fixture::load(file);
        let column = |name: &String| file.joints.iter().position(|joint| joint == name);
        let columns = model
            .joint_names()
            .iter()
            .map(|name| column(name).expect("named"))
            .collect();
        assert_eq!(file.joints.len(), model.n_joints());
        Self {
            file,
            model,
            columns,
        }
    }

    fn from_urdf(file: &str, urdf: &str) -> Self {
        let loaded = load_urdf(&fixture::path(urdf), None).unwrap_or_else(|e| panic!("{e}"));
        Self::new(file, loaded.model)
    }

    fn n(&self) -> usize {
        self.columns.len()
    }

    /// One number per joint, in the model's order.
    fn joints(&self, row: &[f64], stem: &str) -> Vec<f64> {
        let block = self.file.block(row, &format!("{stem}1"), self.n());
        self.columns.iter().map(|&column| block[column]).collect()
    }

    /// The rows and columns of a square matrix in the model's order, each entry `width` wide.
    fn square(&self, row: &[f64], first: &str, width: usize) -> Vec<f64> {
        let n = self.n();
        let block = self.file.block(row, first, n * n * width);
        let mut out = Vec::with_capacity(block.len());
        for (i, j) in self
            .columns
            .iter()
            .flat_map(|i| self.columns.iter().map(move |j| (i, j)))
        {
            out.extend_from_slice(&block[(i * n + j) * width..][..width]);
        }
        out
    }

    fn state(&self, row: &[f64]) -> [Vec<f64>; 3] {
        ["q", "qd", "qdd"].map(|stem| self.joints(row, stem))
    }

    fn rnea(&self, effects: Effects, context: &Context, row: &[f64]) -> Vec<f64> {
        let [q, qd, qdd] = self.state(row);
        let mut tau = vec![0.0; self.n()];
        let mut workspace = Workspace::new(&self.model);
        rnea(
            &self.model,
            &mut workspace,
            effects,
            context,
            &q,
            &qd,
            &qdd,
            &mut tau,
        );
        tau
    }
}

/// The load of the fixture, with a full inertia tensor, in the axes of link 6.
fn loaded_hand(model: &Model) -> Context {
    let inertia = [0.012, 0.009, 0.007, 0.0021, -0.0013, 0.0017]; // kg m², about the centre
    let payload = Payload::new(1.8, [0.03, -0.02, 0.11], inertia).expect("a rigid body");
    let hand = model.frame_idx("link6").expect("link6");
    Context::new([model.attach(hand, &payload).expect("it moves")])
}

/// The PUMA as a table, and as files.
fn pumas(file: &str) -> [Case; 2] {
    let sidecar = fixture::path("puma560.toml");
    let loaded = load_urdf(&fixture::path("puma560.urdf"), Some(&sidecar)).expect("valid");
    [
        Case::new(file, puma560::model()),
        Case::new(file, loaded.model),
    ]
}

#[test]
fn puma_torques_with_load_rotors_and_friction_are_pinocchios() {
    for case in pumas("puma560_torques") {
        let tolerance = tolerance(&case.file, "tau1", 6);
        assert!(tolerance < 1e-9, "{tolerance}"); // N·m, the promise of the README
        let hand = loaded_hand(&case.model);
        for row in case.file.rows() {
            let tau = case.rnea(Effects::ALL, &hand, row);
            assert_close(&tau, &case.joints(row, "tau"), tolerance, "tau");
        }
        assert_eq!(case.file.rows().len(), 300);
    }
}

#[test]
fn puma_rigid_rotor_and_friction_torques_are_pinocchios_one_by_one() {
    let rotors = Effects {
        friction: Friction::None,
        rotor_inertia: true,
    };
    let friction = Effects {
        friction: Friction::Modern,
        rotor_inertia: false,
    };
    for case in pumas("puma560_torques") {
        let tolerance = tolerance(&case.file, "tau1", 6);
        let (empty, hand) = (Context::empty(), loaded_hand(&case.model));
        for row in case.file.rows() {
            let rigid = case.rnea(Effects::RIGID_BODY, &empty, row);
            assert_close(&rigid, &case.joints(row, "rigid"), tolerance, "rigid");
            let loaded = case.rnea(Effects::RIGID_BODY, &hand, row);
            assert_close(
                &loaded,
                &case.joints(row, "rigid_loaded"),
                tolerance,
                "loaded",
            );
            for (effects, stem) in [(rotors, "rotor"), (friction, "friction")] {
                let with: Vec<f64> = case.rnea(effects, &empty, row);
                let part: Vec<f64> = with.iter().zip(&rigid).map(|(a, b)| a - b).collect();
                assert_close(&part, &case.joints(row, stem), tolerance, stem);
            }
        }
    }
}

fn all() -> [Case; 3] {
    [
        Case::from_urdf("puma560_algorithms", "puma560.urdf"),
        Case::from_urdf("tree_algorithms", "puma-dyn/tree.urdf"),
        Case::from_urdf("gen3_algorithms", "puma-dyn/gen3.urdf"),
    ]
}

#[test]
fn torques_of_a_chain_a_tree_and_a_robot_in_the_wild_are_pinocchios() {
    for case in all() {
        let tolerance = tolerance(&case.file, "tau1", case.n());
        for row in case.file.rows() {
            let tau = case.rnea(Effects::RIGID_BODY, &Context::empty(), row);
            assert_close(&tau, &case.joints(row, "tau"), tolerance, case.model.name());
        }
    }
}

/// What `torque-gp export` wrote of a recorded motion.
#[test]
fn torques_of_an_identified_arm_are_pinocchios() {
    let case = Case::from_urdf("gen3_identified", "puma-dyn/gen3_identified.urdf");
    let tolerance = tolerance(&case.file, "tau1", case.n());
    assert!(tolerance < 1e-6, "{tolerance}"); // N·m
    for row in case.file.rows() {
        let tau = case.rnea(Effects::RIGID_BODY, &Context::empty(), row);
        assert_close(&tau, &case.joints(row, "tau"), tolerance, "identified");
    }
    assert_eq!(case.file.rows().len(), 50);
    // The base does not move, so nothing was learned of it.
    let warnings = case.model.physical_warnings().iter();
    assert!(warnings.map(|of| of.link.as_str()).eq(["base_link"]));
}

#[test]
fn gravity_and_coriolis_torques_are_pinocchios() {
    for case in all() {
        let n = case.n();
        let tolerance = tolerance(&case.file, "bias1", n) + tolerance(&case.file, "gravity1", n);
        let (mut workspace, empty) = (Workspace::new(&case.model), Context::empty());
        let (mut gravity, mut bias) = (vec![0.0; n], vec![0.0; n]);
        for row in case.file.rows() {
            let [q, qd, _] = case.state(row);
            gravity_torques(&case.model, &mut workspace, &empty, &q, &mut gravity);
            coriolis_torques(&case.model, &mut workspace, &empty, &q, &qd, &mut bias);
            bias.iter_mut()
                .zip(&gravity)
                .for_each(|(bias, gravity)| *bias += gravity);
            let name = case.model.name();
            assert_close(&gravity, &case.joints(row, "gravity"), tolerance, name);
            assert_close(&bias, &case.joints(row, "bias"), tolerance, name);
        }
    }
}

#[test]
fn inertia_matrices_are_pinocchios() {
    for case in all() {
        let n = case.n();
        let tolerance = tolerance(&case.file, "mass1_1", n * n);
        let mut workspace = Workspace::new(&case.model);
        let (effects, empty) = (Effects::RIGID_BODY, Context::empty());
        let mut inertia = vec![0.0; n * n];
        for row in case.file.rows() {
            let [q, ..] = case.state(row);
            crba(
                &case.model,
                &mut workspace,
                effects,
                &empty,
                &q,
                &mut inertia,
            );
            assert_close(
                &inertia,
                &case.square(row, "mass1_1", 1),
                tolerance,
                case.model.name(),
            );
        }
    }
}

/// Accelerations are compared by the torques that their difference takes: how far two right answers
/// are apart depends on the condition of M, the torques M Δq̈ do not.
#[test]
fn forward_dynamics_are_pinocchios() {
    for case in all() {
        let n = case.n();
        let mut workspace = Workspace::new(&case.model);
        let (effects, empty) = (Effects::RIGID_BODY, Context::empty());
        let mut ours = vec![0.0; n];
        for row in case.file.rows() {
            let [q, qd, _] = case.state(row);
            let (force, theirs) = (case.joints(row, "force"), case.joints(row, "aba_qdd"));
            aba(
                &case.model,
                &mut workspace,
                effects,
                &empty,
                &q,
                &qd,
                &force,
                &mut ours,
            )
            .expect("every joint sees inertia");
            let mass = case.square(row, "mass1_1", 1);
            for mass_row in mass.chunks(n) {
                let torque: f64 = (0..n).map(|j| mass_row[j] * (ours[j] - theirs[j])).sum();
                let scale: f64 = (0..n).map(|j| (mass_row[j] * theirs[j]).abs()).sum();
                let scale = scale + case.file.scale("bias1", n) + case.file.scale("force1", n);
                assert_close(
                    &[torque],
                    &[0.0],
                    C * n as f64 * f64::EPSILON * scale,
                    "M Δq̈",
                );
            }
        }
    }
}

#[test]
fn poses_and_jacobians_of_the_last_frame_are_pinocchios() {
    for (case, frame) in all()
        .into_iter()
        .zip(["link6", "left_tool", "end_effector_link"])
    {
        let n = case.n();
        let frame = case.model.frame_idx(frame).expect("a frame of the robot");
        let position = tolerance(&case.file, "position1", 3);
        let rotation = tolerance(&case.file, "rotation1_1", 9);
        let entries = tolerance(&case.file, "jacobian1_1", 6 * n);
        let mut ours = vec![0.0; 6 * n];
        for row in case.file.rows() {
            let [q, ..] = case.state(row);
            let pose = forward_kinematics(&case.model, frame, &q);
            let expected = case.file.block(row, "position1", 3);
            assert_close(pose.translation.as_slice(), expected, position, "position");
            let expected = case.file.block(row, "rotation1_1", 9);
            assert_close(
                pose.rotation.transpose().as_slice(),
                expected,
                rotation,
                "rotation",
            );

            jacobian(&case.model, frame, &q, &mut ours);
            let block = case.file.block(row, "jacobian1_1", 6 * n);
            let expected: Vec<f64> = block
                .chunks(n)
                .flat_map(|line| case.columns.iter().map(|&column| line[column]))
                .collect();
            assert_close(&ours, &expected, entries, "jacobian");
        }
    }
}

#[test]
fn regressors_and_parameters_are_pinocchios() {
    let puma = Case::from_urdf("puma560_regressor", "puma560.urdf");
    let tree = Case::from_urdf("tree_regressor", "puma-dyn/tree.urdf");
    for case in [puma, tree] {
        let n = case.n();
        let n_entries = n * n * N_PARAMETERS;
        let mut workspace = Workspace::new(&case.model);
        let mut ours = vec![0.0; n_entries];
        let parameters = inertial_parameters(&case.model, &Context::empty());
        for row in case.file.rows() {
            let [q, qd, qdd] = case.state(row);
            regressor(&case.model, &mut workspace, &q, &qd, &qdd, &mut ours);
            let expected = case.square(row, "y1_1", N_PARAMETERS);
            assert_close(
                &ours,
                &expected,
                tolerance(&case.file, "y1_1", n_entries),
                "Y",
            );

            let block = case.file.block(row, "pi1", n * N_PARAMETERS);
            let bodies = case
                .columns
                .iter()
                .map(|&i| &block[i * N_PARAMETERS..][..N_PARAMETERS]);
            let tolerance = tolerance(&case.file, "pi1", n * N_PARAMETERS);
            assert_close(
                &parameters,
                &bodies.collect::<Vec<_>>().concat(),
                tolerance,
                "π",
            );
        }
    }
}
