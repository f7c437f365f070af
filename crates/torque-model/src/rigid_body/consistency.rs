//! Parameters that bodies can have, nearest to those that were learned.
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

use faer::{ColRef, Mat, MatRef};
use linalg::{Factor, ThinSvd, product, symmetric_eigen, thin_svd};
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
    let (nearest, impossible) = nearest_bodies(parameters, covariance)?;
    Ok((std::array::from_fn(|k| nearest[k]), !impossible.is_empty()))
}

/// The same of several bodies together, with the numbers of those that cannot be.
///
/// The others move, too, as far as the covariance says that it is not known which of them has what is not there.
/// # Shapes
/// `parameters` (10 bodies,), `covariance` of as many.
/// # Errors
/// As for one.
pub fn nearest_bodies(
    parameters: &[f64],
    covariance: Mat<f64>,
) -> Result<(Vec<f64>, Vec<usize>), TorqueError> {
    let bodies = parameters.chunks_exact(N_PARAMETERS);
    let (mut at, mut impossible) = (Vec::with_capacity(parameters.len()), Vec::new());
    for (number, body) in bodies.enumerate() {
        let (coordinates, can_be) = coordinates_near(body)?;
        at.extend(coordinates);
        if !can_be {
            impossible.push(number);
        }
    }
    if impossible.is_empty() {
        return Ok((parameters.to_vec(), impossible));
    }
    let metric = Factor::new(covariance).map_err(gp_core::GpError::from)?;
    let at = least_distance(&metric, at, parameters)?;
    let nearest = at.chunks_exact(N_PARAMETERS).map(body_of);
    Ok((nearest.flat_map(inside).collect(), impossible))
}

/// Coordinates of a body near ten parameters, and whether one can have them.
fn coordinates_near(parameters: &[f64]) -> Result<([f64; N_PARAMETERS], bool), TorqueError> {
    let eigen =
        symmetric_eigen(pseudo_inertia(parameters).as_ref()).map_err(gp_core::GpError::from)?;
    let largest = eigen.values[3].max(f64::MIN_POSITIVE);
    let clamped = Mat::from_fn(4, 4, |row, col| {
        let terms = (0..4).map(|k| {
            let value = eigen.values[k].max(FIRST_PART * largest);
            value * eigen.vectors[(row, k)] * eigen.vectors[(col, k)]
        });
        terms.sum()
    });
    let first = Factor::new(clamped).map_err(gp_core::GpError::from)?;
    let coordinates = TRIANGLE.map(|(row, col)| first.l()[(row, col)]);
    Ok((coordinates, eigen.values[0] >= 0.0 && parameters[0] > 0.0))
}

/// Levenberg & Marquardt's search for the coordinates of the bodies nearest to given parameters.
fn least_distance(
    metric: &Factor,
    mut at: Vec<f64>,
    parameters: &[f64],
) -> Result<Vec<f64>, TorqueError> {
    let distance = |at: &[f64]| {
        let bodies = at.chunks_exact(N_PARAMETERS).flat_map(body_of);
        let differences: Vec<f64> = bodies.zip(parameters).map(|(a, b)| a - b).collect();
        let residual = whitened(metric, ColRef::from_slice(&differences).as_mat().to_owned());
        (residual.col(0).squared_norm_l2(), residual)
    };
    let (mut least, mut residual) = distance(&at);
    let mut steps = DampedSteps::new(whitened(metric, jacobian(&at)))?;
    let mut damping = 1e-3;
    for _ in 0..STEPS {
        let step = steps.at(residual.as_ref(), damping);
        let next: Vec<f64> = at.iter().zip(&step).map(|(at, step)| at - step).collect();
        let (found, of_next) = distance(&next);
        if found < least {
            let is_settled = least - found <= SETTLED * least;
            (at, least, residual) = (next, found, of_next);
            damping = (0.3 * damping).max(1e-12);
            if is_settled {
                break;
            }
            steps = DampedSteps::new(whitened(metric, jacobian(&at)))?;
        } else {
            damping *= 4.0;
            if damping > 1e12 {
                break;
            }
        }
    }
    Ok(at)
}

/// Steps of any damping from one place, by singular values of the Jacobian: what is known a thousand times better of
/// some combinations than of others would be lost in JᵀJ.
struct DampedSteps {
    /// J D⁻¹, D its columns' lengths.
    svd: ThinSvd,
    lengths: Vec<f64>,
}

impl DampedSteps {
    fn new(mut jacobian: Mat<f64>) -> Result<Self, TorqueError> {
        let length = |norm: f64| if norm > 0.0 { norm } else { 1.0 };
        let lengths: Vec<f64> = jacobian
            .col_iter()
            .map(|col| length(col.norm_l2()))
            .collect();
        for (column, length) in jacobian.col_iter_mut().zip(&lengths) {
            column.iter_mut().for_each(|entry| *entry /= length);
        }
        let svd = thin_svd(jacobian.as_ref()).map_err(gp_core::GpError::from)?;
        Ok(Self { svd, lengths })
    }

    /// (JᵀJ + λ D²)⁻¹ Jᵀ r = D⁻¹ V diag(s/(s² + λ)) Uᵀ r
    fn at(&self, residual: MatRef<'_, f64>, damping: f64) -> Vec<f64> {
        let ThinSvd {
            left,
            values,
            right,
        } = &self.svd;
        let mut along = product(left.transpose(), residual);
        for (entry, s) in along.col_mut(0).iter_mut().zip(values) {
            *entry *= s / (s * s + damping);
        }
        let step = product(right.as_ref(), along.as_ref());
        step.col(0)
            .iter()
            .zip(&self.lengths)
            .map(|(step, length)| step / length)
            .collect()
    }
}

/// The body with its mass spread by a billionth more, so that rounding leaves it one.
fn inside(mut body: [f64; N_PARAMETERS]) -> [f64; N_PARAMETERS] {
    let more = MARGIN * (body[4] + body[6] + body[9]);
    for moment in [4, 6, 9] {
        body[moment] += more;
    }
    body
}

fn whitened(metric: &Factor, mut columns: Mat<f64>) -> Mat<f64> {
    metric.half_solve_in_place(columns.as_mut());
    columns
}

fn pseudo_inertia(p: &[f64]) -> Mat<f64> {
    let [m, x, y, z, xx, xy, yy, xz, yz, zz]: [f64; N_PARAMETERS] = std::array::from_fn(|k| p[k]);
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

fn factor_of(at: &[f64]) -> Mat<f64> {
    let mut l = Mat::zeros(4, 4);
    for (value, (row, col)) in at.iter().zip(TRIANGLE) {
        l[(row, col)] = *value;
    }
    l
}

fn body_of(at: &[f64]) -> [f64; N_PARAMETERS] {
    let l = factor_of(at);
    parameters_of(&product(l.as_ref(), l.transpose()))
}

/// ∂ψ/∂(coordinates) of bodies, each by its own: dP = dL Lᵀ + L dLᵀ.
fn jacobian(at: &[f64]) -> Mat<f64> {
    let mut jacobian = Mat::zeros(at.len(), at.len());
    for (body, of_body) in at.chunks_exact(N_PARAMETERS).enumerate() {
        let (l, first) = (factor_of(of_body), N_PARAMETERS * body);
        for (k, (row, col)) in TRIANGLE.into_iter().enumerate() {
            let mut change = Mat::zeros(4, 4);
            change[(row, col)] = 1.0;
            let half = product(change.as_ref(), l.transpose());
            let whole = Mat::from_fn(4, 4, |r, c| half[(r, c)] + half[(c, r)]);
            for (entry, value) in parameters_of(&whole).into_iter().enumerate() {
                jacobian[(first + entry, first + k)] = value;
            }
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

    /// Two bodies whose masses only their sum tells: what one lacks, the other gives.
    #[test]
    fn bodies_share_what_is_known_of_both() {
        let mut pair = [BODY, BODY].concat();
        (pair[0], pair[10]) = (-0.5, 4.5);
        let covariance = Mat::from_fn(20, 20, |row, col| match (row == col, row % 10, col % 10) {
            (true, 0, 0) => 1.0 + 1e-8,
            (false, 0, 0) => -1.0,
            (true, ..) => 1.0,
            _ => 0.0,
        });
        let metric = Factor::new(covariance.clone()).unwrap();
        let (nearest, impossible) = nearest_bodies(&pair, covariance).unwrap();
        assert_eq!(impossible, [0]);
        let distance = |bodies: &[f64]| {
            let mut error = Mat::from_fn(20, 1, |k, _| bodies[k] - pair[k]);
            metric.half_solve_in_place(error.as_mut());
            error.squared_norm_l2()
        };
        // Bodies are a convex set: where none is nearer on the way to any other, none is.
        let least = distance(&nearest);
        for number in 0..200_u32 {
            let other = |k: u32| (f64::from(number * 7919 + k * 104_729) * 0.618).fract() - 0.5;
            let other: Vec<f64> = (0..20).map(other).collect();
            let other = other.chunks_exact(N_PARAMETERS).flat_map(body_of);
            for size in [1e-6, 1e-4, 1e-2] {
                let between = nearest.iter().zip(other.clone());
                let between: Vec<f64> = between.map(|(a, b)| a + size * (b - a)).collect();
                let gain = 1.0 - distance(&between) / least;
                assert!(gain < 1e-5, "{number}, {size}: {gain}");
            }
        }
        assert!(nearest[0] > 0.0, "{nearest:?}");
        // A deviation of 1e-4 of the sum is as far as one of the difference by a kilogram.
        assert!((nearest[0] + nearest[10] - 4.0).abs() < 1e-4, "{nearest:?}");
        for body in nearest.chunks_exact(N_PARAMETERS) {
            let eigen = symmetric_eigen(pseudo_inertia(body).as_ref()).unwrap();
            assert!(eigen.values[0] >= 0.0, "{:?}", eigen.values);
        }
        let alone = nearest_body(&std::array::from_fn(|k| pair[k]), unit()).unwrap();
        let apart = Mat::identity(20, 20);
        let (nearest, _) = nearest_bodies(&pair, apart).unwrap();
        for (a, b) in nearest.iter().zip(alone.0.iter().chain(&pair[10..])) {
            // Two searches that end where the distance has fifteen digits.
            assert!((a - b).abs() < 1e-5, "{nearest:?}, {alone:?}");
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
