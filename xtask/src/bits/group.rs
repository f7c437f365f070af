//! The groups that results are in.

use clap::ValueEnum;

/// A group of results, each of which can be asked for alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, ValueEnum)]
pub enum Group {
    /// Runs of the simulated arm, and torques of described robots
    Robot,
    /// Model files of every kind and path, and what `inspect` says of them
    Models,
    /// Predictions of about 1000 states by each model, and its scores
    Predictions,
    /// The control loop, which asks each model for one state at a time
    Loop,
    /// Likelihoods and gradients at fixed hyperparameters
    Likelihood,
    /// A further context, added to models of several
    Adapt,
    /// Which context torques come from: in total, row after row, and as they change
    Context,
    /// Draws of hyperparameters
    Chains,
    /// Every CSV file of the smoke profile but those of seconds; minutes
    Smoke,
}

impl Group {
    /// The name, as `--only` takes it and results begin with it.
    pub fn name(self) -> String {
        let value = self.to_possible_value();
        value.map_or_else(String::new, |value| value.get_name().to_owned())
    }

    /// Whether results of this group are made with the model files of [`Group::Models`].
    pub fn needs_models(self) -> bool {
        matches!(
            self,
            Self::Models | Self::Predictions | Self::Loop | Self::Adapt | Self::Context
        )
    }
}
