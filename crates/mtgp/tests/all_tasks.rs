//! Predictions of all tasks at once equal those of each task.

use faer::Mat;
use gp_core::{LikelihoodOptions, Method};
use mtgp::fit::fit_rank;
use mtgp::{MtgpError, MultiTaskOptions, StageOne};

use crate::icm_draws::four_tasks_of_rank_two;

fn options(method: Method) -> MultiTaskOptions {
    MultiTaskOptions {
        max_evaluations: 5,
        likelihood: LikelihoodOptions {
            method,
            ..LikelihoodOptions::automatic()
        },
        ..MultiTaskOptions::chapter()
    }
}

#[test]
fn every_column_is_the_prediction_of_its_task_on_both_paths() {
    let draw = four_tasks_of_rank_two(3, 12);
    for method in [Method::Dense, Method::Certified] {
        let options = options(method);
        let stage_one = StageOne::new(&draw.data, &draw.targets, &options).unwrap();
        let fit = fit_rank(&draw.data, &draw.targets, 2, &stage_one, None, &options).unwrap();
        // More rows than one block of 256.
        let known = draw.data.covariates();
        let x = Mat::from_fn(300, known.ncols(), |row, col| {
            known[(row % known.nrows(), col)] + 0.001 * row as f64
        });
        let all = fit.predict_mean_of_all_tasks(x.as_ref()).unwrap();
        let scale = draw.targets.iter().fold(0.0_f64, |a, t| a.max(t.abs()));
        for task in 0..4 {
            let expected = fit.predict_mean(task, x.as_ref()).unwrap();
            for (row, expected) in expected.iter().enumerate() {
                let found = all[(row, task)];
                // Sums of 48 products in another order; the weights are of the size of K⁻¹t,
                // at most 1/σ² of the targets.
                let tolerance = 1e-9 * scale;
                assert!(
                    (found - expected).abs() <= tolerance,
                    "{method:?} {row} {task}: {found} {expected}"
                );
            }
        }
        let bad = fit.predict_mean_of_all_tasks(x.subcols(0, 2));
        assert!(matches!(bad, Err(MtgpError::Gp(_))));
    }
}
