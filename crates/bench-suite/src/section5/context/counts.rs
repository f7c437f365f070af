//! Trials of known loads counted by what was true and what was said.

use super::trials::Trial;

/// Trials by what was true and what was said.
pub struct Confusion {
    /// Counts, row the load that was true, column the one said, (m, m).
    pub counts: Vec<Vec<usize>>,
}

impl Confusion {
    /// The trials of known loads that a filter lets through.
    pub fn of(trials: &[Trial], count_idx: usize, is_in: impl Fn(&Trial) -> bool) -> Self {
        let m = trials
            .first()
            .map_or(0, |trial| trial.by_count[0].known.len());
        let mut counts = vec![vec![0; m]; m];
        for trial in trials
            .iter()
            .filter(|trial| trial.load <= m && is_in(trial))
        {
            counts[trial.load - 1][trial.by_count[count_idx].best()] += 1;
        }
        Self { counts }
    }

    /// Part of the trials in which the right load was said.
    pub fn accuracy(&self) -> f64 {
        let right: usize = self.counts.iter().enumerate().map(|(i, row)| row[i]).sum();
        right as f64 / self.n_trials() as f64
    }

    /// Trials of known loads.
    pub fn n_trials(&self) -> usize {
        self.counts.iter().flatten().sum()
    }
}
