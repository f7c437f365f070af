//! Robots from URDF: the file, what the file leaves unsaid (the sidecar), and every doubt about it.
//!
//! The reader is `urdf-rs`, which answers with zeros where a file says nothing and drops what it
//! does not know. So the XML is scanned first for everything it hides ([`scan`](super::scan)); then
//! its answer is turned into a [`RobotDescription`] ([`convert`](super::convert)), the sidecar is
//! laid over it, and [`Model::new`] refuses what cannot be simulated.

use std::path::Path;

use super::{convert, scan};
use crate::error::DynError;
use crate::robot::description::RobotDescription;
use crate::robot::friction_law::Friction;
use crate::robot::model::Model;
use crate::robot::sidecar::Sidecar;
use crate::robot::text_file::read;
use crate::robot::warning::Warning;

/// A robot read from files, ready to compute with, and what was noticed on the way.
#[derive(Debug, Clone)]
pub struct Loaded {
    /// The robot as data, the sidecar's drives included.
    pub description: RobotDescription,
    /// The robot as a model.
    pub model: Model,
    /// The friction convention the sidecar states, if it states one.
    pub friction: Option<Friction>,
    /// Doubts, in the order of the file.
    pub warnings: Vec<Warning>,
    /// The robot file's name, for messages.
    file: String,
}

impl Loaded {
    /// Refuses the robot if there is a doubt about the robot itself.
    ///
    /// # Errors
    /// `DynError::Doubtful` with every warning for which [`Warning::is_about_the_robot`] holds.
    pub fn strict(self) -> Result<Self, DynError> {
        let doubts: Vec<Warning> = self
            .warnings
            .iter()
            .filter(|w| w.is_about_the_robot())
            .cloned()
            .collect();
        if doubts.is_empty() {
            return Ok(self);
        }
        Err(DynError::Doubtful {
            file: self.file,
            warnings: doubts,
        })
    }
}

/// Reads a robot from a URDF file and, if given, the sidecar TOML that goes with it.
///
/// Gravity is (0, 0, −9.81) m/s² in the axes of the root link.
///
/// | in the file | answer |
/// |---|---|
/// | link without `<inertial>` on a fixed joint | a frame of its body |
/// | link without `<inertial>` on a moving joint | massless, with a warning; an error if nothing beyond it has mass |
/// | fixed joint between moving ones | merged by the parallel-axis rule |
/// | continuous joint | one number |
/// | planar, floating and spherical joints, `quat_xyzw` | refused by name |
/// | `<mimic>` | refused by name, unless the sidecar locks the joint |
/// | xacro, SDF, MJCF, unbound prefixes, malformed XML | refused with line and column |
/// | `<transmission>` with a reduction | not read, with a warning |
/// | `<gazebo>`, meshes, custom tags | ignored |
/// | angles too large for radians | a warning: degrees? |
/// | inertia no rigid body has | a warning; [`Loaded::strict`] refuses |
///
/// # Errors
/// `DynError::Unreadable` if a file does not exist or is not UTF-8; otherwise as [`parse_urdf`].
pub fn load_urdf(path: &Path, sidecar: Option<&Path>) -> Result<Loaded, DynError> {
    let text = read(path)?;
    let sidecar = sidecar.map(Sidecar::load).transpose()?;
    parse_urdf(&path.display().to_string(), &text, sidecar.as_ref())
}

/// Reads a robot from the text of a URDF; `name` stands for the file in messages.
///
/// # Errors
/// - `DynError::Malformed` with line and column: not XML, an unbound prefix, not a `<robot>`, a
///   missing attribute, text where a number should be, an orientation as quaternion.
/// - `DynError::UnsupportedJoint` with the line and the joint's name: planar, floating and
///   spherical joints, and mimic unless the sidecar locks the joint.
/// - `DynError::NoMovingJoint`, inside `DynError::InFile`, if no joint moves.
/// - `DynError::InFile` around what [`Model::new`] refuses: links that do not exist, several
///   roots, loops, duplicate names, zero axes, negative masses, joints that move nothing.
/// - `DynError::Sidecar` if the sidecar names a joint that does not exist or does not move.
///
/// ```
/// let urdf = r#"<robot name="pendulum">
///   <link name="base"/>
///   <link name="rod"><inertial>
///     <origin xyz="0.5 0 0"/><mass value="2"/>
///     <inertia ixx="0" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/>
///   </inertial></link>
///   <joint name="hinge" type="continuous">
///     <parent link="base"/><child link="rod"/><axis xyz="0 1 0"/>
///   </joint>
/// </robot>"#;
/// let loaded = puma_dyn::parse_urdf("pendulum.urdf", urdf, None)?;
/// assert_eq!(loaded.model.joint_names(), ["hinge"]);
/// assert!(loaded.warnings.is_empty());
/// # Ok::<(), puma_dyn::DynError>(())
/// ```
pub fn parse_urdf(name: &str, text: &str, sidecar: Option<&Sidecar>) -> Result<Loaded, DynError> {
    let text = text.trim_start_matches('\u{feff}');
    let scan = scan::scan(name, text)?;
    refuse_mimics(&scan, sidecar)?;
    let (mut description, mut warnings) = convert::convert(name, &scan)?;
    if let Some(sidecar) = sidecar {
        warnings.extend(sidecar.apply(&mut description)?);
    }

    warnings.extend(unread_transmissions(&scan, sidecar));
    let model = build(&description).map_err(|cause| in_file(name, &description, cause))?;
    warnings.extend(
        model
            .physical_warnings()
            .iter()
            .cloned()
            .map(Warning::Unphysical),
    );
    let friction = sidecar.and_then(Sidecar::friction);
    Ok(Loaded {
        description,
        model,
        friction,
        warnings,
        file: name.to_owned(),
    })
}

/// A model, of which a file must make at least one number.
fn build(description: &RobotDescription) -> Result<Model, DynError> {
    let model = Model::new(description)?;
    if model.n_joints() == 0 {
        return Err(DynError::NoMovingJoint);
    }
    Ok(model)
}

/// A joint that follows another one is refused unless the sidecar locks it.
fn refuse_mimics(scan: &scan::Scan, sidecar: Option<&Sidecar>) -> Result<(), DynError> {
    let is_locked = |joint: &str| sidecar.is_some_and(|s| s.locks(joint));
    match scan.mimics.iter().find(|(joint, _)| !is_locked(joint)) {
        None => Ok(()),
        Some((_, refusal)) => Err(refusal.clone()),
    }
}

/// A reduction is worth a word only where the sidecar does not state the gear itself.
fn unread_transmissions(scan: &scan::Scan, sidecar: Option<&Sidecar>) -> Vec<Warning> {
    let stated =
        |joint: &str| sidecar.is_some_and(|s| s.states_gear_ratio(joint) || s.locks(joint));
    scan.transmissions
        .iter()
        .filter(|t| !stated(&t.joint))
        .map(scan::Transmission::warning)
        .collect()
}

/// What the model refuses, with the file's name and, where the cause is a missing tag, a hint.
fn in_file(file: &str, robot: &RobotDescription, cause: DynError) -> DynError {
    let hint = match &cause {
        DynError::MasslessSubtree { joint } => massless_hint(robot, joint),
        _ => String::new(),
    };
    DynError::InFile {
        file: file.to_owned(),
        cause: Box::new(cause),
        hint,
    }
}

fn massless_hint(robot: &RobotDescription, joint: &str) -> String {
    let Some(joint) = robot.joints.iter().find(|j| j.name == joint) else {
        return String::new();
    };
    let stated = robot
        .links
        .iter()
        .any(|l| l.name == joint.child && l.inertial.is_some());
    let link = &joint.child;
    if stated {
        format!("; hint: the <inertial> of link `{link}` states zero mass and inertia")
    } else {
        format!(
            "; hint: link `{link}` has no <inertial>; add one, or lock the joint in the sidecar"
        )
    }
}
