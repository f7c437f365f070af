//! Colours and dashes of models: each looks the same in every picture.

use super::colour::{BLUE, GREEN, INK, ORANGE, PURPLE, QUIET, SKY, VERMILION};
use super::line::Line;

/// Width of a model's line in points, and that of mGP's.
const WIDTH: f64 = 1.8;
const WIDE: f64 = 2.4;

/// Models and what stands beside them in pictures, by the names in legends.
const MODELS: [(&str, Line); 20] = [
    ("sGP", Line::dashed(VERMILION, WIDTH, &[2.0, 3.0])),
    ("GPc", Line::dashed(VERMILION, WIDTH, &[2.0, 3.0])),
    ("iGP", Line::dashed(BLUE, WIDTH, &[7.0, 3.0])),
    ("pGP", Line::dashed(GREEN, WIDTH, &[8.0, 3.0, 2.0, 3.0])),
    ("mGP", Line::solid(INK, WIDE)),
    ("mGP-BIC", Line::solid(INK, WIDE)),
    ("mGP-one-K", Line::solid(PURPLE, WIDTH)),
    ("mGP, row only", Line::dashed(INK, WIDTH, &[6.0, 4.0])),
    ("mGP, own function", Line::solid(SKY, WIDTH)),
    ("mGP, no prior", Line::dashed(SKY, WIDTH, &[2.0, 3.0])),
    ("nearest", Line::solid(PURPLE, WIDTH)),
    ("rbd+gp", Line::solid(ORANGE, WIDTH)),
    ("rbd-shared", Line::solid(ORANGE, WIDE)),
    (
        "rbd-shared-signs",
        Line::dashed(ORANGE, WIDTH, &[9.0, 4.0, 2.0, 4.0]),
    ),
    ("rbd¬f+gp", Line::dashed(ORANGE, WIDTH, &[6.0, 4.0])),
    ("LRc", Line::solid(SKY, WIDTH)),
    ("physics", Line::dashed(QUIET, WIDTH, &[9.0, 4.0, 2.0, 4.0])),
    ("exact", Line::dashed(QUIET, WIDTH, &[2.0, 3.0])),
    ("gravity", Line::dashed(QUIET, WIDTH, &[6.0, 4.0])),
    ("nothing", Line::solid(QUIET, WIDTH)),
];

/// Line of a model, by its name in the legend.
///
/// # Panics
/// If the palette has no such name.
pub fn line_of(model: &str) -> Line {
    let found = MODELS.iter().find(|(name, _)| *name == model);
    let (_, line) = found.unwrap_or_else(|| panic!("{model} has no colour"));
    *line
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_differ_and_a_model_is_told_from_others_by_colour_or_dashes() {
        for (idx, (name, line)) in MODELS.iter().enumerate() {
            for (other, same) in &MODELS[..idx] {
                assert_ne!(name, other);
                // The same model under two names, and names that are never in one picture.
                let are_one = [
                    ("GPc", "sGP"),
                    ("mGP-BIC", "mGP"),
                    ("nearest", "mGP-one-K"),
                    ("LRc", "mGP, own function"),
                ];
                assert!(
                    line != same || are_one.contains(&(name, other)),
                    "{name} {other}"
                );
            }
        }
    }
}
