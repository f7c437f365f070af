//! Training samples of one load and the torque of one joint, as a CSV file.

use std::path::Path;

use anyhow::{Context as _, Result, ensure};
use faer::Mat;
use mtgp::Stacked;
use puma_dyn::{Context, Effects, Friction, Scenario, Workspace, rnea};
use rand::SeedableRng;
use rand::seq::index;
use rand_chacha::ChaCha8Rng;

const N_JOINTS: usize = 6;
const N_COVARIATES: usize = 3 * N_JOINTS;
/// Samples drawn from each of the two trajectories.
const N_DRAWN: usize = 2000;
/// The trajectory that all loads share, (p2, s3).
const REFERENCE: (&str, &str) = ("p2", "s3");
/// The trajectory that each load c1..c15 has for itself: table 2.
const UNIQUE: [(&str, &str); 15] = [
    ("p1", "s1"),
    ("p4", "s1"),
    ("p3", "s2"),
    ("p3", "s3"),
    ("p2", "s4"),
    ("p2", "s1"),
    ("p1", "s2"),
    ("p4", "s2"),
    ("p4", "s3"),
    ("p3", "s4"),
    ("p3", "s1"),
    ("p2", "s2"),
    ("p1", "s3"),
    ("p1", "s4"),
    ("p4", "s4"),
];
const SEED: u64 = 3;
/// Name of the column that numbers the loads.
const TASK: &str = "task";

/// Samples to learn from.
pub struct Samples {
    /// Inputs (q, q̇, q̈), (n, 18); rad, rad/s, rad/s².
    pub x: Mat<f64>,
    /// Torques, (n,), N·m.
    pub targets: Vec<f64>,
    /// The load of each sample, from 0, where there are several.
    pub tasks: Option<Vec<usize>>,
}

impl Samples {
    /// The samples as rows (x, task), sorted by task, and their targets.
    pub fn stacked(&self) -> Result<(Stacked, Vec<f64>)> {
        let tasks = self.tasks.as_ref().context("no column `task`")?;
        let n_tasks = tasks.iter().max().map_or(0, |last| last + 1);
        let stacked = Stacked::new(self.x.as_ref(), tasks, n_tasks)?;
        let targets = stacked.stack(&self.targets);
        Ok((stacked, targets))
    }

    /// The rows that a covariance takes: those of several loads have the task in a further column.
    pub fn into_rows(self) -> Result<Self> {
        if self.tasks.is_none() {
            return Ok(self);
        }
        let (stacked, targets) = self.stacked()?;
        Ok(Self {
            x: stacked.inputs().to_owned(),
            targets,
            tasks: self.tasks,
        })
    }
}

/// An arm that carries a load and may be free of friction.
struct Arm {
    scenario: Scenario,
    effects: Effects,
    context: Context,
}

impl Arm {
    fn new(load_idx: usize, friction: Friction) -> Result<Self> {
        let scenario = Scenario::reference();
        let model = scenario.model();
        let context = model.attach(model.frames().len() - 1, scenario.payload(load_idx))?;
        Ok(Self {
            effects: Effects {
                friction,
                ..scenario.effects()
            },
            context: context.into(),
            scenario,
        })
    }
}

/// Draws the samples of a load and writes them, the two trajectories in turn, so that the first
/// n rows are a smaller sample of the same kind.
pub fn write(load: &str, joint: usize, is_frictionless: bool, output: &Path) -> Result<()> {
    ensure!((1..=N_JOINTS).contains(&joint), "no joint {joint}");
    let scenario = Scenario::reference();
    let load_idx = scenario.load_idx(load)?;
    let friction = if is_frictionless {
        Friction::None
    } else {
        scenario.effects().friction
    };
    let arm = Arm::new(load_idx, friction)?;
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let reference = rows(&arm, REFERENCE, joint, &mut rng)?;
    let unique = rows(&arm, UNIQUE[load_idx], joint, &mut rng)?;

    let mut file = csv::Writer::from_path(output)?;
    file.write_record(header(joint))?;
    for row in alternating(&reference, &unique) {
        file.write_record(row.iter().map(f64::to_string))?;
    }
    Ok(file.flush()?)
}

/// Draws the samples of the loads c1, c2, … and writes them with a column `task`, one of each load in turn.
pub fn write_several(n_loads: usize, joint: usize, output: &Path) -> Result<()> {
    ensure!((1..=N_JOINTS).contains(&joint), "no joint {joint}");
    ensure!((2..=UNIQUE.len()).contains(&n_loads), "{n_loads} loads");
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let mut of_loads = Vec::new();
    for (load_idx, unique) in UNIQUE.iter().take(n_loads).enumerate() {
        let arm = Arm::new(load_idx, Scenario::reference().effects().friction)?;
        let reference = rows(&arm, REFERENCE, joint, &mut rng)?;
        let unique = rows(&arm, *unique, joint, &mut rng)?;
        of_loads.push(alternating(&reference, &unique).cloned().collect::<Vec<_>>());
    }

    let mut file = csv::Writer::from_path(output)?;
    file.write_record(header(joint).iter().map(String::as_str).chain([TASK]))?;
    for sample in 0..2 * N_DRAWN {
        for (task, rows) in of_loads.iter().enumerate() {
            let numbers = rows[sample].iter().map(f64::to_string);
            file.write_record(numbers.chain([task.to_string()]))?;
        }
    }
    Ok(file.flush()?)
}

/// The rows of two trajectories in turn.
fn alternating<'a>(a: &'a [Vec<f64>], b: &'a [Vec<f64>]) -> impl Iterator<Item = &'a Vec<f64>> {
    a.iter().zip(b).flat_map(|(a, b)| [a, b])
}

/// States and one torque of randomly drawn samples of a trajectory.
fn rows(
    arm: &Arm,
    (path, speed): (&str, &str),
    joint: usize,
    rng: &mut ChaCha8Rng,
) -> Result<Vec<Vec<f64>>> {
    let (scenario, model) = (&arm.scenario, arm.scenario.model());
    let trajectory = scenario.trajectory(scenario.path_idx(path)?, scenario.speed_idx(speed)?)?;
    let mut workspace = Workspace::new(model);
    let mut row = |sample: usize| {
        let (q, qd, qdd) = trajectory.state(sample);
        let mut tau = [0.0; N_JOINTS];
        let (effects, context) = (arm.effects, &arm.context);
        rnea(
            model,
            &mut workspace,
            effects,
            context,
            q,
            qd,
            qdd,
            &mut tau,
        );
        [q, qd, qdd, &[tau[joint - 1]]].concat()
    };
    let drawn = index::sample(rng, trajectory.n_samples(), N_DRAWN);
    Ok(drawn.into_iter().map(&mut row).collect())
}

fn header(joint: usize) -> Vec<String> {
    let states = ["q", "qd", "qdd"].into_iter();
    states
        .flat_map(|name| (1..=N_JOINTS).map(move |joint| format!("{name}{joint}")))
        .chain([format!("tau{joint}")])
        .collect()
}

/// Reads the first `n` samples of a file with 18 covariates, one torque and perhaps a task.
pub fn read(path: &Path, n: usize) -> Result<Samples> {
    let mut file =
        csv::Reader::from_path(path).with_context(|| format!("reading {}", path.display()))?;
    let has_tasks = file.headers()?.iter().next_back() == Some(TASK);
    let rows = (file.deserialize().take(n)).collect::<Result<Vec<Vec<f64>>, _>>()?;
    ensure!(rows.len() == n, "{} samples instead of {n}", rows.len());
    let n_columns = N_COVARIATES + 1 + usize::from(has_tasks);
    ensure!(
        rows.iter().all(|row| row.len() == n_columns),
        "a row does not have {n_columns} numbers"
    );
    let task = |row: &Vec<f64>| format!("{}", row[N_COVARIATES + 1]).parse::<usize>();
    let tasks = has_tasks.then(|| rows.iter().map(task).collect::<Result<_, _>>());
    Ok(Samples {
        x: Mat::from_fn(n, N_COVARIATES, |row, column| rows[row][column]),
        targets: rows.iter().map(|row| row[N_COVARIATES]).collect(),
        tasks: tasks.transpose()?,
    })
}
