//! Which joints a table of data is about, when nothing but its header says so.

use std::collections::BTreeSet;

use robot_log::Columns;

use crate::columns::{Naming, QUANTITIES, separator_hint};
use crate::error::CliError;
use crate::joints::Joints;

/// How many missing columns a message lists.
const LISTED: usize = 12;

/// The joints of a header: `joint1`, `joint2`, … for numbered columns, or the names of `q_<joint>`, in file order.
///
/// Columns by name beside a full set by number count as other columns, unless they hold states as well.
/// # Errors
/// No states, states by number with gaps or from zero, joints without all of q, qd and qdd, and states under both
/// naming schemes.
pub fn joints_of(file: &str, header: &[String], tau_prefix: &str) -> Result<Joints, CliError> {
    let numbers = joint_numbers(file, header, tau_prefix)?;
    let all = joint_names(header);
    let is_complete = |name: &&String| QUANTITIES.iter().all(|of| has(header, of, name));
    let complete: Vec<String> = all.iter().filter(is_complete).cloned().collect();
    let is_left_out = |name: &String| {
        !complete.is_empty()
            && !complete.contains(name)
            && (is_further_name(name, &complete) || !has(header, tau_prefix, name))
    };
    let names: Vec<String> = all.into_iter().filter(|name| !is_left_out(name)).collect();
    let has_numbered_states = QUANTITIES.iter().any(|quantity| {
        header
            .iter()
            .any(|name| number_of(name, quantity).is_some())
    });
    if !has_numbered_states && names.is_empty() {
        return Err(no_states(file, header));
    }
    if !has_numbered_states {
        require_all(file, header, Naming::Named, names.len(), |idx| {
            names[idx].clone()
        })?;
        return Ok(Joints::by_name("data", names));
    }
    if let Some(name) = complete.first() {
        let reason = format!(
            "states are given both by number (q1, …) and by joint name (q_{name}, …); keep one of the two"
        );
        return Err(columns_error(file, reason));
    }
    let n_joints = numbers.last().copied().unwrap_or_default();
    require_all(file, header, Naming::Numbered, n_joints, |_| String::new())?;
    let names = (1..=n_joints).map(|number| format!("joint{number}"));
    Ok(Joints::by_name("data", names.collect()))
}

/// The indices of the joints asked for, by name or by number from 1, in ascending order.
///
/// # Errors
/// A joint that the data does not have.
pub fn chosen(option: &str, asked: &[String], joints: &Joints) -> Result<Vec<usize>, CliError> {
    let found: Result<BTreeSet<usize>, CliError> = asked
        .iter()
        .map(|joint| {
            joint_idx(joint.trim(), joints).ok_or_else(|| {
                let (whose, known) = (joints.whose, joints.names.join(", "));
                CliError::Usage(format!(
                    "{option} {joint}: the {whose} has no such joint; it has {known} (or by number: 1 to {})",
                    joints.names.len()
                ))
            })
        })
        .collect();
    Ok(found?.into_iter().collect())
}

fn joint_idx(joint: &str, joints: &Joints) -> Option<usize> {
    let by_name = joints.names.iter().position(|name| name == joint);
    by_name.or_else(|| {
        let number: usize = joint.parse().ok()?;
        (1..=joints.names.len())
            .contains(&number)
            .then(|| number - 1)
    })
}

/// The number in a column such as `qd3`: digits without leading zeros; too large a number is `usize::MAX`.
fn number_of(name: &str, quantity: &str) -> Option<usize> {
    let digits = name.strip_prefix(quantity)?;
    let is_number = !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
    let is_canonical = digits.len() == 1 || !digits.starts_with('0');
    (is_number && is_canonical).then(|| digits.parse().unwrap_or(usize::MAX))
}

fn joint_numbers(
    file: &str,
    header: &[String],
    tau_prefix: &str,
) -> Result<BTreeSet<usize>, CliError> {
    let quantities = QUANTITIES.iter().copied().chain([tau_prefix]);
    let mut numbers = BTreeSet::new();
    for quantity in quantities {
        for name in header {
            match number_of(name, quantity) {
                Some(0) => {
                    let reason =
                        format!("column `{name}`: joints are numbered from 1, as q1, qd1, qdd1");
                    return Err(columns_error(file, reason));
                }
                Some(number) => _ = numbers.insert(number),
                None => {}
            }
        }
    }
    Ok(numbers)
}

/// Joints of columns `q_<joint>`, `qd_<joint>`, `qdd_<joint>`, in order of appearance.
fn joint_names(header: &[String]) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for quantity in QUANTITIES {
        for column in header {
            let name = column
                .strip_prefix(quantity)
                .and_then(|rest| rest.strip_prefix('_'))
                .filter(|name| !name.is_empty());
            if let Some(name) = name.filter(|name| !names.iter().any(|known| known == name)) {
                names.push(name.to_owned());
            }
        }
    }
    names
}

/// Whether a joint has a column of a quantity by name.
fn has(header: &[String], quantity: &str, joint: &str) -> bool {
    header.contains(&Naming::Named.column(quantity, 0, joint))
}

/// Whether a name is that of a joint with a word before or after it, as `cmd_hinge` is of `hinge`.
fn is_further_name(name: &str, joints: &[String]) -> bool {
    joints
        .iter()
        .any(|joint| name.ends_with(&format!("_{joint}")) || name.starts_with(&format!("{joint}_")))
}

/// What to say of state columns by name that belong to none of the joints found, if there are any.
pub fn unfinished(header: &[String], joints: &Joints) -> Option<String> {
    let is_of_none = |column: &&String| {
        let of = |quantity: &str| column.strip_prefix(quantity)?.strip_prefix('_');
        let name = QUANTITIES.iter().find_map(|quantity| of(quantity));
        name.is_some_and(|name| !name.is_empty() && !joints.names.iter().any(|joint| joint == name))
    };
    let columns: Vec<&str> = header
        .iter()
        .filter(is_of_none)
        .map(String::as_str)
        .collect();
    (!columns.is_empty()).then(|| {
        format!(
            "columns that belong to no complete joint are ignored: {}",
            columns.join(", ")
        )
    })
}

fn require_all(
    file: &str,
    header: &[String],
    naming: Naming,
    n_joints: usize,
    name: impl Fn(usize) -> String,
) -> Result<(), CliError> {
    // Lazy: a column such as q99999999 must not make a list of that length.
    let mut missing: Vec<String> = (0..n_joints)
        .flat_map(|idx| QUANTITIES.map(|quantity| naming.column(quantity, idx, &name(idx))))
        .filter(|column| !header.contains(column))
        .take(LISTED + 1)
        .collect();
    if missing.is_empty() {
        return Ok(());
    }
    if missing.len() > LISTED {
        missing.truncate(LISTED);
        missing.push("…".to_owned());
    }
    Err(CliError::MissingColumns {
        file: file.to_owned(),
        missing,
        found: header.to_vec(),
        hint: format!(
            "Every joint needs its position q, speed qd and acceleration qdd{}",
            log_hint(header)
        ),
    })
}

fn no_states(file: &str, header: &[String]) -> CliError {
    CliError::MissingColumns {
        file: file.to_owned(),
        missing: QUANTITIES.map(|quantity| format!("{quantity}1…")).into(),
        found: header.to_vec(),
        hint: format!(
            "States are needed as q1..qN, qd1..qdN, qdd1..qddN, or q_<joint>, qd_<joint>, qdd_<joint>{}{}",
            separator_hint(header),
            log_hint(header)
        ),
    }
}

/// What to say of a header that is that of a recorder.
fn log_hint(header: &[String]) -> String {
    let Some(mapping) = robot_log::guess(header) else {
        return String::new();
    };
    let speeds = match mapping.velocity {
        Some(Columns::Template(template)) => {
            format!(", {} as speeds", template.replace("{}", &mapping.joints[0]))
        }
        _ => String::new(),
    };
    format!(
        ". This looks like a robot's log{speeds}: `torque-gp prepare` renames its columns, filters, and makes accelerations \
         from the speeds by differentiation"
    )
}

fn columns_error(file: &str, reason: String) -> CliError {
    CliError::Columns {
        file: file.to_owned(),
        reason,
    }
}
