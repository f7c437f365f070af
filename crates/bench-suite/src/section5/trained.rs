//! The models that the experiments share: fitted once, kept as model files.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use mtgp::{MultiTaskOptions, StageOne, TaskFit, fit_ranks};
use rayon::prelude::*;
use torque_model::{JointModel, ModelParts, Provenance, RobotModel, TaskProcess, TrainingRanges};

use super::training_set::{Samples, TrainingSet};
use crate::dataset::{DataSet, N_JOINTS};
use crate::digest::sha256_hex;
use crate::error::BenchError;
use crate::run::Reuse;
use crate::shard::Shard;
use crate::store::write_atomically;

/// Fingerprint of sources, data and dependencies behind a model, made by the build script.
const TRAINED_BY: &str = env!("TRAINED_BY");

/// Rank of the mGP: what BIC chooses at most sizes in section 4.6.
pub const RANK: usize = 4;

/// Kinds of models as names of files begin with them.
pub const KINDS: [&str; 3] = ["mgp", "igp", "pgp"];

/// The models of one training set, each of all six joints.
#[derive(Debug, Clone)]
pub struct Trained {
    /// Rank [`RANK`].
    pub mgp: RobotModel,
    /// K^ρ = I.
    pub igp: RobotModel,
    /// K^ρ = 11ᵀ.
    pub pgp: RobotModel,
}

/// Directory of model files, each named by the hash of everything that determines it.
pub struct Shelf {
    dir: PathBuf,
    reuse: Reuse,
    shard: Shard,
    /// What this run has used, by key.
    open: Mutex<BTreeMap<String, Arc<Trained>>>,
}

impl Shelf {
    /// A shelf in a directory, which is created with the first model.
    pub fn new(dir: PathBuf, reuse: Reuse, shard: Shard) -> Self {
        Self {
            dir,
            reuse,
            shard,
            open: Mutex::new(BTreeMap::new()),
        }
    }

    /// The models of a training set: of this run, of an earlier one, or fitted now.
    ///
    /// The joints are fitted side by side on the threads of the pool that this runs in, each
    /// on one thread: the same bits for any number of them.
    /// A joint is kept as soon as it is fitted, and shards begin with different ones: those that
    /// run at the same time need not fit everything each.
    ///
    /// # Errors
    /// `MultiTask` or `Fit` if a joint cannot be learned; `Io` if a file cannot be written.
    /// # Panics
    /// If the data lack one of the loads.
    pub fn trained(&self, set: &TrainingSet, data: &DataSet) -> Result<Arc<Trained>, BenchError> {
        let key = key(set);
        let mut open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(trained) = open.get(&key) {
            return Ok(Arc::clone(trained));
        }
        let samples = set.samples(data)?;
        let places = (0..N_JOINTS).map(|place| (place + self.shard.index() - 1) % N_JOINTS);
        let mut joints: Vec<(usize, Trained)> = (places.collect::<Vec<_>>().into_par_iter())
            .map(|joint_idx| {
                let kept = (self.reuse != Reuse::Scratch).then(|| self.load(&key, joint_idx));
                if let Some(trained) = kept.flatten() {
                    return Ok((joint_idx, trained));
                }
                self.save(&key, joint_idx, &fit(set, &samples, data, joint_idx + 1)?)?;
                // As a later run will find it: logarithms that a file does not hold can differ in the last bit.
                let trained = self.load(&key, joint_idx).ok_or_else(|| {
                    BenchError::malformed(&self.dir, "a model cannot be read back")
                })?;
                Ok((joint_idx, trained))
            })
            .collect::<Result<_, BenchError>>()?;
        joints.sort_by_key(|(joint_idx, _)| *joint_idx);
        let trained = Arc::new(Trained::of_joints(joints)?);
        open.insert(key, Arc::clone(&trained));
        Ok(trained)
    }

    /// One joint's models of an earlier run; an unreadable file counts as missing.
    fn load(&self, key: &str, joint_idx: usize) -> Option<Trained> {
        let read = |model| {
            let bytes = std::fs::read(self.path(key, joint_idx, model)).ok()?;
            let model = RobotModel::from_bytes(&bytes).ok()?;
            let joints: Vec<usize> = model.learned().iter().map(|(idx, _)| *idx).collect();
            (joints == [joint_idx]).then_some(model)
        };
        Some(Trained {
            mgp: read("mgp")?,
            igp: read("igp")?,
            pgp: read("pgp")?,
        })
    }

    fn save(&self, key: &str, joint_idx: usize, trained: &Trained) -> Result<(), BenchError> {
        std::fs::create_dir_all(&self.dir).map_err(BenchError::io(&self.dir))?;
        for (kind, bytes) in trained.files() {
            write_atomically(&self.path(key, joint_idx, kind), &bytes)?;
        }
        Ok(())
    }

    /// File of one of the models of a joint.
    fn path(&self, key: &str, joint_idx: usize, model: &str) -> PathBuf {
        self.dir.join(name_of(key, joint_idx, model))
    }
}

/// Everything that the models of a training set depend on.
fn key(set: &TrainingSet) -> String {
    format!("format 2; trained by {TRAINED_BY}; {}", set.key())
}

fn name_of(key: &str, joint_idx: usize, model: &str) -> String {
    let hash = sha256_hex(key.as_bytes());
    let joint = joint_idx + 1;
    format!("{model}-joint{joint}-{}.tgp", &hash[..16])
}

/// Name of the file of one of the [`KINDS`] of a joint, from 0.
pub fn file_name(set: &TrainingSet, joint_idx: usize, kind: &str) -> String {
    name_of(&key(set), joint_idx, kind)
}

/// Fits one joint, from 1, of a training set: the contents of its files, by their [`KINDS`].
///
/// # Errors
/// `MultiTask` or `Fit`.
pub fn model_files(
    set: &TrainingSet,
    data: &DataSet,
    joint: usize,
) -> Result<[(&'static str, Vec<u8>); 3], BenchError> {
    let samples = set.samples(data)?;
    Ok(fit(set, &samples, data, joint)?.files())
}

impl Trained {
    /// Contents of the model files, by their [`KINDS`].
    fn files(&self) -> [(&'static str, Vec<u8>); 3] {
        let models = [&self.mgp, &self.igp, &self.pgp];
        std::array::from_fn(|idx| (KINDS[idx], models[idx].to_bytes()))
    }

    /// The models of all joints from those of each.
    fn of_joints(joints: Vec<(usize, Self)>) -> Result<Self, BenchError> {
        let mut of_kind: [Vec<RobotModel>; 3] = Default::default();
        for (_, Self { mgp, igp, pgp }) in joints {
            for (models, model) in of_kind.iter_mut().zip([mgp, igp, pgp]) {
                models.push(model);
            }
        }
        let [mgp, igp, pgp] = of_kind.each_ref().map(|models| together(models));
        Ok(Self {
            mgp: mgp?,
            igp: igp?,
            pgp: pgp?,
        })
    }
}

/// The process of a joint, from 0, that a model has learned.
///
/// # Panics
/// If it has not.
pub fn process_of(model: &RobotModel, joint_idx: usize) -> &TaskProcess {
    let found = model.tasks().find(|(idx, _)| *idx == joint_idx);
    found.expect("every joint is learned").1
}

/// One model of the joints of several, which know the same contexts.
fn together(models: &[RobotModel]) -> Result<RobotModel, BenchError> {
    let mut parts = models[0].parts().clone();
    parts.learned = (models.iter())
        .flat_map(|model| model.learned().iter().cloned())
        .collect();
    Ok(RobotModel::new(parts)?)
}

/// Fits one joint, from 1, of a training set: mGP, iGP and pGP.
///
/// # Errors
/// `MultiTask` or `Fit`.
/// # Source
/// A.3.
fn fit(
    set: &TrainingSet,
    samples: &Samples,
    data: &DataSet,
    joint: usize,
) -> Result<Trained, BenchError> {
    let [mgp, igp, pgp] = fit_joint(samples, data, joint)?
        .map(|fit| model(set, samples, vec![(joint - 1, JointModel::from(fit))]));
    Ok(Trained {
        mgp: mgp?,
        igp: igp?,
        pgp: pgp?,
    })
}

fn fit_joint(samples: &Samples, data: &DataSet, joint: usize) -> Result<[TaskFit; 3], BenchError> {
    let targets = samples.targets(data, joint);
    let options = MultiTaskOptions::several();
    let stage_one = StageOne::new(&samples.stacked, &targets, &options)?;
    let fits = fit_ranks(&samples.stacked, &targets, &[RANK], &stage_one, &options)?;
    let mgp = fits.into_iter().next().expect("one fit a rank");
    Ok([mgp, stage_one.independent, stage_one.pooled])
}

/// The model file's contents.
fn model(
    set: &TrainingSet,
    samples: &Samples,
    learned: Vec<(usize, JointModel)>,
) -> Result<RobotModel, BenchError> {
    let n_each = set.n_each();
    let of_context = |task: usize| {
        let rows = samples.stacked.covariates();
        TrainingRanges::of(rows.subrows(task * n_each, n_each))
    };
    let context_ranges: Result<_, _> = (0..set.n_contexts).map(of_context).collect();
    Ok(RobotModel::new(ModelParts {
        joint_names: (1..=N_JOINTS)
            .map(|joint| format!("joint{joint}"))
            .collect(),
        contexts: (1..=set.n_contexts)
            .map(|load| format!("c{load}"))
            .collect(),
        learned,
        ranges: TrainingRanges::of(samples.x.as_ref())?,
        context_ranges: context_ranges?,
        selection: None,
        robot: None,
        provenance: Provenance::new(
            concat!("bench-suite ", env!("CARGO_PKG_VERSION")),
            set.key().as_bytes(),
        ),
    })?)
}
