//! Runs over all loads, trajectories, sources and gains, and their averages.

use puma_dyn::motion::{CompliantWall, ReferenceMotion};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use torque_model::RobotModel;

use super::plant::{Control, Outcome, Plant, Run};
use super::settings::Settings;
use super::source::{Desired, Learned, NEW_LOAD, Source, Sources, TorqueTable, shared_table};
use crate::error::BenchError;
use crate::split::TrajectoryId;

/// One run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Name of the trajectory.
    pub trajectory: String,
    /// Load, from 1.
    pub load: usize,
    pub source: Source,
    /// rad/s.
    pub bandwidth: f64,
    pub outcome: Outcome,
}

/// A trajectory with the loads that are carried along it.
pub struct Sweep<'a> {
    pub plant: &'a Plant,
    pub settings: &'a Settings,
    pub wall: Option<&'a CompliantWall>,
}

impl Sweep<'_> {
    /// All sources and gains along a trajectory, load after load.
    ///
    /// # Errors
    /// `Fit`, `MultiTask`, `Dynamics`.
    pub fn rows(
        &self,
        sources: &Sources<'_>,
        id: TrajectoryId,
        learned: &[&Learned],
    ) -> Result<Vec<Row>, BenchError> {
        let reference = self.plant.reference(id)?;
        let desired = Desired::of(self.plant.desired(&reference)?.as_ref());
        let jobs: Vec<(&Learned, Source)> = learned
            .iter()
            .flat_map(|learned| Source::of_each_load().map(|source| (*learned, source)))
            .collect();
        let rows: Vec<Vec<Row>> = jobs
            .into_par_iter()
            .map(|(learned, source)| {
                let table = sources.table(source, learned, &desired)?;
                table.map_or(Ok(Vec::new()), |table| {
                    self.gains(&id.to_string(), &reference, learned.load(), source, &table)
                })
            })
            .collect::<Result<_, BenchError>>()?;
        Ok(rows.concat())
    }

    /// All gains along a trajectory under a load, from 1, with rbd of all loads.
    ///
    /// # Errors
    /// `Model`, `Dynamics`.
    pub fn rows_of_shared(
        &self,
        model: &RobotModel,
        id: TrajectoryId,
        load: usize,
    ) -> Result<Vec<Row>, BenchError> {
        let reference = self.plant.reference(id)?;
        let x = self.plant.desired(&reference)?;
        let table = shared_table(model, load, x.as_ref())?;
        self.gains(&id.to_string(), &reference, load, Source::Shared, &table)
    }

    fn gains(
        &self,
        trajectory: &str,
        reference: &ReferenceMotion,
        load: usize,
        source: Source,
        table: &TorqueTable,
    ) -> Result<Vec<Row>, BenchError> {
        let plant = self.plant;
        let run = Run {
            reference,
            context: plant.context(load)?,
            wall: self.wall.cloned(),
        };
        let bandwidths = self.settings.bandwidths.iter();
        bandwidths
            .map(|&bandwidth| {
                let control = self.settings.control(bandwidth);
                Ok(Row {
                    trajectory: trajectory.to_string(),
                    load,
                    source,
                    bandwidth,
                    outcome: plant.follow(&run, &mut table.feed_forward(), control)?,
                })
            })
            .collect()
    }
}

impl Settings {
    /// Gains of a bandwidth with the profile's integration.
    pub fn control(&self, bandwidth: f64) -> Control {
        Control {
            bandwidth,
            damping_ratio: self.damping_ratio,
            n_steps: self.n_steps,
        }
    }
}

/// How far the errors of runs move when the step of the integration is an eighth, at most, rad.
///
/// # Errors
/// `Dynamics`.
pub fn integration_error(
    plant: &Plant,
    settings: &Settings,
    reference: &ReferenceMotion,
    (table, load): (&TorqueTable, usize),
) -> Result<f64, BenchError> {
    let run = Run {
        reference,
        context: plant.context(load)?,
        wall: None,
    };
    let differences = settings.bandwidths.par_iter().map(|&bandwidth| {
        let usual = settings.control(bandwidth);
        let fine = Control {
            n_steps: 8 * usual.n_steps,
            ..usual
        };
        let follow = |control| plant.follow(&run, &mut table.feed_forward(), control);
        Ok((follow(usual)?.error() - follow(fine)?.error()).abs())
    });
    let differences: Vec<f64> = differences.collect::<Result<_, BenchError>>()?;
    Ok(differences.into_iter().fold(0.0, f64::max))
}

/// Average over loads of a number of the runs chosen; none if there is no such run.
pub fn mean(
    rows: &[Row],
    is_chosen: impl Fn(&Row) -> bool,
    of: impl Fn(&Outcome) -> f64,
) -> Option<f64> {
    let chosen = rows.iter().filter(|row| is_chosen(row));
    let values: Vec<f64> = chosen.map(|row| of(&row.outcome)).collect();
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// Mean error of a source against the bandwidth, over the known loads or c15 alone.
pub fn curve(
    rows: &[Row],
    settings: &Settings,
    (trajectory, source, is_new): (&str, Source, bool),
    of: impl Fn(&Outcome) -> f64,
) -> Vec<(f64, f64)> {
    let point = |&bandwidth: &f64| {
        let is_chosen = |row: &Row| {
            row.trajectory == trajectory
                && row.source == source
                && (row.load == NEW_LOAD) == is_new
                && row.bandwidth.to_bits() == bandwidth.to_bits()
        };
        Some((bandwidth, mean(rows, is_chosen, &of)?))
    };
    settings.bandwidths.iter().filter_map(point).collect()
}

/// Where a falling curve first goes through a level, by straight lines between the logarithms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Crossing {
    /// Below the level from the first point on.
    Below(f64),
    /// At this abscissa.
    At(f64),
    /// Above it up to the last point.
    Above(f64),
}

impl Crossing {
    /// Finds it; `None` for an empty curve.
    pub fn of(curve: &[(f64, f64)], level: f64) -> Option<Self> {
        let (first, last) = (curve.first()?, curve.last()?);
        if first.1 <= level {
            return Some(Self::Below(first.0));
        }
        let crosses = |pair: &&[(f64, f64)]| pair[1].1 <= level;
        let Some(pair) = curve.windows(2).find(crosses) else {
            return Some(Self::Above(last.0));
        };
        let [(x0, y0), (x1, y1)] = [pair[0], pair[1]];
        let part = (y0 / level).ln() / (y0 / y1).ln();
        Some(Self::At(x0 * (x1 / x0).powf(part)))
    }

    /// The bandwidth, exact or its bound.
    pub fn bandwidth(self) -> f64 {
        match self {
            Self::Below(x) | Self::At(x) | Self::Above(x) => x,
        }
    }

    /// How often the stiffness K_p ∝ ω² of this crossing is in a given one, in words.
    pub fn factor_below(self, bandwidth: f64) -> String {
        let factor = (bandwidth / self.bandwidth()).powi(2);
        match self {
            Self::Below(_) => format!("over {factor:.0}"),
            Self::At(_) => format!("{factor:.1}"),
            Self::Above(_) => "not reached".to_string(),
        }
    }
}

/// Value of a curve at an abscissa, by straight lines between the logarithms.
pub fn value_at(curve: &[(f64, f64)], x: f64) -> Option<f64> {
    let (first, last) = (curve.first()?, curve.last()?);
    if x <= first.0 {
        return Some(first.1);
    }
    let Some(pair) = curve.windows(2).find(|pair| pair[1].0 >= x) else {
        return Some(last.1);
    };
    let [(x0, y0), (x1, y1)] = [pair[0], pair[1]];
    let part = (x / x0).ln() / (x1 / x0).ln();
    Some(y0 * (y1 / y0).powf(part))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crossings_worked_by_hand() {
        // y = 100/x² through (1, 100) and (10, 1): at level 4, x = 5.
        let curve = [(1.0, 100.0), (10.0, 1.0)];
        let Some(Crossing::At(x)) = Crossing::of(&curve, 4.0) else {
            panic!("no crossing");
        };
        assert!((x - 5.0).abs() < 1e-12, "{x}");
        assert_eq!(Crossing::of(&curve, 100.0), Some(Crossing::Below(1.0)));
        assert_eq!(Crossing::of(&curve, 0.5), Some(Crossing::Above(10.0)));
        assert_eq!(Crossing::At(5.0).factor_below(10.0), "4.0");
        assert!((value_at(&curve, 5.0).unwrap() - 4.0).abs() < 1e-12);
    }
}
