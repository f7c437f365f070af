//! Sec. 3.2: the prior of a rigid-body model, against linear regression one sample at a time.

use faer::{Mat, MatRef};
use gp_core::fit::{ParameterPrior, RegressorSamples, fit_rigid_body, fit_rigid_body_and_process};
use gp_core::{FitOptions, GpError, Posterior, Starts, log_marginal_likelihood};
use kernels::{RigidBody, TorqueForm};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const PARAMETERS: usize = 4;

fn draws(rng: &mut ChaCha8Rng, rows: usize, cols: usize) -> Mat<f64> {
    let mut values = Mat::zeros(rows, cols);
    for row in 0..rows {
        for col in 0..cols {
            values[(row, col)] = 2.0 * rng.random::<f64>() - 1.0;
        }
    }
    values
}

/// Gaussian beliefs of π, renewed by one sample after the other.
struct Sequential {
    mean: Vec<f64>,
    covariance: Mat<f64>,
    log_evidence: f64,
}

impl Sequential {
    fn new(covariance: Mat<f64>) -> Self {
        Self {
            mean: vec![0.0; covariance.nrows()],
            covariance,
            log_evidence: 0.0,
        }
    }

    /// Mean and variance of y·π.
    fn predict(&self, y: &[f64]) -> (f64, f64) {
        let mean = y.iter().zip(&self.mean).map(|(y, pi)| y * pi).sum();
        let gain = self.gain(y);
        (mean, y.iter().zip(&gain).map(|(y, g)| y * g).sum())
    }

    fn gain(&self, y: &[f64]) -> Vec<f64> {
        let p = y.len();
        let row = |i: usize| (0..p).map(|j| self.covariance[(i, j)] * y[j]).sum();
        (0..p).map(row).collect()
    }

    /// Kalman's update: p(π | t) from p(π), and p(t) on the way.
    fn observe(&mut self, y: &[f64], target: f64, noise_var: f64) {
        let (mean, var) = self.predict(y);
        let (gain, total) = (self.gain(y), var + noise_var);
        let error = target - mean;
        self.log_evidence -=
            0.5 * (error * error / total + total.ln() + std::f64::consts::TAU.ln());
        for i in 0..y.len() {
            self.mean[i] += gain[i] * error / total;
            for j in 0..y.len() {
                self.covariance[(i, j)] -= gain[i] * gain[j] / total;
            }
        }
    }
}

fn row(matrix: MatRef<'_, f64>, row: usize) -> Vec<f64> {
    matrix.row(row).iter().copied().collect()
}

#[test]
fn process_is_linear_regression_one_sample_at_a_time() {
    let mut rng = ChaCha8Rng::seed_from_u64(32);
    let (y, y_test) = (
        draws(&mut rng, 30, PARAMETERS),
        draws(&mut rng, 5, PARAMETERS),
    );
    let targets: Vec<f64> = row(draws(&mut rng, 30, 1).transpose(), 0);
    let root = draws(&mut rng, PARAMETERS, PARAMETERS);
    let prior = RigidBody::new(root.as_ref(), 1.7).unwrap();
    let noise_std = 0.3;

    let mut beliefs = Sequential::new(prior.parameter_covariance());
    for (idx, target) in targets.iter().enumerate() {
        beliefs.observe(&row(y.as_ref(), idx), *target, noise_std * noise_std);
    }
    let value = log_marginal_likelihood(&prior, noise_std, y.as_ref(), &targets).unwrap();
    // Condition of K + σ²I: tr K/σ² is below 30·4·8/0.09 ≈ 10⁴.
    let tolerance = 1e4 * 30.0 * f64::EPSILON;
    let error = (value - beliefs.log_evidence).abs();
    assert!(
        error <= tolerance * value.abs(),
        "{value} {}",
        beliefs.log_evidence
    );

    let posterior = Posterior::dense(prior, noise_std, y.as_ref(), &targets).unwrap();
    let prediction = posterior.predict(y_test.as_ref()).unwrap();
    for idx in 0..5 {
        let (mean, var) = beliefs.predict(&row(y_test.as_ref(), idx));
        let errors = [prediction.mean[idx] - mean, prediction.var[idx] - var];
        assert!(errors.iter().all(|e| e.abs() <= tolerance), "{errors:?}");
    }
}

/// Torques of known parameters with a little noise, inputs of one joint beside them.
struct Made {
    x: Mat<f64>,
    y: Mat<f64>,
    targets: Vec<f64>,
}

const TRUE: [f64; PARAMETERS] = [3.0, -1.0, 0.5, 2.0];

impl Made {
    fn new(n: usize, seed: u64, beside: impl Fn(f64) -> f64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (x, y) = (draws(&mut rng, n, 3), draws(&mut rng, n, PARAMETERS));
        let linear = |i: usize| (0..PARAMETERS).map(|j| y[(i, j)] * TRUE[j]).sum::<f64>();
        let targets = (0..n).map(|i| linear(i) + beside(x[(i, 0)])).collect();
        Self { x, y, targets }
    }

    fn samples(&self) -> RegressorSamples<'_> {
        RegressorSamples {
            x: self.x.as_ref(),
            regressor: self.y.as_ref(),
            targets: &self.targets,
        }
    }

    fn mean_square_error(&self, predictions: &[f64]) -> f64 {
        let errors = predictions.iter().zip(&self.targets);
        errors.map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / self.targets.len() as f64
    }
}

fn options() -> FitOptions {
    FitOptions {
        starts: Starts::Chapter,
        ..FitOptions::several()
    }
}

#[test]
fn exact_parameters_leave_nothing_to_learn() {
    let (train, test) = (Made::new(3, 1, |_| 0.0), Made::new(20, 2, |_| 0.0));
    let prior = ParameterPrior {
        mean: TRUE.to_vec(),
        std: vec![0.0; PARAMETERS],
    };
    let fit = fit_rigid_body(train.samples(), &prior, &options()).unwrap();
    let prediction = fit.predict(test.x.as_ref(), test.y.as_ref()).unwrap();
    // Four products and their sum.
    assert!(test.mean_square_error(&prediction.mean).sqrt() <= 40.0 * f64::EPSILON);
    assert!(prediction.var.iter().all(|var| *var == 0.0));
}

#[test]
fn spread_is_learned_from_how_wrong_the_mean_is() {
    let train = Made::new(40, 3, |_| 0.0);
    let fit_with = |mean: Vec<f64>| {
        let std = vec![1.0; PARAMETERS];
        let prior = ParameterPrior { mean, std };
        let fit = fit_rigid_body(train.samples(), &prior, &options()).unwrap();
        fit.fit.posterior.covariance().inner().spread()
    };
    let near = fit_with(TRUE.map(|pi| pi + 0.01).to_vec());
    let far = fit_with(TRUE.map(|pi| pi + 10.0).to_vec());
    // The likelihood of s given π is that of four draws of N(0, s²): s ≈ |π − π₀|/√4.
    assert!((0.005..0.02).contains(&near), "{near}");
    assert!((9.0..11.0).contains(&far), "{far}");
}

#[test]
fn a_process_takes_what_the_parameters_leave() {
    let beside = |x: f64| (4.0 * x).sin();
    let (train, test) = (Made::new(60, 4, beside), Made::new(200, 5, beside));
    let prior = ParameterPrior {
        mean: vec![0.0; PARAMETERS],
        std: vec![2.0; PARAMETERS],
    };
    let alone = fit_rigid_body(train.samples(), &prior, &options()).unwrap();
    let both = fit_rigid_body_and_process(train.samples(), &prior, TorqueForm::Smooth, &options())
        .unwrap();
    let error = |means: Vec<f64>| test.mean_square_error(&means);
    let of_alone = error(
        alone
            .predict_mean(test.x.as_ref(), test.y.as_ref())
            .unwrap(),
    );
    let of_both = error(both.predict_mean(test.x.as_ref(), test.y.as_ref()).unwrap());
    // Alone it cannot be better than the mean square of a sine about its linear part.
    assert!(of_alone > 0.1 && of_both < 1e-3, "{of_alone} {of_both}");
    assert!(both.fit.log_marginal() > alone.fit.log_marginal());
}

#[test]
fn a_mean_is_that_of_the_parameters_and_that_of_the_process() {
    let beside = |x: f64| (4.0 * x).sin();
    let (train, test) = (Made::new(60, 4, beside), Made::new(50, 5, beside));
    let prior = ParameterPrior {
        mean: vec![1.0; PARAMETERS],
        std: vec![2.0; PARAMETERS],
    };
    let (x, y) = (test.x.as_ref(), test.y.as_ref());
    let linear = |pi: &[f64]| -> Vec<f64> {
        (0..50)
            .map(|i| row(y, i).iter().zip(pi).map(|(y, pi)| y * pi).sum())
            .collect()
    };
    let alone = fit_rigid_body(train.samples(), &prior, &options()).unwrap();
    let of_alone = linear(&alone.parameter_mean().unwrap());

    let form = TorqueForm::Smooth;
    let both = fit_rigid_body_and_process(train.samples(), &prior, form, &options()).unwrap();
    let parameters = both.parameter_mean().unwrap();
    let mut of_both = linear(&parameters);
    for (mean, process) in of_both.iter_mut().zip(both.process_mean(x).unwrap()) {
        *mean += process;
    }
    let whole = [
        alone.predict_mean(x, y).unwrap(),
        both.predict_mean(x, y).unwrap(),
    ];
    for (parts, whole) in [of_alone, of_both].iter().zip(&whole) {
        for (part, whole) in parts.iter().zip(whole) {
            // Sums of 60 weights, which are tens of standard deviations over σ² ≥ 10⁻⁴.
            let tolerance = 60.0 * f64::EPSILON * 1e6;
            assert!((part - whole).abs() < tolerance, "{part} {whole}");
        }
    }
    // The sine has mean zero, and the parameters are those that made the rest.
    for (found, expected) in parameters.iter().zip(TRUE) {
        assert!((found - expected).abs() < 0.1, "{found} {expected}");
    }
}

#[test]
fn joints_teach_each_other_the_parameters_they_share() {
    // Two joints of two parameters: the first sees π₁ and π₁ + π₂ never apart.
    let first = [1.0, 1.0];
    let second = [0.0, 1.0];
    let y = Mat::from_fn(2, 2, |row, col| [first, second][row][col]);
    let prior = RigidBody::independent(&[1.0, 1.0], 100.0).unwrap();
    let joint = Posterior::dense(prior, 1e-2, y.as_ref(), &[5.0, 2.0]).unwrap();
    let unit = Mat::from_fn(1, 2, |_, col| if col == 0 { 1.0 } else { 0.0 });
    // π₁ = 5 − 2, shrunk by σ²/s² = 10⁻⁸ of itself, a few times.
    let mean = joint.predict_mean(unit.as_ref()).unwrap()[0];
    assert!((mean - 3.0).abs() < 1e-6, "{mean}");
}

#[test]
fn parameters_and_columns_must_match() {
    let made = Made::new(5, 6, |_| 0.0);
    let prior = ParameterPrior {
        mean: vec![0.0; 3],
        std: vec![1.0; 3],
    };
    let error = fit_rigid_body(made.samples(), &prior, &options()).unwrap_err();
    let expected = GpError::WrongCovariates {
        found: 4,
        expected: 3,
    };
    assert_eq!(error, expected);
}
