//! The robot as the recursions see it: moving bodies in topological order, each about its own z.
//!
//! A [`Model`] is built once from a [`RobotDescription`], validated, and never changes. Links behind
//! fixed joints are merged into the body that carries them, but keep their name as a frame. Inside,
//! every body's frame is turned so that its joint axis is z; results are always given in the link
//! frames of the description.

use std::collections::BTreeSet;

use nalgebra::{Matrix3, Vector3};

use crate::error::DynError;
use crate::robot::body::{Body, Frame, Joint, Motion};
use crate::robot::description::{Inertial, JointDescription, JointKind, Limits, RobotDescription};
use crate::robot::friction_law::JointFriction;
use crate::robot::smooth_friction::{SmoothLaw, Spring};
use crate::robot::validate;
use crate::robot::warning::PhysicalWarning;
use crate::spatial::inertia::BodyInertia;
use crate::spatial::pose::{Pose, rotation_taking_z_to};

/// An immutable robot: geometry, inertia, drives, friction and gravity.
///
/// Positions, speeds, accelerations and torques are slices with one number per moving joint, in the
/// order the description declares them. All quantities are SI.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    name: String,
    gravity: Vector3<f64>,
    bodies: Vec<Body>,
    joint_names: Vec<String>,
    joints: Vec<Joint>,
    frames: Vec<Frame>,
    rotor_inertias: Vec<f64>,
    friction: Vec<JointFriction>,
    smooth_friction: Vec<SmoothLaw>,
    has_smooth_friction: bool,
    springs: Vec<Spring>,
    warnings: Vec<PhysicalWarning>,
}

impl Model {
    /// Validates a description and prepares it for the recursions.
    ///
    /// # Errors
    /// A [`DynError`] that names the link or joint: duplicate names, unknown or doubly used links, no
    /// root or several, loops, a zero axis, an origin that is not a rotation, non-finite numbers,
    /// negative mass, friction or rotor inertia, a positive `coulomb_motor_negative`, a gear ratio
    /// of zero with a rotor, a width or length of smooth friction that is not positive, an asymmetric inertia tensor, and a moving joint beyond which nothing
    /// has mass or inertia. Inertias that no rigid body can have are accepted with a warning, see
    /// [`Model::physical_warnings`].
    pub fn new(description: &RobotDescription) -> Result<Self, DynError> {
        validate::description(description)?;
        let moving: Vec<&JointDescription> = description
            .joints
            .iter()
            .filter(|joint| joint.kind != JointKind::Fixed)
            .collect();

        let mut springs = Vec::new();
        let laws = moving.iter().enumerate();
        let laws =
            laws.map(|(idx, joint)| SmoothLaw::new(idx, &joint.smooth_friction, &mut springs));
        let smooth_friction: Vec<SmoothLaw> = laws.collect();

        let mut model = Self {
            name: description.name.clone(),
            gravity: Vector3::from(description.gravity),
            bodies: Vec::with_capacity(moving.len()),
            joint_names: moving.iter().map(|joint| joint.name.clone()).collect(),
            joints: moving
                .iter()
                .map(|joint| Joint {
                    kind: joint.kind,
                    limits: joint.limits,
                })
                .collect(),
            frames: Vec::with_capacity(description.links.len()),
            rotor_inertias: moving
                .iter()
                .map(|joint| joint.drive.gear_ratio.powi(2) * joint.drive.rotor_inertia)
                .collect(),
            friction: moving
                .iter()
                .map(|joint| JointFriction::new(&joint.drive))
                .collect(),
            has_smooth_friction: !smooth_friction.iter().all(SmoothLaw::is_none),
            smooth_friction,
            springs,
            warnings: validate::physical_warnings(description),
        };
        model.place_links(description)?;
        model.check_subtrees_have_mass()?;
        Ok(model)
    }

    /// The same robot under another gravity (acceleration of free fall in root axes, m/s²).
    #[must_use]
    pub fn with_gravity(mut self, gravity: [f64; 3]) -> Self {
        self.gravity = Vector3::from(gravity);
        self
    }

    /// Name of the robot.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Number of moving joints: the length of q, qd, qdd and tau.
    pub fn n_joints(&self) -> usize {
        self.joints.len()
    }

    /// Names of the moving joints in the order of q.
    pub fn joint_names(&self) -> &[String] {
        &self.joint_names
    }

    /// Position of a moving joint in q, by name.
    pub fn joint_idx(&self, name: &str) -> Option<usize> {
        self.joint_names.iter().position(|joint| joint == name)
    }

    /// Kind of a moving joint.
    ///
    /// # Panics
    /// If `joint_idx` is not below [`Model::n_joints`].
    pub fn joint_kind(&self, joint_idx: usize) -> JointKind {
        self.joints[joint_idx].kind
    }

    /// Limits of a moving joint, if the description has any.
    ///
    /// # Panics
    /// If `joint_idx` is not below [`Model::n_joints`].
    pub fn limits(&self, joint_idx: usize) -> Option<Limits> {
        self.joints[joint_idx].limits
    }

    /// The named frames: one per link of the description, the root first, parents before children.
    pub fn frames(&self) -> &[Frame] {
        &self.frames
    }

    /// Index of the frame of a link, by name; links behind fixed joints included.
    pub fn frame_idx(&self, name: &str) -> Option<usize> {
        self.frames.iter().position(|frame| frame.name == name)
    }

    /// Acceleration of free fall in root axes, m/s².
    pub fn gravity(&self) -> [f64; 3] {
        self.gravity.into()
    }

    /// Whether a joint has friction beyond viscous and Coulomb.
    pub fn has_smooth_friction(&self) -> bool {
        self.has_smooth_friction
    }

    /// Whether the friction of a joint has memory, so that a state alone does not say its torque.
    pub fn has_hysteresis(&self) -> bool {
        !self.springs.is_empty()
    }

    /// Links whose inertia no rigid body can have. Their torques are still computed as stated.
    pub fn physical_warnings(&self) -> &[PhysicalWarning] {
        &self.warnings
    }

    /// Turns the first of [`Model::physical_warnings`] into an error.
    ///
    /// # Errors
    /// [`DynError::Unphysical`] if a link breaks the triangle inequality or has an inertia tensor
    /// that is not positive semi-definite.
    pub fn check_physical(&self) -> Result<(), DynError> {
        match self.warnings.first() {
            None => Ok(()),
            Some(warning) => Err(DynError::Unphysical {
                what: "link",
                name: warning.link.clone(),
                reason: warning.reason.clone(),
            }),
        }
    }

    pub(crate) fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    pub(crate) fn gravity_vector(&self) -> &Vector3<f64> {
        &self.gravity
    }

    /// Rotor inertias seen from the joint, G² Jm, in joint order.
    pub(crate) fn rotor_inertias(&self) -> &[f64] {
        &self.rotor_inertias
    }

    /// Friction of each joint, in joint order.
    pub(crate) fn joint_friction(&self) -> &[JointFriction] {
        &self.friction
    }

    /// Smooth friction of each joint, in joint order.
    pub(crate) fn smooth_friction(&self) -> &[SmoothLaw] {
        &self.smooth_friction
    }

    /// The hysteresis states that smooth friction has, a joint's side by side.
    pub(crate) fn springs(&self) -> &[Spring] {
        &self.springs
    }

    /// Walks the tree from the root, making a frame of every link and a body of every moving joint.
    ///
    /// Of the joints whose parent is placed, the first declared comes next: a description that
    /// already lists parents first keeps its order.
    fn place_links(&mut self, description: &RobotDescription) -> Result<(), DynError> {
        let root = validate::root_link(description)?;
        self.frames.push(Frame {
            name: root.to_owned(),
            body_idx: None,
            pose: Pose::identity(),
        });
        let mut ready: BTreeSet<usize> = joints_leaving(description, root).collect();

        while let Some(next) = ready.pop_first() {
            let joint = &description.joints[next];
            self.place_child(description, joint);
            ready.extend(joints_leaving(description, &joint.child));
        }
        validate::all_links_reached(description, &self.frames)
    }

    /// Adds the child link of a joint whose parent link is already placed.
    fn place_child(&mut self, description: &RobotDescription, joint: &JointDescription) {
        let parent = self.frames.iter().find(|frame| frame.name == joint.parent);
        let (parent_body, parent_pose) = parent.map_or((None, Pose::identity()), |frame| {
            (frame.body_idx, frame.pose)
        });
        let link_pose = parent_pose.compose(&joint.origin);

        let (body_idx, pose) = if joint.kind == JointKind::Fixed {
            (parent_body, link_pose)
        } else {
            let rot_link_body = rotation_taking_z_to(&Vector3::from(joint.axis).normalize());
            self.push_body(joint, parent_body, &link_pose, rot_link_body);
            let pose = Pose::new(rot_link_body.transpose(), Vector3::zeros());
            (Some(self.bodies.len() - 1), pose)
        };
        if let Some(body_idx) = body_idx {
            let link = description
                .links
                .iter()
                .find(|link| link.name == joint.child);
            if let Some(inertial) = link.and_then(|link| link.inertial) {
                let inertia = inertia_of(&inertial).in_parent(&pose);
                self.bodies[body_idx].inertia.add(&inertia);
            }
        }
        self.frames.push(Frame {
            name: joint.child.clone(),
            body_idx,
            pose,
        });
    }

    fn push_body(
        &mut self,
        joint: &JointDescription,
        parent: Option<usize>,
        link_pose: &Pose,
        rot_link_body: Matrix3<f64>,
    ) {
        let joint_idx = self.joint_names.iter().position(|name| *name == joint.name);
        let joint_idx = joint_idx.unwrap_or_default(); // every moving joint is in the list
        self.bodies.push(Body {
            motion: match joint.kind {
                JointKind::Prismatic => Motion::Prismatic,
                _ => Motion::Revolute,
            },
            parent,
            joint_idx,
            pose: link_pose.compose(&Pose::new(rot_link_body, Vector3::zeros())),
            inertia: BodyInertia::zero(),
            rot_link_body,
        });
    }

    /// Refuses a joint that moves nothing: its row of the inertia matrix would be zero.
    fn check_subtrees_have_mass(&self) -> Result<(), DynError> {
        let mut has_mass: Vec<bool> = self
            .bodies
            .iter()
            .map(|body| !body.inertia.is_zero())
            .collect();
        for (idx, body) in self.bodies.iter().enumerate().rev() {
            if !has_mass[idx] {
                let joint = self.joint_names[body.joint_idx].clone();
                return Err(DynError::MasslessSubtree { joint });
            }
            if let Some(parent) = body.parent {
                has_mass[parent] = true;
            }
        }
        Ok(())
    }
}

/// Indices of the joints that leave a link.
fn joints_leaving<'a>(
    description: &'a RobotDescription,
    link: &'a str,
) -> impl Iterator<Item = usize> + 'a {
    let joints = description.joints.iter().enumerate();
    joints
        .filter(move |(_, joint)| joint.parent == link)
        .map(|(idx, _)| idx)
}

/// A link's mass distribution as the numbers that add, in the link's frame.
fn inertia_of(inertial: &Inertial) -> BodyInertia {
    let centre = Vector3::from(inertial.centre);
    BodyInertia::from_central(inertial.mass, centre, &validate::tensor(inertial))
}
