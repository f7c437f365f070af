//! The payload TOML: a load by mass and centre, with its inertia tensor or as a cuboid.
//!
//! ```toml
//! mass = 2.0                      # kg
//! centre = [0.0, 0.0, 0.1]        # m, centre of mass in the axes of the link's frame
//! inertia = [xx, yy, zz, xy, xz, yz]   # kg m², tensor entries about the centre; or:
//! # size = [0.1, 0.2, 0.3]        # m, edges of a homogeneous cuboid
//! # rpy = [0.0, 0.0, 0.0]         # rad, its roll, pitch, yaw about the fixed axes x, y, z
//! # link = "tool0"                # default: the link that the last joint moves
//! ```

use std::path::Path;

use puma_dyn::robot::{JointDescription, JointKind};
use puma_dyn::{Context, Payload, RobotDescription};
use serde::Deserialize;

use crate::error::CliError;
use crate::robot::Robot;
use crate::toml_fault::fault;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PayloadToml {
    mass: f64,
    centre: [f64; 3],
    inertia: Option<[f64; 6]>,
    size: Option<[f64; 3]>,
    rpy: Option<[f64; 3]>,
    link: Option<String>,
}

/// A payload as its file has it.
pub struct PayloadFile {
    file: String,
    /// The body, in the axes of the link.
    pub payload: Payload,
    /// Name of the link, if the file says it.
    pub link: Option<String>,
}

/// Reads a payload and fixes it to the robot.
///
/// # Errors
/// As for [`PayloadFile::read`] and [`PayloadFile::attached`].
pub fn load(path: &Path, robot: &Robot) -> Result<Context, CliError> {
    PayloadFile::read(path)?.attached(robot)
}

impl PayloadFile {
    /// Reads a payload.
    ///
    /// # Errors
    /// A file that cannot be read or is not such a TOML, both or neither of `inertia` and `size`, a body that cannot
    /// be.
    pub fn read(path: &Path) -> Result<Self, CliError> {
        let file = path.display().to_string();
        let text = std::fs::read_to_string(path).map_err(CliError::io("read", file.clone()))?;
        let refuse = |reason: String| CliError::Payload {
            file: file.clone(),
            reason,
        };
        let toml: PayloadToml =
            toml::from_str(&text).map_err(|error| refuse(fault(&text, &error)))?;
        let payload = toml.payload().map_err(&refuse)?;
        Ok(Self {
            payload,
            link: toml.link,
            file,
        })
    }

    /// The payload fixed to its link of a robot.
    ///
    /// # Errors
    /// A link that does not exist or does not move, and no `link` for a robot whose last link is not unique.
    pub fn attached(&self, robot: &Robot) -> Result<Context, CliError> {
        let refuse = |reason: String| CliError::Payload {
            file: self.file.clone(),
            reason,
        };
        let link = match &self.link {
            Some(link) => link,
            None => last_link(&robot.description).map_err(&refuse)?,
        };
        let frame_idx = robot.model.frame_idx(link).ok_or_else(|| {
            let known: Vec<&str> = robot
                .model
                .frames()
                .iter()
                .map(|frame| frame.name.as_str())
                .collect();
            refuse(format!(
                "link = \"{link}\": the robot has no such link; it has {}",
                known.join(", ")
            ))
        })?;
        let attached = robot
            .model
            .attach(frame_idx, &self.payload)
            .map_err(|error| refuse(error.to_string()))?;
        Ok(attached.into())
    }
}

impl PayloadToml {
    fn payload(&self) -> Result<Payload, String> {
        let payload = match (self.inertia, self.size, self.rpy) {
            (Some(inertia), None, None) => Payload::new(self.mass, self.centre, inertia),
            (None, Some(size), rpy) => {
                Payload::cuboid(self.mass, size, self.centre, rpy.unwrap_or_default())
            }
            (Some(_), Some(_), _) => {
                return Err("`inertia` and `size` are both given; keep one of the two".to_owned());
            }
            (Some(_), None, Some(_)) => {
                return Err("`rpy` turns a cuboid given by `size`; `inertia` is in the axes of the link already".to_owned());
            }
            (None, None, _) => {
                let reason = "neither `inertia` = [xx, yy, zz, xy, xz, yz] nor `size` = [x, y, z] is given; a point load \
                              has inertia = [0, 0, 0, 0, 0, 0]";
                return Err(reason.to_owned());
            }
        };
        payload.map_err(|error| error.to_string())
    }
}

/// The link moved by the last joint, if the moving joints form one chain.
fn last_link(robot: &RobotDescription) -> Result<&String, String> {
    let moving: Vec<&JointDescription> = robot
        .joints
        .iter()
        .filter(|joint| joint.kind != JointKind::Fixed)
        .collect();
    let carriers: Vec<Option<&str>> = moving.iter().map(|joint| carrier(robot, joint)).collect();
    let ends: Vec<&String> = moving
        .iter()
        .filter(|joint| !carriers.contains(&Some(joint.name.as_str())))
        .map(|joint| &joint.child)
        .collect();
    if let [only] = ends[..] {
        return Ok(only);
    }
    let names: Vec<&str> = ends.iter().map(|name| name.as_str()).collect();
    Err(format!(
        "the robot branches and ends in the links {}: say which carries the load with link = \"…\"",
        names.join(", "),
    ))
}

/// The moving joint that carries a joint, through fixed ones.
fn carrier<'a>(robot: &'a RobotDescription, joint: &'a JointDescription) -> Option<&'a str> {
    let mut parent = &joint.parent;
    // A valid robot is a tree: the walk ends at its root.
    loop {
        let above = robot
            .joints
            .iter()
            .find(|candidate| candidate.child == *parent)?;
        if above.kind != JointKind::Fixed {
            return Some(&above.name);
        }
        parent = &above.parent;
    }
}
