//! How a search goes about it, as data: on how many samples, from which starts, how long.

use super::options::{Limits, SearchScheme};
use super::start::Distance;

/// Number of samples up to which a search sees all of them from the beginning.
const WHOLE_UP_TO: usize = 512;

/// Largest number of samples that the first of several stages may have.
const LARGEST_FIRST: usize = 256;

/// Floating-point operations that each stage of a nested search may take.
const STAGE_FLOPS: f64 = 4e10;

/// Dense likelihoods that each stage may compute, however many samples there are.
pub(super) const MIN_WORK: f64 = 2.0;

/// Factor of the value tolerance on subsets of the samples.
const LOOSER: f64 = 10.0;

/// The starts set out once more on the largest subset of at most so many samples,
/// and on all samples, as long as the stage has work left.
///
/// What 250 samples call superfluous, 1000 may need: measured, starts on 1000 end
/// up to 20 nats higher.
const ALL_STARTS_UP_TO: usize = 1024;

/// Dense likelihoods' worth of work for the starts on all of more samples than that:
/// enough where the rank is a few dozen.
const STARTS_WORK: f64 = 1.0;

/// A search in stages, on more and more samples.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The stages; the last sees all samples.
    pub stages: Vec<Stage>,
    /// How a stage sets out from where the one before ended highest.
    pub later: Distance,
}

/// The searches on one set of samples.
#[derive(Debug, Clone, PartialEq)]
pub struct Stage {
    /// Samples that they see.
    pub n_samples: usize,
    /// Which starts set out beside the end of the stage before.
    pub starts: Tried,
    /// Limits of the search from each start.
    pub each: Limits,
    /// Evaluations that the highest end gets after these, refined in the metric of the Fisher information.
    ///
    /// None where it comes from [`Distance::MoreSamples`], which is refined from its beginning.
    pub further: Further,
    /// Work of all searches together; one begins at least where none before has a likelihood.
    pub work: f64,
    /// The part of it that the starts may take after the end of the stage before.
    pub work_of_starts: f64,
}

/// Which starts a stage tries beside the end of the stage before.
///
/// Where there is no such end, all.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tried {
    /// None of them.
    None,
    /// All, in their order.
    All,
    /// All, the last first.
    LastFirst,
}

/// How many evaluations the highest of several searches gets after those that it has used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Further {
    /// As many as are left of so many.
    UpTo(usize),
    /// So many.
    More(usize),
}

impl Further {
    /// Evaluations after those used.
    pub(super) fn after(self, used: usize) -> usize {
        match self {
            Self::UpTo(most) => most.saturating_sub(used),
            Self::More(further) => further,
        }
    }
}

impl Stage {
    /// Several starts for the price of little more than one: each gets some evaluations, and the one
    /// that is highest goes on with what is left.
    pub fn screened(n_samples: usize, screening: usize, limits: Limits) -> Self {
        Self {
            n_samples,
            starts: Tried::All,
            each: limits.with_evaluations(screening.min(limits.max_evaluations)),
            further: Further::UpTo(limits.max_evaluations),
            work: f64::INFINITY,
            work_of_starts: f64::INFINITY,
        }
    }
}

impl Plan {
    /// All starts in the first of the stages, and in each of the others the end of the one before.
    pub fn in_stages(mut stages: Vec<Stage>) -> Self {
        for later in stages.iter_mut().skip(1) {
            later.starts = Tried::None;
        }
        let later = Distance::Near;
        Self { stages, later }
    }

    /// All samples from every start, until it converges.
    pub fn whole(n_samples: usize, limits: Limits) -> Self {
        let half = limits.max_evaluations.div_ceil(2);
        Self::in_stages(vec![Stage::screened(n_samples, half, limits)])
    }

    /// Starts that are compared once: on all samples, or on the first of several subsets.
    pub fn compared(n_samples: usize, scheme: SearchScheme, limits: Limits) -> Self {
        let sizes = match scheme {
            SearchScheme::Whole => vec![n_samples],
            SearchScheme::Nested => stage_sizes(n_samples),
        };
        let half = limits.max_evaluations.div_ceil(2);
        let stage = |(idx, &n_samples): (usize, &usize)| {
            let (each, further) = if idx == 0 {
                (half, half)
            } else {
                (limits.max_evaluations, 0)
            };
            Stage {
                further: Further::More(further),
                ..Stage::screened(n_samples, each, limits)
            }
        };
        Self::in_stages(sizes.iter().enumerate().map(stage).collect())
    }

    // DEVIATION(sec. 3): the chapter searches on all samples from one start.
    /// Every start on the smallest of several subsets, the best ends of each stage on the next, and no
    /// stage takes more work than its limit.
    pub fn nested(n_samples: usize, limits: Limits) -> Self {
        let sizes = stage_sizes(n_samples);
        let all_starts_at = (sizes.iter().copied()).rfind(|&n| n <= ALL_STARTS_UP_TO);
        let half = limits.max_evaluations.div_ceil(2);
        let stage = |&n: &usize| {
            let mut stage = Stage::screened(n, half, limits);
            stage.work = stage_work(n);
            if n > ALL_STARTS_UP_TO {
                stage.work_of_starts = STARTS_WORK;
            }
            if n < n_samples {
                stage.each.value_tolerance = LOOSER * limits.value_tolerance;
            }
            stage.starts = if Some(n) == all_starts_at || n == sizes[0] {
                Tried::All
            } else if n == n_samples {
                // The later ones have longer length scales, so a lower rank and less work.
                Tried::LastFirst
            } else {
                Tried::None
            };
            stage
        };
        Self {
            stages: sizes.iter().map(stage).collect(),
            later: Distance::MoreSamples,
        }
    }
}

/// Work that the searches of one stage may take together, in likelihoods by the dense path.
///
/// ```text
/// max(2, 4·10¹⁰/n³)
/// ```
/// Low-rank likelihoods are so small a part of a dense one that it does not limit them.
fn stage_work(n_samples: usize) -> f64 {
    (STAGE_FLOPS / (n_samples as f64).powi(3)).max(MIN_WORK)
}

/// Numbers of samples of the stages, ascending; the last is `n_samples`.
///
/// ```text
/// …, ⌈n/4⌉, ⌈n/2⌉, n    down to the first that is at most 256; n alone up to 512
/// ```
fn stage_sizes(n_samples: usize) -> Vec<usize> {
    let mut sizes = vec![n_samples];
    let mut n = n_samples;
    while n_samples > WHOLE_UP_TO && n > LARGEST_FIRST {
        n = n.div_ceil(2);
        sizes.push(n);
    }
    sizes.reverse();
    sizes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_double_up_to_all_samples() {
        assert_eq!(stage_sizes(2), [2]);
        assert_eq!(stage_sizes(512), [512]);
        assert_eq!(stage_sizes(513), [129, 257, 513]);
        assert_eq!(stage_sizes(1004), [251, 502, 1004]);
        assert_eq!(stage_sizes(4000), [250, 500, 1000, 2000, 4000]);
    }
}
