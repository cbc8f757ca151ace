//! Mirror of `shaders/lib/light.glsl`: what lights send to a point, and the density with which they are sampled.

use super::bindings::Light;
use super::math::{arctan2, from_frame, sine};
use super::warp::{square_to_cone, square_to_cone_pdf, square_to_sphere, square_to_sphere_pdf};
use crate::pack::layout::{INFINITE_DISTANCE, LIGHT_TRIANGLE};
use glam::{DVec2, DVec3};

/// The largest number below 1 that the kernel knows.
const BELOW_ONE: f64 = 1.0 - 1.0 / 16_777_216.0;

/// A direction from a point to a light.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Unit.
    pub direction: DVec3,
    /// To the sampled point.
    pub distance: f64,
    /// Radiance / density per solid angle; of a point: intensity / distance²; of parallel light:
    /// irradiance; 0 if nothing arrives.
    pub weight: DVec3,
    /// Per solid angle, without the choice of the light; 0 for a point, a spot and
    /// parallel light, which no other technique finds.
    pub pdf: f64,
}

impl LightSample {
    const NOTHING: LightSample = LightSample { direction: DVec3::Z, distance: 0.0, weight: DVec3::ZERO, pdf: 0.0 };
}

/// One line of the alias table (Walker 1977): `u` in \[0, 1) is split into a choice and a number that is uniform again.
pub fn alias_line(count: u32, u: &mut f64) -> u32 {
    let scaled = *u * f64::from(count);
    let line = (scaled as u32).min(count - 1);
    *u = (scaled - f64::from(line)).min(BELOW_ONE);
    line
}

/// Whether the line itself is taken, and not its alias.
pub fn alias_keeps(threshold: f64, u: &mut f64) -> bool {
    let keeps = *u < threshold;
    *u = if keeps { *u / threshold } else { (*u - threshold) / (1.0 - threshold) };
    *u = u.min(BELOW_ONE);
    keeps
}

/// Density per solid angle of a uniform point on a plane figure, seen at a distance under the cosine at the figure.
pub fn area_pdf(area: f64, distance: f64, cos_light: f64) -> f64 {
    distance * distance / (area * cos_light)
}

/// Coordinates along the two edges of a uniform point of a triangle or parallelogram.
pub fn plane_light_point(light: &Light, u: DVec2) -> DVec2 {
    let s = u.x.sqrt();
    if light.kind == LIGHT_TRIANGLE { DVec2::new(1.0 - s, u.y * s) } else { u }
}

/// What arrives from the point of a plane light with the coordinates `v` along its edges, sampled uniformly by the solid angle of
/// the whole light, or by area if that is 0.
pub fn from_plane_light(light: &Light, point: DVec3, v: DVec2, solid_angle: f64) -> LightSample {
    let offset = light.origin + light.edge_1 * v.x + light.edge_2 * v.y - point;
    let squared = offset.dot(offset);
    let distance = squared.sqrt();
    let direction = offset / distance;
    let cos_light = -direction.dot(light.normal);
    let seen = cos_light > 0.0 && squared > 0.0;
    let pdf = if solid_angle == 0.0 { squared / (light.area * cos_light) } else { 1.0 / solid_angle };
    LightSample {
        direction,
        distance,
        pdf: if seen { pdf } else { 0.0 },
        weight: if seen { light.radiance / pdf } else { DVec3::ZERO },
    }
}

/// A point on a triangle or parallelogram, uniform by area.
pub fn sample_plane_light(light: &Light, point: DVec3, u: DVec2) -> LightSample {
    from_plane_light(light, point, plane_light_point(light, u), 0.0)
}

/// A rectangle as a point sees it, in units of its first edge: it spans \[low, high\] in a plane at the height `h` above the
/// point, along axes that are parallel to its edges and begin below the point.
#[derive(Clone, Copy, Debug)]
pub struct SphericalRectangle {
    /// The corner of the light.
    pub low: DVec2,
    /// The corner across.
    pub high: DVec2,
    /// Of the plane above the point; negative on the dark side.
    pub h: f64,
    /// 0 if the rectangle is to be sampled by area.
    pub solid_angle: f64,
}

/// Below this solid angle, uniform points are as good.
pub const LEAST_SOLID_ANGLE: f64 = 2e-4;
/// Square of the sine under which the nearest point of the rectangle is seen above its plane, from which the solid angle is
/// sampled.
pub const LEAST_SIN_SQUARED: f64 = 2e-3;

/// The rectangle as a point sees it. Solid angle: van Oosterom and Strackee (1983), for its two triangles together.
pub fn spherical_rectangle(light: &Light, point: DVec3) -> SphericalRectangle {
    let offset = light.origin - point;
    let unit = 1.0 / light.edge_1.length_squared();
    let height = light.area * unit;
    let low = DVec2::new(offset.dot(light.edge_1) * unit, offset.dot(light.edge_2) / light.area);
    let high = low + DVec2::new(1.0, height);
    let h = -offset.dot(light.normal) * unit.sqrt();
    let h2 = h * h;
    let nearest = low.max(-high).max(DVec2::ZERO).length_squared() + h2;
    let mut solid_angle = 0.0;
    if h > 0.0 && h2 > LEAST_SIN_SQUARED * nearest && height > LEAST_SOLID_ANGLE * nearest {
        let [c00, c10] = [low.extend(h), DVec3::new(high.x, low.y, h)];
        let [c01, c11] = [DVec3::new(low.x, high.y, h), high.extend(h)];
        let [r00, r10, r01, r11] = [c00, c10, c01, c11].map(DVec3::length);
        let n = h * height;
        let d1 = r00 * r10 * r11 + c00.dot(c10) * r11 + c00.dot(c11) * r10 + c10.dot(c11) * r00;
        let d2 = r00 * r01 * r11 + c00.dot(c01) * r11 + c00.dot(c11) * r01 + c01.dot(c11) * r00;
        solid_angle = 2.0 * arctan2((n * (d1 + d2)).max(0.0), d1 * d2 - n * n);
    }
    if solid_angle < LEAST_SOLID_ANGLE {
        solid_angle = 0.0;
    }
    SphericalRectangle { low, high, h, solid_angle }
}

/// `high √(low² + d2) − low √(high² + d2)` of an interval, given the two roots.
fn root_difference(low: f64, high: f64, d2: f64, root_low: f64, root_high: f64) -> f64 {
    let (p, q) = (high * root_low, low * root_high);
    if p * q > 0.0 { (high - low) * (high + low) * d2 / (p + q) } else { p - q }
}

/// The point of a rectangle, in coordinates along its edges from 0 to 1, that is uniform by solid angle (Ureña, Fajardo and King
/// 2013).
pub fn sample_spherical_rectangle(r: &SphericalRectangle, u: DVec2) -> DVec2 {
    let (h2, low2, high2) = (r.h * r.h, r.low.y * r.low.y, r.high.y * r.high.y);
    let edge2 = r.low.x * r.low.x + h2;
    let (corner_low, corner_high) = ((low2 + edge2).sqrt(), (high2 + edge2).sqrt());
    let edge_y = r.low.x * r.h * root_difference(r.low.y, r.high.y, edge2, corner_low, corner_high);
    let edge_x = h2 * corner_low * corner_high + r.low.x * r.low.x * r.low.y * r.high.y;
    let half_a = 0.5 * (arctan2(edge_y, edge_x) + u.x * r.solid_angle);
    let sin_half = sine(half_a);
    let cos_half = (1.0 - sin_half * sin_half).max(1e-12).sqrt();

    let (root_low, root_high) = ((low2 + h2).sqrt(), (high2 + h2).sqrt());
    let difference = root_difference(r.low.y, r.high.y, h2, root_low, root_high);
    let (p, q) = (r.high.y * root_low, r.low.y * root_high);
    let squared = if p * q > 0.0 {
        difference * difference + 4.0 * p * q * sin_half * sin_half
    } else {
        (p + q) * (p + q) - 4.0 * p * q * cos_half * cos_half
    };
    let s = 2.0 * sin_half * cos_half * root_low * root_high / squared.sqrt();
    let x = (r.h * s / ((1.0 - s) * (1.0 + s)).max(1e-12).sqrt()).max(r.low.x).min(r.high.x);

    let d2 = x * x + h2;
    let (root_low, root_high) = ((low2 + d2).sqrt(), (high2 + d2).sqrt());
    let width = root_difference(r.low.y, r.high.y, d2, root_low, root_high) / (root_low * root_high);
    let w = r.low.y / root_low + u.y * width;
    let y = (w * (d2 / ((1.0 - w) * (1.0 + w)).max(1e-12)).sqrt()).max(r.low.y).min(r.high.y);
    DVec2::new(x - r.low.x, (y - r.low.y) / (r.high.y - r.low.y))
}

/// A point on a rectangle, uniform by solid angle, or by area if it covers little of the view.
pub fn sample_rectangle_light(light: &Light, point: DVec3, u: DVec2) -> LightSample {
    let r = spherical_rectangle(light, point);
    let v = if r.solid_angle > 0.0 { sample_spherical_rectangle(&r, u) } else { u };
    from_plane_light(light, point, v, r.solid_angle)
}

/// Density per solid angle of that, where the rectangle is met at a distance under the cosine at it.
pub fn rectangle_light_pdf(light: &Light, point: DVec3, distance: f64, cos_light: f64) -> f64 {
    let solid_angle = spherical_rectangle(light, point).solid_angle;
    if solid_angle > 0.0 { 1.0 / solid_angle } else { area_pdf(light.area, distance, cos_light) }
}

/// What a plane light sends to a point from exactly this direction.
pub fn plane_light_in(light: &Light, point: DVec3, direction: DVec3) -> LightSample {
    let across = light.edge_1.cross(light.edge_2);
    let cos_light = -direction.dot(light.normal);
    let distance = (point - light.origin).dot(light.normal) / cos_light;
    let offset = point + direction * distance - light.origin;
    let (s, t) = (offset.cross(light.edge_2).dot(across), light.edge_1.cross(offset).dot(across));
    let v = DVec2::new(s, t) / across.length_squared();
    let within = if light.kind == LIGHT_TRIANGLE { v.x + v.y <= 1.0 } else { v.max_element() <= 1.0 };
    let seen = cos_light > 0.0 && distance > 0.0 && v.min_element() >= 0.0 && within;
    seen_in(light, direction, seen.then_some(distance))
}

/// A light that is seen in a direction at a distance, or not.
fn seen_in(light: &Light, direction: DVec3, distance: Option<f64>) -> LightSample {
    let weight = if distance.is_some() { light.radiance } else { DVec3::ZERO };
    LightSample { direction, distance: distance.unwrap_or(0.0), weight, pdf: 1.0 }
}

/// 1 − cos of half the angle under which a sphere is seen from outside.
pub fn sphere_one_minus_cos(radius: f64, center_distance: f64) -> f64 {
    let sin_squared = (radius * radius / (center_distance * center_distance)).min(1.0);
    sin_squared / (1.0 + (1.0 - sin_squared).sqrt())
}

/// The outside of a sphere from outside, uniformly over its cone; the inside of a sphere with normals inwards from
/// inside, uniformly over all directions.
pub fn sample_sphere_light(light: &Light, point: DVec3, u: DVec2) -> LightSample {
    let to_center = light.origin - point;
    let radius = light.edge_1.x;
    let center_distance = to_center.length();
    let inwards = light.edge_1.y < 0.0;
    let inside = center_distance < radius;
    if inside != inwards {
        return LightSample::NOTHING;
    }
    let (direction, pdf) = if inside {
        (square_to_sphere(u), square_to_sphere_pdf())
    } else {
        let one_minus_cos = sphere_one_minus_cos(radius, center_distance);
        let local = square_to_cone(u, one_minus_cos);
        (from_frame(to_center / center_distance, local), square_to_cone_pdf(one_minus_cos))
    };
    let along = to_center.dot(direction);
    let closest = to_center - along * direction;
    let half_chord = (radius * radius - closest.dot(closest)).max(0.0).sqrt();
    // From a point of the sphere itself, rounding may find it behind.
    let distance = if inside { along + half_chord } else { along - half_chord }.max(0.0);
    LightSample { direction, distance, weight: light.radiance / pdf, pdf }
}

/// What a sphere sends to a point from exactly this direction.
pub fn sphere_light_in(light: &Light, point: DVec3, direction: DVec3) -> LightSample {
    let to_center = light.origin - point;
    let (radius, along) = (light.edge_1.x, to_center.dot(direction));
    let squared = radius * radius - (to_center - along * direction).length_squared();
    let inside = to_center.length_squared() < radius * radius;
    let seen = squared > 0.0 && inside == (light.edge_1.y < 0.0) && (inside || along > 0.0);
    let half_chord = squared.max(0.0).sqrt();
    let distance = f64::max(if inside { along + half_chord } else { along - half_chord }, 0.0);
    seen_in(light, direction, seen.then_some(distance))
}

/// Density per solid angle with which a sphere is sampled.
pub fn sphere_light_pdf(radius: f64, center_distance: f64) -> f64 {
    if center_distance < radius {
        square_to_sphere_pdf()
    } else {
        square_to_cone_pdf(sphere_one_minus_cos(radius, center_distance))
    }
}

/// A point in the sphere about an emitting medium, from outside: its direction uniform over the cone, its distance over the
/// chord. Nothing from inside.
pub fn sample_volume_light(light: &Light, point: DVec3, u: DVec2, u_distance: f64) -> LightSample {
    let to_center = light.origin - point;
    let (radius, center_distance) = (light.edge_1.x, to_center.length());
    if center_distance <= radius {
        return LightSample::NOTHING;
    }
    let one_minus_cos = sphere_one_minus_cos(radius, center_distance);
    let direction = from_frame(to_center / center_distance, square_to_cone(u, one_minus_cos));
    let pdf = square_to_cone_pdf(one_minus_cos);
    let along = to_center.dot(direction);
    let closest = to_center - along * direction;
    let half_chord = (radius * radius - closest.dot(closest)).max(0.0).sqrt();
    let distance = (along + half_chord * (2.0 * u_distance - 1.0)).max(0.0);
    LightSample { direction, distance, weight: light.radiance * (2.0 * half_chord / pdf), pdf }
}

/// Density per solid angle with which directions to that sphere are sampled: 0 from inside and past it.
pub fn volume_light_pdf(light: &Light, point: DVec3, direction: DVec3) -> f64 {
    let to_center = light.origin - point;
    let (radius, center_distance) = (light.edge_1.x, to_center.length());
    let along = to_center.dot(direction);
    let closest = to_center - along * direction;
    let met = center_distance > radius && along > 0.0 && closest.dot(closest) <= radius * radius;
    if met { square_to_cone_pdf(sphere_one_minus_cos(radius, center_distance)) } else { 0.0 }
}

/// The one direction to a point.
pub fn sample_point_light(light: &Light, point: DVec3) -> LightSample {
    let offset = light.origin - point;
    let squared = offset.dot(offset);
    let distance = squared.sqrt();
    if squared > 0.0 {
        LightSample { direction: offset / distance, distance, weight: light.radiance / squared, pdf: 0.0 }
    } else {
        LightSample::NOTHING
    }
}

/// Share of its intensity that a spot sends at an angle from its axis: all of it within the beam, then less by a straight line
/// down to nothing at the cutoff.
pub fn spot_falloff(light: &Light, angle: f64) -> f64 {
    let (cutoff, beam) = (light.edge_1.x, light.edge_1.y);
    if angle <= beam { 1.0 } else { (cutoff - angle).max(0.0) * light.edge_1.z }
}

/// The one direction to a spot.
pub fn sample_spot_light(light: &Light, point: DVec3) -> LightSample {
    let mut result = sample_point_light(light, point);
    let away = -result.direction;
    let angle = 2.0 * arctan2((away - light.normal).length(), (away + light.normal).length());
    result.weight *= spot_falloff(light, angle);
    result
}

/// The one direction from which parallel light comes; the weight is the irradiance.
pub fn sample_directional_light(light: &Light) -> LightSample {
    LightSample { direction: -light.normal, distance: f64::from(INFINITE_DISTANCE), weight: light.radiance, pdf: 0.0 }
}
