//! The payload file: what it changes, and what it refuses.

use crate::command::{Folder, column, states};

const RUN: &str =
    "inverse-dynamics --robot puma560 --input states.csv --output torques.csv --payload load.toml";

/// q = (45, 70, −100, 60, 25, −140)°, at rest.
fn folder() -> Folder {
    let folder = Folder::new();
    let mut row = [0.0; 18];
    row[..6].copy_from_slice(&[45.0, 70.0, -100.0, 60.0, 25.0, -140.0].map(f64::to_radians));
    folder.write("states.csv", states(&[row]));
    folder
}

fn torques(folder: &Folder) -> [f64; 6] {
    let text = folder.read("torques.csv");
    [1, 2, 3, 4, 5, 6].map(|joint| column(&text, &format!("tau{joint}"))[0])
}

#[test]
fn a_point_load_adds_to_the_last_link_instead_of_replacing_it() {
    let folder = folder();
    folder.write(
        "load.toml",
        "mass = 0.0\ncentre = [0, 0, 0]\ninertia = [0, 0, 0, 0, 0, 0]\n",
    );
    folder.run(RUN);
    // Published for the unloaded arm.
    let expected = [
        0.0,
        16.367_815_9,
        4.595_184_90,
        -0.005_170_24,
        -0.003_939_04,
        0.0,
    ];
    for (found, expected) in torques(&folder).iter().zip(expected) {
        assert!((found - expected).abs() < 5e-8, "{found} {expected}");
    }
    let bare = torques(&folder);

    folder.write(
        "load.toml",
        "mass = 2.5\ncentre = [0, 0, 0.1]\ninertia = [0, 0, 0, 0, 0, 0]\n",
    );
    folder.run(RUN);
    let once = torques(&folder);
    folder.write(
        "load.toml",
        "mass = 5.0\ncentre = [0, 0, 0.1]\ninertia = [0, 0, 0, 0, 0, 0]\n",
    );
    folder.run(RUN);
    // Torques are linear in the mass that is added.
    for ((bare, once), twice) in bare.iter().zip(once).zip(torques(&folder)) {
        assert!(
            (twice - bare - 2.0 * (once - bare)).abs() < 1e-13,
            "{bare} {once} {twice}"
        );
    }
}

#[test]
fn a_cuboid_is_the_tensor_it_stands_for() {
    let folder = folder();
    let mut row = [0.3; 18];
    row[6..].copy_from_slice(&[1.0; 12]);
    folder.write("states.csv", states(&[row]));
    // 12 kg with edges 0.1, 0.2, 0.3 m: Σ of squared edges, turned by 90° about x: yy and zz change places.
    folder.write(
        "load.toml",
        "mass = 12\ncentre = [0.1, 0, 0.2]\ninertia = [0.13, 0.05, 0.10, 0, 0, 0]\n",
    );
    folder.run(RUN);
    let tensor = torques(&folder);
    folder.write("load.toml", "mass = 12\ncentre = [0.1, 0, 0.2]\nsize = [0.1, 0.2, 0.3]\nrpy = [1.5707963267948966, 0, 0]\n");
    folder.run(RUN);
    for (tensor, cuboid) in tensor.iter().zip(torques(&folder)) {
        assert!((tensor - cuboid).abs() < 1e-12, "{tensor} {cuboid}");
    }
}

#[test]
fn products_of_inertia_are_entries_of_the_tensor_in_the_documented_order() {
    // Spinning about the wrist's z: a product xz or yz pulls on other joints, a product xy does not (in the last link).
    let folder = folder();
    let mut row = [0.0; 18];
    row[4] = 1.0;
    row[11] = 3.0;
    folder.write("states.csv", states(&[row]));
    let torque5 = |products: &str| {
        folder.write(
            "load.toml",
            format!("mass = 1\ncentre = [0, 0, 0]\ninertia = [0.1, 0.1, 0.1, {products}]\n"),
        );
        folder.run(RUN);
        torques(&folder)[4]
    };
    let (none, xy, xz, yz) = (
        torque5("0, 0, 0"),
        torque5("0.05, 0, 0"),
        torque5("0, 0.05, 0"),
        torque5("0, 0, 0.05"),
    );
    // At q6 = 0 joint 5 turns about −y of frame 6 (R = Rz(q4) Ry(−q5) Rz(q6)): ω×Iω = ω² (−I_yz, I_xz, 0).
    assert!((xy - none).abs() < 1e-14, "{none} {xy}");
    assert!((xz - none + 9.0 * 0.05).abs() < 1e-14, "{none} {xz}");
    assert!((yz - none).abs() < 1e-14, "{none} {yz}");
}

#[test]
fn a_load_on_a_named_link() {
    let folder = folder();
    folder.write(
        "load.toml",
        "mass = 2\ncentre = [0, 0, 0]\nsize = [0.1, 0.1, 0.1]\nlink = \"link3\"\n",
    );
    folder.run(RUN);
    let on_the_forearm = torques(&folder);
    folder.write(
        "load.toml",
        "mass = 0\ncentre = [0, 0, 0]\nsize = [0, 0, 0]\n",
    );
    folder.run(RUN);
    let bare = torques(&folder);
    // The shoulder carries it, the wrist does not.
    assert!((on_the_forearm[1] - bare[1]).abs() > 1.0);
    assert!((on_the_forearm[3] - bare[3]).abs() < 1e-14);
}

#[test]
fn faults_of_a_payload_file_are_named() {
    let folder = folder();
    for (text, message) in [
        (
            "mass = 1\ncentre = [0, 0, 0]\n",
            "load.toml: neither `inertia` = [xx, yy, zz, xy, xz, yz] nor `size`",
        ),
        (
            "mass = 1\ncentre = [0, 0, 0]\ninertia = [0, 0, 0, 0, 0, 0]\nsize = [1, 1, 1]\n",
            "load.toml: `inertia` and `size` are both given",
        ),
        (
            "mass = 1\ncentre = [0, 0, 0]\ninertia = [0, 0, 0, 0, 0, 0]\nrpy = [1, 1, 1]\n",
            "load.toml: `rpy` turns a cuboid",
        ),
        (
            "mass = 1\ncenter = [0, 0, 0]\nsize = [1, 1, 1]\n",
            "load.toml: line 2: unknown field `center`",
        ),
        ("mass = 1\nsize = [1, 1, 1]\n", "missing field `centre`"),
        (
            "mass = 1\ncentre = [0, 0]\nsize = [1, 1, 1]\n",
            "load.toml: line 2: invalid length 2",
        ),
        (
            "mass = \"heavy\"\ncentre = [0, 0, 0]\nsize = [1, 1, 1]\n",
            "load.toml: line 1: invalid type: string \"heavy\"",
        ),
        (
            "mass = 1\ncentre = [0, 0, 0\n",
            "load.toml: line 2: unclosed array",
        ),
        (
            "mass = -1\ncentre = [0, 0, 0]\nsize = [1, 1, 1]\n",
            "mass is -1",
        ),
        (
            "mass = nan\ncentre = [0, 0, 0]\nsize = [1, 1, 1]\n",
            "mass is NaN",
        ),
        (
            "mass = 1\ncentre = [0, 0, 0]\ninertia = [1, 1, 9, 0, 0, 0]\n",
            "triangle inequality",
        ),
        (
            "mass = 1\ncentre = [0, 0, 0]\nsize = [1, 1, 1]\nlink = \"tool0\"\n",
            "the robot has no such link; it has base, link1, ",
        ),
        (
            "mass = 1\ncentre = [0, 0, 0]\nsize = [1, 1, 1]\nlink = \"base\"\n",
            "frame `base` is fixed to the ground",
        ),
    ] {
        folder.write("load.toml", text);
        let said = folder.refusal(RUN);
        assert!(
            said.starts_with("load.toml: ") && said.contains(message),
            "{message}: {said}"
        );
    }
}

/// Two arms on one base, with a tool fixed to the left one.
const TWO_ARMS: &str = r#"<robot name="two">
  <link name="base"/>
  <link name="left"><inertial><mass value="2"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
  <link name="right"><inertial><mass value="2"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
  <link name="tool"/>
  <joint name="a" type="continuous"><parent link="base"/><child link="left"/><axis xyz="0 1 0"/></joint>
  <joint name="b" type="continuous"><parent link="base"/><child link="right"/><axis xyz="0 1 0"/></joint>
  <joint name="c" type="fixed"><parent link="left"/><child link="tool"/><origin xyz="1 0 0"/></joint>
</robot>"#;

#[test]
fn a_branching_robot_must_name_the_link_which_may_be_fixed_to_a_moving_one() {
    let folder = Folder::new();
    folder.write("two.urdf", TWO_ARMS);
    folder.write("states.csv", "q1,q2,qd1,qd2,qdd1,qdd2\n0,0,0,0,0,0\n");
    let run = RUN.replace("puma560", "two.urdf");
    let load = "mass = 1\ncentre = [0, 0, 0]\nsize = [0, 0, 0]\n";
    folder.write("load.toml", load);
    let said = folder.refusal(&run);
    assert!(
        said.contains("the robot branches and ends in the links left, right: say which"),
        "{said}"
    );
    folder.write("load.toml", format!("{load}link = \"tool\"\n"));
    folder.run(&run);
    // 1 kg at 1 m along x on an axis along +y: the torque that holds it is −9.81 N·m.
    assert_eq!(folder.read("torques.csv"), "tau1,tau2\n-9.81,0.0\n");
}

#[test]
fn a_chain_with_a_fixed_joint_in_it_ends_in_the_link_of_its_last_moving_joint() {
    let folder = Folder::new();
    let chain = TWO_ARMS.replace(
        "<parent link=\"base\"/><child link=\"right\"/>",
        "<parent link=\"tool\"/><child link=\"right\"/>",
    );
    folder.write("chain.urdf", chain);
    folder.write("states.csv", "q1,q2,qd1,qd2,qdd1,qdd2\n0,0,0,0,0,0\n");
    folder.write(
        "load.toml",
        "mass = 1\ncentre = [0.5, 0, 0]\nsize = [0, 0, 0]\n",
    );
    folder.run(&RUN.replace("puma560", "chain.urdf"));
    // The load is 0.5 m beyond axis b, which with link `right` (2 kg) is 1 m beyond axis a: −9.81·(1.5 + 2).
    assert_eq!(folder.read("torques.csv"), "tau1,tau2\n-34.335,-4.905\n");
}
