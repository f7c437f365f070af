//! The figures and tables about the data: figs. 2 to 6 and tables 1 and 2, made from the simulated samples alone.
//!
//! No model is fitted for them, so they take seconds and belong to both profiles.
//!
//! # Source
//! Section 2.

pub mod fig02;
pub mod fig03;
pub mod fig04;
pub mod fig05;
pub mod fig06;
pub mod principal;
pub mod samples;
pub mod section;
pub mod table1;
pub mod table2;

use self::samples::Samples;
use self::section::Section;
use crate::error::BenchError;
use crate::section_experiment::{Kind, SectionExperiment};

/// Makes the figure or table of a name.
///
/// # Errors
/// `UnknownName` if there is none of that name; `Picture`, `Malformed` or `Decomposition` as its parts say.
pub fn make(name: &str, samples: &Samples) -> Result<Section, BenchError> {
    match name {
        "fig02" => fig02::make(samples),
        "fig03" => fig03::make(samples),
        "fig04" => fig04::make(samples),
        "fig05" => fig05::make(samples),
        "fig06" => fig06::make(samples),
        "table1" => table1::make(samples),
        "table2" => table2::make(),
        other => Err(BenchError::UnknownName {
            what: "figure about the data",
            name: other.to_string(),
            known: SectionExperiment::names(Kind::Data)?.join(", "),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_experiment_is_made_the_same_twice_and_its_pictures_name_their_axes() {
        let samples = Samples::reference().unwrap();
        for name in SectionExperiment::names(Kind::Data).unwrap() {
            let (first, second) = (
                make(&name, &samples).unwrap(),
                make(&name, &samples).unwrap(),
            );
            assert_eq!(first.files, second.files, "{name}");
            assert!(!first.findings.is_empty(), "{name}");
            let endings: Vec<&str> = first
                .files
                .iter()
                .filter_map(|(file, _)| file.rsplit('.').next())
                .collect();
            assert!(endings.contains(&"csv"), "{name}: {endings:?}");
            if name.starts_with("fig") {
                assert!(
                    endings.contains(&"svg") && endings.contains(&"png"),
                    "{name}"
                );
            }
        }
    }

    /// The characters that the embedded fonts have.
    fn embedded() -> Vec<(u32, u32)> {
        let css = include_str!("../../fonts/dejavu.css");
        let list = css.split("unicode-range: ").nth(1).unwrap();
        let list = list.split(';').next().unwrap();
        let hex = |digits: &str| u32::from_str_radix(digits, 16).unwrap();
        let ranges = list.split(", ").map(|range| {
            let range = range.trim_start_matches("U+");
            let (first, last) = range.split_once('-').unwrap_or((range, range));
            (hex(first), hex(last))
        });
        ranges.collect()
    }

    #[test]
    fn every_letter_of_the_pictures_is_in_the_embedded_fonts() {
        let samples = Samples::reference().unwrap();
        let ranges = embedded();
        let is_embedded = |c: char| {
            let code = u32::from(c);
            ranges
                .iter()
                .any(|(first, last)| (*first..=*last).contains(&code))
        };
        for name in ["fig02", "fig03", "fig04", "fig05", "fig06"] {
            let section = make(name, &samples).unwrap();
            let svg = section
                .files
                .iter()
                .find(|(file, _)| *file == format!("{name}.svg"))
                .unwrap();
            let svg = String::from_utf8(svg.1.clone()).unwrap();
            let missing: Vec<char> = svg
                .chars()
                .filter(|c| !is_embedded(*c) && *c != '\n')
                .collect();
            assert!(missing.is_empty(), "{name}: {missing:?}");
        }
    }

    #[test]
    fn an_unknown_name_is_refused_with_the_known_ones() {
        let samples = Samples::reference().unwrap();
        let error = make("fig09", &samples).unwrap_err().to_string();
        assert!(
            error.ends_with("known: fig02, table1, fig03, fig04, fig05, fig06, table2"),
            "{error}"
        );
    }
}
