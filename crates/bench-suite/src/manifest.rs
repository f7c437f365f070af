//! What a directory of results says about its own origin.

use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use serde::Serialize;

use crate::digest::sha256_hex;
use crate::revision;
use crate::run::Seconds;
use crate::store::{MANY_MEASURED_BY, MEASURED_BY};
use crate::tally::Tally;

/// Origin of a directory of results.
#[derive(Debug, Clone, Serialize)]
pub struct Manifest {
    /// Command that a reader can type.
    pub command: String,
    /// Git revision of the checkout, with `-dirty` when files differ from it; `unknown` outside one.
    pub revision: String,
    /// The same when the program was compiled: at an older commit if no source has changed since.
    pub compiled_from: String,
    /// Start, UTC.
    pub started: String,
    /// SHA-256 of Cargo.lock.
    pub lock_file_sha256: String,
    /// Fingerprint of sources, data and dependencies behind the numbers of one context.
    pub measured_by: String,
    /// The same for many contexts.
    pub many_measured_by: String,
    /// Processor.
    pub cpu: String,
    /// Threads used.
    pub n_threads: usize,
    /// Seeds of all random draws.
    pub seeds: Vec<String>,
    /// Cells taken from earlier runs.
    pub n_reused: usize,
    /// Cells computed by this run.
    pub n_computed: usize,
    /// Cells that could not be computed.
    pub n_failed: usize,
    /// Cells left for another run.
    pub n_missing: usize,
    /// Where the time of this run went.
    pub seconds: Seconds,
}

impl Manifest {
    /// Manifest of a run that starts now; counts and seconds follow when it ends.
    pub fn start(command: String, n_threads: usize) -> Self {
        Self {
            command,
            revision: revision::of(Path::new(env!("CARGO_MANIFEST_DIR"))),
            compiled_from: env!("COMPILED_FROM").to_string(),
            started: utc(seconds_since_epoch()),
            lock_file_sha256: sha256_hex(include_bytes!("../../../Cargo.lock")),
            measured_by: MEASURED_BY.to_string(),
            many_measured_by: MANY_MEASURED_BY.to_string(),
            cpu: cpu(),
            n_threads: resolve_threads(n_threads),
            seeds: Vec::new(),
            n_reused: 0,
            n_computed: 0,
            n_failed: 0,
            n_missing: 0,
            seconds: Seconds::default(),
        }
    }

    /// Adds how the work went.
    pub fn count<'a>(&mut self, tallies: impl Iterator<Item = &'a Tally>) {
        for tally in tallies {
            self.n_reused += tally.n_reused;
            self.n_computed += tally.n_computed();
            self.n_failed += tally.failed.len();
            self.n_missing += tally.missing.len();
            self.seconds.data_set += tally.seconds.data_set;
            self.seconds.cells += tally.seconds.cells;
        }
    }

    /// Name of the directory: date, profile and revision.
    pub fn directory_name(&self, profile: &str) -> String {
        let date = self.started.replace(':', "");
        format!("{date}-{profile}-{}", self.revision)
    }
}

/// Threads that 0 stands for: one a core.
fn resolve_threads(n_threads: usize) -> usize {
    match n_threads {
        0 => std::thread::available_parallelism().map_or(1, std::num::NonZero::get),
        n => n,
    }
}

fn cpu() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    info.lines()
        .find_map(|line| line.strip_prefix("model name")?.split_once(": "))
        .map_or_else(
            || std::env::consts::ARCH.to_string(),
            |(_, name)| name.to_string(),
        )
}

#[expect(
    clippy::disallowed_methods,
    reason = "the date names the directory; no result depends on it"
)]
fn seconds_since_epoch() -> u64 {
    let now = SystemTime::now().duration_since(UNIX_EPOCH);
    now.map_or(0, |duration| duration.as_secs())
}

/// Seconds since 1970 as a date and time, e.g. 2008-09-01T12:30:05Z.
fn utc(seconds: u64) -> String {
    let (days, second) = (seconds / 86_400, seconds % 86_400);
    let (year, month, day) = civil_date(days);
    let (hour, minute, second) = (second / 3600, second / 60 % 60, second % 60);
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}Z")
}

/// Year, month and day of a number of days since 1970-01-01 in the Gregorian calendar.
fn civil_date(days: u64) -> (u64, u64, u64) {
    let is_leap = |y: u64| y.is_multiple_of(4) && (!y.is_multiple_of(100) || y.is_multiple_of(400));
    let (mut year, mut left) = (1970, days);
    while left >= 365 + u64::from(is_leap(year)) {
        left -= 365 + u64::from(is_leap(year));
        year += 1;
    }
    let february = 28 + u64::from(is_leap(year));
    let months = [31, february, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];
    let mut month = 1;
    for length in months {
        if left < length {
            break;
        }
        left -= length;
        month += 1;
    }
    (year, month, left + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_worked_by_hand() {
        // 2000-02-29 is day 11016: 30 years of 365, 7 leap days before 2000, 31 + 28 days of 2000.
        assert_eq!(civil_date(30 * 365 + 7 + 31 + 28), (2000, 2, 29));
        assert_eq!(civil_date(0), (1970, 1, 1));
        assert_eq!(civil_date(364), (1970, 12, 31));
        assert_eq!(utc(86_399), "1970-01-01T23:59:59Z");
    }
}
