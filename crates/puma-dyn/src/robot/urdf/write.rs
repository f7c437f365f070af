//! Other masses, inertias and friction in the text of a URDF, which stays as it is in everything else.

use std::ops::Range;

use nalgebra::{Matrix3, Vector3};
use roxmltree::{Document, Node};

use super::element::children;
use super::load::parse_urdf;
use crate::error::DynError;
use crate::robot::description::{JointKind, RobotDescription};
use crate::robot::model::Model;
use crate::robot::sidecar::Sidecar;
use crate::robot::validate::{finite, finite_not_negative, finite_positive};

/// What `<dynamics>` states of a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointDynamics {
    /// Viscous friction at the joint, N·m·s/rad or N·s/m.
    pub damping: f64,
    /// Coulomb friction at the joint, the same in both directions, N·m or N.
    pub friction: f64,
}

/// The text of a URDF with other inertial parameters, and other friction if `dynamics` is given.
///
/// ```text
/// π = [m, m c_x, m c_y, m c_z, I_xx, I_xy, I_yy, I_xz, I_yz, I_zz]      I about the origin of the joint's child link
/// I_c = I − m (|c|² 1 − c cᵀ)                                           what URDF states
/// ```
/// The parameters are those of [`inertial_parameters`](crate::dynamics::inertial_parameters): a link that a joint
/// moves states them, links behind fixed joints are part of it and lose their `<inertial>`.
/// Links fixed to the ground, names, joints, visuals, limits and comments stay, and so do attributes of other tools.
/// Numbers have the digits that read back exactly.
///
/// # Shapes
/// `parameters` (n_joints,) in the order of q, kg, kg m and kg m²; `dynamics` (n_joints,).
///
/// # Errors
/// Those of [`parse_urdf`]; [`DynError::OutOfRange`] with the link for a mass that is not positive, with the joint
/// for negative friction; [`DynError::NonFinite`].
///
/// # Panics
/// If `parameters` or `dynamics` are not as many as the joints that move.
pub fn write_urdf(
    name: &str,
    text: &str,
    sidecar: Option<&Sidecar>,
    parameters: &[[f64; 10]],
    dynamics: Option<&[JointDynamics]>,
) -> Result<String, DynError> {
    let loaded = parse_urdf(name, text, sidecar)?;
    let n_joints = loaded.model.n_joints();
    assert_eq!(
        parameters.len(),
        n_joints,
        "parameters of {n_joints} joints"
    );
    let n_dynamics = dynamics.map_or(n_joints, <[_]>::len);
    assert_eq!(n_dynamics, n_joints, "dynamics of {n_joints} joints");

    let body = text.trim_start_matches('\u{feff}');
    // The same text has just been read.
    let document = Document::parse(body).map_err(|error| DynError::Unwritable {
        file: name.to_owned(),
        reason: error.to_string(),
    })?;
    let mut edits = Edits {
        text: body,
        edits: Vec::new(),
    };
    for node in document.root_element().children().filter(Node::is_element) {
        let named = node.attribute("name").unwrap_or_default();
        match node.tag_name().name() {
            "link" => match role(&loaded.description, &loaded.model, named) {
                Role::Moved(joint_idx) => {
                    let central = Central::new(named, &parameters[joint_idx])?;
                    edits.state_inertial(node, &central);
                }
                Role::Carried => edits.remove_inertial(node),
                Role::Ground => {}
            },
            "joint" => {
                if let (Some(idx), Some(dynamics)) = (loaded.model.joint_idx(named), dynamics) {
                    edits.state_dynamics(node, named, dynamics[idx])?;
                }
            }
            _ => {}
        }
    }
    let mark = &text[..text.len() - body.len()];
    Ok(format!("{mark}{}", edits.applied()))
}

/// Who moves a link.
enum Role {
    /// A joint, by its number in q.
    Moved(usize),
    /// The link that it is fixed to.
    Carried,
    /// Nobody.
    Ground,
}

fn role(robot: &RobotDescription, model: &Model, link: &str) -> Role {
    let above = robot.joints.iter().find(|joint| joint.child == link);
    let moving = above.filter(|joint| joint.kind != JointKind::Fixed);
    if let Some(joint_idx) = moving.and_then(|joint| model.joint_idx(&joint.name)) {
        return Role::Moved(joint_idx);
    }
    let frame = model.frames().iter().find(|frame| frame.name == link);
    match frame.and_then(|frame| frame.body_idx) {
        Some(_) => Role::Carried,
        None => Role::Ground,
    }
}

/// A link's mass distribution as URDF states it.
struct Central {
    mass: f64,
    centre: Vector3<f64>,
    /// About the centre.
    inertia: Matrix3<f64>,
}

impl Central {
    /// # Errors
    /// [`DynError::NonFinite`] and [`DynError::OutOfRange`] with the link.
    fn new(link: &str, parameters: &[f64; 10]) -> Result<Self, DynError> {
        let &[mass, hx, hy, hz, xx, xy, yy, xz, yz, zz] = parameters;
        finite_positive("link", link, "mass", mass)?;
        finite("link", link, "first mass moment", &[hx, hy, hz])?;
        finite("link", link, "inertia", &[xx, xy, yy, xz, yz, zz])?;
        let centre = Vector3::new(hx, hy, hz) / mass;
        let at_origin = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        let of_centre = Matrix3::from_diagonal_element(centre.norm_squared());
        Ok(Self {
            mass,
            centre,
            inertia: at_origin - mass * (of_centre - centre * centre.transpose()),
        })
    }

    /// Attributes of `<origin>`, `<mass>` and `<inertia>`.
    fn attributes(&self) -> [(&'static str, Vec<(&'static str, String)>); 3] {
        let [x, y, z] = <[f64; 3]>::from(self.centre);
        let entry = |row: usize, column: usize| format!("{:?}", self.inertia[(row, column)]);
        [
            (
                "origin",
                vec![
                    ("xyz", format!("{x:?} {y:?} {z:?}")),
                    ("rpy", "0 0 0".to_owned()),
                ],
            ),
            ("mass", vec![("value", format!("{:?}", self.mass))]),
            (
                "inertia",
                vec![
                    ("ixx", entry(0, 0)),
                    ("ixy", entry(0, 1)),
                    ("ixz", entry(0, 2)),
                    ("iyy", entry(1, 1)),
                    ("iyz", entry(1, 2)),
                    ("izz", entry(2, 2)),
                ],
            ),
        ]
    }
}

/// Attributes with their values.
type Attributes = [(&'static str, String)];

/// Pieces of a text, each with what takes its place.
struct Edits<'a> {
    text: &'a str,
    edits: Vec<(Range<usize>, String)>,
}

impl Edits<'_> {
    fn state_inertial(&mut self, link: Node, central: &Central) {
        let stated = children(link, "inertial").next();
        let tags = central.attributes();
        let Some(inertial) = stated else {
            let tags = tags
                .iter()
                .map(|(tag, attributes)| element(tag, attributes));
            let tags: String = tags.collect();
            self.add_first_child(link, &format!("<inertial>{tags}</inertial>"));
            return;
        };
        for (tag, attributes) in &tags {
            match children(inertial, tag).next() {
                Some(node) => self.set_attributes(node, attributes),
                None => self.add_first_child(inertial, &element(tag, attributes)),
            }
        }
    }

    /// Takes out an `<inertial>` with the blanks before it.
    fn remove_inertial(&mut self, link: Node) {
        for inertial in children(link, "inertial") {
            let Range { start, end } = inertial.range();
            let start = self.text[..start].trim_end().len();
            self.edits.push((start..end, String::new()));
        }
    }

    /// # Errors
    /// [`DynError::NonFinite`] and [`DynError::OutOfRange`] with the joint.
    fn state_dynamics(
        &mut self,
        joint: Node,
        name: &str,
        dynamics: JointDynamics,
    ) -> Result<(), DynError> {
        let JointDynamics { damping, friction } = dynamics;
        finite_not_negative("joint", name, "damping", damping)?;
        finite_not_negative("joint", name, "friction", friction)?;
        let attributes = [
            ("damping", format!("{damping:?}")),
            ("friction", format!("{friction:?}")),
        ];
        match children(joint, "dynamics").next() {
            Some(node) => self.set_attributes(node, &attributes),
            None => self.add_first_child(joint, &element("dynamics", &attributes)),
        }
        Ok(())
    }

    fn set_attributes(&mut self, node: Node, attributes: &Attributes) {
        for (key, value) in attributes {
            let (place, text) = if let Some(attribute) = node.attribute_node(*key) {
                (attribute.range_value(), value.clone())
            } else {
                let at = node.range().start + self.opening(node).len();
                (at..at, format!(" {key}=\"{value}\""))
            };
            self.edits.push((place, text));
        }
    }

    /// Puts an element before all others in a node, on a line of its own if the node has lines.
    fn add_first_child(&mut self, node: Node, child: &str) {
        let Range { start, end } = node.range();
        if let Some(first) = node.first_child() {
            let at = first.range().start;
            let blanks = &self.text[at..];
            let blanks = &blanks[..blanks.len() - blanks.trim_start().len()];
            self.edits.push((at..at, format!("{blanks}{child}")));
            return;
        }
        let name = self.opening(node)[1..].to_owned();
        let whole = &self.text[start..end];
        let (place, text) = if let Some(head) = whole.strip_suffix("/>") {
            (start + head.len()..end, format!(">{child}</{name}>"))
        } else {
            let at = start + whole.rfind("</").unwrap_or(whole.len());
            (at..at, child.to_owned())
        };
        self.edits.push((place, text));
    }

    /// `<` and the name of a node's tag as written, with its prefix.
    fn opening(&self, node: Node) -> &str {
        let text = &self.text[node.range()];
        let is_end = |character: char| character.is_whitespace() || "/>".contains(character);
        &text[..text.find(is_end).unwrap_or(text.len())]
    }

    fn applied(mut self) -> String {
        self.edits.sort_by_key(|(range, _)| range.start);
        let (mut result, mut from) = (String::with_capacity(self.text.len()), 0);
        for (range, replacement) in &self.edits {
            result.push_str(&self.text[from..range.start]);
            result.push_str(replacement);
            from = range.end;
        }
        result.push_str(&self.text[from..]);
        result
    }
}

fn element(tag: &str, attributes: &Attributes) -> String {
    let mut words = vec![format!("<{tag}")];
    let attributes = attributes.iter();
    words.extend(attributes.map(|(key, value)| format!("{key}=\"{value}\"")));
    words.join(" ") + "/>"
}
