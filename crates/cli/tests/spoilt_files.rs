//! A hundred spoilt tables through the program: one message and status 2, or a result, never a panic.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::command::Folder;

const HYPERPARAMETERS: &str = "bias_std = 1\nlinear_std = [1, 1, 1, 1, 1, 1]\nsignal_std = 1\n\
    length_scales = [1, 1, 1, 1, 1, 1]\ncoulomb_std = [1, 1]\nnoise_std = 0.1\n";

const COMMANDS: [&str; 4] = [
    "fit --data spoilt.csv --model gpc --starts chapter --output out.tgp",
    "predict --model model.tgp --input spoilt.csv --output out.csv --tau-prefix m",
    "evaluate --model model.tgp --data spoilt.csv --json",
    "likelihood --data spoilt.csv --joint 1 --hyperparameters h.toml --json",
];

fn valid() -> String {
    let mut text = "q1,q2,qd1,qd2,qdd1,qdd2,tau1,tau2\n".to_owned();
    for row in 0..12 {
        let number = |col| f64::from((row * 29 + col * 13) % 31) / 7.0 - 2.0;
        let numbers = (0..8).map(|col| format!("{:?}", number(col)));
        text.push_str(&(numbers.collect::<Vec<_>>().join(",") + "\n"));
    }
    text
}

/// Two random changes: a byte, a cut, or a number of extreme size.
fn spoilt(rng: &mut ChaCha8Rng) -> Vec<u8> {
    let mut bytes = valid().into_bytes();
    for _ in 0..2 {
        let at = rng.random_range(0..bytes.len());
        match rng.random_range(0..5) {
            0 => bytes[at] ^= 1 << rng.random_range(0..8),
            1 => bytes.truncate(at.max(1)),
            2 => _ = bytes.remove(at),
            3 => _ = bytes.splice(at..at, *b"e300"),
            _ => _ = bytes.splice(at..at, *b"e-300"),
        }
        if bytes.is_empty() {
            return bytes;
        }
    }
    bytes
}

#[test]
fn a_hundred_spoilt_tables_never_end_in_a_panic() {
    let folder = Folder::new();
    folder.write("train.csv", valid());
    folder.write("h.toml", HYPERPARAMETERS);
    folder.run("fit --data train.csv --model lrc --output model.tgp");
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let (mut n_done, mut n_refused) = (0, 0);
    for file in 0..100 {
        folder.write("spoilt.csv", spoilt(&mut rng));
        let output = folder.command(COMMANDS[file % 4]).output().unwrap();
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        let is_error = |line: &&str| line.starts_with("error: ");
        let n_errors = message.lines().filter(is_error).count();
        match output.status.code() {
            Some(0) => {
                let text = String::from_utf8_lossy(&output.stdout);
                assert!(n_errors == 0 && !text.contains("NaN"), "{message} {text}");
                n_done += 1;
            }
            Some(2) => {
                assert!(n_errors == 1 && output.stdout.is_empty(), "{message}");
                let is_output = |name: &String| name.starts_with("out.");
                assert!(!folder.files().iter().any(is_output), "{message}");
                n_refused += 1;
            }
            other => panic!("status {other:?}: {message}"),
        }
        for name in ["out.tgp", "out.csv"] {
            _ = std::fs::remove_file(folder.path(name));
        }
    }
    assert!(n_done >= 10 && n_refused >= 10, "{n_done}, {n_refused}");
}
