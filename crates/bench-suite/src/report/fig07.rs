//! Figure 7: the four models on every joint, set and size, as one Hinton diagram.

use super::averages::{AverageKey, Averages};
use crate::cell::{ModelKind, TestSet};
use crate::figure::hinton::{Align, Font, LogRange, PITCH, Picture};
use crate::spec::Scope;

/// The chapter's range of average nMSE, from the smallest to the largest square.
///
/// # Source
/// Section 3.4 and the legend of fig. 7.
pub const RANGE: LogRange = LogRange {
    low: 3e-10,
    high: 6e3,
};

/// Values of the chapter's legend.
const LEGEND: [(f64, &str); 6] = [
    (3e-10, "3 × 10⁻¹⁰"),
    (1e-7, "10⁻⁷"),
    (1e-4, "10⁻⁴"),
    (1e-2, "10⁻²"),
    (1.0, "1"),
    (6e3, "6 × 10³"),
];

/// Left edge of the matrices: joint names and model names stand before it.
const LEFT: f64 = 150.0;
/// Top edge of the first matrix: title and column headings stand above it.
const TOP: f64 = 108.0;
/// Room between the two sets and between two joints.
const GAP: f64 = 14.0;
/// Room below the matrices for the legend and the remarks.
const BOTTOM: f64 = 140.0;
/// Width that the title and the legend need at least.
const MIN_WIDTH: f64 = 640.0;

/// Draws the figure for the joints and sizes of a scope; a missing average is a dash.
///
/// # Source
/// Fig. 7.
pub fn draw(averages: &Averages, models: &[ModelKind], scope: &Scope) -> Picture {
    let block = PITCH * scope.sizes.len() as f64;
    let joint_height = PITCH * models.len() as f64 + GAP;
    let bottom = TOP + joint_height * scope.joints.len() as f64;
    let width = (LEFT + 2.0 * block + GAP + 30.0).max(MIN_WIDTH);
    let mut picture = Picture::new(width, bottom + BOTTOM);

    headings(&mut picture, scope, block);
    for (i, &joint) in scope.joints.iter().enumerate() {
        let y = TOP + joint_height * i as f64;
        row_labels(&mut picture, joint, models, y);
        for (set, x) in TestSet::ALL.into_iter().zip([LEFT, LEFT + block + GAP]) {
            picture.frame(x, y, models.len(), scope.sizes.len());
            for (row, &model) in models.iter().enumerate() {
                for (column, &n) in scope.sizes.iter().enumerate() {
                    let key = AverageKey::new(joint, model, set, n);
                    let corner = (x + PITCH * column as f64, y + PITCH * row as f64);
                    element(&mut picture, corner, &key, averages.mean(&key));
                }
            }
        }
    }
    legend(&mut picture, bottom + 34.0, scope.loads.len());
    picture
}

fn headings(picture: &mut Picture, scope: &Scope, block: f64) {
    let title = "Average nMSE of LR¬c, LRc, GP¬c and GPc (the chapter's figure 7)";
    picture.text(24.0, 34.0, title, Font::Title, Align::Left);
    for (set, x) in TestSet::ALL.into_iter().zip([LEFT, LEFT + block + GAP]) {
        let (middle, name) = (x + block / 2.0, set.name());
        picture.text(middle, TOP - 36.0, name, Font::Heading, Align::Centre);
        for (column, n) in scope.sizes.iter().enumerate() {
            let x = x + PITCH * (column as f64 + 0.5);
            let (name, font) = (n.to_string(), size_font(&scope.sizes));
            picture.text(x, TOP - 10.0, &name, font, Align::Centre);
        }
    }
    picture.text(LEFT - 12.0, TOP - 10.0, "n =", Font::Label, Align::Right);
}

/// Four digits in the larger font would touch their neighbours.
fn size_font(sizes: &[usize]) -> Font {
    if sizes.iter().any(|&n| n >= 1000) {
        Font::Remark
    } else {
        Font::Label
    }
}

fn row_labels(picture: &mut Picture, joint: usize, models: &[ModelKind], y: f64) {
    let middle = y + PITCH * models.len() as f64 / 2.0 + 5.0;
    let name = format!("Joint {joint}");
    picture.text(24.0, middle, &name, Font::Heading, Align::Left);
    for (row, model) in models.iter().enumerate() {
        let y = y + PITCH * (row as f64 + 0.5) + 4.0;
        picture.text(LEFT - 12.0, y, model.label(), Font::Label, Align::Right);
    }
}

fn element(picture: &mut Picture, (x, y): (f64, f64), key: &AverageKey, mean: Option<f64>) {
    match mean {
        Some(nmse) => {
            let (joint, n) = (key.joint, key.n);
            let (model, set) = (key.model.label(), key.set.name());
            let title = format!("joint {joint}, {model}, {set}, n = {n}: nMSE {nmse:.2e}");
            picture.square(x, y, RANGE.side(nmse), title);
        }
        None => picture.absent(x, y),
    }
}

fn legend(picture: &mut Picture, y: f64, n_loads: usize) {
    let step = 84.0;
    let middle = y + PITCH / 2.0 + 4.0;
    picture.text(24.0, middle, "nMSE", Font::Heading, Align::Left);
    for (i, (value, label)) in LEGEND.into_iter().enumerate() {
        let x = 92.0 + step * i as f64;
        picture.frame(x, y, 1, 1);
        picture.square(x, y, RANGE.side(value), label.to_string());
        let (middle, below) = (x + PITCH / 2.0, y + PITCH + 18.0);
        picture.text(middle, below, label, Font::Label, Align::Centre);
    }
    let loads = match n_loads {
        1 => "Results of one load.".to_string(),
        n => format!("Averages over {n} loads."),
    };
    let remark = format!("{loads} The side of a square grows with log nMSE: smaller is better.");
    picture.text(24.0, y + PITCH + 50.0, &remark, Font::Remark, Align::Left);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::averages::tests::record;

    #[test]
    fn every_average_is_a_square_and_the_missing_ones_are_dashes() {
        let averages = Averages::of(&[record(1, 1, ModelKind::LrCoulomb, 20, 1.8e-2)]);
        let scope = Scope {
            loads: vec![1],
            joints: vec![1],
            sizes: vec![20, 170],
        };
        let svg = draw(&averages, &[ModelKind::LrCoulomb], &scope).to_svg();
        assert!(
            svg.contains("joint 1, LRc, interp, n = 20: nMSE 1.80e-2"),
            "{svg}"
        );
        assert!(
            svg.contains("joint 1, LRc, extrap, n = 20: nMSE 1.80e-1"),
            "{svg}"
        );
        assert_eq!(svg.matches('–').count(), 2, "{svg}");
    }
}
