//! The numbers: a table of means, every score, and what was asked for.

use super::curve::{Axis, CurveRecord, Learner};
use super::settings::Settings;
use crate::data_figures::section::{Section, csv};
use crate::report::text_table::{TextTable, ratio, score};

/// Geometric means of the nMSE.
pub struct Means<'a>(pub &'a [CurveRecord]);

impl Means<'_> {
    /// Of a learner at a place, over the targets, and over all joints or of one.
    ///
    /// `None` if there is no score.
    pub fn of(
        &self,
        (axis, count): (Axis, usize),
        learner: Learner,
        joint: Option<usize>,
    ) -> Option<f64> {
        let curves = self.0.iter().filter(|record| {
            let curve = &record.curve;
            curve.axis == axis && joint.is_none_or(|joint| joint == curve.joint)
        });
        let logs: Vec<f64> = curves
            .filter_map(|record| record.nmse(learner, count))
            .map(f64::ln)
            .collect();
        let n = logs.len() as f64;
        (n > 0.0).then(|| (logs.iter().sum::<f64>() / n).exp())
    }

    /// Of the mGP over that of sGP at a place, over all joints.
    fn gain(&self, axis: Axis, count: usize) -> Option<f64> {
        let of = |learner| self.of((axis, count), learner, None);
        Some(of(Learner::Transfer)? / of(Learner::Single)?)
    }

    /// The same at every place where there is one, as text.
    fn gains(&self, axis: Axis, counts: &[usize]) -> String {
        let at =
            |&count: &usize| Some(format!("{count}: {}", ratio(Some(self.gain(axis, count)?))));
        counts.iter().filter_map(at).collect::<Vec<_>>().join(", ")
    }

    /// In how many curves the mGP is below sGP at a place, and of how many.
    fn wins(&self, axis: Axis, count: usize) -> (usize, usize) {
        let curves = self.0.iter().filter(|record| record.curve.axis == axis);
        let is_won: Vec<bool> = curves
            .filter_map(|record| {
                let alone = record.nmse(Learner::Single, count)?;
                Some(record.nmse(Learner::Transfer, count)? < alone)
            })
            .collect();
        (is_won.iter().filter(|won| **won).count(), is_won.len())
    }
}

/// Table, CSV file and findings.
pub(super) fn report(records: &[CurveRecord], settings: &Settings, section: &mut Section) {
    let means = Means(records);
    let mut rows = Vec::new();
    for axis in Axis::ALL {
        for &count in settings.counts(axis) {
            let of = |learner| means.of((axis, count), learner, None);
            let mut row = vec![axis.label().to_string(), count.to_string()];
            row.extend(Learner::ALL.map(|learner| score(of(learner))));
            row.push(ratio(means.gain(axis, count)));
            let (won, all) = means.wins(axis, count);
            row.push(format!("{won} of {all}"));
            rows.push(row);
        }
    }
    let header = ["what grows", "number"].into_iter();
    let header = header.chain(Learner::ALL.map(Learner::name));
    let header = header.chain(["mGP / sGP", "mGP below sGP"]);
    section.table = Some(TextTable::new(1, header, rows));
    section.file("transfer.csv", scores(records));
    others_help(&means, settings, section);
    samples_help(&means, settings, section);
}

/// Every score.
fn scores(records: &[CurveRecord]) -> String {
    let line = |record: &CurveRecord| -> Vec<(Vec<String>, Vec<f64>)> {
        let curve = record.curve.clone();
        let row = |score: &super::Score| {
            let labels = vec![
                curve.axis.name().to_string(),
                score.count.to_string(),
                format!("c{}", curve.target),
                curve.joint.to_string(),
                score.learner.name().to_string(),
                score.evaluations.to_string(),
            ];
            (labels, vec![score.log_marginal_likelihood, score.nmse])
        };
        record.scores.iter().map(row).collect()
    };
    let header = "axis,count,target,joint,model,evaluations,log_marginal_likelihood,nmse";
    csv(header, records.iter().flat_map(line))
}

/// nMSE against the number of other loads.
fn others_help(means: &Means<'_>, settings: &Settings, section: &mut Section) {
    let axis = Axis::Others;
    let of = |learner, count| means.of((axis, count), learner, None);
    let Some(&most) = settings.others.last() else {
        return;
    };
    let (won, all) = means.wins(axis, most);
    section.found(
        format!(
            "samples of {most} other loads make the mGP better than sGP, which has the target's alone"
        ),
        format!("below it in {won} of {all} joints and targets"),
    );
    section.found(
        "each further load helps: the error falls with their number",
        format!(
            "nMSE of the mGP over that of sGP, by number of other loads, {}",
            means.gains(axis, &settings.others)
        ),
    );
    let shared = of(Learner::Independent, most).zip(of(Learner::Transfer, most));
    if let Some(((independent, mgp), alone)) = shared.zip(of(Learner::Single, most)) {
        section.found(
            "what helps is more than hyperparameters known better: the mGP is below iGP, which shares these alone",
            format!(
                "with {most} other loads, iGP has {} of the error of sGP, the mGP {}",
                ratio(Some(independent / alone)),
                ratio(Some(mgp / alone))
            ),
        );
    }
}

/// nMSE against the target's own samples.
fn samples_help(means: &Means<'_>, settings: &Settings, section: &mut Section) {
    let of = |learner, count| means.of((Axis::Samples, count), learner, None);
    section.found(
        "the fewer samples of its own a load has, the more the others help",
        format!(
            "nMSE of the mGP over that of sGP, by number of own samples, {}",
            means.gains(Axis::Samples, &settings.samples)
        ),
    );
    let worth = settings.samples.iter().map(|&count| {
        let mgp = of(Learner::Transfer, count).unwrap_or(f64::INFINITY);
        let is_as_good = |n: &&usize| of(Learner::Single, **n).is_some_and(|alone| alone <= mgp);
        let n = settings.samples.iter().find(is_as_good);
        let n = n.map_or("more than measured".to_string(), usize::to_string);
        format!("{count}: {n}")
    });
    section.found(
        "how many samples sGP needs to be as good as the mGP",
        format!(
            "by number of the mGP's own samples, {}",
            worth.collect::<Vec<_>>().join(", ")
        ),
    );
}

#[cfg(test)]
mod tests {
    use super::super::curve::{Curve, Score};
    use super::*;

    fn record(axis: Axis, joint: usize, nmses: &[(usize, [f64; 4])]) -> CurveRecord {
        let scores = nmses.iter().flat_map(|&(count, nmses)| {
            let pairs = Learner::ALL.into_iter().zip(nmses);
            pairs.map(move |(learner, nmse)| Score {
                learner,
                count,
                nmse,
                log_marginal_likelihood: -1.0,
                evaluations: 3,
            })
        });
        CurveRecord {
            scores: scores.collect(),
            curve: Curve {
                axis,
                target: 1,
                joint,
                counts: nmses.iter().map(|(count, _)| *count).collect(),
                n_each: 10,
                test_stride: 1,
            },
        }
    }

    #[test]
    fn means_wins_and_what_samples_are_worth_worked_by_hand() {
        let records = [
            record(Axis::Others, 1, &[(13, [1e-2, 1e-2, 1.0, 1e-4])]),
            record(Axis::Others, 3, &[(13, [1e-4, 1e-4, 1.0, 1e-2])]),
            record(
                Axis::Samples,
                1,
                &[
                    (2, [1.0, 1.0, 1.0, 1e-3]),
                    (10, [1e-2, 1.0, 1.0, 1e-4]),
                    (50, [5e-4, 1.0, 1.0, 2e-4]),
                ],
            ),
        ];
        let means = Means(&records);
        let mean = means.of((Axis::Others, 13), Learner::Transfer, None);
        assert!((mean.unwrap() - 1e-3).abs() < 1e-15);
        let of_joint = means.of((Axis::Others, 13), Learner::Transfer, Some(3));
        assert!((of_joint.unwrap() - 1e-2).abs() < 1e-15);
        assert_eq!(means.of((Axis::Others, 4), Learner::Single, None), None);
        assert_eq!(means.wins(Axis::Others, 13), (1, 2));

        let settings = Settings {
            joints: vec![1, 3],
            targets: vec![1],
            others: vec![13],
            n_each: 10,
            samples: vec![2, 10, 50],
            n_each_other: 10,
            test_stride: 1,
        };
        let mut section = Section::default();
        report(&records, &settings, &mut section);
        let here: Vec<&str> = section.findings.iter().map(|f| f.here.as_str()).collect();
        assert_eq!(here[0], "below it in 1 of 2 joints and targets");
        assert!(here[1].ends_with("13: 1.00"), "{}", here[1]);
        assert!(
            here[3].ends_with("2: 1.0e-3, 10: 1.0e-2, 50: 0.40"),
            "{}",
            here[3]
        );
        // 10⁻³ is reached with 50 samples (5·10⁻⁴), 10⁻⁴ and 2·10⁻⁴ with none of them.
        assert!(
            here[4].ends_with("2: 50, 10: more than measured, 50: more than measured"),
            "{}",
            here[4]
        );
        let text = &section.files[0].1;
        let lines = text.split(|byte| *byte == b'\n').count();
        assert_eq!(lines, 1 + 5 * 4 + 1);
    }
}
