//! The covariance of one joint's torque, eq. (7): GPc, and GP¬c without friction.

use faer::{Mat, MatMut, MatRef};

use crate::constant::Constant;
use crate::coulomb::{Coulomb, write_signs};
use crate::covariance::Covariance;
use crate::error::KernelError;
use crate::features;
use crate::linear_ard::LinearArd;
use crate::params::ParamLayout;
use crate::revived::revive;
use crate::se_ard::SeArd;
use crate::sum::Sum;
use crate::torque_params::{TorqueForm, TorqueParams};

/// Covariance of one joint's torque as a function of x = (q, q̇, q̈), without noise.
///
/// ```text
/// c(x, x′) = b² + Σ_j u_j² x_j x′_j + v² exp(−½ Σ_j ((x_j − x′_j)/l_j)²)
///          + Σ_j w_j² sgn(q̇_j) sgn(q̇′_j)                    (GPc only)
/// ```
/// θ = (`bias_std`, `linear_std[3ℓ]`, `signal_std`, `length_scales[3ℓ]`,
/// `coulomb_std[ℓ]`): 7ℓ + 2 numbers, 6ℓ + 2 without friction.
/// The noise σ is not part of it; see [`crate::Jitter`].
/// # Source
/// Eqs. (5)–(7).
#[derive(Debug, Clone, PartialEq)]
pub struct TorqueCovariance {
    smooth: Sum<Sum<Constant, LinearArd>, SeArd>,
    coulomb: Option<Coulomb>,
}

impl TorqueCovariance {
    /// The covariance with given hyperparameters.
    ///
    /// # Errors
    /// [`KernelError::NotPositive`] for a value that is not finite and above zero;
    /// [`KernelError::WrongCount`] unless there is one linear weight and one length
    /// scale per covariate, and three covariates per Coulomb weight.
    pub fn new(params: TorqueParams) -> Result<Self, KernelError> {
        let n_covariates = params.linear_std.len();
        expect_count("length_scales", params.length_scales.len(), n_covariates)?;
        expect_count("linear_std", n_covariates, 3 * (n_covariates / 3))?;
        if let Some(coulomb_std) = &params.coulomb_std {
            expect_count("coulomb_std", coulomb_std.len(), n_covariates / 3)?;
        }

        let bias_linear = Sum::new(
            Constant::new(params.bias_std)?,
            LinearArd::new(params.linear_std)?,
        );
        let se = SeArd::new(params.signal_std, params.length_scales)?;
        Ok(Self {
            smooth: Sum::new(bias_linear, se),
            coulomb: params.coulomb_std.map(Coulomb::new).transpose()?,
        })
    }

    /// The covariance whose hyperparameters are all 1.
    ///
    /// # Panics
    /// If `n_joints` is zero.
    pub fn unit(n_joints: usize, form: TorqueForm) -> Self {
        assert!(n_joints > 0, "a robot has at least one joint");
        let coulomb_std = match form {
            TorqueForm::Smooth => None,
            TorqueForm::Coulomb => Some(vec![1.0; n_joints]),
        };
        Self::new(TorqueParams {
            bias_std: 1.0,
            linear_std: vec![1.0; 3 * n_joints],
            signal_std: 1.0,
            length_scales: vec![1.0; 3 * n_joints],
            coulomb_std,
        })
        .expect("ones are positive and counted above")
    }

    /// The hyperparameters by name.
    pub fn named_params(&self) -> TorqueParams {
        TorqueParams {
            bias_std: self.constant().bias_std(),
            linear_std: self.linear().linear_std().to_vec(),
            signal_std: self.se().signal_std(),
            length_scales: self.se().length_scales().to_vec(),
            coulomb_std: self.coulomb.as_ref().map(|c| c.coulomb_std().to_vec()),
        }
    }

    /// With or without friction.
    pub fn form(&self) -> TorqueForm {
        match self.coulomb {
            None => TorqueForm::Smooth,
            Some(_) => TorqueForm::Coulomb,
        }
    }

    /// Number of joints ℓ.
    pub fn n_joints(&self) -> usize {
        self.se().length_scales().len() / 3
    }

    /// The bias term.
    pub fn constant(&self) -> &Constant {
        self.smooth.first().first()
    }

    /// The linear term.
    pub fn linear(&self) -> &LinearArd {
        self.smooth.first().second()
    }

    /// The squared-exponential term.
    pub fn se(&self) -> &SeArd {
        self.smooth.second()
    }

    /// The Coulomb term, if there is one.
    pub fn coulomb(&self) -> Option<&Coulomb> {
        self.coulomb.as_ref()
    }

    /// A weighted sum of values of c, from its gradient: Euler's theorem.
    ///
    /// ```text
    /// Σ_ab Q_ab c(x_a, x_b) = ½ Σ_i θ_i ∂/∂θ_i Σ_ab Q_ab c(x_a, x_b)      i over b, u, v, w
    /// ```
    /// as c is homogeneous of degree 2 in its standard deviations.
    /// # Shapes
    /// `gradient` in the order of θ; the entries of the length scales are not read.
    /// # Panics
    /// If there is not one entry per hyperparameter.
    pub fn sum_of_its_gradient(&self, gradient: &[f64]) -> f64 {
        assert_eq!(gradient.len(), self.n_params());
        let n_linear = 1 + 3 * self.n_joints();
        let (linear, rest) = gradient.split_at(n_linear);
        let (of_se, of_coulomb) = rest.split_at(n_linear);
        let of_features = linear.iter().chain(of_coulomb);
        let products = (self.weights().into_iter().zip(of_features)).map(|(w, slope)| w * slope);
        0.5 * (products.sum::<f64>() + self.se().signal_std() * of_se[0])
    }

    /// Number of features of the terms that are inner products of features.
    fn n_features(&self) -> usize {
        1 + 3 * self.n_joints() + self.coulomb.as_ref().map_or(0, |c| c.coulomb_std().len())
    }

    /// (1, x, sgn(q̇)): the features of bias, linear and Coulomb term, for one product.
    fn features(&self, x: MatRef<'_, f64>) -> Mat<f64> {
        let n_joints = self.n_joints();
        assert_eq!(
            x.ncols(),
            3 * n_joints,
            "x holds (q, qd, qdd) of each joint"
        );
        let mut features = Mat::zeros(x.nrows(), self.n_features());
        features.as_mut().col_mut(0).fill(1.0);
        features.as_mut().subcols_mut(1, x.ncols()).copy_from(x);
        if self.coulomb.is_some() {
            write_signs(
                x,
                n_joints,
                features.as_mut().subcols_mut(1 + x.ncols(), n_joints),
            );
        }
        features
    }

    /// (b, u, w): the weights of the features.
    fn weights(&self) -> Vec<f64> {
        let mut weights = vec![self.constant().bias_std()];
        weights.extend(self.linear().linear_std());
        weights.extend(self.coulomb.iter().flat_map(Coulomb::coulomb_std));
        weights
    }

    /// Adds the gradient of the weights to that of θ; returns the part of θ between them, that of the
    /// squared-exponential term.
    fn scatter<'a>(&self, of_weights: &[f64], gradient: &'a mut [f64]) -> &'a mut [f64] {
        let n_covariates = 3 * self.n_joints();
        let (of_linear, of_coulomb) = of_weights.split_at(1 + n_covariates);
        let (linear, rest) = gradient.split_at_mut(1 + n_covariates);
        let (se, coulomb) = rest.split_at_mut(1 + n_covariates);
        assert_eq!(coulomb.len(), of_coulomb.len());
        let targets = linear.iter_mut().chain(coulomb);
        for (target, value) in targets.zip(of_linear.iter().chain(of_coulomb)) {
            *target += value;
        }
        se
    }
}

fn expect_count(name: &'static str, found: usize, expected: usize) -> Result<(), KernelError> {
    if found == expected && found > 0 {
        return Ok(());
    }
    Err(KernelError::WrongCount {
        name,
        found,
        expected: expected.max(1),
    })
}

impl Covariance for TorqueCovariance {
    fn layout(&self) -> ParamLayout {
        let layout = self.smooth.layout();
        match &self.coulomb {
            Some(coulomb) => layout.followed_by(coulomb.layout()),
            None => layout,
        }
    }

    fn params(&self) -> Vec<f64> {
        let mut theta = self.smooth.params();
        if let Some(coulomb) = &self.coulomb {
            theta.extend(coulomb.params());
        }
        theta
    }

    fn set_params(&mut self, theta: &[f64]) {
        let (smooth, friction) = theta.split_at(self.smooth.n_params());
        self.smooth.set_params(smooth);
        match &mut self.coulomb {
            Some(coulomb) => coulomb.set_params(friction),
            None => assert!(friction.is_empty(), "more hyperparameters than GP¬c has"),
        }
    }

    fn add_gram(&self, x: MatRef<'_, f64>, mut out: MatMut<'_, f64>) {
        self.se().add_gram(x, out.as_mut());
        features::add_gram(self.features(x).as_ref(), &self.weights(), out);
    }

    fn add_cross(&self, x1: MatRef<'_, f64>, x2: MatRef<'_, f64>, mut out: MatMut<'_, f64>) {
        self.se().add_cross(x1, x2, out.as_mut());
        let (features1, features2) = (self.features(x1), self.features(x2));
        features::add_cross(features1.as_ref(), features2.as_ref(), &self.weights(), out);
    }

    fn add_diag(&self, x: MatRef<'_, f64>, out: &mut [f64]) {
        self.smooth.add_diag(x, out);
        if let Some(coulomb) = &self.coulomb {
            coulomb.add_diag(x, out);
        }
    }

    fn gram_adjoint(&self, x: MatRef<'_, f64>, adjoint: MatRef<'_, f64>, gradient: &mut [f64]) {
        let mut of_weights = vec![0.0; self.n_features()];
        features::add_adjoint(
            self.features(x).as_ref(),
            &self.weights(),
            adjoint,
            &mut of_weights,
        );
        let of_se = self.scatter(&of_weights, gradient);
        self.se().gram_adjoint(x, adjoint, of_se);
    }

    fn cross_adjoint(
        &self,
        x1: MatRef<'_, f64>,
        x2: MatRef<'_, f64>,
        adjoint: MatRef<'_, f64>,
        gradient: &mut [f64],
    ) {
        let mut of_weights = vec![0.0; self.n_features()];
        features::add_cross_adjoint(
            self.features(x1).as_ref(),
            self.features(x2).as_ref(),
            &self.weights(),
            adjoint,
            &mut of_weights,
        );
        let of_se = self.scatter(&of_weights, gradient);
        self.se().cross_adjoint(x1, x2, adjoint, of_se);
    }

    fn revived(&self, x: MatRef<'_, f64>, amplitude: f64) -> Vec<f64> {
        assert_eq!(x.ncols(), 3 * self.n_joints());
        let mut params = self.named_params();
        revive(&mut params, x, amplitude);
        let theta = Self::new(params).map(|revived| revived.params());
        theta.unwrap_or_else(|_| self.params())
    }

    fn n_params(&self) -> usize {
        self.n_features() + 1 + 3 * self.n_joints()
    }
}
