//! One XML element: its attributes, and complaints about those that it must not have.

use roxmltree::Node;

use super::source::Source;
use super::suggest::{did_you_mean, list};
use crate::scene::SceneError;
use crate::scene::error::Location;

/// An attribute after `$name` has been replaced.
pub(super) struct Attribute {
    pub name: String,
    pub value: String,
    pub at: Location,
}

/// An element with its attributes; looks them up and complains about those that nobody knows.
pub(super) struct Element<'a, 'input> {
    pub node: Node<'a, 'input>,
    /// In snake case.
    pub tag: String,
    pub at: Location,
    pub attributes: Vec<Attribute>,
}

impl Element<'_, '_> {
    /// An attribute.
    pub fn attribute(&self, name: &str) -> Option<&Attribute> {
        self.attributes.iter().find(|a| a.name == name)
    }

    /// The text of an attribute.
    pub fn get(&self, name: &str) -> Option<&str> {
        self.attribute(name).map(|a| a.value.as_str())
    }

    /// An attribute that must be there.
    pub fn required(&self, name: &str) -> Result<&Attribute, SceneError> {
        self.attribute(name).ok_or_else(|| self.at.error(format!("<{}> needs the attribute \"{name}\"", self.tag)))
    }

    /// Complains about attributes that are not in the list.
    pub fn allow(&self, allowed: &[&'static str]) -> Result<(), SceneError> {
        match self.attributes.iter().find(|a| !allowed.contains(&a.name.as_str())) {
            None => Ok(()),
            Some(a) => Err(a.at.error(format!(
                "<{}> has no attribute \"{}\"{}; accepted: {}",
                self.tag,
                a.name,
                did_you_mean(&a.name, allowed.iter().copied()),
                list(allowed.iter().copied())
            ))),
        }
    }
}

/// Mitsuba's dialects that are known: 0.6, 2 and 3.
pub(super) fn check_version(root: &Element) -> Result<(), SceneError> {
    let version = root.required("version")?;
    let mut numbers = version.value.split('.').map(str::parse::<u32>);
    match (numbers.next(), numbers.all(|n| n.is_ok())) {
        (Some(Ok(0 | 2 | 3)), true) => Ok(()),
        _ => Err(version.at.error(format!(
            "\"{}\" is not a version of the scene format that is supported; supported: 0.x, 2.x and 3.x",
            version.value
        ))),
    }
}

/// Complains about anything inside an element.
pub(super) fn refuse_children(source: &Source, element: &Element) -> Result<(), SceneError> {
    for node in element.node.children() {
        if node.is_element() {
            let at = source.location(node.range().start);
            return Err(at.error(format!("<{}> cannot have children", element.tag)));
        }
        refuse_text(source, node)?;
    }
    Ok(())
}

/// Complains about text between elements, which Mitsuba would ignore.
pub(super) fn refuse_text(source: &Source, node: Node) -> Result<(), SceneError> {
    let text = node.text().unwrap_or_default();
    if !node.is_text() || text.trim().is_empty() {
        return Ok(());
    }
    let blank = text.len() - text.trim_start().len();
    let at = source.location(node.range().start + blank);
    Err(at.error("text between elements has no meaning; values are given as attributes"))
}
