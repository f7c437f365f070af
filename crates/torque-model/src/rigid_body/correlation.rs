//! Rows of a log that tell as much as one independent row.

use linalg::sums::dot;

/// Least autocorrelation that counts.
const LEAST: f64 = 0.03;
/// Longest lag, s, and in rows where there is no time.
const LONGEST_SECONDS: f64 = 1.8;
const LONGEST_ROWS: usize = 60;
/// Rows that tell as much as one at least: those of so many seconds, or so many where there is no time.
pub const LEAST_SECONDS: f64 = 0.3;
const LEAST_ROWS: f64 = 10.0;
/// Rows of a run that it takes to judge by it.
pub(crate) const ENOUGH_ROWS: usize = 50;

/// Standardised residuals of one run, zero at rows that do not count.
#[derive(Debug, Clone, Copy)]
pub struct RunRows<'a> {
    /// e/(σ h), (n,).
    pub residuals: &'a [f64],
    /// Whether a row counts, (n,).
    pub used: &'a [bool],
    /// Median step of the run, s.
    pub step: Option<f64>,
}

/// c of one run: one and twice the sum of the autocorrelations of its residuals.
///
/// ```text
/// c = 1 + 2 Σ_l min(ρ_l, 1),   ρ_l = mean_P u_t u_{t+l} / mean u²
/// ```
/// P are the pairs of rows l apart that both count. The sum ends before the first ρ below 0.03,
/// where fewer pairs are left than half the rows, at 1.8 s (60 rows without time) and at a quarter of the rows.
pub fn correlation_of_run(run: RunRows<'_>) -> f64 {
    let RunRows {
        residuals,
        used,
        step,
    } = run;
    let n = used.iter().filter(|used| **used).count();
    let longest = longest_lag(step);
    let power = dot(residuals, residuals) / n.max(1) as f64;
    if power <= 0.0 {
        return 1.0;
    }
    let is_whole = n == used.len();
    let mut c = 1.0;
    for lag in 1..=longest.min(n / 4) {
        let (early, late) = (used.len() - lag, lag);
        let pairs = if is_whole {
            early
        } else {
            let both = used[..early].iter().zip(&used[late..]);
            both.filter(|(a, b)| **a && **b).count()
        };
        if 2 * pairs < n {
            break;
        }
        let rho = dot(&residuals[..early], &residuals[late..]) / pairs as f64 / power;
        if rho < LEAST {
            break;
        }
        c += 2.0 * rho.min(1.0);
    }
    c
}

/// The longest lag that counts: 1.8 s in rows, or 60 rows without time.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a positive number of rows, at most that of a run"
)]
pub(crate) fn longest_lag(step: Option<f64>) -> usize {
    step.map_or(LONGEST_ROWS, |step| {
        (LONGEST_SECONDS / step + 1e-9) as usize
    })
}

/// The least c: 0.3 s in rows, ten rows where a run has no time.
pub fn least_correlation(steps: &[Option<f64>], seconds: f64) -> f64 {
    let steps: Option<Vec<f64>> = steps.iter().copied().collect();
    steps.map_or(LEAST_ROWS, |steps| (seconds / median(steps)).max(1.0))
}

/// c of a joint: the mean of those of its runs with at least 50 rows that count, by these rows, and no less than `least`.
pub fn correlation(runs: &[RunRows<'_>], least: f64) -> f64 {
    let (mut sum, mut rows) = (0.0, 0.0);
    for run in runs {
        let n = run.used.iter().filter(|used| **used).count();
        if n >= ENOUGH_ROWS {
            sum += n as f64 * correlation_of_run(*run);
            rows += n as f64;
        }
    }
    if rows > 0.0 {
        least.max(sum / rows)
    } else {
        least
    }
}

/// The median; the mean of the two in the middle of an even number. NaN of nothing.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    if n == 0 {
        return f64::NAN;
    }
    0.5 * (values[(n - 1) / 2] + values[n / 2])
}
