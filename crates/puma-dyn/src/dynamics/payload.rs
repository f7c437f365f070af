//! Payloads: bodies that an arm picks up and puts down without its model being rebuilt.
//!
//! A [`Payload`] is validated once in its own frame, [`Model::attach`] moves its ten inertial
//! parameters to the body that carries it by the parallel-axis rule, and a [`Context`] holds what is
//! attached right now. Inertial parameters of rigidly connected bodies add, so a loaded arm is the
//! arm plus its context.

use nalgebra::{Matrix3, Vector3};

use crate::error::DynError;
use crate::robot::model::Model;
use crate::robot::validate;
use crate::spatial::inertia::BodyInertia;
use crate::spatial::pose::rotation_from_rpy;

/// How errors name a payload, which has no name of its own.
const NAME: &str = "payload";

/// A rigid body in the axes of the frame it will be attached to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Payload {
    inertia: BodyInertia,
}

impl Payload {
    /// A payload from mass, centre of mass and inertia tensor.
    ///
    /// `mass` in kg; `centre` in m, in the frame it will be attached to; `inertia` =
    /// [xx, yy, zz, xy, xz, yz] about the *centre of mass*, in that frame's axes, kg m². The products
    /// are the entries of the tensor: xy = −∫ x y dm.
    ///
    /// # Errors
    /// - [`DynError::NonFinite`] or [`DynError::OutOfRange`] if a number is NaN or infinite, or the
    ///   mass is negative.
    /// - [`DynError::Unphysical`] if the tensor has a negative eigenvalue, breaks the triangle
    ///   inequality, or belongs to a body without mass.
    pub fn new(mass: f64, centre: [f64; 3], inertia: [f64; 6]) -> Result<Self, DynError> {
        validate::finite_not_negative("payload", NAME, "mass", mass)?;
        validate::finite("payload", NAME, "centre of mass", &centre)?;
        validate::finite("payload", NAME, "inertia", &inertia)?;
        let [xx, yy, zz, xy, xz, yz] = inertia;
        let tensor = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        match validate::unphysical(mass, &tensor) {
            None => {
                let inertia = BodyInertia::from_central(mass, Vector3::from(centre), &tensor);
                Ok(Self { inertia })
            }
            Some(reason) => Err(DynError::Unphysical {
                what: "payload",
                name: NAME.to_owned(),
                reason,
            }),
        }
    }

    /// A homogeneous cuboid.
    ///
    /// ```text
    /// I = R diag(m (y² + z²) / 12, m (x² + z²) / 12, m (x² + y²) / 12) Rᵀ
    /// ```
    /// `mass` in kg; `size` = (x, y, z) edge lengths in m along the cuboid's own axes; `centre` in m
    /// and `rpy` in rad (roll, pitch, yaw about the fixed axes x, y, z) place those axes in the
    /// frame it will be attached to.
    ///
    /// # Errors
    /// [`DynError::NonFinite`] or [`DynError::OutOfRange`] if a number is NaN or infinite, or the
    /// mass or an edge is negative.
    pub fn cuboid(
        mass: f64,
        size: [f64; 3],
        centre: [f64; 3],
        rpy: [f64; 3],
    ) -> Result<Self, DynError> {
        validate::finite("payload", NAME, "orientation", &rpy)?;
        for edge in size {
            validate::finite_not_negative("payload", NAME, "edge length", edge)?;
        }
        let [x, y, z] = size.map(|edge| mass * edge * edge / 12.0);
        let r = rotation_from_rpy(rpy);
        let tensor = r * Matrix3::from_diagonal(&Vector3::new(y + z, x + z, x + y)) * r.transpose();
        let inertia = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].map(|at| tensor[at]);
        Self::new(mass, centre, inertia)
    }

    /// Mass, kg.
    pub fn mass(&self) -> f64 {
        self.inertia.mass
    }

    /// Mass times centre of mass, in the axes and about the origin of its frame, kg m.
    pub fn first_moments(&self) -> [f64; 3] {
        self.inertia.first_moment.into()
    }
}

/// A payload expressed in the body that carries it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AttachedPayload {
    pub(crate) body_idx: usize,
    pub(crate) inertia: BodyInertia,
}

impl Model {
    /// Fixes a payload to a named frame; the model itself does not change.
    ///
    /// `frame_idx` comes from [`Model::frame_idx`]; the payload's centre and axes are in that frame.
    ///
    /// # Errors
    /// [`DynError::FrameDoesNotMove`] if the frame is fixed to the ground.
    ///
    /// # Panics
    /// If `frame_idx` is not an index into [`Model::frames`].
    pub fn attach(&self, frame_idx: usize, payload: &Payload) -> Result<AttachedPayload, DynError> {
        let frame = &self.frames()[frame_idx];
        match frame.body_idx {
            None => Err(DynError::FrameDoesNotMove {
                frame: frame.name.clone(),
            }),
            Some(body_idx) => Ok(AttachedPayload {
                body_idx,
                inertia: payload.inertia.in_parent(&frame.pose),
            }),
        }
    }
}

/// What an arm carries: no, one or several payloads.
///
/// Every algorithm takes a context by reference. Keep one per load and pass another to swap loads,
/// or [`replace`](Context::replace) in place; neither allocates.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Context {
    loads: Vec<AttachedPayload>,
}

impl Context {
    /// The unloaded arm.
    #[must_use]
    pub const fn empty() -> Self {
        Self { loads: Vec::new() }
    }

    /// An arm that carries these payloads.
    #[must_use]
    pub fn new(loads: impl IntoIterator<Item = AttachedPayload>) -> Self {
        Self {
            loads: loads.into_iter().collect(),
        }
    }

    /// The attached payloads.
    pub fn loads(&self) -> &[AttachedPayload] {
        &self.loads
    }

    /// Swaps one payload for another and returns the old one; allocates nothing.
    ///
    /// # Panics
    /// If `idx` is not an index into [`Context::loads`].
    pub fn replace(&mut self, idx: usize, load: AttachedPayload) -> AttachedPayload {
        std::mem::replace(&mut self.loads[idx], load)
    }
}

impl From<AttachedPayload> for Context {
    fn from(load: AttachedPayload) -> Self {
        Self { loads: vec![load] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chapter::puma560;

    #[test]
    fn a_cuboid_turned_by_a_quarter_about_z_swaps_its_x_and_y_edges() {
        // Rotated cuboid = cuboid of exchanged edges; 12 kg makes the moments sums of squares.
        let quarter = std::f64::consts::FRAC_PI_2;
        let turned = Payload::cuboid(12.0, [1.0, 2.0, 3.0], [0.1; 3], [0.0, 0.0, quarter]).unwrap();
        let swapped = Payload::new(12.0, [0.1; 3], [10.0, 13.0, 5.0, 0.0, 0.0, 0.0]).unwrap();
        let difference = turned.inertia.second_moment - swapped.inertia.second_moment;
        assert!(difference.norm() < 1e-14, "{difference}");
    }

    #[test]
    fn a_roll_tilts_the_cuboid_about_the_frames_x_axis() {
        // A rod along z, rolled by 45° about x: ∫ y z dm = −(m L² / 12) sin 45° cos 45° = −0.5.
        let eighth = std::f64::consts::FRAC_PI_4;
        let rod = Payload::cuboid(12.0, [0.0, 0.0, 1.0], [0.0; 3], [eighth, 0.0, 0.0]).unwrap();
        assert!(
            (rod.inertia.second_moment[(1, 2)] + 0.5).abs() < 1e-15,
            "{rod:?}"
        );
    }

    #[test]
    fn impossible_payloads_are_refused_by_name() {
        let centre = [0.0; 3];
        let refused = |mass, inertia| Payload::new(mass, centre, inertia).unwrap_err().to_string();
        assert!(refused(-1.0, [0.0; 6]).contains("mass is -1"));
        assert!(refused(f64::NAN, [0.0; 6]).contains("mass is NaN"));
        let triangle = refused(1.0, [1.0, 1.0, 2.1, 0.0, 0.0, 0.0]);
        assert!(
            triangle.contains("triangle inequality: 2.1 > 1 + 1"),
            "{triangle}"
        );
        let negative = refused(1.0, [1.0, 1.0, 1.0, 1.5, 0.0, 0.0]);
        assert!(negative.contains("negative eigenvalue"), "{negative}");
        let massless = refused(0.0, [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
        assert!(massless.contains("no mass"), "{massless}");
        let edge = Payload::cuboid(1.0, [1.0, -1.0, 1.0], centre, [0.0; 3]).unwrap_err();
        assert!(edge.to_string().contains("edge length is -1"), "{edge}");
    }

    #[test]
    fn a_payload_on_the_base_is_refused_by_the_frames_name() {
        let model = puma560::model();
        let payload = Payload::new(1.0, [0.0; 3], [0.0; 6]).unwrap();
        let base = model.frame_idx(puma560::BASE_LINK).unwrap();
        let message = model.attach(base, &payload).unwrap_err().to_string();
        assert!(message.contains("`base`"), "{message}");
    }
}
