//! Which columns of a table hold the state of which joint, and what the torque columns are called.
//!
//! Two naming schemes: `q1, qd1, qdd1, …` by number, or `q_<joint>, qd_<joint>, qdd_<joint>, …` by name.

use crate::error::CliError;
use crate::joints::Joints;
use crate::number_column::NumberColumn;

/// Prefixes of the state columns, in the order of x = (q, qd, qdd).
pub const QUANTITIES: [&str; 3] = ["q", "qd", "qdd"];

/// How a file names the joints.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Naming {
    /// `q1`, in the order of the robot's joints.
    Numbered,
    /// `q_<joint>`.
    Named,
}

/// The columns of a table, told apart.
#[derive(Debug)]
pub struct StateColumns {
    /// How the file names the joints.
    pub naming: Naming,
    /// 3·n_joints columns: q of every joint, then qd, then qdd.
    pub states: Vec<NumberColumn>,
    /// Positions of all other columns.
    pub extra: Vec<usize>,
    /// State columns by name of joints that the robot does not have; they are among `extra`.
    pub strangers: Vec<String>,
}

impl Naming {
    /// The column of a quantity of a joint.
    pub fn column(self, quantity: &str, joint_idx: usize, joint: &str) -> String {
        match self {
            Self::Numbered => format!("{quantity}{}", joint_idx + 1),
            Self::Named => format!("{quantity}_{joint}"),
        }
    }

    /// The columns of a quantity for every joint of a robot.
    pub fn columns(self, quantity: &str, joints: &[String]) -> Vec<String> {
        joints
            .iter()
            .enumerate()
            .map(|(idx, joint)| self.column(quantity, idx, joint))
            .collect()
    }

    /// The state columns of a robot, in the order of x.
    fn state_columns(self, joints: &[String]) -> Vec<String> {
        QUANTITIES
            .iter()
            .flat_map(|quantity| self.columns(quantity, joints))
            .collect()
    }
}

impl StateColumns {
    /// Finds the state columns of the joints in a header.
    ///
    /// # Errors
    /// Missing columns, columns by number of more joints than the robot has, and a header that holds states
    /// under both naming schemes.
    pub fn find(file: &str, header: &[String], joints: &Joints) -> Result<Self, CliError> {
        let names = &joints.names;
        let present = |naming: Naming| {
            naming
                .state_columns(names)
                .iter()
                .filter(|name| header.contains(name))
                .count()
        };
        let (numbered, named) = (present(Naming::Numbered), present(Naming::Named));
        if numbered > 0 && named > 0 {
            let reason = format!(
                "states are given both by number ({}, …) and by joint name ({}, …); keep one of the two",
                first_present(Naming::Numbered, names, header),
                first_present(Naming::Named, names, header),
            );
            return Err(CliError::Columns {
                file: file.to_owned(),
                reason,
            });
        }
        let looks_named = numbered == 0 && header.iter().any(|name| name.starts_with("q_"));
        let naming = if named > 0 || looks_named {
            Naming::Named
        } else {
            Naming::Numbered
        };
        check(file, header, joints, naming)?;
        Ok(Self::of(header, joints, naming))
    }

    /// Columns of a header in which every state is known to be present.
    fn of(header: &[String], joints: &Joints, naming: Naming) -> Self {
        let n_joints = joints.names.len();
        let names = naming.state_columns(&joints.names);
        let states: Vec<NumberColumn> = names
            .into_iter()
            .enumerate()
            .filter_map(|(position, name)| {
                let (derivative, joint_idx) = (position / n_joints, position % n_joints);
                Some(NumberColumn {
                    idx: header.iter().position(|column| *column == name)?,
                    name,
                    joint: joints.names[joint_idx].clone(),
                    unit: joints.unit(derivative, joint_idx),
                })
            })
            .collect();
        let extra = (0..header.len())
            .filter(|idx| states.iter().all(|column| column.idx != *idx))
            .collect();
        Self {
            naming,
            states,
            extra,
            strangers: strangers(header, &joints.names, naming),
        }
    }
}

fn first_present(naming: Naming, joints: &[String], header: &[String]) -> String {
    naming
        .state_columns(joints)
        .into_iter()
        .find(|name| header.contains(name))
        .unwrap_or_default()
}

/// Refuses missing states, and columns by number of more joints than the robot has.
fn check(file: &str, header: &[String], joints: &Joints, naming: Naming) -> Result<(), CliError> {
    let file = || file.to_owned();
    let missing: Vec<String> = naming
        .state_columns(&joints.names)
        .into_iter()
        .filter(|name| !header.contains(name))
        .collect();
    let strangers = strangers(header, &joints.names, naming);
    if !missing.is_empty() {
        let hint = hint(header, joints, &strangers);
        return Err(CliError::MissingColumns {
            file: file(),
            missing,
            found: header.to_vec(),
            hint,
        });
    }
    if naming == Naming::Numbered && !strangers.is_empty() {
        let whose = joints.whose;
        let reason = format!(
            "the {whose} has only {} ({}), but there is also: {}; is it the right {whose}?",
            count(&joints.names),
            joints.names.join(", "),
            strangers.join(", "),
        );
        return Err(CliError::Columns {
            file: file(),
            reason,
        });
    }
    Ok(())
}

/// State columns of joints that the robot does not have.
fn strangers(header: &[String], joints: &[String], naming: Naming) -> Vec<String> {
    let own = naming.state_columns(joints);
    header
        .iter()
        .filter(|name| is_state(name, naming) && !own.contains(name))
        .cloned()
        .collect()
}

/// Whether a name has the form of a state column.
fn is_state(name: &str, naming: Naming) -> bool {
    QUANTITIES.iter().any(|quantity| {
        name.strip_prefix(quantity)
            .is_some_and(|rest| match naming {
                Naming::Numbered => {
                    !rest.is_empty() && rest.bytes().all(|byte| byte.is_ascii_digit())
                }
                Naming::Named => rest.len() > 1 && rest.starts_with('_'),
            })
    })
}

/// What is needed, which columns belong to no joint of it, and the wrong separator if that is the cause.
fn hint(header: &[String], joints: &Joints, strangers: &[String]) -> String {
    let n = joints.names.len();
    let first = joints.names.first().map_or("", String::as_str);
    let needs = format!(
        "The {} has {} ({}) and needs q1..q{n}, qd1..qd{n}, qdd1..qdd{n}, or q_{first}, …, qd_{first}, …, qdd_{first}, …",
        joints.whose,
        count(&joints.names),
        joints.names.join(", "),
    );
    let foreign = match strangers {
        [] => String::new(),
        _ => format!("; columns of no joint of it: {}", strangers.join(", ")),
    };
    format!("{needs}{foreign}{}", separator_hint(header))
}

/// What to say of a header that is one column because its separator is not the comma.
pub fn separator_hint(header: &[String]) -> &'static str {
    match header {
        [only] if only.contains(';') => "; separate the columns by commas, not semicolons",
        [only] if only.contains('\t') => "; separate the columns by commas, not tabs",
        _ => "",
    }
}

fn count(joints: &[String]) -> String {
    format!(
        "{} joint{}",
        joints.len(),
        if joints.len() == 1 { "" } else { "s" }
    )
}
