//! A linear axis: what it covers, where its ticks are, and how they are written.

/// Distances of ticks in units of a power of ten.
const STEPS: [f64; 3] = [1.0, 2.0, 5.0];
/// Number of intervals that an axis has at most.
const MOST_INTERVALS: f64 = 6.0;

/// A linear axis of a chart.
#[derive(Debug, Clone, PartialEq)]
pub struct Scale {
    /// Name and unit.
    pub label: String,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Distance of the ticks, which lie at its multiples.
    pub step: f64,
}

impl Scale {
    /// Axis between two ends, with a tick at every multiple of `step`.
    pub fn new(label: &str, (low, high): (f64, f64), step: f64) -> Self {
        Self {
            label: label.to_string(),
            low,
            high,
            step,
        }
    }

    /// Axis over the data and at least over `(low, high)`, its ends at ticks or half-way between two.
    pub fn covering(label: &str, data: (f64, f64), (low, high): (f64, f64)) -> Self {
        let (low, high) = (data.0.min(low), data.1.max(high));
        let step = step_for(high - low);
        let half = step / 2.0;
        let ends = ((low / half).floor() * half, (high / half).ceil() * half);
        Self::new(label, ends, step)
    }

    /// Axis over the data with a margin of a thirtieth; ends need not be at ticks.
    pub fn around(label: &str, data: (f64, f64)) -> Self {
        let margin = (data.1 - data.0) / 30.0;
        let ends = (data.0 - margin, data.1 + margin);
        Self::new(label, ends, step_for(ends.1 - ends.0))
    }

    /// Place of a value, 0 at the lower end and 1 at the upper.
    pub fn fraction(&self, value: f64) -> f64 {
        (value - self.low) / (self.high - self.low)
    }

    /// Value and text of each tick, ascending; a true minus sign, and as many decimals as the step has.
    pub fn ticks(&self) -> Vec<(f64, String)> {
        let (first, last) = (
            (self.low / self.step - 1e-9).ceil(),
            (self.high / self.step + 1e-9).floor(),
        );
        let decimals = decimals(self.step);
        let mut ticks = Vec::new();
        let mut i = first;
        while i <= last {
            let value = i * self.step + 0.0; // + 0.0: no negative zero
            let text = format!("{value:.decimals$}").replace('-', "−");
            ticks.push((value, text));
            i += 1.0;
        }
        ticks
    }
}

/// The smallest step 1, 2 or 5 times a power of ten with no more intervals than allowed.
fn step_for(width: f64) -> f64 {
    let rough = width / MOST_INTERVALS;
    let power = 10_f64.powf(rough.log10().floor());
    let step = STEPS.iter().map(|step| step * power);
    step.into_iter()
        .find(|step| *step >= rough * (1.0 - 1e-9))
        .unwrap_or(10.0 * power)
}

/// Decimals that a multiple of the step needs.
fn decimals(step: f64) -> usize {
    (0..6)
        .find(|&d| {
            let scaled = step * 10_f64.powi(d);
            (scaled - scaled.round()).abs() < 1e-6
        })
        .map_or(6, |d| usize::try_from(d).unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(scale: &Scale) -> String {
        let texts: Vec<String> = scale.ticks().into_iter().map(|(_, text)| text).collect();
        texts.join(" ")
    }

    #[test]
    fn the_chapters_axis_stays_when_it_covers_the_data() {
        let scale = Scale::covering("τ", (-36.6, 6.4), (-40.0, 20.0));
        assert_eq!(texts(&scale), "−40 −30 −20 −10 0 10 20");
        let scale = Scale::covering("τ", (-0.92, 0.43), (-1.5, 0.5));
        assert_eq!(texts(&scale), "−1.5 −1.0 −0.5 0.0 0.5");
    }

    #[test]
    fn an_axis_grows_beyond_the_data_by_less_than_half_a_step() {
        let scale = Scale::covering("τ", (-36.6, 12.0), (-40.0, 10.0));
        assert!((scale.low, scale.high) == (-40.0, 15.0), "{scale:?}");
        assert!((scale.fraction(scale.high) - 1.0).abs() <= f64::EPSILON);
    }

    #[test]
    fn ticks_lie_inside_and_zero_has_no_sign() {
        let scale = Scale::around("x", (-0.31, 0.33));
        assert_eq!(texts(&scale), "−0.2 0.0 0.2");
        let scale = Scale::new("x", (-0.05, 0.5), 0.5); // the first multiple inside is −0.0
        assert_eq!(texts(&scale), "0.0 0.5");
    }
}
