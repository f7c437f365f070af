//! A line search for the strong Wolfe conditions that survives undefined points.
//!
//! ```text
//! φ(α) = f(z + αd)
//! φ(α) ≤ φ(0) + c₁ α φ′(0)          sufficient decrease, c₁ = 10⁻⁴
//! |φ′(α)| ≤ c₂ |φ′(0)|              curvature, c₂ = 0.9
//! ```
//! It brackets, then narrows the bracket by safeguarded quadratic interpolation.
//! A point where f is not finite counts as too far.
//! Source: Nocedal & Wright 2006, algorithms 3.5 and 3.6.

use argmin::core::{
    CostFunction, Error, Gradient, IterState, KV, LineSearch, Problem, Solver, State,
    TerminationReason,
};

/// Sufficient-decrease constant c₁. Source: Nocedal & Wright 2006, p. 33.
const SUFFICIENT_DECREASE: f64 = 1e-4;

/// Curvature constant c₂ for quasi-Newton directions. Source: Nocedal & Wright 2006, p. 34.
const CURVATURE: f64 = 0.9;

/// Rounding error that is granted to a value of f, relative to it.
///
/// Near a minimum f changes by less than it is rounded, while its slope is still
/// known; without the grant a search ends there by failure.
pub(super) const VALUE_NOISE: f64 = 1e-13;

/// Evaluations after which the best point so far is taken, or the search fails.
const MAX_TRIALS: usize = 20;

/// Largest change of one coordinate in the first trial, and in the whole search.
///
/// Coordinates are logarithms of standard deviations and length scales.
const FIRST_REACH: f64 = 2.0;
const FULL_REACH: f64 = 10.0;

/// The state that argmin's L-BFGS wants from its line search.
#[derive(Debug, Clone, Default)]
pub(crate) struct StrongWolfe {
    direction: Vec<f64>,
}

/// One point on the line.
#[derive(Debug, Clone)]
struct Trial {
    step: f64,
    value: f64,
    slope: f64,
    z: Vec<f64>,
    gradient: Vec<f64>,
}

/// The bracket: `low` has the least value with sufficient decrease, `high` closes it.
struct Bracket {
    low: Trial,
    high: Option<(f64, f64)>, // step, value
}

impl LineSearch<Vec<f64>, f64> for StrongWolfe {
    fn search_direction(&mut self, direction: Vec<f64>) {
        self.direction = direction;
    }

    fn initial_step_length(&mut self, _step_length: f64) -> Result<(), Error> {
        Ok(())
    }
}

type LineState = IterState<Vec<f64>, Vec<f64>, (), (), (), f64>;

impl<O> Solver<O, LineState> for StrongWolfe
where
    O: CostFunction<Param = Vec<f64>, Output = f64>
        + Gradient<Param = Vec<f64>, Gradient = Vec<f64>>,
{
    fn name(&self) -> &'static str {
        "strong Wolfe line search"
    }

    /// The whole search is one iteration.
    fn next_iter(
        &mut self,
        problem: &mut Problem<O>,
        mut state: LineState,
    ) -> Result<(LineState, Option<KV>), Error> {
        let missing = || Error::msg("line search without a point or gradient");
        let z = state.take_param().ok_or_else(missing)?;
        let gradient = state.take_gradient().ok_or_else(missing)?;
        let start = Trial {
            step: 0.0,
            value: state.get_cost(),
            slope: inner(&gradient, &self.direction),
            z,
            gradient,
        };
        let found = self.search(problem, &start)?;
        let state = state
            .param(found.z)
            .gradient(found.gradient)
            .cost(found.value)
            .terminate_with(TerminationReason::SolverConverged);
        Ok((state, None))
    }
}

impl StrongWolfe {
    fn search<O>(&self, problem: &mut Problem<O>, start: &Trial) -> Result<Trial, Error>
    where
        O: CostFunction<Param = Vec<f64>, Output = f64>
            + Gradient<Param = Vec<f64>, Gradient = Vec<f64>>,
    {
        // The comparison fails for NaN as well.
        if !matches!(
            start.slope.partial_cmp(&0.0),
            Some(std::cmp::Ordering::Less)
        ) {
            return Err(Error::msg("search direction does not descend"));
        }
        let reach = largest(&self.direction);
        let max_step = FULL_REACH / reach;
        let mut step = self.first_step(start).min(FIRST_REACH / reach);
        let mut bracket = Bracket {
            low: start.clone(),
            high: None,
        };

        for _ in 0..MAX_TRIALS {
            let trial = self.trial(problem, start, step)?;
            let noise = VALUE_NOISE * start.value.abs();
            if !is_decrease(start, &trial, noise) || trial.value > bracket.low.value + noise {
                bracket.high = Some((trial.step, trial.value));
            } else if trial.slope.abs() <= CURVATURE * start.slope.abs() || step >= max_step {
                return Ok(trial);
            } else {
                bracket.accept(trial);
            }
            step = match bracket.high {
                None => (2.5 * step).min(max_step),
                Some(high) => interpolate(&bracket.low, high),
            };
            if bracket.is_exhausted() {
                break;
            }
        }
        if bracket.low.step > 0.0 {
            return Ok(bracket.low);
        }
        Err(Error::msg("no step decreases the function"))
    }

    /// 1 for a quasi-Newton direction, min(1, 1/|g|) for the first, which is −g.
    fn first_step(&self, start: &Trial) -> f64 {
        let is_steepest = (self.direction.iter().zip(&start.gradient))
            .all(|(d, g)| (d + g).abs() <= f64::EPSILON * g.abs());
        let norm = inner(&start.gradient, &start.gradient).sqrt();
        if is_steepest {
            norm.recip().min(1.0)
        } else {
            1.0
        }
    }

    fn trial<O>(&self, problem: &mut Problem<O>, start: &Trial, step: f64) -> Result<Trial, Error>
    where
        O: CostFunction<Param = Vec<f64>, Output = f64>
            + Gradient<Param = Vec<f64>, Gradient = Vec<f64>>,
    {
        let z: Vec<f64> = (start.z.iter().zip(&self.direction))
            .map(|(z, d)| z + step * d)
            .collect();
        let value = problem.cost(&z)?;
        let gradient = problem.gradient(&z)?;
        Ok(Trial {
            step,
            value,
            slope: inner(&gradient, &self.direction),
            z,
            gradient,
        })
    }
}

impl Bracket {
    /// Makes `trial` the low end; the old one closes the bracket if the slope turned.
    fn accept(&mut self, trial: Trial) {
        let towards_high = match self.high {
            None => 1.0,
            Some((step, _)) => step - trial.step,
        };
        if trial.slope * towards_high >= 0.0 {
            self.high = Some((self.low.step, self.low.value));
        }
        self.low = trial;
    }

    /// Whether the bracket is too narrow for another point in double precision.
    fn is_exhausted(&self) -> bool {
        self.high.is_some_and(|(step, _)| {
            let width = (step - self.low.step).abs();
            width <= 1e-12 * step.max(self.low.step)
        })
    }
}

fn is_decrease(start: &Trial, trial: &Trial, noise: f64) -> bool {
    trial.value <= start.value + SUFFICIENT_DECREASE * trial.step * start.slope + noise
}

/// Minimiser of the parabola through the low end, its slope, and the high end,
/// kept between 10 % and 90 % of the bracket; 10 % where the high end is undefined.
fn interpolate(low: &Trial, (high_step, high_value): (f64, f64)) -> f64 {
    let width = high_step - low.step;
    let curvature = high_value - low.value - low.slope * width;
    let fraction = if high_value.is_finite() && curvature > 0.0 {
        (-0.5 * low.slope * width / curvature).clamp(0.1, 0.9)
    } else if high_value.is_finite() {
        0.5
    } else {
        0.1
    };
    low.step + fraction * width
}

fn inner(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Largest absolute value.
pub(super) fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |largest, v| v.abs().max(largest))
}
