//! How the work of a run went, by kind of work.

use crate::tally::Tally;

/// One tally for each kind of work that was chosen.
#[derive(Debug, Default)]
pub struct Tallies {
    /// One load at a time.
    pub cells: Option<Tally>,
    /// Many loads at once.
    pub units: Option<Tally>,
    /// Section 5.
    pub parts: Option<Tally>,
}

impl Tallies {
    /// Those that there are, each with the name of its work.
    pub fn named(&self) -> impl Iterator<Item = (&'static str, &Tally)> {
        let kinds = [
            ("cells", self.cells.as_ref()),
            ("units", self.units.as_ref()),
            ("parts", self.parts.as_ref()),
        ];
        kinds
            .into_iter()
            .filter_map(|(name, tally)| Some((name, tally?)))
    }

    /// Those that there are.
    pub fn all(&self) -> impl Iterator<Item = &Tally> {
        self.named().map(|(_, tally)| tally)
    }
}
