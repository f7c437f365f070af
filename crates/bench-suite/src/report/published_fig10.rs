//! What the chapter prints about figures 10 and 11: axes, chosen ranks and starts.

use serde::Deserialize;

use crate::cell::TestSet;
use crate::error::BenchError;

/// Vertical axes of one figure, joints 1 to 6.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Axes {
    /// Upper ends.
    pub tops: [f64; 6],
    /// Distances of the ticks.
    pub ticks: [f64; 6],
}

/// Rank and starts at a size that the chapter names.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PublishedChoice {
    /// Training samples of all contexts together.
    pub n: usize,
    /// Rank of mGP-BIC.
    pub rank: usize,
    /// Model that the mGPs of joints 1 to 6 start from.
    pub starts: [String; 6],
}

/// The fixture.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Published {
    /// Axes of figure 10.
    pub interp: Axes,
    /// Axes of figure 11.
    pub extrap: Axes,
    /// Choices at the sizes named.
    pub chosen: Vec<PublishedChoice>,
}

impl Published {
    /// Reads the fixture.
    ///
    /// # Errors
    /// `Malformed` if it does not follow the format.
    /// # Source
    /// Figs. 10 and 11; section 4.6.
    pub fn read() -> Result<Self, BenchError> {
        let path = "fixtures/bench-suite/fig10_11_published.toml";
        let text = include_str!("../../../../fixtures/bench-suite/fig10_11_published.toml");
        toml::from_str(text).map_err(|e| BenchError::malformed(path, e))
    }

    /// Axes of a test set's figure.
    pub fn axes(&self, set: TestSet) -> &Axes {
        match set {
            TestSet::Interp => &self.interp,
            TestSet::Extrap => &self.extrap,
        }
    }

    /// The choice at a size, if the chapter names it.
    pub fn choice(&self, n: usize) -> Option<&PublishedChoice> {
        self.chosen.iter().find(|choice| choice.n == n)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fixture_reads_and_every_tick_distance_divides_its_axis() {
        let published = Published::read().unwrap();
        for set in TestSet::ALL {
            let axes = published.axes(set);
            for (top, tick) in axes.tops.iter().zip(axes.ticks) {
                let n_ticks = top / tick;
                assert!((n_ticks - n_ticks.round()).abs() < 1e-9, "{top} / {tick}");
            }
        }
        assert_eq!(published.choice(476).map(|choice| choice.rank), Some(5));
        assert_eq!(published.choice(364), None);
    }
}
