//! The scratch memory of the recursions, made once per thread and model.

use crate::dynamics::articulated::Articulated;
use crate::dynamics::kinematics::BodyState;
use crate::dynamics::unit_motion::UnitMotion;
use crate::robot::model::Model;
use crate::spatial::inertia::BodyInertia;

/// Scratch for every algorithm of this crate.
///
/// Nothing in it survives a call: any algorithm may follow any other. After construction no
/// algorithm that takes a workspace allocates.
#[derive(Debug, Clone)]
pub struct Workspace {
    /// One per body, in the model's order.
    pub(crate) bodies: Vec<BodyState>,
    /// One per joint, always zero: speeds and accelerations of an arm at rest.
    pub(crate) zeros: Vec<f64>,
    /// Composite inertia of the subtree that starts at each body.
    pub(crate) composite: Vec<BodyInertia>,
    /// Articulated inertia of the subtree that starts at each body.
    pub(crate) articulated: Vec<Articulated>,
    /// One per joint: momentum M q̇.
    pub(crate) momentum: Vec<f64>,
    /// One per joint: sign of its load, where friction grows with it.
    pub(crate) load_signs: Vec<f64>,
    /// Of each body, body after body, at unit speed of the joint of each.
    pub(crate) unit_motions: Vec<UnitMotion>,
}

impl Workspace {
    /// Scratch for a model; every clone of the model and every payload can use it.
    #[must_use]
    pub fn new(model: &Model) -> Self {
        let n_bodies = model.bodies().len();
        Self {
            bodies: vec![BodyState::at_rest(); n_bodies],
            zeros: vec![0.0; n_bodies],
            composite: vec![BodyInertia::zero(); n_bodies],
            articulated: vec![Articulated::rigid(&BodyInertia::zero()); n_bodies],
            momentum: vec![0.0; n_bodies],
            load_signs: vec![0.0; n_bodies],
            unit_motions: vec![UnitMotion::zero(); n_bodies * n_bodies],
        }
    }

    /// # Panics
    /// If the workspace was made for another number of bodies.
    #[inline]
    pub(crate) fn check(&self, model: &Model) {
        let (have, want) = (self.bodies.len(), model.bodies().len());
        assert_eq!(
            have, want,
            "workspace of {have} bodies used with a model of {want}"
        );
    }
}
