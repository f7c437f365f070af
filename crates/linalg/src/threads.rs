//! Who does the independent parts of one piece of work: the calling thread, or every thread of the pool.
//!
//! How work is cut into parts depends on its size and never on the number of
//! threads, and every part is done by one thread from beginning to end; so
//! results are the same bit for bit whoever does them.

use faer::MatMut;
use rayon::prelude::*;

/// Orders below which the parts are too small to hand around.
const WORTH_SHARING: usize = 512;

/// The threads that share one piece of work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Threads {
    /// The calling thread.
    One,
    /// All threads of rayon's pool.
    Pool,
}

impl Threads {
    /// The threads for matrices of order `n`.
    ///
    /// A thread that already works for a pool stays alone: its neighbours have work
    /// of their own, other fits for example, and a thread that waited for them
    /// would begin yet another fit, with all its memory, before it finished this one.
    #[inline]
    pub fn at_hand(n: usize) -> Self {
        let is_worker = rayon::current_thread_index().is_some();
        if n < WORTH_SHARING || is_worker || rayon::current_num_threads() == 1 {
            Self::One
        } else {
            Self::Pool
        }
    }

    /// Enters the pool once, for a piece of work of many steps.
    pub fn run<R: Send>(self, work: impl FnOnce() -> R + Send) -> R {
        match self {
            Self::One => work(),
            Self::Pool => rayon::scope(|_| work()),
        }
    }

    /// Does `work` on every part.
    pub fn for_each<T: Send>(self, parts: Vec<T>, work: impl Fn(T) + Sync + Send) {
        match self {
            Self::One => parts.into_iter().for_each(work),
            Self::Pool => parts.into_par_iter().with_max_len(1).for_each(work),
        }
    }

    /// Results of all parts, in the order of the parts.
    pub fn map<T: Send, R: Send>(
        self,
        parts: Vec<T>,
        work: impl Fn(T) -> R + Sync + Send,
    ) -> Vec<R> {
        match self {
            Self::One => parts.into_iter().map(work).collect(),
            Self::Pool => (parts.into_par_iter().with_max_len(1).map(work)).collect(),
        }
    }

    /// Two pieces of work.
    pub fn join<A: Send, B: Send>(
        self,
        first: impl FnOnce() -> A + Send,
        second: impl FnOnce() -> B + Send,
    ) -> (A, B) {
        match self {
            Self::One => (first(), second()),
            Self::Pool => rayon::join(first, second),
        }
    }
}

/// The matrix in panels of at most `width` columns, each with its first column.
pub fn column_panels(mut matrix: MatMut<'_, f64>, width: usize) -> Vec<(usize, MatMut<'_, f64>)> {
    let mut panels = Vec::new();
    let mut first = 0;
    while matrix.ncols() > 0 {
        let taken = width.min(matrix.ncols());
        let (panel, rest) = matrix.split_at_col_mut(taken);
        panels.push((first, panel));
        first += taken;
        matrix = rest;
    }
    panels
}

/// The matrix in panels of at most `height` rows, each with its first row.
pub fn row_panels(matrix: MatMut<'_, f64>, height: usize) -> Vec<(usize, MatMut<'_, f64>)> {
    (column_panels(matrix.transpose_mut(), height).into_iter())
        .map(|(first, panel)| (first, panel.transpose_mut()))
        .collect()
}
