//! How long and how hard to search, and from where.

use gp_core::search::{Limits, Stage};
use gp_core::{LikelihoodOptions, Starts};
use kernels::{ContinuousJoints, TorqueForm};

use crate::prior::RankPart;

/// How long and how hard to search, and how far to follow the chapter.
#[derive(Debug, Clone, PartialEq)]
pub struct MultiTaskOptions {
    /// Terms of c^x.
    pub form: TorqueForm,
    /// Joints of whose positions c^x sees the place on the circle.
    pub continuous: ContinuousJoints,
    /// Starts of the pooled and the independent model.
    pub starts: Starts,
    /// Likelihoods with gradient that each search may use.
    pub max_evaluations: usize,
    /// Floating-point operations, n³ for each likelihood, after which a search for Λ
    /// ends sooner than that, though not before 80 likelihoods; 24 beyond 16,384 samples.
    pub max_flops: f64,
    /// Those that each of several starts gets before all but the highest are left.
    pub screening: usize,
    /// Converged when no component of the projected gradient with respect to the
    /// logarithms of the hyperparameters is larger, in nats.
    pub gradient_tolerance: f64,
    /// Stalled when an iteration gains less than this, in nats.
    pub value_tolerance: f64,
    /// How each likelihood is computed.
    pub likelihood: LikelihoodOptions,
    /// How the rank-r part of eq. (28) is taken.
    pub rank_part: RankPart,
}

impl MultiTaskOptions {
    /// A.3 as it stands: eq. (22) alone, with up to 300 evaluations per search.
    pub fn chapter() -> Self {
        Self {
            form: TorqueForm::Coulomb,
            continuous: ContinuousJoints::none(),
            starts: Starts::Chapter,
            max_evaluations: 300,
            max_flops: f64::INFINITY,
            screening: 300,
            gradient_tolerance: 1e-3,
            value_tolerance: 1e-5,
            likelihood: LikelihoodOptions::automatic(),
            rank_part: RankPart::Eigenpairs,
        }
    }

    /// Several starts, of which the highest after 30 evaluations goes on, to up to 2000.
    ///
    /// Many of them are needed: from rank 2 to rank 4 a search may take all.
    /// They are had cheaply on few data, from where a search on more data may set out.
    pub fn several() -> Self {
        Self {
            starts: Starts::Several,
            screening: 30,
            max_evaluations: 2000,
            max_flops: 8e10,
            ..Self::chapter()
        }
    }
}

/// Likelihoods that a search may compute up to `MANY_SAMPLES`, and beyond.
const FEWEST_EVALUATIONS: usize = 80;
const FEWEST_ON_MANY: usize = 24;

/// Likelihoods of pGP beyond `MANY_SAMPLES`: its rank is near the largest, several times that of the others.
const POOLED_ON_MANY: usize = 4;

/// Samples of all tasks together beyond which step 1 sees a part of them, and the search on all only
/// adjusts what was found on that part: as many as a likelihood by the dense path takes.
pub(super) const MANY_SAMPLES: usize = 16_384;

/// Evaluations from which several starts are searched for a while before one is chosen;
/// with fewer, their first likelihoods decide.
const ENOUGH_TO_COMPARE: usize = 200;

/// Part of the evaluations that a search gets that is not to go to the end.
const BRIEF_PART: usize = 3;

impl MultiTaskOptions {
    /// The same options with the evaluations that `max_flops` leaves on n samples.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between two counts"
    )]
    pub(super) fn on(&self, n_samples: usize) -> Self {
        let affordable = self.max_flops / (n_samples as f64).powi(3);
        let fewest = if n_samples > MANY_SAMPLES {
            FEWEST_ON_MANY
        } else {
            FEWEST_EVALUATIONS
        };
        let fewest = fewest.min(self.max_evaluations);
        let most = self.max_evaluations as f64;
        let max_evaluations = affordable.clamp(fewest as f64, most) as usize;
        Self {
            max_evaluations,
            screening: if max_evaluations < ENOUGH_TO_COMPARE {
                1
            } else {
                self.screening
            },
            ..self.clone()
        }
    }

    /// The searches on n samples: several starts, of which the highest goes on.
    pub(super) fn stage(&self, n_samples: usize) -> Stage {
        let limits = Limits {
            max_evaluations: self.max_evaluations,
            max_work: f64::INFINITY,
            gradient_tolerance: self.gradient_tolerance,
            value_tolerance: self.value_tolerance,
        };
        Stage::screened(n_samples, self.screening, limits)
    }

    /// The same options for pGP on n samples.
    ///
    /// With [`Starts::Chapter`] as for any search.
    pub(super) fn pooled_on(&self, n_samples: usize) -> Self {
        let mut options = self.on(n_samples);
        if self.starts == Starts::Several && n_samples > MANY_SAMPLES {
            options.max_evaluations = options.max_evaluations.min(POOLED_ON_MANY);
        }
        options
    }

    /// The same options for a search on n samples that is not to go to the end.
    ///
    /// With [`Starts::Chapter`] every search goes to the end.
    pub(super) fn briefly(&self, n_samples: usize) -> Self {
        if self.starts == Starts::Chapter {
            return self.clone();
        }
        let of_whole = self.on(n_samples).max_evaluations;
        Self {
            max_evaluations: of_whole.div_ceil(BRIEF_PART),
            ..self.clone()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::MultiTaskOptions;

    #[test]
    fn more_samples_leave_fewer_evaluations() {
        let options = MultiTaskOptions::several();
        let evaluations = |n_samples| options.on(n_samples).max_evaluations;
        assert_eq!(evaluations(280), 2000);
        assert_eq!([1820, 16_384].map(evaluations), [80, 80]);
        assert_eq!(evaluations(56_000), 24);
        assert_eq!(MultiTaskOptions::chapter().on(56_000).max_evaluations, 300);
    }
}
