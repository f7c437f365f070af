//! The git revision of a directory; the build script reads it too, for what the program was compiled from.

use std::path::Path;
use std::process::Command;

/// Abbreviated commit, with `-dirty` when files differ from it; `unknown` outside a checkout or without git.
pub fn of(directory: &Path) -> String {
    let git = |arguments: &[&str]| {
        let mut git = Command::new("git");
        let output = git.arg("-C").arg(directory).args(arguments).output();
        output
            .ok()
            .filter(|output| output.status.success())
            .map(|output| String::from_utf8_lossy(&output.stdout).trim().to_string())
    };
    match (
        git(&["rev-parse", "--short=10", "HEAD"]),
        git(&["status", "--porcelain"]),
    ) {
        (Some(revision), Some(changes)) if changes.is_empty() => revision,
        (Some(revision), _) => format!("{revision}-dirty"),
        (None, _) => "unknown".to_string(),
    }
}
