//! Covariances that are inner products of weighted features, Σ_j w_j² φ_j(x) φ_j(x′).
//!
//! The ARD linear term and the Coulomb term differ only in φ, so the matrix
//! products stand here once.

use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::{Accum, Mat, MatMut, MatRef, Par};
use linalg::sums::{dot, weighted_squares};
use linalg::{Threads, column_panels, for_each_column, row_panels};

/// Rows or columns of the Gram matrix that are worked on together.
const PANEL: usize = 128;

/// Features scaled by their weights, Φ diag(w), (n, p).
fn weighted(features: MatRef<'_, f64>, weights: &[f64]) -> Mat<f64> {
    let mut scaled = Mat::zeros(features.nrows(), features.ncols());
    for_each_column(features, |col, column| {
        for (target, feature) in scaled.col_as_slice_mut(col).iter_mut().zip(column) {
            *target = feature * weights[col];
        }
    });
    scaled
}

/// Adds Φ diag(w²) Φᵀ to the lower triangle of `out`.
pub(crate) fn add_gram(features: MatRef<'_, f64>, weights: &[f64], out: MatMut<'_, f64>) {
    let scaled = weighted(features, weights);
    let n = features.nrows();
    Threads::at_hand(n).for_each(column_panels(out, PANEL), |(first, panel)| {
        let (width, below) = (panel.ncols(), n - first - panel.ncols());
        let (mut on_diagonal, rest) = panel
            .subrows_mut(first, width + below)
            .split_at_row_mut(width);
        let own = scaled.as_ref().subrows(first, width); // (width, p)
        triangular::matmul(
            on_diagonal.as_mut(),
            BlockStructure::TriangularLower,
            Accum::Add,
            own,
            BlockStructure::Rectangular,
            own.transpose(),
            BlockStructure::Rectangular,
            1.0,
            Par::Seq,
        );
        let lower = scaled.as_ref().subrows(first + width, below);
        matmul(rest, Accum::Add, lower, own.transpose(), 1.0, Par::Seq);
    });
}

/// Adds Φ1 diag(w²) Φ2ᵀ to `out`; the first set is the longer one, if one is.
pub(crate) fn add_cross(
    features1: MatRef<'_, f64>,
    features2: MatRef<'_, f64>,
    weights: &[f64],
    out: MatMut<'_, f64>,
) {
    // All weights on the side that is usually the shorter.
    let variances: Vec<f64> = weights.iter().map(|weight| weight * weight).collect();
    let scaled2 = weighted(features2, &variances);
    matmul(
        out,
        Accum::Add,
        features1,
        scaled2.transpose(),
        1.0,
        Par::Seq,
    );
}

/// Adds Σ_j w_j² φ_j(x)² to every entry of `out`.
pub(crate) fn add_diag(features: MatRef<'_, f64>, weights: &[f64], out: &mut [f64]) {
    assert_eq!(out.len(), features.nrows());
    for_each_column(features, |col_idx, column| {
        let variance = weights[col_idx] * weights[col_idx];
        for (value, feature) in out.iter_mut().zip(column) {
            *value += variance * feature * feature;
        }
    });
}

/// Adds ∂/∂w_j tr(QᵀK) = 2 w_j φ_jᵀ Q φ_j to `gradient`, from the lower triangle of Q.
pub(crate) fn add_adjoint(
    features: MatRef<'_, f64>,
    weights: &[f64],
    adjoint: MatRef<'_, f64>,
    gradient: &mut [f64],
) {
    let (n, p) = (features.nrows(), features.ncols());
    assert_eq!((adjoint.nrows(), adjoint.ncols()), (n, n));
    assert_eq!(gradient.len(), p);

    // φᵀQφ = 2 φᵀ(strictly lower Q)φ + Σ_a Q_aa φ_a².
    let mut below = Mat::zeros(n, p); // (n, p)
    Threads::at_hand(n).for_each(row_panels(below.as_mut(), PANEL), |(first, mut rows)| {
        let height = rows.nrows();
        triangular::matmul(
            rows.as_mut(),
            BlockStructure::Rectangular,
            Accum::Replace,
            adjoint.submatrix(first, first, height, height),
            BlockStructure::StrictTriangularLower,
            features.subrows(first, height),
            BlockStructure::Rectangular,
            1.0,
            Par::Seq,
        );
        let left = adjoint.submatrix(first, 0, height, first);
        matmul(
            rows,
            Accum::Add,
            left,
            features.subrows(0, first),
            1.0,
            Par::Seq,
        );
    });
    let diagonal: Vec<f64> = (0..n).map(|row| adjoint[(row, row)]).collect();
    for_each_column(features, |col_idx, column| {
        let quadratic =
            2.0 * dot(column, below.col_as_slice(col_idx)) + weighted_squares(column, &diagonal);
        gradient[col_idx] += 2.0 * weights[col_idx] * quadratic;
    });
}

/// Adds Σ_ab Q_ab ∂K_ab/∂w_j = 2 w_j φ1_jᵀ Q φ2_j to `gradient`.
pub(crate) fn add_cross_adjoint(
    features1: MatRef<'_, f64>,
    features2: MatRef<'_, f64>,
    weights: &[f64],
    adjoint: MatRef<'_, f64>,
    gradient: &mut [f64],
) {
    let (n1, n2, p) = (features1.nrows(), features2.nrows(), features1.ncols());
    assert_eq!((adjoint.nrows(), adjoint.ncols()), (n1, n2));
    assert_eq!((features2.ncols(), gradient.len()), (p, p));

    // Qᵀφ1: the product with the longer set first leaves the shorter columns.
    let mut product = Mat::zeros(n2, p); // (n2, p)
    matmul(
        product.as_mut(),
        Accum::Replace,
        adjoint.transpose(),
        features1,
        1.0,
        Par::Seq,
    );
    for_each_column(features2, |col_idx, column| {
        let quadratic = dot(column, product.col_as_slice(col_idx));
        gradient[col_idx] += 2.0 * weights[col_idx] * quadratic;
    });
}
