//! The covariance of one joint's torque, eq. (7): GPc, and GP¬c without friction.

use faer::{Mat, MatMut, MatRef};

use crate::constant::Constant;
use crate::continuous::{ContinuousJoints, Embedded};
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
///
/// Of a joint that turns without end, see [`TorqueCovariance::with_continuous`], cos(q_j − q′_j) stands for q_j q′_j
/// and the chord 2 sin ½(q_j − q′_j) for q_j − q′_j: θ has as many numbers, u_j in torque units, l_j without unit.
/// # Source
/// Eqs. (5)–(7).
#[derive(Debug, Clone, PartialEq)]
pub struct TorqueCovariance {
    /// Of embedded states.
    smooth: Sum<Sum<Constant, LinearArd>, SeArd>,
    coulomb: Option<Coulomb>,
    continuous: ContinuousJoints,
}

impl TorqueCovariance {
    /// The covariance with given hyperparameters.
    ///
    /// # Errors
    /// [`KernelError::NotPositive`] for a value that is not finite and above zero;
    /// [`KernelError::WrongCount`] unless there is one linear weight and one length
    /// scale per covariate, and three covariates per Coulomb weight.
    pub fn new(params: TorqueParams) -> Result<Self, KernelError> {
        Self::build(params, ContinuousJoints::none())
    }

    fn build(params: TorqueParams, continuous: ContinuousJoints) -> Result<Self, KernelError> {
        let n_covariates = params.linear_std.len();
        expect_count("length_scales", params.length_scales.len(), n_covariates)?;
        expect_count("linear_std", n_covariates, 3 * (n_covariates / 3))?;
        if let Some(coulomb_std) = &params.coulomb_std {
            expect_count("coulomb_std", coulomb_std.len(), n_covariates / 3)?;
        }
        if let Some(last) = continuous.indices().last() {
            let n_joints = n_covariates / 3;
            expect_count("continuous joints", n_joints, n_joints.max(last + 1))?;
        }

        let bias_linear = Sum::new(
            Constant::new(params.bias_std)?,
            LinearArd::new(continuous.repeated(&params.linear_std))?,
        );
        let length_scales = continuous.repeated(&params.length_scales);
        Ok(Self {
            smooth: Sum::new(bias_linear, SeArd::new(params.signal_std, length_scales)?),
            coulomb: params.coulomb_std.map(Coulomb::new).transpose()?,
            continuous,
        })
    }

    /// The same hyperparameters, with some joints' positions as places on the circle.
    ///
    /// # Errors
    /// [`KernelError::WrongCount`] if there is no such joint.
    pub fn with_continuous(&self, continuous: ContinuousJoints) -> Result<Self, KernelError> {
        Self::build(self.named_params(), continuous)
    }

    /// Other hyperparameters, of the same joints.
    ///
    /// # Errors
    /// As for [`TorqueCovariance::new`].
    pub fn with_params(&self, params: TorqueParams) -> Result<Self, KernelError> {
        Self::build(params, self.continuous.clone())
    }

    /// The joints whose positions are places on the circle.
    pub fn continuous(&self) -> &ContinuousJoints {
        &self.continuous
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
        let n_covariates = 3 * self.n_joints();
        let mut params = self.embedded_params();
        params.linear_std.truncate(n_covariates);
        params.length_scales.truncate(n_covariates);
        params
    }

    /// The same with one weight and one length scale per column of embedded states, see [`ContinuousJoints`].
    pub fn embedded_params(&self) -> TorqueParams {
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
        (self.n_embedded() - self.continuous.indices().len()) / 3
    }

    /// Columns of embedded states.
    fn n_embedded(&self) -> usize {
        self.se().length_scales().len()
    }

    /// The bias term.
    pub fn constant(&self) -> &Constant {
        self.smooth.first().first()
    }

    /// The linear term, of embedded states.
    pub fn linear(&self) -> &LinearArd {
        self.smooth.first().second()
    }

    /// The squared-exponential term, of embedded states.
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
        let bias_std = self.constant().bias_std();
        let linear_std = &self.linear().linear_std()[..n_linear - 1];
        let coulomb_std = self.coulomb.iter().flat_map(Coulomb::coulomb_std);
        let weights = std::iter::once(&bias_std)
            .chain(linear_std)
            .chain(coulomb_std);
        let of_features = linear.iter().chain(of_coulomb);
        let products = weights.zip(of_features).map(|(w, slope)| w * slope);
        0.5 * (products.sum::<f64>() + self.se().signal_std() * of_se[0])
    }

    /// Number of features of the terms that are inner products of features.
    fn n_features(&self) -> usize {
        1 + self.n_embedded() + self.coulomb.as_ref().map_or(0, |c| c.coulomb_std().len())
    }

    /// The states as the smooth terms see them.
    fn embed<'a>(&self, x: MatRef<'a, f64>) -> Embedded<'a> {
        assert_eq!(
            x.ncols(),
            3 * self.n_joints(),
            "x holds (q, qd, qdd) of each joint"
        );
        self.continuous.embed(x)
    }

    /// (1, z, sgn(q̇)): the features of bias, linear and Coulomb term, for one product.
    fn features(&self, z: MatRef<'_, f64>) -> Mat<f64> {
        let n_joints = self.n_joints();
        let mut features = Mat::zeros(z.nrows(), self.n_features());
        features.as_mut().col_mut(0).fill(1.0);
        features.as_mut().subcols_mut(1, z.ncols()).copy_from(z);
        if self.coulomb.is_some() {
            write_signs(
                z,
                n_joints,
                features.as_mut().subcols_mut(1 + z.ncols(), n_joints),
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

    /// Adds the gradient of the weights of the features and that of the squared-exponential term to that of θ.
    ///
    /// # Shapes
    /// `of_weights` (`n_features`,); `of_se` adds to its argument, (1 + embedded columns,).
    fn add_gradient(
        &self,
        of_weights: &[f64],
        gradient: &mut [f64],
        of_se: impl FnOnce(&mut [f64]),
    ) {
        let n_covariates = 3 * self.n_joints();
        let (of_linear, of_coulomb) = of_weights.split_at(1 + self.n_embedded());
        let (linear, rest) = gradient.split_at_mut(1 + n_covariates);
        let (se, coulomb) = rest.split_at_mut(1 + n_covariates);
        assert_eq!(coulomb.len(), of_coulomb.len());

        linear[0] += of_linear[0];
        self.continuous
            .add_folded(&of_linear[1..], &mut linear[1..]);
        for (target, value) in coulomb.iter_mut().zip(of_coulomb) {
            *target += value;
        }
        if self.continuous.is_empty() {
            return of_se(se);
        }
        let mut embedded = vec![0.0; 1 + self.n_embedded()];
        of_se(&mut embedded);
        se[0] += embedded[0];
        self.continuous.add_folded(&embedded[1..], &mut se[1..]);
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
        let n_covariates = 3 * self.n_joints();
        let layout = (self.constant().layout())
            .followed_by(self.linear().layout().first(n_covariates))
            .followed_by(self.se().layout().first(1 + n_covariates));
        match &self.coulomb {
            Some(coulomb) => layout.followed_by(coulomb.layout()),
            None => layout,
        }
    }

    fn params(&self) -> Vec<f64> {
        let n_covariates = 3 * self.n_joints();
        let mut theta = vec![self.constant().bias_std()];
        theta.extend(&self.linear().linear_std()[..n_covariates]);
        theta.push(self.se().signal_std());
        theta.extend(&self.se().length_scales()[..n_covariates]);
        theta.extend(self.coulomb.iter().flat_map(Coulomb::coulomb_std));
        theta
    }

    fn set_params(&mut self, theta: &[f64]) {
        let n_linear = 1 + 3 * self.n_joints();
        let (linear, rest) = theta.split_at(n_linear);
        let (se, friction) = rest.split_at(n_linear);
        let mut smooth = vec![linear[0]];
        smooth.extend(self.continuous.repeated(&linear[1..]));
        smooth.push(se[0]);
        smooth.extend(self.continuous.repeated(&se[1..]));
        self.smooth.set_params(&smooth);
        match &mut self.coulomb {
            Some(coulomb) => coulomb.set_params(friction),
            None => assert!(friction.is_empty(), "more hyperparameters than GP¬c has"),
        }
    }

    fn add_gram(&self, x: MatRef<'_, f64>, mut out: MatMut<'_, f64>) {
        let embedded = self.embed(x);
        let z = embedded.as_ref();
        self.se().add_gram(z, out.as_mut());
        features::add_gram(self.features(z).as_ref(), &self.weights(), out);
    }

    fn add_cross(&self, x1: MatRef<'_, f64>, x2: MatRef<'_, f64>, mut out: MatMut<'_, f64>) {
        let (embedded1, embedded2) = (self.embed(x1), self.embed(x2));
        let (z1, z2) = (embedded1.as_ref(), embedded2.as_ref());
        self.se().add_cross(z1, z2, out.as_mut());
        let (features1, features2) = (self.features(z1), self.features(z2));
        features::add_cross(features1.as_ref(), features2.as_ref(), &self.weights(), out);
    }

    fn add_diag(&self, x: MatRef<'_, f64>, out: &mut [f64]) {
        self.smooth.add_diag(self.embed(x).as_ref(), out);
        if let Some(coulomb) = &self.coulomb {
            coulomb.add_diag(x, out);
        }
    }

    fn gram_adjoint(&self, x: MatRef<'_, f64>, adjoint: MatRef<'_, f64>, gradient: &mut [f64]) {
        let embedded = self.embed(x);
        let z = embedded.as_ref();
        let mut of_weights = vec![0.0; self.n_features()];
        features::add_adjoint(
            self.features(z).as_ref(),
            &self.weights(),
            adjoint,
            &mut of_weights,
        );
        self.add_gradient(&of_weights, gradient, |of_se| {
            self.se().gram_adjoint(z, adjoint, of_se);
        });
    }

    fn cross_adjoint(
        &self,
        x1: MatRef<'_, f64>,
        x2: MatRef<'_, f64>,
        adjoint: MatRef<'_, f64>,
        gradient: &mut [f64],
    ) {
        let (embedded1, embedded2) = (self.embed(x1), self.embed(x2));
        let (z1, z2) = (embedded1.as_ref(), embedded2.as_ref());
        let mut of_weights = vec![0.0; self.n_features()];
        features::add_cross_adjoint(
            self.features(z1).as_ref(),
            self.features(z2).as_ref(),
            &self.weights(),
            adjoint,
            &mut of_weights,
        );
        self.add_gradient(&of_weights, gradient, |of_se| {
            self.se().cross_adjoint(z1, z2, adjoint, of_se);
        });
    }

    fn revived(&self, x: MatRef<'_, f64>, amplitude: f64) -> Vec<f64> {
        assert_eq!(x.ncols(), 3 * self.n_joints());
        let mut params = self.named_params();
        revive(&mut params, &self.continuous, x, amplitude);
        let theta = self.with_params(params).map(|revived| revived.params());
        theta.unwrap_or_else(|_| self.params())
    }

    fn n_params(&self) -> usize {
        let n_signs = self.coulomb.as_ref().map_or(0, |c| c.coulomb_std().len());
        2 * (1 + 3 * self.n_joints()) + n_signs
    }
}
