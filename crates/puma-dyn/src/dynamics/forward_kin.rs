//! Forward kinematics: where a named frame is.

use crate::dynamics::check::check_len;
use crate::robot::model::Model;
use crate::spatial::pose::Pose;

/// Pose of a frame in the root link's frame.
///
/// ```text
/// T_root_frame = T_1(q_1) · T_2(q_2) · … · T_body_frame       along the chain from the root
/// ```
/// `frame_idx` comes from [`Model::frame_idx`]; links behind fixed joints have frames too.
///
/// # Shapes
/// `q` (n_joints,), rad or m.
///
/// # Panics
/// If `q` has another length or `frame_idx` is not an index into [`Model::frames`].
#[must_use]
pub fn forward_kinematics(model: &Model, frame_idx: usize, q: &[f64]) -> Pose {
    check_len("q", q, model.n_joints());
    let frame = &model.frames()[frame_idx];
    let mut pose = frame.pose;
    let mut next = frame.body_idx;
    while let Some(idx) = next {
        let body = &model.bodies()[idx];
        pose = body.pose_at(q[body.joint_idx]).compose(&pose);
        next = body.parent;
    }
    pose
}
