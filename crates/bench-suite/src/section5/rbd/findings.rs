//! When the prior helps: sentences made of the lines.

use std::collections::BTreeSet;

use super::line::Line;
use crate::data_figures::section::Section;
use crate::report::text_table::{ratio, score};

/// Adds what the lines say.
pub fn add(section: &mut Section, lines: &[Line]) {
    let (one, many): (Vec<&Line>, Vec<&Line>) = lines.iter().partition(|line| line.n_loads == 1);
    for (model, question) in [
        ("rbd", "one load: does the right model alone beat GPc?"),
        ("rbd+gp, masses × 3", "one load: do wrong masses spoil it?"),
        (
            "rbd, no friction",
            "one load: what does a missing term cost?",
        ),
        (
            "rbd+gp, no friction",
            "one load: does a process make up for it?",
        ),
    ] {
        section.found(question, beside(&one, model, "GPc"));
    }
    let Some(reference) = many.first().map(|line| line.model.clone()) else {
        return;
    };
    for (model, question) in [
        ("rbd", "many loads: does the right model beat mGP?"),
        (
            "rbd+gp, no friction",
            "many loads: and one without friction, with a process?",
        ),
    ] {
        section.found(question, beside(&many, model, &reference));
    }
}

/// In how many cells a model has the lower extrap score, and the scores' geometric mean ratio.
fn beside(lines: &[&Line], model: &str, reference: &str) -> String {
    let cells: BTreeSet<(usize, usize)> = lines.iter().map(|l| (l.joint, l.n)).collect();
    let of = |name: &str, cell: (usize, usize)| {
        let found = lines
            .iter()
            .find(|l| l.model == name && (l.joint, l.n) == cell);
        found.map(|line| line.extrap)
    };
    let pairs: Vec<(f64, f64)> = cells
        .into_iter()
        .filter_map(|cell| Some((of(model, cell)?, of(reference, cell)?)))
        .collect();
    let n_better = pairs.iter().filter(|(ours, theirs)| ours < theirs).count();
    let logs = pairs.iter().map(|(ours, theirs)| (ours / theirs).ln());
    let typical = (logs.sum::<f64>() / pairs.len().max(1) as f64).exp();
    let worst = pairs.iter().map(|pair| pair.0).fold(0.0, f64::max);
    format!(
        "{model} is below {reference} on extrap in {n_better} of {} cells, typically {} times its nMSE; its largest is {}",
        pairs.len(),
        ratio(Some(typical)),
        score(Some(worst))
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ratios_are_geometric_means_over_cells_that_have_both() {
        let line = |joint, model: &str, extrap| Line {
            n_loads: 1,
            joint,
            n: 20,
            model: model.to_string(),
            interp: 0.5,
            extrap,
            noise_std: 0.01,
        };
        let lines = [
            line(1, "GPc", 0.1),
            line(1, "rbd", 0.001),
            line(2, "GPc", 0.1),
            line(2, "rbd", 0.2),
            line(3, "GPc", 0.1),
        ];
        let text = beside(&lines.iter().collect::<Vec<_>>(), "rbd", "GPc");
        // √(0.01 · 2) = 0.14
        let expected = "rbd is below GPc on extrap in 1 of 2 cells, typically 0.14 times its nMSE; its largest is 2.0e-1";
        assert_eq!(text, expected);
    }
}
