//! provisional
use crate::rigid_body::term_set::TermSet;
/// chosen
#[derive(Debug, Clone, PartialEq)]
pub struct TermChoice {
    pub chosen: Vec<TermSet>,
}
