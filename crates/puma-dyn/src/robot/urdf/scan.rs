//! The XML of a URDF before `urdf-rs` sees it: what is stated, what is missing, what is not allowed.
//!
//! Every element that enters the dynamics is checked here, because only here its line is known.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use roxmltree::{Document, Node};

use super::element::{Scanner, children, malformed};
use crate::error::DynError;
use crate::robot::warning::Warning;

/// What `urdf-rs` cannot tell about a file.
#[derive(Debug, Default)]
pub(super) struct Scan {
    /// Links with an `<inertial>`.
    pub inertials: BTreeSet<String>,
    /// Joints with a `<limit>`, and which ends of the range it states.
    pub limits: BTreeMap<String, StatedLimits>,
    /// Reductions other than one, in the order of the file.
    pub transmissions: Vec<Transmission>,
    /// Moving joints that follow another one, each with its refusal.
    pub mimics: Vec<(String, DynError)>,
    /// The file without meshes, materials and custom tags, on which `urdf-rs` may stumble.
    pub dynamics: String,
}

/// Which ends of a joint's range are stated.
#[derive(Debug, Clone, Copy)]
pub(super) struct StatedLimits {
    pub lower: bool,
    pub upper: bool,
}

/// A `<transmission>` with a reduction.
#[derive(Debug)]
pub(super) struct Transmission {
    pub joint: String,
    reduction: String,
    line: u32,
}

impl Transmission {
    pub(super) fn warning(&self) -> Warning {
        Warning::TransmissionNotRead {
            joint: self.joint.clone(),
            reduction: self.reduction.clone(),
            line: self.line,
        }
    }
}

/// Scans the text of a URDF; `file` is its name in messages.
///
/// # Errors
/// `DynError::Malformed` and `DynError::UnsupportedJoint`, both with the line.
pub(super) fn scan(file: &str, text: &str) -> Result<Scan, DynError> {
    let document = Document::parse(text).map_err(|error| not_xml(file, &error))?;
    let scanner = Scanner {
        file,
        document: &document,
    };
    scanner.refuse_other_formats()?;

    let mut scan = Scan {
        dynamics: dynamics_only(&document),
        ..Scan::default()
    };
    for node in document.root_element().children().filter(Node::is_element) {
        match node.tag_name().name() {
            "link" => scanner.link(node, &mut scan)?,
            "joint" => scanner.joint(node, &mut scan)?,
            "transmission" => scan.transmissions.extend(scanner.transmission(node)),
            _ => {} // <gazebo>, <material>, <sensor> and custom tags say nothing about dynamics
        }
    }
    Ok(scan)
}

/// The text of a document without the elements that say nothing about dynamics.
fn dynamics_only(document: &Document) -> String {
    let root = document.root_element();
    let within = |parent: Node, tags: &[&str]| -> Vec<Range<usize>> {
        let is_noise = |node: &Node| node.is_element() && !tags.contains(&node.tag_name().name());
        let noise = parent.children().filter(is_noise);
        noise.map(|node| node.range()).collect()
    };
    let mut cuts = within(root, &["link", "joint"]);
    for node in root.children().filter(Node::is_element) {
        match node.tag_name().name() {
            "link" => cuts.extend(within(node, &["inertial"])),
            "joint" => cuts.extend(within(node, &JOINT_TAGS)),
            _ => {}
        }
    }

    cuts.sort_by_key(|cut| cut.start);
    let mut kept = String::new();
    let mut from = 0;
    for cut in cuts {
        kept.push_str(&document.input_text()[from..cut.start]);
        from = cut.end;
    }
    kept.push_str(&document.input_text()[from..]);
    kept
}

/// What a joint says about its motion.
const JOINT_TAGS: [&str; 6] = ["origin", "parent", "child", "axis", "limit", "dynamics"];

fn not_xml(file: &str, error: &roxmltree::Error) -> DynError {
    let reason = match error {
        roxmltree::Error::UnknownNamespace(prefix, _) if prefix == "xacro" => XACRO.to_owned(),
        roxmltree::Error::UnknownNamespace(prefix, _) => format!(
            "the XML prefix `{prefix}:` is not declared; hint: declare it in the first tag, \
             <robot xmlns:{prefix}=\"…\">, or remove the tags that use it"
        ),
        // The message of roxmltree ends with " at line:column", which is said in front already.
        other => {
            let text = other.to_string();
            let text = text
                .rsplit_once(" at ")
                .map_or(text.as_str(), |(head, _)| head);
            format!("not well-formed XML: {text}")
        }
    };
    malformed(file, error.pos(), &reason)
}

const XACRO: &str = "this is a xacro file, not a URDF; hint: expand it first, \
                     `xacro robot.urdf.xacro > robot.urdf`";

impl Scanner<'_, '_> {
    /// Refuses what is not a `<robot>`, and xacro, told by its elements or by `${…}` and `$(…)`.
    fn refuse_other_formats(&self) -> Result<(), DynError> {
        let root = self.document.root_element();
        if root.tag_name().name() != "robot" {
            let name = root.tag_name().name();
            let reason = format!("the first tag is <{name}>, a URDF starts with <robot>");
            return Err(self.malformed(root, &reason));
        }
        let is_macro = |text: &str| text.contains("${") || text.contains("$(");
        for node in root.descendants().filter(Node::is_element) {
            let is_xacro = node
                .tag_name()
                .namespace()
                .is_some_and(|uri| uri.contains("xacro"));
            let in_urdf = node.tag_name().namespace() == root.tag_name().namespace();
            if is_xacro || (in_urdf && node.attributes().any(|a| is_macro(a.value()))) {
                return Err(self.malformed(node, XACRO));
            }
        }
        Ok(())
    }

    fn link(&self, node: Node, scan: &mut Scan) -> Result<(), DynError> {
        let name = self.attribute(node, "link", "name")?;
        let owner = format!("link `{name}`");
        let Some(inertial) = self.at_most_one(node, &owner, "inertial")? else {
            return Ok(());
        };
        let mass = self.exactly_one(inertial, &owner, "mass")?;
        self.number(mass, &owner, "value")?;
        let inertia = self.exactly_one(inertial, &owner, "inertia")?;
        for key in ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"] {
            self.number(inertia, &owner, key)?;
        }
        self.origin(inertial, &owner)?;
        scan.inertials.insert(name.to_owned());
        Ok(())
    }

    fn joint(&self, node: Node, scan: &mut Scan) -> Result<(), DynError> {
        let name = self.attribute(node, "joint", "name")?;
        let owner = format!("joint `{name}`");
        self.kind(node, name, &owner)?;
        scan.mimics.extend(self.mimic(node, name));
        for end in ["parent", "child"] {
            let end = self.exactly_one(node, &owner, end)?;
            self.attribute(end, &owner, "link")?;
        }
        self.origin(node, &owner)?;
        if let Some(axis) = self.at_most_one(node, &owner, "axis")? {
            self.vector(axis, &owner, "xyz")?;
        }
        if let Some(dynamics) = self.at_most_one(node, &owner, "dynamics")? {
            self.stated_number(dynamics, &owner, "damping")?;
            self.stated_number(dynamics, &owner, "friction")?;
        }
        if let Some(limit) = self.at_most_one(node, &owner, "limit")? {
            scan.limits
                .insert(name.to_owned(), self.limit(limit, &owner)?);
        }
        Ok(())
    }

    /// Refuses the joints that are not one number each.
    fn kind(&self, node: Node, name: &str, owner: &str) -> Result<(), DynError> {
        match self.attribute(node, owner, "type")? {
            "revolute" | "continuous" | "prismatic" | "fixed" => {}
            kind @ ("planar" | "floating" | "spherical") => {
                let reason = format!(
                    "is {kind}: only revolute, continuous, prismatic and fixed joints are supported"
                );
                return Err(self.unsupported(node, name, &reason));
            }
            other => {
                let reason = format!("{owner}: type=\"{other}\" is not a joint type of URDF");
                return Err(self.malformed(node, &reason));
            }
        }
        Ok(())
    }

    /// The refusal of a joint that follows another one, to be used unless the joint is locked.
    fn mimic(&self, node: Node, name: &str) -> Option<(String, DynError)> {
        let mimic = children(node, "mimic").next()?;
        if node.attribute("type") == Some("fixed") {
            return None;
        }
        let leader = mimic.attribute("joint").unwrap_or("another joint");
        let reason = format!(
            "mimics `{leader}`: coupled joints are not supported; hint: lock it with `locked_at` \
             under [joint.{name}] of the sidecar file, or remove <mimic> to treat it as independent"
        );
        Some((name.to_owned(), self.unsupported(mimic, name, &reason)))
    }

    fn limit(&self, limit: Node, owner: &str) -> Result<StatedLimits, DynError> {
        self.stated_number(limit, owner, "effort")?;
        self.number(limit, owner, "velocity")?;
        Ok(StatedLimits {
            lower: self.stated_number(limit, owner, "lower")?,
            upper: self.stated_number(limit, owner, "upper")?,
        })
    }

    fn origin(&self, node: Node, owner: &str) -> Result<(), DynError> {
        let Some(origin) = self.at_most_one(node, owner, "origin")? else {
            return Ok(());
        };
        if origin.has_attribute("quat_xyzw") {
            let reason =
                format!("{owner}: quat_xyzw is not supported; write the orientation as rpy");
            return Err(self.malformed(origin, &reason));
        }
        for key in ["xyz", "rpy"] {
            if origin.has_attribute(key) {
                self.vector(origin, owner, key)?;
            }
        }
        Ok(())
    }

    fn transmission(&self, node: Node) -> Option<Transmission> {
        let joint = node
            .descendants()
            .find(|n| n.has_tag_name("joint"))?
            .attribute("name")?;
        let tag = node
            .descendants()
            .find(|n| n.has_tag_name("mechanicalReduction"))?;
        let reduction = tag.text()?.trim();
        let is_one = reduction
            .parse::<f64>()
            .is_ok_and(|r| (r - 1.0).abs() <= 0.0);
        (!is_one).then(|| Transmission {
            joint: joint.to_owned(),
            reduction: reduction.to_owned(),
            line: self.position(tag).row,
        })
    }
}
