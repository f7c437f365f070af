//! L-BFGS with recovery: argmin's iteration, our line search, restarts from steepest descent.
//!
//! argmin returns `Ok` when its line search fails, and then has lost the problem.
//! The problem here is a handle to state that this module keeps, so nothing is
//! lost: every evaluated point is remembered long enough to serve argmin's
//! separate requests for value and gradient, and the best one for good.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

use argmin::core::{CostFunction, Error, Executor, Gradient, State};
use argmin::solver::quasinewton::LBFGS;

use super::Objective;
use super::line_search::{StrongWolfe, VALUE_NOISE, largest};

/// Pairs of steps and gradient changes that approximate the Hessian.
///
/// Beyond `FEW` coordinates all pairs of a search are kept, more or less: the entries
/// of a task factor beside a small σ have curvatures that span ten orders of magnitude.
/// Measured on 280 samples of 14 loads, rank 4, 95 coordinates: after 3000 evaluations
/// 562 nats with 30 pairs; 584 nats and at rest after 2100 with 400.
const HISTORY: usize = 30;
const LONG_HISTORY: usize = 400;
const FEW: usize = 48;

/// Points whose value and gradient are kept; more than one line search makes.
const REMEMBERED: usize = 24;

/// When a search ends.
#[derive(Debug, Clone, PartialEq)]
pub struct MinimizeOptions {
    /// Converged when no component of the projected gradient is larger.
    pub gradient_tolerance: f64,
    /// Stalled when a whole iteration gains less than this.
    pub value_tolerance: f64,
    /// Evaluations of value and gradient after which the best point is returned.
    pub max_evaluations: usize,
    /// Restarts from steepest descent after which a stalled search is given up.
    pub max_recoveries: usize,
}

/// Why a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum StopReason {
    /// The projected gradient is within its tolerance.
    GradientSmall,
    /// A restart from steepest descent gained less than the value tolerance.
    ValueStalled,
    /// The evaluations are used up.
    EvaluationLimit,
    /// The work that the objective may take is used up.
    WorkLimit,
    /// Line searches kept failing, although each restart still gained something.
    RecoveryLimit,
    /// The function is undefined at the start.
    StartUndefined,
}

/// The best point that a search evaluated.
#[derive(Debug, Clone, PartialEq)]
pub struct Minimum {
    /// Its coordinates.
    pub z: Vec<f64>,
    /// Value of the function there; +∞ if it is undefined at the start.
    pub value: f64,
    /// Its gradient there; zeros if it is undefined at the start.
    pub gradient: Vec<f64>,
    /// Value at the start; +∞ if it is undefined there.
    pub start_value: f64,
    /// Largest component of the projected gradient there.
    pub projected_gradient: f64,
    /// L-BFGS iterations.
    pub iterations: usize,
    /// Evaluations of value and gradient.
    pub evaluations: usize,
    /// Restarts from steepest descent after a failed line search or a stall.
    pub recoveries: usize,
    /// Why the search ended.
    pub stop: StopReason,
}

/// Minimises a function by L-BFGS from `start`.
///
/// The value of the result is never above that at the start.
///
/// ```
/// use gp_core::optimize::{MinimizeOptions, Objective, StopReason, minimize};
///
/// struct Valley; // Rosenbrock's function, with its minimum 0 at (1, 1)
/// impl Objective for Valley {
///     fn value_and_gradient(&mut self, z: &[f64], gradient: &mut [f64]) -> f64 {
///         let (slope, drop) = (1.0 - z[0], z[1] - z[0] * z[0]);
///         gradient[0] = -2.0 * slope - 400.0 * z[0] * drop;
///         gradient[1] = 200.0 * drop;
///         slope * slope + 100.0 * drop * drop
///     }
/// }
/// let options = MinimizeOptions {
///     gradient_tolerance: 1e-8,
///     value_tolerance: 0.0,
///     max_evaluations: 200,
///     max_recoveries: 5,
/// };
/// let minimum = minimize(&mut Valley, &[-1.2, 1.0], &options);
/// assert_eq!(minimum.stop, StopReason::GradientSmall);
/// assert!((minimum.z[0] - 1.0).abs() < 1e-7);
/// ```
/// # Source
/// Nocedal & Wright 2006, algorithm 7.5.
pub fn minimize(
    objective: &mut dyn Objective,
    start: &[f64],
    options: &MinimizeOptions,
) -> Minimum {
    let record = Rc::new(RefCell::new(Record::new(
        objective,
        options.max_evaluations,
    )));
    let is_defined = record
        .borrow_mut()
        .evaluate(start)
        .is_ok_and(f64::is_finite);
    let mut progress = Progress::default();
    let stop = if is_defined {
        search(&record, options, &mut progress)
    } else {
        StopReason::StartUndefined
    };

    let record = record.borrow();
    let (best, projected_gradient) = match &record.best {
        Some(best) => (best.clone(), record.projected_gradient(best)),
        None => (Point::undefined(start), f64::INFINITY),
    };
    Minimum {
        z: best.z,
        value: best.value,
        gradient: best.gradient,
        start_value: record.start_value.unwrap_or(f64::INFINITY),
        projected_gradient,
        iterations: progress.iterations,
        evaluations: record.evaluations,
        recoveries: progress.recoveries,
        stop,
    }
}

#[derive(Default)]
struct Progress {
    iterations: usize,
    recoveries: usize,
}

/// Rounds of L-BFGS, each from the best point so far, until one of them settles the matter.
fn search(
    record: &Rc<RefCell<Record<'_>>>,
    options: &MinimizeOptions,
    progress: &mut Progress,
) -> StopReason {
    let mut round_start = record.borrow().best_point();
    loop {
        let value_before = record.borrow().best_point().value;
        progress.iterations += lbfgs_round(record, &round_start.z, options);

        let now = record.borrow();
        let best = now.best_point();
        if now.projected_gradient(&best) <= options.gradient_tolerance {
            return StopReason::GradientSmall;
        }
        if now.objective.is_spent() {
            return StopReason::WorkLimit;
        }
        if now.is_exhausted() {
            return StopReason::EvaluationLimit;
        }
        let has_stalled = value_before - best.value <= options.value_tolerance;
        if has_stalled && progress.recoveries > 0 {
            return StopReason::ValueStalled;
        }
        if progress.recoveries == options.max_recoveries {
            return StopReason::RecoveryLimit;
        }
        progress.recoveries += 1;
        let released = now.released(&best, options.gradient_tolerance);
        drop(now);
        round_start = released
            .and_then(|z| Record::point_at(record, &z))
            .unwrap_or(best);
    }
}

/// One run of argmin's L-BFGS without history; returns its iterations.
fn lbfgs_round(
    record: &Rc<RefCell<Record<'_>>>,
    start: &[f64],
    options: &MinimizeOptions,
) -> usize {
    let history = if start.len() > FEW {
        LONG_HISTORY
    } else {
        HISTORY
    };
    let solver = LBFGS::new(StrongWolfe::default(), history)
        .with_tolerance_grad(options.gradient_tolerance)
        .and_then(|solver| solver.with_tolerance_cost(options.value_tolerance));
    let Ok(solver) = solver else {
        // Only negative tolerances get here; they ask for a search without end.
        return 0;
    };
    // argmin calls a start whose value is given a stall, as its value does not
    // change on initialisation; left to ask, it gets the value from memory.
    let outcome = Executor::new(Handle(Rc::clone(record)), solver)
        .configure(|state| state.param(start.to_vec()))
        .timer(false)
        .run();
    // An error means that the evaluations ran out between two line searches;
    // the record knows, and has the best point.
    outcome.map_or(0, |result| {
        usize::try_from(result.state().get_iter()).unwrap_or(usize::MAX)
    })
}

/// A point with the value and gradient of the objective there.
#[derive(Debug, Clone)]
struct Point {
    z: Vec<f64>,
    value: f64,
    gradient: Vec<f64>,
}

impl Point {
    fn undefined(z: &[f64]) -> Self {
        Self {
            z: z.to_vec(),
            value: f64::INFINITY,
            gradient: vec![0.0; z.len()],
        }
    }
}

/// The objective with what is known of it.
struct Record<'a> {
    objective: &'a mut dyn Objective,
    recent: VecDeque<Point>,
    best: Option<Point>,
    start_value: Option<f64>,
    evaluations: usize,
    max_evaluations: usize,
}

impl<'a> Record<'a> {
    fn new(objective: &'a mut dyn Objective, max_evaluations: usize) -> Self {
        Self {
            objective,
            recent: VecDeque::with_capacity(REMEMBERED + 1),
            best: None,
            start_value: None,
            evaluations: 0,
            max_evaluations,
        }
    }

    /// Value at `z`, from memory if it is there.
    fn evaluate(&mut self, z: &[f64]) -> Result<f64, Error> {
        if let Some(point) = self.remembered(z) {
            return Ok(point.value);
        }
        if self.is_exhausted() {
            return Err(Error::msg("evaluations used up"));
        }
        self.evaluations += 1;
        let mut gradient = vec![0.0; z.len()];
        let value = self.objective.value_and_gradient(z, &mut gradient);
        let point = Point {
            z: z.to_vec(),
            value,
            gradient,
        };
        if self.is_best(&point) {
            self.start_value.get_or_insert(value);
            self.best = Some(point.clone());
        }
        self.recent.push_back(point);
        if self.recent.len() > REMEMBERED {
            self.recent.pop_front();
        }
        Ok(value)
    }

    /// Whether a point beats the best so far: by its value, or, where rounding
    /// hides the difference, by its gradient. It is never above the start.
    fn is_best(&self, point: &Point) -> bool {
        let (Some(best), Some(start_value)) = (&self.best, self.start_value) else {
            return point.value.is_finite();
        };
        let noise = VALUE_NOISE * best.value.abs();
        let is_same = (point.value - best.value).abs() <= noise && point.value <= start_value;
        if is_same {
            return largest(&point.gradient) < largest(&best.gradient);
        }
        point.value < best.value
    }

    fn remembered(&self, z: &[f64]) -> Option<&Point> {
        let same_bits = |a: &[f64]| a.iter().zip(z).all(|(a, b)| a.to_bits() == b.to_bits());
        self.recent.iter().rev().find(|point| same_bits(&point.z))
    }

    fn point_at(record: &Rc<RefCell<Self>>, z: &[f64]) -> Option<Point> {
        let mut record = record.borrow_mut();
        let value = record.evaluate(z).ok()?;
        let point = record.remembered(z).cloned();
        point.filter(|_| value.is_finite())
    }

    /// The best point; the search starts with one, so there always is.
    fn best_point(&self) -> Point {
        self.best
            .clone()
            .expect("the start was evaluated and is defined")
    }

    fn projected_gradient(&self, point: &Point) -> f64 {
        self.objective.projected_gradient(&point.z, &point.gradient)
    }

    fn released(&self, point: &Point, tolerance: f64) -> Option<Vec<f64>> {
        self.objective
            .released(&point.z, &point.gradient, tolerance)
    }

    fn is_exhausted(&self) -> bool {
        self.evaluations >= self.max_evaluations || self.objective.is_spent()
    }
}

/// What argmin gets: it may drop it without harm.
struct Handle<'a>(Rc<RefCell<Record<'a>>>);

impl CostFunction for Handle<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, z: &Vec<f64>) -> Result<f64, Error> {
        self.0.borrow_mut().evaluate(z)
    }
}

impl Gradient for Handle<'_> {
    type Param = Vec<f64>;
    type Gradient = Vec<f64>;

    fn gradient(&self, z: &Vec<f64>) -> Result<Vec<f64>, Error> {
        let mut record = self.0.borrow_mut();
        record.evaluate(z)?;
        let point = record.remembered(z);
        point
            .map(|point| point.gradient.clone())
            .ok_or_else(|| Error::msg("point forgotten"))
    }
}
