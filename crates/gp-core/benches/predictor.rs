//! Placeholder until the predictor is in place.
fn main() {}
