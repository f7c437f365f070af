//! The load that an arm carries, followed in a control loop.

use puma_dyn::dynamics::N_PARAMETERS;

use crate::error::TorqueError;
use crate::ranges::TrainingRanges;
use crate::rigid_body::online::arm_basis::ArmBasis;
use crate::rigid_body::online::lanes::{Lanes, ZEROS};
use crate::rigid_body::online::load_belief::{LoadBelief, log_mean_exp};
use crate::rigid_body::online::load_factor::Ten;
use crate::rigid_body::online::outer_products::BLOCK;
use crate::rigid_body::online::settings::OnlineSettings;
use crate::rigid_body::online::stretch::Stretch;
use crate::rigid_body::online::tick_rows::TickRows;
use crate::rigid_body::posterior::ParameterPosterior;
use crate::rigid_body::prior::LOAD_STD;

/// Ten inertial parameters of a load about the last joint's origin, with their standard deviations.
///
/// m, kg; m c_x, m c_y, m c_z, kg m; I_xx, I_xy, I_yy, I_xz, I_yz, I_zz, kg m².
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadEstimate {
    /// ψ̂
    pub mean: [f64; N_PARAMETERS],
    /// Of each.
    pub std: [f64; N_PARAMETERS],
}

/// Follows which load an arm carries, and weighs it, one state and its torques after another.
///
/// ```text
/// p(c | D) ∝ p(D | c),   c = each context and a load that is not known,   D the rows since the last change
/// changed:  log p(D_s.. | anew) − log p(D_s.. | D_..s, as before) > margin
/// ```
/// Every row has the variance max(1, c/g) σ² h² of [`ParameterPosterior::given`], with g the time since the row
/// before in steps of the training data; without forgetting and change, evidence and load are those of
/// [`ParameterPosterior::load_evidence`] and of a new context that is given the same rows.
/// What rows tell of the arm is kept until the load changes.
/// Two younger stretches wait for a change: one begins anew every quarter of a second and finds what is heavy at once,
/// the other gathers evidence for longer. A stretch that wins becomes the present one, since when it began.
/// All memory is allocated when it is made.
#[derive(Debug, Clone)]
pub struct OnlineLoad {
    settings: OnlineSettings,
    basis: ArmBasis,
    n_covariates: usize,
    rows: TickRows,
    present: Stretch,
    /// Log evidence that forgetting has taken from the present stretch.
    carried: f64,
    younger: [Younger; 2],
    /// The one whose turn it is to be compared.
    turn: usize,
    /// Of each context, and of a load that is not known.
    beliefs: Vec<LoadBelief>,
    probabilities: Vec<f64>,
    /// The most probable load, in units of its prior.
    load: Ten,
    /// z under it, (chunks,).
    arm: Vec<Lanes>,
    predicted: Vec<f64>,
    /// Seconds since the beginning, of the present stretch's beginning, and of what was last forgotten.
    now: f64,
    since: f64,
    forgotten: f64,
    n_changes: usize,
}

/// A stretch that began later.
#[derive(Debug, Clone)]
struct Younger {
    stretch: Stretch,
    since: f64,
    /// Log evidence of the present stretch when it began.
    total: f64,
    beliefs: Vec<LoadBelief>,
}

impl OnlineLoad {
    /// Of a posterior whose training states had these ranges.
    ///
    /// # Errors
    /// [`TorqueError::Log`] for settings that are not above zero; numbers that overflow.
    pub fn new(
        posterior: &ParameterPosterior,
        ranges: &TrainingRanges,
        settings: OnlineSettings,
    ) -> Result<Self, TorqueError> {
        if let Some(what) = settings.fault() {
            return Err(TorqueError::Log { what });
        }
        let basis = ArmBasis::new(posterior, ranges, settings.left_out)?;
        let stretch = Stretch::new(&basis);
        let n_hypotheses = basis.loads.len() + 1;
        let beliefs = vec![stretch.unknown(); n_hypotheses];
        let younger = Younger {
            stretch: stretch.clone(),
            since: 0.0,
            total: 0.0,
            beliefs: beliefs.clone(),
        };
        Ok(Self {
            n_covariates: posterior.unknowns().n_covariates(),
            rows: TickRows::new(posterior, basis.n_chunks()),
            beliefs,
            probabilities: vec![1.0 / n_hypotheses as f64; n_hypotheses],
            load: [0.0; N_PARAMETERS],
            arm: vec![ZEROS; basis.n_chunks()],
            predicted: vec![f64::NAN; posterior.unknowns().n_joints()],
            younger: [younger.clone(), younger],
            present: stretch,
            carried: 0.0,
            turn: 0,
            now: 0.0,
            since: 0.0,
            forgotten: 0.0,
            n_changes: 0,
            basis,
            settings,
        })
    }

    /// Takes the next state and its torques.
    ///
    /// Allocates nothing but for an error, after which nothing has been taken.
    /// # Shapes
    /// `x` (3ℓ + ℓ for each length of hysteresis,), (q, q̇, q̈, z); `torques` (ℓ,), N·m, those of joints without a
    /// model of no account; `step` seconds since the state before, for the first one those that rows are apart.
    /// # Errors
    /// [`TorqueError::Log`] for a number that is not finite, and a step that is not above zero;
    /// [`TorqueError::NotFinite`] for a state so large that its torque overflows.
    /// # Panics
    /// On other lengths.
    pub fn update(&mut self, x: &[f64], torques: &[f64], step: f64) -> Result<(), TorqueError> {
        assert_eq!(x.len(), self.n_covariates, "x holds (q, qd, qdd) and z");
        assert_eq!(torques.len(), self.predicted.len(), "one torque per joint");
        if let Some(what) = fault(x, torques, step) {
            return Err(TorqueError::Log { what });
        }
        self.rows.fill(&self.basis, (x, torques, step), &self.load);
        if let Some(joint_idx) = self.rows.overflow() {
            return Err(TorqueError::NotFinite { row: 0, joint_idx });
        }
        self.now += step;
        self.present.arm_into(&self.load, &mut self.arm);
        (self.rows).predict_into(&self.load, &self.arm, &mut self.predicted);
        self.take();
        self.judge();
        self.compare();
        Ok(())
    }

    /// The rows that count, into every stretch.
    fn take(&mut self) {
        let mut counting = self.rows.rows.iter().filter(|row| row.counts);
        while let Some(first) = counting.next() {
            let mut block = [first; BLOCK];
            let mut n = 1;
            for (place, row) in block[1..].iter_mut().zip(&mut counting) {
                *place = row;
                n += 1;
            }
            self.present.take(&self.basis, &block[..n]);
            for younger in &mut self.younger {
                younger.stretch.take(&self.basis, &block[..n]);
            }
        }
    }

    /// Evidence of every hypothesis by the present stretch, probabilities, the most probable load.
    fn judge(&mut self) {
        self.present.judge(&self.basis, &mut self.beliefs);
        let total = log_evidence(&self.beliefs);
        let n = self.beliefs.len() as f64;
        let mut best = self.basis.loads.len();
        for (idx, belief) in self.beliefs.iter().enumerate() {
            self.probabilities[idx] = (belief.log_evidence - total).exp() / n;
            if belief.log_evidence > self.beliefs[best].log_evidence {
                best = idx;
            }
        }
        self.load = self.beliefs[best].mean;
    }

    /// Compares the younger stretch whose turn it is with the present one; it takes its place, or begins anew.
    fn compare(&mut self) {
        let total = self.carried + log_evidence(&self.beliefs);
        let (turn, window) = (self.turn, self.settings.windows[self.turn]);
        self.turn = 1 - turn;
        let younger = &mut self.younger[turn];
        younger.stretch.judge(&self.basis, &mut younger.beliefs);
        let gain = log_evidence(&younger.beliefs) - (total - younger.total);
        if gain > self.settings.margin {
            std::mem::swap(&mut self.present, &mut younger.stretch);
            self.since = younger.since;
            self.n_changes += 1;
            self.settle();
        } else if self.now - younger.since >= window {
            younger.begin(&self.basis, self.now, total);
            if turn == 0 {
                self.forget();
            }
        }
    }

    /// After the present stretch has become another one.
    fn settle(&mut self) {
        self.carried = 0.0;
        self.forgotten = self.now;
        self.judge();
        let total = log_evidence(&self.beliefs);
        for younger in &mut self.younger {
            younger.begin(&self.basis, self.now, total);
        }
    }

    /// Forgets by the time that has passed; what that changes of the evidence is carried on.
    fn forget(&mut self) {
        let Some(seconds) = self.settings.forgetting else {
            return;
        };
        let before = log_evidence(&self.beliefs);
        self.present
            .forget(((self.forgotten - self.now) / seconds).exp());
        self.forgotten = self.now;
        self.judge();
        self.carried += before - log_evidence(&self.beliefs);
    }

    /// Begins anew: whoever knows that the load is another one need not wait until torques show it.
    ///
    /// Allocates nothing.
    pub fn restart(&mut self) {
        self.present.begin(&self.basis);
        self.since = self.now;
        self.n_changes += 1;
        self.settle();
    }

    /// Probabilities of each context, and behind them of a load that is none of them, (contexts + 1,).
    pub fn probabilities(&self) -> &[f64] {
        &self.probabilities
    }

    /// Log evidence of each context and of a load that is none of them, by the rows since the last change, nat.
    pub fn log_evidences(&self) -> impl Iterator<Item = f64> + '_ {
        self.beliefs.iter().map(|belief| belief.log_evidence)
    }

    /// What is carried, weighed by the rows since the last change alone.
    ///
    /// Allocates nothing.
    pub fn load(&self) -> LoadEstimate {
        let belief = &self.beliefs[self.basis.loads.len()];
        let std = belief.std();
        LoadEstimate {
            mean: std::array::from_fn(|k| belief.mean[k] * LOAD_STD[k]),
            std: std::array::from_fn(|k| std[k] * LOAD_STD[k]),
        }
    }

    /// Torques of the last state as they were expected before they were seen, with the most probable load, N·m.
    ///
    /// # Shapes
    /// (ℓ,); NaN for joints without a model.
    pub fn predicted(&self) -> &[f64] {
        &self.predicted
    }

    /// How often the load has changed.
    pub fn n_changes(&self) -> usize {
        self.n_changes
    }

    /// Seconds since the load has last changed, as far as torques show it, or since the beginning.
    pub fn seconds_since_change(&self) -> f64 {
        self.now - self.since
    }

    /// Directions that the arm's parameters are taken to be uncertain in.
    pub fn n_directions(&self) -> usize {
        self.basis.n_directions()
    }
}

impl Younger {
    fn begin(&mut self, basis: &ArmBasis, now: f64, total: f64) {
        self.stretch.begin(basis);
        (self.since, self.total) = (now, total);
    }
}

/// Log evidence of all hypotheses together, equally probable beforehand.
fn log_evidence(beliefs: &[LoadBelief]) -> f64 {
    log_mean_exp(beliefs.iter().map(|belief| belief.log_evidence))
}

/// What is wrong with a tick's numbers, if anything.
fn fault(x: &[f64], torques: &[f64], step: f64) -> Option<String> {
    if let Some(column) = x.iter().position(|value| !value.is_finite()) {
        return Some(format!("covariate {column} is {}", x[column]));
    }
    if let Some(joint) = torques.iter().position(|value| !value.is_finite()) {
        return Some(format!(
            "the torque of joint {joint} is {} N·m",
            torques[joint]
        ));
    }
    let is_step = step.is_finite() && step > 0.0;
    (!is_step).then(|| format!("a step of {step} s"))
}
