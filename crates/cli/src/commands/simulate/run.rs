//! One simulated run: its columns, and its file.

use std::io::Write;

use puma_dyn::chapter::Trajectory;

use crate::error::CliError;
use crate::format::write_numbers;
use crate::output::Output;

/// Names of the columns before the states.
pub const KEYS: [&str; 3] = ["context", "run", "t"];
const N_JOINTS: usize = puma_dyn::puma560::N_JOINTS;

/// One trajectory under one load.
pub struct Run<'a> {
    /// Name of the load.
    pub context: &'a str,
    /// States.
    pub trajectory: &'a Trajectory,
    /// (n_samples, 6) row-major, N·m.
    pub torques: &'a [f64],
}

impl Run<'_> {
    /// Name of the run: its path and speed.
    pub fn name(&self) -> String {
        format!("{}_{}", self.trajectory.path, self.trajectory.speed)
    }

    /// Names of the columns of numbers: t, states, torques.
    pub fn number_columns() -> Vec<String> {
        let quantities = ["q", "qd", "qdd", "tau"];
        let numbered = quantities
            .iter()
            .flat_map(|quantity| (1..=N_JOINTS).map(move |joint| format!("{quantity}{joint}")));
        std::iter::once(KEYS[2].to_owned())
            .chain(numbered)
            .collect()
    }

    /// Values of one column of numbers, in the order of [`Run::number_columns`].
    #[cfg(feature = "parquet")]
    pub fn number_column(&self, column: usize) -> Vec<f64> {
        let n_state = 3 * N_JOINTS;
        let every = |values: &[f64], first: usize, step: usize| {
            values[first..].iter().step_by(step).copied().collect()
        };
        match column {
            0 => self.trajectory.time.clone(),
            column if column <= n_state => every(&self.trajectory.states, column - 1, n_state),
            column => every(self.torques, column - 1 - n_state, N_JOINTS),
        }
    }

    /// Writes the run as CSV and makes the file visible.
    ///
    /// # Errors
    /// A system error.
    pub fn write_csv(&self, mut output: Output) -> Result<(), CliError> {
        let name = output.name().to_owned();
        self.write_rows(&mut output)
            .map_err(CliError::io("write", name))?;
        output.commit()
    }

    fn write_rows(&self, output: &mut Output) -> std::io::Result<()> {
        writeln!(
            output,
            "{},{},{}",
            KEYS[0],
            KEYS[1],
            Self::number_columns().join(",")
        )?;
        let key = format!("{},{}", self.context, self.name());
        for (sample_idx, tau) in self.torques.chunks_exact(N_JOINTS).enumerate() {
            let (q, qd, qdd) = self.trajectory.state(sample_idx);
            write!(output, "{key},{:?}", self.trajectory.time[sample_idx])?;
            for numbers in [q, qd, qdd, tau] {
                write_numbers(output, numbers)?;
            }
            writeln!(output)?;
        }
        Ok(())
    }
}
