//! Puts a scene together from the objects of its file.

use std::collections::{HashMap, HashSet};
use std::path::PathBuf;
use std::sync::Arc;

use super::mesh_file::{Attributes, MeshKey};
use super::props::{Child, Props};
use super::tree::{Kind, Object, ObjectId, Property, Tree, Value};
use super::{Loaded, bsdf, emitter, integrator, medium, sensor, shape, texture, volume};
use crate::scene::mesh::{self, FileMesh};
use crate::scene::{
    Aov, Bitmap, Geometry, GridFile, Integrator, Light, Medium, MediumId, Scene, SceneError, Shape, Volume,
};

/// What the converters of single objects share.
pub(super) struct Context<'a> {
    pub tree: &'a Tree,
    pub warnings: Vec<String>,
    pub media: Vec<Medium>,
    /// Channels beside the radiance.
    pub aovs: Vec<Aov>,
    /// Name of the channels with second moments.
    pub moments: Option<String>,
    /// Images by file, and whether they are raw.
    pub images: HashMap<(PathBuf, bool), Arc<Bitmap>>,
    /// Voxels by file and name of the grid in it.
    pub grids: HashMap<(PathBuf, Option<String>), GridFile>,
    /// Meshes as they are in their files.
    pub meshes: HashMap<MeshKey, Arc<FileMesh>>,
    medium_ids: HashMap<ObjectId, MediumId>,
    /// The `volumelight` by which a medium shines.
    pub volume_lights: HashMap<MediumId, ObjectId>,
    /// Of the shape whose BSDF is being read.
    pub attributes: Attributes,
    /// BSDFs that are being read, each inside of the one before it.
    pub open_bsdfs: Vec<ObjectId>,
}

impl<'a> Context<'a> {
    /// The properties of an object.
    pub fn props(&self, child: Child<'a>) -> Props<'a> {
        Props::new(self.tree, child.object)
    }

    /// A medium of the scene; every mention of one object is one medium.
    pub fn medium(&mut self, child: Child<'a>) -> Result<MediumId, SceneError> {
        if let Some(id) = self.medium_ids.get(&child.id) {
            return Ok(*id);
        }
        let medium = medium::convert(self, child)?;
        let id = MediumId(self.media.len() as u32);
        self.media.push(medium);
        self.medium_ids.insert(child.id, id);
        Ok(id)
    }
}

/// The scene that a tree describes.
pub(super) fn build(tree: &Tree) -> Result<Loaded, SceneError> {
    let root = &tree.objects[0];
    let (images, grids, meshes, medium_ids) = (HashMap::new(), HashMap::new(), HashMap::new(), HashMap::new());
    let mut context = Context {
        tree,
        warnings: Vec::new(),
        media: Vec::new(),
        aovs: Vec::new(),
        moments: None,
        images,
        grids,
        meshes,
        medium_ids,
        volume_lights: HashMap::new(),
        attributes: Attributes::Unknown,
        open_bsdfs: Vec::new(),
    };
    let props = Props::new(tree, root);
    refuse_doubles(root)?;

    let sensors = props.children(Kind::Sensor);
    let Some(&first) = sensors.first() else {
        return Err(root.at.error("the scene has no sensor; add <sensor type=\"perspective\">"));
    };
    if let Some(second) = sensors.get(1) {
        let count = sensors.len();
        context.warnings.push(second.at.warning(format_args!("the first of {count} sensors is used, not this one")));
    }
    let sensor = sensor::convert(&mut context, first)?;

    let integrator_child = props.child(Kind::Integrator)?;
    let integrator = match integrator_child {
        Some(child) => integrator::convert(&mut context, child)?,
        None => Integrator::default(),
    };

    let mut shapes = Vec::new();
    for child in props.children(Kind::Shape) {
        shapes.extend(shape::convert(&mut context, child)?);
        if child.object.plugin == "shapegroup" && !used(tree).contains(&child.id) {
            let name = child.object.id.as_deref().map_or(String::new(), |id| format!(" \"{id}\""));
            let text = format!("the group{name} has no instance, so nothing of it is seen");
            context.warnings.push(child.at.warning(text));
        }
    }
    let mut lights = Vec::new();
    for child in props.children(Kind::Emitter) {
        lights.push(emitter::light(&mut context, child)?);
    }
    declarations(&mut context, &props, &mut shapes)?;
    props.finish()?;

    for (index, medium) in context.media.iter_mut().enumerate() {
        let id = Some(MediumId(index as u32));
        let filled: Vec<&Shape> =
            shapes.iter().filter(|shape| shape.boundary.is_some_and(|both| both.interior == id)).collect();
        if sensor.camera.medium != id {
            volume::simplify(medium, &filled);
        }
    }
    if let Some(child) = integrator_child {
        integrator::warn_about_media(&mut context, child);
    }
    if !has_light(&shapes, &lights, &context.media) {
        context.warnings.push(root.at.warning("the scene has no light: the picture will be black"));
    }
    let mut moments = context.moments;
    if let (Some(_), Some(child), true) = (&moments, integrator_child, sensor.film.filter.has_negative_lobes()) {
        let text = "no second moments are written: with a filter of both signs the squares of samples say nothing; use \"box\", \"tent\" or \"gaussian\"";
        context.warnings.push(child.at.warning(text));
        moments = None;
    }
    let scene = Scene {
        camera: sensor.camera,
        film: sensor.film,
        integrator,
        shapes,
        media: context.media,
        lights,
        aovs: context.aovs,
        moments,
        sample_count: sensor.sample_count,
    };
    context.warnings.extend(tree.warnings());
    // A shape in a group is read for each instance, and warned about each time.
    let mut said = HashSet::new();
    context.warnings.retain(|warning| said.insert(warning.clone()));
    Ok(Loaded { scene, warnings: context.warnings })
}

/// Media, BSDFs and textures that stand directly in the scene are there to be referred to. They are checked even if nobody does,
/// since a fault in them is one that waits. A medium of voxels that nobody refers to fills the box of its voxels.
fn declarations<'a>(context: &mut Context<'a>, props: &Props<'a>, shapes: &mut Vec<Shape>) -> Result<(), SceneError> {
    let used = used(context.tree);
    for kind in [Kind::Medium, Kind::Bsdf, Kind::Phase, Kind::Texture] {
        for child in props.children(kind) {
            match kind {
                Kind::Medium if !used.contains(&child.id) => {
                    let medium = medium::convert(context, child)?;
                    if let Some(Volume::Grid(volume)) = &medium.volumes.sigma_t {
                        let (name, geometry) = (medium.name.clone(), mesh::box_of(volume.to_world));
                        let id = context.medium(child)?;
                        shapes.push(Shape::boundary(&name, Geometry::Mesh(geometry), id));
                        continue;
                    }
                }
                Kind::Medium => drop(medium::convert(context, child)?),
                Kind::Bsdf => drop(bsdf::convert(context, child)?),
                Kind::Texture => drop(texture::convert(context, child)?),
                _ => drop(medium::phase(context, child)?),
            }
            if !used.contains(&child.id) {
                let name = child.object.id.as_deref().map_or(String::new(), |id| format!(" \"{id}\""));
                let text = format!("the {kind}{name} is never used");
                context.warnings.push(child.at.warning(text));
            }
        }
    }
    Ok(())
}

/// What objects other than the scene hold or refer to.
fn used(tree: &Tree) -> HashSet<ObjectId> {
    tree.objects.iter().skip(1).flat_map(targets).map(|(_, target)| target).collect()
}

/// The objects that an object holds or refers to.
fn targets(object: &Object) -> impl Iterator<Item = (&Property, ObjectId)> {
    object.properties.iter().filter_map(|property| match property.value {
        Value::Object(id) => Some((property, id)),
        _ => None,
    })
}

/// A `<ref>` directly in the scene would put what it refers to into the scene for a second time.
fn refuse_doubles(root: &Object) -> Result<(), SceneError> {
    let mut seen = HashSet::new();
    match targets(root).find(|(_, target)| !seen.insert(*target)) {
        None => Ok(()),
        Some((property, _)) => Err(property.at.error("this object is part of the scene already")),
    }
}

fn has_light(shapes: &[Shape], lights: &[Light], media: &[Medium]) -> bool {
    let shines = |radiance: glam::DVec3| radiance.max_element() > 0.0;
    shapes.iter().any(|shape| shape.emission.is_some_and(shines))
        || lights.iter().any(Light::shines)
        || media.iter().any(|medium| shines(medium.emission))
}
