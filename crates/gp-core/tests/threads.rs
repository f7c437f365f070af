//! The dense likelihood and its gradient, bit by bit, with one thread and with more.
//!
//! The number of threads of rayon's pool is fixed for a process, so the test runs
//! itself again in processes with other numbers.

use std::env;
use std::io::Write;
use std::process::Command;

use gp_core::{LikelihoodOptions, LogMarginal};
use kernels::Covariance;

use crate::curves;

/// Set in the processes that only print.
const PRINTS: &str = "GP_CORE_TEST_PRINTS_BITS";

fn bits_of_value_and_gradient() -> String {
    let x = curves::inputs(1500);
    let targets = curves::targets(&x);
    let covariance = curves::covariance(4.0);
    let mut gradient = vec![0.0; covariance.n_params() + 1];
    let mut evidence = LogMarginal::new(x.as_ref(), &targets, LikelihoodOptions::dense());
    let found = evidence.evaluate(&covariance, 0.03, &mut gradient).unwrap();
    gradient.push(found.log_marginal_likelihood);
    let words = gradient.iter().map(|g| format!("{:016x}", g.to_bits()));
    words.collect::<Vec<_>>().join(" ")
}

fn bits_with_threads(n_threads: usize) -> String {
    let output = Command::new(env::current_exe().unwrap())
        .args([
            "--exact",
            "threads::dense_likelihood_has_the_same_bits_for_any_number_of_threads",
            "--nocapture",
        ])
        .env(PRINTS, "yes")
        .env("RAYON_NUM_THREADS", n_threads.to_string())
        .output()
        .unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let line = text.lines().find_map(|line| line.split_once("bits: "));
    line.unwrap_or_else(|| panic!("{text}")).1.to_owned()
}

#[test]
fn dense_likelihood_has_the_same_bits_for_any_number_of_threads() {
    let bits = bits_of_value_and_gradient();
    if env::var_os(PRINTS).is_some() {
        writeln!(std::io::stdout(), "\nbits: {bits}").unwrap();
        return;
    }
    for n_threads in 1..=3 {
        assert_eq!(bits, bits_with_threads(n_threads), "{n_threads} threads");
    }
}

#[test]
fn dense_likelihood_has_the_same_bits_inside_a_pool_of_others() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2);
    let inside = pool.build().unwrap().install(bits_of_value_and_gradient);
    assert_eq!(bits_of_value_and_gradient(), inside);
}
