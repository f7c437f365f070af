//! How well one of our numbers agrees with a published one.

/// Largest ratio that one significant figure of the published value leaves open.
const AGREES_BELOW: f64 = 1.5;
/// Smallest such ratio.
const AGREES_ABOVE: f64 = 0.7;
/// Ratio from which a number is far from the published one.
const FAR: f64 = 3.0;

/// Place of a ratio of errors, ours divided by the published one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Agreement {
    /// Below 0.7: ours is more accurate.
    Lower,
    /// 0.7 to 1.5: the same within the figure that is printed.
    Same,
    /// 1.5 to 3: the published value is more accurate.
    Higher,
    /// Above 3, or not a number.
    FarHigher,
}

impl Agreement {
    /// All, ascending in the ratio.
    pub const ALL: [Self; 4] = [Self::Lower, Self::Same, Self::Higher, Self::FarHigher];

    /// Where a ratio belongs.
    pub fn of(ratio: f64) -> Self {
        match ratio {
            r if r < AGREES_ABOVE => Self::Lower,
            r if r <= AGREES_BELOW => Self::Same,
            r if r <= FAR => Self::Higher,
            _ => Self::FarHigher,
        }
    }

    /// Whether ours and the published value differ by more than its one figure says.
    pub fn is_difference(self) -> bool {
        self != Self::Same
    }

    /// Where it lies.
    pub fn range(self) -> &'static str {
        match self {
            Self::Lower => "below 0.7",
            Self::Same => "from 0.7 to 1.5",
            Self::Higher => "from 1.5 to 3",
            Self::FarHigher => "above 3",
        }
    }

    /// What it says.
    pub fn meaning(self) -> &'static str {
        match self {
            Self::Lower => "ours is more accurate",
            Self::Same => "the same, as far as one published figure goes",
            Self::Higher => "the published value is more accurate",
            Self::FarHigher => "the published value is far more accurate",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Agreement::{self, FarHigher, Higher, Lower, Same};

    #[test]
    fn the_limits_belong_to_agreement() {
        let of = [0.69, 0.7, 1.5, 1.51, 3.0, 3.01, f64::NAN].map(Agreement::of);
        let expected = [Lower, Same, Same, Higher, Higher, FarHigher, FarHigher];
        assert_eq!(of, expected);
    }
}
