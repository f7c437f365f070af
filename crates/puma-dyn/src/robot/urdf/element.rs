//! Checked access to one XML element: a refusal says file, line, column, owner and attribute.

use roxmltree::{Document, Node, TextPos};

use crate::error::DynError;

/// A document and its file's name: what every refusal needs to say where.
pub(super) struct Scanner<'a, 'text> {
    pub file: &'a str,
    pub document: &'a Document<'text>,
}

impl Scanner<'_, '_> {
    pub(super) fn position(&self, node: Node) -> TextPos {
        self.document.text_pos_at(node.range().start)
    }

    pub(super) fn malformed(&self, node: Node, reason: &str) -> DynError {
        malformed(self.file, self.position(node), reason)
    }

    pub(super) fn unsupported(&self, node: Node, name: &str, reason: &str) -> DynError {
        let line = self.position(node).row;
        DynError::UnsupportedJoint {
            file: self.file.to_owned(),
            line,
            joint: one_line(name),
            reason: one_line(reason),
        }
    }

    pub(super) fn at_most_one<'n, 'i>(
        &self,
        node: Node<'n, 'i>,
        owner: &str,
        tag: &str,
    ) -> Result<Option<Node<'n, 'i>>, DynError> {
        let mut found = children(node, tag);
        let first = found.next();
        match found.next() {
            None => Ok(first),
            Some(second) => {
                Err(self.malformed(second, &format!("{owner} has more than one <{tag}>")))
            }
        }
    }

    pub(super) fn exactly_one<'n, 'i>(
        &self,
        node: Node<'n, 'i>,
        owner: &str,
        tag: &str,
    ) -> Result<Node<'n, 'i>, DynError> {
        self.at_most_one(node, owner, tag)?.ok_or_else(|| {
            let parent = node.tag_name().name();
            self.malformed(node, &format!("{owner}: <{parent}> has no <{tag}>"))
        })
    }

    pub(super) fn attribute<'n>(
        &self,
        node: Node<'n, '_>,
        owner: &str,
        key: &str,
    ) -> Result<&'n str, DynError> {
        node.attribute(key).ok_or_else(|| {
            let tag = node.tag_name().name();
            self.malformed(node, &format!("{owner}: <{tag}> has no attribute `{key}`"))
        })
    }

    /// Checks a number that must be there.
    pub(super) fn number(&self, node: Node, owner: &str, key: &str) -> Result<(), DynError> {
        let text = self.attribute(node, owner, key)?;
        self.finite(node, owner, key, text)
    }

    /// Checks a number that may be absent; true if it is there.
    pub(super) fn stated_number(
        &self,
        node: Node,
        owner: &str,
        key: &str,
    ) -> Result<bool, DynError> {
        match node.attribute(key) {
            None => Ok(false),
            Some(text) => self.finite(node, owner, key, text).map(|()| true),
        }
    }

    /// Checks three numbers; `urdf-rs` skips words among them.
    pub(super) fn vector(&self, node: Node, owner: &str, key: &str) -> Result<(), DynError> {
        let text = self.attribute(node, owner, key)?;
        let n_words = text.split_whitespace().count();
        if n_words != 3 {
            let tag = node.tag_name().name();
            let reason = format!("{owner}: <{tag} {key}=\"{text}\"> has {n_words} numbers, not 3");
            return Err(self.malformed(node, &reason));
        }
        text.split_whitespace()
            .try_for_each(|word| self.finite(node, owner, key, word))
    }

    fn finite(&self, node: Node, owner: &str, key: &str, text: &str) -> Result<(), DynError> {
        match text.trim().parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(()),
            _ => {
                let tag = node.tag_name().name();
                let reason = format!("{owner}: <{tag} {key}>: `{text}` is not a finite number");
                Err(self.malformed(node, &reason))
            }
        }
    }
}

pub(super) fn malformed(file: &str, at: TextPos, reason: &str) -> DynError {
    DynError::Malformed {
        file: file.to_owned(),
        line: at.row,
        column: at.col,
        reason: one_line(reason),
    }
}

/// The text with line ends and other control characters of the file written as escapes.
fn one_line(text: &str) -> String {
    let mut line = String::with_capacity(text.len());
    for character in text.chars() {
        if character.is_control() {
            line.extend(character.escape_default());
        } else {
            line.push(character);
        }
    }
    line
}

/// The children of a node with this tag, in whatever namespace: `urdf-rs` knows none.
pub(super) fn children<'n, 'i: 'n>(
    node: Node<'n, 'i>,
    tag: &str,
) -> impl Iterator<Item = Node<'n, 'i>> {
    let tag = tag.to_owned();
    node.children()
        .filter(move |child| child.has_tag_name(tag.as_str()))
}
