//! The fixed inputs: rows of simulated runs, hyperparameters and a load.

/// A run of the simulated arm: load, path and speed.
pub struct Run(pub &'static str, pub &'static str, pub &'static str);

/// A CSV file: evenly spaced rows of one or more runs, one run after another.
pub struct Table {
    /// Name of the file without its ending.
    pub name: &'static str,
    /// Where its rows are from.
    pub runs: &'static [Run],
    /// First row that is taken of each run.
    pub first: usize,
    /// Rows from one that is taken to the next.
    pub step: usize,
    /// Rows that are taken of each run.
    pub count: usize,
}

const C3: Run = Run("c3", "p2", "s3");
const C3_ELSEWHERE: Run = Run("c3", "p1", "s4");
const FIVE_LOADS: &[Run] = &[
    Run("c1", "p2", "s3"),
    C3,
    Run("c5", "p2", "s3"),
    Run("c8", "p2", "s3"),
    Run("c12", "p2", "s3"),
];
/// Loads whose samples are along trajectories of their own.
const FIVE_TRAJECTORIES: &[Run] = &[
    Run("c1", "p2", "s3"),
    Run("c3", "p1", "s4"),
    Run("c5", "p3", "s2"),
    Run("c8", "p4", "s3"),
    Run("c12", "p2", "s1"),
];

const fn table(
    name: &'static str,
    runs: &'static [Run],
    (first, step, count): (usize, usize, usize),
) -> Table {
    Table {
        name,
        runs,
        first,
        step,
        count,
    }
}

/// All tables; those of several loads begin with `many`.
pub const TABLES: &[Table] = &[
    table("one", &[C3], (0, 33, 120)),
    table("one-700", &[C3, C3_ELSEWHERE], (0, 11, 350)),
    table("one-test", &[C3], (7, 4, 998)),
    table("one-reference", &[Run("c3", "p2", "s4")], (0, 1, 401)),
    table("many", FIVE_LOADS, (0, 133, 30)),
    table("many-apart", FIVE_TRAJECTORIES, (0, 133, 25)),
    table("many-600", FIVE_TRAJECTORIES, (0, 33, 120)),
    table("many-test", FIVE_LOADS, (7, 19, 200)),
    table("new", &[Run("c15", "p2", "s3")], (0, 97, 40)),
    table("new-test", &[Run("c15", "p2", "s3")], (5, 4, 998)),
    table("log", &[C3], (505, 7, 60)),
    table(
        "log-changes",
        &[Run("c3", "p2", "s3"), Run("c8", "p2", "s3")],
        (505, 7, 60),
    ),
    table("likelihood-one-100", &[C3], (0, 40, 100)),
    table("likelihood-one-700", &[C3, C3_ELSEWHERE], (0, 11, 350)),
    table("likelihood-one-1300", &[C3, C3_ELSEWHERE], (0, 6, 650)),
    table("likelihood-one-4000", &[C3, C3_ELSEWHERE], (0, 2, 2000)),
    table("likelihood-many-100", FIVE_TRAJECTORIES, (0, 200, 20)),
    table("likelihood-many-700", FIVE_TRAJECTORIES, (0, 28, 140)),
    table("likelihood-many-1300", FIVE_TRAJECTORIES, (0, 15, 260)),
    table("likelihood-many-4000", FIVE_TRAJECTORIES, (0, 5, 800)),
];

/// Hyperparameters of joint 3, of the size that fits to these runs find.
const HYPERPARAMETERS: &str = "\
bias_std = 4.0
linear_std = [
    0.01, 0.5, 0.5, 0.01, 0.1, 0.05,
    0.01, 0.5, 3.0, 0.01, 0.1, 0.01,
    0.1, 0.5, 0.7, 0.01, 0.02, 0.01,
]
signal_std = 7.0
length_scales = [
    4.0, 1.4, 1.1, 3.0, 5.0, 6.0,
    20.0, 20.0, 15.0, 20.0, 15.0, 25.0,
    200.0, 150.0, 80.0, 200.0, 150.0, 250.0,
]
coulomb_std = [0.1, 0.2, 6.0, 0.1, 0.1, 0.1]
";

const ONE: &str = "noise_std = 0.05\n";

const MANY: &str = "\
noise_std = [0.05, 0.06, 0.04, 0.05, 0.07]
contexts = [\"c1\", \"c3\", \"c5\", \"c8\", \"c12\"]
task_factor = [[0.9], [1.0, 0.1], [1.1, 0.2], [1.2, 0.3], [1.4, 0.5]]
";

/// A load for the control loop, that of c3.
const LOAD: &str = "\
mass = 0.6
size = [0.191, 0.049, 0.13]
centre = [0.04, 0.027, 0.103]
rpy = [1.058, -0.702, 2.681]
";

/// Other files by their names.
pub fn texts() -> [(&'static str, String); 3] {
    [
        ("one.toml", HYPERPARAMETERS.to_owned() + ONE),
        ("many.toml", HYPERPARAMETERS.to_owned() + MANY),
        ("load.toml", LOAD.to_owned()),
    ]
}

impl Run {
    /// Name of the run's file without its ending.
    pub fn name(&self) -> String {
        let Self(load, path, speed) = self;
        format!("run-{load}-{path}-{speed}")
    }
}

impl Table {
    /// The table's text, given that of each run in their order.
    pub fn text(&self, runs: &[String]) -> String {
        let mut text = String::new();
        for run in runs {
            let mut lines = run.lines();
            let header = lines.next().unwrap_or_default();
            if text.is_empty() {
                text = format!("{header}\n");
            }
            for line in lines.skip(self.first).step_by(self.step).take(self.count) {
                text.push_str(line);
                text.push('\n');
            }
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_has_one_header_and_the_rows_asked_for() {
        let runs = ["x\n0\n1\n2\n3\n4\n", "x\n5\n6\n7\n8\n9\n"].map(String::from);
        assert_eq!(table("a", &[], (1, 2, 2)).text(&runs), "x\n1\n3\n6\n8\n");
    }
}
