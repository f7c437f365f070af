//! Integration tests of the experiment runner.
