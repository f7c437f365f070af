//! Controller and arm in a loop: torques from the state at each tick, held until the next.

use crate::dynamics::payload::Context;
use crate::error::DynError;
use crate::motion::arm_simulator::ArmSimulator;
use crate::motion::compliant_wall::CompliantWall;
use crate::motion::controller::CompositeController;
use crate::motion::feed_forward::FeedForward;
use crate::motion::reference_motion::{JointState, ReferenceMotion};
use crate::motion::tick::{Rate, Tick};
use crate::robot::friction_law::Effects;
use crate::robot::model::Model;

/// An arm that follows a motion.
///
/// ```
/// use puma_dyn::motion::{
///     ArmSimulator, ClosedLoop, CompositeController, GravityFeedForward, Rate, ReferenceMotion,
/// };
/// use puma_dyn::{Context, Effects, puma560};
///
/// // Half a second of holding still.
/// let model = puma560::model();
/// let rest = [0.1, -0.7, 0.4, 0.3, -0.2, 0.9].iter().chain(&[0.0; 12]).copied();
/// let states: Vec<f64> = rest.clone().chain(rest).collect();
/// let reference = ReferenceMotion::new(6, vec![0.0, 0.5], states)?;
///
/// let controller = CompositeController::with_bandwidth(&[3.0, 5.0, 1.0, 0.2, 0.2, 0.2], 10.0, 1.0)?;
/// let rate = Rate { period: 1e-3, n_steps: 2 };
/// let mut robot = ClosedLoop::new(&model, Effects::ALL, Context::empty(), &reference, rate)?;
/// let mut gravity = GravityFeedForward::new(&model, Context::empty());
/// robot.run(&controller, &mut gravity, f64::INFINITY, |tick| {
///     assert!((tick.q[1] + 0.7).abs() < 1e-12); // friction holds what gravity's torques balance
/// })?;
/// # Ok::<(), puma_dyn::DynError>(())
/// ```
#[derive(Debug, Clone)]
pub struct ClosedLoop<'a> {
    arm: ArmSimulator<'a>,
    reference: &'a ReferenceMotion,
    rate: Rate,
    n_done: usize,
    desired: JointState,
    q: Vec<f64>,
    qd: Vec<f64>,
    tau: Vec<f64>,
    feed_forward: Vec<f64>,
}

impl<'a> ClosedLoop<'a> {
    /// An arm at the beginning of a reference, moving with it.
    ///
    /// # Errors
    /// Those of [`ArmSimulator::new`]; [`DynError::Reference`] for a motion of another number of joints
    /// or a period or number of steps that is not positive.
    pub fn new(
        model: &'a Model,
        effects: Effects,
        context: Context,
        reference: &'a ReferenceMotion,
        rate: Rate,
    ) -> Result<Self, DynError> {
        let n = model.n_joints();
        let refuse = |reason: String| Err(DynError::Reference { reason });
        if reference.n_joints() != n {
            let found = reference.n_joints();
            return refuse(format!("it moves {found} joints, the robot has {n}"));
        }
        let is_positive = rate.period > 0.0 && rate.period.is_finite();
        if !is_positive || rate.n_steps == 0 {
            let Rate { period, n_steps } = rate;
            return refuse(format!(
                "it cannot be followed in {n_steps} steps of {period} s"
            ));
        }
        let mut desired = JointState::zero(n);
        reference.at(0.0, &mut desired);
        Ok(Self {
            arm: ArmSimulator::new(model, effects, context, &desired.q, &desired.qd)?,
            reference,
            rate,
            n_done: 0,
            desired,
            q: vec![0.0; n],
            qd: vec![0.0; n],
            tau: vec![0.0; n],
            feed_forward: vec![0.0; n],
        })
    }

    /// The same before a wall.
    ///
    /// # Errors
    /// Those of [`ArmSimulator::with_wall`].
    pub fn with_wall(mut self, wall: CompliantWall) -> Result<Self, DynError> {
        self.arm = self.arm.with_wall(wall)?;
        Ok(self)
    }

    /// The arm as it is now.
    pub fn arm(&self) -> &ArmSimulator<'a> {
        &self.arm
    }

    /// The arm, to swap its load.
    pub fn arm_mut(&mut self) -> &mut ArmSimulator<'a> {
        &mut self.arm
    }

    /// Number of ticks of the whole reference.
    pub fn n_ticks(&self) -> usize {
        let whole = self.reference.duration() / self.rate.period + 1e-9; // a last tick may fall short by rounding
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a number of ticks is positive and far below 2^52"
        )]
        let n = whole.floor() as usize;
        n
    }

    /// Follows the reference up to a time since its start, or to its end, and tells of every tick.
    ///
    /// Allocates nothing, if the feed-forward does not. A later call goes on where this one ended.
    /// # Errors
    /// Those of [`ArmSimulator::advance`].
    /// # Panics
    /// If the controller has another number of joints.
    pub fn run(
        &mut self,
        controller: &CompositeController,
        feed_forward: &mut impl FeedForward,
        until: f64,
        mut each: impl FnMut(&Tick<'_>),
    ) -> Result<(), DynError> {
        let Rate { period, n_steps } = self.rate;
        while self.n_done < self.n_ticks() {
            let time = period * self.n_done as f64;
            if time >= until {
                break;
            }
            self.reference.at(time, &mut self.desired);
            self.q.copy_from_slice(self.arm.q());
            self.qd.copy_from_slice(self.arm.qd());
            feed_forward.torques(&self.desired, &mut self.feed_forward);
            let measured = (&self.q[..], &self.qd[..]);
            controller.torques(&self.desired, measured, &self.feed_forward, &mut self.tau);
            self.arm.advance(&self.tau, period, n_steps)?;
            self.n_done += 1;
            let wall_force = self.arm.wall_force();
            let tick = Tick {
                time,
                desired: &self.desired,
                q: &self.q,
                qd: &self.qd,
                tau: &self.tau,
                feed_forward: &self.feed_forward,
                next_q: self.arm.q(),
                next_qd: self.arm.qd(),
                wall_force,
            };
            feed_forward.observe(&tick);
            each(&tick);
        }
        Ok(())
    }
}
