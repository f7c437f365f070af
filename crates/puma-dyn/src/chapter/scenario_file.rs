//! The scenario as its TOML file states it: keys, units and the checks that the values fit together.

use serde::Deserialize;

use crate::chapter::inverse_kin::{Arm, Branch, Elbow, Wrist};
use crate::error::DynError;
use crate::robot::friction_law::Friction;
use crate::robot::text_file::line_and_column;

/// A whole scenario file, parsed and checked.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ScenarioFile {
    pub robot: RobotSection,
    pub tool: ToolSection,
    pub path: PathSection,
    #[serde(rename = "load")]
    pub loads: Vec<LoadSection>,
}

/// Which arm, in which configuration, under which friction.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RobotSection {
    name: String,
    arm: ArmName,
    elbow: i8,
    wrist: i8,
    /// Height of the shoulder above the origin of the paths, m.
    pub shoulder_height: f64,
    /// Magnitude, m/s².
    pub gravity: f64,
    friction: FrictionName,
}

/// The pointer on the last link; angles in degrees.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ToolSection {
    pub offset: f64,
    pub pitch: f64,
    pub yaw: f64,
}

/// The figures of eight, one per entry of `centre_x`; rotations in degrees, durations in seconds.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PathSection {
    pub half_width: f64,
    pub half_height: f64,
    pub samples: usize,
    pub centre_x: Vec<f64>,
    pub centre_z: Vec<f64>,
    pub rotation: Vec<f64>,
    pub durations: Vec<f64>,
}

/// A homogeneous cuboid in the frame of the last link.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct LoadSection {
    pub name: String,
    pub mass: f64,
    pub size: [f64; 3],
    pub centre: [f64; 3],
    pub rpy: [f64; 3],
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum ArmName {
    Left,
    Right,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum FrictionName {
    None,
    Modern,
    #[serde(rename = "toolbox-2008")]
    Toolbox2008,
}

impl RobotSection {
    /// The configuration of the arm along every path.
    pub fn branch(&self) -> Branch {
        let arm = match self.arm {
            ArmName::Left => Arm::Left,
            ArmName::Right => Arm::Right,
        };
        let wrist = if self.wrist > 0 {
            Wrist::NoFlip
        } else {
            Wrist::Flip
        };
        Branch::new(arm, Elbow::from_acos_sign(arm, self.elbow > 0), wrist)
    }

    /// The friction convention.
    pub fn friction(&self) -> Friction {
        match self.friction {
            FrictionName::None => Friction::None,
            FrictionName::Modern => Friction::Modern,
            FrictionName::Toolbox2008 => Friction::Toolbox2008,
        }
    }
}

impl ScenarioFile {
    /// Parses and checks the text of a scenario file.
    ///
    /// # Errors
    /// [`DynError::Scenario`] with the key and what is wrong with it.
    pub fn parse(text: &str) -> Result<Self, DynError> {
        let file: Self = toml::from_str(text).map_err(|error| not_toml(text, &error))?;
        file.check_robot()?;
        file.check_paths()?;
        file.check_loads()?;
        Ok(file)
    }

    fn check_robot(&self) -> Result<(), DynError> {
        let robot = &self.robot;
        if robot.name != "puma560" {
            let name = &robot.name;
            return Err(fault(&format!(
                "robot.name is `{name}`, only `puma560` has closed-form inverse kinematics"
            )));
        }
        for (key, sign) in [("robot.elbow", robot.elbow), ("robot.wrist", robot.wrist)] {
            if sign.abs() != 1 {
                return Err(fault(&format!("{key} is {sign}, must be 1 or -1")));
            }
        }
        finite("robot.shoulder_height", robot.shoulder_height)?;
        finite("robot.gravity", robot.gravity)?;
        finite("tool.offset", self.tool.offset)?;
        finite("tool.pitch", self.tool.pitch)?;
        finite("tool.yaw", self.tool.yaw)
    }

    fn check_paths(&self) -> Result<(), DynError> {
        let path = &self.path;
        positive("path.half_width", path.half_width)?;
        positive("path.half_height", path.half_height)?;
        if path.samples == 0 {
            return Err(fault("path.samples is 0, must be at least 1"));
        }
        if path.centre_x.is_empty() {
            return Err(fault(
                "path.centre_x is empty, there must be at least one path",
            ));
        }
        if path.durations.is_empty() {
            return Err(fault(
                "path.durations is empty, there must be at least one speed",
            ));
        }
        let n_paths = path.centre_x.len();
        for (key, values) in [
            ("path.centre_z", &path.centre_z),
            ("path.rotation", &path.rotation),
        ] {
            if values.len() != n_paths {
                let n = values.len();
                return Err(fault(&format!(
                    "{key} has {n} entries, path.centre_x has {n_paths}"
                )));
            }
        }
        for (key, values) in [
            ("path.centre_x", &path.centre_x),
            ("path.centre_z", &path.centre_z),
            ("path.rotation", &path.rotation),
        ] {
            values.iter().try_for_each(|&value| finite(key, value))?;
        }
        path.durations
            .iter()
            .try_for_each(|&value| positive("path.durations", value))
    }

    fn check_loads(&self) -> Result<(), DynError> {
        for (idx, load) in self.loads.iter().enumerate() {
            let name = &load.name;
            // Names become parts of file names and fields of CSV files.
            let is_plain = |c: char| c.is_alphanumeric() || c == '-' || c == '_';
            if name.is_empty() || !name.chars().all(is_plain) {
                return Err(fault(&format!(
                    "load name `{name}` must be letters, digits, `-` and `_`"
                )));
            }
            if self.loads[..idx].iter().any(|other| other.name == *name) {
                return Err(fault(&format!("load name `{name}` is used more than once")));
            }
        }
        Ok(())
    }
}

/// What the parser refuses, in one line with its place.
fn not_toml(text: &str, error: &toml::de::Error) -> DynError {
    let (line, _) = line_and_column(text, error);
    fault(&format!("line {line}: {}", error.message()))
}

fn finite(key: &str, value: f64) -> Result<(), DynError> {
    if value.is_finite() {
        return Ok(());
    }
    Err(fault(&format!("{key} is {value}, must be finite")))
}

fn positive(key: &str, value: f64) -> Result<(), DynError> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(fault(&format!("{key} is {value}, must be positive")))
}

fn fault(reason: &str) -> DynError {
    DynError::Scenario {
        reason: reason.to_owned(),
    }
}
