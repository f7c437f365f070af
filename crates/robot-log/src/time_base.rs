//! Stamps of a run made into an even time base: duplicates dropped, gaps cut, the rest interpolated.

use std::ops::Range;

use crate::error::LogError;

/// Stamps nearer to the one before than this are of the same moment, s, or a tenth of a step if that is less.
const SAME_MOMENT: f64 = 1e-5;
/// Steps, and seconds at least, after which a run is cut.
const GAP_STEPS: f64 = 5.0;
const GAP_SECONDS: f64 = 0.05;
/// Part of a step by which rounding puts stamps of an even log off.
const EVEN: f64 = 1e-8;
/// Part by which a rate is off a whole number of hertz that counts as it.
const WHOLE_HERTZ: f64 = 0.01;

/// A run's time base.
#[derive(Debug, Clone, PartialEq)]
pub struct TimeBase {
    /// s.
    pub step: f64,
    /// Rows of the run without those of a moment that was there before.
    pub rows: Vec<usize>,
    /// Stretches without a gap.
    pub stretches: Vec<Stretch>,
}

/// Rows without a gap between them.
#[derive(Debug, Clone, PartialEq)]
pub struct Stretch {
    /// Their places among [`TimeBase::rows`].
    pub places: Range<usize>,
    /// Even times, s, or `None` where the stamps are even already.
    pub grid: Option<Vec<f64>>,
}

impl TimeBase {
    /// The time base of stamps, s, at a rate that is known, Hz, or else that of their median step.
    ///
    /// # Errors
    /// [`LogError::Backwards`] for stamps that fall, with the row; [`LogError::OneMoment`] for stamps that are all equal.
    pub fn new(t: &[f64], rate: Option<f64>) -> Result<Self, LogError> {
        if let Some(row) = (1..t.len()).find(|&row| t[row] < t[row - 1]) {
            return Err(LogError::Backwards {
                row: row + 1,
                before: t[row - 1],
                after: t[row],
            });
        }
        let step = match rate {
            Some(rate) => 1.0 / rate,
            None => step_of(t).ok_or(LogError::OneMoment)?,
        };
        let rows = distinct(t, SAME_MOMENT.min(0.1 * step));
        let kept: Vec<f64> = rows.iter().map(|row| t[*row]).collect();
        let longest = (GAP_STEPS * step).max(GAP_SECONDS);
        let mut cuts = vec![0];
        cuts.extend((1..kept.len()).filter(|&at| kept[at] - kept[at - 1] > longest));
        cuts.push(kept.len());
        let stretch = |pair: &[usize]| Stretch {
            places: pair[0]..pair[1],
            grid: even_grid(&kept[pair[0]..pair[1]], step),
        };
        let stretches = cuts.windows(2).map(stretch).collect();
        Ok(Self {
            step,
            rows,
            stretches,
        })
    }

    /// Rows that are dropped since their moment was there before.
    pub fn n_duplicates(&self, n_rows: usize) -> usize {
        n_rows - self.rows.len()
    }
}

impl Stretch {
    /// Times of the even rows, s.
    ///
    /// # Shapes
    /// `t` stamps of all rows of the base.
    pub fn times<'a>(&'a self, t: &'a [f64]) -> &'a [f64] {
        self.grid.as_deref().unwrap_or(&t[self.places.clone()])
    }

    /// Values at the even times, by linear interpolation between rows.
    ///
    /// # Shapes
    /// `t` and `values` of all rows of the base.
    pub fn values(&self, t: &[f64], values: &[f64]) -> Vec<f64> {
        let (t, values) = (&t[self.places.clone()], &values[self.places.clone()]);
        let Some(grid) = &self.grid else {
            return values.to_vec();
        };
        let mut after = 1;
        let at = |time: &f64| {
            while after + 1 < t.len() && t[after] < *time {
                after += 1;
            }
            let (t0, t1) = (t[after - 1], t[after]);
            let (v0, v1) = (values[after - 1], values[after]);
            v0 + (v1 - v0) / (t1 - t0) * (time - t0)
        };
        grid.iter().map(at).collect()
    }
}

/// Median of the steps that are not zero, as that of a whole number of hertz where it nearly is one.
fn step_of(t: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> = t.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.retain(|step| *step > SAME_MOMENT);
    if steps.is_empty() {
        return None;
    }
    let middle = steps.len() / 2;
    let (_, step, _) = steps.select_nth_unstable_by(middle, f64::total_cmp);
    let rate = 1.0 / *step;
    let whole = rate.round();
    let is_whole = whole >= 1.0 && (rate - whole).abs() <= WHOLE_HERTZ * whole;
    Some(if is_whole { 1.0 / whole } else { *step })
}

/// Rows later than the one kept before them.
fn distinct(t: &[f64], same: f64) -> Vec<usize> {
    let mut rows: Vec<usize> = Vec::with_capacity(t.len());
    for (row, time) in t.iter().enumerate() {
        // Each is held against the row before it, as a burst of stamps that creep forward is one moment.
        if row == 0 || time - t[row - 1] > same {
            rows.push(row);
        }
    }
    rows
}

/// Even times from the first stamp to before the last; `None` where the stamps are these.
fn even_grid(t: &[f64], step: f64) -> Option<Vec<f64>> {
    let start = t[0];
    let is_even =
        |(row, time): (usize, &f64)| (time - start - row as f64 * step).abs() <= EVEN * step;
    if t.len() < 2 || t.iter().enumerate().all(is_even) {
        return None;
    }
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a positive number of rows; without gaps a few times that of the stamps at most"
    )]
    let n = ((t[t.len() - 1] - start) / step).ceil() as usize;
    Some((0..n).map(|row| start + row as f64 * step).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn even_stamps_stay_as_they_are() {
        let t: Vec<f64> = (0..100).map(|row| 5.0 + 0.008 * f64::from(row)).collect();
        let base = TimeBase::new(&t, None).unwrap();
        assert!((base.step - 0.008).abs() < 1e-15);
        assert_eq!(base.stretches.len(), 1);
        assert_eq!(base.stretches[0].grid, None);
        assert_eq!(base.stretches[0].times(&t), &t[..]);
    }

    #[test]
    fn stamps_that_jitter_are_interpolated_and_lines_stay_lines() {
        let t: Vec<f64> = (0..100)
            .map(|row| 0.01 * f64::from(row) + 0.002 * f64::from(row % 3))
            .collect();
        let base = TimeBase::new(&t, Some(100.0)).unwrap();
        let stretch = &base.stretches[0];
        let line: Vec<f64> = t.iter().map(|t| 3.0 - 2.0 * t).collect();
        let even = stretch.values(&t, &line);
        assert_eq!(even.len(), 99);
        for (row, value) in even.iter().enumerate() {
            assert!((value - (3.0 - 0.02 * row as f64)).abs() < 1e-12, "{row}");
        }
    }

    #[test]
    fn duplicates_are_dropped_gaps_cut_and_falling_stamps_named() {
        let base = TimeBase::new(&[0.0, 0.01, 0.01, 0.02, 0.5, 0.51], None).unwrap();
        assert_eq!(base.rows, [0, 1, 3, 4, 5]);
        let places: Vec<_> = base.stretches.iter().map(|of| of.places.clone()).collect();
        assert_eq!(places, [0..3, 3..5]);
        let error = TimeBase::new(&[0.0, 0.01, 0.005], None).unwrap_err();
        assert!(matches!(error, LogError::Backwards { row: 3, .. }));
        assert!(TimeBase::new(&[1.0, 1.0], None).is_err());
    }
}
