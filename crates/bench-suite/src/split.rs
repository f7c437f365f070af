//! Training and test samples of a load: table 2 and the subsets of the data-poor runs.

use std::collections::BTreeSet;
use std::fmt;

use serde::{Deserialize, Serialize};

use crate::seed::{sample_indices, stream};

/// Paths p1..p4.
pub const N_PATHS: usize = 4;
/// Speeds s1..s4.
pub const N_SPEEDS: usize = 4;
/// Samples of one trajectory under one load.
pub const N_SAMPLES: usize = 4000;
/// Samples of all trajectories under one load.
pub const N_ROWS: usize = N_PATHS * N_SPEEDS * N_SAMPLES;
/// Training samples drawn from each of a load's two trajectories.
const N_DRAWN: usize = 2000;

/// One of the sixteen trajectories, a path followed at a speed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct TrajectoryId {
    /// Path, from 0: p1 is 0.
    pub path_idx: usize,
    /// Speed, from 0: s1 is 0.
    pub speed_idx: usize,
}

/// T_r = (p2, s3), the trajectory shared by all loads.
pub const REFERENCE: TrajectoryId = trajectory(2, 3);

/// T_1..T_15, the trajectory that each load has for itself.
///
/// # Source
/// Table 2.
pub const UNIQUE: [TrajectoryId; 15] = [
    trajectory(1, 1),
    trajectory(4, 1),
    trajectory(3, 2),
    trajectory(3, 3),
    trajectory(2, 4),
    trajectory(2, 1),
    trajectory(1, 2),
    trajectory(4, 2),
    trajectory(4, 3),
    trajectory(3, 4),
    trajectory(3, 1),
    trajectory(2, 2),
    trajectory(1, 3),
    trajectory(1, 4),
    trajectory(4, 4),
];

/// The trajectory (p`path`, s`speed`), both from 1 as in the chapter.
const fn trajectory(path: usize, speed: usize) -> TrajectoryId {
    TrajectoryId {
        path_idx: path - 1,
        speed_idx: speed - 1,
    }
}

/// Path and speed, such as p2s3.
impl fmt::Display for TrajectoryId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "p{}s{}", self.path_idx + 1, self.speed_idx + 1)
    }
}

impl TrajectoryId {
    /// Every trajectory in the order of the data set's rows: p1 s1..s4, p2 s1..s4, ….
    pub fn all() -> impl Iterator<Item = Self> {
        (1..=N_PATHS).flat_map(|path| (1..=N_SPEEDS).map(move |speed| trajectory(path, speed)))
    }

    /// Rows of this trajectory in the data set.
    pub fn rows(self) -> std::ops::Range<usize> {
        let start = (self.path_idx * N_SPEEDS + self.speed_idx) * N_SAMPLES;
        start..start + N_SAMPLES
    }
}

/// Rows of the data set that train and test the models of one load.
///
/// `train` 4000 rows, 2000 of T_r and 2000 of T_k, in the order drawn;
/// `interp` the other 4000 rows of the two, ascending;
/// `extrap` every row that does not train, 60,000, ascending: it contains `interp`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Split {
    /// Rows to train on.
    pub train: Vec<usize>,
    /// Rows of the trained trajectories to test on.
    pub interp: Vec<usize>,
    /// Rows of all trajectories to test on.
    pub extrap: Vec<usize>,
}

impl Split {
    /// Split of load c`load`, from 1.
    ///
    /// # Panics
    /// If `load` is not one of 1..=15.
    /// # Source
    /// Section 2.3.
    pub fn draw(seed: &str, load: usize) -> Self {
        let unique = UNIQUE[load - 1];
        let mut train = draw_rows(seed, &format!("split/c{load}/reference"), REFERENCE);
        train.extend(draw_rows(seed, &format!("split/c{load}/unique"), unique));

        let trained: BTreeSet<usize> = train.iter().copied().collect();
        let is_free = |row: &usize| !trained.contains(row);
        let mut interp: Vec<usize> = REFERENCE
            .rows()
            .chain(unique.rows())
            .filter(is_free)
            .collect();
        interp.sort_unstable();
        let extrap = (0..N_ROWS).filter(is_free).collect();
        Self {
            train,
            interp,
            extrap,
        }
    }

    /// `n` of the training rows, drawn for this load and size.
    ///
    /// ASSUMPTION(sec. 2.3): the subsets of different sizes are drawn independently of each other (not nested),
    /// as section 4.6 does it; the joints and models of a load share the subset of a size.
    ///
    /// # Panics
    /// If `n` exceeds the training set.
    pub fn subset(&self, seed: &str, load: usize, n: usize) -> Vec<usize> {
        if n == self.train.len() {
            return self.train.clone();
        }
        let mut rng = stream(seed, &format!("subset/c{load}/n{n}"));
        sample_indices(&mut rng, self.train.len(), n)
            .into_iter()
            .map(|i| self.train[i])
            .collect()
    }

    /// Positions in `extrap` of the rows of `interp`, so that one prediction serves both sets.
    pub fn interp_in_extrap(&self) -> Vec<usize> {
        self.interp
            .iter()
            .filter_map(|row| self.extrap.binary_search(row).ok())
            .collect()
    }
}

fn draw_rows(seed: &str, label: &str, trajectory: TrajectoryId) -> Vec<usize> {
    let start = trajectory.rows().start;
    sample_indices(&mut stream(seed, label), N_SAMPLES, N_DRAWN)
        .into_iter()
        .map(|i| start + i)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unique_and_reference_trajectories_are_all_sixteen() {
        let mut starts: Vec<usize> = UNIQUE.iter().map(|t| t.rows().start).collect();
        starts.push(REFERENCE.rows().start);
        starts.sort_unstable();
        let all: Vec<usize> = TrajectoryId::all().map(|t| t.rows().start).collect();
        assert_eq!(starts, all);
    }

    #[test]
    fn table_2_reads_as_printed() {
        // Rows of table 2 are speeds, columns are paths; r is the reference.
        let printed = ["1 6 11 2", "7 12 3 8", "13 r 4 9", "14 5 10 15"];
        for (speed_idx, row) in printed.iter().enumerate() {
            for (path_idx, cell) in row.split(' ').enumerate() {
                let id = TrajectoryId {
                    path_idx,
                    speed_idx,
                };
                let expected = cell.parse().map_or(REFERENCE, |k: usize| UNIQUE[k - 1]);
                assert_eq!(id, expected, "T{cell}");
            }
        }
    }

    #[test]
    fn sets_of_every_load_have_the_published_sizes_and_do_not_leak() {
        for load in 1..=15 {
            let split = Split::draw("seed", load);
            assert_eq!(split.train.len(), 4000);
            assert_eq!(split.interp.len(), 4000);
            assert_eq!(split.extrap.len(), 60_000);
            let train: BTreeSet<_> = split.train.iter().collect();
            assert_eq!(train.len(), 4000);
            assert!(split.extrap.iter().all(|row| !train.contains(row)));
            let extrap: BTreeSet<_> = split.extrap.iter().collect();
            assert!(split.interp.iter().all(|row| extrap.contains(row)));
            let in_reference = |rows: &[usize]| {
                let range = REFERENCE.rows();
                rows.iter().filter(|row| range.contains(row)).count()
            };
            assert_eq!(in_reference(&split.train), 2000);
            assert_eq!(in_reference(&split.interp), 2000);
        }
    }

    #[test]
    fn positions_find_the_interp_rows() {
        let split = Split::draw("seed", 4);
        let positions = split.interp_in_extrap();
        let rows: Vec<usize> = positions.iter().map(|&i| split.extrap[i]).collect();
        assert_eq!(rows, split.interp);
    }

    #[test]
    fn subsets_come_from_the_training_set_and_are_not_nested() {
        let split = Split::draw("seed", 2);
        let train: BTreeSet<_> = split.train.iter().collect();
        let small = split.subset("seed", 2, 20);
        let large = split.subset("seed", 2, 170);
        assert!(small.iter().chain(&large).all(|row| train.contains(row)));
        assert_eq!(small.iter().collect::<BTreeSet<_>>().len(), 20);
        assert!(small.iter().any(|row| !large.contains(row)));
        assert_eq!(split.subset("seed", 2, 4000), split.train);
    }

    #[test]
    fn draws_are_pinned() {
        // A change of these numbers changes every result: it must be deliberate.
        let split = Split::draw("one-context", 1);
        assert_eq!(split.train[..3], PINNED_TRAIN);
        assert_eq!(split.subset("one-context", 1, 20)[..3], PINNED_SUBSET);
    }

    const PINNED_TRAIN: [usize; 3] = [26_315, 25_193, 27_490];
    const PINNED_SUBSET: [usize; 3] = [24_651, 278, 24_029];
}
