//! Ten parameters that a body can have, nearest to those that were learned.
//!
//! ```text
//! P = [½ tr(I) 1 − I, m c; (m c)ᵀ, m] ⪰ 0        the pseudo-inertia
//! min (ψ − ψ̂)ᵀ S (ψ − ψ̂)  over  P = L Lᵀ,  L lower triangular
//! ```
//! # Source
//! Wensing, Kim & Slotine 2018, "Linear matrix inequalities for physically consistent inertial parameter
//! identification", IEEE Robotics and Automation Letters 3(1); Rucker & Wensing 2022, "Smooth parameterization of
//! rigid-body inertia", 7(2), for Cholesky coordinates; without their logarithms here,
//! since the nearest body is often flat, which a logarithm never reaches.

use faer::{Mat, MatRef};
use linalg::{Factor, product, symmetric_eigen};
use puma_dyn::dynamics::N_PARAMETERS;

use crate::error::TorqueError;

/// Steps of the search.
const STEPS: usize = 2000;
/// Change of the distance at which it ends, as a part of it.
const SETTLED: f64 = 1e-15;
/// Least eigenvalue of the pseudo-inertia at the start, as a part of the largest.
const FIRST_PART: f64 = 1e-3;
/// Part of the moments of inertia by which the nearest body is inside the bodies that there can be.
const MARGIN: f64 = 1e-9;

/// Places of the entries of a lower triangle of order four.
const TRIANGLE: [(usize, usize); N_PARAMETERS] = [
    (0, 0),
    (1, 0),
    (1, 1),
    (2, 0),
    (2, 1),
    (2, 2),
    (3, 0),
    (3, 1),
    (3, 2),
    (3, 3),
];

/// The parameters of a body nearest to given ones, and whether these were not those of one.
///
/// Near is what the covariance of the given ones says: what the data determine stays.
/// # Shapes
/// `covariance` (10, 10).
/// # Errors
/// A covariance that is not positive definite; numbers that overflow.
pub fn nearest_body(
    parameters: &[f64; N_PARAMETERS],
    covariance: Mat<f64>,
) -> Result<([f64; N_PARAMETERS], bool), TorqueError> {
    let eigen =
        symmetric_eigen(pseudo_inertia(parameters).as_ref()).map_err(gp_core::GpError::from)?;
    if eigen.values[0] >= 0.0 && parameters[0] > 0.0 {
        return Ok((*parameters, false));
    }
    let metric = Factor::new(covariance).map_err(gp_core::GpError::from)?;
    let largest = eigen.values[3].max(f64::MIN_POSITIVE);
    let clamped = Mat::from_fn(4, 4, |row, col| {
        let terms = (0..4).map(|k| {
            let value = eigen.values[k].max(FIRST_PART * largest);
            value * eigen.vectors[(row, k)] * eigen.vectors[(col, k)]
        });
        terms.sum()
    });
    let first = Factor::new(clamped).map_err(gp_core::GpError::from)?;
    let mut at: [f64; N_PARAMETERS] = std::array::from_fn(|k| {
        let (row, col) = TRIANGLE[k];
        first.l()[(row, col)]
    });
    let distance = |at: &[f64; N_PARAMETERS]| {
        let residual = whitened(&metric, &difference(&body_of(at), parameters));
        (residual.col(0).squared_norm_l2(), residual)
    };
    let (mut least, mut residual) = distance(&at);
    let mut damping = 1e-3;
    for _ in 0..STEPS {
        let jacobian = whitened(&metric, &jacobian(&at));
        let step = damped_step(jacobian.as_ref(), residual.as_ref(), damping)?;
        let next: [f64; N_PARAMETERS] = std::array::from_fn(|k| at[k] - step[(k, 0)]);
        let (found, of_next) = distance(&next);
        if found < least {
            let is_settled = least - found <= SETTLED * least;
            (at, least, residual) = (next, found, of_next);
            damping = (0.3 * damping).max(1e-12);
            if is_settled {
                break;
            }
        } else {
            damping *= 4.0;
            if damping > 1e12 {
                break;
            }
        }
    }
    Ok((inside(body_of(&at)), true))
}

/// The body with its mass spread by a billionth more, so that rounding leaves it one.
fn inside(mut body: [f64; N_PARAMETERS]) -> [f64; N_PARAMETERS] {
    let more = MARGIN * (body[4] + body[6] + body[9]);
    for moment in [4, 6, 9] {
        body[moment] += more;
    }
    body
}

/// (JᵀJ + λ diag JᵀJ)⁻¹ Jᵀ r
fn damped_step(
    jacobian: MatRef<'_, f64>,
    residual: MatRef<'_, f64>,
    damping: f64,
) -> Result<Mat<f64>, TorqueError> {
    let mut normal = product(jacobian.transpose(), jacobian);
    let largest = (0..N_PARAMETERS)
        .map(|k| normal[(k, k)])
        .fold(0.0, f64::max);
    for k in 0..N_PARAMETERS {
        normal[(k, k)] += damping * normal[(k, k)] + 1e-14 * largest;
    }
    let mut step = product(jacobian.transpose(), residual);
    let factor = Factor::new(normal).map_err(gp_core::GpError::from)?;
    factor.solve_in_place(step.as_mut());
    Ok(step)
}

fn whitened(metric: &Factor, columns: &Mat<f64>) -> Mat<f64> {
    let mut columns = columns.clone();
    metric.half_solve_in_place(columns.as_mut());
    columns
}

fn difference(a: &[f64; N_PARAMETERS], b: &[f64; N_PARAMETERS]) -> Mat<f64> {
    Mat::from_fn(N_PARAMETERS, 1, |row, _| a[row] - b[row])
}

fn pseudo_inertia(p: &[f64; N_PARAMETERS]) -> Mat<f64> {
    let [m, x, y, z, xx, xy, yy, xz, yz, zz] = *p;
    let half = 0.5 * (xx + yy + zz);
    let rows = [
        [half - xx, -xy, -xz, x],
        [-xy, half - yy, -yz, y],
        [-xz, -yz, half - zz, z],
        [x, y, z, m],
    ];
    Mat::from_fn(4, 4, |row, col| rows[row][col])
}

/// The ten parameters of a pseudo-inertia: I = tr(Σ) 1 − Σ.
fn parameters_of(p: &Mat<f64>) -> [f64; N_PARAMETERS] {
    let trace = p[(0, 0)] + p[(1, 1)] + p[(2, 2)];
    [
        p[(3, 3)],
        p[(0, 3)],
        p[(1, 3)],
        p[(2, 3)],
        trace - p[(0, 0)],
        -p[(0, 1)],
        trace - p[(1, 1)],
        -p[(0, 2)],
        -p[(1, 2)],
        trace - p[(2, 2)],
    ]
}

fn factor_of(at: &[f64; N_PARAMETERS]) -> Mat<f64> {
    let mut l = Mat::zeros(4, 4);
    for (value, (row, col)) in at.iter().zip(TRIANGLE) {
        l[(row, col)] = *value;
    }
    l
}

fn body_of(at: &[f64; N_PARAMETERS]) -> [f64; N_PARAMETERS] {
    let l = factor_of(at);
    parameters_of(&product(l.as_ref(), l.transpose()))
}

/// ∂ψ/∂(coordinates), (10, 10): dP = dL Lᵀ + L dLᵀ.
fn jacobian(at: &[f64; N_PARAMETERS]) -> Mat<f64> {
    let l = factor_of(at);
    let mut jacobian = Mat::zeros(N_PARAMETERS, N_PARAMETERS);
    for (k, (row, col)) in TRIANGLE.into_iter().enumerate() {
        let mut change = Mat::zeros(4, 4);
        change[(row, col)] = 1.0;
        let half = product(change.as_ref(), l.transpose());
        let whole = Mat::from_fn(4, 4, |r, c| half[(r, c)] + half[(c, r)]);
        for (entry, value) in parameters_of(&whole).into_iter().enumerate() {
            jacobian[(entry, k)] = value;
        }
    }
    jacobian
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 2 kg at (0.1, 0, 0.2) m, a cube's moments about its centre.
    const BODY: [f64; N_PARAMETERS] = [2.0, 0.2, 0.0, 0.4, 0.09, 0.0, 0.11, -0.04, 0.0, 0.03];

    fn unit() -> Mat<f64> {
        Mat::identity(N_PARAMETERS, N_PARAMETERS)
    }

    #[test]
    fn a_body_stays_to_the_bit() {
        assert_eq!(nearest_body(&BODY, unit()).unwrap(), (BODY, false));
    }

    #[test]
    fn what_no_body_has_becomes_the_nearest_that_one_has() {
        let mut wrong = BODY;
        wrong[4] = -0.3; // a negative moment of inertia
        let (nearest, acted) = nearest_body(&wrong, unit()).unwrap();
        assert!(acted);
        let eigen = symmetric_eigen(pseudo_inertia(&nearest).as_ref()).unwrap();
        assert!(eigen.values[0] >= 0.0, "{:?}", eigen.values);
        let square = |a: &[f64; N_PARAMETERS]| -> f64 {
            a.iter().zip(&wrong).map(|(a, b)| (a - b).powi(2)).sum()
        };
        // No body in any direction from it is nearer: bodies made of coordinates near its own, and far ones.
        let start = [-1.0_f64, 0.0, -1.0, 0.1, 0.0, -1.0, 0.2, 0.1, 0.3, 0.2];
        let mut state = 1_u64;
        let mut random = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        for size in [0.01, 0.3, 3.0] {
            for _ in 0..2000 {
                let other: [f64; N_PARAMETERS] =
                    std::array::from_fn(|k| start[k] + size * random());
                let other = body_of(&other);
                let between: [f64; N_PARAMETERS] =
                    std::array::from_fn(|k| nearest[k] + 0.01 * (other[k] - nearest[k]));
                // Bodies are a convex set, so what is between two of them is one.
                let gain = 1.0 - square(&between) / square(&nearest);
                assert!(gain < 1e-5, "{gain}");
            }
        }
    }

    #[test]
    fn what_the_data_determine_stays() {
        let mut wrong = BODY;
        wrong[4] = -0.3;
        let covariance = Mat::from_fn(N_PARAMETERS, N_PARAMETERS, |row, col| {
            match (row == col, row) {
                (false, _) => 0.0,
                (true, 0..4) => 1e-8,
                (true, _) => 1.0,
            }
        });
        let (nearest, _) = nearest_body(&wrong, covariance).unwrap();
        for (a, b) in nearest[..4].iter().zip(&wrong) {
            assert!((a - b).abs() < 1e-3, "{nearest:?}");
        }
    }

    #[test]
    fn the_derivative_is_that_of_differences() {
        let at = [-1.0, 0.2, -0.7, 0.1, -0.3, -1.2, 0.4, 0.1, 0.3, 0.2];
        let exact = jacobian(&at);
        for k in 0..N_PARAMETERS {
            let step = 1e-6;
            let moved = |sign: f64| {
                let mut moved = at;
                moved[k] += sign * step;
                body_of(&moved)
            };
            for (row, (up, down)) in moved(1.0).iter().zip(moved(-1.0)).enumerate() {
                let difference = (up - down) / (2.0 * step);
                // Second differences of numbers near one: ε/step and step².
                assert!((difference - exact[(row, k)]).abs() < 1e-8, "{row} {k}");
            }
        }
    }
}
