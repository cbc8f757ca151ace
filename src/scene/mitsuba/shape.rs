//! `<shape>`: surfaces in world space, with what they do to light and the media on their sides.

use glam::{DMat3, DMat4, DVec3};

use super::build::Context;
use super::props::{Child, Props, unknown_plugin};
use super::tree::Kind;
use super::{bsdf, emitter, source};
use crate::scene::mesh::{self, obj};
use crate::scene::{Boundary, Bsdf, Geometry, Mesh, SceneError, Shape};

const TYPES: [&str; 4] = ["obj", "rectangle", "cube", "sphere"];

/// The points of a shape, and what was found out on the way.
struct Outline {
    /// `None` if nothing is left of a mesh.
    geometry: Option<Geometry>,
    name: String,
    /// `to_world` turns or mirrors a sphere, which has texture coordinates but no axes of its own.
    turned: bool,
    /// How a mirroring transform changed the normals, if it did in a way that is worth a warning.
    mirrored: Option<&'static str>,
}

/// A shape, or `None` for a mesh that has no area at all.
pub(super) fn convert<'a>(context: &mut Context<'a>, child: Child<'a>) -> Result<Option<Shape>, SceneError> {
    let plugin = child.object.plugin.as_str();
    if !TYPES.contains(&plugin) {
        return Err(unknown_plugin(child.object, &TYPES));
    }
    let props = context.props(child);
    let emission = match props.child(Kind::Emitter)? {
        Some(emitter) => Some(emitter::area(context, emitter)?),
        None => None,
    };
    let boundary = boundary(context, &props)?;
    let bsdf = match props.child(Kind::Bsdf)? {
        Some(child) => bsdf::convert(context, child)?,
        None => default_bsdf(context, child, emission, boundary),
    };
    let flip = props.boolean("flip_normals")?.is_some_and(|given| given.value);
    // A weight of Mitsuba's gradients.
    props.float("silhouette_sampling_weight")?;
    let outline = match plugin {
        "sphere" => sphere(&props, flip)?,
        "obj" => triangles(context, child, &props, flip)?,
        _ => analytic(&props, plugin, flip)?,
    };
    props.finish()?;

    if let (Some(why), Some(geometry)) = (bsdf.needs_uvs(), &outline.geometry) {
        let text = match geometry {
            Geometry::Mesh(mesh) if mesh.uvs.is_empty() => "but its mesh has no texture coordinates (vt)",
            Geometry::Sphere { .. } if outline.turned => {
                "but its to_world turns or mirrors it; only spheres that are moved and scaled can have one"
            }
            _ => "",
        };
        if !text.is_empty() {
            return Err(child.object.at.error(format!("the BSDF of this shape has {why}, {text}")));
        }
    }
    let sides_matter = emission.is_some() || boundary.is_some() || bsdf.sides_differ();
    if let Some(text) = outline.mirrored.filter(|_| sides_matter) {
        context.warnings.push(child.object.at.warning(text));
    }
    let name = child.object.id.clone().unwrap_or(outline.name);
    Ok(outline.geometry.map(|geometry| Shape { name, geometry, bsdf, emission, boundary }))
}

/// What Mitsuba gives to a shape without a BSDF.
fn default_bsdf<'a>(
    context: &mut Context<'a>,
    child: Child<'a>,
    emission: Option<DVec3>,
    boundary: Option<Boundary>,
) -> Bsdf {
    if boundary.is_some() {
        let text = "this boundary of a medium has no BSDF, so it is a diffuse surface, as in Mitsuba; an invisible \
                    boundary needs <bsdf type=\"null\"/>";
        context.warnings.push(child.object.at.warning(text));
    }
    let reflectance = if emission.is_some() { 0.0 } else { bsdf::DEFAULT_REFLECTANCE };
    Bsdf::Diffuse { reflectance: DVec3::splat(reflectance).into(), two_sided: false }
}

/// The media named `interior` and `exterior`.
fn boundary<'a>(context: &mut Context<'a>, props: &Props<'a>) -> Result<Option<Boundary>, SceneError> {
    let mut boundary = Boundary { interior: None, exterior: None };
    for child in props.children(Kind::Medium) {
        let side = match child.name {
            Some("interior") => &mut boundary.interior,
            Some("exterior") => &mut boundary.exterior,
            name => {
                let found = name.map_or("no name".to_owned(), |name| format!("the name \"{name}\""));
                return Err(child.at.error(format!(
                    "the medium of a shape has {found}; it must be named \"interior\" or \"exterior\""
                )));
            }
        };
        *side = Some(context.medium(child)?);
    }
    let any = boundary.interior.is_some() || boundary.exterior.is_some();
    Ok(any.then_some(boundary))
}

/// `to_world`, which must have an inverse.
fn to_world(props: &Props) -> Result<DMat4, SceneError> {
    let Some(given) = props.transform("to_world")? else { return Ok(DMat4::IDENTITY) };
    let determinant = DMat3::from_mat4(given.value).determinant();
    if determinant == 0.0 || !determinant.is_finite() {
        return Err(given
            .at
            .error(format!("to_world has no inverse: the determinant of its upper 3 x 3 part is {determinant}")));
    }
    Ok(given.value)
}

/// Whether a transform turns left hands into right ones.
fn mirrors(to_world: &DMat4) -> bool {
    DMat3::from_mat4(*to_world).determinant() < 0.0
}

fn sphere(props: &Props, flip: bool) -> Result<Outline, SceneError> {
    const TOLERANCE: f64 = 1e-6;
    let center = props.vector("center")?.map_or(DVec3::ZERO, |given| given.value);
    let radius = match props.float("radius")? {
        Some(given) if given.value <= 0.0 => {
            return Err(given.at.error(format!("radius is {}; it must be greater than 0", given.value)));
        }
        Some(given) => given.value,
        None => 1.0,
    };
    let to_world = to_world(props)?;
    let linear = DMat3::from_mat4(to_world);
    let scale = linear.determinant().abs().cbrt();
    let gram = linear.transpose() * linear * (scale * scale).recip();
    if !gram.abs_diff_eq(DMat3::IDENTITY, TOLERANCE) {
        let at = props.transform("to_world")?.map(|given| given.at.clone());
        let at = at.expect("the identity, which a missing to_world is, is uniform");
        return Err(at.error("a sphere cannot be scaled non-uniformly; use the same factor for x, y and z"));
    }
    let mirrored = mirrors(&to_world);
    let (center, radius) = (to_world.transform_point3(center), radius * scale);
    if !center.is_finite() || !radius.is_finite() {
        return Err(props.at().error("the sphere overflows: its world-space centre or radius is not finite"));
    }
    Ok(Outline {
        geometry: Some(Geometry::Sphere { center, radius, flipped: flip != mirrored }),
        name: "sphere".to_owned(),
        turned: !(linear * scale.recip()).abs_diff_eq(DMat3::IDENTITY, TOLERANCE),
        mirrored: mirrored.then_some(
            "to_world mirrors this sphere, which turns its normals around, as in Mitsuba; use flip_normals to turn \
             them back",
        ),
    })
}

/// Rectangles and cubes keep their normals outwards however they are transformed.
fn analytic(props: &Props, plugin: &str, flip: bool) -> Result<Outline, SceneError> {
    let to_world = to_world(props)?;
    let mut mesh = if plugin == "cube" { mesh::cube() } else { mesh::rectangle() };
    mesh.transform(&to_world);
    let mirrored = mirrors(&to_world);
    if flip != mirrored {
        mesh.flip();
    }
    if mesh.positions.iter().any(|p| !p.is_finite()) {
        return Err(props.at().error("the shape overflows: its world-space corners are not finite"));
    }
    Ok(Outline {
        geometry: Some(Geometry::Mesh(mesh)),
        name: plugin.to_owned(),
        turned: false,
        mirrored: mirrored.then_some(
            "to_world mirrors this shape; its normals stay on the side that Mitsuba emits light from, where Mitsuba \
             swaps interior and exterior media",
        ),
    })
}

fn triangles<'a>(
    context: &mut Context<'a>,
    child: Child<'a>,
    props: &Props<'a>,
    flip: bool,
) -> Result<Outline, SceneError> {
    let at = &child.object.at;
    let filename = props
        .string("filename")?
        .ok_or_else(|| at.error("<shape type=\"obj\"> needs <string name=\"filename\" value=\"…\"/>"))?;
    let face_normals = props.boolean("face_normals")?.is_some_and(|given| given.value);
    let flip_uvs = props.boolean("flip_tex_coords")?.is_none_or(|given| given.value);
    let to_world = to_world(props)?;

    let path = source::find(&filename.value, child.object.folders.iter());
    let shown = path.display().to_string();
    let bytes =
        std::fs::read(&path).map_err(|cause| filename.at.error(format!("cannot read the mesh {shown}: {cause}")))?;
    let read = obj::parse(&bytes).map_err(|error| SceneError::Asset {
        file: shown.clone(),
        line: error.line,
        col: error.col,
        message: error.message,
        used_at: filename.at.to_string(),
    })?;
    let mut mesh: Mesh = read.mesh;
    if mesh.triangles.is_empty() {
        return Err(filename.at.error(format!("the mesh {shown} has no faces")));
    }
    let total = mesh.triangles.len();
    mesh.transform(&to_world);
    if let Some(vertex) = mesh.positions.iter().position(|p| !p.is_finite()) {
        let p = mesh.positions[vertex];
        return Err(at.error(format!("the mesh {shown} overflows: to_world moves a vertex to {p}")));
    }
    let dropped = mesh.drop_degenerate();
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
        geometry: (!empty).then_some(Geometry::Mesh(mesh)),
        name: filename.value,
        turned: false,
        mirrored: mirrors(&to_world).then_some(
            "to_world mirrors this mesh, which turns its normals around, as in Mitsuba; use flip_normals to turn them \
             back",
        ),
    })
}
