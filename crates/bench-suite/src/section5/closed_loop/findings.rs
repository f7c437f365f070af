//! What the runs say: table, files and findings.

use super::picture;
use super::plant::{Outcome, PERIOD, Plant};
use super::settings::Settings;
use super::source::{NEW_LOAD, Source};
use super::sweep::{Crossing, Row, curve, mean, value_at};
use super::switch::{Belief, Change};
use crate::data_figures::section::{Section, csv};
use crate::error::BenchError;
use crate::report::text_table::TextTable;

/// All that was measured.
pub struct Results<'a> {
    pub settings: &'a Settings,
    /// Names, and whether the models were trained on the trajectory.
    pub trajectories: Vec<(String, bool)>,
    pub rows: Vec<Row>,
    /// Runs into the wall.
    pub contact: Vec<Row>,
    pub changes: Vec<Change>,
    /// rad.
    pub integration_error: f64,
}

impl Results<'_> {
    /// The section of the report.
    ///
    /// # Errors
    /// `Picture`.
    pub fn section(&self, plant: &Plant) -> Result<Section, BenchError> {
        let mut section = Section::default();
        let labels: Vec<(String, String)> = (self.trajectories.iter())
            .map(|(name, is_seen)| {
                let seen = if *is_seen {
                    "trained on"
                } else {
                    "not trained on"
                };
                (name.clone(), format!("{name}, {seen}"))
            })
            .collect();
        let drawn = picture::draw(&self.rows, self.settings, &labels);
        let caption = "RMS tracking error against the gains, mean over the known loads";
        section.show("closed_loop", caption, &drawn)?;
        section.table = Some(self.table());
        self.files(&mut section);
        for (name, label) in &labels {
            self.found_gains(name, label, &mut section);
        }
        self.found_new_load(&mut section);
        self.found_contact(&mut section);
        self.found_changes(&mut section);
        self.found_integration(&mut section);
        let inertias = plant.inertias().map(|inertia| format!("{inertia:.2}"));
        section.found(
            "inertias I of the gains, kg m²",
            format!("{} for joints 1 to 6", inertias.join(", ")),
        );
        Ok(section)
    }

    /// Errors at the lowest and highest gains, and the part of the torque that is corrective.
    fn table(&self) -> TextTable {
        let ends = [
            self.settings.bandwidths[0],
            self.settings.bandwidths[self.settings.bandwidths.len() - 1],
        ];
        let mut header = vec!["trajectory".to_string(), "feed-forward".to_string()];
        header.extend(ends.map(|end| format!("error at ω = {end} (mrad)")));
        header.extend(ends.map(|end| format!("corrective part at ω = {end}")));
        header.push("error of c15 (mrad)".to_string());
        let mut rows = Vec::new();
        for (trajectory, _) in &self.trajectories {
            for source in Source::ALL {
                let errors = self.curve(trajectory, source, false, |o| 1e3 * o.error());
                let shares = self.curve(trajectory, source, false, |o| o.corrective_share);
                let new = self.curve(trajectory, source, true, |o| 1e3 * o.error());
                let number = |curve: &[(f64, f64)], last: bool| {
                    let point = if last { curve.last() } else { curve.first() };
                    point.map_or("–".to_string(), |(_, value)| three_digits(*value))
                };
                rows.push(vec![
                    trajectory.clone(),
                    source.name().to_string(),
                    number(&errors, false),
                    number(&errors, true),
                    number(&shares, false),
                    number(&shares, true),
                    number(&new, false),
                ]);
            }
        }
        TextTable::new(2, header, rows)
    }

    fn curve(
        &self,
        trajectory: &str,
        source: Source,
        is_new: bool,
        of: impl Fn(&Outcome) -> f64,
    ) -> Vec<(f64, f64)> {
        curve(&self.rows, self.settings, (trajectory, source, is_new), of)
    }

    fn files(&self, section: &mut Section) {
        let line = |row: &Row| {
            let labels = vec![
                row.trajectory.clone(),
                format!("c{}", row.load),
                row.source.name().to_string(),
            ];
            let outcome = &row.outcome;
            let mut numbers = vec![row.bandwidth, outcome.error()];
            numbers.extend(outcome.errors);
            numbers.extend([outcome.corrective_share, outcome.peak_force]);
            (labels, numbers)
        };
        let errors: Vec<String> = (1..=6)
            .map(|joint| format!("rms_error{joint}_rad"))
            .collect();
        let header = format!(
            "trajectory,load,feed_forward,bandwidth_rad_s,rms_error_rad,{},corrective_share,peak_force_n",
            errors.join(",")
        );
        section.file("closed_loop.csv", csv(&header, self.rows.iter().map(line)));
        let contact = self.contact.iter().map(line);
        section.file("closed_loop_contact.csv", csv(&header, contact));
        let changes = self.changes.iter().map(|change| {
            let labels = vec![format!("c{}", change.from), format!("c{}", change.to)];
            let [unaware, tracked, told] = change.errors;
            (labels, vec![unaware, tracked, told, change.delay])
        });
        let header =
            "from,to,rms_error_unaware_rad,rms_error_tracked_rad,rms_error_told_rad,delay_s";
        section.file("closed_loop_changes.csv", csv(header, changes));
    }

    /// Level of error that gravity compensation reaches with the stiffest gains, rad.
    fn level(&self, trajectory: &str) -> Option<(f64, f64)> {
        let gravity = self.curve(trajectory, Source::Gravity, false, Outcome::error);
        gravity.last().copied()
    }

    fn found_gains(&self, trajectory: &str, label: &str, section: &mut Section) {
        let Some((stiffest, level)) = self.level(trajectory) else {
            return;
        };
        let factors = Source::ALL.into_iter().filter_map(|source| {
            let errors = self.curve(trajectory, source, false, Outcome::error);
            let crossing = Crossing::of(&errors, level)?;
            Some(format!(
                "{} {}",
                source.name(),
                crossing.factor_below(stiffest)
            ))
        });
        let factors: Vec<String> = factors.collect();
        section.found(
            format!(
                "{label}: K_p lower by what factor for the error of gravity compensation at ω = {stiffest} ({} mrad)",
                three_digits(1e3 * level)
            ),
            factors.join("; "),
        );
    }

    fn found_new_load(&self, section: &mut Section) {
        let bandwidth = self.settings.bandwidths[0];
        for (trajectory, _) in &self.trajectories {
            let errors = Source::ALL.into_iter().filter_map(|source| {
                let is_chosen = |row: &Row| {
                    row.trajectory == *trajectory
                        && row.source == source
                        && row.load == NEW_LOAD
                        && row.bandwidth.to_bits() == bandwidth.to_bits()
                };
                let error = mean(&self.rows, is_chosen, |o| 1e3 * o.error())?;
                Some(format!("{} {}", source.name(), three_digits(error)))
            });
            let errors: Vec<String> = errors.collect();
            section.found(
                format!(
                    "{trajectory} with c15, learned from {} samples: error at ω = {bandwidth}, mrad",
                    self.settings.new_samples
                ),
                errors.join("; "),
            );
        }
    }

    /// Peak forces at the gains that each source needs for one error in free motion.
    fn found_contact(&self, section: &mut Section) {
        let Some(trajectory) = self.contact.first().map(|row| row.trajectory.clone()) else {
            return;
        };
        let Some((_, level)) = self.level(&trajectory) else {
            return;
        };
        let wall = &self.settings.wall;
        let forces = Source::ALL.into_iter().filter_map(|source| {
            let errors = self.curve(&trajectory, source, false, Outcome::error);
            let crossing = Crossing::of(&errors, level)?;
            let key = (trajectory.as_str(), source, false);
            let force = curve(&self.contact, self.settings, key, |o| o.peak_force);
            let bandwidth = crossing.bandwidth();
            let force = value_at(&force, bandwidth)?;
            let sign = match crossing {
                Crossing::Below(_) => "at most ",
                Crossing::At(_) => "",
                Crossing::Above(_) => "over ",
            };
            Some(format!(
                "{} {sign}{force:.0} (ω = {bandwidth:.1})",
                source.name()
            ))
        });
        let forces: Vec<String> = forces.collect();
        section.found(
            format!(
                "{trajectory} into a wall of {:.0} N/m with c{}: peak force, N, at the gains of equal error",
                wall.stiffness, wall.load
            ),
            forces.join("; "),
        );
    }

    fn found_changes(&self, section: &mut Section) {
        let n = self.changes.len() as f64;
        let errors = Belief::ALL.into_iter().enumerate().map(|(idx, belief)| {
            let squares = self.changes.iter().map(|change| change.errors[idx].powi(2));
            let rms = (squares.sum::<f64>() / n).sqrt();
            format!("{} {}", belief.name(), three_digits(1e3 * rms))
        });
        let errors: Vec<String> = errors.collect();
        let mut delays: Vec<f64> = self.changes.iter().map(|change| change.delay).collect();
        delays.sort_by(f64::total_cmp);
        let n_found = delays.iter().filter(|delay| delay.is_finite()).count();
        let median = delays[delays.len() / 2];
        section.found(
            format!(
                "load changed in mid-motion, ω = {}: error of the 0.75 s after it, mrad",
                self.settings.switch.bandwidth
            ),
            format!(
                "{}; the tracker found the new load in {n_found} of {} changes, after {:.0} ms in the middle one",
                errors.join("; "),
                delays.len(),
                1e3 * median
            ),
        );
    }

    /// The smallest difference between two sources' errors at one gain, on one trajectory; of rbd, which is the exact
    /// model but for less than the integration can tell, none.
    fn smallest_difference(&self) -> f64 {
        let mut smallest = f64::INFINITY;
        for (trajectory, _) in &self.trajectories {
            for idx in 0..self.settings.bandwidths.len() {
                let error = |source| {
                    let errors = self.curve(trajectory, source, false, Outcome::error);
                    errors.get(idx).map_or(f64::NAN, |(_, error)| *error)
                };
                let errors: Vec<f64> = Source::of_each_load().map(error).collect();
                for (i, a) in errors.iter().enumerate() {
                    let gaps = errors[..i].iter().map(|b| (a - b).abs());
                    smallest = gaps.fold(smallest, f64::min);
                }
            }
        }
        smallest
    }

    fn found_integration(&self, section: &mut Section) {
        let difference = self.smallest_difference();
        section.found(
            "error of the integration a tenth or less of the differences shown",
            format!(
                "{:.1e} mrad by steps of {} ms against an eighth of them; the smallest difference between two sources, rbd-shared aside, is {:.1e} mrad, {:.0} times that",
                1e3 * self.integration_error,
                1e3 * PERIOD / self.settings.n_steps as f64,
                1e3 * difference,
                difference / self.integration_error
            ),
        );
    }
}

/// A positive number with three digits, without an exponent where it is short.
fn three_digits(value: f64) -> String {
    match value {
        value if value >= 100.0 => format!("{value:.0}"),
        value if value >= 10.0 => format!("{value:.1}"),
        value if value >= 1.0 => format!("{value:.2}"),
        value if value >= 0.01 => format!("{value:.4}"),
        value => format!("{value:.2e}"),
    }
}
