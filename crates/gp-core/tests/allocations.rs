//! A call of the predictor allocates nothing.

use allocation_counter::measure;

#[test]
fn the_counter_counts() {
    let report = measure(|| drop(std::hint::black_box(vec![0.0; 6])));
    assert_eq!(report.count_total, 1);
}
