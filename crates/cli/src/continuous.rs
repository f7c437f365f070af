//! The option `--continuous`: joints that turn without end, of which a process sees the place on the circle.

use puma_dyn::robot::JointKind;
use torque_model::{CircleCover, ContinuousJoints, Samples};

use crate::error::CliError;
use crate::header_joints::chosen;
use crate::joints::Joints;
use crate::messages;

/// Which joints turn without end.
#[derive(clap::Args, Debug)]
pub struct ContinuousArgs {
    /// Joints that turn without end, by number or name: a process sees their cosine and sine, so that a turn further
    /// torques are the same. `auto` takes those of type `continuous` of --robot; without a robot those whose positions
    /// fill one turn, as -π to π or 0 to 2π, which it says; or `none` [default: auto]
    #[arg(
        long,
        value_name = "auto|none|JOINT,…",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    pub continuous: Vec<String>,
}

impl ContinuousArgs {
    /// Whether the option was given.
    pub fn is_given(&self) -> bool {
        !self.continuous.is_empty()
    }

    /// The joints that are named, before any row is read; `None` where none has a name.
    ///
    /// # Errors
    /// A joint that there is not, or that slides.
    pub fn named(&self, joints: &Joints) -> Result<Option<ContinuousJoints>, CliError> {
        match self.words().as_slice() {
            [] | ["auto" | "none"] => Ok(None),
            _ => self.by_name(joints).map(Some),
        }
    }

    fn words(&self) -> Vec<&str> {
        self.continuous.iter().map(|name| name.trim()).collect()
    }

    /// The joints, with notes of what was taken for one.
    ///
    /// # Errors
    /// A joint that there is not, or that slides.
    pub fn of(
        &self,
        file: &str,
        joints: &Joints,
        samples: &Samples,
    ) -> Result<ContinuousJoints, CliError> {
        match self.words().as_slice() {
            ["none"] => Ok(ContinuousJoints::none()),
            [] | ["auto"] if joints.are_of_robot() => Ok(of_robot(file, joints)),
            [] | ["auto"] => Ok(of_positions(file, joints, samples)),
            _ => self.by_name(joints),
        }
    }

    fn by_name(&self, joints: &Joints) -> Result<ContinuousJoints, CliError> {
        let found = chosen("--continuous", &self.continuous, joints)?;
        let slides = |joint: &&usize| joints.kind(**joint) == Some(JointKind::Prismatic);
        if let Some(&joint) = found.iter().find(slides) {
            return Err(CliError::Usage(format!(
                "--continuous {name}: the {whose}'s joint {name} slides (type prismatic)",
                name = joints.names[joint],
                whose = joints.whose
            )));
        }
        Ok(ContinuousJoints::of(found))
    }
}

/// The joints that a robot's description says turn without end.
fn of_robot(file: &str, joints: &Joints) -> ContinuousJoints {
    let turns = |joint: &usize| joints.kind(*joint) == Some(JointKind::Continuous);
    let found: Vec<usize> = (0..joints.names.len()).filter(turns).collect();
    if !found.is_empty() {
        let names = quoted(found.iter().map(|joint| &joints.names[*joint]));
        messages::note(format!(
            "{file}: {names} turn without end (type continuous of --robot): torques are the same a turn further; \
             --continuous none if not"
        ));
    }
    ContinuousJoints::of(found)
}

/// The joints whose positions fill one turn; those that go beyond one are mentioned.
fn of_positions(file: &str, joints: &Joints, samples: &Samples) -> ContinuousJoints {
    let mut found = Vec::new();
    for (joint, name) in joints.names.iter().enumerate() {
        let positions = samples.x.col(joint).iter().copied();
        let Some(cover) = CircleCover::of(positions) else {
            continue;
        };
        if cover.is_one_turn() {
            let gap = cover.largest_gap.to_degrees();
            messages::note(format!(
                "{file}: the positions of `{name}` fill a turn ({:.3} to {:.3}, largest gap {gap:.0}°): taken for a joint \
                 that turns without end, whose torques are the same a turn further; --continuous none if it is not",
                cover.min, cover.max
            ));
            found.push(joint);
        } else if cover.is_several_turns() {
            messages::note(format!(
                "{file}: the positions of `{name}` go from {:.3} to {:.3}: if it is a joint that turns without end, say \
                 --continuous {name}",
                cover.min, cover.max
            ));
        }
    }
    ContinuousJoints::of(found)
}

fn quoted<'a>(names: impl Iterator<Item = &'a String>) -> String {
    let names: Vec<String> = names.map(|name| format!("`{name}`")).collect();
    names.join(", ")
}
