//! Everything that can go wrong between an experiment's description and its report.

use std::io::ErrorKind;
use std::path::PathBuf;

/// Error of the experiment runner.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BenchError {
    /// A score was asked for without any test sample.
    #[error("the test set is empty")]
    EmptyTestSet,
    /// The variance of the targets is zero, so the score is undefined.
    #[error("all test targets equal {value}, their variance is zero and nMSE undefined")]
    ConstantTargets {
        /// The common value, N·m.
        value: f64,
    },
    /// A prediction or a target is NaN or infinite.
    #[error("test sample {idx}: the prediction or the target is not finite")]
    NonFinite {
        /// Index in the test set, from 0.
        idx: usize,
    },
    /// A name that is not in the list it should come from.
    #[error("unknown {what} \"{name}\"; known: {known}")]
    UnknownName {
        /// What was named: a model, a profile, ….
        what: &'static str,
        /// The name given.
        name: String,
        /// The names there are, separated by commas.
        known: String,
    },
    /// An experiment's TOML is not what the format asks for.
    #[error("experiment {name}: {message}")]
    Experiment {
        /// File name of the experiment.
        name: String,
        /// What is wrong.
        message: String,
    },
    /// A flag was given that concerns nothing of what was asked for.
    #[error("{flag} would change nothing: it concerns {concerns}, and none of these is chosen")]
    UnusedFlag {
        /// The flag.
        flag: &'static str,
        /// Names of the experiments that it concerns.
        concerns: String,
    },
    /// A report of stored results was asked for, and there are none.
    #[error("{output}: nothing of what was asked for is computed yet{others}; without `--from results` it is computed now", output = output.display(), others = other_versions(.others))]
    NothingFinished {
        /// The output directory.
        output: PathBuf,
        /// Directories with results of other versions of the sources.
        others: Vec<String>,
    },
    /// A file could not be read or written.
    #[error("{path}: {reason}", path = path.display(), reason = reason(source))]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A stored record or a table cannot be understood.
    #[error("{path}: {message}", path = path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        message: String,
    },
    /// The pool of threads could not be started.
    #[error("cannot start {n_threads} threads: {message}")]
    Threads {
        /// Number asked for.
        n_threads: usize,
        /// The system's reason.
        message: String,
    },
    /// A picture could not be drawn.
    #[error("cannot draw the picture: {message}")]
    Picture {
        /// The drawing library's reason.
        message: String,
    },
    /// An eigendecomposition did not converge.
    #[error("eigendecomposition: {message}")]
    Decomposition {
        /// The linear-algebra library's reason.
        message: String,
    },
    /// The simulated data could not be made.
    #[error("data set: {0}")]
    Dynamics(#[from] puma_dyn::DynError),
    /// A model could not be fitted.
    #[error("fit: {0}")]
    Fit(#[from] gp_core::GpError),
    /// A model of several contexts could not be fitted.
    #[error("fit of several contexts: {0}")]
    MultiTask(#[from] mtgp::MtgpError),
    /// A robot's model could not be learned, put together or asked.
    #[error("model: {0}")]
    Model(torque_model::TorqueError),
}

impl From<torque_model::TorqueError> for BenchError {
    fn from(error: torque_model::TorqueError) -> Self {
        match error {
            torque_model::TorqueError::Gp(cause) => Self::Fit(cause),
            torque_model::TorqueError::Mtgp(cause) => Self::MultiTask(cause),
            other => Self::Model(other),
        }
    }
}

/// The system's words, with what they mean where that is all there is to be done about it.
fn reason(error: &std::io::Error) -> String {
    match error.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => {
            format!(
                "the disk is full ({error}); what is finished is kept, and the next run goes on from there"
            )
        }
        _ => error.to_string(),
    }
}

fn other_versions(directories: &[String]) -> String {
    if directories.is_empty() {
        String::new()
    } else {
        let directories = directories.join(", ");
        format!(" with these sources (results of other versions: {directories})")
    }
}

impl BenchError {
    /// Adapter for `map_err`: attaches the path to an input or output error.
    pub fn io(path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        move |source| Self::Io { path, source }
    }

    /// An experiment whose description is not what it should be.
    pub fn experiment(name: &str, message: impl std::fmt::Display) -> Self {
        Self::Experiment {
            name: name.to_string(),
            message: message.to_string(),
        }
    }

    /// A file whose contents do not make sense.
    pub fn malformed(path: impl Into<PathBuf>, message: impl std::fmt::Display) -> Self {
        Self::Malformed {
            path: path.into(),
            message: message.to_string(),
        }
    }
}
