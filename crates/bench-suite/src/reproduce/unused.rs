//! Flags that would change nothing of what was asked for are refused: their author expects something else.

use super::request::Request;
use crate::catalogue::Catalogue;
use crate::error::BenchError;

/// Checks a request against the experiments that it chose.
///
/// # Errors
/// `UnusedFlag` with the experiments that the flag concerns.
pub(super) fn check(request: &Request, chosen: &Catalogue) -> Result<(), BenchError> {
    let all = Catalogue::all()?;
    let one: Vec<String> = all.one.into_iter().map(|e| e.name).collect();
    let many: Vec<String> = all.many.into_iter().map(|e| e.name).collect();
    let both = [one.clone(), many.clone()].concat();
    let (no_one, no_many) = (chosen.one.is_empty(), chosen.many.is_empty());
    let selection = &request.selection;
    let cases = [
        ("--loads", selection.loads.is_some() && no_one, &one),
        ("--sizes", selection.sizes.is_some() && no_one, &one),
        ("--totals", selection.totals.is_some() && no_many, &many),
        ("--ranks", selection.ranks.is_some() && no_many, &many),
        ("--repeats", selection.n_more_repeats > 0 && no_many, &many),
        (
            "--joints",
            selection.joints.is_some() && no_one && no_many,
            &both,
        ),
        ("--seed", request.seed.is_some() && no_one && no_many, &both),
    ];
    match cases.into_iter().find(|(_, is_unused, _)| *is_unused) {
        Some((flag, _, concerns)) => Err(BenchError::UnusedFlag {
            flag,
            concerns: concerns.join(", "),
        }),
        None => Ok(()),
    }
}
