//! Axes of a small plot: where a number lies, which numbers get a tick, and how they are written.

/// A vertical axis.
#[derive(Debug, Clone, PartialEq)]
pub enum Axis {
    /// From 0 to `top`, a tick every `tick`.
    Linear {
        /// Upper end.
        top: f64,
        /// Distance of the ticks.
        tick: f64,
    },
    /// Whole powers of ten.
    Log {
        /// Exponent of the lower end.
        low: i32,
        /// Exponent of the upper end.
        high: i32,
    },
}

/// Place of a number on an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Height, from 0 to 1.
    pub fraction: f64,
    /// Whether the number lies above the axis, whose nominal place this is.
    pub is_above: bool,
}

/// Height at which a number above the axis is drawn.
///
/// # Source
/// Section 4.6: "If a value lies above the upper limit of the vertical range, it is given a nominal value near the upper limit."
const NOMINAL: f64 = 0.97;

impl Axis {
    /// The logarithmic axis that all values fit on; `None` without a positive one.
    pub fn log_around(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let exponents = values.into_iter().filter(|v| *v > 0.0 && v.is_finite());
        let (low, high) =
            exponents
                .map(f64::log10)
                .fold(None, |range: Option<(f64, f64)>, e| {
                    range.map_or(Some((e, e)), |(low, high)| Some((low.min(e), high.max(e))))
                })?;
        let (low, high) = (whole(low.floor()), whole(high.ceil()));
        Some(Self::Log {
            low,
            high: high.max(low + 1),
        })
    }

    /// Where a number lies.
    pub fn place(&self, value: f64) -> Place {
        let fraction = match *self {
            Self::Linear { top, .. } => value / top,
            Self::Log { low, high } => (value.log10() - f64::from(low)) / f64::from(high - low),
        };
        let is_above = fraction > 1.0 || fraction.is_nan();
        Place {
            fraction: if is_above { NOMINAL } else { fraction.max(0.0) },
            is_above,
        }
    }

    /// Heights from 0 to 1 and labels of the ticks, from below.
    pub fn ticks(&self) -> Vec<(f64, String)> {
        match *self {
            Self::Linear { top, tick } => {
                let scale = 10_f64.powi(exponent(top));
                let n = whole((top / tick).round());
                (0..=n)
                    .map(|i| {
                        let value = f64::from(i) * tick;
                        (value / top, plain(value / scale))
                    })
                    .collect()
            }
            Self::Log { low, high } => (low..=high)
                .map(|e| {
                    let fraction = f64::from(e - low) / f64::from(high - low);
                    (fraction, format!("10{}", superscript(e)))
                })
                .collect(),
        }
    }

    /// The power of ten that the labels of a linear axis leave out, as in ×10⁻⁵.
    pub fn unit(&self) -> String {
        match *self {
            Self::Linear { top, .. } => format!("×10{}", superscript(exponent(top))),
            Self::Log { .. } => String::new(),
        }
    }
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

    #[test]
    fn the_chapters_axes_read_as_printed() {
        let labels = |top, tick| {
            let axis = Axis::Linear { top, tick };
            let labels: Vec<String> = axis.ticks().into_iter().map(|(_, label)| label).collect();
            labels.join(" ") + " " + &axis.unit()
        };
        // Joint 1 and joint 3 of fig. 10; joint 5 has its unit on another power of ten in print: 0.2 … 1 ×10⁻³.
        assert_eq!(labels(5e-5, 1e-5), "0 1 2 3 4 5 ×10⁻⁵");
        assert_eq!(labels(3e-4, 5e-5), "0 0.5 1 1.5 2 2.5 3 ×10⁻⁴");
        assert_eq!(labels(1e-3, 2e-4), "0 0.2 0.4 0.6 0.8 1 ×10⁻³");
    }

    #[test]
    fn a_number_above_the_axis_gets_its_nominal_place() {
        let axis = Axis::Linear {
            top: 2e-4,
            tick: 5e-5,
        };
        assert!((axis.place(1e-4).fraction - 0.5).abs() <= f64::EPSILON);
        let above = axis.place(2.1e-4);
        assert!(above.is_above && above.fraction < 1.0);
        assert!(axis.place(f64::NAN).is_above);
    }

    #[test]
    fn a_log_axis_takes_in_all_values() {
        let axis = Axis::log_around([3e-9, 2e-5, 0.0]).unwrap();
        assert_eq!(axis, Axis::Log { low: -9, high: -4 });
        assert!((axis.place(1e-9).fraction).abs() <= 1e-12);
        assert_eq!(axis.ticks()[0].1, "10⁻⁹");
        assert_eq!(Axis::log_around([0.0]), None);
        assert_eq!(
            Axis::log_around([1e-3]),
            Some(Axis::Log { low: -3, high: -2 })
        );
    }
}
