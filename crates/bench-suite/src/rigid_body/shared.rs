//! rbd as `torque-gp fit --model rbd` learns it: one vector of parameters for all joints and loads of the arm.

use torque_model::learn::SharedParameters;
use torque_model::rigid_body::{SharedJoint, TermSet};
use torque_model::{JointModel, JointTorques, Provenance, RobotModel, Samples, Timeline};

use super::parameters;
use crate::dataset::{DataSet, N_JOINTS};
use crate::error::BenchError;

/// Where the friction terms of a joint come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Terms {
    /// Chosen joint by joint, by what is left out.
    Chosen,
    /// Signs of velocity: those of the simulated arm.
    Signs,
}

impl Terms {
    /// Both, in the order of the tables.
    pub const ALL: [Self; 2] = [Self::Chosen, Self::Signs];

    /// Name of the model in files and legends.
    pub fn name(self) -> &'static str {
        match self {
            Self::Chosen => "rbd-shared",
            Self::Signs => "rbd-shared-signs",
        }
    }

    /// That of the command: `--model rbd --robot puma560`, and with signs `--friction-terms signs`.
    pub fn learner(self) -> SharedParameters {
        SharedParameters {
            terms: match self {
                Self::Chosen => None,
                Self::Signs => Some(TermSet::Signs),
            },
            ..SharedParameters::new(parameters::robot())
        }
    }

    /// Learns all joints and loads of samples.
    ///
    /// # Errors
    /// `Model` if they cannot be learned.
    pub fn learn(self, samples: &Samples) -> Result<RobotModel, BenchError> {
        let provenance = Provenance::new(concat!("bench-suite ", env!("CARGO_PKG_VERSION")), b"");
        Ok(RobotModel::learn(samples, &self.learner(), provenance)?)
    }
}

/// A joint, from 1, of a model that [`Terms::learn`] made.
///
/// # Panics
/// If it was not made so, or there is no such joint.
pub fn joint_of(model: &RobotModel, joint: usize) -> &SharedJoint {
    let found = model.learned().iter().find(|(idx, _)| *idx == joint - 1);
    match found {
        Some((_, JointModel::Shared(of_joint))) => of_joint,
        _ => panic!("joint {joint} has no parameters that others share"),
    }
}

/// Samples of all joints as a user has them: rows of the data set under each of some loads, from 1.
///
/// The torques of one load name no context.
/// # Panics
/// If a load was not simulated, or a row does not exist.
pub fn samples<R: AsRef<[usize]>>(data: &DataSet, loads: &[(usize, R)]) -> Samples {
    let rows: Vec<usize> = (loads.iter())
        .flat_map(|(_, rows)| rows.as_ref().iter().copied())
        .collect();
    let of_joint = |joint: usize| JointTorques {
        joint_idx: joint - 1,
        values: (loads.iter())
            .flat_map(|(load, rows)| data.torques(*load, joint, rows.as_ref()))
            .collect(),
    };
    let named: &[(usize, R)] = if loads.len() > 1 { loads } else { &[] };
    let of_context = |(context, (_, rows)): (usize, &(usize, R))| {
        std::iter::repeat_n(context, rows.as_ref().len())
    };
    Samples {
        joint_names: (1..=N_JOINTS).map(|i| format!("joint{i}")).collect(),
        contexts: named.iter().map(|(load, _)| format!("c{load}")).collect(),
        context_of: named.iter().enumerate().flat_map(of_context).collect(),
        x: data.x(&rows),
        torques: (1..=N_JOINTS).map(of_joint).collect(),
        timeline: Timeline::default(),
        continuous: torque_model::ContinuousJoints::none(),
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use torque_model::{Robot, RobotSource};

    use super::*;
    use crate::cell::{Cell, ModelKind};
    use crate::measure::measure;
    use crate::metrics::nmse_of_sets;
    use crate::rigid_body::rows::Regressors;
    use crate::split::Split;

    fn cell(model: ModelKind, joint: usize) -> Cell {
        Cell {
            seed: "test".to_string(),
            load: 7,
            joint,
            model,
            n: 80,
        }
    }

    /// Samples of c7 as a file of them has them.
    fn of_user(data: &DataSet, rows: &[usize]) -> Samples {
        let names = (1..=N_JOINTS).map(|i| format!("joint{i}")).collect();
        let torques = (0..N_JOINTS).map(|joint_idx| JointTorques {
            joint_idx,
            values: data.torques(7, joint_idx + 1, rows),
        });
        Samples::of_one_context(names, data.x(rows), torques.collect()).unwrap()
    }

    #[test]
    fn a_cell_is_what_a_user_learns() {
        let data = DataSet::simulate(&BTreeSet::from([7])).unwrap();
        let (regressors, split) = (Regressors::new(&data), Split::draw("test", 7));
        for (model, terms) in [
            (ModelKind::SharedParameters, None),
            (ModelKind::SharedParametersSigns, Some(TermSet::Signs)),
        ] {
            let cell = cell(model, 3);
            let record = measure(&cell, &data, &regressors, &split).unwrap();
            let source = RobotSource {
                urdf: None,
                sidecar: None,
                gravity: None,
            };
            let mut learner = SharedParameters::new(Robot::new(source, "puma560").unwrap());
            learner.terms = terms;
            let samples = of_user(&data, &split.subset("test", 7, 80));
            let provenance = Provenance::new("test", b"");
            let model = RobotModel::learn(&samples, &learner, provenance).unwrap();
            let of_user = model.predict_joint(2, 0, data.x(&split.extrap).as_ref());
            let truth = data.torques(7, 3, &split.extrap);
            let scores = nmse_of_sets(&split, &of_user.unwrap().mean, &truth).unwrap();
            let found = [record.nmse_interp, record.nmse_extrap];
            assert_eq!(found.map(f64::to_bits), scores.map(f64::to_bits));
            assert_eq!(record.fit, None);
        }
    }

    /// With the simulation's own terms the error is that of the least noise, 1e-4 of the torques, and of less rows:
    /// nMSE about (1e-4)² times the ratio of squares to variance.
    #[test]
    fn with_the_terms_of_the_simulation_every_joint_is_exact_to_the_least_noise() {
        let data = DataSet::simulate(&BTreeSet::from([7])).unwrap();
        let (regressors, split) = (Regressors::new(&data), Split::draw("test", 7));
        for joint in 1..=N_JOINTS {
            let cell = cell(ModelKind::SharedParametersSigns, joint);
            let record = measure(&cell, &data, &regressors, &split).unwrap();
            assert!(record.nmse_interp < 1e-6, "{record:?}");
            assert!(record.nmse_extrap < 1e-5, "{record:?}");
        }
    }

    #[test]
    fn contexts_are_named_where_there_are_several() {
        let data = DataSet::simulate(&BTreeSet::from([2, 7])).unwrap();
        let one = samples(&data, &[(7, [3, 5])]);
        assert!(one.contexts.is_empty() && one.context_of.is_empty());
        let two = samples(&data, &[(2, vec![3]), (7, vec![3, 5])]);
        assert_eq!(
            (two.contexts, two.context_of),
            (vec!["c2".to_string(), "c7".to_string()], vec![0, 1, 1])
        );
        assert_eq!(two.torques[4].values[1..], one.torques[4].values);
        assert_eq!(two.torques[4].values[..1], data.torques(2, 5, &[3]));
    }
}
