//! From XML text to a [`Tree`]: includes, parameters, ids and references are resolved here, meanings are not.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DMat4;
use roxmltree::{Document, Node};

use super::element::{Attribute, Element, check_version, refuse_children, refuse_text};
use super::params::Parameters;
use super::source::{Source, find, read_text};
use super::suggest::{did_you_mean, list};
use super::tree::{Kind, Object, ObjectId, Property, Tree, Value};
use super::{spectrum, transform, values};
use crate::scene::SceneError;

/// Deepest nesting of objects, and of files that include each other. Real scenes need about five levels; the limit
/// keeps a malicious file from exhausting the stack.
const MAX_DEPTH: usize = 64;

const PROPERTY_TAGS: [&str; 9] =
    ["boolean", "integer", "float", "string", "rgb", "spectrum", "vector", "point", "transform"];
const STRUCTURE_TAGS: [&str; 5] = ["ref", "include", "default", "alias", "path"];

/// Reads a scene. `folder` is where its relative file names start.
pub(super) fn read(text: &str, file: &str, folder: &Path, overrides: &[(String, String)]) -> Result<Tree, SceneError> {
    let mut reader = Reader {
        tree: Tree::default(),
        parameters: Parameters::new(overrides)?,
        ids: HashMap::new(),
        folders: vec![folder.to_owned()],
        including: Path::new(file).canonicalize().into_iter().collect(),
    };
    reader.document(text, file, None)?;
    reader.parameters.finish()?;
    reader.resolve_references()?;
    Ok(reader.tree)
}

struct Reader {
    tree: Tree,
    parameters: Parameters,
    ids: HashMap<String, ObjectId>,
    /// Where file names are looked up, the nearest last.
    folders: Vec<PathBuf>,
    /// The files that are being read, the outermost first.
    including: Vec<PathBuf>,
}

/// Where the objects of an included file go.
struct Host {
    parent: ObjectId,
    /// The `name` on the `<include>`.
    name: Option<String>,
    depth: usize,
}

impl Reader {
    /// Reads one file; the objects of an included one go to `host`.
    fn document(&mut self, text: &str, file: &str, host: Option<Host>) -> Result<(), SceneError> {
        let source = Source::new(text, file);
        let document = Document::parse(source.text).map_err(|error| source.syntax_error(&error))?;
        let root = self.element(&source, document.root_element())?;
        check_version(&root)?;
        match host {
            None if root.tag != "scene" => {
                Err(root.at.error(format!("the root is <{}>; it must be <scene>", root.tag)))
            }
            None => self.object(&source, &root, Kind::Scene, None, 0).map(|_| ()),
            Some(host) if root.tag == "scene" => {
                root.allow(&["version"])?;
                self.children(&source, &root, host.parent, host.depth)
            }
            Some(host) => self.item(&source, &root, host.parent, host.name, host.depth),
        }
    }

    /// The attributes of a node, with parameters replaced.
    fn element<'a, 'input>(
        &mut self,
        source: &Source,
        node: Node<'a, 'input>,
    ) -> Result<Element<'a, 'input>, SceneError> {
        let at = source.location(node.range().start);
        let attributes = node
            .attributes()
            .map(|a| {
                let at = source.location(a.range().start);
                let value = self.parameters.substitute(a.value(), &at)?;
                Ok(Attribute { name: a.name().to_owned(), value, at })
            })
            .collect::<Result<_, SceneError>>()?;
        Ok(Element { node, tag: values::snake_case(node.tag_name().name()), at, attributes })
    }

    /// Everything inside an object.
    fn children(
        &mut self,
        source: &Source,
        parent_element: &Element,
        parent: ObjectId,
        depth: usize,
    ) -> Result<(), SceneError> {
        for node in parent_element.node.children() {
            if node.is_element() {
                let element = self.element(source, node)?;
                self.item(source, &element, parent, None, depth)?;
            } else {
                refuse_text(source, node)?;
            }
        }
        Ok(())
    }

    /// One element inside an object; `name` stands in for a missing `name` attribute.
    fn item(
        &mut self,
        source: &Source,
        element: &Element,
        parent: ObjectId,
        name: Option<String>,
        depth: usize,
    ) -> Result<(), SceneError> {
        let tag = element.tag.as_str();
        let plain = |kind: &Kind| *kind == Kind::Spectrum && element.attribute("type").is_none();
        if let Some(kind) = Kind::from_tag(tag).filter(|kind| !plain(kind)) {
            if kind == Kind::Scene {
                return Err(element.at.error("<scene> can only be the root of a file"));
            }
            let id = self.object(source, element, kind, Some(parent), depth)?;
            let name = element.get("name").map(values::snake_case).or(name);
            return self.add(parent, Property { name, at: element.at.clone(), value: Value::Object(id) });
        }
        match tag {
            "ref" => {
                element.allow(&["id", "name"])?;
                refuse_children(source, element)?;
                let target = Value::Reference(element.required("id")?.value.clone());
                let name = element.get("name").map(values::snake_case).or(name);
                self.add(parent, Property { name, at: element.at.clone(), value: target })
            }
            "include" => self.include(element, parent, depth),
            "default" => {
                element.allow(&["name", "value"])?;
                refuse_children(source, element)?;
                let name = element.required("name")?;
                if name.value.is_empty() {
                    return Err(name.at.error("the name of a <default> must not be empty"));
                }
                self.parameters.set_default(&name.value, &element.required("value")?.value);
                Ok(())
            }
            "alias" => self.alias(source, element),
            "path" => self.path(source, element, parent),
            _ if PROPERTY_TAGS.contains(&tag) => self.property(source, element, parent),
            _ if transform::OPERATIONS.contains(&tag) => {
                Err(element.at.error(format!("<{tag}> can only stand inside a <transform>")))
            }
            _ => {
                let tags = || Kind::tags().chain(PROPERTY_TAGS).chain(STRUCTURE_TAGS).filter(|t| *t != "scene");
                let hint = did_you_mean(tag, tags());
                Err(element.at.error(format!("unknown element <{tag}>{hint}; accepted: {}", list(tags()))))
            }
        }
    }

    fn object(
        &mut self,
        source: &Source,
        element: &Element,
        kind: Kind,
        parent: Option<ObjectId>,
        depth: usize,
    ) -> Result<ObjectId, SceneError> {
        if depth > MAX_DEPTH {
            return Err(element.at.error(format!("objects are nested more than {MAX_DEPTH} levels deep")));
        }
        let plugin = match parent {
            None => {
                element.allow(&["version", "type", "id", "name"])?;
                element.get("type").unwrap_or("scene").to_owned()
            }
            // The root of an included file has a version, and an XML file cannot nest such a root any deeper.
            Some(_) if element.node.parent_element().is_none() => {
                element.allow(&["version", "type", "id", "name"])?;
                element.required("type")?.value.clone()
            }
            Some(_) => {
                element.allow(&["type", "id", "name"])?;
                element.required("type")?.value.clone()
            }
        };
        let index = self.tree.objects.len();
        if let Some(id) = element.attribute("id") {
            if let Some(&first) = self.ids.get(&id.value) {
                let first = &self.tree.objects[first].at;
                return Err(id.at.error(format!("the id \"{}\" is already taken at {first}", id.value)));
            }
            self.ids.insert(id.value.clone(), index);
        }
        self.tree.objects.push(Object {
            kind,
            plugin,
            id: element.get("id").map(str::to_owned),
            at: element.at.clone(),
            folders: self.folders.iter().rev().cloned().collect::<Arc<[PathBuf]>>(),
            properties: Vec::new(),
        });
        self.children(source, element, index, depth + 1)?;
        Ok(index)
    }

    fn property(&mut self, source: &Source, element: &Element, parent: ObjectId) -> Result<(), SceneError> {
        let tag = element.tag.as_str();
        if tag != "transform" {
            refuse_children(source, element)?;
        }
        let value = match tag {
            "transform" => {
                element.allow(&["name"])?;
                Value::Transform(self.transform(source, element)?)
            }
            "vector" | "point" => {
                element.allow(&["name", "value", "x", "y", "z"])?;
                if element.attribute("value").is_none() {
                    for component in ["x", "y", "z"] {
                        element.required(component)?;
                    }
                }
                let vector = transform::xyz(&|name: &str| element.get(name), 0.0);
                Value::Vector(vector.map_err(|message| element.at.error(message))?)
            }
            "spectrum" if element.attribute("filename").is_some() => {
                element.allow(&["name", "filename"])?;
                Value::Samples(self.spectrum_file(element)?)
            }
            _ => {
                element.allow(&["name", "value"])?;
                let text = element.required("value")?;
                let parsed = match tag {
                    "boolean" => values::boolean(&text.value).map(Value::Boolean),
                    "integer" => values::integer(&text.value).map(Value::Integer),
                    "float" => values::float(&text.value).map(Value::Float),
                    "string" => Ok(Value::String(text.value.clone())),
                    "rgb" => values::rgb(&text.value).map(Value::Rgb),
                    _ if text.value.contains(':') => spectrum::samples(&text.value).map(Value::Samples),
                    _ => values::float(&text.value).map(Value::Spectrum).map_err(|message| {
                        format!(
                            "{message}; a <spectrum> is one number for all wavelengths, or like \"400:0.1, 500:0.2\""
                        )
                    }),
                };
                parsed.map_err(|message| text.at.error(message))?
            }
        };
        let name = values::snake_case(&element.required("name")?.value);
        self.add(parent, Property { name: Some(name), at: element.at.clone(), value })
    }

    /// The samples in the file that a `<spectrum>` names.
    fn spectrum_file(&self, element: &Element) -> Result<Vec<(f64, f64)>, SceneError> {
        let filename = element.required("filename")?;
        let path = find(&filename.value, self.folders.iter().rev());
        let shown = path.display().to_string();
        let unreadable =
            |cause: &dyn std::fmt::Display| filename.at.error(format!("cannot read the spectrum {shown}: {cause}"));
        let bytes = std::fs::read(&path).map_err(|cause| unreadable(&cause))?;
        let text = std::str::from_utf8(&bytes).map_err(|cause| unreadable(&cause))?;
        spectrum::file(text).map_err(|(line, message)| SceneError::Asset {
            file: shown.clone(),
            line,
            col: 1,
            message,
            used_at: filename.at.to_string(),
        })
    }

    fn transform(&mut self, source: &Source, element: &Element) -> Result<DMat4, SceneError> {
        let mut total = DMat4::IDENTITY;
        for node in element.node.children() {
            if !node.is_element() {
                refuse_text(source, node)?;
                continue;
            }
            let step = self.element(source, node)?;
            if !transform::OPERATIONS.contains(&step.tag.as_str()) {
                let accepted = || transform::OPERATIONS.into_iter().filter(|name| *name != "look_at");
                return Err(step.at.error(format!(
                    "<{}> cannot stand inside a <transform>{}; accepted: {}",
                    step.tag,
                    did_you_mean(&step.tag, accepted()),
                    list(accepted())
                )));
            }
            step.allow(transform::attributes(&step.tag))?;
            refuse_children(source, &step)?;
            let matrix = transform::operation(&step.tag, |name| step.get(name));
            total = matrix.map_err(|message| step.at.error(message))? * total;
            if !total.is_finite() {
                return Err(step.at.error("the transform overflows: its matrix has entries that are not finite"));
            }
        }
        Ok(total)
    }

    fn include(&mut self, element: &Element, parent: ObjectId, depth: usize) -> Result<(), SceneError> {
        element.allow(&["filename", "name"])?;
        let filename = element.required("filename")?;
        let path = find(&filename.value, self.folders.iter().rev());
        let shown = path.display().to_string();
        let canonical = path
            .canonicalize()
            .map_err(|cause| filename.at.error(format!("cannot read the included file {shown}: {cause}")))?;
        if self.including.contains(&canonical) {
            return Err(filename.at.error(format!("{shown} includes itself")));
        }
        if self.including.len() >= MAX_DEPTH {
            return Err(filename.at.error(format!("files include each other more than {MAX_DEPTH} levels deep")));
        }
        let bytes = std::fs::read(&path)
            .map_err(|cause| filename.at.error(format!("cannot read the included file {shown}: {cause}")))?;
        let text = read_text(&bytes, &shown)?;
        let folders = self.folders.len();
        self.folders.push(path.parent().unwrap_or(Path::new("")).to_owned());
        self.including.push(canonical);
        let host = Host { parent, name: element.get("name").map(values::snake_case), depth };
        self.document(text, &shown, Some(host))?;
        self.including.pop();
        self.folders.truncate(folders);
        Ok(())
    }

    fn alias(&mut self, source: &Source, element: &Element) -> Result<(), SceneError> {
        element.allow(&["id", "as"])?;
        refuse_children(source, element)?;
        let (id, new) = (element.required("id")?, element.required("as")?);
        let Some(&target) = self.ids.get(&id.value) else { return Err(id.at.error(self.unknown_id(&id.value))) };
        if self.ids.insert(new.value.clone(), target).is_some() {
            return Err(new.at.error(format!("the id \"{}\" is already taken", new.value)));
        }
        Ok(())
    }

    fn path(&mut self, source: &Source, element: &Element, parent: ObjectId) -> Result<(), SceneError> {
        element.allow(&["value"])?;
        refuse_children(source, element)?;
        let value = element.required("value")?;
        if parent != 0 {
            return Err(element.at.error("<path> can only stand directly inside <scene>"));
        }
        let folder = find(&value.value, self.folders.iter().rev());
        if !folder.is_dir() {
            return Err(value.at.error(format!("there is no folder {}", folder.display())));
        }
        self.folders.push(folder);
        Ok(())
    }

    fn add(&mut self, parent: ObjectId, property: Property) -> Result<(), SceneError> {
        let object = &mut self.tree.objects[parent];
        let twice = |other: &&Property| other.name.is_some() && other.name == property.name;
        if let Some(first) = object.properties.iter().find(twice) {
            let name = property.name.as_deref().unwrap_or_default();
            return Err(property.at.error(format!("\"{name}\" is given twice; first at {}", first.at)));
        }
        object.properties.push(property);
        Ok(())
    }

    fn unknown_id(&self, id: &str) -> String {
        let mut known: Vec<&str> = self.ids.keys().map(String::as_str).collect();
        known.sort_unstable();
        format!(
            "nothing has the id \"{id}\"{}; known here: {}",
            did_you_mean(id, known.iter().copied()),
            list(known.iter().copied())
        )
    }

    /// References may name objects that come later, so they are resolved at the end.
    fn resolve_references(&mut self) -> Result<(), SceneError> {
        for object in 0..self.tree.objects.len() {
            for index in 0..self.tree.objects[object].properties.len() {
                let property = &self.tree.objects[object].properties[index];
                let Value::Reference(id) = &property.value else { continue };
                let Some(&target) = self.ids.get(id) else { return Err(property.at.error(self.unknown_id(id))) };
                self.tree.objects[object].properties[index].value = Value::Object(target);
            }
        }
        Ok(())
    }
}
