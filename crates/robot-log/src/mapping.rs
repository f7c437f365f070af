//! Which columns of a log are what, and in which units.
//!
//! ```toml
//! position = "actual_q_{}"          # {} stands for a joint's name; or a list of columns: ["a", "b"]
//! velocity = "actual_qd_{}"         # left out: made from the positions
//! effort = "actual_current_{}"
//! effort_unit = "A"
//! gain = [10.0, 10.0, 9.0]          # N·m/A, of each joint
//! position_unit = "rad"             # rad, deg, turn, mrad, m, mm
//! velocity_unit = "rad/s"           # rad/s, deg/s, turn/s, rpm, mrad/s, m/s, mm/s
//! time = "timestamp"
//! time_unit = "s"                   # s, ms, us, ns
//! joints = ["0", "1", "2"]          # left out: all that have these columns, in the order of the file
//! run = "trial"                     # columns of labels
//! context = "load"
//! ```

use serde::Deserialize;

use crate::error::LogError;
use crate::unit::{EffortUnit, PositionUnit, TimeUnit, VelocityUnit};

/// What stands for a joint's name in a template.
const PLACE: &str = "{}";

/// Columns of one quantity: a template with `{}` in the place of the joint's name, or a name for each joint.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(untagged)]
pub enum Columns {
    /// `Position{}`.
    Template(String),
    /// In the order of the joints.
    Names(Vec<String>),
}

/// Which columns are what.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mapping {
    /// Column of the stamps.
    pub time: Option<String>,
    /// Their unit.
    pub time_unit: TimeUnit,
    /// Columns of q.
    pub position: Option<Columns>,
    /// Their unit.
    pub position_unit: PositionUnit,
    /// Columns of q̇; `None`: made from q.
    pub velocity: Option<Columns>,
    /// Their unit.
    pub velocity_unit: VelocityUnit,
    /// Columns of τ or of the motors' currents.
    pub effort: Option<Columns>,
    /// Their unit, which is never guessed.
    pub effort_unit: Option<EffortUnit>,
    /// N·m (N) for each ampere, of each joint or one for all; empty of torques.
    pub gain: Vec<f64>,
    /// Names of the joints in the order of the arm; empty: all that there are columns of.
    pub joints: Vec<String>,
    /// Column of the runs' labels.
    pub run: Option<String>,
    /// Column of what the arm carries.
    pub context: Option<String>,
}

/// The file as it is written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MappingToml {
    time: Option<String>,
    time_unit: Option<String>,
    position: Option<Columns>,
    position_unit: Option<String>,
    velocity: Option<Columns>,
    velocity_unit: Option<String>,
    effort: Option<Columns>,
    effort_unit: Option<String>,
    #[serde(default)]
    gain: Vec<f64>,
    #[serde(default)]
    joints: Vec<String>,
    run: Option<String>,
    context: Option<String>,
}

/// Where the columns of a mapping stand in a header.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Places {
    pub joints: Vec<String>,
    pub time: Option<usize>,
    pub position: Vec<usize>,
    pub velocity: Vec<usize>,
    pub effort: Vec<usize>,
    /// N·m for each unit of a joint's column.
    pub effort_factor: Vec<f64>,
    pub run: Option<usize>,
    pub context: Option<usize>,
}

impl Mapping {
    /// Reads the TOML of a mapping.
    ///
    /// # Errors
    /// Text that is none, with its line; keys and units that are not known; gains that are not positive.
    pub fn parse(text: &str) -> Result<Self, LogError> {
        let toml: MappingToml = toml::from_str(text)
            .map_err(|error| LogError::Mapping(error.to_string().trim_end().to_owned()))?;
        let unit = |text: Option<String>, default: &str| text.unwrap_or_else(|| default.to_owned());
        let mapping = Self {
            time: toml.time,
            time_unit: TimeUnit::parse(&unit(toml.time_unit, "s"))?,
            position: toml.position,
            position_unit: PositionUnit::parse(&unit(toml.position_unit, "rad"))?,
            velocity: toml.velocity,
            velocity_unit: VelocityUnit::parse(&unit(toml.velocity_unit, "rad/s"))?,
            effort: toml.effort,
            effort_unit: toml
                .effort_unit
                .as_deref()
                .map(EffortUnit::parse)
                .transpose()?,
            gain: toml.gain,
            joints: toml.joints,
            run: toml.run,
            context: toml.context,
        };
        if let Some(gain) = mapping.gain.iter().find(|gain| !gain.is_normal()) {
            return Err(LogError::Mapping(format!(
                "a gain of {gain}: gains are numbers other than zero"
            )));
        }
        Ok(mapping)
    }

    /// The mapping as TOML, with the unit of efforts as a question where it is not declared.
    pub fn to_toml(&self) -> String {
        let mut lines = Vec::new();
        let mut say = |key: &str, value: String, remark: &str| {
            let gap = if remark.is_empty() { "" } else { "   # " };
            lines.push(format!("{key} = {value}{gap}{remark}"));
        };
        if !self.joints.is_empty() {
            say(
                "joints",
                format!("{:?}", self.joints),
                "in the order of the arm",
            );
        }
        if let Some(time) = &self.time {
            say("time", format!("{time:?}"), "");
            say(
                "time_unit",
                format!("\"{}\"", self.time_unit),
                "s, ms, us, ns",
            );
        }
        if let Some(position) = &self.position {
            say("position", position.to_toml(), "");
            say(
                "position_unit",
                format!("\"{}\"", self.position_unit),
                "rad, deg, turn, mrad, m, mm",
            );
        }
        if let Some(velocity) = &self.velocity {
            say("velocity", velocity.to_toml(), "");
            say(
                "velocity_unit",
                format!("\"{}\"", self.velocity_unit),
                "rad/s, deg/s, turn/s, rpm, mrad/s, m/s, mm/s",
            );
        }
        if let Some(effort) = &self.effort {
            say("effort", effort.to_toml(), "");
        }
        match self.effort_unit {
            Some(unit) => say("effort_unit", format!("\"{unit}\""), ""),
            None => say(
                "# effort_unit",
                "\"?\"".to_owned(),
                "Nm, mNm, N; or A, mA with gain = [N·m/A of each joint]",
            ),
        }
        if !self.gain.is_empty() {
            say("gain", format!("{:?}", self.gain), "N·m/A");
        }
        for (key, column) in [("run", &self.run), ("context", &self.context)] {
            if let Some(column) = column {
                say(key, format!("{column:?}"), "");
            }
        }
        lines.join("\n") + "\n"
    }

    /// N·m for each unit of the efforts of some names, one for each joint.
    ///
    /// # Errors
    /// A unit that is not declared, with a question; a number of gains that differs.
    pub(crate) fn effort_factors(&self, efforts: &[String]) -> Result<Vec<f64>, LogError> {
        let unit = self.effort_unit.ok_or_else(|| {
            LogError::Mapping(format!(
                "in which unit are the efforts ({})? Say --effort-unit Nm (or mNm, N; A or mA with --gain, N·m/A of each joint): it is never guessed",
                listed(efforts)
            ))
        })?;
        let n_joints = efforts.len();
        let gains = match (unit.is_current(), self.gain.as_slice()) {
            (true, []) => {
                return Err(LogError::Mapping(format!(
                    "efforts in {unit} take a gain: --gain, N·m/A of each joint, or one for all"
                )));
            }
            (false, [_, ..]) => {
                return Err(LogError::Mapping(format!("efforts in {unit} take no gain")));
            }
            (false, []) => vec![1.0; n_joints],
            (true, [gain]) => vec![*gain; n_joints],
            (true, gains) if gains.len() == n_joints => gains.to_vec(),
            (true, gains) => {
                return Err(LogError::Mapping(format!(
                    "{} gains for {n_joints} joints",
                    gains.len()
                )));
            }
        };
        Ok(gains.iter().map(|gain| gain * unit.factor()).collect())
    }

    /// Where the columns stand in a header.
    ///
    /// # Errors
    /// Columns that are missing, numbers of columns or gains that differ, a unit of efforts that is not declared.
    pub(crate) fn places(&self, header: &[String]) -> Result<Places, LogError> {
        let needed = |columns: &Option<Columns>, what: &str| {
            columns.clone().ok_or_else(|| {
                LogError::Mapping(format!("no columns of {what}: say which with --{what} 'NAME{{}}', {{}} in the place of a joint's name, or in a mapping; found: {}", listed(header)))
            })
        };
        let position = needed(&self.position, "position")?;
        let effort = needed(&self.effort, "effort")?;
        let joints = if self.joints.is_empty() {
            position.joints(header)?
        } else {
            self.joints.clone()
        };
        let find = |columns: &Columns| columns.places(header, &joints);
        let one =
            |column: &Option<String>| column.as_ref().map(|name| place(header, name)).transpose();
        Ok(Places {
            time: one(&self.time)?,
            position: find(&position)?,
            velocity: self
                .velocity
                .as_ref()
                .map(find)
                .transpose()?
                .unwrap_or_default(),
            effort: find(&effort)?,
            effort_factor: self.effort_factors(&effort.names(&joints))?,
            run: one(&self.run)?,
            context: one(&self.context)?,
            joints,
        })
    }
}

impl Columns {
    /// Columns of a template, or of names with commas between them.
    pub fn parse(text: &str) -> Self {
        if text.contains(PLACE) || !text.contains(',') {
            return Self::Template(text.to_owned());
        }
        Self::Names(text.split(',').map(|name| name.trim().to_owned()).collect())
    }

    fn to_toml(&self) -> String {
        match self {
            Self::Template(template) => format!("{template:?}"),
            Self::Names(names) => format!("{names:?}"),
        }
    }

    /// Names of the joints that a header has such columns of, in its order.
    pub(crate) fn joints(&self, header: &[String]) -> Result<Vec<String>, LogError> {
        let template = match self {
            Self::Names(names) => {
                return Ok((1..=names.len()).map(|number| number.to_string()).collect());
            }
            Self::Template(template) => template,
        };
        let joints: Vec<String> = header
            .iter()
            .filter_map(|name| matched(template, name))
            .map(str::to_owned)
            .collect();
        if joints.is_empty() {
            return Err(LogError::Mapping(format!(
                "no column `{template}`; found: {}",
                listed(header)
            )));
        }
        Ok(joints)
    }

    fn names(&self, joints: &[String]) -> Vec<String> {
        match self {
            Self::Names(names) => names.clone(),
            Self::Template(template) => joints
                .iter()
                .map(|joint| template.replacen(PLACE, joint, 1))
                .collect(),
        }
    }

    fn places(&self, header: &[String], joints: &[String]) -> Result<Vec<usize>, LogError> {
        let names = self.names(joints);
        if names.len() != joints.len() {
            return Err(LogError::Mapping(format!(
                "{} columns ({}) for {} joints",
                names.len(),
                listed(&names),
                joints.len()
            )));
        }
        names.iter().map(|name| place(header, name)).collect()
    }
}

/// The joint's name in a column's, if the column is of a template.
pub(crate) fn matched<'a>(template: &str, column: &'a str) -> Option<&'a str> {
    let (before, after) = template.split_once(PLACE)?;
    let rest = column.strip_prefix(before)?;
    let joint = rest.strip_suffix(after)?;
    (!joint.is_empty()).then_some(joint)
}

fn place(header: &[String], name: &str) -> Result<usize, LogError> {
    let mut found = header
        .iter()
        .enumerate()
        .filter(|(_, column)| *column == name);
    match (found.next(), found.next()) {
        (Some((place, _)), None) => Ok(place),
        (Some(_), Some(_)) => Err(LogError::Mapping(format!("there are two columns `{name}`"))),
        (None, _) => Err(LogError::Mapping(format!(
            "no column `{name}`; found: {}",
            listed(header)
        ))),
    }
}

/// Names, up to thirty of them.
fn listed(names: &[String]) -> String {
    const MOST: usize = 30;
    let shown: Vec<String> = names
        .iter()
        .take(MOST)
        .map(|name| name.escape_debug().to_string())
        .collect();
    let rest = names.len().saturating_sub(MOST);
    let end = if rest > 0 {
        format!(", … and {rest} more")
    } else {
        String::new()
    };
    shown.join(", ") + &end
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(names: &str) -> Vec<String> {
        names.split(',').map(str::to_owned).collect()
    }

    #[test]
    fn a_mapping_finds_its_columns_and_what_it_writes_is_itself() {
        let text = "position = \"q_{}\"\nvelocity = \"dq_{}\"\neffort = \"i_{}\"\neffort_unit = \"mA\"\ngain = [2.0]\ntime = \"stamp\"\ntime_unit = \"ns\"\n";
        let mapping = Mapping::parse(text).unwrap();
        let places = mapping
            .places(&header("stamp,q_b,q_a,dq_a,dq_b,i_a,i_b,q"))
            .unwrap();
        assert_eq!(places.joints, ["b", "a"]);
        assert_eq!((places.position, places.velocity), (vec![1, 2], vec![4, 3]));
        assert_eq!(places.effort_factor, [2e-3, 2e-3]);
        assert_eq!(Mapping::parse(&mapping.to_toml()).unwrap(), mapping);
    }

    #[test]
    fn what_is_missing_is_asked_for() {
        let columns = header("q1,q2,tau1,tau2");
        let mut mapping = Mapping::parse("position = \"q{}\"\neffort = \"tau{}\"").unwrap();
        let error = mapping.places(&columns).unwrap_err().to_string();
        assert!(
            error.contains("in which unit") && error.contains("tau1"),
            "{error}"
        );
        mapping.effort_unit = Some(EffortUnit::parse("A").unwrap());
        assert!(
            mapping
                .places(&columns)
                .unwrap_err()
                .to_string()
                .contains("--gain")
        );
        mapping.gain = vec![1.0, 2.0, 3.0];
        assert!(
            mapping
                .places(&columns)
                .unwrap_err()
                .to_string()
                .contains("3 gains for 2 joints")
        );
        let error = Mapping::parse("positions = \"q{}\"")
            .unwrap_err()
            .to_string();
        assert!(error.contains("positions"), "{error}");
        assert!(Mapping::parse("gain = [0.0]").is_err());
    }
}
