//! Eq. (9): Bayesian linear regression, against the normal equations in 50 digits.

use faer::mat;
use gp_core::{BayesLinear, LinearForm};

use crate::fixture::{D, case, matrix, numbers, rows};

fn check(name: &str, form: LinearForm, form_name: &str) {
    let case = case(name);
    let model = BayesLinear::fit(case.x.as_ref(), &case.targets, form).unwrap();
    let expected: Vec<Vec<f64>> = rows("bayes_linear.csv")
        .iter()
        .filter(|row| row[0] == name && row[1] == form_name)
        .map(|row| numbers(&row[2..]))
        .collect();
    let points = matrix(&expected);
    let means = model.predict_mean(points.subcols(0, D)).unwrap();
    let vars = model.predict_var(points.subcols(0, D)).unwrap();

    // QR is backward stable, and a prediction among the data is as well determined as
    // the targets: (rows) · (columns) roundings, whatever the condition number.
    let n_weights = model.weights().len();
    let tolerance = ((case.targets.len() + n_weights) * n_weights) as f64 * f64::EPSILON;
    let scale = expected.iter().fold(0.0, |l: f64, row| l.max(row[D].abs()));
    for (idx, row) in expected.iter().enumerate() {
        let error = (means[idx] - row[D]).abs() / scale;
        assert!(
            error <= tolerance,
            "{name} {idx}: {} {} {error:e}",
            means[idx],
            row[D]
        );
        let error = (vars[idx] - row[D + 1]).abs() / row[D + 1];
        assert!(
            error <= tolerance,
            "{name} {idx}: {} {} {error:e}",
            vars[idx],
            row[D + 1]
        );
    }
}

#[test]
fn linear_model_with_friction() {
    check("well", LinearForm::Coulomb, "coulomb");
    check("ill", LinearForm::Coulomb, "coulomb");
}

#[test]
fn linear_model_without_friction() {
    check("well", LinearForm::Smooth, "smooth");
    check("ill", LinearForm::Smooth, "smooth");
}

#[test]
fn weights_are_covariates_then_signs_then_constant() {
    // One sample at x = (1, −2, 0): A = 1e4 x̃x̃ᵀ + 1e-4 I, so
    // E[β] = x̃ t 1e4 / (1e-4 + 1e4 x̃ᵀx̃), with x̃ = (1, −2, 0, −1, 1) and x̃ᵀx̃ = 7.
    let x = mat![[1.0, -2.0, 0.0]];
    let model = BayesLinear::fit(x.as_ref(), &[7.0], LinearForm::Coulomb).unwrap();
    let expected = [1.0, -2.0, 0.0, -1.0, 1.0].map(|feature| feature * 7.0 / (7.0 + 1e-8));
    for (weight, expected) in model.weights().iter().zip(expected) {
        assert!(
            (weight - expected).abs() <= 1e4 * f64::EPSILON,
            "{weight} {expected}"
        );
    }
}
