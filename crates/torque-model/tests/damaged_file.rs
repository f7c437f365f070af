//! Damaged model files are refused, whatever the kind of model.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use torque_model::ModelFileError;

/// Magic number, version, length and checksum.
const HEADER: usize = 52;

/// Cut short anywhere, a file is refused with the length that it should have: its header's, then its own.
pub fn every_truncation_is_named<M>(
    bytes: &[u8],
    read: impl Fn(&[u8]) -> Result<M, ModelFileError>,
) {
    for found in 0..bytes.len() {
        let expected = if found < HEADER { HEADER } else { bytes.len() };
        let named = ModelFileError::Truncated {
            expected: expected as u64,
            found: found as u64,
        };
        assert_eq!(read(&bytes[..found]).err(), Some(named));
    }
}

/// A flipped byte is refused, and as an altered file where the checksum covers it.
pub fn flipped_bytes_are_refused<M>(
    mut bytes: Vec<u8>,
    n_trials: usize,
    read: impl Fn(&[u8]) -> Result<M, ModelFileError>,
) {
    let mut rng = ChaCha8Rng::seed_from_u64(10);
    for trial in 0..n_trials {
        // Every fourth flip hits the header, which is a hundredth of the file.
        let end = if trial % 4 == 0 { HEADER } else { bytes.len() };
        let position = rng.random_range(0..end);
        let flip: u8 = rng.random_range(1..=255);
        bytes[position] ^= flip;
        let error = read(&bytes).err();
        bytes[position] ^= flip;
        assert!(error.is_some(), "byte {position}");
        if position >= 20 {
            assert_eq!(error, Some(ModelFileError::Altered), "byte {position}");
        }
    }
    assert!(read(&bytes).is_ok());
}
