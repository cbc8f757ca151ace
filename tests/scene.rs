//! The scene reader: what is read from a file, and what is refused with which message.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should say so")]

#[path = "scene/bad_input.rs"]
mod bad_input;
#[path = "scene/bad_materials.rs"]
mod bad_materials;
#[path = "scene/check.rs"]
mod check;
#[path = "scene/crossings.rs"]
mod crossings;
#[path = "scene/dialect.rs"]
mod dialect;
#[path = "scene/docs.rs"]
mod docs;
#[path = "scene/features.rs"]
mod features;
#[path = "scene/files.rs"]
mod files;
#[path = "scene/materials.rs"]
mod materials;
#[path = "scene/mesh.rs"]
mod mesh;
#[path = "scene/robustness.rs"]
mod robustness;
#[path = "scene/sensor.rs"]
mod sensor;
#[path = "scene/shapes.rs"]
mod shapes;
#[path = "scene/spectra.rs"]
mod spectra;
#[path = "scene/textures.rs"]
mod textures;
#[path = "scene/unsupported.rs"]
mod unsupported;
#[path = "scene/volumes.rs"]
mod volumes;

use std::path::{Path, PathBuf};

use tyndall::scene::mitsuba::{Loaded, parse_str};
use tyndall::scene::{Scene, SceneError};

/// Folder of the scene files.
fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/scene").join(name)
}

/// A camera, without anything that warns.
const SENSOR: &str = r#"<sensor type="perspective"><float name="fov" value="40"/><film type="hdrfilm"><rfilter type="box"/></film></sensor>"#;

/// Something that shines, so that nothing warns about the dark.
const LIGHT: &str = r#"<emitter type="constant"/>"#;

/// Reads a text that is called `scene.xml` and stands in the folder of the scene files.
fn parse(text: &str) -> Result<Loaded, SceneError> {
    parse_str(text, &data("scene.xml"), &[])
}

/// A scene with a camera, a light and `body`, which must not warn.
fn scene(body: &str) -> Scene {
    let loaded = with_warnings(body);
    assert_eq!(loaded.warnings, [""; 0], "{body}");
    loaded.scene
}

/// A scene with a camera, a light and `body`.
fn with_warnings(body: &str) -> Loaded {
    let text = format!("<scene version=\"3.0.0\">{SENSOR}{LIGHT}\n{body}\n</scene>");
    parse(&text).unwrap_or_else(|error| panic!("{error}\nin {body}"))
}

/// The one warning about a scene with a camera, a light and `body`.
fn warning(body: &str) -> String {
    let loaded = with_warnings(body);
    assert_eq!(loaded.warnings.len(), 1, "{body}\n{:#?}", loaded.warnings);
    loaded.warnings[0].clone()
}
