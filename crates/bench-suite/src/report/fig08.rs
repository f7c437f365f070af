//! Figure 8: the fitted variances of accelerations and of signs of velocity, as two Hinton diagrams.

use kernels::{Covariance, TorqueCovariance, TorqueForm};

use super::finding::Finding;
use crate::cell::{CellRecord, ModelKind};
use crate::dataset::N_JOINTS;
use crate::figure::hinton::{Align, Font, PITCH, Picture, side_of_area};
use crate::spec::Scope;

/// Left edge of the first matrix.
const LEFT: f64 = 110.0;
/// Top edge of both matrices.
const TOP: f64 = 118.0;
/// Room between the matrices.
const GAP: f64 = 60.0;
/// Side of a matrix with a column for every joint.
const WIDTH: f64 = PITCH * N_JOINTS as f64;

/// The scaled variances of one joint's GPc.
///
/// ```text
/// u²_{2ℓ+j} / max_j u²_{2ℓ+j}     weights of q̈_j
/// w²_j / max_j w²_j               weights of sgn q̇_j
/// ```
/// # Source
/// Section 3.4, fig. 8.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Joint whose torque is predicted, from 1.
    pub joint: usize,
    /// Scaled variances of the linear terms in q̈_1 … q̈_ℓ.
    pub accelerations: Vec<f64>,
    /// Scaled variances of the Coulomb terms in sgn q̇_1 … sgn q̇_ℓ.
    pub signs: Vec<f64>,
}

/// The load and the size that the figure shows: the first load and the largest size of the scope.
pub fn subject(scope: &Scope) -> Option<(usize, usize)> {
    Some((*scope.loads.first()?, *scope.sizes.iter().max()?))
}

/// Rows of the joints whose GPc is among the records.
pub fn rows(records: &[CellRecord], scope: &Scope) -> Vec<Row> {
    let Some((load, n)) = subject(scope) else {
        return Vec::new();
    };
    let is_shown = |record: &&CellRecord| {
        let cell = &record.cell;
        (cell.load, cell.n, cell.model) == (load, n, ModelKind::GpCoulomb)
            && scope.joints.contains(&cell.joint)
    };
    let shown = records.iter().filter(is_shown);
    shown
        .filter_map(|record| row(record.cell.joint, &record.fit.as_ref()?.hyperparameters))
        .collect()
}

/// A joint's row from its hyperparameters θ, in the order of the covariance's layout.
fn row(joint: usize, theta: &[f64]) -> Option<Row> {
    let layout = TorqueCovariance::unit(N_JOINTS, TorqueForm::Coulomb).layout();
    let linear = theta.get(layout.range("linear_std")?)?;
    let signs = theta.get(layout.range("coulomb_std")?)?;
    Some(Row {
        joint,
        accelerations: scaled_variances(&linear[2 * N_JOINTS..]),
        signs: scaled_variances(signs),
    })
}

/// Squares of standard deviations over the largest of them.
fn scaled_variances(stds: &[f64]) -> Vec<f64> {
    let largest = stds.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    stds.iter().map(|std| (std / largest).powi(2)).collect()
}

/// Whether the row maxima are on the diagonals; a sentence for each row and matrix.
///
/// # Source
/// Section 3.4: both matrices "diagonally dominant".
pub fn findings(rows: &[Row]) -> Vec<String> {
    let verdict = |joint: usize, name: &str, values: &[f64]| match largest(values) {
        column if column == joint => {
            format!("joint {joint}: the largest weight of {name} is on the diagonal.")
        }
        column => format!(
            "joint {joint}: the largest weight of {name} is NOT on the diagonal but at joint {column}; the diagonal has {:.1e} of it.",
            values[joint - 1]
        ),
    };
    let both = |row: &Row| {
        [
            verdict(row.joint, "accelerations", &row.accelerations),
            verdict(row.joint, "signs of velocity", &row.signs),
        ]
    };
    rows.iter().flat_map(both).collect()
}

/// How many row maxima are on the diagonals, beside the chapter's claim.
///
/// # Source
/// Section 3.4.
pub fn claim(rows: &[Row]) -> Finding {
    let on_diagonal = |values: fn(&Row) -> &Vec<f64>| {
        let is_on = |row: &&Row| largest(values(row)) == row.joint;
        rows.iter().filter(is_on).count()
    };
    let here = format!(
        "row maxima on the diagonal: {} of {} for accelerations, {} of {} for signs of velocity",
        on_diagonal(|row| &row.accelerations),
        rows.len(),
        on_diagonal(|row| &row.signs),
        rows.len()
    );
    Finding::new("both matrices diagonally dominant", here)
}

/// Joint (from 1) of the largest value.
fn largest(values: &[f64]) -> usize {
    let idx = (0..values.len()).max_by(|&a, &b| values[a].total_cmp(&values[b]));
    idx.map_or(0, |idx| idx + 1)
}

/// The weights behind the figure, with all their digits.
pub fn to_csv(rows: &[Row], (load, n): (usize, usize)) -> String {
    let mut text = String::from("load,n,torque,weight_of,joint,scaled_variance\n");
    for row in rows {
        for (name, values) in [("acceleration", &row.accelerations), ("sign", &row.signs)] {
            for (j, value) in values.iter().enumerate() {
                let line = format!("c{load},{n},{},{name},{},{value:e}\n", row.joint, j + 1);
                text.push_str(&line);
            }
        }
    }
    text
}

/// Draws both matrices side by side.
///
/// # Source
/// Fig. 8.
pub fn draw(rows: &[Row], (load, n): (usize, usize)) -> Picture {
    let height = TOP + PITCH * rows.len() as f64;
    let mut picture = Picture::new(LEFT + 2.0 * WIDTH + GAP + 30.0, height + 60.0);
    let title = format!("Hyperparameters of GPc, load c{load}, n = {n} (the chapter's figure 8)");
    picture.text(24.0, 34.0, &title, Font::Title, Align::Left);

    let accelerations: Vec<&[f64]> = rows.iter().map(|row| &row.accelerations[..]).collect();
    let signs: Vec<&[f64]> = rows.iter().map(|row| &row.signs[..]).collect();
    let joints: Vec<usize> = rows.iter().map(|row| row.joint).collect();
    let heading = "linear in acceleration, u²";
    matrix(&mut picture, LEFT, (heading, "q̈"), &joints, &accelerations);
    let right = LEFT + WIDTH + GAP;
    matrix(
        &mut picture,
        right,
        ("Coulomb, w²", "sgn q̇"),
        &joints,
        &signs,
    );
    for (i, row) in rows.iter().enumerate() {
        let y = TOP + PITCH * (i as f64 + 0.5) + 4.0;
        let name = format!("torque {}", row.joint);
        picture.text(LEFT - 12.0, y, &name, Font::Label, Align::Right);
    }
    let remark = "The area of a square is the variance, each row scaled to a maximum of 1.";
    picture.text(24.0, height + 34.0, remark, Font::Remark, Align::Left);
    picture
}

/// One matrix with its heading, column labels and squares; x is its left edge.
fn matrix(
    picture: &mut Picture,
    x: f64,
    (heading, symbol): (&str, &str),
    joints: &[usize],
    values: &[&[f64]],
) {
    let middle = x + WIDTH / 2.0;
    picture.text(middle, TOP - 40.0, heading, Font::Heading, Align::Centre);
    for joint in 1..=N_JOINTS {
        let centre = x + PITCH * (joint as f64 - 0.5);
        let label = joint.to_string();
        picture.text(centre, TOP - 12.0, &label, Font::Label, Align::Centre);
    }
    picture.frame(x, TOP, values.len(), N_JOINTS);
    for (i, (joint, row)) in joints.iter().zip(values).enumerate() {
        let y = TOP + PITCH * i as f64;
        for (j, value) in row.iter().enumerate() {
            let tooltip = format!("torque {joint}, {symbol} {}: {value:.2e}", j + 1);
            picture.square(x + PITCH * j as f64, y, side_of_area(*value), tooltip);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// θ with u_{2ℓ+j} = j (so that joint 6 has the largest) and w_2 the largest sign.
    fn theta() -> Vec<f64> {
        let mut theta = vec![1.0; 1 + 18 + 1 + 18 + 6];
        for (j, value) in theta[13..19].iter_mut().enumerate() {
            *value = (j + 1) as f64;
        }
        theta[38 + 1] = 4.0;
        theta
    }

    #[test]
    fn a_row_holds_the_scaled_squares_of_the_right_hyperparameters() {
        let row = row(6, &theta()).unwrap();
        let expected: Vec<f64> = (1..=6).map(|j| (f64::from(j) / 6.0).powi(2)).collect();
        assert_eq!(row.accelerations, expected);
        assert_eq!(
            row.signs,
            [
                1.0 / 16.0,
                1.0,
                1.0 / 16.0,
                1.0 / 16.0,
                1.0 / 16.0,
                1.0 / 16.0
            ]
        );
    }

    #[test]
    fn a_maximum_off_the_diagonal_is_said_with_its_place() {
        let found = findings(&[row(6, &theta()).unwrap()]);
        assert_eq!(
            found,
            [
                "joint 6: the largest weight of accelerations is on the diagonal.",
                "joint 6: the largest weight of signs of velocity is NOT on the diagonal but at joint 2; \
                 the diagonal has 6.2e-2 of it.",
            ]
        );
    }

    #[test]
    fn maxima_on_the_diagonals_are_counted_and_every_weight_is_a_row() {
        let rows = [row(6, &theta()).unwrap()];
        let here =
            "row maxima on the diagonal: 1 of 1 for accelerations, 0 of 1 for signs of velocity";
        assert_eq!(claim(&rows).here, here);
        let text = to_csv(&rows, (2, 170));
        assert_eq!(text.lines().count(), 1 + 12);
        assert!(text.contains("\nc2,170,6,sign,2,1e0\n"), "{text}");
    }

    #[test]
    fn every_weight_has_its_square() {
        let svg = draw(&[row(6, &theta()).unwrap()], (2, 170)).to_svg();
        assert!(svg.contains("torque 6, q̈ 6: 1.00e0"), "{svg}");
        assert!(svg.contains("torque 6, sgn q̇ 2: 1.00e0"), "{svg}");
        assert_eq!(svg.matches("<title>torque").count(), 12, "{svg}");
    }
}
