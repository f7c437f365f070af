//! Files that are no URDF, or not quite: refused with file, line and column.

use std::path::Path;

use proptest::prelude::*;
use puma_dyn::{DynError, load_urdf, parse_urdf};

use crate::urdf_arm::{ARM, UPPER, arm_with, load, refused};

#[test]
fn numbers_that_are_not_finite_numbers_are_refused_with_their_place() {
    let cases = [
        (
            UPPER,
            r#"<mass value="NaN"/>"#,
            "arm.urdf:7:7: link `upper`: <mass value>: `NaN`",
        ),
        (
            UPPER,
            r#"<mass value="inf"/>"#,
            "<mass value>: `inf` is not a finite number",
        ),
        (
            UPPER,
            r#"<mass value="2 kg"/>"#,
            "`2 kg` is not a finite number",
        ),
        (
            UPPER,
            r#"<mass value="2,0"/>"#,
            "`2,0` is not a finite number",
        ),
        (
            r#"xyz="0.2 0 0""#,
            r#"xyz="0.2 0""#,
            "<origin xyz=\"0.2 0\"> has 2 numbers, not 3",
        ),
        // urdf-rs skips the word and reads 0 0 1.
        (
            r#"xyz="0 0 1""#,
            r#"xyz="0 O 0 1""#,
            "joint `elbow`: <axis xyz=\"0 O 0 1\"> has 4 numbers",
        ),
        (
            r#"xyz="0 0 1""#,
            r#"xyz="0 O 1""#,
            "joint `elbow`: <axis xyz>: `O` is not a finite number",
        ),
        (
            r#"damping="0.7""#,
            r#"damping="x""#,
            "joint `elbow`: <dynamics damping>: `x`",
        ),
    ];
    for (old, new, message) in cases {
        refused(&arm_with(old, new), &[message]);
    }
}

#[test]
fn missing_doubled_and_unsupported_parts_are_refused_with_their_place() {
    let cases = [
        (
            UPPER,
            "<mass/>",
            "link `upper`: <mass> has no attribute `value`",
        ),
        (UPPER, "", "link `upper`: <inertial> has no <mass>"),
        (
            UPPER,
            r#"<mass value="2"/><mass value="3"/>"#,
            "link `upper` has more than one <mass>",
        ),
        (
            r#"velocity="3""#,
            "",
            "joint `shoulder`: <limit> has no attribute `velocity`",
        ),
        (
            r#"<child link="tool"/>"#,
            "",
            "joint `flange`: <joint> has no <child>",
        ),
        (
            r#" rpy="0.1 0 0""#,
            r#" quat_xyzw="0 0 0 1""#,
            "joint `bolt`: quat_xyzw is not supported",
        ),
    ];
    for (old, new, message) in cases {
        refused(&arm_with(old, new), &[message]);
    }
}

#[test]
fn malformed_xml_is_refused_with_line_and_column() {
    let unclosed = arm_with(r#"<link name="tool"/>"#, r#"<link name="tool">"#);
    let error = refused(&unclosed, &["not well-formed XML"]);
    assert!(
        matches!(
            error,
            DynError::Malformed {
                line: 42,
                column: 1,
                ..
            }
        ),
        "{error}"
    );
    let ampersand = arm_with(r#"robot name="arm""#, r#"robot name="arm & hand""#);
    refused(&ampersand, &["arm.urdf:2:", "not well-formed XML"]);
    refused("", &["not well-formed XML"]);
    refused("PK\u{3}\u{4}", &["arm.urdf:1:1:"]);
}

#[test]
fn an_unbound_prefix_is_refused_with_a_hint() {
    let urdf = arm_with(
        r#"<link name="tool"/>"#,
        r#"<link name="tool"/><controller:gains p="1"/>"#,
    );
    refused(
        &urdf,
        &[
            "arm.urdf:19:",
            "prefix `controller:` is not declared",
            "hint:",
        ],
    );
}

#[test]
fn a_xacro_file_is_refused_with_a_hint_to_expand_it() {
    let hint = ["arm.urdf:", "xacro file", "hint: expand it first"];
    let unbound = arm_with("</robot>", "<xacro:arm/></robot>");
    refused(&unbound, &hint);
    let robot = r#"<robot name="arm">"#;
    let bound_robot = r#"<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">"#;
    let bound = unbound.replace(robot, bound_robot);
    refused(&bound, &hint);
    refused(&arm_with(UPPER, r#"<mass value="${mass}"/>"#), &hint);
    // The prefix alone is left behind by the expansion itself.
    assert_eq!(load(&arm_with(robot, bound_robot)).warnings, []);
}

#[test]
fn other_formats_and_empty_robots_are_refused() {
    refused(
        "<sdf version='1.7'><model name='m'/></sdf>",
        &["the first tag is <sdf>", "<robot>"],
    );
    refused("<robot name='empty'/>", &["no links"]);
    refused(
        "<robot name='still'><link name='base'/></robot>",
        &["no moving joint"],
    );
}

#[test]
fn a_file_that_does_not_exist_or_is_not_text_is_refused_by_its_path() {
    let error = load_urdf(Path::new("no/such/arm.urdf"), None).expect_err("not there");
    assert!(error.to_string().contains("no/such/arm.urdf"), "{error}");
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let error = load_urdf(here, None).expect_err("a folder");
    assert!(matches!(error, DynError::Unreadable { .. }), "{error}");
    let fixture = here.join("../../fixtures/puma560.urdf");
    let error = load_urdf(&fixture, Some(Path::new("no.toml"))).expect_err("not there");
    assert!(error.to_string().contains("no.toml"), "{error}");
}

#[test]
fn tags_that_are_not_dynamics_are_ignored_quietly() {
    let extra = r#"<gazebo reference="lower"><mu1>0.2</mu1><joint name="elbow"/></gazebo>
      <material name="grey"><color rgba="0.5 0.5 0.5 1"/></material>
      <ros2_control name="x"><joint name="elbow"><param name="p">1</param></joint></ros2_control>
      <my:tag xmlns:my="urn:mine" a="1"/><!-- comment --></robot>"#;
    let tool = r#"<link name="tool"><visual><geometry><mesh filename="package://x/y.stl"/></geometry>
      <material name="grey"><texture/></material></visual><collision><geometry><box size="1 2 3"/></geometry></collision>
      <collision/><sensor name="s"/></link>"#;
    let urdf = arm_with("</robot>", extra).replace(r#"<link name="tool"/>"#, tool);
    let loaded = load(&urdf);
    assert_eq!(loaded.warnings, []);
    assert_eq!(loaded.description, load(ARM).description);
    let with_mark = format!("\u{feff}{ARM}");
    assert_eq!(load(&with_mark).description, loaded.description);
}

#[test]
fn a_robot_in_a_default_namespace_is_the_same_robot() {
    let robot = r#"<robot name="arm">"#;
    let urdf = arm_with(robot, r#"<robot name="arm" xmlns="http://www.ros.org">"#);
    assert_eq!(load(&urdf).description, load(ARM).description);
}

proptest! {
    #[test]
    fn a_file_spoilt_anywhere_is_loaded_or_refused_in_one_line_and_never_panics(
        at in 0..ARM.len(),
        n_lost in 0..40_usize,
        inserted in "[<>/\"=&;!a0. -]{0,4}",
    ) {
        let end = (at + n_lost).min(ARM.len());
        let spoilt = format!("{}{inserted}{}", &ARM[..at], &ARM[end..]);
        if let Err(error) = parse_urdf("arm.urdf", &spoilt, None) {
            let message = error.to_string();
            prop_assert!(message.starts_with("arm.urdf") && !message.contains('\n'), "{message}");
        }
    }
}
