//! An axis: where a number lies on it, and where its ticks are and how they are written.

/// Distances of ticks in units of a power of ten.
const STEPS: [f64; 3] = [1.0, 2.0, 5.0];
/// Number of intervals that a linear axis has at most.
const MOST_INTERVALS: f64 = 6.0;

/// A linear or logarithmic axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Name and unit.
    pub label: String,
    /// What the texts of the ticks leave out, as in ×10⁻⁵; empty if nothing.
    pub unit: String,
    scale: Scale,
    /// Ends; of a logarithmic axis their logarithms to base ten.
    ends: (f64, f64),
    /// Places from 0 to 1 and texts, ascending.
    ticks: Vec<(f64, String)>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Scale {
    Linear,
    Log,
}

impl Axis {
    fn new(label: &str, scale: Scale, ends: (f64, f64)) -> Self {
        Self {
            label: label.to_string(),
            unit: String::new(),
            scale,
            ends,
            ticks: Vec::new(),
        }
    }

    /// Linear axis between two ends, with a tick at every multiple of `step`: a true minus sign, and as many
    /// decimals as the step has.
    pub fn linear(label: &str, (low, high): (f64, f64), step: f64) -> Self {
        let decimals = decimals(step);
        let mut axis = Self::new(label, Scale::Linear, (low, high));
        let mut i = (low / step - 1e-9).ceil();
        while i <= (high / step + 1e-9).floor() {
            let value = i * step + 0.0; // + 0.0: no negative zero
            let text = format!("{value:.decimals$}").replace('-', "−");
            axis.ticks.push((axis.fraction(value), text));
            i += 1.0;
        }
        axis
    }

    /// Linear axis over the data and at least over `(low, high)`, its ends at ticks or half-way between two.
    pub fn covering(label: &str, data: (f64, f64), (low, high): (f64, f64)) -> Self {
        let (low, high) = (data.0.min(low), data.1.max(high));
        let step = step_for(high - low);
        let half = step / 2.0;
        let ends = ((low / half).floor() * half, (high / half).ceil() * half);
        Self::linear(label, ends, step)
    }

    /// Linear axis over the data with a margin of a thirtieth; ends need not be at ticks.
    pub fn around(label: &str, data: (f64, f64)) -> Self {
        let margin = (data.1 - data.0) / 30.0;
        let ends = (data.0 - margin, data.1 + margin);
        Self::linear(label, ends, step_for(ends.1 - ends.0))
    }

    /// Linear axis from 0 whose texts leave out the power of ten of its upper end.
    pub fn from_zero(label: &str, top: f64, step: f64) -> Self {
        let exponent = exponent(top);
        let scale = 10_f64.powi(exponent);
        let mut axis = Self::new(label, Scale::Linear, (0.0, top));
        axis.unit = format!("×10{}", superscript(exponent));
        for i in 0..=whole((top / step).round()) {
            let value = f64::from(i) * step;
            axis.ticks.push((value / top, plain(value / scale)));
        }
        axis
    }

    /// Logarithmic axis over whole powers of ten that all positive values fit on.
    pub fn decades(label: &str, values: impl IntoIterator<Item = f64>) -> Self {
        let values = values.into_iter().filter(|v| *v > 0.0 && v.is_finite());
        let logs: Vec<f64> = values.map(f64::log10).collect();
        let low = logs.iter().copied().reduce(f64::min).unwrap_or(-1.0);
        let high = logs.iter().copied().reduce(f64::max).unwrap_or(0.0);
        let (low, high) = (whole(low.floor()), whole(high.ceil()));
        let high = high.max(low + 1);
        let mut axis = Self::new(label, Scale::Log, (f64::from(low), f64::from(high)));
        for exponent in low..=high {
            let place = f64::from(exponent - low) / f64::from(high - low);
            axis.ticks
                .push((place, format!("10{}", superscript(exponent))));
        }
        axis
    }

    /// Logarithmic axis with a tick at each number and nothing beyond them.
    pub fn of_numbers(label: &str, numbers: impl IntoIterator<Item = (f64, String)>) -> Self {
        let numbers: Vec<(f64, String)> = numbers.into_iter().collect();
        let logs = || numbers.iter().map(|(number, _)| number.log10());
        let low = logs().reduce(f64::min).unwrap_or(0.0);
        let high = logs().reduce(f64::max).unwrap_or(1.0);
        let high = if high > low { high } else { low + 1.0 };
        let mut axis = Self::new(label, Scale::Log, (low, high));
        for (number, text) in numbers {
            axis.ticks.push((axis.fraction(number), text));
        }
        axis
    }

    /// The same with grid lines alone, for a panel beside one that has the texts.
    #[must_use]
    pub fn without_texts(mut self) -> Self {
        self.label.clear();
        for (_, text) in &mut self.ticks {
            text.clear();
        }
        self
    }

    /// Place of a value, 0 at the lower end and 1 at the upper.
    pub fn fraction(&self, value: f64) -> f64 {
        let (low, high) = self.ends;
        let number = match self.scale {
            Scale::Linear => value,
            Scale::Log => value.log10(),
        };
        (number - low) / (high - low)
    }

    /// Lower end.
    pub fn low(&self) -> f64 {
        match self.scale {
            Scale::Linear => self.ends.0,
            Scale::Log => 10_f64.powf(self.ends.0),
        }
    }

    /// Places from 0 to 1 and texts of the ticks, ascending.
    pub fn ticks(&self) -> impl Iterator<Item = (f64, &str)> {
        let ticks = self.ticks.iter();
        ticks.map(|(place, text)| (*place, text.as_str()))
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

/// Exponent of the leading digit; a little tolerance keeps 1e-3 from being 9.99…e-4.
fn exponent(value: f64) -> i32 {
    whole((value.log10() + 1e-9).floor())
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "exponents and counts of ticks are small"
)]
fn whole(value: f64) -> i32 {
    value as i32
}

/// One digit after the point, none if it is 0.
fn plain(value: f64) -> String {
    let text = format!("{value:.1}");
    text.strip_suffix(".0").unwrap_or(&text).to_string()
}

fn superscript(exponent: i32) -> String {
    let raised = |c: char| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        c => c
            .to_digit(10)
            .and_then(|d| char::from_u32(0x2070 + d))
            .unwrap_or(c),
    };
    exponent.to_string().chars().map(raised).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(axis: &Axis) -> String {
        let texts: Vec<&str> = axis.ticks().map(|(_, text)| text).collect();
        texts.join(" ")
    }

    #[test]
    fn the_chapters_axes_read_as_printed() {
        let labels = |top, step| {
            let axis = Axis::from_zero("nMSE", top, step);
            texts(&axis) + " " + &axis.unit
        };
        // Joint 1 and joint 3 of fig. 10; joint 5 has its unit on another power of ten in print: 0.2 … 1 ×10⁻³.
        assert_eq!(labels(5e-5, 1e-5), "0 1 2 3 4 5 ×10⁻⁵");
        assert_eq!(labels(3e-4, 5e-5), "0 0.5 1 1.5 2 2.5 3 ×10⁻⁴");
        assert_eq!(labels(1e-3, 2e-4), "0 0.2 0.4 0.6 0.8 1 ×10⁻³");
    }

    #[test]
    fn the_chapters_axis_stays_when_it_covers_the_data() {
        let axis = Axis::covering("τ", (-36.6, 6.4), (-40.0, 20.0));
        assert_eq!(texts(&axis), "−40 −30 −20 −10 0 10 20");
        let axis = Axis::covering("τ", (-0.92, 0.43), (-1.5, 0.5));
        assert_eq!(texts(&axis), "−1.5 −1.0 −0.5 0.0 0.5");
    }

    #[test]
    fn an_axis_grows_beyond_the_data_by_less_than_half_a_step() {
        let axis = Axis::covering("τ", (-36.6, 12.0), (-40.0, 10.0));
        assert!(axis.ends == (-40.0, 15.0), "{axis:?}");
        assert!((axis.fraction(15.0) - 1.0).abs() <= f64::EPSILON);
    }

    #[test]
    fn ticks_lie_inside_and_zero_has_no_sign() {
        let axis = Axis::around("x", (-0.31, 0.33));
        assert_eq!(texts(&axis), "−0.2 0.0 0.2");
        let axis = Axis::linear("x", (-0.05, 0.5), 0.5); // the first multiple inside is −0.0
        assert_eq!(texts(&axis), "0.0 0.5");
    }

    #[test]
    fn decades_take_in_all_values() {
        let axis = Axis::decades("nMSE", [3e-9, 2e-5, 0.0]);
        assert_eq!(axis.ends, (-9.0, -4.0));
        assert!(axis.fraction(1e-9).abs() <= 1e-12);
        assert_eq!(axis.ticks().next(), Some((0.0, "10⁻⁹")));
        assert_eq!(Axis::decades("", [1e-3]).ends, (-3.0, -2.0));
        assert_eq!(Axis::decades("", [0.0]).ends, (-1.0, 0.0));
    }

    #[test]
    fn numbers_lie_by_their_logarithms_and_one_alone_at_the_left() {
        let axis =
            |numbers: &[f64]| Axis::of_numbers("n", numbers.iter().map(|n| (*n, n.to_string())));
        let places: Vec<f64> = axis(&[1.0, 10.0, 100.0])
            .ticks()
            .map(|tick| tick.0)
            .collect();
        assert_eq!(places, [0.0, 0.5, 1.0]);
        assert!(axis(&[5.0]).fraction(5.0).abs() <= f64::EPSILON);
    }
}
