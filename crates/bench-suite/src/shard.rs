//! One of several equal parts of the work, so that machines that share a directory of results share the work too.

use std::collections::BTreeSet;
use std::fmt;
use std::str::FromStr;

use crate::run::longest_first;
use crate::store::Work;

/// Largest number of parts.
const MAX_COUNT: usize = 100_000;

/// Part `index` of `count`, both from 1.
///
/// Which work belongs to a part depends on the whole work alone, never on what is finished already:
/// parts computed at different times, or again, leave nothing out and do nothing twice.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    index: usize,
    count: usize,
}

impl Shard {
    /// The only part of one.
    pub const WHOLE: Self = Self { index: 1, count: 1 };

    /// This part of the work.
    ///
    /// All work is dealt like cards, what takes longest first and every other round backwards:
    /// the parts' sizes differ by one at most, and none of them gets the longer piece of every round.
    pub fn of<W: Work>(self, work: BTreeSet<W>) -> BTreeSet<W> {
        let all: Vec<W> = work.into_iter().collect();
        let order = longest_first(&all).into_iter().enumerate();
        let mine = order.filter(|(place, _)| self.owner(*place) == self.index);
        mine.map(|(_, i)| all[i].clone()).collect()
    }

    /// The shard that takes this one's place in the dealing when `n_dealt` pieces have been dealt before.
    ///
    /// So that many short lots of work do not all begin with the first shard.
    #[must_use]
    pub fn after(self, n_dealt: usize) -> Self {
        let back = self.count - n_dealt % self.count;
        Self {
            index: (self.index - 1 + back) % self.count + 1,
            ..self
        }
    }

    /// Number of this part, from 1.
    pub fn index(self) -> usize {
        self.index
    }

    /// Part, from 1, that the piece at a place of the dealt order goes to.
    fn owner(self, place: usize) -> usize {
        let (round, k) = (place / self.count, place % self.count);
        if round.is_multiple_of(2) {
            k + 1
        } else {
            self.count - k
        }
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text
            .split_once('/')
            .and_then(|(index, count)| Some((index.parse().ok()?, count.parse().ok()?)));
        match numbers {
            Some((index, count)) if (1..=count).contains(&index) && count <= MAX_COUNT => {
                Ok(Self { index, count })
            }
            _ => Err(format!(
                "not I/N with whole numbers 1 <= I <= N <= {MAX_COUNT}"
            )),
        }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::{Cell, ModelKind};

    fn cells(n_loads: usize) -> BTreeSet<Cell> {
        let mut cells = BTreeSet::new();
        for load in 1..=n_loads {
            for model in ModelKind::ALL {
                cells.extend([20, 4000].map(|n| Cell {
                    seed: "s".into(),
                    load,
                    joint: 1,
                    model,
                    n,
                }));
            }
        }
        cells
    }

    fn parts(count: usize, work: &BTreeSet<Cell>) -> Vec<BTreeSet<Cell>> {
        (1..=count)
            .map(|index| Shard { index, count }.of(work.clone()))
            .collect()
    }

    #[test]
    fn parts_are_disjoint_and_make_up_the_whole() {
        let work = cells(5);
        for count in [1, 2, 3, 7, 40, 41] {
            let parts = parts(count, &work);
            let n: usize = parts.iter().map(BTreeSet::len).sum();
            assert_eq!(n, work.len(), "{count} parts");
            let union: BTreeSet<Cell> = parts.into_iter().flatten().collect();
            assert_eq!(union, work, "{count} parts");
        }
        assert_eq!(Shard::WHOLE.of(work.clone()), work);
    }

    #[test]
    fn long_pieces_are_spread_evenly() {
        let work = cells(6);
        let is_long = |cell: &&Cell| cell.model == ModelKind::GpSmooth && cell.n == 4000;
        for part in parts(3, &work) {
            assert_eq!(part.len(), 28);
            assert_eq!(part.iter().filter(is_long).count(), 2);
        }
    }

    #[test]
    fn every_other_round_is_dealt_backwards() {
        let shard = Shard { index: 1, count: 3 };
        let owners: Vec<usize> = (0..9).map(|place| shard.owner(place)).collect();
        assert_eq!(owners, [1, 2, 3, 3, 2, 1, 1, 2, 3]);
    }

    #[test]
    fn lots_dealt_one_after_another_leave_nothing_out_and_go_on_where_the_last_ended() {
        let work = cells(1);
        for n_dealt in 0..7 {
            let shards = (1..=3).map(|index| Shard { index, count: 3 }.after(n_dealt));
            let parts: Vec<BTreeSet<Cell>> = shards.map(|shard| shard.of(work.clone())).collect();
            assert_eq!(parts.iter().map(BTreeSet::len).sum::<usize>(), work.len());
            let union: BTreeSet<Cell> = parts.into_iter().flatten().collect();
            assert_eq!(union, work);
        }
        // With one piece dealt to the first of three, the second is the next first.
        let second = Shard { index: 2, count: 3 };
        assert_eq!(second.after(1), Shard { index: 1, count: 3 });
        assert_eq!(Shard::WHOLE.after(5), Shard::WHOLE);
    }

    #[test]
    fn shards_are_read_as_they_are_shown_and_others_are_refused() {
        let shard: Shard = "3/8".parse().unwrap();
        assert_eq!(shard, Shard { index: 3, count: 8 });
        assert_eq!(shard.to_string(), "3/8");
        for text in [
            "0/8", "9/8", "3", "3/", "/8", "-1/8", "1/0", "a/b", "1/100001", "1/2/3",
        ] {
            let refused = text.parse::<Shard>().unwrap_err();
            assert!(refused.starts_with("not I/N"), "{text}: {refused}");
        }
    }
}
