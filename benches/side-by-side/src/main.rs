//! RNEA of the PUMA 560 by this project and by others, on the same states, in alternating rounds.
//!
//! ```text
//! cargo run --release --manifest-path benches/side-by-side/Cargo.toml
//! ```
//! Every contestant must first agree on the torques. Pinocchio takes part if `python3` (or the
//! interpreter named by the environment variable `PINOCCHIO_PYTHON`) can import its package `pin`
//! and `g++` is there; its compiled library is then called from C++, without Python in the loop.

mod ours;
mod pinocchio;
mod states;
mod theirs;

use anyhow::{Result, ensure};
use states::{N_STATES, State, states};

/// Alternating rounds; the median over them is reported, and the fastest.
const ROUNDS: usize = 1001;
/// Passes over all states in one round: a third of a millisecond, shorter than a scheduler's slice.
const PASSES: usize = 1;
/// Gravity that is built into dynibo 0.5 and cannot be changed; everybody uses it here, m/s².
const GRAVITY: f64 = 9.80665;
/// Largest disagreement of torques: 1e-12 of the largest torque among them, N·m.
const AGREEMENT: f64 = 1e-12 * 300.0;

/// One implementation of inverse dynamics.
trait Contestant {
    fn name(&self) -> &str;
    /// Whether its torques are those of the rigid body alone.
    fn is_rigid_body(&self) -> bool;
    /// Torques of every state, once.
    fn torques(&mut self) -> Result<Vec<[f64; 6]>>;
    /// Nanoseconds per call in one round.
    fn round(&mut self, passes: usize) -> Result<f64>;
}

fn main() -> Result<()> {
    let states = states();
    let mut contestants = ours::contestants(&states)?;
    contestants.push(theirs::dynibo(&states)?);
    match pinocchio::Driver::start(&states) {
        Ok(driver) => contestants.push(Box::new(driver)),
        Err(reason) => println!("pinocchio: skipped, {reason:#}"),
    }
    check_agreement(&mut contestants)?;
    let times = measure(&mut contestants)?;
    report(&contestants, &times);
    ours::time_data_set()
}

/// Compares the torques of all rigid-body contestants with the first one's.
fn check_agreement(contestants: &mut [Box<dyn Contestant + '_>]) -> Result<()> {
    let reference = contestants[0].torques()?;
    for contestant in contestants
        .iter_mut()
        .filter(|contestant| contestant.is_rigid_body())
    {
        let torques = contestant.torques()?;
        let pairs = torques.iter().flatten().zip(reference.iter().flatten());
        let worst = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        println!(
            "{:<44} largest difference {worst:.1e} N·m",
            contestant.name()
        );
        ensure!(
            worst < AGREEMENT,
            "{} disagrees by {worst} N·m",
            contestant.name()
        );
    }
    Ok(())
}

/// Nanoseconds per call of one contestant.
struct Times {
    median: f64,
    fastest: f64,
}

/// In every round each contestant has one turn.
fn measure(contestants: &mut [Box<dyn Contestant + '_>]) -> Result<Vec<Times>> {
    let mut times = vec![Vec::with_capacity(ROUNDS); contestants.len()];
    for _ in 0..ROUNDS {
        for (contestant, times) in contestants.iter_mut().zip(&mut times) {
            times.push(contestant.round(PASSES)?);
        }
    }
    Ok(times.into_iter().map(Times::new).collect())
}

impl Times {
    fn new(mut rounds: Vec<f64>) -> Self {
        rounds.sort_by(f64::total_cmp);
        Self {
            median: rounds[rounds.len() / 2],
            fastest: rounds[0],
        }
    }
}

fn report(contestants: &[Box<dyn Contestant + '_>], times: &[Times]) {
    let names = contestants.iter().map(|contestant| contestant.name());
    let dynibo = names
        .clone()
        .zip(times)
        .find(|(name, _)| name.starts_with("dynibo"));
    let dynibo = dynibo.map_or(f64::NAN, |(_, times)| times.median);
    println!(
        "\n{ROUNDS} alternating rounds of {} calls, ns per call",
        PASSES * N_STATES
    );
    println!(
        "{:<44} {:>8} {:>8} {:>8}",
        "RNEA, PUMA 560", "median", "fastest", "/ dynibo"
    );
    for (name, Times { median, fastest }) in names.zip(times) {
        println!(
            "{name:<44} {median:>8.1} {fastest:>8.1} {:>8.3}",
            median / dynibo
        );
    }
}

/// The type every contestant receives.
type States = [State];
