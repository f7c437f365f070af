//! The starting values of eq. (22), from the moments of the data.

use faer::MatRef;
use kernels::params::{LINEAR_STD_CEILING, NOISE_VAR_FLOOR};
use kernels::{ContinuousJoints, TorqueCovariance, TorqueForm, TorqueParams, Transform};

use crate::data::{joints_of, require_training_data};
use crate::error::GpError;
use crate::search::{Origin, Start};

/// A column whose spread is below this part of its size is taken for constant.
const CONSTANT_COLUMN: f64 = 1e-12;

/// Starting values of eq. (22).
///
/// ```text
/// b² = v² = ¼ t̄²,  u_j² = ¼ t̄²/(3ℓ s_j),  w_j² = ¼ t̄²/ℓ,  σ² = 0.01 t̄²,  l_j² = s_j − m_j²
/// ```
/// with t̄² the mean of the squared targets, m_j and s_j the mean of covariate j
/// and of its square.
/// Where the formula has no usable value: t̄² = 0 counts as 100 times the floor of
/// σ²; a covariate that is always zero counts as s_j = 1; a constant covariate has
/// l_j = 1; u_j and σ² are moved inside their bounds.
/// Of the angle of a continuous joint s_j is 1, and l_j² the spread of its places in the plane: the sums of the
/// formula over its cosine and its sine.
/// # Errors
/// Fewer than 2 samples, data that is not finite or does not match, or columns
/// that are not three per joint; [`GpError::Kernel`] for a continuous joint that there is not.
/// # Source
/// Eq. (22), A.1.
pub fn chapter_start(
    x: MatRef<'_, f64>,
    targets: &[f64],
    form: TorqueForm,
    continuous: &ContinuousJoints,
) -> Result<Start, GpError> {
    require_training_data(x, targets, 2)?;
    let n_joints = joints_of(x)?;
    let target_power = mean_square(targets.iter().copied());
    let target_power = if target_power > 0.0 {
        target_power
    } else {
        100.0 * NOISE_VAR_FLOOR
    };
    let share = 0.25 * target_power;
    let n_covariates = 3 * n_joints;

    let of_joints = TorqueCovariance::unit(n_joints, form).with_continuous(continuous.clone())?;
    let embedded = continuous.embed(x);
    let z = embedded.as_ref();
    let coordinates = |j: usize| continuous.columns_of(j, n_covariates);
    let columns = 0..n_covariates;
    let params = TorqueParams {
        bias_std: share.sqrt(),
        linear_std: columns
            .clone()
            .map(|j| linear_std_start(z, coordinates(j), share / n_covariates as f64))
            .collect(),
        signal_std: share.sqrt(),
        length_scales: columns
            .map(|j| length_scale_start(z, coordinates(j)))
            .collect(),
        coulomb_std: match form {
            TorqueForm::Smooth => None,
            TorqueForm::Coulomb => Some(vec![(share / n_joints as f64).sqrt(); n_joints]),
        },
    };
    // DEVIATION(eq. 22): σ² starts at 2·10⁻⁴ where 0.01 t̄² is below that, as a start on
    // its bound could not move.
    let noise_bound = Transform::SquareAbove {
        floor: NOISE_VAR_FLOOR,
    };
    let noise_std = noise_bound.clamp_inside((0.01 * target_power).sqrt());
    Ok(Start::new(
        Origin::Chapter,
        of_joints.with_params(params)?,
        noise_std,
    ))
}

/// A start derived from that of eq. (22): itself for an origin that is no variation of it.
///
/// # Errors
/// [`GpError::Kernel`] if scaling takes a hyperparameter out of double precision.
pub fn varied_start(chapter: &Start, origin: Origin) -> Result<Start, GpError> {
    let n_joints = chapter.covariance.n_joints();
    let typical = (3.0 * n_joints as f64).sqrt();
    let (stretch, noise_var_factor): ([f64; 3], f64) = match origin {
        Origin::TypicalPairs => ([typical; 3], 1.0),
        Origin::TypicalPairsLowNoise => ([typical; 3], 0.01),
        Origin::SlowInRates => ([typical, 10.0 * typical, 30.0 * typical], 0.01),
        _ => ([1.0; 3], 1.0),
    };
    let mut params = chapter.covariance.named_params();
    let blocks = params.length_scales.chunks_mut(n_joints);
    for (of_block, stretch) in blocks.zip(stretch) {
        for length_scale in of_block {
            *length_scale *= stretch;
        }
    }
    let noise_bound = Transform::SquareAbove {
        floor: NOISE_VAR_FLOOR,
    };
    let noise_std = noise_bound.clamp_inside(chapter.noise_std * noise_var_factor.sqrt());
    Ok(Start::new(
        origin,
        chapter.covariance.with_params(params)?,
        noise_std,
    ))
}

/// u_j with u_j² s_j = `share`.
fn linear_std_start(
    z: MatRef<'_, f64>,
    coordinates: impl Iterator<Item = usize>,
    share: f64,
) -> f64 {
    let power: f64 = coordinates
        .map(|column| mean_square(z.col(column).iter().copied()))
        .sum();
    let power = if power > 0.0 { power } else { 1.0 };
    let bound = Transform::Below {
        ceiling: LINEAR_STD_CEILING,
    };
    bound.clamp_inside((share / power).sqrt())
}

/// l_j with l_j² = s_j − m_j², formed from deviations so that nothing cancels.
fn length_scale_start(z: MatRef<'_, f64>, coordinates: impl Iterator<Item = usize>) -> f64 {
    let (mut variance, mut power) = (0.0, 0.0);
    for column in coordinates {
        let values = || z.col(column).iter().copied();
        let mean = values().sum::<f64>() / z.nrows() as f64;
        variance += mean_square(values().map(|value| value - mean));
        power += mean_square(values());
    }
    let (spread, size) = (variance.sqrt(), power.sqrt());
    if spread > CONSTANT_COLUMN * size {
        spread
    } else {
        1.0
    }
}

fn mean_square(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    values.map(|value| value * value).sum::<f64>() / count
}
