//! `<shape>`: surfaces in world space, with what they do to light and the media on their sides.

use glam::{DMat3, DMat4, DVec3};

use super::build::Context;
use super::mesh_file::{self, Attributes};
use super::props::{Child, Props, unknown_plugin};
use super::tree::Kind;
use super::{bsdf, emitter, medium};
use crate::scene::mesh;
use crate::scene::{Boundary, Bsdf, Geometry, SceneError, Shape};

/// Shapes that have points.
pub(super) const TYPES: [&str; 10] =
    ["obj", "ply", "serialized", "rectangle", "cube", "sphere", "disk", "cylinder", "shapegroup", "instance"];

/// The points of a shape, and what was found out on the way.
pub(super) struct Outline {
    /// Further numbers of vertices and faces.
    pub attributes: Attributes,
    /// `None` if nothing is left of a mesh.
    pub geometry: Option<Geometry>,
    pub name: String,
    /// Normals are those of a file.
    pub own_normals: bool,
    /// Of a sphere: its axes in world space.
    pub axes: DMat3,
    /// How a mirroring transform changed the normals, if it did in a way that is worth a warning.
    pub mirrored: Option<&'static str>,
}

/// The surfaces that a shape of the scene stands for: none for a group, whose shapes are where instances put them, and one
/// otherwise, or none if nothing is left of its mesh.
pub(super) fn convert<'a>(context: &mut Context<'a>, child: Child<'a>) -> Result<Vec<Shape>, SceneError> {
    match child.object.plugin.as_str() {
        "shapegroup" => {
            // Made as well and thrown away, since a fault in a group that nobody puts anywhere is one that waits.
            group(context, child, &DMat4::IDENTITY)?;
            Ok(Vec::new())
        }
        "instance" => instance(context, child),
        _ => Ok(single(context, child, &DMat4::IDENTITY)?.into_iter().collect()),
    }
}

/// The shapes of a group, moved.
fn group<'a>(context: &mut Context<'a>, child: Child<'a>, outer: &DMat4) -> Result<Vec<Shape>, SceneError> {
    let props = context.props(child);
    let inside = props.children(Kind::Shape);
    props.finish()?;
    let mut shapes = Vec::new();
    for part in inside {
        if matches!(part.object.plugin.as_str(), "shapegroup" | "instance") {
            let what = part.object.describe();
            return Err(part.at.error(format!("<shape type=\"shapegroup\"> cannot hold {what}")));
        }
        shapes.extend(single(context, part, outer)?);
    }
    Ok(shapes)
}

/// A copy of a group. It shares nothing with other copies: each has triangles of its own, in world space.
fn instance<'a>(context: &mut Context<'a>, child: Child<'a>) -> Result<Vec<Shape>, SceneError> {
    let props = context.props(child);
    let to_world = to_world(&props, &DMat4::IDENTITY)?;
    let groups = props.children(Kind::Shape);
    props.finish()?;
    let [inner] = groups[..] else {
        let count = groups.len();
        return Err(child.object.at.error(format!(
            "<shape type=\"instance\"> holds {count} shapes; it must hold one <ref> to a <shape type=\"shapegroup\">"
        )));
    };
    if inner.object.plugin != "shapegroup" {
        let what = inner.object.describe();
        return Err(inner
            .at
            .error(format!("<shape type=\"instance\"> cannot hold {what}; it must be a <shape type=\"shapegroup\">")));
    }
    let mut shapes = group(context, inner, &to_world)?;
    if let Some(id) = &child.object.id {
        shapes.iter_mut().for_each(|shape| shape.name = format!("{id}/{}", shape.name));
    }
    Ok(shapes)
}

/// A shape that `outer` moves after its own `to_world`, or `None` for a mesh that has no area at all.
fn single<'a>(context: &mut Context<'a>, child: Child<'a>, outer: &DMat4) -> Result<Option<Shape>, SceneError> {
    let plugin = child.object.plugin.as_str();
    if !TYPES.contains(&plugin) {
        return Err(unknown_plugin(child.object, &TYPES));
    }
    let props = context.props(child);
    let boundary = boundary(context, &props)?;
    let emission = match props.child(Kind::Emitter)? {
        Some(emitter) if emitter.object.plugin == "volumelight" => {
            let Some(medium) = boundary.and_then(|boundary| boundary.interior) else {
                return Err(emitter.at.error(
                    "<emitter type=\"volumelight\"> makes the medium inside of a shape shine; this one has no medium named \
                     \"interior\"",
                ));
            };
            medium::shine(context, medium, emitter)?;
            None
        }
        Some(emitter) => Some((emitter::area(context, emitter)?, emitter)),
        None => None,
    };
    let (lamp, emission) = (emission.as_ref().map(|(_, emitter)| *emitter), emission.map(|(radiance, _)| radiance));
    let (emission, emission_texture) = match emission {
        Some((radiance, texture)) => (Some(radiance), texture),
        None => (None, None),
    };
    let flip = props.boolean("flip_normals")?.is_some_and(|given| given.value);
    // A weight of Mitsuba's gradients.
    props.float("silhouette_sampling_weight")?;
    let mut outline = match plugin {
        "sphere" => sphere(&props, flip, outer)?,
        "obj" | "ply" | "serialized" => mesh_file::outline(context, child, &props, flip, outer)?,
        _ => analytic(&props, plugin, flip, outer)?,
    };
    // Mitsuba sees the front of a surface on the side of its interpolated normals, and a mirror moves those of a file with the mesh. Media
    // are on the sides of the triangles, whose order of corners stays.
    if let (true, Some(_), Some(Geometry::Mesh(mesh)), None) =
        (outline.own_normals, outline.mirrored, &mut outline.geometry, boundary)
    {
        mesh.flip();
        outline.attributes.flip();
        outline.mirrored = None;
    }
    context.attributes = std::mem::take(&mut outline.attributes);
    let bsdf = match props.child(Kind::Bsdf)? {
        Some(child) => bsdf::convert(context, child)?,
        None => default_bsdf(context, child, emission, boundary),
    };
    context.attributes = Attributes::default();
    props.finish()?;
    if matches!(plugin, "disk" | "cylinder") {
        let text = format!(
            "this {plugin} is rendered with {} flat faces, with the same {}",
            mesh::SEGMENTS,
            if plugin == "disk" { "area" } else { "volume" }
        );
        context.warnings.push(child.object.at.warning(text));
    }

    if let (Some(why), Some(geometry)) = (bsdf.needs_uvs(), &outline.geometry) {
        let text = match geometry {
            Geometry::Mesh(mesh) if mesh.uvs.is_empty() => "but its mesh has no texture coordinates",
            _ => "",
        };
        if !text.is_empty() {
            return Err(child.object.at.error(format!("the BSDF of this shape has {why}, {text}")));
        }
    }
    if let (Some(_), Some(geometry), Some(lamp)) = (&emission_texture, &outline.geometry, lamp)
        && !matches!(geometry, Geometry::Mesh(mesh) if !mesh.uvs.is_empty())
    {
        return Err(lamp.at.error(
            "the radiance of this lamp is a texture, which needs a mesh (or rectangle, cube, disk, cylinder) with texture coordinates",
        ));
    }
    let axes = outline.axes;
    let sides_matter = emission.is_some() || boundary.is_some() || bsdf.sides_differ();
    if let Some(text) = outline.mirrored.filter(|_| sides_matter) {
        context.warnings.push(child.object.at.warning(text));
    }
    let name = child.object.id.clone().unwrap_or(outline.name);
    Ok(outline.geometry.map(|geometry| Shape { name, geometry, bsdf, emission, emission_texture, axes, boundary }))
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

/// `to_world`, which must have an inverse, and `outer` behind it.
pub(super) fn to_world(props: &Props, outer: &DMat4) -> Result<DMat4, SceneError> {
    let Some(given) = props.transform("to_world")? else { return Ok(*outer) };
    let determinant = DMat3::from_mat4(given.value).determinant();
    if determinant == 0.0 || !determinant.is_finite() {
        return Err(given
            .at
            .error(format!("to_world has no inverse: the determinant of its upper 3 x 3 part is {determinant}")));
    }
    Ok(*outer * given.value)
}

/// Whether a transform turns left hands into right ones.
pub(super) fn mirrors(to_world: &DMat4) -> bool {
    DMat3::from_mat4(*to_world).determinant() < 0.0
}

fn sphere(props: &Props, flip: bool, outer: &DMat4) -> Result<Outline, SceneError> {
    const TOLERANCE: f64 = 1e-6;
    let center = props.vector("center")?.map_or(DVec3::ZERO, |given| given.value);
    let radius = match props.float("radius")? {
        Some(given) if given.value <= 0.0 => {
            return Err(given.at.error(format!("radius is {}; it must be greater than 0", given.value)));
        }
        Some(given) => given.value,
        None => 1.0,
    };
    let to_world = to_world(props, outer)?;
    let linear = DMat3::from_mat4(to_world);
    let scale = linear.determinant().abs().cbrt();
    let gram = linear.transpose() * linear * (scale * scale).recip();
    if !gram.abs_diff_eq(DMat3::IDENTITY, TOLERANCE) {
        let own = props.transform("to_world")?.map(|given| given.at);
        let text = "a sphere cannot be scaled non-uniformly; use the same factor for x, y and z";
        return Err(own.unwrap_or(props.at()).error(text));
    }
    let mirrored = mirrors(&to_world);
    let (center, radius) = (to_world.transform_point3(center), radius * scale);
    if !center.is_finite() || !radius.is_finite() {
        return Err(props.at().error("the sphere overflows: its world-space centre or radius is not finite"));
    }
    Ok(Outline {
        attributes: Attributes::none(),
        own_normals: false,
        geometry: Some(Geometry::Sphere { center, radius, flipped: flip != mirrored }),
        name: "sphere".to_owned(),
        axes: linear * scale.recip(),
        mirrored: mirrored.then_some(
            "to_world mirrors this sphere, which turns its normals around, as in Mitsuba; use flip_normals to turn \
             them back",
        ),
    })
}

/// Rectangles, cubes, disks and cylinders keep their normals outwards however they are transformed.
fn analytic(props: &Props, plugin: &str, flip: bool, outer: &DMat4) -> Result<Outline, SceneError> {
    let to_world = to_world(props, outer)?;
    let mut mesh = match plugin {
        "cube" => mesh::cube(),
        "disk" => mesh::disk(),
        "cylinder" => cylinder(props)?,
        _ => mesh::rectangle(),
    };
    mesh.transform(&to_world);
    let mirrored = mirrors(&to_world);
    if flip != mirrored {
        mesh.flip();
    }
    if mesh.positions.iter().any(|p| !p.is_finite()) {
        return Err(props.at().error("the shape overflows: its world-space corners are not finite"));
    }
    Ok(Outline {
        attributes: Attributes::none(),
        own_normals: false,
        geometry: Some(Geometry::Mesh(mesh)),
        name: plugin.to_owned(),
        axes: DMat3::IDENTITY,
        mirrored: mirrored.then_some(
            "to_world mirrors this shape; its normals stay on the side that Mitsuba emits light from, where Mitsuba \
             swaps interior and exterior media",
        ),
    })
}

fn cylinder(props: &Props) -> Result<crate::scene::Mesh, SceneError> {
    let (p0, p1, radius) = (props.vector("p0")?, props.vector("p1")?, props.float("radius")?);
    let at = [&p0, &p1].into_iter().flatten().next().map_or(props.at(), |given| given.at);
    let p0 = p0.map_or(DVec3::ZERO, |given| given.value);
    let p1 = p1.map_or(DVec3::Z, |given| given.value);
    if !((p1 - p0).length() > 0.0 && (p1 - p0).is_finite()) {
        return Err(at.error(format!("p0 is {p0} and p1 {p1}; they must be different points")));
    }
    match radius {
        Some(given) if given.value <= 0.0 => {
            Err(given.at.error(format!("radius is {}; it must be greater than 0", given.value)))
        }
        radius => Ok(mesh::cylinder(p0, p1, radius.map_or(1.0, |given| given.value))),
    }
}
