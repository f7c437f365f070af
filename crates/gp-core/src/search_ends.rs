//! Of several searches, which ended highest; or why none of them has a likelihood.

use std::mem::discriminant;

use crate::error::GpError;
use crate::search::SearchEnd;

/// Index of the highest finite likelihood; the earliest of equals.
pub fn highest<C>(ends: &[SearchEnd<C>]) -> Option<usize> {
    let value = |idx: usize| ends[idx].report.log_marginal;
    (0..ends.len())
        .filter(|&idx| value(idx).is_finite())
        .reduce(|best, idx| if value(idx) > value(best) { idx } else { best })
}

/// The error of a search none of whose ends has a likelihood, with the reason if all have the same.
pub fn no_usable_start<C>(ends: &[SearchEnd<C>]) -> GpError {
    let failures: Option<Vec<&GpError>> = ends.iter().map(|end| end.failure.as_ref()).collect();
    let failures = failures.unwrap_or_default();
    let are_alike =
        (failures.windows(2)).all(|pair| discriminant(pair[0]) == discriminant(pair[1]));
    let first = failures.first().filter(|_| are_alike);
    GpError::NoUsableStart {
        n_starts: ends.len(),
        reason: first.map(|&failure| Box::new(failure.clone())),
    }
}

#[cfg(test)]
mod tests {
    use kernels::Constant;

    use super::*;
    use crate::init::StartKind;

    #[test]
    fn a_reason_is_given_where_all_starts_have_the_same() {
        let failed = |failure: GpError| {
            let mut end = SearchEnd::at(Constant::new(1.0).unwrap(), 0.1, StartKind::Given);
            end.failure = Some(failure);
            end
        };
        let not_finite = |n_samples| GpError::NonFiniteLikelihood { n_samples };
        let alike = [failed(not_finite(3)), failed(not_finite(4))];
        let (n_starts, first) = (2, Box::new(not_finite(3)));
        let expected = GpError::NoUsableStart {
            n_starts,
            reason: Some(first),
        };
        assert_eq!(no_usable_start(&alike), expected);

        let other = GpError::BadNoise { value: 0.0 };
        let unlike = [failed(not_finite(3)), failed(other)];
        let reason = None;
        let expected = GpError::NoUsableStart { n_starts, reason };
        assert_eq!(no_usable_start(&unlike), expected);
    }
}
