//! Parameters into the text of a URDF and back.

use puma_dyn::dynamics::{inertial_parameters, regressor};
use puma_dyn::robot::{JointDynamics, write_urdf};
use puma_dyn::{Context, Effects, Model, Sidecar, Workspace, parse_urdf, rnea};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::fixture::{assert_close, path};

const FILES: [&str; 3] = ["puma560.urdf", "puma-dyn/tree.urdf", "puma-dyn/gen3.urdf"];

fn text(name: &str) -> String {
    std::fs::read_to_string(path(name)).expect("a fixture")
}

fn model(text: &str) -> Model {
    let loaded = parse_urdf("arm.urdf", text, None);
    loaded
        .unwrap_or_else(|error| panic!("{error}\n{text}"))
        .model
}

/// Ten numbers, the mass positive; no rigid body need have them.
fn random_parameters(n: usize, seed: u64) -> Vec<[f64; 10]> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut of_link = || {
        let mut numbers: [f64; 10] = std::array::from_fn(|_| rng.random_range(-1.0..1.0));
        numbers[0] = rng.random_range(0.3..4.0);
        numbers
    };
    (0..n).map(|_| of_link()).collect()
}

#[test]
fn parameters_come_back_and_torques_are_linear_in_them() {
    for (seed, file) in (0..).zip(FILES) {
        let source = text(file);
        let n = model(&source).n_joints();
        let parameters = random_parameters(n, seed);
        let written = write_urdf(file, &source, None, &parameters, None).unwrap();
        let model = model(&written);
        let back = inertial_parameters(&model, &Context::empty());
        assert_close(&back, parameters.as_flattened(), 1e-12, file);

        let (mut workspace, mut y) = (Workspace::new(&model), vec![0.0; n * 10 * n]);
        let state = |shift: usize| {
            (0..n)
                .map(|j| 0.7 - 0.4 * ((j + shift) % 5) as f64)
                .collect()
        };
        let [q, qd, qdd] = [0, 1, 3].map(|shift| -> Vec<f64> { state(shift) });
        let (mut tau, empty) = (vec![0.0; n], Context::empty());
        let rigid = Effects::RIGID_BODY;
        rnea(
            &model,
            &mut workspace,
            rigid,
            &empty,
            &q,
            &qd,
            &qdd,
            &mut tau,
        );
        regressor(&model, &mut workspace, &q, &qd, &qdd, &mut y);
        let rows = y.chunks_exact(10 * n);
        let products = rows.map(|row| {
            row.iter()
                .zip(parameters.as_flattened())
                .map(|(y, p)| y * p)
                .sum()
        });
        assert_close(&tau, &products.collect::<Vec<f64>>(), 1e-10, file);
    }
}

/// Everything of a text but the elements in question and blanks.
fn rest(text: &str, tags: &[&str]) -> String {
    let document = roxmltree::Document::parse(text).expect("XML");
    let is_cut = |node: &roxmltree::Node| tags.iter().any(|tag| node.has_tag_name(*tag));
    let mut kept = String::new();
    let mut from = 0;
    for node in document.descendants().filter(is_cut) {
        let range = node.range();
        if range.start >= from {
            kept += &text[from..range.start];
            from = range.end;
        }
    }
    kept += &text[from..];
    kept.replace("/>", ">")
        .replace("</link>", "")
        .split_whitespace()
        .collect()
}

#[test]
fn everything_else_stays() {
    for file in FILES {
        let source = text(file);
        let n = model(&source).n_joints();
        let parameters = random_parameters(n, 7);
        let written = write_urdf(file, &source, None, &parameters, None).unwrap();
        assert_eq!(
            rest(&written, &["inertial"]),
            rest(&source, &["inertial"]),
            "{file}"
        );
        let [before, after] = [&source, &written].map(|text| parse_urdf(file, text, None).unwrap());
        assert_eq!(
            after.description.joints, before.description.joints,
            "{file}"
        );

        let dynamics: Vec<JointDynamics> = (0..n)
            .map(|j| JointDynamics {
                damping: j as f64 / 3.0,
                friction: 0.1 + j as f64 / 7.0,
            })
            .collect();
        let written = write_urdf(file, &source, None, &parameters, Some(&dynamics)).unwrap();
        let tags = ["inertial", "dynamics"];
        let joined = |text: &str| rest(text, &tags).replace("</joint>", "");
        assert_eq!(joined(&written), joined(&source), "{file}");
        let robot = parse_urdf(file, &written, None).unwrap();
        for (idx, name) in robot.model.joint_names().iter().enumerate() {
            let joint = robot
                .description
                .joints
                .iter()
                .find(|joint| joint.name == *name);
            let drive = joint.unwrap().drive;
            let found = [drive.viscous_joint, drive.coulomb_joint];
            let JointDynamics { damping, friction } = dynamics[idx];
            assert_eq!(
                found.map(f64::to_bits),
                [damping, friction].map(f64::to_bits)
            );
        }
    }
}

const TWO_LINKS: &str = "\u{feff}<?xml version='1.0'?>
<robot name='two'>
  <link name='base'><inertial><mass value='9'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial></link>
  <link name='upper'/>
  <link name='tool'><!-- kept -->
    <inertial><mass value='9'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial>
  </link>
  <link name='lower'>
    <inertial>
      <!-- weighed -->
      <mass value='2'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1' unit='si'/>
    </inertial>
  </link>
  <joint name='elbow' type='continuous'><parent link='upper'/><child link='lower'/><dynamics spring='1'/></joint>
  <joint name='flange' type='fixed'><parent link='lower'/><child link='tool'/></joint>
  <joint name='shoulder' type='continuous'><parent link='base'/><child link='upper'/></joint>
</robot>
";

#[test]
fn the_text_worked_by_hand() {
    // q is (elbow, shoulder). A mass of 2 at (0, 0, 3): I = I_c + 2·9 about x and y.
    let parameters = [
        [2.0, 0.0, 0.0, 6.0, 18.5, 0.0, 18.5, 0.0, 0.0, 0.25],
        [1.0, 0.0, 0.0, 0.0, 0.5, 0.125, 0.5, 0.0, 0.0, 0.25],
    ];
    let dynamics = [
        JointDynamics {
            damping: 0.5,
            friction: 0.25,
        },
        JointDynamics {
            damping: 1.0,
            friction: 0.0,
        },
    ];
    let written = write_urdf("two.urdf", TWO_LINKS, None, &parameters, Some(&dynamics)).unwrap();
    let expected = "\u{feff}<?xml version='1.0'?>
<robot name='two'>
  <link name='base'><inertial><mass value='9'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial></link>
  <link name='upper'><inertial><origin xyz=\"0.0 0.0 0.0\" rpy=\"0 0 0\"/><mass value=\"1.0\"/><inertia ixx=\"0.5\" ixy=\"0.125\" ixz=\"0.0\" iyy=\"0.5\" iyz=\"0.0\" izz=\"0.25\"/></inertial></link>
  <link name='tool'><!-- kept -->
  </link>
  <link name='lower'>
    <inertial>
      <origin xyz=\"0.0 0.0 3.0\" rpy=\"0 0 0\"/>
      <!-- weighed -->
      <mass value='2.0'/><inertia ixx='0.5' ixy='0.0' ixz='0.0' iyy='0.5' iyz='0.0' izz='0.25' unit='si'/>
    </inertial>
  </link>
  <joint name='elbow' type='continuous'><parent link='upper'/><child link='lower'/><dynamics damping=\"0.5\" friction=\"0.25\" spring='1'/></joint>
  <joint name='flange' type='fixed'><parent link='lower'/><child link='tool'/></joint>
  <joint name='shoulder' type='continuous'><dynamics damping=\"1.0\" friction=\"0.0\"/><parent link='base'/><child link='upper'/></joint>
</robot>
";
    assert_eq!(written, expected);
}

#[test]
fn a_joint_that_the_sidecar_locks_is_part_of_its_carrier() {
    let sidecar = Sidecar::parse("two.toml", "[joint.elbow]\nlocked_at = 0.5").unwrap();
    let parameters = random_parameters(1, 3);
    let written = write_urdf("two.urdf", TWO_LINKS, Some(&sidecar), &parameters, None).unwrap();
    let loaded = parse_urdf("two.urdf", &written, Some(&sidecar)).unwrap();
    let back = inertial_parameters(&loaded.model, &Context::empty());
    assert_close(&back, &parameters[0], 1e-12, "locked");
}

#[test]
fn what_no_urdf_can_state_is_refused_by_name() {
    let good = random_parameters(2, 5);
    let refused = |parameters: &[[f64; 10]], dynamics: Option<&[JointDynamics]>| {
        let refused = write_urdf("two.urdf", TWO_LINKS, None, parameters, dynamics);
        refused.unwrap_err().to_string()
    };
    for (number, value, expected) in [
        (0, 0.0, "link `upper`: mass is 0, must be above zero"),
        (0, -0.5, "link `upper`: mass is -0.5, must be above zero"),
        (2, f64::NAN, "link `upper`: first mass moment is NaN"),
        (9, f64::INFINITY, "link `upper`: inertia is inf"),
    ] {
        let mut bad = good.clone();
        bad[1][number] = value;
        assert_eq!(refused(&bad, None), expected);
    }
    let dynamics = [JointDynamics {
        damping: 0.0,
        friction: -1.0,
    }; 2];
    let message = refused(&good, Some(&dynamics));
    assert!(
        message.starts_with("joint `elbow`: friction is -1"),
        "{message}"
    );
}
