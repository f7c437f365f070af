//! Evaluations on request, a line in, a line out.

use std::collections::BTreeMap;
use std::io::{BufRead, Write};

use anyhow::{Context, Result, bail};

use crate::contestant::Contestant;
use crate::data::Samples;
use crate::hyperparameters::Hyperparameters;
use crate::{ours, theirs};

/// Answers requests until there are no more.
pub fn serve(samples: &Samples, hyperparameters: &Hyperparameters) -> Result<()> {
    let mut contestants: BTreeMap<String, Box<dyn Contestant + '_>> = BTreeMap::new();
    for line in std::io::stdin().lock().lines() {
        let line = line?;
        let (name, shift) = line.rsplit_once(' ').context("CONTESTANT SHIFT expected")?;
        let at = hyperparameters.shifted(shift.parse()?);
        if !contestants.contains_key(name) {
            contestants.insert(name.to_owned(), contestant(name, samples, &at)?);
        }
        let contestant = contestants.get_mut(name).context("just inserted")?;
        let answer = contestant.evaluate(&at)?;
        let mut out = std::io::stdout().lock();
        serde_json::to_writer(&mut out, &answer)?;
        writeln!(out)?;
        out.flush()?;
    }
    Ok(())
}

/// `dense`, `certified BOUND`, `warm BOUND` or `gprx`.
fn contestant<'a>(
    name: &str,
    samples: &'a Samples,
    at: &Hyperparameters,
) -> Result<Box<dyn Contestant + 'a>> {
    Ok(match name.split_whitespace().collect::<Vec<_>>()[..] {
        ["dense"] => Box::new(ours::Ours::dense(samples)),
        ["certified", bound] => Box::new(ours::Ours::certified(samples, bound.parse()?)),
        ["warm", bound] => Box::new(ours::Ours::warm(samples, bound.parse()?)),
        ["gprx"] => Box::new(theirs::Gprx::new(samples, at)?),
        _ => bail!("no contestant `{name}`"),
    })
}
