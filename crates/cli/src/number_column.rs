//! A column of a table: where its numbers are and what they mean.

/// A column of numbers: where it is and what it means.
#[derive(Clone, Debug)]
pub struct NumberColumn {
    /// Position in the header.
    pub idx: usize,
    /// Name in the header.
    pub name: String,
    /// Name of the joint.
    pub joint: String,
    /// Unit.
    pub unit: &'static str,
}
