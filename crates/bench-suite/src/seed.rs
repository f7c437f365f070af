//! One random stream per stable label, so that no draw depends on the order of the others.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use sha2::{Digest, Sha256};

/// Random stream of a label: ChaCha8 keyed by a hash.
///
/// ```text
/// key = SHA-256("seed/label")
/// ```
pub fn stream(seed: &str, label: &str) -> ChaCha8Rng {
    let key = Sha256::digest(format!("{seed}/{label}"));
    ChaCha8Rng::from_seed(key.into())
}

/// `n` distinct indices of `0..population`, uniformly and in the order drawn.
///
/// A partial Fisher–Yates shuffle, written out here so that the draws stay the same
/// whatever a later version of a library does.
///
/// # Panics
/// If `n > population`.
pub fn sample_indices(rng: &mut impl Rng, population: usize, n: usize) -> Vec<usize> {
    assert!(n <= population, "cannot draw {n} of {population}");
    let mut indices: Vec<usize> = (0..population).collect();
    for i in 0..n {
        let j = i + below(rng, population - i);
        indices.swap(i, j);
    }
    indices.truncate(n);
    indices
}

/// Uniform integer of `0..bound`; draws that would favour small values are rejected.
fn below(rng: &mut impl Rng, bound: usize) -> usize {
    let bound = bound as u64;
    let zone = u64::MAX - u64::MAX % bound;
    loop {
        let draw = rng.next_u64();
        if draw < zone {
            return usize::try_from(draw % bound).unwrap_or(usize::MAX);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn same_label_repeats_and_another_label_differs() {
        let draw = |label| sample_indices(&mut stream("s", label), 1000, 20);
        assert_eq!(draw("a"), draw("a"));
        assert_ne!(draw("a"), draw("b"));
    }

    #[test]
    fn indices_are_distinct_and_in_range() {
        let mut drawn = sample_indices(&mut stream("s", "a"), 50, 50);
        drawn.sort_unstable();
        assert_eq!(drawn, (0..50).collect::<Vec<_>>());
    }

    #[test]
    fn every_index_is_drawn_about_equally_often() {
        let mut rng = stream("s", "uniform");
        let mut counts = [0_u32; 10];
        for _ in 0..10_000 {
            for i in sample_indices(&mut rng, 10, 3) {
                counts[i] += 1;
            }
        }
        // Binomial(10⁴, 0.3): standard deviation 46, so ±230 is five of them.
        for count in counts {
            assert!(count.abs_diff(3000) < 230, "{counts:?}");
        }
    }
}
