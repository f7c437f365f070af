//! What is decided about following a load beforehand.

/// How a load is followed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OnlineSettings {
    /// Seconds after which a row tells of the load e times less; `None`: all rows of a stretch count alike.
    pub forgetting: Option<f64>,
    /// Log evidence by which a load that began later must win before it takes the place of the present one, nat.
    pub margin: f64,
    /// Seconds after which the two stretches that wait for a change begin anew.
    pub windows: [f64; 2],
    /// Part of the variance of a measurement that may be left out of what the arm's parameters are uncertain by.
    pub left_out: f64,
}

impl Default for OnlineSettings {
    /// 10 s, 10 nats, windows of 0.25 s for what is heavy and 2 s for what is not, a hundredth.
    fn default() -> Self {
        Self {
            forgetting: Some(10.0),
            margin: 10.0,
            windows: [0.25, 2.0],
            left_out: 0.01,
        }
    }
}

impl OnlineSettings {
    /// Every row counts alike and the load never changes: what [`crate::rigid_body::ParameterPosterior::given`] has.
    #[must_use]
    pub fn one_load() -> Self {
        Self {
            forgetting: None,
            margin: f64::INFINITY,
            left_out: 0.0,
            ..Self::default()
        }
    }

    /// What is wrong with the numbers, if anything.
    pub(super) fn fault(&self) -> Option<String> {
        let is_positive = |value: f64| value > 0.0;
        let numbers = [
            ("forgetting, s,", self.forgetting.unwrap_or(1.0)),
            ("margin, nat,", self.margin),
            ("first window, s,", self.windows[0]),
            ("second window, s,", self.windows[1]),
        ];
        let (what, value) = numbers
            .into_iter()
            .find(|(_, value)| !is_positive(*value))?;
        Some(format!("{what} is {value}, not above 0"))
    }
}
