//! Likelihood with gradient at n = 1000 and 4000, low-rank against dense.
//!
//! Every value is checked before it is timed: the two paths differ by no more than
//! their error bounds.

#![allow(missing_docs, reason = "criterion's macros make undocumented items")]
#![allow(
    clippy::unwrap_used,
    reason = "a benchmark stops where its premise fails"
)]

use std::hint::black_box;
use std::time::Duration;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use gp_core::evidence::evidence;
use gp_core::{LikelihoodOptions, LogMarginal, Method};
use kernels::Covariance;

#[path = "../tests/curves.rs"]
mod curves;

const NOISE_STD: f64 = 0.03;

fn likelihood(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("likelihood_with_gradient");
    group
        .sample_size(10)
        .measurement_time(Duration::from_secs(5));
    for n in [1000, 4000] {
        let x = curves::inputs(n);
        let targets = curves::targets(&x);
        let covariance = curves::covariance(8.0);
        let mut gradient = vec![0.0; covariance.n_params() + 1];

        let dense_options = LikelihoodOptions::dense();
        let exact = evidence(&covariance, NOISE_STD, x.as_ref(), &targets, dense_options).unwrap();
        let mut dense = LogMarginal::new(x.as_ref(), &targets, dense_options);
        group.bench_function(BenchmarkId::new("dense", n), |bencher| {
            bencher
                .iter(|| black_box(dense.evaluate(&covariance, NOISE_STD, &mut gradient)).unwrap());
        });

        let options = LikelihoodOptions {
            method: Method::Certified,
            certificate: 2e-3,
        };
        let mut certified = LogMarginal::new(x.as_ref(), &targets, options);
        let found = (certified.evaluate(&covariance, NOISE_STD, &mut gradient)).unwrap();
        let difference = found.log_marginal_likelihood - exact.evaluation.log_marginal_likelihood;
        let bound = found.error_bound + exact.evaluation.error_bound;
        assert!(difference.abs() <= bound, "{difference:e} {bound:e}");
        assert!(found.error_bound <= 1e-2, "{found:?}");
        let id = BenchmarkId::new(format!("certified_rank_{}", found.rank), n);
        group.bench_function(id, |bencher| {
            bencher.iter(|| {
                black_box(certified.evaluate(&covariance, NOISE_STD, &mut gradient)).unwrap()
            });
        });
    }
    group.finish();
}

criterion_group!(benches, likelihood);
criterion_main!(benches);
