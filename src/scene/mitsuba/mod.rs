//! Reads scenes in the XML dialect of Mitsuba 3. `docs/SCENES.md` describes what is supported, and where pictures differ.
//!
//! The steps: `xml` turns text into a tree of objects (includes, parameters, references), and one file for each kind of
//! plugin turns objects into parts of a [`Scene`]. Nothing is ignored silently: what has no meaning here is an error,
//! what has a slightly different one is a warning.

use std::path::Path;

use super::{Scene, SceneError};

mod bsdf;
mod build;
mod element;
mod emitter;
mod film;
mod integrator;
mod material;
mod medium;
mod mesh_file;
mod params;
mod plugins;
mod principled;
mod props;
mod sensor;
mod shape;
mod source;
mod spectrum;
mod suggest;
mod texture;
mod transform;
mod tree;
mod values;
mod volume;
mod xml;

/// A scene, and what its author should know about it.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The scene.
    pub scene: Scene,
    /// `file:line:col: text`, in the order in which they were found.
    pub warnings: Vec<String>,
}

/// Reads a scene file. `overrides` are names and values that replace those of `<default>`.
pub fn load(path: &Path, overrides: &[(String, String)]) -> Result<Loaded, SceneError> {
    let file = path.display().to_string();
    let bytes = std::fs::read(path).map_err(|cause| SceneError::Unreadable { file: file.clone(), cause })?;
    parse_str(source::read_text(&bytes, &file)?, path, overrides)
}

/// Reads a scene from a text. `file` is what the text is called in messages; file names in it are relative to the
/// folder of `file`, which itself need not exist.
pub fn parse_str(text: &str, file: &Path, overrides: &[(String, String)]) -> Result<Loaded, SceneError> {
    let folder = file.parent().unwrap_or(Path::new(""));
    let tree = xml::read(text, &file.display().to_string(), folder, overrides)?;
    build::build(&tree)
}

/// Tags of elements with the types that are supported, for documentation.
pub fn supported_plugins() -> Vec<(String, &'static [&'static str])> {
    plugins::SUPPORTED.iter().map(|(kind, types)| (kind.to_string(), *types)).collect()
}

/// Tags and types of the plugins of Mitsuba 3.9 that are not supported, each with what to use instead, for documentation.
pub fn refused_plugins() -> Vec<(String, &'static str, &'static str)> {
    let supported = |kind, plugin| plugins::SUPPORTED.iter().any(|(k, types)| *k == kind && types.contains(&plugin));
    let refused = plugins::REFUSED.iter().filter(|(kind, plugin, _)| !supported(*kind, *plugin));
    refused.map(|(kind, plugin, advice)| (kind.to_string(), *plugin, *advice)).collect()
}
