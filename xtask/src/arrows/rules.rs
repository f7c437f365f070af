//! What may know what; paths are below `crates/`.

/// The crates that each crate may use: no more, and fewer are fine.
pub const MAY_USE: &[(&str, &[&str])] = &[
    ("puma-dyn", &[]),
    ("linalg", &[]),
    ("kernels", &["linalg"]),
    ("gp-core", &["linalg", "kernels"]),
    ("mtgp", &["linalg", "kernels", "gp-core"]),
    (
        "torque-model",
        &["linalg", "kernels", "gp-core", "mtgp", "puma-dyn"],
    ),
    ("robot-log", &["puma-dyn", "torque-model"]),
    ("bench-suite", LIBRARIES),
    (
        "cli",
        &[
            "linalg",
            "kernels",
            "gp-core",
            "mtgp",
            "puma-dyn",
            "torque-model",
            "robot-log",
        ],
    ),
];

const LIBRARIES: &[&str] = &[
    "linalg",
    "kernels",
    "gp-core",
    "mtgp",
    "puma-dyn",
    "torque-model",
];

/// What files must not import.
pub struct Rule {
    /// Whom it concerns: files whose path begins with this …
    pub folder: &'static str,
    /// … and ends with one of these.
    pub endings: &'static [&'static str],
    /// Beginnings of the paths that they must not import from …
    pub must_not: &'static [&'static str],
    /// … unless they begin with one of these.
    pub but_may: &'static [&'static str],
    /// What the rule keeps true.
    pub reason: &'static str,
}

const MODELS: &[&str] = &["gp-core/", "mtgp/", "torque-model/"];

/// The rules inside crates.
pub const RULES: &[Rule] = &[
    Rule {
        folder: "gp-core/src/optimize/",
        endings: &[".rs"],
        must_not: &["gp-core/"],
        but_may: &["gp-core/src/optimize/", "gp-core/src/error.rs"],
        reason: "the optimiser knows no Gaussian process",
    },
    Rule {
        folder: "bench-suite/src/report/",
        endings: &[".rs"],
        must_not: MODELS,
        but_may: &[],
        reason: "a report reads records, never a model",
    },
    Rule {
        folder: "bench-suite/src/section5/",
        endings: &["/findings.rs", "/picture.rs", "/table.rs", "/confusion.rs"],
        must_not: MODELS,
        but_may: &[],
        reason: "a report reads records, never a model",
    },
];

/// Circles of files that there still are: a line goes when its circle is opened, and none comes.
pub const CIRCLES: &[&[&str]] = &[];
