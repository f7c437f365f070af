//! docs/EQUATIONS.md: every equation of the chapter, the item that implements it and where it is tested.
//!
//! Items are found by the equation numbers in the `# Source` sections of the libraries' documentation. A test
//! counts if it stands beside the item, or in a file of the crate's `tests/` that is called `eq_NN.rs`, names the
//! equation, or uses the item or its module.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, ensure};

use crate::paths::{files, root, shown};

/// The chapter's equations: numbers, contents, and the reason where there is no item.
const EQUATIONS: [(u32, &str, Option<&str>); 28] = [
    (
        1,
        "torque from the Lagrangian",
        Some(
            "the recursion of Newton and Euler gives the same torques without derivatives of energies",
        ),
    ),
    (
        2,
        "torque as inertia, Coriolis, gravity and friction terms",
        None,
    ),
    (3, "posterior mean", None),
    (4, "posterior variance", None),
    (5, "smooth covariance", None),
    (6, "Coulomb covariance", None),
    (7, "full covariance", None),
    (8, "log marginal likelihood", None),
    (9, "Bayesian linear regression", None),
    (
        10,
        "torque linear in the inertial parameters of the last link",
        None,
    ),
    (11, "parameters of a context", None),
    (12, "torque linear in the parameters", None),
    (13, "parameters up to a linear map", None),
    (14, "multi-task prior", None),
    (15, "prior on the functions z", None),
    (16, "prior on the torques of all contexts", None),
    (17, "prediction for a complete block design", None),
    (18, "prediction without noise", None),
    (19, "BIC of a rank", None),
    (20, "torques from eleven known contexts", MANY),
    (21, "which context is it", None),
    (22, "starting values", None),
    (23, "likelihood of a complete block", None),
    (24, "its gradient with respect to K^ρ", None),
    (25, "K^ρ at the maximum", None),
    (26, "likelihood at the maximum", None),
    (27, "first K^ρ by expectation", None),
    (28, "first K^ρ from augmented targets", None),
];

/// Why an equation of section 4 has no item.
const MANY: Option<&str> = Some("not implemented: it needs the inertial parameters of every load");

/// Crates that implement equations; the others only call them.
const LIBRARIES: [&str; 4] = ["puma-dyn", "kernels", "gp-core", "mtgp"];

/// Where an equation is implemented and tested, both as paths from the root.
#[derive(Debug, Default, Clone, PartialEq, Eq)]
struct Places {
    items: Vec<String>,
    tests: Vec<String>,
}

/// A file of a library.
struct SourceFile {
    name: String,
    stem: String,
    text: String,
}

/// Writes docs/EQUATIONS.md, or with `check` only compares it.
///
/// # Errors
/// If an equation has neither item nor reason, an item without a test, or an item in spite of a reason;
/// with `check`, also if the file differs.
#[expect(clippy::print_stdout, reason = "the result is what the command is for")]
pub fn run(check: bool) -> anyhow::Result<ExitCode> {
    let places = places()?;
    let gaps = gaps(&places);
    ensure!(gaps.is_empty(), "{}", gaps.join("\n"));
    let (path, text) = (root().join("docs/EQUATIONS.md"), page(&places));
    if check {
        let present = std::fs::read_to_string(&path).context("docs/EQUATIONS.md")?;
        ensure!(
            present == text,
            "docs/EQUATIONS.md is out of date: run `cargo xtask equations`"
        );
        println!("docs/EQUATIONS.md is up to date");
    } else {
        std::fs::write(&path, text)?;
        println!("docs/EQUATIONS.md written");
    }
    Ok(ExitCode::SUCCESS)
}

fn places() -> anyhow::Result<BTreeMap<u32, Places>> {
    let mut places = BTreeMap::new();
    for library in LIBRARIES {
        let directory = root().join("crates").join(library);
        let sources = read(&directory.join("src"))?;
        let tests = directory.join("tests");
        let tests = if tests.is_dir() {
            read(&tests)?
        } else {
            Vec::new()
        };
        add_places(&sources, &tests, &mut places);
    }
    Ok(places)
}

fn read(directory: &Path) -> anyhow::Result<Vec<SourceFile>> {
    let file = |path: PathBuf| {
        Ok(SourceFile {
            name: shown(&path),
            stem: path
                .file_stem()
                .unwrap_or_default()
                .to_string_lossy()
                .to_string(),
            text: std::fs::read_to_string(&path)?,
        })
    };
    files(directory, &["rs"])?.into_iter().map(file).collect()
}

fn add_places(files: &[SourceFile], tests: &[SourceFile], places: &mut BTreeMap<u32, Places>) {
    for file in files {
        for (number, item) in sources(&file.text) {
            let place = places.entry(number).or_default();
            push(&mut place.items, &format!("{}: {item}", file.name));
            if file.text.contains("#[cfg(test)]") {
                push(&mut place.tests, &file.name);
            }
            let is_about = |test: &&SourceFile| {
                tested(test).contains(&number)
                    || uses(&test.text, &item)
                    || uses(&test.text, &file.stem)
            };
            for test in tests.iter().filter(is_about) {
                push(&mut place.tests, &test.name);
            }
        }
    }
}

/// Whether a text contains a name as a whole identifier.
fn uses(text: &str, name: &str) -> bool {
    let is_identifier = |c: char| c.is_alphanumeric() || c == '_';
    text.split(|c| !is_identifier(c)).any(|word| word == name)
}

fn push(list: &mut Vec<String>, entry: &str) {
    if !list.iter().any(|present| present == entry) {
        list.push(entry.to_string());
    }
}

/// Equations that a test file is about: the number in `eq_NN.rs`, and those its text names.
fn tested(file: &SourceFile) -> Vec<u32> {
    let by_name: Option<u32> = file.stem.strip_prefix("eq_").and_then(|n| n.parse().ok());
    let mut numbers = numbers(&file.text);
    numbers.extend(by_name);
    numbers
}

/// (equation, item) for every equation number in a `# Source` section.
fn sources(text: &str) -> Vec<(u32, String)> {
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    let mut found = Vec::new();
    for (i, line) in lines.iter().enumerate() {
        let Some(marker) = ["///", "//!"]
            .into_iter()
            .find(|m| *line == format!("{m} # Source"))
        else {
            continue;
        };
        let section: Vec<&str> = lines[i + 1..]
            .iter()
            .map_while(|line| line.strip_prefix(marker))
            .take_while(|line| !line.trim().is_empty() && !line.starts_with(" #"))
            .collect();
        let item = match marker {
            "///" => item_after(&lines[i..]),
            _ => "the module".to_string(),
        };
        found.extend(
            numbers(&section.join(" "))
                .into_iter()
                .map(|n| (n, item.clone())),
        );
    }
    found
}

/// Name of the first item after a documentation comment.
fn item_after(lines: &[&str]) -> String {
    let is_code =
        |line: &&&str| !line.starts_with("//") && !line.starts_with("#[") && !line.is_empty();
    let declaration = lines.iter().find(is_code).copied().unwrap_or_default();
    let keywords = [
        "fn", "struct", "enum", "trait", "const", "static", "type", "impl", "mod",
    ];
    let mut words = declaration
        .split([' ', '(', '<', ':', '{'])
        .filter(|word| !word.is_empty());
    let is_keyword = |word: &str| keywords.contains(&word);
    match words.by_ref().find(|word| is_keyword(word)) {
        // `const fn name`: the name follows the last keyword.
        Some(_) => words
            .find(|word| !is_keyword(word))
            .unwrap_or_default()
            .to_string(),
        None => declaration
            .split([' ', '(', ','])
            .next()
            .unwrap_or_default()
            .to_string(),
    }
}

/// Equation numbers of a text: "eq. (8)", "eqs. (3)–(4)", "eqs. (5), (7) and (22)".
fn numbers(text: &str) -> Vec<u32> {
    let mut found: Vec<u32> = Vec::new();
    let lower = text.to_lowercase();
    for start in ["eq. ", "eqs. "]
        .iter()
        .flat_map(|word| lower.match_indices(word))
    {
        let mut rest = &lower[start.0 + start.1.len()..];
        let mut is_range = false;
        while let Some((number, after)) = parenthesised(rest) {
            let previous = found.last().copied();
            match previous.filter(|_| is_range) {
                Some(first) => found.extend(first + 1..=number),
                None => found.push(number),
            }
            let Some((separator, next)) = separated(after) else {
                break;
            };
            is_range = separator == "–";
            rest = next;
        }
    }
    found.sort_unstable();
    found.dedup();
    found
}

/// The number of "(8)…" and what follows it.
fn parenthesised(text: &str) -> Option<(u32, &str)> {
    let (number, rest) = text.strip_prefix('(')?.split_once(')')?;
    Some((number.parse().ok()?, rest))
}

/// A separator of a list of equations and what follows it.
fn separated(text: &str) -> Option<(&'static str, &str)> {
    let separators = ["–", ", ", " and "];
    separators
        .into_iter()
        .find_map(|s| Some((s, text.strip_prefix(s)?)))
}

fn gaps(places: &BTreeMap<u32, Places>) -> Vec<String> {
    let judge = |(number, _, reason): &(u32, &str, Option<&str>)| {
        let place = places.get(number).cloned().unwrap_or_default();
        match (place.items.is_empty(), place.tests.is_empty(), reason) {
            (true, _, None) => Some(format!("eq. ({number}): no `# Source` section names it")),
            (false, true, _) => Some(format!(
                "eq. ({number}): no test in or for {}",
                place.items.join(", ")
            )),
            (false, _, Some(_)) => Some(format!(
                "eq. ({number}): implemented, remove the reason from equations.rs"
            )),
            _ => None,
        }
    };
    EQUATIONS.iter().filter_map(judge).collect()
}

fn page(places: &BTreeMap<u32, Places>) -> String {
    let mut page = String::from(
        "# The chapter's equations in the code\n\n\
         Generated by `cargo xtask equations`; do not edit.\n\n\
         | eq. | what | where | tested in |\n| ---: | --- | --- | --- |\n",
    );
    for (number, what, reason) in EQUATIONS {
        let place = places.get(&number).cloned().unwrap_or_default();
        let items = match reason {
            Some(reason) => reason.to_string(),
            None => place.items.join("<br>"),
        };
        let tests = if reason.is_some() {
            String::new()
        } else {
            place.tests.join("<br>")
        };
        let row = format!("| ({number}) | {what} | {items} | {tests} |\n");
        page.push_str(&row);
    }
    page
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_in_all_their_forms() {
        assert_eq!(numbers("Eq. (8); Rasmussen 2006, eq. (2.25)."), [8]);
        assert_eq!(
            numbers("eqs. (3)–(4) and (22); eqs. (5), (7)"),
            [3, 4, 5, 7, 22]
        );
        assert_eq!(numbers("Sec. 3.4, table 3"), Vec::<u32>::new());
    }

    #[test]
    fn a_source_section_belongs_to_the_next_item() {
        let text = "/// Sum.\n/// # Source\n/// Eq. (5),\n/// and eq. (6).\n/// # Panics\n/// Eq. (9).\n#[must_use]\npub const fn sum(a: f64) {}\n";
        assert_eq!(
            sources(text),
            [(5, "sum".to_string()), (6, "sum".to_string())]
        );
        assert_eq!(
            sources("//! # Source\n//! Eq. (7).\n"),
            [(7, "the module".to_string())]
        );
    }

    #[test]
    fn gaps_are_named() {
        let place = |items: &[&str], tests: &[&str]| Places {
            items: items.iter().map(ToString::to_string).collect(),
            tests: tests.iter().map(ToString::to_string).collect(),
        };
        let mut places: BTreeMap<u32, Places> =
            (1..=28).map(|n| (n, place(&["a"], &["t"]))).collect();
        places.insert(5, place(&[], &[]));
        places.insert(6, place(&["b"], &[]));
        let found = gaps(&places);
        assert!(
            found.contains(&"eq. (5): no `# Source` section names it".to_string()),
            "{found:?}"
        );
        assert!(
            found.contains(&"eq. (6): no test in or for b".to_string()),
            "{found:?}"
        );
        assert!(
            found
                .iter()
                .any(|gap| gap.starts_with("eq. (20): implemented")),
            "{found:?}"
        );
    }
}
