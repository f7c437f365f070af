//! The robot a command works on: built in, or a URDF file with its sidecar.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::{Args, ValueEnum};
use puma_dyn::{Effects, Friction, Model, RobotDescription, load_urdf, puma560};
use torque_model::RobotSource;

use crate::error::CliError;
use crate::messages;

/// Name of the built-in robot.
const PUMA_560: &str = "puma560";

/// Which robot, and which effects are part of its torques.
#[derive(Args, Debug)]
pub struct RobotArgs {
    /// `puma560` (built in, with its motors and friction) or a URDF file
    #[arg(long, value_name = "puma560|FILE.urdf")]
    robot: PathBuf,

    #[command(flatten)]
    details: RobotDetails,
}

/// As [`RobotArgs`], for a command that does without a robot as well.
#[derive(Args, Debug)]
pub struct OptionalRobotArgs {
    /// `puma560` (built in, with its motors and friction) or a URDF file
    #[arg(long, value_name = "puma560|FILE.urdf")]
    robot: Option<PathBuf>,

    #[command(flatten)]
    details: RobotDetails,
}

/// What may be said of a robot beside its name or file.
#[derive(Args, Debug)]
struct RobotDetails {
    /// What a URDF cannot say: rotor inertia, gear ratio, motor-side, smooth and remembering friction, convention
    #[arg(long, value_name = "FILE.toml", requires = "robot")]
    sidecar: Option<PathBuf>,

    /// Friction in the torques [default: the sidecar's `friction_convention`, else modern]
    #[arg(long, value_enum, requires = "robot")]
    friction: Option<FrictionArg>,

    /// Leave out G²·Jm·q̈, the torque that accelerates the motors' rotors
    #[arg(long, requires = "robot")]
    no_rotor_inertia: bool,

    /// Free fall in the axes of the root link, m/s², for a robot that does not stand upright
    #[arg(long, value_name = "X,Y,Z", value_parser = three_numbers, allow_hyphen_values = true, requires = "robot")]
    gravity: Option<[f64; 3]>,

    /// Refuse a robot that no rigid bodies can form instead of warning (the PUMA 560 is one)
    #[arg(long, requires = "robot")]
    strict: bool,
}

/// Which friction torques are added.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum FrictionArg {
    /// Viscous and asymmetric Coulomb friction, against the motion: G²·B·q̇ + |G|·Tc
    Modern,
    /// As the Robotics Toolbox of 2002–2008: G·(B·q̇ + Tc) with the sign of G; for reproductions
    #[value(name = "toolbox-2008")]
    Toolbox2008,
    /// No friction
    None,
}

/// A robot ready for use.
pub struct Robot {
    /// Links and joints by name.
    pub description: RobotDescription,
    /// For the algorithms.
    pub model: Model,
    /// What is part of the torques.
    pub effects: Effects,
}

impl RobotArgs {
    /// The robot asked for.
    pub fn request(&self) -> RobotRequest<'_> {
        RobotRequest {
            robot: &self.robot,
            details: &self.details,
        }
    }
}

impl OptionalRobotArgs {
    /// The robot asked for, if there is one.
    pub fn request(&self) -> Option<RobotRequest<'_>> {
        self.robot.as_deref().map(|robot| RobotRequest {
            robot,
            details: &self.details,
        })
    }
}

/// A robot by name or file, and what was said of it.
#[derive(Debug, Clone, Copy)]
pub struct RobotRequest<'a> {
    robot: &'a Path,
    details: &'a RobotDetails,
}

impl<'a> RobotRequest<'a> {
    /// Loads the robot; warnings and notes go to standard error.
    ///
    /// # Errors
    /// A file that does not exist or is refused, a sidecar for the built-in robot, and with `--strict` every
    /// warning about the robot.
    pub fn load(self) -> Result<Robot, CliError> {
        let (description, mut model, friction) = if self.is_built_in() {
            self.built_in()?
        } else {
            self.urdf_file()?
        };
        if let Some(gravity) = self.details.gravity {
            model = model.with_gravity(gravity);
        }
        let friction = match self.details.friction {
            Some(FrictionArg::Modern) => Friction::Modern,
            Some(FrictionArg::Toolbox2008) => Friction::Toolbox2008,
            Some(FrictionArg::None) => Friction::None,
            None => friction.unwrap_or(Friction::Modern),
        };
        let effects = Effects {
            friction,
            rotor_inertia: !self.details.no_rotor_inertia,
        };
        Ok(Robot {
            description,
            model,
            effects,
        })
    }

    /// Loads the robot with the texts that describe it, for a model file that is to make it again.
    ///
    /// # Errors
    /// As for [`RobotRequest::load`].
    pub fn load_with_source(self) -> Result<torque_model::Robot, CliError> {
        let Robot { model, effects, .. } = self.load()?;
        Ok(torque_model::Robot {
            source: self.source()?,
            model: Arc::new(model),
            effects,
        })
    }

    fn source(self) -> Result<RobotSource, CliError> {
        let read = |path: &Path| {
            let file = path.display().to_string();
            std::fs::read_to_string(path).map_err(CliError::io("read", file))
        };
        Ok(RobotSource {
            urdf: (!self.is_built_in())
                .then(|| read(self.robot))
                .transpose()?,
            sidecar: self.details.sidecar.as_deref().map(read).transpose()?,
            gravity: self.details.gravity,
        })
    }

    /// Whether it is the built-in arm.
    pub fn is_built_in(self) -> bool {
        self.robot == Path::new(PUMA_560)
    }

    /// Files that this robot is read from.
    pub fn files(self) -> Vec<&'a Path> {
        let sidecar = self.details.sidecar.as_deref();
        std::iter::once(self.robot).chain(sidecar).collect()
    }

    /// The built-in arm; that links 1 and 3 of its published parameters are unphysical is no news, so without `--strict`
    /// nothing is said.
    fn built_in(self) -> Result<(RobotDescription, Model, Option<Friction>), CliError> {
        if self.details.sidecar.is_some() {
            let reason = "--sidecar goes with a URDF file; the built-in puma560 has its motors and friction already";
            return Err(CliError::Usage(reason.to_owned()));
        }
        let model = puma560::model();
        if self.details.strict {
            model.check_physical()?;
        }
        Ok((puma560::description(), model, None))
    }

    fn urdf_file(self) -> Result<(RobotDescription, Model, Option<Friction>), CliError> {
        if !self.robot.exists() {
            let name = self.robot.display();
            let reason = format!(
                "--robot {name}: there is no such file, and the only built-in robot is {PUMA_560}"
            );
            return Err(CliError::Usage(reason));
        }
        let mut loaded = load_urdf(self.robot, self.details.sidecar.as_deref())?;
        if self.details.strict {
            loaded = loaded.strict()?;
        }
        for warning in &loaded.warnings {
            messages::warning(format!("{}: {warning}", self.robot.display()));
        }
        self.note_unread_sidecar();
        Ok((loaded.description, loaded.model, loaded.friction))
    }

    /// Says that a file that looks like the sidecar was not read: reading it silently would change torques.
    fn note_unread_sidecar(self) {
        let beside = self.robot.with_extension("toml");
        if self.details.sidecar.is_none() && beside.is_file() {
            let beside = beside.display();
            messages::note(format!(
                "{beside} lies beside the robot and was not read; if it is its sidecar, pass --sidecar {beside}"
            ));
        }
    }
}

/// Three finite numbers between commas.
fn three_numbers(text: &str) -> Result<[f64; 3], String> {
    let numbers: Result<Vec<f64>, _> = text
        .split(',')
        .map(|number| number.trim().parse())
        .collect();
    match numbers.as_deref() {
        Ok(&[x, y, z]) if [x, y, z].iter().all(|number| number.is_finite()) => Ok([x, y, z]),
        _ => Err("three numbers are needed, such as 0,0,-9.81".to_owned()),
    }
}

impl Robot {
    /// The robot that a model file knows, with all of its drives; `whose` is the file's name.
    ///
    /// # Errors
    /// Texts that are not a robot's.
    pub fn of_source(source: &RobotSource, whose: &str) -> Result<Self, CliError> {
        Ok(Self {
            description: source.description(whose)?,
            model: source.model(whose)?,
            effects: Effects::ALL,
        })
    }

    /// What is part of the torques, in words.
    pub fn effects_in_words(&self) -> String {
        let friction = match self.effects.friction {
            Friction::None => "no friction",
            Friction::Modern => "modern friction",
            Friction::Toolbox2008 => "toolbox-2008 friction",
        };
        let rotors = if self.effects.rotor_inertia {
            "rotor inertia"
        } else {
            "no rotor inertia"
        };
        format!("{friction}, {rotors}")
    }
}
