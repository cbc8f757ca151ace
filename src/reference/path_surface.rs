//! Mirror of `shaders/lib/path_surface.glsl`: what a surface is at a point.

use super::bindings::{Primitive, Surface, Tables};
use super::bsdf::pane_reflectance;
use super::math::{arctan2, max_component, orthonormal_frame};
use super::texture::{eval_attribute, eval_texture, texture_gradient};
use crate::pack::layout::{
    PRIMITIVE_SPHERE, SURFACE_HEIGHTS, SURFACE_INVERTED, SURFACE_PANE, SURFACE_RELIEF_FADES, SURFACE_RELIEF_FLIPS,
    SURFACE_RELIEF_TURNS, SURFACE_SMOOTH, TEXTURE_ATTRIBUTE,
};
use glam::{DMat3, DVec2, DVec3};
use std::f64::consts::{FRAC_1_PI, PI, TAU};

/// A point on a primitive, as a ray finds it.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// Index of the primitive.
    pub index: u32,
    /// Where it is; of use for spheres.
    pub point: DVec3,
    /// Of a triangle.
    pub barycentric: DVec2,
}

/// Whether it is a sphere, else a triangle.
pub fn is_sphere(primitive: &Primitive) -> bool {
    primitive.surface & PRIMITIVE_SPHERE != 0
}

/// The axes of a sphere, which stand in the place of its corners' normals.
fn sphere_axes(tables: &Tables, place: &Place) -> DMat3 {
    let corners = &tables.corners[place.index as usize];
    DMat3::from_cols(corners.normal_a.as_dvec3(), corners.normal_b.as_dvec3(), corners.normal_c.as_dvec3())
}

/// Texture coordinates of a point on a primitive: a sphere's from the direction from its centre, (azimuth / 2π, polar angle / π).
pub fn texture_coordinates(tables: &Tables, place: &Place) -> DVec2 {
    let primitive = tables.primitive(place.index);
    if is_sphere(primitive) {
        let outwards = sphere_axes(tables, place).transpose() * (place.point - primitive.a);
        let azimuth = arctan2(outwards.y, outwards.x) * 0.5 * FRAC_1_PI;
        let polar = arctan2(outwards.truncate().length(), outwards.z) * FRAC_1_PI;
        return DVec2::new(if azimuth < 0.0 { azimuth + 1.0 } else { azimuth }, polar);
    }
    let corners = &tables.corners[place.index as usize];
    let DVec2 { x, y } = place.barycentric;
    let weights = DVec3::new(1.0 - x - y, x, y);
    let u = DVec3::new(f64::from(corners.u_a), f64::from(corners.u_b), f64::from(corners.u_c));
    DVec2::new(u.dot(weights), corners.v.as_dvec3().dot(weights))
}

/// Optical depth at which a share is left. What is not there at all is out of reach for any flight.
fn color_depth(share: f64) -> f64 {
    if share > 1e-30 { -share.min(1.0).ln() } else { 1000.0 }
}

/// A colour at a place on a primitive; `texture` is its index plus one.
fn texture_at(tables: &Tables, texture: u32, place: &Place) -> DVec3 {
    let texture = &tables.textures[texture as usize - 1];
    if texture.flags & TEXTURE_ATTRIBUTE != 0 {
        let number = tables.corners[place.index as usize].number;
        return eval_attribute(texture, &tables.values, number, place.barycentric);
    }
    eval_texture(texture, &tables.values, texture_coordinates(tables, place))
}

/// What a thin pane leaves of the light that it does not reflect.
fn pane_transmittance(tables: &Tables, surface: &Surface, place: &Place) -> DVec3 {
    match surface.textures_2 & 0xffff {
        0 => surface.transmittance,
        texture => texture_at(tables, texture, place),
    }
}

/// The colour of a thin pane as an optical depth of each channel, 0 for the one that it leaves the most of: of the rest [`opacity_at`] knows.
pub fn pane_depth(tables: &Tables, surface: &Surface, place: &Place) -> DVec3 {
    let color = pane_transmittance(tables, surface, place);
    (color / max_component(color).max(1e-30)).map(color_depth)
}

/// Probability that light in a direction meets a surface that it may also pass: a mask, or a thin pane, of which `opacity` says how
/// much of the light is left that it does not reflect.
pub fn opacity_at(tables: &Tables, surface: &Surface, place: &Place, direction: DVec3) -> f64 {
    if surface.flags & SURFACE_PANE != 0 {
        let primitive = tables.primitive(place.index);
        let normal = if is_sphere(primitive) {
            (place.point - primitive.a).normalize()
        } else {
            (primitive.b - primitive.a).cross(primitive.c - primitive.a).normalize()
        };
        let smooth = surface.flags & SURFACE_SMOOTH != 0;
        let normal = if smooth { shading_normal(tables, place, normal) } else { normal };
        let textured = surface.textures_2 & 0xffff != 0;
        let most = if textured { max_component(pane_transmittance(tables, surface, place)) } else { surface.opacity };
        return 1.0 - (1.0 - pane_reflectance(normal.dot(direction), surface.eta)) * most;
    }
    let texture = surface.textures_2 >> 16;
    if texture == 0 {
        return surface.opacity;
    }
    texture_at(tables, texture, place).x.clamp(0.0, 1.0)
}

/// Puts the colours at a place in the place of their means.
pub fn apply_textures(tables: &Tables, surface: &mut Surface, place: &Place) {
    let color = |texture: u32, mean: DVec3| match texture {
        0 => mean,
        texture => texture_at(tables, texture, place),
    };
    surface.reflectance = color(surface.textures_1 & 0xffff, surface.reflectance);
    surface.specular = color(surface.textures_1 >> 16, surface.specular);
    surface.transmittance = color(surface.textures_2 & 0xffff, surface.transmittance);
    if surface.flags & SURFACE_PANE != 0 && surface.textures_2 & 0xffff != 0 {
        surface.opacity = max_component(surface.transmittance);
    }
}

/// The normal of the BSDF's frame: that of the surface, or the interpolated one.
pub fn shading_normal(tables: &Tables, place: &Place, normal: DVec3) -> DVec3 {
    let corners = &tables.corners[place.index as usize];
    let DVec2 { x, y } = place.barycentric;
    let [a, b, c] = [corners.normal_a, corners.normal_b, corners.normal_c].map(|corner| corner.as_dvec3());
    let sum = a * (1.0 - x - y) + b * x + c * y;
    if sum.length_squared() > 0.0 { sum.normalize() } else { normal }
}

/// The tangent of the BSDF's frame: the direction in which u grows, where it has one.
pub fn surface_tangent(tables: &Tables, place: &Place, axis: DVec3) -> DVec3 {
    let primitive = tables.primitive(place.index);
    let along = if is_sphere(primitive) {
        let axes = sphere_axes(tables, place);
        let outwards = axes.transpose() * (place.point - primitive.a);
        axes * DVec3::new(-outwards.y, outwards.x, 0.0)
    } else {
        let corners = &tables.corners[place.index as usize];
        let v = corners.v.as_dvec3();
        let v = DVec2::new(v.y - v.x, v.z - v.x);
        let [u_a, u_b, u_c] = [corners.u_a, corners.u_b, corners.u_c].map(f64::from);
        let side = (u_b - u_a) * v.y - (u_c - u_a) * v.x;
        ((primitive.b - primitive.a) * v.y - (primitive.c - primitive.a) * v.x) * if side < 0.0 { -1.0 } else { 1.0 }
    };
    let along = along - axis * axis.dot(along);
    if along.length_squared() > 0.0 { along.normalize() } else { orthonormal_frame(axis).0 }
}

/// With which probability the other surface is in the place of a surface.
pub fn share_at(tables: &Tables, surface: &Surface, place: &Place) -> f64 {
    if surface.share_texture == 0 {
        return surface.share;
    }
    let share = texture_at(tables, surface.share_texture, place).x.clamp(0.0, 1.0);
    if surface.flags & SURFACE_INVERTED != 0 { 1.0 - share } else { share }
}

/// The derivatives of the place on a primitive by the texture coordinates; `None` where these are degenerate.
pub fn place_derivatives(tables: &Tables, place: &Place) -> Option<(DVec3, DVec3)> {
    let primitive = tables.primitive(place.index);
    if is_sphere(primitive) {
        let axes = sphere_axes(tables, place);
        let outwards = axes.transpose() * (place.point - primitive.a);
        let flat = outwards.truncate();
        let dp_du = axes * (TAU * DVec3::new(-outwards.y, outwards.x, 0.0));
        let dp_dv = axes * (PI * (flat * (outwards.z / flat.length())).extend(-flat.length()));
        return (flat.length() > 0.0).then_some((dp_du, dp_dv));
    }
    let corners = &tables.corners[place.index as usize];
    let [u_a, u_b, u_c] = [corners.u_a, corners.u_b, corners.u_c].map(f64::from);
    let v = corners.v.as_dvec3();
    let (u, v) = (DVec2::new(u_b - u_a, u_c - u_a), DVec2::new(v.y - v.x, v.z - v.x));
    let (edge_1, edge_2) = (primitive.b - primitive.a, primitive.c - primitive.a);
    let determinant = u.x * v.y - u.y * v.x;
    let dp_du = (edge_1 * v.y - edge_2 * v.x) / determinant;
    let dp_dv = (edge_2 * u.x - edge_1 * u.y) / determinant;
    (determinant != 0.0).then_some((dp_du, dp_dv))
}

/// The normal of a height field over a surface with the normal n, in (s, t, n); not normalised.
fn height_normal(tables: &Tables, surface: &Surface, place: &Place, [s, t, n]: [DVec3; 3]) -> DVec3 {
    let Some((dp_du, dp_dv)) = place_derivatives(tables, place) else { return DVec3::Z };
    let texture = &tables.textures[surface.relief_texture as usize - 1];
    let slope = texture_gradient(texture, &tables.values, texture_coordinates(tables, place)) * surface.relief_scale;
    let found = (dp_du + n * (slope.x - n.dot(dp_du))).cross(dp_dv + n * (slope.y - n.dot(dp_dv)));
    let found = if found.dot(n) < 0.0 { -found } else { found };
    DVec3::new(s.dot(found), t.dot(found), n.dot(found))
}

/// A frame that a map of normals or heights has turned.
#[derive(Clone, Copy, Debug)]
pub struct TurnedFrame {
    /// The new normal.
    pub axis: DVec3,
    /// The new tangent.
    pub tangent: DVec3,
    /// The squared roughness by which light fades where it grazes the surface, 0 if it does not.
    pub fade: f64,
}

/// Turns the frame of a BSDF by a map of normals or heights. `towards` is where the path comes from; `turned` says that the axis is
/// on the back of the surface.
pub fn turn_frame(
    tables: &Tables,
    surface: &Surface,
    place: &Place,
    towards: DVec3,
    turned: bool,
    axis: DVec3,
) -> TurnedFrame {
    let s = surface_tangent(tables, place, axis);
    let front = if turned { -axis } else { axis };
    let t = front.cross(s);
    let mut n = if surface.flags & SURFACE_HEIGHTS != 0 {
        height_normal(tables, surface, place, [s, t, front])
    } else {
        let texture = &tables.textures[surface.relief_texture as usize - 1];
        2.0 * eval_texture(texture, &tables.values, texture_coordinates(tables, place)) - 1.0
    };
    let other_way = |n: DVec3| DVec3::new(-n.x, -n.y, n.z);
    if turned && surface.flags & SURFACE_RELIEF_TURNS != 0 {
        n = other_way(n);
    }
    let local = DVec3::new(s.dot(towards), t.dot(towards), axis.dot(towards));
    if surface.flags & SURFACE_RELIEF_FLIPS != 0 && local.z * local.dot(n) <= 0.0 {
        n = other_way(n);
    }
    let n = n.try_normalize().unwrap_or(DVec3::Z);
    let along = (DVec3::X - n * n.x).try_normalize().unwrap_or(DVec3::Y);
    let fades = surface.flags & SURFACE_RELIEF_FADES != 0;
    TurnedFrame {
        axis: (s * n.x + t * n.y + axis * n.z).normalize(),
        tangent: (s * along.x + t * along.y + axis * along.z).normalize(),
        fade: if fades { (0.125 * n.truncate().length_squared() / (n.z * n.z).max(1e-12)).min(1.0) } else { 0.0 },
    }
}

/// What is left of light in a direction whose cosine to the interpolated normal is given (Conty Estevez, Lecocq and Stein 2019).
pub fn relief_fading(squared_roughness: f64, cosine: f64) -> f64 {
    let c2 = (cosine * cosine).max(1e-12);
    2.0 / (1.0 + (1.0 + squared_roughness * (1.0 - c2).max(0.0) / c2).sqrt())
}
