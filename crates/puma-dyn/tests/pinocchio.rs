//! Against Pinocchio, a program that is not ours: `fixtures/puma-dyn/*.csv`, made by `generate.py`.
//!
//! Both programs round differently at every step of the recursion, so an answer may differ by a
//! few units of rounding per joint of the largest number that enters it: `C · n · EPS · scale`,
//! with `scale` the largest value of that quantity in the file.

use puma_dyn::{Context, Effects, Friction, Model, Payload, Workspace, load_urdf, puma560, rnea};

use crate::fixture::{self, Fixture, assert_close};

/// Roundings of one joint's part in the recursion, twice: ours and theirs.
const C: f64 = 64.0;

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
