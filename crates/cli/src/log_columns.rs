//! Optional columns of a log beside states and torques: `run`, `t`, `z<δ>_<joint>` and `use_<joint>`.

use crate::columns::Naming;
use crate::context::{COLUMN as CONTEXT, columns_error};
use crate::error::CliError;
use crate::joints::Joints;
use crate::number_column::NumberColumn;

/// Name of the column of runs.
const RUN: &str = "run";

/// Name of the column of times.
const TIME: &str = "t";

/// Milliradians of a radian: lengths are named in mrad.
const MRAD: f64 = 1e3;

/// Where a log says when, in which run and how its rows were measured.
#[derive(Debug)]
pub struct LogColumns {
    /// Name of the file.
    pub file: String,
    /// Position of the column `context`, whose rows' times are compared with each other.
    pub context: Option<usize>,
    /// Position of the column `run`.
    pub run: Option<usize>,
    /// Column `t`, s.
    pub time: Option<NumberColumn>,
    /// Columns of hysteresis states, in ascending order of their lengths.
    pub hysteresis: Vec<LengthColumns>,
    /// Columns `use_<joint>` of all joints, or none.
    pub used: Vec<NumberColumn>,
}

/// Columns of the hysteresis states of one length.
#[derive(Debug)]
pub struct LengthColumns {
    /// Length δ, rad.
    pub length: f64,
    /// (ℓ,), in the order of the joints.
    pub columns: Vec<NumberColumn>,
}

impl LogColumns {
    /// Finds the columns that there are.
    ///
    /// Joints stand behind an underscore, by number or by name: `use_1` or `use_shoulder`.
    /// # Errors
    /// Columns of some joints only, by number and by name at once, and hysteresis lengths that are not positive or
    /// appear twice.
    pub fn find(file: &str, header: &[String], joints: &Joints) -> Result<Self, CliError> {
        let position = |name: &str| header.iter().position(|column| column == name);
        let time = position(TIME).map(|idx| NumberColumn {
            idx,
            name: TIME.to_owned(),
            joint: "time".to_owned(),
            unit: "s",
        });
        let lookup = Lookup {
            file,
            header,
            joints,
        };
        Ok(Self {
            file: file.to_owned(),
            context: position(CONTEXT),
            run: position(RUN),
            time,
            hysteresis: lookup.hysteresis()?,
            used: lookup.of_all_joints("use", "0 or 1")?.unwrap_or_default(),
        })
    }
}

/// A header and the joints that it is searched for.
struct Lookup<'a> {
    file: &'a str,
    header: &'a [String],
    joints: &'a Joints,
}

impl Lookup<'_> {
    fn hysteresis(&self) -> Result<Vec<LengthColumns>, CliError> {
        let mut lengths: Vec<(f64, &str)> = Vec::new();
        for column in self.header {
            if let Some((length, text)) = self.length_of(column)?
                && !lengths.iter().any(|(_, known)| *known == text)
            {
                lengths.push((length, text));
            }
        }
        lengths.sort_by(|a, b| a.0.total_cmp(&b.0));
        if let Some(pair) = (lengths.windows(2)).find(|p| p[0].0.total_cmp(&p[1].0).is_eq()) {
            let (one, other) = (pair[0].1, pair[1].1);
            let reason = format!(
                "columns z{one}_… and z{other}_… hold hysteresis states of the same length"
            );
            return Err(columns_error(self.file, reason));
        }
        let found = lengths.into_iter().map(|(length, text)| {
            let columns = self.of_all_joints(&format!("z{text}"), "from −1 to 1")?;
            Ok(columns.map(|columns| LengthColumns { length, columns }))
        });
        found.filter_map(Result::transpose).collect()
    }

    /// Length in rad and its text in mrad, of a column such as `z0.5_1` of a joint that there is.
    fn length_of<'b>(&self, column: &'b str) -> Result<Option<(f64, &'b str)>, CliError> {
        let split = column.strip_prefix('z').and_then(|c| c.split_once('_'));
        let Some((text, _)) = split.filter(|(_, joint)| self.is_joint(joint)) else {
            return Ok(None);
        };
        let is_number = text.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
        let Some(length) = text.parse::<f64>().ok().filter(|_| is_number) else {
            return Ok(None);
        };
        if length > 0.0 && length.is_finite() {
            return Ok(Some((length / MRAD, text)));
        }
        let reason =
            format!("column `{column}`: a hysteresis length of {text} mrad; it must be above zero");
        Err(columns_error(self.file, reason))
    }

    fn is_joint(&self, suffix: &str) -> bool {
        let names = &self.joints.names;
        names.iter().any(|name| name == suffix)
            || (1..=names.len()).any(|number| number.to_string() == suffix)
    }

    /// The columns of a quantity, one for each joint; `None` if no joint has one.
    fn of_all_joints(
        &self,
        quantity: &str,
        unit: &'static str,
    ) -> Result<Option<Vec<NumberColumn>>, CliError> {
        let joints = &self.joints.names;
        let schemes = [
            Naming::Numbered.columns(&format!("{quantity}_"), joints),
            Naming::Named.columns(quantity, joints),
        ];
        let has_any = |names: &&Vec<String>| names.iter().any(|name| self.header.contains(name));
        let mut present = schemes.iter().filter(has_any);
        let (Some(names), other) = (present.next(), present.next()) else {
            return Ok(None);
        };
        if other.is_some_and(|other| other != names) {
            let reason = format!(
                "columns {quantity}_… are given both by number and by joint name; keep one of the two"
            );
            return Err(columns_error(self.file, reason));
        }
        let columns = names.iter().zip(joints).map(|(name, joint)| {
            let idx = self.header.iter().position(|column| column == name);
            idx.map(|idx| NumberColumn {
                idx,
                name: name.clone(),
                joint: joint.clone(),
                unit,
            })
            .ok_or(name)
        });
        let columns: Result<Vec<NumberColumn>, &String> = columns.collect();
        columns.map(Some).map_err(|_| self.missing(names))
    }

    fn missing(&self, names: &[String]) -> CliError {
        let missing = names.iter().filter(|name| !self.header.contains(name));
        CliError::MissingColumns {
            file: self.file.to_owned(),
            missing: missing.cloned().collect(),
            found: self.header.to_vec(),
            hint: "Where one joint has such a column, all must have it".to_owned(),
        }
    }
}
