//! The numbers: a table of means, every score, and what was asked for.

use super::case::Settings;
use super::learners::{Learner, Score};
use crate::data_figures::section::{Section, csv};
use crate::report::text_table::{TextTable, score};

/// Joints that the target is an average over.
pub const JOINTS: std::ops::RangeInclusive<usize> = 2..=6;

/// Largest number of samples of the target.
const ASKED_UP_TO: usize = 100;

/// Table, CSV file and findings.
pub fn report(scores: &[Score], settings: &Settings, section: &mut Section) {
    let mut rows = Vec::new();
    for (noise_idx, noise) in settings.torque_noise.iter().enumerate() {
        for learner in Learner::ALL {
            let mean = |&count: &usize| {
                let place = (learner, noise_idx, count);
                score(settings.mean(scores, place, JOINTS))
            };
            let labels = [learner.name().to_string(), noise.to_string()];
            let means = settings.counts.iter().map(mean);
            rows.push(labels.into_iter().chain(means).collect());
        }
    }
    let header = ["nMSE, joints 2 to 6", "noise (N·m)"].map(String::from);
    let counts = settings.counts.iter().map(|count| format!("n = {count}"));
    section.table = Some(TextTable::new(1, header.into_iter().chain(counts), rows));
    let line = |one: &Score| {
        let labels = [
            one.learner.name().replace(", ", " "),
            settings.torque_noise[one.noise_idx].to_string(),
            one.count.to_string(),
            one.draw.to_string(),
            one.joint.to_string(),
        ];
        (labels.to_vec(), vec![one.nmse])
    };
    let header = "learner,torque_noise,samples,draw,joint,nmse";
    section.file("novel_scores.csv", csv(header, scores.iter().map(line)));
    found(scores, settings, section);
}

fn found(scores: &[Score], settings: &Settings, section: &mut Section) {
    for (noise_idx, noise) in settings.torque_noise.iter().enumerate() {
        let mean = |learner, count| settings.mean(scores, (learner, noise_idx, count), JOINTS);
        let asked = settings
            .counts
            .iter()
            .filter(|&&count| count <= ASKED_UP_TO);
        let ratios = asked.map(|&count| {
            let both = (mean(Learner::Alone, count), mean(Learner::Mgp, count));
            match both {
                (Some(alone), Some(mgp)) => format!("{count}: {:.3}", mgp / alone),
                _ => format!("{count}: GPc cannot be learned"),
            }
        });
        section.found(
            format!(
                "below GPc from scratch at every number of samples up to {ASKED_UP_TO}, mean over joints 2 to 6, noise {noise} N·m"
            ),
            format!("nMSE over that of GPc, {}", ratios.collect::<Vec<_>>().join(", ")),
        );
        let wins = settings.counts.iter().filter(|&&count| {
            let physics = mean(Learner::Physics, count);
            let learned = Learner::ALL.into_iter();
            let learned = learned.filter(|learner| *learner != Learner::Physics);
            let learned = learned.filter_map(|learner| mean(learner, count));
            physics.is_some_and(|physics| learned.fold(f64::INFINITY, f64::min) > physics)
        });
        let wins: Vec<String> = wins.map(usize::to_string).collect();
        section.found(
            format!("where physics with Y known wins, noise {noise} N·m"),
            format!("at n = {}", wins.join(", ")),
        );
    }
    let is_asked = |one: &&Score| one.count == ASKED_UP_TO && one.learner == Learner::Mgp;
    let of_draw = |draw: usize| -> f64 {
        let of_draw = scores.iter().filter(is_asked);
        let of_draw = of_draw.filter(|one| one.draw == draw && one.noise_idx == 0);
        of_draw.map(|one| one.seconds).sum()
    };
    let slowest = (0..settings.draws).map(of_draw).fold(0.0, f64::max);
    section.found(
        format!(
            "adaptation to {ASKED_UP_TO} samples in less than 1 s, n = {}",
            settings.n_total
        ),
        format!("{slowest:.2} s for six joints one after another, the slowest draw"),
    );
}
