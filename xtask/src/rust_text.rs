//! Checks of one Rust file's text.

/// Longest accepted file, in lines: one concept is better whole in one file than cut by its length into
/// files that use each other.
const MAX_LINES: usize = 700;
/// How a file may open: with a sentence, or with the crate's README as its documentation.
const OPENINGS: [&str; 2] = ["//! ", "#![doc = include_str!"];
/// Module names that say nothing about their contents.
const EMPTY_NAMES: [&str; 4] = ["utils", "helpers", "common", "misc"];

/// What is wrong with a file, one sentence each with its line where there is one.
///
/// `name` is the file's name without directory and extension.
pub fn complaints(name: &str, text: &str) -> Vec<String> {
    let mut found = Vec::new();
    if EMPTY_NAMES.contains(&name) {
        found.push(format!("the module name `{name}` names no concept"));
    }
    if !OPENINGS.iter().any(|opening| text.starts_with(opening)) {
        found.push("1: does not open with a `//!` sentence".to_string());
    }
    let n_lines = text.lines().count();
    if n_lines > MAX_LINES {
        found.push(format!("{n_lines} lines, more than {MAX_LINES}: split it"));
    }
    for (i, line) in text.lines().enumerate() {
        found.extend(line_complaint(line).map(|what| format!("{}: {what}", i + 1)));
    }
    found.extend(empty_tests(text));
    found
}

fn line_complaint(line: &str) -> Option<&'static str> {
    let code = line.trim_start();
    if line.ends_with([' ', '\t']) {
        return Some("trailing blank");
    }
    if code.starts_with("#[ignore]") {
        return Some("#[ignore] without a reason");
    }
    None
}

/// Tests whose body is empty: they cannot fail.
fn empty_tests(text: &str) -> Vec<String> {
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    let is_empty_test = |pair: &[&str]| {
        pair[0] == "#[test]" && pair[1].starts_with("fn ") && pair[1].ends_with("{}")
    };
    let pairs = lines.windows(2).enumerate();
    pairs
        .filter(|(_, pair)| is_empty_test(pair))
        .map(|(i, _)| format!("{}: a test without a body", i + 2))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clean_file_has_no_complaint() {
        let text = "//! A module.\n\n#[ignore = \"slow\"]\nfn f() {}\n";
        assert_eq!(complaints("rnea", text), Vec::<String>::new());
    }

    #[test]
    fn each_fault_is_found_with_its_line() {
        let ignored = ["#[ign", "ore]"].concat();
        let text = format!("use a;\nfn f() {{ }} \n{ignored}\n#[test]\nfn g() {{}}\n");
        assert_eq!(
            complaints("utils", &text),
            [
                "the module name `utils` names no concept",
                "1: does not open with a `//!` sentence",
                "2: trailing blank",
                "3: #[ignore] without a reason",
                "5: a test without a body",
            ]
        );
        assert_eq!(
            complaints("a", &("//! a\n".to_string() + &"\n".repeat(MAX_LINES))).len(),
            1
        );
    }
}
