//! Rows that a posterior has not seen, as they weigh beside those that it was learned from.

use faer::Mat;

use crate::error::TorqueError;
use crate::rigid_body::design::{Design, JointPanel, Panel, gathered};
use crate::rigid_body::log::Log;
use crate::rigid_body::posterior::ParameterPosterior;

/// A joint's rows of one panel.
pub(crate) struct NewRows<'a> {
    pub panel: &'a JointPanel,
    /// τ^rb, N·m.
    pub rigid: Vec<f64>,
    /// Columns, each row divided by the root of its variance, (m, p_j).
    pub columns: Mat<f64>,
    /// max(1, c/g) σ² h², (m,).
    pub vars: Vec<f64>,
}

impl ParameterPosterior {
    /// A log's rows as equations for the unknowns.
    ///
    /// # Errors
    /// [`TorqueError::Log`] for terms with memory without times; states of another robot.
    pub(crate) fn design<'a>(&'a self, log: &'a Log<'a>) -> Result<Design<'a>, TorqueError> {
        let parts = self.parts();
        Design::new(&parts.robot, self.unknowns(), &parts.described, log)
    }

    /// The rows of a joint that count, with a load; `mean` says how large the friction is that grows with it.
    ///
    /// `None` where the joint was not learned or none of the log's rows counts for it.
    pub(crate) fn new_rows<'a>(
        &self,
        design: &Design<'_>,
        (joint, panel): (usize, &'a Panel),
        load: Option<usize>,
        mean: &[f64],
    ) -> Option<NewRows<'a>> {
        let learned = self.parts().joints[joint].as_ref()?;
        if !(learned.is_seen && design.is_seen(joint)) {
            return None;
        }
        let rows = &panel.joints[joint];
        let rigid = design.rigid(joint, rows, mean, load);
        let mut columns = all_gathered(self, rows, &rigid);
        let spacing = design.spacing(panel, self.parts().step);
        let var = |qd: &f64| learned.noise.weighted_var_at(*qd, spacing);
        let vars: Vec<f64> = rows.qd.iter().map(var).collect();
        for (row, var) in vars.iter().enumerate() {
            let root = var.sqrt();
            columns
                .row_mut(row)
                .iter_mut()
                .for_each(|entry| *entry /= root);
        }
        Some(NewRows {
            panel: rows,
            rigid,
            columns,
            vars,
        })
    }
}

/// All rows of a panel, with terms of the load made from τ^rb.
pub(crate) fn all_gathered(
    posterior: &ParameterPosterior,
    rows: &JointPanel,
    rigid: &[f64],
) -> Mat<f64> {
    let all: Vec<usize> = (0..rows.qd.len()).collect();
    gathered(
        posterior.unknowns(),
        rows.columns.as_ref(),
        &all,
        Some(rigid),
    )
}
