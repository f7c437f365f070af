//! The experiments by name: those with one context and those with many.

use crate::error::BenchError;
use crate::multi::spec::MultiExperiment;
use crate::spec::Experiment;

/// Experiments, each kind in the order of the chapter.
#[derive(Debug, Clone, PartialEq)]
pub struct Catalogue {
    /// Section 3.4.
    pub one: Vec<Experiment>,
    /// Section 4.6.
    pub many: Vec<MultiExperiment>,
}

impl Catalogue {
    /// Every experiment there is.
    ///
    /// # Errors
    /// `Experiment` if a description does not follow the format.
    pub fn all() -> Result<Self, BenchError> {
        Ok(Self {
            one: Experiment::all()?,
            many: MultiExperiment::all()?,
        })
    }

    /// The experiments named, or all of them when no name is given.
    ///
    /// # Errors
    /// `UnknownName` if one does not exist; `Experiment` as in [`Self::all`].
    pub fn named(names: &[String]) -> Result<Self, BenchError> {
        let mut catalogue = Self::all()?;
        let known = catalogue.names();
        if let Some(name) = names.iter().find(|name| !known.contains(name)) {
            return Err(BenchError::UnknownName {
                what: "experiment",
                name: name.clone(),
                known: known.join(", "),
            });
        }
        let is_chosen = |name: &String| names.is_empty() || names.contains(name);
        catalogue
            .one
            .retain(|experiment| is_chosen(&experiment.name));
        catalogue
            .many
            .retain(|experiment| is_chosen(&experiment.name));
        Ok(catalogue)
    }

    fn names(&self) -> Vec<String> {
        let one = self.one.iter().map(|experiment| &experiment.name);
        let many = self.many.iter().map(|experiment| &experiment.name);
        one.chain(many).cloned().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_choose_among_both_kinds() {
        let catalogue = Catalogue::named(&["fig11".into(), "table3".into()]).unwrap();
        assert_eq!(catalogue.names(), ["table3", "fig11"]);
        let error = Catalogue::named(&["fig70".into()]).unwrap_err();
        assert_eq!(
            error.to_string(),
            "unknown experiment \"fig70\"; known: table3, fig07, fig08, fig10, fig11"
        );
    }
}
