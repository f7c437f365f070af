//! How often the most probable load is the right one.

use super::counts::Confusion;
use super::picture;
use super::settings::Settings;
use super::trials::{Layout, Trial};
use crate::data_figures::section::{Section, csv};
use crate::error::BenchError;
use crate::report::text_table::TextTable;

/// Samples and noise of the sentence "with 10 samples and no noise".
const ASKED_COUNT: usize = 10;

/// Table, CSV file, picture and the finding about right loads.
///
/// # Errors
/// `Picture`.
pub fn report(
    trials: &[Trial],
    settings: &Settings,
    section: &mut Section,
) -> Result<(), BenchError> {
    let mut rows = Vec::new();
    let mut numbers = Vec::new();
    for layout in Layout::ALL {
        for (noise_idx, noise) in settings.torque_noise.iter().enumerate() {
            let mut row = vec![layout.name().to_string(), format!("{noise}")];
            for (count_idx, count) in settings.counts.iter().enumerate() {
                let is_in = |trial: &Trial| trial.layout == layout && trial.noise_idx == noise_idx;
                let confusion = Confusion::of(trials, count_idx, is_in);
                row.push(percent(confusion.accuracy()));
                numbers.extend(cells(layout, *noise, *count, &confusion));
                if is_shown(layout, *noise, *count, settings) {
                    let picture = picture::draw(&confusion);
                    let caption = "Loads that were true (rows) and said (columns)";
                    section.show("context", caption, &picture)?;
                }
            }
            rows.push(row);
        }
    }
    let header = ["samples are", "noise (N·m)"].map(String::from);
    let counts = settings.counts.iter().map(|count| format!("n = {count}"));
    section.table = Some(TextTable::new(1, header.into_iter().chain(counts), rows));
    let header = "samples,torque_noise,count,load,said,trials";
    section.file("context_confusion.csv", csv(header, numbers));
    found(trials, settings, section);
    Ok(())
}

/// The picture is of ten consecutive samples with the middle noise.
fn is_shown(layout: Layout, noise: f64, count: usize, settings: &Settings) -> bool {
    let is_noise = noise.to_bits() == settings.switch_noise.to_bits();
    layout == Layout::Consecutive && count == ASKED_COUNT && is_noise
}

fn cells(
    layout: Layout,
    noise: f64,
    count: usize,
    confusion: &Confusion,
) -> Vec<(Vec<String>, Vec<f64>)> {
    let mut cells = Vec::new();
    for (load, row) in confusion.counts.iter().enumerate() {
        for (said, n) in row.iter().enumerate().filter(|(_, n)| **n > 0) {
            let labels = [
                layout.name().to_string(),
                noise.to_string(),
                count.to_string(),
                format!("c{}", load + 1),
                format!("c{}", said + 1),
            ];
            cells.push((labels.to_vec(), vec![*n as f64]));
        }
    }
    cells
}

fn found(trials: &[Trial], settings: &Settings, section: &mut Section) {
    let Some(count_idx) = settings.counts.iter().position(|&n| n == ASKED_COUNT) else {
        return;
    };
    let is_quiet = |trial: &Trial| settings.torque_noise[trial.noise_idx] <= 0.0;
    for layout in Layout::ALL {
        let is_in = |trial: &Trial| trial.layout == layout && is_quiet(trial);
        let confusion = Confusion::of(trials, count_idx, is_in);
        section.found(
            format!(
                "right load in 99 % of trials or more, {ASKED_COUNT} {} samples without noise",
                layout.name()
            ),
            format!(
                "{} of {} trials",
                percent(confusion.accuracy()),
                confusion.n_trials()
            ),
        );
    }
}

/// One decimal.
pub fn percent(part: f64) -> String {
    format!("{:.1} %", 100.0 * part)
}
