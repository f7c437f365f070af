//! The integration tests, one module per file.
