//! Licences of the dependencies against an explicit list.

use std::process::Command;

use anyhow::{Context, ensure};
use serde_json::Value;

use crate::paths::root;

/// Accepted licences, the same as in `deny.toml`.
const ACCEPTED: [&str; 10] = [
    "0BSD",
    "Apache-2.0",
    "Apache-2.0 WITH LLVM-exception",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "BSL-1.0",
    "MIT",
    "Unicode-3.0",
    "Unlicense",
    "Zlib",
];

/// Packages whose licence is not accepted.
///
/// # Errors
/// If `cargo metadata` fails or prints something else than JSON.
pub fn complaints() -> anyhow::Result<Vec<String>> {
    let metadata = metadata()?;
    let packages = metadata["packages"]
        .as_array()
        .context("no packages in cargo metadata")?;
    let refused = packages.iter().filter_map(|package| {
        let licence = package["license"].as_str().unwrap_or("none");
        let (name, version) = (&package["name"], &package["version"]);
        (!is_accepted(licence)).then(|| format!("{name} {version}: licence {licence}"))
    });
    Ok(refused.collect())
}

fn metadata() -> anyhow::Result<Value> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .args(["metadata", "--format-version=1", "--locked"])
        .current_dir(root())
        .output()
        .context("cannot start cargo")?;
    ensure!(
        output.status.success(),
        "cargo metadata: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    Ok(serde_json::from_slice(&output.stdout)?)
}

/// Whether an SPDX expression can be met with accepted licences: one of its OR parts has only accepted AND parts.
///
/// Parentheses group ORs inside an AND, as in `(MIT OR Apache-2.0) AND Unicode-3.0`.
fn is_accepted(expression: &str) -> bool {
    let expression = expression.replace('/', " OR ");
    if expression.contains('(') {
        let parts = expression.split(" AND ");
        return parts
            .map(|part| part.trim_matches(['(', ')']).to_string())
            .all(|part| is_accepted(&part));
    }
    expression.split(" OR ").any(|part| {
        part.split(" AND ")
            .all(|licence| ACCEPTED.contains(&licence.trim()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn expressions_are_read_as_spdx() {
        for good in [
            "MIT",
            "GPL-3.0 OR MIT",
            "MIT/Apache-2.0",
            "(MIT OR Apache-2.0) AND Unicode-3.0",
            "Apache-2.0 WITH LLVM-exception OR GPL-2.0",
            "MIT AND BSD-3-Clause",
        ] {
            assert!(is_accepted(good), "{good}");
        }
        for bad in [
            "GPL-3.0",
            "MIT AND GPL-3.0",
            "(MIT OR GPL-3.0) AND LGPL-2.1",
            "none",
        ] {
            assert!(!is_accepted(bad), "{bad}");
        }
    }

    #[test]
    fn the_list_is_that_of_deny_toml() {
        let deny = std::fs::read_to_string(root().join("deny.toml")).unwrap();
        let list = deny
            .split("allow = [")
            .nth(1)
            .unwrap()
            .split(']')
            .next()
            .unwrap();
        let listed: Vec<&str> = list.split('"').skip(1).step_by(2).collect();
        assert_eq!(listed, ACCEPTED);
    }
}
