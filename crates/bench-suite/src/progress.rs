//! How far a run has come: a bar on a terminal, a plain line now and then otherwise.

use std::fmt::Display;
use std::io::{IsTerminal, Write};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

/// Time between two plain lines.
const INTERVAL: Duration = Duration::from_secs(10);

/// Progress of a run, on standard error; shared by the threads.
pub struct Progress {
    output: Output,
    n_cells: usize,
    started: Instant,
}

enum Output {
    Bar(ProgressBar),
    Lines(Mutex<Lines>),
}

struct Lines {
    n_finished: usize,
    last: Instant,
}

impl Progress {
    /// Announces `n_cells` to compute beside `n_reused` already there.
    pub fn start(n_cells: usize, n_reused: usize) -> Self {
        let started = Instant::now();
        let output = if std::io::stderr().is_terminal() {
            Output::Bar(bar(n_cells))
        } else {
            let last = started;
            Output::Lines(Mutex::new(Lines {
                n_finished: 0,
                last,
            }))
        };
        let progress = Self {
            output,
            n_cells,
            started,
        };
        progress.line(&format!(
            "{n_cells} cells to compute, {n_reused} finished before"
        ));
        progress
    }

    /// Counts a cell.
    pub fn finished(&self, cell: &impl Display) {
        match &self.output {
            Output::Bar(bar) => {
                bar.set_message(cell.to_string());
                bar.inc(1);
            }
            Output::Lines(lines) => {
                let mut lines = counted(lines);
                lines.n_finished += 1;
                if lines.last.elapsed() >= INTERVAL {
                    lines.last = Instant::now();
                    let (done, all) = (lines.n_finished, self.n_cells);
                    let seconds = self.started.elapsed().as_secs();
                    self.line(&format!("{done} of {all} cells, {seconds} s"));
                }
            }
        }
    }

    /// Removes the bar and says how much was done.
    pub fn end(&self) {
        let n_finished = match &self.output {
            Output::Bar(bar) => {
                bar.finish_and_clear();
                bar.position()
            }
            Output::Lines(lines) => counted(lines).n_finished as u64,
        };
        let seconds = self.started.elapsed().as_secs_f64();
        self.line(&format!("{n_finished} cells computed in {seconds:.1} s"));
    }

    /// Progress that nobody reads any more is no reason to stop.
    fn line(&self, text: &str) {
        match &self.output {
            Output::Bar(bar) => bar.println(text),
            Output::Lines(_) => drop(writeln!(std::io::stderr(), "{text}")),
        }
    }
}

/// A panic elsewhere poisons the lock; counting on is harmless.
fn counted(lines: &Mutex<Lines>) -> MutexGuard<'_, Lines> {
    lines.lock().unwrap_or_else(PoisonError::into_inner)
}

fn bar(n_cells: usize) -> ProgressBar {
    let template = "{bar:32} {pos}/{len} cells  {elapsed} (about {eta} left)  {wide_msg}";
    let style =
        ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = ProgressBar::new(n_cells as u64).with_style(style);
    bar.enable_steady_tick(Duration::from_millis(500));
    bar
}
