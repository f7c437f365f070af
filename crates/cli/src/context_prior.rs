//! Weights of contexts before any data, as they are typed.

use std::str::FromStr;

use mtgp::context::ContextPrior;

use crate::error::CliError;
use crate::row_contexts::number_in;

/// `c1=2,c2=1`.
#[derive(Clone, Debug, PartialEq)]
pub struct PriorArg(Vec<(String, f64)>);

impl FromStr for PriorArg {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let weight = |part: &str| {
            let wrong = || format!("`{part}` is not NAME=WEIGHT with a weight from 0");
            let (name, weight) = part.rsplit_once('=').ok_or_else(wrong)?;
            let weight: f64 = weight.trim().parse().map_err(|_| wrong())?;
            if name.trim().is_empty() || !(weight >= 0.0 && weight.is_finite()) {
                return Err(wrong());
            }
            Ok((name.trim().to_owned(), weight))
        };
        text.split(',')
            .map(weight)
            .collect::<Result<_, _>>()
            .map(Self)
    }
}

impl PriorArg {
    /// The prior over a model's contexts; `whose` names it in messages.
    ///
    /// # Errors
    /// A context that the model does not have or that is named twice, or no weight above zero.
    pub fn of(&self, contexts: &[String], whose: &str) -> Result<ContextPrior, CliError> {
        let mut weights: Vec<Option<f64>> = vec![None; contexts.len()];
        for (name, weight) in &self.0 {
            let number = number_in("--prior", name, contexts, whose)?;
            if weights[number].replace(*weight).is_some() {
                return Err(CliError::Usage(format!("--prior: `{name}` appears twice")));
            }
        }
        let weights: Vec<f64> = weights.into_iter().map(Option::unwrap_or_default).collect();
        ContextPrior::from_weights(&weights)
            .map_err(|_| CliError::Usage("--prior: no weight is above zero".to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_read_and_wrong_ones_refused() {
        let read: PriorArg = "c1=2, a=b=0.5".parse().unwrap();
        assert_eq!(read.0, [("c1".to_owned(), 2.0), ("a=b".to_owned(), 0.5)]);
        for wrong in ["", "c1", "c1=x", "c1=-1", "=1", "c1=inf", "c1=NaN", "c1=1,"] {
            assert!(wrong.parse::<PriorArg>().is_err(), "{wrong}");
        }
    }
}
