//! A search that goes on where another ended, without evaluating its start again, as long as there is work left.

use std::cell::Cell;

use super::Objective;

/// A point at which value and gradient are known.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Known {
    pub z: Vec<f64>,
    pub value: f64,
    pub gradient: Vec<f64>,
}

/// A function of which one point is known, and whose search may have a limit on its work.
pub(crate) struct Resumed<'a, O> {
    objective: O,
    known: Option<Known>,
    budget: Option<(&'a Cell<f64>, f64)>,
}

impl<'a, O: Objective> Resumed<'a, O> {
    /// Without a known point, the function itself.
    pub fn new(objective: O, known: Option<Known>) -> Self {
        Self {
            objective,
            known,
            budget: None,
        }
    }

    /// The search ends when `work`, to which the function adds what it does, passes the limit.
    pub fn within(mut self, work: &'a Cell<f64>, limit: f64) -> Self {
        self.budget = Some((work, limit));
        self
    }

    /// The function itself.
    pub fn into_inner(self) -> O {
        self.objective
    }
}

impl<O: Objective> Objective for Resumed<'_, O> {
    fn value_and_gradient(&mut self, z: &[f64], gradient: &mut [f64]) -> f64 {
        let same_bits =
            |known: &Known| (known.z.iter().zip(z)).all(|(a, b)| a.to_bits() == b.to_bits());
        if let Some(known) = self.known.as_ref().filter(|known| same_bits(known)) {
            gradient.copy_from_slice(&known.gradient);
            return known.value;
        }
        self.objective.value_and_gradient(z, gradient)
    }

    fn projected_gradient(&self, z: &[f64], gradient: &[f64]) -> f64 {
        self.objective.projected_gradient(z, gradient)
    }

    fn released(&self, z: &[f64], gradient: &[f64], tolerance: f64) -> Option<Vec<f64>> {
        self.objective.released(z, gradient, tolerance)
    }

    fn is_spent(&self) -> bool {
        match self.budget {
            Some((work, limit)) => work.get() >= limit,
            None => self.objective.is_spent(),
        }
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "what is known is copied")]
mod tests {
    use super::*;

    struct Counted(usize);

    impl Objective for Counted {
        fn value_and_gradient(&mut self, z: &[f64], gradient: &mut [f64]) -> f64 {
            self.0 += 1;
            gradient[0] = 2.0 * z[0];
            z[0] * z[0]
        }
    }

    #[test]
    fn only_the_known_point_is_not_evaluated() {
        let known = Known {
            z: vec![3.0],
            value: 9.0,
            gradient: vec![6.0],
        };
        let mut resumed = Resumed::new(Counted(0), Some(known));
        let mut gradient = [0.0];
        assert_eq!(resumed.value_and_gradient(&[3.0], &mut gradient), 9.0);
        assert_eq!(gradient, [6.0]);
        assert_eq!(resumed.value_and_gradient(&[-2.0], &mut gradient), 4.0);
        assert_eq!(gradient, [-4.0]);
        assert_eq!(resumed.into_inner().0, 1);
    }
}
