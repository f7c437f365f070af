//! The gains: one bandwidth for all joints, or each joint's own.

use puma_dyn::motion::CompositeController;
use puma_dyn::{Context, Workspace, crba};

use crate::commands::control::reference::Reference;
use crate::error::CliError;
use crate::robot::Robot;

/// Either a bandwidth, or both lists of gains.
#[derive(clap::Args, Debug)]
pub struct GainArgs {
    /// Gains of one bandwidth ω, rad/s: Kp = I ω², Kd = 2 ζ I ω, with I the diagonal of the unloaded robot's inertia
    /// matrix at the first state
    #[arg(long, value_name = "OMEGA", required_unless_present = "kp", conflicts_with_all = ["kp", "kd"])]
    bandwidth: Option<f64>,

    /// Damping ratio ζ that goes with --bandwidth
    #[arg(long, value_name = "ZETA", default_value_t = 1.0)]
    damping_ratio: f64,

    /// Kp of every joint in the robot's order, N·m/rad (N/m)
    #[arg(long, value_name = "K1,K2,…", value_delimiter = ',', requires = "kd")]
    kp: Option<Vec<f64>>,

    /// Kd of every joint, N·m·s/rad (N·s/m)
    #[arg(long, value_name = "K1,K2,…", value_delimiter = ',', requires = "kp")]
    kd: Option<Vec<f64>>,
}

impl GainArgs {
    /// The controller.
    ///
    /// # Errors
    /// Gains that are not as many as joints, negative or not finite.
    pub fn controller(
        &self,
        robot: &Robot,
        reference: &Reference,
    ) -> Result<CompositeController, CliError> {
        if let (Some(kp), Some(kd)) = (&self.kp, &self.kd) {
            let n = robot.model.n_joints();
            for (option, gains) in [("--kp", kp), ("--kd", kd)] {
                if gains.len() != n {
                    let found = gains.len();
                    return Err(CliError::Usage(format!(
                        "{option} has {found} gains, the robot has {n} joints: {}",
                        robot.model.joint_names().join(", ")
                    )));
                }
            }
            return Ok(CompositeController::new(kp.clone(), kd.clone())?);
        }
        let bandwidth = self.bandwidth.unwrap_or_default();
        for (option, number) in [
            ("--bandwidth", bandwidth),
            ("--damping-ratio", self.damping_ratio),
        ] {
            if !(number.is_finite() && number >= 0.0) {
                let reason = format!("{option} {number}: a number that is not negative is needed");
                return Err(CliError::Usage(reason));
            }
        }
        let inertias = inertias(robot, reference.first_q());
        let controller =
            CompositeController::with_bandwidth(&inertias, bandwidth, self.damping_ratio);
        Ok(controller?)
    }
}

/// Diagonal of the unloaded robot's inertia matrix.
fn inertias(robot: &Robot, q: &[f64]) -> Vec<f64> {
    let (model, n) = (&robot.model, q.len());
    let mut matrix = vec![0.0; n * n];
    let (mut workspace, empty) = (Workspace::new(model), Context::empty());
    crba(model, &mut workspace, robot.effects, &empty, q, &mut matrix);
    matrix.into_iter().step_by(n + 1).collect()
}
