//! The Cholesky factor of a matrix and the inverse from it, in place and by one thread.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{
    LltError, LltParams, LltRegularization, cholesky_in_place, cholesky_in_place_scratch,
};
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::triangular_inverse::invert_lower_triangular;
use faer::{Accum, Auto, MatMut, Par, Spec};

/// Replaces the lower triangle of K by that of L, by one thread.
///
/// # Errors
/// The index of the first pivot that is not a positive number.
pub(crate) fn factorise_in_place(k: MatMut<'_, f64>) -> Result<(), usize> {
    let params: Spec<LltParams, f64> = <LltParams as Auto<f64>>::auto().into();
    let scratch = cholesky_in_place_scratch::<f64>(k.nrows(), Par::Seq, params);
    cholesky_in_place(
        k,
        LltRegularization::default(),
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(scratch)),
        params,
    )
    .map_err(|LltError::NonPositivePivot { index }| index)?;
    Ok(())
}

/// The lower triangle of L⁻ᵀL⁻¹ in place of that of L, with L⁻¹ in `scratch`, by one thread.
pub(crate) fn invert_in_place(mut l: MatMut<'_, f64>, mut scratch: MatMut<'_, f64>) {
    invert_lower_triangular(scratch.as_mut(), l.as_ref(), Par::Seq);
    triangular::matmul(
        l.as_mut(),
        BlockStructure::TriangularLower,
        Accum::Replace,
        scratch.as_ref().transpose(),
        BlockStructure::TriangularUpper,
        scratch.as_ref(),
        BlockStructure::TriangularLower,
        1.0,
        Par::Seq,
    );
}
