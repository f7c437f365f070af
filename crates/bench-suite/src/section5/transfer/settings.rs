//! What is measured of samples of other loads, in each profile.

use std::collections::BTreeSet;

use serde::Deserialize;

use super::curve::{Axis, Curve};

/// Settings of a profile.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    pub joints: Vec<usize>,
    pub targets: Vec<usize>,
    pub others: Vec<usize>,
    pub n_each: usize,
    pub samples: Vec<usize>,
    pub n_each_other: usize,
    pub test_stride: usize,
}

impl Settings {
    /// Both curves of every target and joint.
    pub fn curves(&self) -> BTreeSet<Curve> {
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
    pub fn counts(&self, axis: Axis) -> &[usize] {
        match axis {
            Axis::Others => &self.others,
            Axis::Samples => &self.samples,
        }
    }
}
