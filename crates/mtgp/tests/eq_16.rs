//! Eq. (16): likelihood, gradient and posterior of the multi-task prior, against 50-digit arithmetic.

use faer::Mat;
use gp_core::evidence::{Evidence, evidence};
use gp_core::{LikelihoodOptions, Method, Posterior};
use kernels::Covariance;

use crate::fixture::{Case, case, joint_covariance, predictions};

fn certified(certificate: f64) -> LikelihoodOptions {
    LikelihoodOptions {
        method: Method::Certified,
        certificate,
    }
}

fn evaluate(case: &Case, options: LikelihoodOptions) -> Evidence {
    let data = case.stacked();
    let targets = data.stack(&case.torques);
    evidence(
        &case.covariance,
        case.noise_std[0],
        data.inputs(),
        &targets,
        options,
    )
    .unwrap()
}

/// Every entry of the gradient, relative to itself.
fn check_gradient(name: &str, case: &Case, found: &Evidence, tolerance: f64) {
    assert_eq!(found.gradient.len(), case.expected.len() - 1);
    let layout = case.covariance.layout();
    for (idx, (entry, row)) in found.gradient.iter().zip(&case.expected[1..]).enumerate() {
        let spec = layout.specs().get(idx).map(ToString::to_string);
        let error = (entry - row.value).abs() / row.value.abs();
        let (label, value) = (spec.unwrap_or("noise_std".to_owned()), row.value);
        assert!(label.starts_with(&row.name), "{label} {}", row.name);
        assert!(
            error <= tolerance,
            "{name} {label}: {entry} {value} error {error:e}"
        );
    }
}

#[test]
fn value_and_gradient_of_five_contexts_with_their_own_inputs() {
    for name in ["five", "curve"] {
        let case = case(name);
        let found = evaluate(&case, LikelihoodOptions::dense());
        let (value, expected) = (
            found.evaluation.log_marginal_likelihood,
            case.expected[0].value,
        );
        // n ε κ(K) with κ ≤ tr K/σ² near 1e5 (five) and 1e7 (curve) is below 1e-7; the error seen
        // is 1e-15 and 1e-12.
        let error = (value - expected).abs() / expected.abs();
        assert!(error <= 1e-10, "{name}: {value} {expected} error {error:e}");
        check_gradient(name, &case, &found, 1e-8);
    }
}

#[test]
fn certified_value_is_within_its_bound_and_its_gradient_follows() {
    // At full rank nothing is left out.
    let five = case("five");
    let found = evaluate(&five, certified(1e-9));
    let error = (found.evaluation.log_marginal_likelihood - five.expected[0].value).abs();
    assert!(error <= found.evaluation.error_bound, "{error:e} {found:?}");
    check_gradient("five", &five, &found, 1e-8);

    let curve = case("curve");
    for certificate in [0.3, 1e-2, 1e-4, 1e-6] {
        let found = evaluate(&curve, certified(certificate));
        let evaluation = found.evaluation;
        let error = (evaluation.log_marginal_likelihood - curve.expected[0].value).abs();
        assert!(error <= evaluation.error_bound, "{error:e} {evaluation:?}");
        assert!(evaluation.rank < 70, "{evaluation:?}");
        let largest = curve.expected[1..]
            .iter()
            .fold(0.0, |l: f64, row| l.max(row.value.abs()));
        for (entry, row) in found.gradient.iter().zip(&curve.expected[1..]) {
            // A change by the certificate over σ = 0.02, as the gradient is that of the
            // truncated value, beside what rounding may do.
            let error = (entry - row.value).abs();
            let tolerance = 50.0 * certificate + 1e-8 * largest;
            assert!(
                error <= tolerance,
                "{certificate} {}: {entry} {error:e}",
                row.name
            );
        }
    }
}

/// Largest difference of two matrices, relative to the largest entry of the second.
fn relative_difference(a: &Mat<f64>, b: &Mat<f64>) -> f64 {
    (a - b).norm_max() / b.norm_max()
}

#[test]
fn posterior_of_every_context_and_between_contexts() {
    for name in ["five", "curve"] {
        let case = case(name);
        let (points, means) = predictions(name);
        let expected = joint_covariance(name, points.nrows());
        let data = case.stacked();
        let targets = data.stack(&case.torques);
        let noise_std = case.noise_std[0];
        let dense =
            Posterior::dense(case.covariance.clone(), noise_std, data.inputs(), &targets).unwrap();
        let prediction = dense.predict(points.as_ref()).unwrap();
        let scale = means.iter().fold(0.0, |l: f64, mean| l.max(mean.abs()));
        for (idx, mean) in means.iter().enumerate() {
            let error = (prediction.mean[idx] - mean).abs() / scale;
            assert!(error <= 1e-10, "{name} {idx}: mean {mean} {error:e}");
            let (var, expected) = (prediction.var[idx], expected[(idx, idx)]);
            let error = (var - expected).abs() / case.covariance.diag(points.as_ref())[idx];
            assert!(
                error <= 1e-10,
                "{name} {idx}: var {var} {expected} {error:e}"
            );
        }
        let joint = dense.predict_covariance(points.as_ref()).unwrap();
        let error = relative_difference(&joint, &expected);
        assert!(error <= 1e-10, "{name}: {error:e}");
    }
}

#[test]
fn low_rank_posterior_of_every_context() {
    let case = case("curve");
    let (points, means) = predictions("curve");
    let expected = joint_covariance("curve", points.nrows());
    let data = case.stacked();
    let targets = data.stack(&case.torques);
    let options = certified(1e-6);
    let noise_std = case.noise_std[0];
    let covariance = case.covariance.clone();
    let found = Posterior::new(covariance, noise_std, data.inputs(), &targets, options).unwrap();
    let prediction = found.predict(points.as_ref()).unwrap();
    assert!(found.rank() < targets.len(), "{}", found.rank());
    for (idx, mean) in means.iter().enumerate() {
        // √(e ε)|α| with ε|α|² ≤ 2e-6 is 1.4e-3 √e, and √e at most the latent std.
        let std = expected[(idx, idx)].sqrt();
        let error = (prediction.mean[idx] - mean).abs();
        assert!(error <= 1.4e-3 * std + 1e-8, "{idx}: mean {mean} {error:e}");
        let error = (prediction.var[idx] - std * std).abs();
        assert!(
            error <= 1e-3 * std * std,
            "{idx}: var {} {error:e}",
            std * std
        );
    }
}
