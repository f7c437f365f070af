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
    ("bench-suite", LIBRARIES),
    ("cli", LIBRARIES),
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
pub const CIRCLES: &[&[&str]] = &[
    &[
        "bench-suite/src/cell.rs",
        "bench-suite/src/dataset.rs",
        "bench-suite/src/models.rs",
        "bench-suite/src/rigid_body/learned.rs",
        "bench-suite/src/rigid_body/parameters.rs",
        "bench-suite/src/rigid_body/rows.rs",
        "bench-suite/src/spec.rs",
    ],
    &[
        "bench-suite/src/multi/measure.rs",
        "bench-suite/src/multi/rigid_body.rs",
    ],
    &[
        "bench-suite/src/reproduce/many_contexts.rs",
        "bench-suite/src/reproduce/mod.rs",
        "bench-suite/src/reproduce/one_context.rs",
        "bench-suite/src/reproduce/unfinished.rs",
        "bench-suite/src/reproduce/unused.rs",
    ],
    &[
        "bench-suite/src/section5/context/confusion.rs",
        "bench-suite/src/section5/context/picture.rs",
    ],
    &[
        "bench-suite/src/section5/novel/learners.rs",
        "bench-suite/src/section5/novel/mod.rs",
        "bench-suite/src/section5/novel/picture.rs",
        "bench-suite/src/section5/novel/table.rs",
    ],
    &[
        "bench-suite/src/section5/sampled/chains.rs",
        "bench-suite/src/section5/sampled/mod.rs",
    ],
    &[
        "bench-suite/src/section5/transfer/mod.rs",
        "bench-suite/src/section5/transfer/picture.rs",
        "bench-suite/src/section5/transfer/table.rs",
    ],
    &[
        "gp-core/src/candidate.rs",
        "gp-core/src/fit.rs",
        "gp-core/src/opening.rs",
        "gp-core/src/search.rs",
        "gp-core/src/search_ends.rs",
        "gp-core/src/search_metric.rs",
    ],
    &["gp-core/src/cholesky.rs", "gp-core/src/tiled.rs"],
    &["gp-core/src/evidence.rs", "gp-core/src/log_marginal.rs"],
    &[
        "gp-core/src/model/predictor.rs",
        "gp-core/src/model/record.rs",
        "gp-core/src/model/torque_model.rs",
    ],
    &["kernels/src/audible.rs", "kernels/src/torque.rs"],
    &["kernels/src/se_ard.rs", "kernels/src/se_ard_adjoint.rs"],
    &[
        "mtgp/src/baselines.rs",
        "mtgp/src/ladder.rs",
        "mtgp/src/staged.rs",
    ],
    &["mtgp/src/climb.rs", "mtgp/src/task_fit.rs"],
    &["mtgp/src/latent_functions.rs", "mtgp/src/predictive.rs"],
    &[
        "mtgp/src/model/context_predictor.rs",
        "mtgp/src/model/multi_task_model.rs",
        "mtgp/src/model/record.rs",
    ],
    &[
        "mtgp/src/prior.rs",
        "mtgp/src/rank_part.rs",
        "mtgp/src/task_cov.rs",
        "mtgp/src/task_regression.rs",
    ],
    &[
        "puma-dyn/src/aba.rs",
        "puma-dyn/src/error.rs",
        "puma-dyn/src/friction.rs",
        "puma-dyn/src/kinematics.rs",
        "puma-dyn/src/model.rs",
        "puma-dyn/src/payload.rs",
        "puma-dyn/src/rnea.rs",
        "puma-dyn/src/validate.rs",
        "puma-dyn/src/warning.rs",
        "puma-dyn/src/workspace.rs",
    ],
    &[
        "puma-dyn/src/closed_loop.rs",
        "puma-dyn/src/feed_forward.rs",
    ],
    &["puma-dyn/src/description.rs", "puma-dyn/src/spatial.rs"],
    &["puma-dyn/src/sidecar.rs", "puma-dyn/src/urdf.rs"],
];
