//! The commands of `torque-gp` whose results are compared, as tables.

use super::group::Group;

/// One command; its results are the file that it writes and its standard output, where there is any.
#[derive(Debug)]
pub struct Line {
    /// Group of the results.
    pub group: Group,
    /// Name of the results inside the group.
    pub name: String,
    /// Arguments, with blanks between them; `{root}` stands for the root of the repository.
    pub arguments: String,
    /// File that it writes.
    pub output: Option<String>,
}

/// A model to be fitted: its name, the table it is learned from, and further arguments of `fit`.
struct Model(&'static str, &'static str, &'static str);

const MODELS: &[Model] = &[
    Model("gpc", "one", "--model gpc"),
    Model("gpc-dense", "one", "--model gpc --method dense"),
    Model("gpc-certified", "one", "--model gpc --method certified"),
    Model("gpc-chapter", "one", "--model gpc --starts chapter"),
    Model("gpc-700", "one-700", "--model gpc --joints 3,5"),
    Model(
        "gpc-700-dense",
        "one-700",
        "--model gpc --joints 3 --method dense",
    ),
    Model(
        "gpc-700-certified",
        "one-700",
        "--model gpc --joints 3 --method certified",
    ),
    Model("gp", "one", "--model gp"),
    Model("lrc", "one", "--model lrc"),
    Model("lr", "one", "--model lr"),
    Model("rbd", "one", "--model rbd --robot puma560"),
    Model("rbd-gp", "one", "--model rbd+gp --robot puma560"),
    Model(
        "rbd-gp-dense",
        "one",
        "--model rbd+gp --robot puma560 --joints 2,3 --method dense",
    ),
    Model(
        "rbd-gp-certified",
        "one",
        "--model rbd+gp --robot puma560 --joints 2,3 --method certified",
    ),
    Model(
        "rbd-gp-700",
        "one-700",
        "--model rbd+gp --robot puma560 --joints 3",
    ),
    Model("mgp-2", "many", "--model mgp --rank 2"),
    Model("mgp-4", "many", "--model mgp --rank 4 --joints 1,3"),
    Model(
        "mgp-2-dense",
        "many-apart",
        "--model mgp --rank 2 --joints 3 --method dense",
    ),
    Model(
        "mgp-2-certified",
        "many-apart",
        "--model mgp --rank 2 --joints 3 --method certified",
    ),
    Model(
        "mgp-4-chapter",
        "many-apart",
        "--model mgp --rank 4 --joints 3,6 --starts chapter",
    ),
    Model(
        "mgp-bic",
        "many-apart",
        "--model mgp --rank bic --joints 2,3",
    ),
    Model("mgp-2-600", "many-600", "--model mgp --rank 2 --joints 3"),
    Model("igp", "many", "--model igp"),
    Model(
        "igp-certified",
        "many-apart",
        "--model igp --joints 3 --method certified",
    ),
    Model("igp-600", "many-600", "--model igp --joints 3"),
    Model("pgp", "many", "--model pgp"),
    Model(
        "pgp-certified",
        "many-apart",
        "--model pgp --joints 3 --method certified",
    ),
    Model("pgp-600", "many-600", "--model pgp --joints 3"),
];

/// Commands that need no model: group, name, arguments, and the ending of the file that they write.
const WITHOUT_MODEL: &[(Group, &str, &str, Option<&str>)] = &[
    (
        Group::Robot,
        "puma560-torques",
        "inverse-dynamics --tau-prefix computed --robot puma560 --payload load.toml --terms --input one-test.csv",
        Some("csv"),
    ),
    (
        Group::Robot,
        "puma560-torques-2008",
        "inverse-dynamics --tau-prefix computed --robot puma560 --friction toolbox-2008 --no-rotor-inertia --input one-test.csv",
        Some("csv"),
    ),
    (
        Group::Robot,
        "gen3-torques",
        "inverse-dynamics --tau-prefix computed --robot {root}/fixtures/puma-dyn/gen3.urdf --terms --input {root}/fixtures/kinova_gen3/test.csv",
        Some("csv"),
    ),
    (
        Group::Chains,
        "gpc",
        "sample --data one.csv --joint 3 --chains 2 --warmup 50 --draws 50 --max-depth 5",
        Some("csv"),
    ),
    (
        Group::Chains,
        "gpc-certified",
        "sample --data one.csv --joint 3 --chains 2 --warmup 20 --draws 20 --max-depth 4 --seed 7 --method certified",
        Some("csv"),
    ),
];

/// A loop of half a second or so; a feed-forward follows.
const CONTROL: &str = "control --robot puma560 --payload load.toml --reference one-reference.csv --bandwidth 8 --json --feed-forward";

/// Feed-forward torques that are no model's.
const FEED_FORWARDS: [&str; 3] = ["none", "gravity", "exact"];

/// Models that a context is added to and that tell contexts apart.
const OF_CONTEXTS: [&str; 4] = ["mgp-2", "mgp-4", "mgp-bic", "igp"];

/// Ways to ask which context torques come from: name, further arguments, and whether there is a row for each row.
const WAYS_TO_ASK: &[(&str, &str, bool)] = &[
    ("total", "--data log.csv", true),
    ("prior", "--data log.csv --prior c1=3,c3=1 --window 0", true),
    ("noise", "--data log.csv --noise 0.3", true),
    ("new", "--data new.csv", true),
    (
        "switching",
        "--data log-changes.csv --switching 0.5 --interval 0.0175 --noise 0.1",
        true,
    ),
    (
        "held-out",
        "--data log.csv --held-out many-test.csv --level 0.2",
        false,
    ),
];

/// Every command that the groups need, in an order in which they can be run.
pub fn lines(groups: &[Group]) -> Vec<Line> {
    let mut lines = Vec::new();
    if groups.iter().any(|group| group.needs_models()) {
        lines.extend(MODELS.iter().flat_map(Model::learned));
    }
    lines.extend(
        WITHOUT_MODEL
            .iter()
            .map(|(group, name, arguments, ending)| line(*group, name, arguments, *ending)),
    );
    lines.extend(FEED_FORWARDS.iter().map(|source| {
        let arguments = format!("{CONTROL} {source}");
        line(Group::Loop, source, &arguments, Some("csv"))
    }));
    lines.extend(MODELS.iter().flat_map(Model::used));
    lines.extend(OF_CONTEXTS.iter().flat_map(|model| contexts(model)));
    lines.extend(likelihoods());
    lines.retain(|line| groups.contains(&line.group) || line.is_model());
    lines
}

/// A command that writes `<group>-<name>.<ending>`, or to standard output alone.
fn line(group: Group, name: &str, arguments: &str, ending: Option<&str>) -> Line {
    let output = ending.map(|ending| match group {
        Group::Models => format!("{name}.{ending}"),
        _ => format!("{}-{name}.{ending}", group.name()),
    });
    let arguments = match &output {
        Some(file) => format!("{arguments} --output {file}"),
        None => arguments.to_owned(),
    };
    Line {
        group,
        name: name.to_owned(),
        arguments,
        output,
    }
}

impl Line {
    /// Whether it writes a model file that other commands read.
    fn is_model(&self) -> bool {
        self.group == Group::Models && self.output.is_some()
    }
}

impl Model {
    /// Its fit and what is in its file.
    fn learned(&self) -> [Line; 2] {
        let Self(name, data, flags) = self;
        let fit = format!("fit --data {data}.csv {flags}");
        let inspect = format!("inspect {name}.tgp --json");
        [
            line(Group::Models, name, &fit, Some("tgp")),
            line(Group::Models, &format!("{name}-inspect"), &inspect, None),
        ]
    }

    /// What it predicts: all states at once, and one at a time.
    fn used(&self) -> [Line; 4] {
        let Self(name, data, _) = self;
        let many = data.starts_with("many");
        let (test, context) = if many {
            ("many-test", " --context c3")
        } else {
            ("one-test", "")
        };
        let model = format!("--model {name}.tgp");
        let predict = format!("predict --tau-prefix learned {model} --input {test}.csv");
        let evaluate = format!("evaluate {model} --data {test}.csv --json");
        let observed = format!("{predict} --observed{context}");
        let control = format!("{CONTROL} {name}.tgp{context}");
        let of = |what: &str| format!("{name}-{what}");
        [
            line(Group::Predictions, &of("latent"), &predict, Some("csv")),
            line(Group::Predictions, &of("observed"), &observed, Some("csv")),
            line(Group::Predictions, &of("scores"), &evaluate, None),
            line(Group::Loop, name, &control, Some("csv")),
        ]
    }
}

/// Adaptation of a model, what comes of it, and the contexts that it takes torques for.
fn contexts(model: &str) -> Vec<Line> {
    let mut lines = Vec::new();
    for (way, flags) in [
        ("", ""),
        ("-row-only", " --row-only"),
        ("-few", " --rows 3"),
    ] {
        let name = format!("{model}{way}");
        let adapt = format!("adapt --model {model}.tgp --data new.csv --context c15{flags}");
        let predict = format!(
            "predict --tau-prefix learned --model adapt-{name}.tgp --context c15 --input new-test.csv"
        );
        let known = format!(
            "predict --tau-prefix learned --model adapt-{name}.tgp --input many-test.csv --observed"
        );
        lines.extend([
            line(Group::Adapt, &name, &adapt, Some("tgp")),
            line(Group::Adapt, &format!("{name}-new"), &predict, Some("csv")),
            line(Group::Adapt, &format!("{name}-known"), &known, Some("csv")),
        ]);
    }
    for (way, flags, has_rows) in WAYS_TO_ASK {
        let arguments = format!("context --model {model}.tgp {flags} --json");
        let ending = has_rows.then_some("csv");
        let name = format!("{model}-{way}");
        lines.push(line(Group::Context, &name, &arguments, ending));
    }
    lines
}

/// Likelihood and gradient of every size and method, for one context and for several.
fn likelihoods() -> Vec<Line> {
    let mut lines = Vec::new();
    for contexts in ["one", "many"] {
        for n in [100, 700, 1300, 4000] {
            for method in ["dense", "certified"] {
                let arguments = format!(
                    "likelihood --data likelihood-{contexts}-{n}.csv --joint 3 --hyperparameters {contexts}.toml --method {method} --json"
                );
                let name = format!("{contexts}-{n}-{method}");
                lines.push(line(Group::Likelihood, &name, &arguments, None));
            }
        }
    }
    lines
}
