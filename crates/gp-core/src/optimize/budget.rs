//! A limit on the work of a search, counted by whoever does it.

use std::cell::Cell;

use super::Objective;

/// A function whose search ends when a counter of work passes its limit.
pub(crate) struct Budgeted<'a, O> {
    objective: O,
    work: &'a Cell<f64>,
    limit: f64,
}

impl<'a, O: Objective> Budgeted<'a, O> {
    /// `objective` adds what it does to `work`.
    pub fn new(objective: O, work: &'a Cell<f64>, limit: f64) -> Self {
        Self {
            objective,
            work,
            limit,
        }
    }

    /// The function without its limit.
    pub fn into_inner(self) -> O {
        self.objective
    }
}

impl<O: Objective> Objective for Budgeted<'_, O> {
    fn value_and_gradient(&mut self, z: &[f64], gradient: &mut [f64]) -> f64 {
        self.objective.value_and_gradient(z, gradient)
    }

    fn projected_gradient(&self, z: &[f64], gradient: &[f64]) -> f64 {
        self.objective.projected_gradient(z, gradient)
    }

    fn released(&self, z: &[f64], gradient: &[f64], tolerance: f64) -> Option<Vec<f64>> {
        self.objective.released(z, gradient, tolerance)
    }

    fn is_spent(&self) -> bool {
        self.work.get() >= self.limit
    }
}
