//! Variances of the highest evidence, against the density of the targets written out and against what they were made with.

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};
use gp_core::{BayesLinear, LinearForm};

use crate::samples::normals;

const NOISE_STD: f64 = 0.4;

/// States of one joint in some units, and targets with noise that are linear in them.
fn data(n: usize, units: [f64; 3], target_unit: f64) -> (Mat<f64>, Vec<f64>) {
    let (states, noise) = (normals(7, 3 * n), normals(8, n));
    let x = Mat::from_fn(n, 3, |row, col| units[col] * (states[3 * row + col] + 2.0));
    let weights = [1.5, -0.7, 0.2];
    let target = |row: usize| {
        let linear = (0..3).map(|col| weights[col] * (states[3 * row + col] + 2.0));
        target_unit * (10.0 + linear.sum::<f64>() + NOISE_STD * noise[row])
    };
    (x, (0..n).map(target).collect())
}

fn fit(x: &Mat<f64>, targets: &[f64]) -> BayesLinear {
    BayesLinear::fit_by_evidence(x.as_ref(), targets, LinearForm::Smooth).unwrap()
}

/// log p of the targets less their mean under σ²I + τ²ZZᵀ, from the matrix itself, with the constant integrated out.
fn log_density(x: &Mat<f64>, targets: &[f64], noise_var: f64, weight_var: f64) -> f64 {
    let n = targets.len();
    let column = |col: usize| {
        let mean = x.col(col).iter().sum::<f64>() / n as f64;
        let squares = x.col(col).iter().map(|v| (v - mean).powi(2)).sum::<f64>();
        (mean, (squares / n as f64).sqrt())
    };
    let z = Mat::from_fn(n, 3, |row, col| {
        (x[(row, col)] - column(col).0) / column(col).1
    });
    let k = Mat::<f64>::identity(n, n) * faer::Scale(noise_var)
        + &z * z.transpose() * faer::Scale(weight_var);
    let llt = k.llt(Side::Lower).unwrap();
    let ones = Mat::<f64>::ones(n, 1);
    let t = Mat::from_fn(n, 1, |row, _| targets[row]);
    let (k_ones, k_t) = (llt.solve(&ones), llt.solve(&t));
    // Patterson & Thompson 1971: the quadratic form about the generalised mean, and |1ᵀK⁻¹1|.
    let sum = |m: &Mat<f64>| m.col(0).iter().sum::<f64>();
    let (s, st) = (sum(&k_ones), sum(&k_t));
    let quadratic = (t.transpose() * &k_t)[(0, 0)] - st * st / s;
    let log_det: f64 = (0..n).map(|i| 2.0 * llt.L()[(i, i)].ln()).sum();
    -0.5 * (quadratic + log_det + s.ln())
}

/// τ² from the posterior of one weight: the prior rows are what R has beyond the data.
fn weight_var(model: &BayesLinear, x: &Mat<f64>, n: usize) -> f64 {
    // RᵀR = X̃ᵀX̃ + (σ/τ)² diag(s²): the first entry of both sides.
    let r = model.r();
    let (mut of_r, squares) = (r[(0, 0)].powi(2), x.col(0).squared_norm_l2());
    of_r -= squares;
    let mean = x.col(0).iter().sum::<f64>() / n as f64;
    let spread = squares / n as f64 - mean * mean;
    model.noise_var() * spread / of_r
}

#[test]
fn no_other_variances_have_a_higher_density() {
    let n = 40;
    let (x, targets) = data(n, [1.0, 1.0, 1.0], 1.0);
    let model = fit(&x, &targets);
    let (noise, weight) = (model.noise_var(), weight_var(&model, &x, n));
    let highest = log_density(&x, &targets, noise, weight);
    for (a, b) in [
        (1.02, 1.0),
        (0.98, 1.0),
        (1.0, 1.1),
        (1.0, 0.9),
        (1.02, 1.1),
        (0.98, 0.9),
    ] {
        let other = log_density(&x, &targets, a * noise, b * weight);
        assert!(other < highest, "{a} {b}: {other} {highest}");
    }
    // The slopes by central differences, in nats per logarithm; off by 1 % they would be 0.2.
    for (a, b) in [(1e-4, 0.0), (0.0, 1e-4)] {
        let at = |sign: f64| {
            log_density(
                &x,
                &targets,
                noise * (sign * a).exp(),
                weight * (sign * b).exp(),
            )
        };
        let slope = (at(1.0) - at(-1.0)) / 2e-4;
        assert!(slope.abs() < 1e-3, "{a} {b}: {slope}");
    }
}

#[test]
fn the_noise_that_targets_were_made_with_is_found_and_predictions_know_their_errors() {
    let n = 400;
    let (x, targets) = data(n, [1.0, 1.0, 1.0], 1.0);
    let (x, others) = (
        x.submatrix(0, 0, 200, 3).to_owned(),
        x.submatrix(200, 0, 200, 3).to_owned(),
    );
    let model = fit(&x, &targets[..200]);
    // A standard deviation from 196 degrees of freedom is known to 1/√(2 · 196) = 5 %.
    let found = model.noise_var().sqrt() / NOISE_STD;
    assert!((found - 1.0).abs() < 0.2, "{found}");
    let (mean, var) = (
        model.predict_mean(others.as_ref()).unwrap(),
        model.predict_var(others.as_ref()).unwrap(),
    );
    let inside = (0..200).filter(|&row| {
        let std = (var[row] + model.noise_var()).sqrt();
        (targets[200 + row] - mean[row]).abs() < 1.96 * std
    });
    // 190 ± 3.1 of 200.
    let inside = inside.count();
    assert!((177..=199).contains(&inside), "{inside}");
}

#[test]
fn units_do_not_matter() {
    let n = 30;
    let (x, targets) = data(n, [1.0, 1.0, 1.0], 1.0);
    let model = fit(&x, &targets);
    let at = model.predict_mean(x.as_ref()).unwrap();
    let units = [1024.0, 1.0 / 512.0, 4096.0];
    for target_unit in [1.0, 2.0_f64.powi(-40), 2.0_f64.powi(40)] {
        let (scaled, torques) = data(n, units, target_unit);
        let model_of_scaled = fit(&scaled, &torques);
        let ratio = model_of_scaled.noise_var().sqrt() / (target_unit * model.noise_var().sqrt());
        assert!((ratio - 1.0).abs() < 1e-6, "{ratio}");
        let means = model_of_scaled.predict_mean(scaled.as_ref()).unwrap();
        for (mean, expected) in means.iter().zip(&at) {
            let error = (mean / target_unit - expected).abs();
            assert!(error < 1e-6 * NOISE_STD, "{mean} {expected}");
        }
    }
}

#[test]
fn equal_targets_constant_covariates_and_few_samples_have_an_answer() {
    let (mut x, targets) = data(12, [1.0, 1.0, 1.0], 1.0);
    x.col_mut(1).fill(3.0);
    let equal = fit(&x, &[5.0; 12]);
    for mean in equal.predict_mean(x.as_ref()).unwrap() {
        assert!((mean - 5.0).abs() < 1e-9, "{mean}");
    }
    assert!(equal.noise_var() > 0.0 && equal.noise_var() < 1e-9);
    let zero = fit(&x, &[0.0; 12]);
    assert!(zero.noise_var() > 0.0);
    let model = fit(&x, &targets);
    let mut moved = x.clone();
    moved.col_mut(1).fill(6.0);
    // What never changed says nothing; moving it makes the torque uncertain and leaves the mean.
    let mean = |x: &Mat<f64>| model.predict_mean(x.as_ref()).unwrap()[0];
    assert!((mean(&x) - mean(&moved)).abs() < 1e-6);
    let var = |x: &Mat<f64>| model.predict_var(x.as_ref()).unwrap()[0];
    assert!(var(&moved) > 1.5 * var(&x), "{} {}", var(&moved), var(&x));

    let (two, of_two) = (x.submatrix(0, 0, 2, 3).to_owned(), &targets[..2]);
    let means = fit(&two, of_two).predict_mean(two.as_ref()).unwrap();
    assert!(means.iter().all(|mean| mean.is_finite()), "{means:?}");
}

#[test]
fn samples_of_which_c_are_one_say_what_every_cth_alone_does_if_they_are_equal() {
    let (x, targets) = data(40, [1.0, 30.0, 1e-3], 1.0);
    let once = fit(&x, &targets);
    let repeats = 7;
    let repeated = Mat::from_fn(40 * repeats, 3, |row, col| x[(row / repeats, col)]);
    let of_each = |target: &f64| std::iter::repeat_n(*target, repeats);
    let all: Vec<f64> = targets.iter().flat_map(of_each).collect();
    let form = LinearForm::Smooth;
    let fit_all = |c| BayesLinear::fit_correlated_by_evidence(repeated.as_ref(), &all, form, c);
    let (right, wrong) = (fit_all(repeats as f64).unwrap(), fit_all(1.0).unwrap());
    // QR of 280 rows of condition about 10; the search for τ² ends at 10⁻¹² of a flat maximum.
    let tolerance = 1e-6;
    let close = |found: f64, expected: f64, what: &str| {
        assert!(
            (found / expected - 1.0).abs() < tolerance,
            "{what}: {found} {expected}"
        );
    };
    close(right.noise_var(), once.noise_var(), "noise");
    for (found, expected) in right.weights().iter().zip(once.weights()) {
        close(*found, *expected, "weight");
    }
    let states = x.as_ref().subrows(0, 5);
    let var = |model: &BayesLinear| model.predict_var(states).unwrap();
    for ((right, wrong), once) in var(&right).iter().zip(var(&wrong)).zip(var(&once)) {
        close(*right, once, "variance");
        // Seven times as many rows for independent: a seventh of the variance, and n − 1 for n in σ².
        assert!(wrong < once / 6.0, "{wrong} {once}");
    }
    // 5 independent samples are left for 4 weights at 280/5 for one; beyond, variances alone grow.
    let (least, beyond) = (fit_all(56.0).unwrap(), fit_all(560.0).unwrap());
    close(beyond.noise_var(), least.noise_var(), "least noise");
    for (found, expected) in beyond.weights().iter().zip(least.weights()) {
        close(*found, *expected, "least weight");
    }
    for (beyond, least) in var(&beyond).iter().zip(var(&least)) {
        close(*beyond, 10.0 * least, "variance beyond");
    }
}
