//! The model files of section 5: which training set they are of, and their names of today.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};
use torque_model::RobotModel;

use crate::dataset::N_JOINTS;
use crate::error::BenchError;
use crate::section_experiment::SectionExperiment;
use crate::section5::trained::{KINDS, file_name};
use crate::section5::training_set::TrainingSet;
use crate::store::write_atomically;

/// The models of a joint: file and contents, by kind.
type OfJoint = BTreeMap<&'static str, (PathBuf, Vec<u8>)>;

/// Model files by training set, its place among the sets, and joint, from 0.
pub(super) struct OldModels {
    sets: Vec<TrainingSet>,
    found: BTreeMap<(usize, usize), OfJoint>,
    /// Second files of the same models that are not the same bytes.
    pub contradictions: Vec<String>,
    /// Files that today's program has already.
    pub n_there: usize,
}

impl OldModels {
    /// None yet, of the training sets of the experiments.
    ///
    /// # Errors
    /// `Experiment` for settings that are not of the form.
    pub fn of(experiments: &[SectionExperiment]) -> Result<Self, BenchError> {
        let mut sets = Vec::new();
        for experiment in experiments {
            for profile in experiment.profiles() {
                let set = TrainingSet::of_experiment(experiment, profile)?;
                sets.extend(set.filter(|set| !sets.contains(set)));
            }
        }
        Ok(Self {
            sets,
            found: BTreeMap::new(),
            contradictions: Vec::new(),
            n_there: 0,
        })
    }

    /// Takes in a file.
    ///
    /// # Errors
    /// The reason why it is not a model that today's experiments use.
    pub fn read(&mut self, path: &Path, bytes: Vec<u8>, output: &Path) -> Result<(), String> {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let is_named = |kind: &&&str| name.starts_with(&format!("{kind}-"));
        let kind = KINDS.iter().find(is_named);
        let kind = *kind.ok_or("the name of the file is not one of a model")?;
        let model = RobotModel::from_bytes(&bytes).map_err(|error| error.to_string())?;
        let [(joint_idx, _)] = model.learned() else {
            return Err("it is not a model of one joint".to_string());
        };
        let digest = model.provenance().data_sha256;
        let is_set = |set: &TrainingSet| digest == <[u8; 32]>::from(Sha256::digest(set.key()));
        let set = self.sets.iter().position(is_set);
        let set = set.ok_or("no experiment of today has its training set")?;
        let file = file_name(&self.sets[set], *joint_idx, kind);
        if directory(output).join(file).exists() {
            self.n_there += 1;
            return Ok(());
        }
        let of_joint = self.found.entry((set, *joint_idx)).or_default();
        if let Some((first, contents)) = of_joint.get(kind) {
            if *contents != bytes {
                let (first, second) = (first.display(), path.display());
                let line = format!("{first} and {second}: the same model, and not the same bytes");
                self.contradictions.push(line);
            }
            return Ok(());
        }
        of_joint.insert(kind, (path.to_path_buf(), bytes));
        Ok(())
    }

    /// Drops joints of which a model is missing: a run would fit all three again.
    pub fn remove_incomplete(&mut self) -> Vec<String> {
        let is_whole = |of_joint: &OfJoint| of_joint.len() == KINDS.len();
        let parts = self.found.values().filter(|of_joint| !is_whole(of_joint));
        let files = parts.flat_map(OfJoint::values);
        let lines = files.map(|(path, _)| {
            let path = path.display();
            format!("{path}: the other models of its joint are missing")
        });
        let lines = lines.collect();
        self.found.retain(|_, of_joint| is_whole(of_joint));
        lines
    }

    /// One joint, from 0, of each training set: that of the smallest files, whose factors are smallest.
    pub fn witnesses(&self) -> Vec<(&TrainingSet, usize)> {
        let size = |of_joint: &OfJoint| -> usize {
            let files = of_joint.values();
            files.map(|(_, contents)| contents.len()).sum()
        };
        let chosen = (0..self.sets.len()).filter_map(|set| {
            let of_set = self.found.iter().filter(|((of, _), _)| *of == set);
            let (&(_, joint_idx), _) = of_set.min_by_key(|(_, of_joint)| size(of_joint))?;
            Some((&self.sets[set], joint_idx))
        });
        chosen.collect()
    }

    /// What is not the same in a witness fitted again: the place of the first byte that differs.
    pub fn compared(
        &self,
        (set, joint_idx): (&TrainingSet, usize),
        fitted: &[(&'static str, Vec<u8>)],
    ) -> Vec<String> {
        let set_idx = self.sets.iter().position(|of| of == set);
        let of_joint = set_idx.and_then(|idx| self.found.get(&(idx, joint_idx)));
        let mut lines = Vec::new();
        for (kind, new) in fitted {
            let old = of_joint.and_then(|of_joint| of_joint.get(kind));
            let Some((path, old)) = old.filter(|(_, old)| old != new) else {
                continue;
            };
            let at = old.iter().zip(new).position(|(a, b)| a != b);
            let at = at.unwrap_or(old.len().min(new.len()));
            let byte = |bytes: &[u8]| bytes.get(at).map_or("absent".to_string(), u8::to_string);
            let (path, was, is) = (path.display(), byte(old), byte(new));
            lines.push(format!("{path}: byte {at} was {was}, is {is}"));
        }
        lines
    }

    /// Writes all files under today's names; how many.
    pub fn write(&self, output: &Path) -> Result<usize, BenchError> {
        let mut n = 0;
        for ((set, joint_idx), of_joint) in &self.found {
            for (kind, (_, contents)) in of_joint {
                let file = file_name(&self.sets[*set], *joint_idx, kind);
                if !directory(output).join(&file).exists() {
                    keep(output, &file, contents)?;
                }
                n += 1;
            }
        }
        Ok(n)
    }

    /// Copies what today's program has already.
    pub fn copy_finished(&self, output: &Path, to: &Path) -> Result<(), BenchError> {
        for set in &self.sets {
            for joint_idx in 0..N_JOINTS {
                for file in KINDS.map(|kind| file_name(set, joint_idx, kind)) {
                    if let Ok(contents) = std::fs::read(directory(output).join(&file)) {
                        keep(to, &file, &contents)?;
                    }
                }
            }
        }
        Ok(())
    }
}

fn directory(output: &Path) -> PathBuf {
    output.join("models")
}

fn keep(output: &Path, file: &str, contents: &[u8]) -> Result<(), BenchError> {
    let directory = directory(output);
    std::fs::create_dir_all(&directory).map_err(BenchError::io(&directory))?;
    write_atomically(&directory.join(file), contents)
}
