//! The scatter of what is learned from disjoint stretches of a log, against the error bars of each.

use faer::{ColRef, Mat};
use linalg::{product, symmetric_eigen};
use torque_model::RobotModel;
use torque_model::rigid_body::{FitSettings, ParameterPosterior, TermSet};

use crate::coverage::{learned, runs};
use crate::simulated_arm::{FrictionKind, SimulatedArm};

const STRETCHES: u64 = 8;
/// Part of the prior's variance that is left of a combination which every stretch fixes.
const FIXED: f64 = 0.1;

/// Scatter over error bar of the combinations of some unknowns that every stretch fixes: the root of the mean square, and
/// how many they are.
///
/// The combinations are the principal directions of the first stretch's posterior, in standard deviations of the prior.
fn scatter(models: &[RobotModel], of: &[usize]) -> (f64, usize) {
    let posteriors: Vec<&ParameterPosterior> = models
        .iter()
        .map(|model| model.rigid_body().unwrap().as_ref())
        .collect();
    let std: Vec<f64> = of
        .iter()
        .map(|k| posteriors[0].parts().prior_std[*k])
        .collect();
    let covariances: Vec<Mat<f64>> = (posteriors.iter())
        .map(|posterior| {
            let covariance = posterior.covariance_of(of);
            Mat::from_fn(of.len(), of.len(), |row, col| {
                covariance[(row, col)] / (std[row] * std[col])
            })
        })
        .collect();
    let axes = symmetric_eigen(covariances[0].as_ref()).unwrap().vectors;
    let ratios: Vec<f64> = (axes.col_iter())
        .filter_map(|axis| {
            let vars: Vec<f64> = covariances
                .iter()
                .map(|of| variance_along(of, axis))
                .collect();
            if vars.iter().any(|var| *var > FIXED) {
                return None;
            }
            let estimate = |posterior: &&ParameterPosterior| -> f64 {
                let terms = of.iter().zip(&std).zip(axis.iter());
                terms
                    .map(|((k, std), along)| along * posterior.mean()[*k] / std)
                    .sum()
            };
            let estimates: Vec<f64> = posteriors.iter().map(estimate).collect();
            Some(sample_variance(&estimates) / mean(&vars))
        })
        .collect();
    (mean(&ratios).sqrt(), ratios.len())
}

fn variance_along(covariance: &Mat<f64>, axis: ColRef<'_, f64>) -> f64 {
    let turned = product(covariance.as_ref(), axis.as_mat());
    product(axis.transpose().as_mat(), turned.as_ref())[(0, 0)]
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn sample_variance(values: &[f64]) -> f64 {
    let centre = mean(values);
    let squares: f64 = values.iter().map(|value| (value - centre).powi(2)).sum();
    squares / (values.len() - 1) as f64
}

#[test]
fn error_bars_are_the_scatter_over_stretches_within_a_factor_of_two() {
    for (kind, least_correlation) in [
        (
            FrictionKind::OfTheModel,
            FitSettings::default().least_correlation,
        ),
        (FrictionKind::OfTheModel, 0.0),
        (
            FrictionKind::Other,
            FitSettings::default().least_correlation,
        ),
    ] {
        let arm = SimulatedArm::draw(40, kind, 2);
        let models: Vec<RobotModel> = (0..STRETCHES)
            .map(|stretch| {
                learned(
                    &arm.log(stretch, &runs(10.0)),
                    Some(TermSet::Full),
                    least_correlation,
                )
            })
            .collect();
        let unknowns = models[0].rigid_body().unwrap().unknowns();
        let bodies: Vec<usize> = unknowns.bodies().collect();
        let loads: Vec<usize> = unknowns.load(0).chain(unknowns.load(1)).collect();
        for (what, of, least) in [("links", bodies, 25), ("loads", loads, 18)] {
            let (ratio, n) = scatter(&models, &of);
            assert!(
                (0.5..=2.0).contains(&ratio) && n >= least,
                "{what}, {kind:?}, {least_correlation} s: {ratio}, {n} combinations"
            );
        }
    }
}
