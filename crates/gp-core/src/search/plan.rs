//! Which samples the stages of a search see.

/// Number of samples up to which a search sees all of them from the beginning.
const WHOLE_UP_TO: usize = 512;

/// Largest number of samples that the first of several stages may have.
const LARGEST_FIRST: usize = 256;

/// Numbers of samples of the stages, ascending; the last is `n_samples`.
///
/// ```text
/// …, ⌈n/4⌉, ⌈n/2⌉, n    down to the first that is at most 256; n alone up to 512
/// ```
pub(crate) fn stage_sizes(n_samples: usize) -> Vec<usize> {
    let mut sizes = vec![n_samples];
    let mut n = n_samples;
    while n_samples > WHOLE_UP_TO && n > LARGEST_FIRST {
        n = n.div_ceil(2);
        sizes.push(n);
    }
    sizes.reverse();
    sizes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_double_up_to_all_samples() {
        assert_eq!(stage_sizes(2), [2]);
        assert_eq!(stage_sizes(512), [512]);
        assert_eq!(stage_sizes(513), [129, 257, 513]);
        assert_eq!(stage_sizes(1004), [251, 502, 1004]);
        assert_eq!(stage_sizes(4000), [250, 500, 1000, 2000, 4000]);
    }
}
