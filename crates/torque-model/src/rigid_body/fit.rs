//! Five passes over a log: solve for the parameters, then take noise, profile and correlation from what they leave.

use std::sync::Arc;

use puma_dyn::Model;

use crate::error::TorqueError;
use crate::rigid_body::correlation::{LEAST_SECONDS, RunRows, correlation, least_correlation};
use crate::rigid_body::design::Design;
use crate::rigid_body::log::Log;
use crate::rigid_body::noise::{BinSquares, JointNoise, profile};
use crate::rigid_body::normal_equations::{JointSums, NormalEquations};
use crate::rigid_body::posterior::{LearnedJoint, ParameterPosterior, PosteriorParts};
use crate::rigid_body::prior::{LOAD_STD, body_std, friction_std};
use crate::rigid_body::term_set::TermSet;
use crate::rigid_body::unknowns::Unknowns;

/// Passes over the data.
const PASSES: usize = 5;
/// Passes in which no friction grows with the load, since the load is not known yet.
const PASSES_WITHOUT_LOAD: usize = 2;
/// Noise at the start, as a part of the torques that the description leaves.
const FIRST_PART: f64 = 0.1;
/// Least noise as a part of the root mean square of the torques, and in N·m.
const LEAST_NOISE_PART: f64 = 1e-4;
const LEAST_NOISE: f64 = 1e-9;

/// What is decided about a fit beforehand.
#[derive(Debug, Clone, PartialEq)]
pub struct FitSettings {
    /// Names of the contexts that carry nothing.
    pub bare: Vec<String>,
    /// κ: width of the prior of friction, as a part of the torques.
    pub friction_width: f64,
    /// Seconds of rows that tell no less than one independent row does.
    pub least_correlation: f64,
}

impl Default for FitSettings {
    /// Nothing bare, κ = 1, 0.3 s.
    fn default() -> Self {
        Self {
            bare: Vec::new(),
            friction_width: 1.0,
            least_correlation: LEAST_SECONDS,
        }
    }
}

/// A posterior after each pass.
#[derive(Debug, Clone)]
pub(crate) struct Passes {
    pub posteriors: Vec<ParameterPosterior>,
}

impl Passes {
    pub fn into_last(mut self) -> Result<ParameterPosterior, TorqueError> {
        self.posteriors
            .pop()
            .ok_or_else(|| TorqueError::InconsistentModel {
                what: "no pass over the data".to_owned(),
            })
    }
}

/// Learns a robot's parameters from the runs of a log, each joint with a set of friction terms.
///
/// # Shapes
/// `sets` (ℓ,).
/// # Errors
/// [`TorqueError::Log`] for terms with memory without times, and runs of different rates; contexts said to be bare
/// that there are not; states of another robot; numbers that overflow.
/// # Source
/// Sec. 3.2 for the prior about a description; Swevers, Verdonck & De Schutter 2007, "Dynamic model identification for
/// industrial robots", IEEE Control Systems Magazine 27(5), for the estimate; Bayley & Hammersley 1946 for
/// rows per independent row.
pub(crate) fn fit_passes(
    robot: &Arc<Model>,
    described: &[f64],
    log: &Log<'_>,
    sets: &[TermSet],
    settings: &FitSettings,
) -> Result<Passes, TorqueError> {
    log.require_one_step()?;
    let loads = loads_of(log, &settings.bare)?;
    let n_loads = loads.iter().flatten().count();
    let unknowns = Unknowns::new(robot, TermSet::union(sets)).with_loads(n_loads);
    let design = Design::new(robot, &unknowns, described, log)?;
    let mut fit = Fit {
        prior: first_prior(&unknowns, described, settings),
        joints: (0..robot.n_joints())
            .map(|joint| JointFit::new(&design, log, joint, sets[joint]))
            .collect(),
        robot,
        described,
        design: &design,
        unknowns: &unknowns,
        log,
        loads,
        settings,
    };
    fit.run()
}

/// Standard deviations of bodies and loads; those of friction follow from the data.
fn first_prior(unknowns: &Unknowns, described: &[f64], settings: &FitSettings) -> Vec<f64> {
    let mut prior = vec![0.0; unknowns.len()];
    prior[unknowns.bodies()].copy_from_slice(&body_std(described, settings.bare.is_empty()));
    for load in 0..unknowns.n_loads() {
        prior[unknowns.load(load)].copy_from_slice(&LOAD_STD);
    }
    prior
}

/// The number of each context's load: none of a bare one, and none where one context is all that there is.
fn loads_of(log: &Log<'_>, bare: &[String]) -> Result<Vec<Option<usize>>, TorqueError> {
    let names = &log.samples.contexts;
    if let Some(unknown) = bare.iter().find(|name| !names.contains(name)) {
        return Err(mtgp::MtgpError::UnknownContext {
            name: unknown.clone(),
            known: names.clone(),
        }
        .into());
    }
    let is_loaded = |context: usize| {
        let is_bare = names.get(context).is_some_and(|name| bare.contains(name));
        !is_bare && log.runs.iter().any(|run| run.context == context)
    };
    let n_contexts = names.len().max(1);
    let loaded: Vec<usize> = (0..n_contexts)
        .filter(|context| is_loaded(*context))
        .collect();
    if bare.is_empty() && loaded.len() == 1 {
        return Ok(vec![None; n_contexts]);
    }
    Ok((0..n_contexts)
        .map(|context| loaded.iter().position(|other| *other == context))
        .collect())
}

/// Root of the mean square about the mean.
fn standard_deviation(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let centre = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|value| (value - centre).powi(2)).sum();
    (squares / n).sqrt()
}

/// A fit under way.
struct Fit<'a> {
    robot: &'a Arc<Model>,
    described: &'a [f64],
    design: &'a Design<'a>,
    unknowns: &'a Unknowns,
    log: &'a Log<'a>,
    loads: Vec<Option<usize>>,
    settings: &'a FitSettings,
    prior: Vec<f64>,
    joints: Vec<JointFit>,
}

/// One joint of it.
struct JointFit {
    set: TermSet,
    is_measured: bool,
    is_seen: bool,
    noise: JointNoise,
    /// Root mean square of the torques of rows that count, N·m.
    torque_rms: f64,
    /// Least σ, N·m.
    least_noise: f64,
    sums: JointSums,
    /// Residuals at all rows of all runs, zero at those that do not count.
    residuals: Vec<f64>,
}

impl JointFit {
    fn new(design: &Design<'_>, log: &Log<'_>, joint: usize, set: TermSet) -> Self {
        let torques = log
            .samples
            .torques
            .iter()
            .find(|torques| torques.joint_idx == joint);
        let (mut squares, mut used_squares, mut n_used) = (0.0, 0.0, 0.0_f64);
        if let Some(torques) = torques {
            for run in &log.runs {
                for (row, place) in run.rows.iter().zip(run.span.clone()) {
                    let square = torques.values[*row].powi(2);
                    squares += square;
                    if log.is_used(place, joint) {
                        used_squares += square;
                        n_used += 1.0;
                    }
                }
            }
        }
        let rms = (squares / (log.n_rows().max(1) as f64)).sqrt();
        Self {
            set,
            is_measured: design.is_measured(joint),
            is_seen: design.is_seen(joint),
            noise: JointNoise::white(0.0),
            torque_rms: (used_squares / n_used.max(1.0)).sqrt(),
            least_noise: LEAST_NOISE_PART * rms + LEAST_NOISE,
            sums: JointSums::new(log.samples.contexts.len().max(1)),
            residuals: Vec::new(),
        }
    }
}

impl Fit<'_> {
    fn run(&mut self) -> Result<Passes, TorqueError> {
        // Without parameters, residuals are what the description leaves.
        self.look(0, &vec![0.0; self.unknowns.len()], None);
        self.first_noise();
        let mut posteriors: Vec<ParameterPosterior> = Vec::new();
        for pass in 1..=PASSES {
            // Weights of the pass before make the parameters of this one.
            let posterior = self.solve()?;
            let before = posteriors.last().filter(|_| pass > PASSES_WITHOUT_LOAD);
            self.look(pass, posterior.mean(), before.map(ParameterPosterior::mean));
            self.take_noise();
            posteriors.push(posterior.with_joints(self.learned_joints()));
        }
        Ok(Passes { posteriors })
    }

    /// One look at all rows after a pass: residuals of its parameters, and the sums for the next one, where they change.
    ///
    /// Residuals have the friction that grows with the load as it was at the parameters `before`, sums as it is at `mean`.
    fn look(&mut self, pass: usize, mean: &[f64], before: Option<&[f64]>) {
        let (design, unknowns, log, loads) = (self.design, self.unknowns, self.log, &self.loads);
        let with_load = pass >= PASSES_WITHOUT_LOAD;
        let changes = with_load && pass < PASSES && unknowns.have_load_friction();
        let is_summed = pass == 0 || changes;
        let n = log.n_rows();
        for joint in &mut self.joints {
            if joint.is_measured {
                joint.residuals.resize(n, 0.0);
            }
            if is_summed {
                joint.sums = JointSums::new(loads.len());
            }
        }
        design.for_each(&mut self.joints, |of_joint, joint, panel| {
            if !of_joint.is_measured {
                return;
            }
            let (context, rows) = (log.runs[panel.run].context, &panel.joints[joint]);
            let rigid_at = |w| design.rigid(joint, rows, w, loads[context]);
            let rigid = before.map(rigid_at);
            let residuals = design.residuals(joint, rows, mean, loads[context], rigid.as_deref());
            for (place, residual) in rows.places.iter().zip(residuals) {
                of_joint.residuals[*place] = residual;
            }
            if is_summed && of_joint.is_seen {
                let rigid = with_load.then(|| rigid_at(mean));
                of_joint.sums.add(unknowns, context, rows, rigid.as_deref());
            }
        });
    }

    /// Noise before the first pass: a tenth of what the description leaves.
    fn first_noise(&mut self) {
        let log = self.log;
        for (joint, of_joint) in self.joints.iter_mut().enumerate() {
            let counts = |place: usize| !of_joint.is_seen || log.is_used(place, joint);
            let residuals = of_joint.residuals.iter().enumerate();
            let rows: Vec<f64> = residuals
                .filter(|(place, _)| counts(*place))
                .map(|(_, e)| *e)
                .collect();
            if !rows.is_empty() {
                let std = FIRST_PART * standard_deviation(&rows);
                of_joint.noise = JointNoise::white(std.max(of_joint.least_noise));
            }
        }
    }

    /// Prior of friction, normal equations, solution.
    fn solve(&mut self) -> Result<ParameterPosterior, TorqueError> {
        let mut equations = NormalEquations::empty(self.unknowns);
        for (joint, of_joint) in self.joints.iter().enumerate().filter(|(_, of)| of.is_seen) {
            let terms = self.unknowns.terms();
            let rms = of_joint.sums.friction_rms(self.unknowns);
            let std = friction_std(
                terms,
                &rms,
                of_joint.torque_rms,
                self.settings.friction_width,
            );
            let kept = of_joint.set.terms();
            let prior = self.prior[self.unknowns.friction(joint)].iter_mut();
            for ((prior, std), term) in prior.zip(std).zip(terms) {
                *prior = if kept.contains(term) { std } else { 0.0 };
            }
            equations.add(
                self.unknowns,
                joint,
                &of_joint.sums,
                &self.loads,
                &of_joint.noise,
            );
        }
        ParameterPosterior::new(PosteriorParts {
            robot: Arc::clone(self.robot),
            unknowns: self.unknowns.clone(),
            described: self.described.to_vec(),
            contexts: self.log.samples.contexts.clone(),
            loads: self.loads.clone(),
            prior_std: self.prior.clone(),
            h: equations.h,
            b: equations.b,
            joints: self.learned_joints(),
            step: self.log.step(),
        })
    }

    fn learned_joints(&self) -> Vec<Option<LearnedJoint>> {
        let of_joint = |joint: &JointFit| {
            joint.is_measured.then_some(LearnedJoint {
                terms: joint.set,
                noise: joint.noise,
                is_seen: joint.is_seen,
            })
        };
        self.joints.iter().map(of_joint).collect()
    }

    /// σ, h and c of what the parameters leave.
    fn take_noise(&mut self) {
        use rayon::prelude::*;
        let log = self.log;
        let least = least_correlation(&log.steps(), self.settings.least_correlation);
        self.joints
            .par_iter_mut()
            .enumerate()
            .for_each(|(joint, of_joint)| {
                if of_joint.is_measured {
                    of_joint.noise = of_joint.noise_of(log, joint, least);
                }
            });
    }
}

impl JointFit {
    fn noise_of(&self, log: &Log<'_>, joint: usize, least: f64) -> JointNoise {
        let column = log.samples.n_joints() + joint;
        let speed = |row: usize| log.samples.x[(row, column)];
        if !self.is_seen {
            let squares: f64 = self.residuals.iter().map(|e| e * e).sum();
            let rms = (squares / self.residuals.len().max(1) as f64).sqrt();
            return JointNoise {
                correlation: least,
                ..JointNoise::white(rms.max(self.least_noise))
            };
        }
        let mut of_runs = vec![BinSquares::default(); log.runs.len()];
        for (run, squares) in log.runs.iter().zip(&mut of_runs) {
            for (row, place) in run.rows.iter().zip(run.span.clone()) {
                if log.is_used(place, joint) {
                    squares.add(self.residuals[place], speed(*row));
                }
            }
        }
        let (std, h) = profile(&of_runs).unwrap_or((0.0, JointNoise::white(0.0).profile));
        let mut noise = JointNoise {
            std: std.max(self.least_noise),
            profile: h,
            correlation: 1.0,
        };
        let mut standardised = self.residuals.clone();
        let mut used = vec![false; standardised.len()];
        for run in &log.runs {
            for (row, place) in run.rows.iter().zip(run.span.clone()) {
                used[place] = log.is_used(place, joint);
                standardised[place] /= noise.std_at(speed(*row));
            }
        }
        let runs: Vec<RunRows<'_>> = (log.runs.iter())
            .map(|run| RunRows {
                residuals: &standardised[run.span.clone()],
                used: &used[run.span.clone()],
                step: run.step,
            })
            .collect();
        noise.correlation = correlation(&runs, least);
        noise
    }
}
