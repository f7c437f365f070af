//! A small robot as URDF text, to be spoilt in one place per test.

use puma_dyn::{DynError, Loaded, parse_urdf};

/// Two moving links, a bracket and a tool on fixed joints, and tags that are not dynamics.
pub const ARM: &str = r#"<?xml version="1.0"?>
<robot name="arm">
  <link name="base"/>
  <link name="upper">
    <inertial>
      <origin xyz="0.1 0 0"/>
      <mass value="2"/>
      <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/>
    </inertial>
  </link>
  <link name="bracket"/>
  <link name="lower">
    <inertial>
      <origin xyz="0.2 0 0" rpy="0 0 0.5"/>
      <mass value="1"/>
      <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/>
    </inertial>
  </link>
  <link name="tool"/>
  <joint name="shoulder" type="revolute">
    <parent link="base"/>
    <child link="upper"/>
    <axis xyz="0 1 0"/>
    <limit lower="-2" upper="2.5" effort="40" velocity="3"/>
  </joint>
  <joint name="bolt" type="fixed">
    <origin xyz="0.3 0 0" rpy="0.1 0 0"/>
    <parent link="upper"/>
    <child link="bracket"/>
  </joint>
  <joint name="elbow" type="continuous">
    <origin xyz="0 0 0.1"/>
    <parent link="bracket"/>
    <child link="lower"/>
    <axis xyz="0 0 1"/>
    <dynamics damping="0.7" friction="0.2"/>
  </joint>
  <joint name="flange" type="fixed">
    <parent link="lower"/>
    <child link="tool"/>
  </joint>
</robot>
"#;

/// The arm with one piece of its text replaced.
pub fn arm_with(old: &str, new: &str) -> String {
    assert_eq!(ARM.matches(old).count(), 1, "`{old}` must occur once");
    ARM.replace(old, new)
}

pub fn load(urdf: &str) -> Loaded {
    parse_urdf("arm.urdf", urdf, None).unwrap_or_else(|error| panic!("{error}"))
}

/// The message with which a robot is refused, which must contain all of `parts`.
pub fn refused(urdf: &str, parts: &[&str]) -> DynError {
    let error = parse_urdf("arm.urdf", urdf, None).expect_err("must be refused");
    let message = error.to_string();
    for part in parts {
        assert!(message.contains(part), "`{part}` is not in: {message}");
    }
    assert!(
        message.starts_with("arm.urdf"),
        "no file in front: {message}"
    );
    assert!(!message.contains('\n'), "not one line: {message}");
    error
}

/// The upper arm's mass.
pub const UPPER: &str = r#"<mass value="2"/>"#;

/// The lower arm's inertial.
pub const LOWER_INERTIAL: &str = r#"<inertial>
      <origin xyz="0.2 0 0" rpy="0 0 0.5"/>
      <mass value="1"/>
      <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/>
    </inertial>"#;
