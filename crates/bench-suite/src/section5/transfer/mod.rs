//! How much the samples of other loads are worth: nMSE against their number, and against the target's own samples.
//!
//! # Source
//! Section 4.6, whose figures have 14 loads with equally many samples each.

mod curve;
mod measure;
mod picture;
mod table;

use std::collections::BTreeSet;

use serde::Deserialize;

pub use self::curve::{Axis, Curve, CurveRecord, Learner, Score};
pub use self::measure::measure;
use super::campaign::Campaign;
use super::spec::Section5Experiment;
use crate::data_figures::section::Section;
use crate::error::BenchError;

/// Settings of a profile.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Settings {
    joints: Vec<usize>,
    targets: Vec<usize>,
    others: Vec<usize>,
    n_each: usize,
    samples: Vec<usize>,
    n_each_other: usize,
    test_stride: usize,
}

impl Settings {
    /// Both curves of every target and joint.
    fn curves(&self) -> BTreeSet<Curve> {
        let mut curves = BTreeSet::new();
        for axis in Axis::ALL {
            for &target in &self.targets {
                curves.extend(self.joints.iter().map(|&joint| Curve {
                    axis,
                    target,
                    joint,
                    counts: self.counts(axis).to_vec(),
                    n_each: match axis {
                        Axis::Others => self.n_each,
                        Axis::Samples => self.n_each_other,
                    },
                    test_stride: self.test_stride,
                }));
            }
        }
        curves
    }

    /// Places on an axis that are measured.
    fn counts(&self, axis: Axis) -> &[usize] {
        match axis {
            Axis::Others => &self.others,
            Axis::Samples => &self.samples,
        }
    }
}

/// Makes the table, the picture and the findings; `None` as long as a curve is missing.
///
/// # Errors
/// `Experiment`, and those of the models and the picture.
pub fn make(
    experiment: &Section5Experiment,
    campaign: &Campaign,
) -> Result<Option<Section>, BenchError> {
    let settings: Settings = experiment.settings(campaign.profile)?;
    let records = campaign.complete(&experiment.name, settings.curves(), Ok, |bench, curve| {
        measure(curve, &bench.data)
    })?;
    let Some(records) = records else {
        return Ok(None);
    };
    let mut section = Section::default();
    table::report(&records, &settings, &mut section);
    let picture = picture::draw(&records, &settings);
    let caption = "nMSE of the target load on extrap, geometric mean over the targets";
    section.show("transfer", caption, &picture)?;
    Ok(Some(section))
}
