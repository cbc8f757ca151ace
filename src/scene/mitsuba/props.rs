//! Typed access to the properties of an object. Whatever nobody asked for is an error in the end, which lists what was
//! asked for, so the list of what is accepted cannot differ from what is read.

use std::cell::{Cell, RefCell};

use glam::{DMat4, DVec3};

use super::plugins;
use super::spectrum::{self, Color, Meaning};
use super::suggest::{did_you_mean, list};
use super::tree::{Kind, Object, ObjectId, Property, Tree, Value};
use crate::scene::SceneError;
use crate::scene::error::Location;

/// A view of one object that remembers which properties were asked for.
pub(super) struct Props<'a> {
    tree: &'a Tree,
    object: &'a Object,
    used: Vec<Cell<bool>>,
    names: RefCell<Vec<&'static str>>,
    kinds: RefCell<Vec<Kind>>,
}

/// A value and the place that gave it.
pub(super) struct Given<'a, T> {
    pub value: T,
    pub at: &'a Location,
}

/// An object inside another, or referred to by it.
#[derive(Clone, Copy)]
pub(super) struct Child<'a> {
    pub id: ObjectId,
    pub object: &'a Object,
    /// `name` of the element or of the `<ref>`.
    pub name: Option<&'a str>,
    /// The element or the `<ref>`.
    pub at: &'a Location,
}

/// A colour, or the texture that it comes from.
pub(super) enum Colored<'a> {
    Constant(Given<'a, DVec3>),
    Texture(Child<'a>),
}

/// A colour, or the field in space that it comes from.
pub(super) enum VolumeOrColor<'a> {
    Constant(Given<'a, DVec3>),
    Volume(Child<'a>),
}

/// A number, or a name that stands for one.
pub(super) enum NumberOrName {
    Number(f64),
    Name(String),
}

impl<'a> Props<'a> {
    /// Nothing has been asked for yet.
    pub fn new(tree: &'a Tree, object: &'a Object) -> Self {
        let used = object.properties.iter().map(|_| Cell::new(false)).collect();
        Props { tree, object, used, names: RefCell::default(), kinds: RefCell::default() }
    }

    /// Whether the object has a property, without asking for it.
    pub fn has(&self, name: &str) -> bool {
        self.object.properties.iter().any(|property| property.name.as_deref() == Some(name))
    }

    /// Where the object stands.
    pub fn at(&self) -> &'a Location {
        &self.object.at
    }

    fn find(&self, name: &'static str) -> Option<&'a Property> {
        if !self.names.borrow().contains(&name) {
            self.names.borrow_mut().push(name);
        }
        let index = self.object.properties.iter().position(|p| p.name.as_deref() == Some(name))?;
        self.used[index].set(true);
        Some(&self.object.properties[index])
    }

    fn typed<T>(
        &self,
        name: &'static str,
        accepted: &str,
        convert: impl Fn(&Value) -> Option<T>,
    ) -> Result<Option<Given<'a, T>>, SceneError> {
        let Some(property) = self.find(name) else { return Ok(None) };
        match convert(&property.value) {
            Some(value) => Ok(Some(Given { value, at: &property.at })),
            None => {
                let found = match property.value {
                    Value::Object(id) => self.tree.objects[id].describe(),
                    ref other => format!("<{}>", other.tag()),
                };
                Err(property.at.error(format!("\"{name}\" is given as {found}; accepted: {accepted}")))
            }
        }
    }

    /// A number.
    pub fn float(&self, name: &'static str) -> Result<Option<Given<'a, f64>>, SceneError> {
        self.typed(name, "<float>", |value| match *value {
            Value::Float(v) => Some(v),
            Value::Integer(v) => Some(v as f64),
            _ => None,
        })
    }

    /// A whole number.
    pub fn integer(&self, name: &'static str) -> Result<Option<Given<'a, i64>>, SceneError> {
        self.typed(name, "<integer>", |value| match *value {
            Value::Integer(v) => Some(v),
            _ => None,
        })
    }

    /// A whole number that only some plugins have.
    pub fn integer_if(&self, name: &'static str, has: bool) -> Result<Option<Given<'a, i64>>, SceneError> {
        if has { self.integer(name) } else { Ok(None) }
    }

    /// A truth value.
    pub fn boolean(&self, name: &'static str) -> Result<Option<Given<'a, bool>>, SceneError> {
        self.typed(name, "<boolean>", |value| match *value {
            Value::Boolean(v) => Some(v),
            _ => None,
        })
    }

    /// A text.
    pub fn string(&self, name: &'static str) -> Result<Option<Given<'a, String>>, SceneError> {
        self.typed(name, "<string>", |value| match value {
            Value::String(v) => Some(v.clone()),
            _ => None,
        })
    }

    /// A point or a vector.
    pub fn vector(&self, name: &'static str) -> Result<Option<Given<'a, DVec3>>, SceneError> {
        self.typed(name, "<point> or <vector>", |value| match *value {
            Value::Vector(v) => Some(v),
            _ => None,
        })
    }

    /// A matrix.
    pub fn transform(&self, name: &'static str) -> Result<Option<Given<'a, DMat4>>, SceneError> {
        self.typed(name, "<transform>", |value| match *value {
            Value::Transform(v) => Some(v),
            _ => None,
        })
    }

    /// A quantity of each channel that does not emit: extinction, an index of refraction. A constant spectrum has the same value in
    /// all channels.
    pub fn color(&self, name: &'static str) -> Result<Option<Color<'a>>, SceneError> {
        self.spectrum(name, Meaning::Factor, false)
    }

    /// The same for what does not exceed 1.
    pub fn fraction(&self, name: &'static str) -> Result<Option<Color<'a>>, SceneError> {
        self.spectrum(name, Meaning::Fraction, false)
    }

    /// A radiance or an intensity.
    pub fn emission(&self, name: &'static str) -> Result<Option<Color<'a>>, SceneError> {
        self.spectrum(name, Meaning::Emitted, false)
    }

    /// A quantity of each channel that does not exceed 1, or a texture that has it.
    pub fn color_or_texture(&self, name: &'static str) -> Result<Option<Colored<'a>>, SceneError> {
        if let Some(property) = self.find(name)
            && let Value::Object(id) = property.value
            && self.tree.objects[id].kind == Kind::Texture
        {
            let object = &self.tree.objects[id];
            return Ok(Some(Colored::Texture(Child { id, object, name: Some(name), at: &property.at })));
        }
        Ok(self.spectrum(name, Meaning::Fraction, true)?.map(Colored::Constant))
    }

    /// A radiance, or a texture that has it.
    pub fn emission_or_texture(&self, name: &'static str) -> Result<Option<Colored<'a>>, SceneError> {
        match self.texture(name)? {
            Some(texture) => Ok(Some(Colored::Texture(texture))),
            None => Ok(self.spectrum(name, Meaning::Emitted, true)?.map(Colored::Constant)),
        }
    }

    /// A texture of some name, if the property is one.
    pub fn texture(&self, name: &'static str) -> Result<Option<Child<'a>>, SceneError> {
        let Some(property) = self.find(name) else { return Ok(None) };
        let Value::Object(id) = property.value else { return Ok(None) };
        let object = &self.tree.objects[id];
        // What is something else is complained about by whoever asks for that.
        let child = Child { id, object, name: Some(name), at: &property.at };
        Ok((object.kind == Kind::Texture).then_some(child))
    }

    /// A coefficient of a medium: a quantity of each channel, or a field in space.
    pub fn color_or_volume(
        &self,
        name: &'static str,
        meaning: Meaning,
    ) -> Result<Option<VolumeOrColor<'a>>, SceneError> {
        let Some(property) = self.find(name) else { return Ok(None) };
        if let Value::Object(id) = property.value
            && self.tree.objects[id].kind == Kind::Volume
        {
            let object = &self.tree.objects[id];
            return Ok(Some(VolumeOrColor::Volume(Child { id, object, name: Some(name), at: &property.at })));
        }
        match spectrum::color_of(self.tree, &property.value, &property.at, meaning)? {
            Some(value) => Ok(Some(VolumeOrColor::Constant(Given { value, at: &property.at }))),
            None => {
                let refused: Option<Given<()>> =
                    self.typed(name, "<rgb>, <float>, <spectrum> or <volume>", |_| None)?;
                Ok(refused.map(|_| unreachable!("nothing is accepted")))
            }
        }
    }

    /// A refractive index: a number, or the name of a material.
    pub fn number_or_name(&self, name: &'static str) -> Result<Option<Given<'a, NumberOrName>>, SceneError> {
        self.typed(name, "<float> or <string>", |value| match value {
            Value::Float(v) => Some(NumberOrName::Number(*v)),
            Value::Integer(v) => Some(NumberOrName::Number(*v as f64)),
            Value::String(v) => Some(NumberOrName::Name(v.clone())),
            _ => None,
        })
    }

    fn spectrum(&self, name: &'static str, meaning: Meaning, texture: bool) -> Result<Option<Color<'a>>, SceneError> {
        let Some(property) = self.find(name) else { return Ok(None) };
        match spectrum::color_of(self.tree, &property.value, &property.at, meaning)? {
            Some(value) => Ok(Some(Given { value, at: &property.at })),
            None if texture => self.typed(name, "<rgb>, <float>, <spectrum> or <texture>", |_| None),
            None => self.typed(name, "<rgb>, <float> or <spectrum>", |_| None),
        }
    }

    /// Accepts a property that does not change the picture.
    pub fn ignore_boolean(&self, name: &'static str) -> Result<(), SceneError> {
        self.boolean(name).map(drop)
    }

    /// The nested and referenced objects of a kind.
    pub fn children(&self, kind: Kind) -> Vec<Child<'a>> {
        self.kinds.borrow_mut().push(kind);
        let mut found = Vec::new();
        for (property, used) in self.object.properties.iter().zip(&self.used) {
            let Value::Object(id) = property.value else { continue };
            let object = &self.tree.objects[id];
            if object.kind == kind && !used.get() {
                used.set(true);
                found.push(Child { id, object, name: property.name.as_deref(), at: &property.at });
            }
        }
        found
    }

    /// The one nested object of a kind, if there is any.
    pub fn child(&self, kind: Kind) -> Result<Option<Child<'a>>, SceneError> {
        let found = self.children(kind);
        match found[..] {
            [] => Ok(None),
            [child] => Ok(Some(child)),
            [first, second, ..] => Err(second.at.error(format!(
                "{} can have only one <{kind}>; the first is at {}",
                self.object.describe(),
                first.at
            ))),
        }
    }

    /// Complains about the first property that nobody asked for.
    pub fn finish(self) -> Result<(), SceneError> {
        let unused = self.object.properties.iter().zip(&self.used).find(|(_, used)| !used.get());
        let Some((property, _)) = unused else { return Ok(()) };
        let names = self.names.into_inner();
        let kinds = self.kinds.into_inner();
        let mut accepted: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
        accepted.extend(kinds.iter().map(|kind| format!("<{kind}>")));
        let accepted = list(accepted.iter().map(String::as_str));
        let owner = self.object.describe();
        Err(property.at.error(match (&property.value, &property.name) {
            (Value::Object(id), _) => {
                format!("{owner} has no use for {}; accepted: {accepted}", self.tree.objects[*id].describe())
            }
            (_, name) => {
                let name = name.as_deref().unwrap_or_default();
                let hint = did_you_mean(name, names.iter().copied());
                format!("{owner} has no property \"{name}\"{hint}; accepted: {accepted}")
            }
        }))
    }
}

/// The error about a plugin that is not supported, with what to use instead if it is one of Mitsuba.
pub(super) fn unknown_plugin(object: &Object, accepted: &[&str]) -> SceneError {
    let instead = plugins::instead(object);
    let hint = if instead.is_empty() { did_you_mean(&object.plugin, accepted.iter().copied()) } else { instead };
    object.at.error(format!(
        "{} is not supported{hint}; accepted types: {}",
        object.describe(),
        list(accepted.iter().copied())
    ))
}
