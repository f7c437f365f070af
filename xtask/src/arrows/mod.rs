//! Which part knows which: crates, folders and files, held against [`rules`].

mod circles;
mod imports;
mod rules;
mod source;
mod tree;

use std::collections::{BTreeMap, BTreeSet};

use anyhow::Context;

use crate::paths::root;
use imports::{Imports, arrows, imports};
use rules::{CIRCLES, MAY_USE, RULES, Rule};
use tree::Tree;

/// Every import that [`rules`] forbid, every circle of files that they do not list, and every listed one that is gone.
///
/// # Errors
/// If a file cannot be read or a module has none.
pub fn complaints() -> anyhow::Result<Vec<String>> {
    let crates = root().join("crates");
    let mut names = Vec::new();
    for entry in std::fs::read_dir(&crates)? {
        names.push(entry?.file_name().to_string_lossy().into_owned());
    }
    names.sort();
    let tree = Tree::read(&names, &|path| {
        std::fs::read_to_string(crates.join(path)).ok()
    })?;
    let imports = imports(&tree);
    let mut found = crate_complaints(&tree, MAY_USE);
    found.extend(
        RULES
            .iter()
            .flat_map(|rule| rule_complaints(&tree, &imports, rule)),
    );
    found.extend(circle_complaints(&tree, &imports, CIRCLES));
    let manifest =
        std::fs::read_to_string(root().join("xtask/Cargo.toml")).context("xtask/Cargo.toml")?;
    found.extend(runner_complaints(&manifest, &names));
    Ok(found)
}

/// Crates that use what they may not.
fn crate_complaints(tree: &Tree, may_use: &[(&str, &[&str])]) -> Vec<String> {
    let may_use: BTreeMap<&str, &[&str]> = may_use.iter().copied().collect();
    let complaint = |((from, to), files): (&(String, String), &BTreeSet<usize>)| {
        let allowed = may_use.get(from.as_str())?;
        let files: Vec<&str> = files
            .iter()
            .map(|file| tree.files[*file].path.as_str())
            .collect();
        (!allowed.contains(&to.as_str()))
            .then(|| format!("{from} must not use {to}; it is in {}", files.join(", ")))
    };
    let unknown = tree.files.iter().map(|file| file.of_crate.as_str());
    let unknown: BTreeSet<&str> = unknown.filter(|name| !may_use.contains_key(name)).collect();
    let unknown = unknown
        .into_iter()
        .map(|name| format!("xtask/src/arrows/rules.rs does not say what {name} may use"));
    arrows(tree)
        .iter()
        .filter_map(complaint)
        .chain(unknown)
        .collect()
}

/// Imports that a rule forbids.
fn rule_complaints(tree: &Tree, imports: &Imports, rule: &Rule) -> Vec<String> {
    let path = |file: usize| tree.files[file].path.as_str();
    let begins = |path: &str, with: &[&str]| with.iter().any(|start| path.starts_with(start));
    let concerns = |path: &str| {
        path.starts_with(rule.folder) && rule.endings.iter().any(|end| path.ends_with(end))
    };
    let is_forbidden = |path: &str| begins(path, rule.must_not) && !begins(path, rule.but_may);
    imports
        .iter()
        .filter(|((from, to), _)| concerns(path(*from)) && is_forbidden(path(*to)))
        .map(|((from, to), names)| {
            let (from, to, names) = (path(*from), path(*to), list(names));
            format!(
                "crates/{from} imports {names} of crates/{to}: {}",
                rule.reason
            )
        })
        .collect()
}

/// Circles that are not known, and known ones that are gone.
fn circle_complaints(tree: &Tree, imports: &Imports, known: &[&[&str]]) -> Vec<String> {
    let path = |file: usize| tree.files[file].path.as_str();
    let between: BTreeSet<(usize, usize)> = imports.keys().copied().collect();
    let circles = circles::circles(tree.files.len(), &between);
    let named = |circle: &Vec<usize>| circle.iter().map(|file| path(*file)).collect();
    let found: Vec<BTreeSet<&str>> = circles.iter().map(named).collect();
    let known: Vec<BTreeSet<&str>> = known.iter().map(|c| c.iter().copied().collect()).collect();
    let new = circles
        .iter()
        .zip(&found)
        .filter(|(_, names)| !known.contains(names));
    let new = new.map(|(circle, names)| {
        let is_inside =
            |((from, to), _): &(&(usize, usize), _)| circle.contains(from) && circle.contains(to);
        let lines = imports.iter().filter(is_inside).map(|((from, to), names)| {
            format!(
                "\n  {} imports {} of {}",
                path(*from),
                list(names),
                path(*to)
            )
        });
        format!("a circle of files: {names:?}{}", lines.collect::<String>())
    });
    let gone = known.iter().filter(|circle| !found.contains(circle));
    let gone = gone.map(|names| {
        format!("no longer a circle, so it goes from xtask/src/arrows/rules.rs: {names:?}")
    });
    new.chain(gone).collect()
}

/// Members of the workspace that the runner links.
fn runner_complaints(manifest: &str, members: &[String]) -> Vec<String> {
    let keys = manifest
        .lines()
        .filter_map(|line| line.split(['.', ' ', '=']).next());
    keys.filter(|key| members.iter().any(|member| member == key))
        .map(|key| format!("xtask/Cargo.toml: xtask links no member, but {key}"))
        .collect()
}

fn list(names: &BTreeSet<String>) -> String {
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    names.join(", ")
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    /// A workspace of these files below `crates/`.
    fn tree(files: &[(&str, &str)]) -> Tree {
        let crates: BTreeSet<&str> = files
            .iter()
            .filter_map(|(path, _)| path.split('/').next())
            .collect();
        let crates: Vec<String> = crates.into_iter().map(str::to_owned).collect();
        let read = |path: &Path| {
            let found = files.iter().find(|(file, _)| Path::new(file) == path);
            found.map(|(_, text)| (*text).to_owned())
        };
        Tree::read(&crates, &read).unwrap()
    }

    /// Every import as `from to: names`, without the directory of the crate's sources.
    fn shown(tree: &Tree) -> Vec<String> {
        let path = |file: usize| tree.files[file].path.replace("/src/", ":");
        let shown = |((from, to), names): (&(usize, usize), &BTreeSet<String>)| {
            format!("{} {}: {}", path(*from), path(*to), list(names))
        };
        let mut lines: Vec<String> = imports(tree).iter().map(shown).collect();
        lines.sort();
        lines
    }

    const LIBRARY: &[(&str, &str)] = &[
        (
            "a-b/src/lib.rs",
            "mod one;\nmod two;\npub use one::One;\npub use two::*;",
        ),
        (
            "a-b/src/one.rs",
            "pub struct One;\nuse super::two::three::Three;",
        ),
        (
            "a-b/src/two/mod.rs",
            "pub(crate) mod three;\npub use self::three::Three as Drei;",
        ),
        (
            "a-b/src/two/three.rs",
            "pub struct Three;\nfn f() { crate::One; }",
        ),
    ];

    #[test]
    fn a_name_is_of_the_file_that_defines_it_whoever_hands_it_on() {
        let mut files = LIBRARY.to_vec();
        files.push(("c/src/lib.rs", "pub use a_b::One;"));
        files.push((
            "c/src/main.rs",
            "use a_b::{Drei, One as Eins};\nfn main() { a_b::Drei::new(); std::x::y(); }",
        ));
        let expected = [
            "a-b:one.rs a-b:two/three.rs: Three",
            "a-b:two/three.rs a-b:one.rs: One",
            "c:lib.rs a-b:one.rs: One",
            "c:main.rs a-b:one.rs: Eins",
            "c:main.rs a-b:two/three.rs: Drei, new",
        ];
        assert_eq!(shown(&tree(&files)), expected);
    }

    #[test]
    fn what_is_only_handed_on_is_not_imported_and_globs_bring_in_what_is_used() {
        let tree = tree(&[
            (
                "a/src/lib.rs",
                "mod one;\nmod two;\npub use one::{f, g};\nfn h() { f(); }",
            ),
            ("a/src/one.rs", "pub fn f() {}\npub fn g() {}"),
            ("a/src/two.rs", "use super::*;\nfn i() { g(); }"),
        ]);
        assert_eq!(
            shown(&tree),
            ["a:lib.rs a:one.rs: f", "a:two.rs a:one.rs: g"]
        );
    }

    #[test]
    fn crates_use_what_is_listed_and_no_more() {
        let mut files = LIBRARY.to_vec();
        files.push(("c/src/lib.rs", "use a_b::One;"));
        let tree = tree(&files);
        assert_eq!(
            crate_complaints(&tree, &[("a-b", &[]), ("c", &["a-b"])]),
            [""; 0]
        );
        assert_eq!(
            crate_complaints(&tree, &[("a-b", &[]), ("c", &[])]),
            ["c must not use a-b; it is in c/src/lib.rs"]
        );
        let unknown = crate_complaints(&tree, &[("c", &["a-b"])]);
        assert!(
            unknown[0].ends_with("does not say what a-b may use"),
            "{unknown:?}"
        );
    }

    #[test]
    fn new_circles_and_listed_ones_that_are_gone_are_named() {
        let tree = tree(LIBRARY);
        let imports = imports(&tree);
        let circle: &[&str] = &["a-b/src/one.rs", "a-b/src/two/three.rs"];
        assert_eq!(circle_complaints(&tree, &imports, &[circle]), [""; 0]);
        let new = circle_complaints(&tree, &imports, &[]);
        assert!(
            new[0].contains("\n  a-b/src/one.rs imports Three of a-b/src/two/three.rs"),
            "{new:?}"
        );
        let gone = circle_complaints(&tree, &imports, &[circle, &["x.rs", "y.rs"]]);
        assert!(
            gone.len() == 1 && gone[0].contains("no longer a circle"),
            "{gone:?}"
        );
    }

    #[test]
    fn folders_import_what_their_rule_lets_them() {
        let tree = tree(LIBRARY);
        let rule = |but_may| Rule {
            folder: "a-b/src/two/",
            endings: &["three.rs"],
            must_not: &["a-b/"],
            but_may,
            reason: "so",
        };
        let complaints = |rule| rule_complaints(&tree, &imports(&tree), &rule);
        assert_eq!(
            complaints(rule(&[])),
            ["crates/a-b/src/two/three.rs imports One of crates/a-b/src/one.rs: so"]
        );
        assert_eq!(complaints(rule(&["a-b/src/one.rs"])), [""; 0]);
    }

    #[test]
    fn the_runner_links_no_member() {
        let members = ["a".to_owned(), "a-b".to_owned()];
        assert_eq!(
            runner_complaints("aa.workspace = true\n", &members),
            [""; 0]
        );
        for line in ["a-b.workspace = true", "a-b = { path = \"a\" }"] {
            assert_eq!(runner_complaints(line, &members).len(), 1, "{line}");
        }
    }
}
