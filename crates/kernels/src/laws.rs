//! Laws that every covariance obeys, one function each; the tests of a crate run them on all covariances that it has.
//!
//! Feature `laws`, for tests alone: a law that does not hold is a panic that says by how much.

use faer::{Mat, Side};

use crate::covariance::Covariance;

/// A covariance, and what the laws are tried on.
pub struct Subject<'a> {
    /// For messages.
    pub name: &'a str,
    /// The covariance.
    pub cov: &'a mut dyn Covariance,
    /// Inputs.
    pub x: &'a Mat<f64>,
    /// Other inputs, in a number that is no multiple of a block or panel.
    pub other: &'a Mat<f64>,
    /// Rounding of one entry, of the matrix between x and the others too.
    pub tolerance: f64,
    /// Draws from [0, 1), for adjoints.
    pub draw: &'a mut dyn FnMut() -> f64,
}

/// c(X, X) = K, where the covariance is one of inputs and not of observations.
///
/// # Panics
/// If it does not hold.
pub fn cross_of_a_set_with_itself_is_its_gram_matrix(s: &mut Subject<'_>) {
    let x = s.x.as_ref();
    close(s, &s.cov.gram(x), &s.cov.cross(x, x));
}

/// c(X, X′) = c(X′, X)ᵀ.
///
/// # Panics
/// If it does not hold.
pub fn cross_is_symmetric_in_its_arguments(s: &mut Subject<'_>) {
    let (x, other) = (s.x.as_ref(), s.other.as_ref());
    let back = s.cov.cross(other, x);
    close(s, &s.cov.cross(x, other), &back.transpose().to_owned());
}

/// The diagonal that is asked for alone is that of K.
///
/// # Panics
/// If it does not hold.
pub fn diag_is_the_diagonal_of_the_gram_matrix(s: &mut Subject<'_>) {
    let (gram, diag) = (s.cov.gram(s.x.as_ref()), s.cov.diag(s.x.as_ref()));
    let largest = diag.iter().copied().fold(0.0, f64::max);
    let tolerance = 4.0 * s.x.ncols() as f64 * f64::EPSILON * largest;
    for (row, variance) in diag.iter().enumerate() {
        let entry = gram[(row, row)];
        let error = (entry - variance).abs();
        assert!(error <= tolerance, "{} {row}: {entry} {variance}", s.name);
    }
}

/// K ⪰ 0, to rounding.
///
/// # Panics
/// If it does not hold.
pub fn gram_matrix_is_positive_semi_definite(s: &mut Subject<'_>) {
    let gram = s.cov.gram(s.x.as_ref());
    let eigenvalues = gram.self_adjoint_eigenvalues(Side::Lower);
    let least = eigenvalues.expect("its entries are finite")[0];
    let tolerance = s.x.nrows() as f64 * s.tolerance;
    assert!(least >= -tolerance, "{}: least eigenvalue {least}", s.name);
}

/// `add_gram` and `add_cross` add to what is there.
///
/// # Panics
/// If it does not hold.
pub fn gram_and_cross_accumulate_on_what_is_there(s: &mut Subject<'_>) {
    let (x, other) = (s.x.as_ref(), s.other.as_ref());
    let (mut gram, mut cross) = (s.cov.gram(x), s.cov.cross(x, other));
    let (twice_gram, twice_cross) = (&gram + &gram, &cross + &cross);
    s.cov.add_gram(x, gram.as_mut());
    s.cov.add_cross(x, other, cross.as_mut());
    close(s, &lower(&gram), &lower(&twice_gram));
    close(s, &cross, &twice_cross);
}

/// Inputs may lie in memory in either order.
///
/// # Panics
/// If it does not hold.
pub fn transposed_views_give_the_same_values(s: &mut Subject<'_>) {
    let rows_in_memory = s.x.transpose().to_owned();
    let of_view = s.cov.gram(rows_in_memory.transpose());
    close(s, &s.cov.gram(s.x.as_ref()), &of_view);
}

/// As many names as parameters, and the parameters set are those that are read; the layout, with the units that a
/// search counts in, does not move with them.
///
/// # Panics
/// If it does not hold.
pub fn layout_names_every_parameter(s: &mut Subject<'_>) {
    let (theta, layout) = (s.cov.params(), s.cov.layout());
    assert_eq!(layout.len(), theta.len(), "{}", s.name);
    assert_eq!(s.cov.n_params(), theta.len(), "{}", s.name);
    let changed: Vec<f64> = theta.iter().map(|value| 2.0 * value).collect();
    s.cov.set_params(&changed);
    assert_eq!(s.cov.params(), changed, "{}", s.name);
    assert_eq!(s.cov.layout(), layout, "{}", s.name);
}

/// `gram_adjoint` is ∂/∂θ tr(QᵀK), and reads the lower triangle of Q alone.
///
/// # Panics
/// If it does not hold.
pub fn adjoint_is_the_gradient_by_central_differences(s: &mut Subject<'_>) {
    let n = s.x.nrows();
    let half = random_matrix(s.draw, n, n);
    let q = &half + half.transpose();
    // Only the lower triangle may be read.
    let seen = |row, col| if row >= col { q[(row, col)] } else { f64::NAN };
    let lower = Mat::from_fn(n, n, seen);
    let mut gradient = vec![0.0; s.cov.n_params()];
    s.cov
        .gram_adjoint(s.x.as_ref(), lower.as_ref(), &mut gradient);
    let x = s.x.as_ref();
    check_gradient(s, &q, &gradient, |cov| cov.gram(x));
}

/// `cross_adjoint` is ∂/∂θ Σ Q_ab c(x_a, x′_b), in whichever order Q lies in memory.
///
/// # Panics
/// If it does not hold.
pub fn cross_adjoint_is_the_gradient_by_central_differences(s: &mut Subject<'_>) {
    let (x, other) = (s.x.as_ref(), s.other.as_ref());
    let q = random_matrix(s.draw, x.nrows(), other.nrows());
    let mut gradient = vec![0.0; s.cov.n_params()];
    s.cov.cross_adjoint(x, other, q.as_ref(), &mut gradient);
    check_gradient(s, &q, &gradient, |cov| cov.cross(x, other));
    // As the rows of a matrix in memory.
    let transposed = q.transpose().to_owned();
    let mut again = vec![0.0; s.cov.n_params()];
    let view = transposed.transpose();
    s.cov.cross_adjoint(x, other, view, &mut again);
    for (a, b) in gradient.iter().zip(&again) {
        let error = (a - b).abs();
        assert!(error <= 1e-12 * a.abs().max(1.0), "{}: {a} {b}", s.name);
    }
}

/// `gram_adjoint` adds to what is there.
///
/// # Panics
/// If it does not hold.
pub fn adjoint_accumulates(s: &mut Subject<'_>) {
    let n = s.x.nrows();
    let q = Mat::from_fn(n, n, |row, col| if row == col { 1.0 } else { 0.25 });
    let mut once = vec![0.0; s.cov.n_params()];
    s.cov.gram_adjoint(s.x.as_ref(), q.as_ref(), &mut once);
    let mut again = once.clone();
    s.cov.gram_adjoint(s.x.as_ref(), q.as_ref(), &mut again);
    for (a, b) in once.iter().zip(&again) {
        let error = (2.0 * a - b).abs();
        // Every panel of columns adds to the sum, which is rounded once more each time.
        let tolerance = 4.0 * n.div_ceil(128) as f64 * f64::EPSILON * b.abs();
        assert!(error <= tolerance, "{}: {a} {b}", s.name);
    }
}

/// The triangle that Gram matrices are added to, with zeros above.
fn lower(k: &Mat<f64>) -> Mat<f64> {
    let entry = |row, col| if row >= col { k[(row, col)] } else { 0.0 };
    Mat::from_fn(k.nrows(), k.ncols(), entry)
}

/// Entry by entry within the subject's tolerance.
fn close(s: &Subject<'_>, one: &Mat<f64>, other: &Mat<f64>) {
    for col in 0..one.ncols() {
        for row in 0..one.nrows() {
            let (a, b) = (one[(row, col)], other[(row, col)]);
            let error = (a - b).abs();
            assert!(error <= s.tolerance, "{} ({row}, {col}): {a} {b}", s.name);
        }
    }
}

fn random_matrix(draw: &mut dyn FnMut() -> f64, n_rows: usize, n_cols: usize) -> Mat<f64> {
    let mut q = Mat::zeros(n_rows, n_cols);
    for col in 0..n_cols {
        for row in 0..n_rows {
            q[(row, col)] = -1.0 + 2.0 * draw();
        }
    }
    q
}

/// Σ_ab Q_ab K_ab and the sum of the sizes of its terms.
fn weighted_sum(k: &Mat<f64>, q: &Mat<f64>) -> (f64, f64) {
    let (mut sum, mut size) = (0.0, 0.0);
    for col in 0..k.ncols() {
        for row in 0..k.nrows() {
            let term: f64 = q[(row, col)] * k[(row, col)];
            sum += term;
            size += term.abs();
        }
    }
    (sum, size)
}

/// Compares a gradient with central differences of Σ Q_ab K_ab.
fn check_gradient(
    s: &mut Subject<'_>,
    q: &Mat<f64>,
    gradient: &[f64],
    matrix: impl Fn(&dyn Covariance) -> Mat<f64>,
) {
    let theta = s.cov.params();
    for (idx, &value) in theta.iter().enumerate() {
        // A zero among entries of either sign is taken for one of their size.
        let scale = if value.abs() > 0.0 { value.abs() } else { 0.5 };
        // The best step for third derivatives of size 1/θ³: ε^{1/3} θ.
        let step = f64::EPSILON.cbrt() * scale;
        let mut at = |shift: f64| {
            let mut moved = theta.clone();
            moved[idx] += shift;
            s.cov.set_params(&moved);
            weighted_sum(&matrix(s.cov), q)
        };
        let ((high, size), (low, _)) = (at(step), at(-step));
        s.cov.set_params(&theta);
        let difference = (high - low) / (2.0 * step);
        // Rounding: the entries carry 1e3 ε at most (see the entries' tolerance) of their size, n of them add up at
        // random; truncation: step²/6 · f‴ with f‴ ≤ 60·size/θ³, reached by e^{−s/2} as a function of a length scale.
        let rounding = 4e3 * f64::EPSILON * size / step;
        let truncation = 10.0 * step * step * size / scale.powi(3);
        let (slope, error) = (gradient[idx], (gradient[idx] - difference).abs());
        assert!(
            error <= rounding + truncation,
            "{}, parameter {idx}: {slope} {difference}",
            s.name
        );
    }
}
