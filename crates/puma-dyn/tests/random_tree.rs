//! Random robots: branching trees of turning, sliding and fixed joints about arbitrary axes.

use puma_dyn::nalgebra::{Matrix3, Vector3};
use puma_dyn::robot::{Drive, Inertial, JointDescription, JointKind, LinkDescription};
use puma_dyn::{Context, Model, Payload, Pose, RobotDescription, Workspace};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// How many robots each identity is tried on.
pub const N_ROBOTS: u64 = 60;

/// A robot with one state, one payload on its last link, and room for the algorithms.
pub struct Case {
    pub seed: u64,
    pub description: RobotDescription,
    pub model: Model,
    pub workspace: Workspace,
    pub loaded_link: String,
    pub context: Context,
    pub q: Vec<f64>,
    pub qd: Vec<f64>,
    pub qdd: Vec<f64>,
}

/// The kinds a case may contain.
#[derive(Clone, Copy, PartialEq)]
pub enum Joints {
    Mixed,
    /// Turning joints only: every quantity is then periodic in q.
    Turning,
}

pub fn cases(joints: Joints) -> impl Iterator<Item = Case> {
    (0..N_ROBOTS).map(move |seed| case(seed, joints))
}

fn case(seed: u64, joints: Joints) -> Case {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let description = tree(&mut rng, joints);
    let model = Model::new(&description).expect("the generator makes valid robots");
    let inertial = random_inertial(&mut rng);
    let [[xx, xy, xz], [_, yy, yz], [_, _, zz]] = inertial.inertia;
    let payload = Payload::new(inertial.mass, inertial.centre, [xx, yy, zz, xy, xz, yz]);
    let payload = payload.expect("the generator makes valid payloads");
    let loaded_link = moved_link(&description);
    let frame = model.frame_idx(&loaded_link).expect("it is a link");
    let context = model
        .attach(frame, &payload)
        .expect("a joint moves it")
        .into();
    let n_joints = model.n_joints();
    let [q, qd, qdd] = [3.0, 1.5, 3.0].map(|range| uniform_vec(&mut rng, n_joints, range));
    Case {
        seed,
        q,
        qd,
        qdd,
        workspace: Workspace::new(&model),
        description,
        model,
        loaded_link,
        context,
    }
}

/// The child of the last joint that moves.
fn moved_link(description: &RobotDescription) -> String {
    let mut moving = description
        .joints
        .iter()
        .filter(|joint| joint.kind != JointKind::Fixed);
    moving.next_back().expect("there is one").child.clone()
}

/// Two to eight moving joints and up to four fixed ones, declared in random order.
fn tree(rng: &mut ChaCha8Rng, joints: Joints) -> RobotDescription {
    let mut robot = RobotDescription::new("random tree");
    robot.gravity = uniform_array(rng, 10.0);
    robot
        .links
        .push(LinkDescription::new("root", Some(random_inertial(rng))));
    let (n_moving, n_fixed) = (rng.random_range(2..=8), rng.random_range(0..=4));
    for idx in 0..n_moving + n_fixed {
        let is_fixed = rng.random_range(0..n_moving + n_fixed) < n_fixed;
        let kind = if is_fixed && idx > 0 {
            JointKind::Fixed
        } else {
            random_kind(rng, joints)
        };
        add_joint(rng, &mut robot, kind);
    }
    for idx in (1..robot.joints.len()).rev() {
        robot.joints.swap(idx, rng.random_range(0..=idx));
    }
    robot
}

fn random_kind(rng: &mut ChaCha8Rng, joints: Joints) -> JointKind {
    match rng.random_range(0..3) {
        0 if joints == Joints::Mixed => JointKind::Prismatic,
        1 => JointKind::Continuous,
        _ => JointKind::Revolute,
    }
}

fn add_joint(rng: &mut ChaCha8Rng, robot: &mut RobotDescription, kind: JointKind) {
    let number = robot.links.len();
    // The last few links are likelier parents, or the trees would be shallow.
    let parent = number - 1 - rng.random_range(0..number.min(3));
    let parent = robot.links[parent].name.clone();
    let child = format!("link{number}");
    let has_no_inertial = kind == JointKind::Fixed && rng.random_range(0..2) == 0;
    let inertial = (!has_no_inertial).then(|| random_inertial(rng));
    robot.links.push(LinkDescription::new(&child, inertial));
    robot.joints.push(JointDescription {
        origin: Pose::from_xyz_rpy(uniform_array(rng, 0.5), uniform_array(rng, 3.0)),
        axis: random_axis(rng),
        drive: random_drive(rng),
        ..JointDescription::new(&format!("joint{number}"), kind, &parent, &child)
    });
}

/// Along a coordinate axis, up or down, every other time; not normalised.
fn random_axis(rng: &mut ChaCha8Rng) -> [f64; 3] {
    if rng.random_range(0..2) == 0 {
        return uniform_array(rng, 2.0);
    }
    let mut axis = [0.0; 3];
    axis[rng.random_range(0..3)] = if rng.random_range(0..2) == 0 {
        1.0
    } else {
        -1.0
    };
    axis
}

fn random_drive(rng: &mut ChaCha8Rng) -> Drive {
    Drive {
        rotor_inertia: rng.random_range(0.0..1e-4),
        gear_ratio: rng.random_range(-80.0..80.0),
        viscous_motor: rng.random_range(0.0..1e-3),
        coulomb_motor_positive: rng.random_range(0.0..0.1),
        coulomb_motor_negative: rng.random_range(-0.1..0.0),
        viscous_joint: rng.random_range(0.0..0.5),
        coulomb_joint: rng.random_range(0.0..0.5),
    }
}

/// The inertia of five random points, which a rigid body can surely have.
fn random_inertial(rng: &mut ChaCha8Rng) -> Inertial {
    let mut inertia = Matrix3::zeros();
    for _ in 0..5 {
        let r = Vector3::from(uniform_array(rng, 0.2));
        inertia += Matrix3::from_diagonal_element(r.norm_squared()) - r * r.transpose();
    }
    Inertial {
        mass: rng.random_range(0.2..5.0),
        centre: uniform_array(rng, 0.3),
        inertia: inertia.into(),
    }
}

fn uniform_array(rng: &mut ChaCha8Rng, range: f64) -> [f64; 3] {
    std::array::from_fn(|_| rng.random_range(-range..range))
}

fn uniform_vec(rng: &mut ChaCha8Rng, length: usize, range: f64) -> Vec<f64> {
    (0..length)
        .map(|_| rng.random_range(-range..range))
        .collect()
}
