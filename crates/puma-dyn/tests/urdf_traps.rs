//! What trips people up in URDF robots: each trap is handled, or refused by name and place.

use puma_dyn::robot::JointKind;
use puma_dyn::{Context, DynError, Effects, Model, Sidecar, Warning, Workspace, parse_urdf, rnea};

use crate::urdf_arm::{ARM, LOWER_INERTIAL, UPPER, arm_with, load, refused};

#[test]
fn the_arm_itself_is_loaded_without_a_doubt() {
    let loaded = load(ARM);
    assert_eq!(loaded.warnings, []);
    assert_eq!(loaded.friction, None);
    assert_eq!(loaded.model.joint_names(), ["shoulder", "elbow"]);
    assert!(loaded.strict().is_ok());
}

#[test]
fn a_link_without_inertial_on_a_fixed_joint_is_a_massless_frame() {
    let loaded = load(ARM);
    for name in ["bracket", "tool", "base"] {
        let link = loaded.description.links.iter().find(|l| l.name == name);
        assert_eq!(link.expect("present").inertial, None);
        assert!(loaded.model.frame_idx(name).is_some(), "{name}");
    }
}

const ZERO_INERTIAL: &str = r#"<inertial>
      <mass value="0"/>
      <inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/>
    </inertial>"#;

#[test]
fn a_moving_joint_with_nothing_beyond_it_is_refused_and_missing_is_told_from_zero() {
    let missing = ["`elbow` moves", "hint: link `lower` has no <inertial>"];
    refused(&arm_with(LOWER_INERTIAL, ""), &missing);
    let zero = [
        "`elbow` moves",
        "hint: the <inertial> of link `lower` states zero",
    ];
    refused(&arm_with(LOWER_INERTIAL, ZERO_INERTIAL), &zero);
}

#[test]
fn a_moving_link_without_inertial_is_massless_with_a_warning_but_a_stated_zero_is_silent() {
    let upper = r#"<inertial>
      <origin xyz="0.1 0 0"/>
      <mass value="2"/>
      <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/>
    </inertial>"#;
    let missing = load(&arm_with(upper, ""));
    let expected = Warning::NoInertial {
        link: "upper".to_owned(),
    };
    assert_eq!(missing.warnings, [expected]);
    assert_eq!(missing.description.links[1].inertial, None);

    let zero = load(&arm_with(upper, ZERO_INERTIAL));
    assert_eq!(zero.warnings, []);
    assert!(zero.description.links[1].inertial.is_some());
}

#[test]
fn a_continuous_joint_is_one_number_without_a_range() {
    let loaded = load(ARM);
    assert_eq!(loaded.model.n_joints(), 2);
    assert_eq!(loaded.model.joint_kind(1), JointKind::Continuous);
    assert_eq!(loaded.model.limits(1), None);
}

#[test]
fn joints_that_are_not_one_number_each_are_refused_by_name() {
    for kind in ["planar", "floating", "spherical"] {
        let urdf = arm_with(r#"type="continuous""#, &format!(r#"type="{kind}""#));
        let error = refused(&urdf, &["arm.urdf:31: joint `elbow` is ", kind]);
        assert!(matches!(error, DynError::UnsupportedJoint { .. }));
    }
    let urdf = arm_with(r#"type="continuous""#, r#"type="hinge""#);
    refused(&urdf, &["arm.urdf:31:", "joint `elbow`", "\"hinge\""]);
}

#[test]
fn mimic_is_refused_by_name_unless_the_sidecar_locks_the_joint() {
    let mimic = r#"<dynamics damping="0.7" friction="0.2"/><mimic joint="shoulder"/>"#;
    let urdf = arm_with(r#"<dynamics damping="0.7" friction="0.2"/>"#, mimic);
    let hint = "hint: lock it with `locked_at` under [joint.elbow]";
    refused(
        &urdf,
        &["arm.urdf:36: joint `elbow` mimics `shoulder`", hint],
    );

    let locked = Sidecar::parse("arm.toml", "[joint.elbow]\nlocked_at = 0.3").expect("valid");
    let loaded = parse_urdf("arm.urdf", &urdf, Some(&locked)).expect("locked");
    assert_eq!(loaded.model.joint_names(), ["shoulder"]);
}

#[test]
fn a_locked_joint_gives_the_torques_of_the_same_joint_held_still() {
    let empty = Context::empty();
    let torques = |model: &Model, q: &[f64], qd: &[f64], qdd: &[f64]| {
        let mut tau = vec![0.0; q.len()];
        let mut workspace = Workspace::new(model);
        rnea(
            model,
            &mut workspace,
            Effects::ALL,
            &empty,
            q,
            qd,
            qdd,
            &mut tau,
        );
        tau
    };
    let locked = Sidecar::parse("arm.toml", "[joint.elbow]\nlocked_at = -1.1").expect("valid");
    let prismatic = arm_with(
        r#"name="elbow" type="continuous""#,
        r#"name="elbow" type="prismatic""#,
    );
    for urdf in [ARM, &prismatic] {
        let urdf = urdf.replace(r#"<axis xyz="0 0 1"/>"#, r#"<axis xyz="1 2 -2"/>"#);
        let locked = parse_urdf("arm.urdf", &urdf, Some(&locked))
            .expect("valid")
            .model;
        let ours = torques(&locked, &[0.4], &[0.7], &[-2.0])[0];
        let held = torques(&load(&urdf).model, &[0.4, -1.1], &[0.7, 0.0], &[-2.0, 0.0])[0];
        // A dozen roundings of numbers below 100 N·m.
        let tolerance = 16.0 * f64::EPSILON * 100.0;
        assert!((ours - held).abs() <= tolerance, "{ours} {held}");
    }
}

#[test]
fn negative_mass_and_friction_are_refused_by_name() {
    refused(
        &arm_with(UPPER, r#"<mass value="-2"/>"#),
        &["link `upper`", "-2"],
    );
    let damping = arm_with(r#"damping="0.7""#, r#"damping="-0.7""#);
    refused(&damping, &["joint `elbow`", "-0.7"]);
}

#[test]
fn a_joint_between_links_that_do_not_exist_is_refused_by_name() {
    let child = arm_with(r#"<child link="tool"/>"#, r#"<child link="tol"/>"#);
    refused(&child, &["joint `flange`: child link `tol` does not exist"]);
    let parent = arm_with(r#"<parent link="bracket"/>"#, r#"<parent link="braket"/>"#);
    refused(
        &parent,
        &["joint `elbow`: parent link `braket` does not exist"],
    );
}

#[test]
fn a_robot_that_is_not_one_tree_is_refused_by_name() {
    let two_roots = arm_with("</robot>", r#"<link name="table"/></robot>"#);
    refused(&two_roots, &["2 root links", "base", "table"]);

    let two_parents = arm_with(
        "</robot>",
        r#"<joint name="weld" type="fixed"><parent link="base"/><child link="lower"/></joint></robot>"#,
    );
    refused(&two_parents, &["`lower`", "`elbow`", "`weld`"]);

    let all_in_a_loop = arm_with(
        "</robot>",
        r#"<joint name="weld" type="fixed"><parent link="tool"/><child link="base"/></joint></robot>"#,
    );
    refused(&all_in_a_loop, &["loop"]);

    let loop_beside_a_tree = arm_with(
        "</robot>",
        r#"<link name="a"/><link name="b"/>
        <joint name="ab" type="fixed"><parent link="a"/><child link="b"/></joint>
        <joint name="ba" type="fixed"><parent link="b"/><child link="a"/></joint></robot>"#,
    );
    refused(&loop_beside_a_tree, &["loop", "`a`"]);
}

#[test]
fn duplicate_names_are_refused_by_name() {
    let links = arm_with(r#"<link name="tool"/>"#, r#"<link name="lower"/>"#);
    refused(&links, &["link name `lower`"]);
    let joints = arm_with(r#"joint name="flange""#, r#"joint name="bolt""#);
    refused(&joints, &["joint name `bolt`"]);
}

#[test]
fn a_zero_axis_is_refused_and_a_missing_one_is_x() {
    let axis = r#"<axis xyz="0 0 1"/>"#;
    refused(
        &arm_with(axis, r#"<axis xyz="0 0 0"/>"#),
        &["joint `elbow`", "axis is zero"],
    );
    let missing = load(&arm_with(axis, ""));
    let elbow = &missing.description.joints[2];
    assert_eq!(
        elbow.axis.map(f64::to_bits),
        [1.0, 0.0, 0.0].map(f64::to_bits)
    );
}

#[test]
fn a_transmission_with_a_reduction_is_not_read_and_says_where_the_gear_ratio_goes() {
    let transmission = |reduction: &str| {
        let tag = format!(
            r#"<transmission name="t"><type>simple</type><joint name="elbow"/>
            <actuator name="m"><mechanicalReduction>{reduction}</mechanicalReduction></actuator>
            </transmission></robot>"#
        );
        arm_with("</robot>", &tag)
    };
    let warnings = load(&transmission("101")).warnings;
    let text = warnings[0].to_string();
    for part in ["joint `elbow`", "101", "line 43", "[joint.elbow]"] {
        assert!(text.contains(part), "`{part}` is not in: {text}");
    }
    assert_eq!(warnings.len(), 1);
    assert_eq!(load(&transmission("1.0")).warnings, []);

    let sidecar = "[joint.elbow]\ngear_ratio = 101\nrotor_inertia = 1e-5";
    let sidecar = Sidecar::parse("arm.toml", sidecar).expect("valid");
    let loaded = parse_urdf("arm.urdf", &transmission("101"), Some(&sidecar)).expect("valid");
    assert_eq!(loaded.warnings, []);
}

#[test]
fn angles_too_large_for_radians_are_suspected_to_be_degrees() {
    let cases = [
        (
            r#"lower="-2""#,
            r#"lower="-170""#,
            "shoulder",
            "limit lower",
            -170.0,
        ),
        (
            r#"upper="2.5""#,
            r#"upper="90""#,
            "shoulder",
            "limit upper",
            90.0,
        ),
        (
            r#"rpy="0.1 0 0""#,
            r#"rpy="0 -90 0""#,
            "bolt",
            "origin rpy",
            -90.0,
        ),
        (
            r#"rpy="0 0 0.5""#,
            r#"rpy="0 0 45""#,
            "elbow",
            "inertial origin rpy",
            45.0,
        ),
    ];
    for (old, new, joint, quantity, value) in cases {
        let loaded = load(&arm_with(old, new));
        let expected = Warning::LooksLikeDegrees {
            joint: joint.to_owned(),
            quantity,
            value,
        };
        assert_eq!(loaded.warnings, [expected]);
        let error = loaded.strict().expect_err("strict").to_string();
        assert!(
            error.contains("radians") && error.contains(joint),
            "{error}"
        );
    }
    // Full turns, three half turns as rounded by others, and "no limit" written as a number.
    for upper in ["6.2832", "9.42477796077", "10", "1e16"] {
        let urdf = arm_with(r#"upper="2.5""#, &format!(r#"upper="{upper}""#));
        assert_eq!(load(&urdf).warnings, []);
    }
}

#[test]
fn limits_that_are_not_stated_are_infinite_and_reversed_ones_are_noticed() {
    let no_range = load(&arm_with(r#"lower="-2" upper="2.5""#, ""));
    let limits = no_range.model.limits(0).expect("stated");
    assert!(
        limits.lower.is_infinite() && limits.upper.is_infinite(),
        "{limits:?}"
    );
    assert!((limits.effort - 40.0).abs() <= 0.0);

    let reversed = load(&arm_with(r#"lower="-2""#, r#"lower="3""#)).warnings;
    assert!(
        matches!(reversed[..], [Warning::ReversedLimits { .. }]),
        "{reversed:?}"
    );
}

#[test]
fn an_inertia_no_rigid_body_has_is_a_warning_that_strict_refuses() {
    // Iyy > Ixx + Izz: no mass distribution has that.
    let old = r#"<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/>
    </inertial>
  </link>
  <link name="bracket"/>"#;
    let urdf = arm_with(old, &old.replace(r#"iyy="0.02""#, r#"iyy="0.2""#));
    let loaded = load(&urdf);
    assert!(
        matches!(&loaded.warnings[..], [Warning::Unphysical(w)] if w.link == "upper"),
        "{:?}",
        loaded.warnings
    );
    let error = loaded.strict().expect_err("strict");
    assert!(matches!(error, DynError::Doubtful { .. }));
    assert!(error.to_string().contains("link `upper`"), "{error}");
}

#[test]
fn the_root_link_may_have_an_inertia_and_it_loads_no_joint() {
    let base = arm_with(
        r#"<link name="base"/>"#,
        &format!(r#"<link name="base">{LOWER_INERTIAL}</link>"#),
    );
    assert_eq!(load(&base).warnings, []);
}

/// Torques of the arm in one state, friction included, N·m.
fn torques(urdf: &str) -> Vec<f64> {
    let model = load(urdf).model;
    let mut tau = vec![0.0; 2];
    let (q, qd, qdd) = ([0.4, -1.1], [0.7, 1.3], [-2.0, 3.0]);
    let (empty, effects) = (Context::empty(), Effects::ALL);
    rnea(
        &model,
        &mut Workspace::new(&model),
        effects,
        &empty,
        &q,
        &qd,
        &qdd,
        &mut tau,
    );
    tau
}

#[test]
fn a_fixed_joint_between_moving_ones_gives_the_torques_of_the_robot_merged_by_hand() {
    // The bolt is a pure shift here, so that its origin can be added to the elbow's by hand, and a
    // 3 kg point mass at its end moves the centre of the 2 kg upper arm from 0.1 to 0.22 m.
    let bolted = arm_with(
        r#"<origin xyz="0.3 0 0" rpy="0.1 0 0"/>"#,
        r#"<origin xyz="0.3 0 0"/>"#,
    )
    .replace(
        r#"<link name="bracket"/>"#,
        r#"<link name="bracket"><inertial><mass value="3"/>
            <inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial></link>"#,
    );
    let upper = r#"<origin xyz="0.1 0 0"/>
      <mass value="2"/>
      <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/>"#;
    // I + Σ m d²: 0.02 + 2 · 0.12² + 3 · 0.08² = 0.068 kg m² about y and z.
    let merged = arm_with(
        upper,
        r#"<origin xyz="0.22 0 0"/>
      <mass value="5"/>
      <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.068" iyz="0" izz="0.068"/>"#,
    )
    .replace(r#"<parent link="bracket"/>"#, r#"<parent link="upper"/>"#)
    .replace(r#"<origin xyz="0 0 0.1"/>"#, r#"<origin xyz="0.3 0 0.1"/>"#);
    let (bolted, merged) = (torques(&bolted), torques(&merged));
    for (bolted, merged) in bolted.iter().zip(&merged) {
        // A dozen roundings of numbers below 100 N·m.
        let tolerance = 16.0 * f64::EPSILON * 100.0;
        assert!((bolted - merged).abs() <= tolerance, "{bolted} {merged}");
    }
    assert!(merged[0].abs() > 1.0 && merged[1].abs() > 0.1, "{merged:?}");
}
