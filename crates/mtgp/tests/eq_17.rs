//! Eq. (17): a complete block by eigendecompositions is the same process as by the whole matrix.

use faer::{Mat, mat};
use gp_core::evidence::{information, log_marginal_likelihood_with_gradient};
use gp_core::search::{SearchEnd, Start, refine, search};
use gp_core::{FitOptions, Likelihood, LikelihoodOptions, LogMarginal, Posterior};
use kernels::{Constant, Covariance, Jitter, TorqueCovariance, TorqueParams, Transform};
use linalg::Factor;
use mtgp::block::{BlockPosterior, CompleteBlock};
use mtgp::prior::{TaskMatrix, TaskRegression};
use mtgp::{MtgpError, MultiTaskCovariance, TaskCovariance, TaskFactor, with_task};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::icm_draws::torques;
use crate::textbook::{Case, assert_close, complete_case, entries, random, torque_covariance};

/// What a structured method must agree to, relative to the largest entry.
const AGREEMENT: f64 = 1e-8;

/// The prior with K^ρ as regressions.
type Regressions = MultiTaskCovariance<TaskRegression>;

const N_INPUTS: usize = 9;
const NOISE_STD: [f64; 4] = [0.2, 0.15, 0.3, 0.25];

/// Four tasks at nine inputs, and the case with K^ρ of a given rank.
fn block(rank: usize) -> (CompleteBlock, Case) {
    let lambda = random(4, rank, 1);
    let k_task = &lambda * lambda.transpose();
    let (x, targets) = (random(N_INPUTS, 6, 2), random(N_INPUTS, 4, 3));
    let block = CompleteBlock::new(x.as_ref(), targets.as_ref());
    let case = complete_case(torque_covariance(), &k_task, &NOISE_STD, &x, &targets);
    assert!(case.rounding() <= 0.1 * AGREEMENT, "{:e}", case.rounding());
    (block.unwrap(), case)
}

/// A block under the hyperparameters of a case.
fn conditioned<'a>(block: &'a CompleteBlock, case: &Case) -> BlockPosterior<'a, TorqueCovariance> {
    let k_task = case.k_task.as_ref();
    let posterior = block.condition(case.covariance.clone(), k_task, &case.noise_std);
    posterior.unwrap()
}

#[test]
fn likelihood_and_gradient_of_a_complete_block_equal_the_dense_ones() {
    for rank in [1, 2, 4] {
        let (block, case) = block(rank);
        let block = conditioned(&block, &case);
        let (gradient, expected) = (block.gradient(), case.likelihood());
        let value = block.log_marginal_likelihood().unwrap();
        assert_close("value", &[value], &[expected.value], AGREEMENT);
        assert_close("theta", &gradient.theta, &expected.theta, AGREEMENT);
        let (found, wanted) = (entries(&gradient.k_task), entries(&expected.k_task));
        assert_close("k_task", &found, &wanted, AGREEMENT);
        assert_close("noise", &gradient.noise_std, &expected.noise_std, AGREEMENT);
    }
}

#[test]
fn posterior_of_every_context_of_a_complete_block_equals_the_dense_one() {
    let x_test = random(7, 6, 4);
    for rank in [1, 2, 4] {
        let (block, case) = block(rank);
        let block = conditioned(&block, &case);
        for task in 0..4 {
            let found = block.predict(task, x_test.as_ref()).unwrap();
            let (mean, var) = case.predict(task, x_test.as_ref());
            assert_close("mean", &found.mean, &mean, AGREEMENT);
            assert_close("var", &found.var, &var, AGREEMENT);
            assert_eq!(found.n_clamped, 0);
        }
    }
}

#[test]
fn derivative_by_a_factor_is_that_of_central_differences() {
    let (block, _) = block(2);
    let lambda = random(4, 2, 1);
    let at = |lambda: &Mat<f64>| {
        let k_task = lambda * lambda.transpose();
        let posterior = block.condition(torque_covariance(), k_task.as_ref(), &NOISE_STD);
        posterior.unwrap()
    };
    let gradient = at(&lambda).gradient().of_factor(lambda.as_ref());
    let step = 1e-5;
    for row in 0..4 {
        for col in 0..2 {
            let shifted = |shift: f64| {
                let mut moved = lambda.clone();
                moved[(row, col)] += shift;
                at(&moved).log_marginal_likelihood().unwrap()
            };
            let difference = (shifted(step) - shifted(-step)) / (2.0 * step);
            // Values near 1e2 rounded to 1e-13; third derivatives below 1e3.
            let tolerance = 1e-12 / step + 1e3 * step * step;
            let error = (gradient[(row, col)] - difference).abs();
            assert!(error <= tolerance, "{} {difference}", gradient[(row, col)]);
        }
    }
}

#[test]
fn one_observation_is_a_normal_density() {
    // K = 2·3 + 4 = 10, t = 5: −½·25/10 − ½ ln 10 − ½ ln 2π; ∂/∂K^ρ = ½(t²/K² − 1/K)·3.
    let (one, x) = (mat![[2.0]], mat![[0.0]]);
    let covariance = Constant::new(3.0_f64.sqrt()).unwrap();
    let t = mat![[5.0]];
    let block = CompleteBlock::new(x.as_ref(), t.as_ref()).unwrap();
    let block = block.condition(covariance, one.as_ref(), &[2.0]).unwrap();
    let by_hand = -1.25 - 0.5 * 10.0_f64.ln() - 0.5 * (2.0 * std::f64::consts::PI).ln();
    let value = block.log_marginal_likelihood().unwrap();
    assert_close("value", &[value], &[by_hand], 16.0 * f64::EPSILON);
    let slope = block.gradient().k_task[(0, 0)];
    assert_close("slope", &[slope], &[0.225], 16.0 * f64::EPSILON);
    let posterior = block.predict(0, x.as_ref()).unwrap();
    assert_close("mean", &posterior.mean, &[3.0], 16.0 * f64::EPSILON);
    assert_close("var", &posterior.var, &[6.0 - 3.6], 16.0 * f64::EPSILON);
}

#[test]
fn bad_data_is_named() {
    let (k_task, x) = (Mat::identity(1, 1), mat![[0.0]]);
    let at = |std: f64, target: f64| {
        let (covariance, target) = (Constant::new(1.0).unwrap(), mat![[target]]);
        let conditioned = |block: &CompleteBlock| {
            let posterior = block.condition(covariance, k_task.as_ref(), &[std]);
            posterior.map(|_| ())
        };
        let block = CompleteBlock::new(x.as_ref(), target.as_ref());
        let outcome = block.and_then(|block| conditioned(&block));
        outcome.unwrap_err().to_string()
    };
    assert!(at(0.0, 1.0).contains("noise_std is 0"));
    assert!(at(1.0, f64::NAN).contains("target at row 0 is NaN"));

    let spoilt = mat![[f64::INFINITY]];
    let covariance = Constant::new(1.0).unwrap();
    let block = CompleteBlock::new(x.as_ref(), x.as_ref()).unwrap();
    let error = block.condition(covariance, spoilt.as_ref(), &[1.0]);
    assert_eq!(
        error.map(|_| ()),
        Err(MtgpError::NoSpectrum {
            rows: 1,
            columns: 1
        })
    );
}

#[test]
fn complete_block_equals_the_prior_of_eq_16_in_the_dense_engine() {
    let (n_inputs, n_tasks, noise_std) = (40, 6, 0.3);
    let entries: Vec<f64> = random(TaskFactor::count(n_tasks, 3), 1, 5)
        .col_as_slice(0)
        .to_vec();
    let factor = TaskFactor::from_entries(n_tasks, 3, &entries).unwrap();
    let task = TaskCovariance::Factor(factor);
    let prior = MultiTaskCovariance::new(torque_covariance(), task.clone());
    let (x, targets) = (random(n_inputs, 6, 6), random(n_inputs, n_tasks, 7));
    let (k_task, noise) = (task.k_task(), vec![noise_std; n_tasks]);
    let mut data = CompleteBlock::new(x.as_ref(), targets.as_ref()).unwrap();

    let case = complete_case(torque_covariance(), &k_task, &noise, &x, &targets);
    assert!(case.rounding() <= AGREEMENT, "{:e}", case.rounding());
    let rows = Mat::from_fn(case.x.nrows(), 7, |row, col| match col {
        6 => case.tasks[row] as f64,
        _ => case.x[(row, col)],
    });
    let (rows, t) = (rows.as_ref(), &case.targets);
    let (value, dense) = log_marginal_likelihood_with_gradient(&prior, noise_std, rows, t).unwrap();
    let mut slopes = vec![f64::NAN; prior.n_params() + 1];
    let evaluation = data.evaluate(&prior, noise_std, &mut slopes).unwrap();
    let found = evaluation.log_marginal_likelihood;
    assert_close("value", &[found], &[value], AGREEMENT);
    assert_close("gradient", &slopes, &dense, AGREEMENT);
    assert!(evaluation.error_bound <= AGREEMENT * value.abs());
    let parts = Likelihood::<MultiTaskCovariance>::parts(&data);
    assert_eq!(parts, [rows]);

    let block = data.posterior(&prior, noise_std).unwrap();
    let gradient = block.gradient();
    let mut of_factor = vec![0.0; task.n_params()];
    task.add_adjoint(gradient.k_task.as_ref(), &mut of_factor);
    let (of_prior, of_noise) = dense.split_at(prior.n_params());
    let (of_theta, of_entries) = of_prior.split_at(gradient.theta.len());
    assert_close("theta", &gradient.theta, of_theta, AGREEMENT);
    assert_close("task_factor", &of_factor, of_entries, AGREEMENT);
    let shared: f64 = gradient.noise_std.iter().sum();
    assert_close("noise_std", &[shared], of_noise, AGREEMENT);

    let posterior = Posterior::dense(prior, noise_std, rows, t).unwrap();
    let x_test = random(130, 6, 8); // more than one block of test points
    for task in 0..n_tasks {
        let found = block.predict(task, x_test.as_ref()).unwrap();
        let dense = posterior
            .predict(with_task(x_test.as_ref(), task).as_ref())
            .unwrap();
        assert_close("mean", &found.mean, &dense.mean, AGREEMENT);
        assert_close("var", &found.var, &dense.var, AGREEMENT);
    }
}

/// Nats by which a search may end below the maximum.
const GAP: f64 = 1e-9;

/// The end of a search from a start that is off by a half in everything.
fn fit(
    likelihood: &mut impl Likelihood<Regressions>,
    truth: &Regressions,
) -> SearchEnd<Regressions> {
    let options = FitOptions {
        max_evaluations: 600,
        gradient_tolerance: 1e-7,
        value_tolerance: 0.0,
        ..FitOptions::chapter()
    };
    let mut start = truth.clone();
    let theta: Vec<f64> = truth.params().iter().map(|value| 1.5 * value).collect();
    start.set_params(&theta);
    let limits = options.limits();
    let mut end = search(likelihood, &Start::given(start, 0.2), &limits);
    refine(likelihood, &mut end, &limits);
    end
}

/// The coordinates of a search, F⁻¹ there, and ½ gᵀF⁻¹g, what the maximum has more to second order.
fn coordinates(
    end: &SearchEnd<Regressions>,
    likelihood: &mut impl Likelihood<Regressions>,
) -> (Vec<f64>, Mat<f64>, f64) {
    let (covariance, noise_std) = (&end.covariance, end.noise_std);
    let layout = (covariance.layout()).followed_by(Jitter::new(1.0).unwrap().layout());
    let theta = [covariance.params(), vec![noise_std]].concat();
    let transforms: Vec<Transform> = layout.specs().iter().map(|spec| spec.transform).collect();
    let z: Vec<f64> = (transforms.iter().zip(&theta))
        .map(|(transform, value)| transform.unconstrained(*value))
        .collect();

    let mut slopes = vec![f64::NAN; theta.len()];
    likelihood
        .evaluate(covariance, noise_std, &mut slopes)
        .unwrap();
    for ((slope, transform), z) in slopes.iter_mut().zip(transforms).zip(&z) {
        *slope *= transform.derivative(*z);
    }
    let information = information(&likelihood.parts(), covariance, &z).unwrap();
    let factor = Factor::new(information).unwrap();
    let (twice_the_gap, _) = factor.quadratic_form_and_solve(&slopes);
    let mut inverse = Mat::identity(z.len(), z.len());
    factor.solve_in_place(inverse.as_mut());
    (z, inverse, 0.5 * twice_the_gap)
}

/// Four tasks of rank 3 in which every term shows: as regressions, so that the scale between K^ρ and c^x is
/// not open.
fn truth() -> Regressions {
    let input = TorqueCovariance::new(TorqueParams {
        bias_std: 2.0,
        linear_std: vec![1.5, 1.0, 1.2],
        signal_std: 0.5,
        length_scales: vec![1.5, 2.0, 1.2],
        coulomb_std: Some(vec![1.0]),
    });
    let entries = [1.0, 0.8, 0.9, -0.6, 0.9, 0.7, 1.1, -0.5, 0.4];
    let factor = TaskFactor::from_entries(4, 3, &entries).unwrap();
    let prior = MultiTaskCovariance::new(input.unwrap(), TaskCovariance::Factor(factor));
    prior.with_regression().unwrap()
}

#[test]
fn a_fit_by_a_complete_block_ends_at_the_maximum_of_the_dense_likelihood() {
    let (truth, n_inputs, n_tasks) = (truth(), 40, 4);
    let x = 2.0 * random(n_inputs, 3, 9);
    let rows = Mat::from_fn(n_inputs * n_tasks, 4, |row, col| match col {
        3 => (row / n_inputs) as f64,
        _ => x[(row % n_inputs, col)],
    });
    let mut rng = ChaCha8Rng::seed_from_u64(10);
    let torques = torques(&truth, 0.05, rows.as_ref(), &mut rng);
    let targets = Mat::from_fn(n_inputs, n_tasks, |j, task| torques[n_inputs * task + j]);

    let mut block = CompleteBlock::new(x.as_ref(), targets.as_ref()).unwrap();
    let mut dense = LogMarginal::new(rows.as_ref(), &torques, LikelihoodOptions::dense());
    let (by_block, by_dense) = (fit(&mut block, &truth), fit(&mut dense, &truth));
    let values = [&by_block, &by_dense].map(|end| end.report.log_marginal);
    assert!((values[0] - values[1]).abs() <= 1e-6, "{values:?}");

    let (found, variances, gap) = coordinates(&by_block, &mut block);
    let (expected, _, dense_gap) = coordinates(&by_dense, &mut dense);
    assert!(gap <= GAP && dense_gap <= GAP, "{gap:e} {dense_gap:e}");
    for (idx, (a, b)) in found.iter().zip(&expected).enumerate() {
        // Each end is within √(2 gap (H⁻¹)_ii) of the maximum; H is taken to be at least F/4.
        let tolerance = 4.0 * (2.0 * GAP * variances[(idx, idx)]).sqrt();
        assert!((a - b).abs() <= tolerance, "{idx}: {a} {b}, {tolerance:e}");
    }
}
