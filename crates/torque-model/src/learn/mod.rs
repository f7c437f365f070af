//! Ways to learn the torques of a robot's joints: one list for the command, the experiments and other programs.

mod candidate;
mod described_contexts;
mod learner;
mod linear;
mod many_contexts;
mod own_unit;
mod process;
mod rigid_body;
mod shared_parameters;

pub use candidate::{Candidate, TaskCandidate};
pub use described_contexts::DescribedContexts;
pub use learner::{Learn, Learned, LearnedJoint, Silent, Watch, learn_joints};
pub use linear::{Linear, LinearVariances};
pub use many_contexts::{ManyContexts, Ranks, Tasks, candidate_ranks};
pub use own_unit::{InOwnUnit, own_unit};
pub use process::SingleProcess;
pub use rigid_body::{InformedJoint, RigidBody, RigidBodyForm};
pub use shared_parameters::SharedParameters;
