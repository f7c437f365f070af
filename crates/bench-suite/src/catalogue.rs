//! The experiments by name: those about the data, those with one context, those with many, and those of section 5.

use crate::error::BenchError;
use crate::multi::spec::MultiExperiment;
use crate::section_experiment::{Kind, SectionExperiment};
use crate::spec::Experiment;

/// Name that chooses all of section 5 on the command line.
pub const GROUP: &str = "section5";

/// Experiments, each kind in the order of the chapter.
#[derive(Debug, Clone, PartialEq)]
pub struct Catalogue {
    /// Section 2: no model, no profile.
    pub data: Vec<SectionExperiment>,
    /// Section 3.4.
    pub one: Vec<Experiment>,
    /// Section 4.6.
    pub many: Vec<MultiExperiment>,
    /// Section 5; `section5` names all of them.
    pub section5: Vec<SectionExperiment>,
}

impl Catalogue {
    /// Every experiment there is.
    ///
    /// # Errors
    /// `Experiment` if a description does not follow the format.
    pub fn all() -> Result<Self, BenchError> {
        Ok(Self {
            data: SectionExperiment::all(Kind::Data)?,
            one: Experiment::all()?,
            many: MultiExperiment::all()?,
            section5: SectionExperiment::all(Kind::Section5)?,
        })
    }

    /// The experiments named, or all of them when no name is given.
    ///
    /// # Errors
    /// `UnknownName` if one does not exist; `Experiment` as in [`Self::all`].
    pub fn named(names: &[String]) -> Result<Self, BenchError> {
        let mut catalogue = Self::all()?;
        let known = catalogue.names();
        if let Some(name) = (names.iter()).find(|name| !known.contains(name) && *name != GROUP) {
            return Err(BenchError::UnknownName {
                what: "experiment",
                name: name.clone(),
                known: format!("{}, {GROUP}", known.join(", ")),
            });
        }
        let is_chosen = |name: &String| names.is_empty() || names.contains(name);
        let is_group_chosen = names.iter().any(|name| name == GROUP);
        catalogue.data.retain(|one| is_chosen(&one.name));
        catalogue.one.retain(|one| is_chosen(&one.name));
        catalogue.many.retain(|one| is_chosen(&one.name));
        catalogue
            .section5
            .retain(|one| is_group_chosen || is_chosen(&one.name));
        Ok(catalogue)
    }

    /// Names of the experiments whose averages the regression check compares.
    ///
    /// # Errors
    /// As in [`Self::all`].
    pub fn scored_names() -> Result<Vec<String>, BenchError> {
        let Self { one, many, .. } = Self::all()?;
        let one = one.into_iter().map(|experiment| experiment.name);
        let many = many.into_iter().map(|experiment| experiment.name);
        Ok(one.chain(many).collect())
    }

    /// Names of all experiments.
    pub fn names(&self) -> Vec<String> {
        let data = self.data.iter().map(|experiment| &experiment.name);
        let one = self.one.iter().map(|experiment| &experiment.name);
        let many = self.many.iter().map(|experiment| &experiment.name);
        let section5 = self.section5.iter().map(|experiment| &experiment.name);
        let names = data.chain(one).chain(many).chain(section5);
        names.cloned().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_name_means_all_and_names_choose_across_the_kinds() {
        let all = Catalogue::named(&[]).unwrap();
        assert_eq!((all.data.len(), all.one.len(), all.many.len()), (7, 3, 2));
        let some = Catalogue::named(&["fig11", "fig08", "fig03"].map(String::from)).unwrap();
        assert_eq!(some.names(), ["fig03", "fig08", "fig11"]);
    }

    #[test]
    fn the_group_means_all_of_section_5() {
        let group = Catalogue::named(&["section5".to_string()]).unwrap();
        assert_eq!(
            group.names(),
            SectionExperiment::names(Kind::Section5).unwrap()
        );
    }

    #[test]
    fn unknown_names_are_refused_with_the_known_ones() {
        let error = Catalogue::named(&["fig70".to_string()]).unwrap_err();
        let known =
            "fig02, table1, fig03, fig04, fig05, fig06, table2, table3, fig07, fig08, fig10, fig11";
        let message = error.to_string();
        let expected = format!("unknown experiment \"fig70\"; known: {known}, ");
        assert!(message.starts_with(&expected), "{message}");
        assert!(message.ends_with(", section5"), "{message}");
    }
}
