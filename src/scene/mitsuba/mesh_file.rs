//! Shapes from mesh files: `obj`, `ply` and `serialized`.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

use glam::{DMat3, DMat4};

use super::build::Context;
use super::props::{Child, Given, Props};
use super::shape::{Outline, mirrors, to_world};
use super::source;
use crate::scene::mesh::{FileMesh, attributes, obj, ply, serialized};
use crate::scene::{Bitmap, Geometry, Mesh, SceneError};

/// A mesh file, and which of the meshes in it.
pub(super) type MeshKey = (PathBuf, &'static str, u64);

/// The attributes of the shape that is being read.
#[derive(Default)]
pub(super) enum Attributes {
    /// There is no shape: something that shapes refer to is looked at for faults.
    #[default]
    Unknown,
    /// Those of a mesh.
    Known {
        /// The mesh in world space.
        mesh: Mesh,
        /// As it was in the file.
        file: Arc<FileMesh>,
        /// Which face of the file each triangle is.
        faces: Vec<u32>,
        /// The images that were made, by name and the bits of their factor.
        images: HashMap<(String, u32), Arc<Bitmap>>,
    },
}

impl Attributes {
    /// Of a mesh from a file. What has none has none that could be named.
    fn of(mesh: &Mesh, file: Arc<FileMesh>, faces: Vec<u32>) -> Attributes {
        // The mesh is only needed for images.
        let mesh = if file.attributes.is_empty() { Mesh::default() } else { mesh.clone() };
        Attributes::Known { mesh, file, faces, images: HashMap::new() }
    }

    /// Of a shape that is not from a file.
    pub(super) fn none() -> Attributes {
        let file = FileMesh { mesh: Mesh::default(), attributes: Vec::new(), missing_uvs: 0 };
        Attributes::of(&Mesh::default(), Arc::new(file), Vec::new())
    }

    /// The image of an attribute; `None` where there is no shape to have it. The error lists the attributes that there are.
    pub(super) fn image(&mut self, name: &str, scale: f64) -> Result<Option<Arc<Bitmap>>, String> {
        let Attributes::Known { mesh, file, faces, images } = self else { return Ok(None) };
        let usable = || file.attributes.iter().filter(|attribute| matches!(attribute.channels, 1 | 3));
        let Some(attribute) = usable().find(|attribute| attribute.name == name) else {
            let names: Vec<&str> = usable().map(|attribute| attribute.name.as_str()).collect();
            let names = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
            return Err(format!("this shape has no attribute \"{name}\" of one or three numbers; it has: {names}"));
        };
        let scale = scale as f32;
        let image = images.entry((name.to_owned(), scale.to_bits()));
        Ok(Some(image.or_insert_with(|| Arc::new(attribute.image(mesh, faces, scale))).clone()))
    }

    /// Follows the mesh, whose triangles are turned over.
    pub(super) fn flip(&mut self) {
        if let Attributes::Known { mesh, .. } = self {
            mesh.flip();
        }
    }
}

/// Reads the file, unless another shape has done so.
fn read<'a>(
    context: &mut Context<'a>,
    plugin: &str,
    path: PathBuf,
    filename: &Given<'a, String>,
    shape_index: u64,
) -> Result<Arc<FileMesh>, SceneError> {
    let format = ["obj", "ply"].into_iter().find(|name| *name == plugin).unwrap_or("serialized");
    let key = (path, format, shape_index);
    if let Some(mesh) = context.meshes.get(&key) {
        return Ok(mesh.clone());
    }
    let shown = key.0.display().to_string();
    let bytes =
        std::fs::read(&key.0).map_err(|cause| filename.at.error(format!("cannot read the mesh {shown}: {cause}")))?;
    let in_file = |text: String| filename.at.error(format!("cannot read the mesh {shown}: {text}"));
    let mesh = match format {
        "obj" => obj::parse(&bytes)
            .map(|obj| FileMesh { mesh: obj.mesh, attributes: Vec::new(), missing_uvs: obj.missing_uvs })
            .map_err(|error| SceneError::Asset {
                file: shown.clone(),
                line: error.line,
                col: error.col,
                message: error.message,
                used_at: filename.at.to_string(),
            })?,
        "ply" => ply::parse(&bytes).map_err(in_file)?,
        _ => serialized::parse(&bytes, shape_index).map_err(in_file)?,
    };
    let mesh = Arc::new(mesh);
    context.meshes.insert(key, mesh.clone());
    Ok(mesh)
}

/// The mesh of a shape in world space.
pub(super) fn outline<'a>(
    context: &mut Context<'a>,
    child: Child<'a>,
    props: &Props<'a>,
    flip: bool,
    outer: &DMat4,
) -> Result<Outline, SceneError> {
    let (at, plugin) = (&child.object.at, child.object.plugin.as_str());
    let filename = props
        .string("filename")?
        .ok_or_else(|| at.error(format!("<shape type=\"{plugin}\"> needs <string name=\"filename\" value=\"…\"/>")))?;
    let face_normals = props.boolean("face_normals")?.is_some_and(|given| given.value);
    // OBJ files have (0, 0) at the lower left of an image; Mitsuba takes it that the others do not.
    let flip_uvs = props.boolean("flip_tex_coords")?.map_or(plugin == "obj", |given| given.value);
    let shape_index = match props.integer_if("shape_index", plugin == "serialized")? {
        None => 0,
        Some(given) => u64::try_from(given.value)
            .map_err(|_| given.at.error(format!("shape_index is {}; it must not be negative", given.value)))?,
    };
    let to_world = to_world(props, outer)?;

    let path = source::find(&filename.value, child.object.folders.iter());
    let shown = path.display().to_string();
    let read = read(context, plugin, path, &filename, shape_index)?;
    let mut mesh = read.mesh.clone();
    if mesh.triangles.is_empty() {
        return Err(filename.at.error(format!("the mesh {shown} has no faces")));
    }
    let total = mesh.triangles.len();
    mesh.transform(&to_world);
    if let Some(vertex) = mesh.positions.iter().position(|p| !p.is_finite()) {
        let p = mesh.positions[vertex];
        return Err(at.error(format!("the mesh {shown} overflows: to_world moves a vertex to {p}")));
    }
    let before = if read.attributes.is_empty() { Vec::new() } else { mesh.triangles.clone() };
    let dropped = mesh.drop_degenerate();
    let faces = attributes::faces_left(&before, &mesh.triangles);
    if flip {
        mesh.flip();
    }
    let empty = mesh.triangles.is_empty();
    if empty {
        let text = format!("all {total} triangles of the mesh {shown} have no area; the shape is left out");
        context.warnings.push(filename.at.warning(text));
    } else if dropped > 0 {
        let text = format!("{dropped} of {total} triangles of the mesh {shown} have no area and are left out");
        context.warnings.push(filename.at.warning(text));
    }
    if read.missing_uvs > 0 {
        let text = format!(
            "{} vertices of the mesh {shown} have no texture coordinates; they get those of a corner of the image",
            read.missing_uvs
        );
        context.warnings.push(filename.at.warning(text));
    }
    if flip_uvs {
        mesh.uvs.iter_mut().for_each(|uv| uv.y = 1.0 - uv.y);
    }
    if !face_normals {
        mesh.complete_normals();
    }
    if face_normals || mesh.is_flat() {
        mesh.normals.clear();
    }
    Ok(Outline {
        attributes: Attributes::of(&mesh, read.clone(), faces),
        geometry: (!empty).then_some(Geometry::Mesh(mesh)),
        own_normals: !face_normals && !read.mesh.normals.is_empty(),
        name: filename.value,
        axes: DMat3::IDENTITY,
        mirrored: mirrors(&to_world).then_some(
            "to_world mirrors this mesh, which turns its normals around, as in Mitsuba; use flip_normals to turn them \
             back",
        ),
    })
}
