//! `$name` in attribute values: what `<default>` and `-D name=value` set.

use crate::scene::SceneError;
use crate::scene::error::Location;

use super::suggest::{did_you_mean, list};

/// The parameters of a scene, which `<default>` adds to as the file is read.
#[derive(Debug)]
pub(super) struct Parameters {
    entries: Vec<Entry>,
}

#[derive(Debug)]
struct Entry {
    name: String,
    value: String,
    /// Came from the command line.
    overrides: bool,
    /// A `<default>` or a `$name` of the scene mentions it.
    mentioned: bool,
}

impl Parameters {
    /// Starts with the overrides of the command line.
    pub fn new(overrides: &[(String, String)]) -> Result<Self, SceneError> {
        let mut entries: Vec<Entry> = Vec::new();
        for (name, value) in overrides {
            if entries.iter().any(|entry| entry.name == *name) {
                return Err(SceneError::Override { name: name.clone(), message: "given twice".to_owned() });
            }
            entries.push(Entry { name: name.clone(), value: value.clone(), overrides: true, mentioned: false });
        }
        Ok(Parameters { entries })
    }

    /// `<default name value>`: sets a parameter that has no value yet.
    pub fn set_default(&mut self, name: &str, value: &str) {
        match self.entries.iter_mut().find(|entry| entry.name == name) {
            Some(entry) => entry.mentioned = true,
            None => self.entries.push(Entry {
                name: name.to_owned(),
                value: value.to_owned(),
                overrides: false,
                mentioned: true,
            }),
        }
    }

    /// Replaces every `$name`. As in Mitsuba the longest defined name that fits wins, so `$ab` is `$a` followed by `b`
    /// if only `a` is defined, values are not searched again, and `\$` is a plain dollar sign.
    pub fn substitute(&mut self, text: &str, at: &Location) -> Result<String, SceneError> {
        if !text.contains('$') {
            return Ok(text.to_owned());
        }
        let mut out = String::with_capacity(text.len());
        let mut rest = text;
        while let Some(dollar) = rest.find('$') {
            let (before, after) = (&rest[..dollar], &rest[dollar + 1..]);
            if let Some(escaped) = before.strip_suffix('\\') {
                out.push_str(escaped);
                out.push('$');
                rest = after;
                continue;
            }
            out.push_str(before);
            let entry = self
                .entries
                .iter_mut()
                .filter(|entry| !entry.name.is_empty() && after.starts_with(entry.name.as_str()))
                .max_by_key(|entry| entry.name.len());
            let Some(entry) = entry else {
                let end = after.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(after.len());
                return Err(at.error(self.undefined(&after[..end])));
            };
            entry.mentioned = true;
            out.push_str(&entry.value);
            rest = &after[entry.name.len()..];
        }
        out.push_str(rest);
        Ok(out)
    }

    fn undefined(&self, name: &str) -> String {
        let hint = did_you_mean(name, self.names());
        format!(
            "${name} has no value{hint}; set it with <default name=\"{name}\" value=\"…\"/> before this line or with -D {name}=…"
        )
    }

    fn names(&self) -> impl Iterator<Item = &str> {
        self.entries.iter().map(|entry| entry.name.as_str())
    }

    /// Checks at the end of the scene that each override was of some use.
    pub fn finish(&self) -> Result<(), SceneError> {
        let Some(unused) = self.entries.iter().find(|entry| !entry.mentioned) else { return Ok(()) };
        let known = || self.entries.iter().filter(|entry| entry.mentioned).map(|entry| entry.name.as_str());
        debug_assert!(unused.overrides, "defaults are mentioned by definition");
        let message = match known().next() {
            None => "the scene has no parameters".to_owned(),
            Some(_) => format!(
                "the scene has no such parameter{}; it has: {}",
                did_you_mean(&unused.name, known()),
                list(known())
            ),
        };
        Err(SceneError::Override { name: unused.name.clone(), message })
    }
}
