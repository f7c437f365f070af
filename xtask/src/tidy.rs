//! Text checks of the whole repository; `cargo test -p xtask` runs them too.

use std::path::Path;
use std::process::ExitCode;

use crate::paths::{files, root, shown};
use crate::{arrows, licences, rust_text};

/// Prints every complaint.
///
/// # Errors
/// If a file cannot be read or cargo cannot be asked for the dependencies.
#[expect(
    clippy::print_stdout,
    reason = "the complaints are what the command is for"
)]
pub fn run() -> anyhow::Result<ExitCode> {
    let complaints = complaints()?;
    for complaint in &complaints {
        println!("{complaint}");
    }
    println!("tidy: {} complaints", complaints.len());
    Ok(match complaints.as_slice() {
        [] => ExitCode::SUCCESS,
        _ => ExitCode::FAILURE,
    })
}

/// Everything that is wrong, as `path:line: what`.
fn complaints() -> anyhow::Result<Vec<String>> {
    let mut found = Vec::new();
    for path in files(root(), &["rs"])? {
        let text = std::fs::read_to_string(&path)?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        let of_file = rust_text::complaints(&name, &text);
        found.extend(
            of_file
                .into_iter()
                .map(|what| format!("{}:{what}", shown(&path))),
        );
    }
    for path in files(root(), &["md", "toml"])? {
        let text = std::fs::read_to_string(&path)?;
        found.extend(
            trailing_blanks(&text).map(|i| format!("{}:{i}: trailing blank", shown(&path))),
        );
    }
    for path in files(&root().join("fixtures"), &["csv"])? {
        found.extend(provenance_complaint(&path));
    }
    found.extend(licences::complaints()?);
    found.extend(arrows::complaints()?);
    Ok(found)
}

fn trailing_blanks(text: &str) -> impl Iterator<Item = usize> {
    let lines = text.lines().enumerate();
    lines
        .filter(|(_, line)| line.ends_with([' ', '\t']))
        .map(|(i, _)| i + 1)
}

/// What a fixture's provenance lacks: `name.toml` beside `name.csv` with a source (or the program that made the
/// numbers), a date and a licence.
fn provenance_complaint(csv: &Path) -> Option<String> {
    let toml = csv.with_extension("toml");
    let Ok(text) = std::fs::read_to_string(&toml) else {
        return Some(format!("{}: no {} beside it", shown(csv), shown(&toml)));
    };
    let has = |key: &str| {
        text.lines()
            .any(|line| line.starts_with(&format!("{key} = ")))
    };
    let missing: Vec<&str> = ["source|program", "date", "licence"]
        .into_iter()
        .filter(|keys| !keys.split('|').any(has))
        .collect();
    let keys = missing.join(", ");
    (!missing.is_empty()).then(|| format!("{}: missing {keys}", shown(&toml)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_repository_is_tidy() {
        let found = complaints().unwrap();
        assert!(found.is_empty(), "{}", found.join("\n"));
    }

    #[test]
    fn provenance_needs_its_three_keys() {
        let dir = tempfile::tempdir().unwrap();
        let csv = dir.path().join("a.csv");
        std::fs::write(&csv, "x\n").unwrap();
        assert!(provenance_complaint(&csv).unwrap().contains("no "));
        std::fs::write(csv.with_extension("toml"), "source = \"s\"\ndate = \"d\"\n").unwrap();
        assert!(
            provenance_complaint(&csv)
                .unwrap()
                .ends_with("missing licence")
        );
        std::fs::write(
            csv.with_extension("toml"),
            "source = 1\ndate = 1\nlicence = 1\n",
        )
        .unwrap();
        assert_eq!(provenance_complaint(&csv), None);
    }

    #[test]
    fn trailing_blanks_are_counted_from_one() {
        assert_eq!(trailing_blanks("a\nb \n\t\n").collect::<Vec<_>>(), [2, 3]);
    }
}
