//! Training rows of one context: nested subsets of table 2's training set.

use crate::seed::{sample_indices, stream};
use crate::split::Split;

/// The first `n` training rows of load c`load` in the random order of a repeat.
///
/// The order does not depend on `n`, so the rows of a smaller size are among those of a larger one,
/// and the joints and models of a context share them.
///
/// DEVIATION(sec. 4.6): the chapter draws the subsets of different sizes independently;
/// nested ones take this noise out of the comparison between sizes, and repeats show it.
///
/// # Panics
/// If `n` exceeds the training set.
/// # Source
/// Sections 2.3 and 4.6.
pub fn nested(split: &Split, seed: &str, load: usize, repeat: usize, n: usize) -> Vec<usize> {
    let mut rng = stream(seed, &format!("nested/c{load}/repeat{repeat}"));
    sample_indices(&mut rng, split.train.len(), n)
        .into_iter()
        .map(|i| split.train[i])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_nested_and_come_from_the_training_set() {
        let split = Split::draw("one-context", 5);
        let rows = |n| nested(&split, "many-contexts", 5, 0, n);
        let large = rows(130);
        for n in [1, 20, 34, 129] {
            assert_eq!(rows(n), large[..n]);
        }
        assert!(large.iter().all(|row| split.train.contains(row)));
        let mut all = rows(split.train.len());
        all.sort_unstable();
        all.dedup();
        assert_eq!(all.len(), split.train.len());
    }

    #[test]
    fn repeats_and_contexts_draw_their_own_rows() {
        let split = Split::draw("one-context", 5);
        let first = nested(&split, "many-contexts", 5, 0, 20);
        assert_ne!(first, nested(&split, "many-contexts", 5, 1, 20));
        assert_ne!(first, nested(&split, "many-contexts", 6, 0, 20));
        assert_ne!(first, nested(&split, "other", 5, 0, 20));
    }

    #[test]
    fn draws_are_pinned() {
        // A change of these numbers changes every result: it must be deliberate.
        let split = Split::draw("one-context", 1);
        let rows = nested(&split, "many-contexts", 1, 0, 3);
        assert_eq!(rows, [1400, 24_039, 26_550]);
    }
}
