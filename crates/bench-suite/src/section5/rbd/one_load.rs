//! One load: the rows beside GPc's of table 3.

use super::line::Line;
use crate::cell::ModelKind;
use crate::error::BenchError;
use crate::metrics::nmse_of_sets;
use crate::models::Fitted;
use crate::rigid_body::parameters::Knowledge;
use crate::rigid_body::rows::Regressors;
use crate::rigid_body::{JointModel, RigidBodyForm};
use crate::section5::bench::Bench;
use crate::section5::training_set::SPLIT_SEED;
use crate::split::Split;

/// Scores of a model on one load: interp, extrap, σ.
type Scores = [f64; 3];

/// All models of a joint at one size, averaged over the loads.
///
/// # Errors
/// `Fit`, and those of [`nmse_of_sets`].
pub fn lines(
    bench: &Bench,
    regressors: &Regressors<'_>,
    loads: &[usize],
    joint: usize,
    n: usize,
) -> Result<Vec<Line>, BenchError> {
    let mut sums: Vec<(String, Scores)> = Vec::new();
    for &load in loads {
        for (idx, (model, scores)) in of_load(bench, regressors, load, joint, n)?
            .into_iter()
            .enumerate()
        {
            if sums.len() == idx {
                sums.push((model, [0.0; 3]));
            }
            for (sum, score) in sums[idx].1.iter_mut().zip(scores) {
                *sum += score / loads.len() as f64;
            }
        }
    }
    let line = |(model, [interp, extrap, noise_std]): (String, Scores)| Line {
        n_loads: 1,
        joint,
        n,
        model,
        interp,
        extrap,
        noise_std,
    };
    Ok(sums.into_iter().map(line).collect())
}

fn of_load(
    bench: &Bench,
    regressors: &Regressors<'_>,
    load: usize,
    joint: usize,
    n: usize,
) -> Result<Vec<(String, Scores)>, BenchError> {
    let split = Split::draw(SPLIT_SEED, load);
    let subset = split.subset(SPLIT_SEED, load, n);
    let samples = regressors.states(joint, &subset);
    let test = regressors.states(joint, &split.extrap);
    let targets = bench.data.torques(load, joint, &subset);
    let truth = bench.data.torques(load, joint, &split.extrap);
    let scored = |means: &[f64], noise_std: f64| {
        let [interp, extrap] = nmse_of_sets(&split, means, &truth)?;
        Ok::<Scores, BenchError>([interp, extrap, noise_std])
    };

    let gp = Fitted::fit(ModelKind::GpCoulomb, samples.x.as_ref(), &targets)?;
    let noise_std = gp.summary().map_or(f64::NAN, |fit| fit.noise_std);
    let means = gp.predict_mean(test.x.as_ref())?;
    let mut all = vec![("GPc".to_string(), scored(&means, noise_std)?)];
    for knowledge in Knowledge::ALL {
        for form in RigidBodyForm::ALL {
            let model = JointModel::of_one_load(joint, knowledge);
            let fit = model.fit(form, &samples, &targets, &[])?;
            let means = fit.predict_mean(&test)?;
            let name = format!("{}{}", form.name(), knowledge.label());
            all.push((name, scored(&means, fit.noise_std())?));
        }
    }
    Ok(all)
}
