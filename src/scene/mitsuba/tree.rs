//! A scene file as a tree of objects and their properties, before anybody asks what they mean.

use std::cell::RefCell;
use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;

use glam::{DMat4, DVec3};

use crate::scene::error::Location;

/// Index of an object in [`Tree::objects`].
pub(super) type ObjectId = usize;

/// All objects of a scene file and of the files it includes. The first is the root.
#[derive(Debug, Default)]
pub(super) struct Tree {
    pub objects: Vec<Object>,
    /// What there is to say about values.
    warnings: RefCell<Vec<String>>,
}

impl Tree {
    /// Says something about a value as it is looked at.
    pub fn warn(&self, warning: String) {
        self.warnings.borrow_mut().push(warning);
    }

    /// What was said.
    pub fn warnings(&self) -> Vec<String> {
        self.warnings.borrow().clone()
    }
}

/// An element with a `type`: a plugin of Mitsuba.
#[derive(Debug)]
pub(super) struct Object {
    pub kind: Kind,
    /// The value of `type`; `scene` for the root.
    pub plugin: String,
    pub id: Option<String>,
    pub at: Location,
    /// Folders in which the files that it names are looked for, the nearest first.
    pub folders: Arc<[PathBuf]>,
    pub properties: Vec<Property>,
}

impl Object {
    /// What to call the object in messages: `<shape type="obj">`.
    pub fn describe(&self) -> String {
        match self.kind {
            Kind::Scene => "<scene>".to_owned(),
            kind => format!("<{kind} type=\"{}\">", self.plugin),
        }
    }
}

/// One property or nested object.
#[derive(Debug)]
pub(super) struct Property {
    /// `name` in snake case; nested objects need none.
    pub name: Option<String>,
    pub at: Location,
    pub value: Value,
}

/// The value of a property.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Value {
    Boolean(bool),
    Integer(i64),
    Float(f64),
    String(String),
    /// `<rgb>`: linear sRGB.
    Rgb(DVec3),
    /// `<spectrum>` with one value for all wavelengths.
    Spectrum(f64),
    /// `<spectrum>` with wavelengths in nm, ascending, and values.
    Samples(Vec<(f64, f64)>),
    /// `<vector>` or `<point>`.
    Vector(DVec3),
    Transform(DMat4),
    /// A nested object, or the target of a `<ref>` once references are resolved.
    Object(ObjectId),
    /// A `<ref>` whose target is not known yet.
    Reference(String),
}

impl Value {
    /// The tag that such a value comes from.
    pub fn tag(&self) -> &'static str {
        match self {
            Value::Boolean(_) => "boolean",
            Value::Integer(_) => "integer",
            Value::Float(_) => "float",
            Value::String(_) => "string",
            Value::Rgb(_) => "rgb",
            Value::Spectrum(_) | Value::Samples(_) => "spectrum",
            Value::Vector(_) => "vector",
            Value::Transform(_) => "transform",
            Value::Object(_) => "object",
            Value::Reference(_) => "ref",
        }
    }
}

/// The tags that make an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Scene,
    Integrator,
    Sensor,
    Film,
    Sampler,
    Rfilter,
    Shape,
    Bsdf,
    Emitter,
    Medium,
    Phase,
    Texture,
    Volume,
    /// A `<spectrum>` with a `type`; those without are values.
    Spectrum,
}

impl Kind {
    const ALL: [(Kind, &'static str); 14] = [
        (Kind::Scene, "scene"),
        (Kind::Integrator, "integrator"),
        (Kind::Sensor, "sensor"),
        (Kind::Film, "film"),
        (Kind::Sampler, "sampler"),
        (Kind::Rfilter, "rfilter"),
        (Kind::Shape, "shape"),
        (Kind::Bsdf, "bsdf"),
        (Kind::Emitter, "emitter"),
        (Kind::Medium, "medium"),
        (Kind::Phase, "phase"),
        (Kind::Texture, "texture"),
        (Kind::Volume, "volume"),
        (Kind::Spectrum, "spectrum"),
    ];

    /// The kind that a tag stands for.
    pub fn from_tag(tag: &str) -> Option<Kind> {
        Kind::ALL.iter().find(|(_, name)| *name == tag).map(|(kind, _)| *kind)
    }

    /// All tags that make an object, but for `spectrum`, which need not.
    pub fn tags() -> impl Iterator<Item = &'static str> {
        Kind::ALL.iter().filter(|(kind, _)| *kind != Kind::Spectrum).map(|(_, name)| *name)
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (_, name) = Kind::ALL.iter().find(|(kind, _)| kind == self).expect("ALL lists every kind");
        f.write_str(name)
    }
}
