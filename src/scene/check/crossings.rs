//! Boundaries of media that cross each other, or themselves.
//!
//! Closed surfaces that are nested, apart, or touch each other say for each point in which medium it lies; where they cross
//! they do not. Whether they cross is asked in two steps.
//!
//! 1. An edge of one goes through the middle of a triangle of the other: they cross, and this is the usual case.
//! 2. They only touch: faces in one plane, edges on edges. Two boxes that are shifted along one of their sides overlap like
//!    this, two that stand side by side and a box in the corner of another do as well. So points of the triangles
//!    that touch are asked for the winding number of the other surface; if some are well inside of it and others well outside,
//!    the surfaces overlap.

use glam::DVec3;
use rayon::prelude::*;

use super::triangles::{Bounds, Meeting, Triangles, meeting, nearest};
use crate::scene::{Geometry, Scene};

/// Depth, relative to the smaller of two surfaces, up to which they only touch.
const TOLERANCE: f64 = 1e-6;
/// The same relative to the coordinates: what two roundings to single precision, which most files have, can do.
const ROUNDING: f64 = 2.4e-7;
/// Points of a surface that are asked for their place, where surfaces touch.
const PROBES: usize = 96;

enum Surface {
    Mesh(Triangles),
    Sphere { center: DVec3, radius: f64 },
}

struct Body<'a> {
    name: &'a str,
    surface: Surface,
    bounds: Bounds,
}

/// Doubts about all pairs of boundaries whose bounds overlap, and about each boundary with itself. n triangles of which few
/// are close to each other take O(n log n).
pub(super) fn doubts(scene: &Scene) -> Vec<String> {
    let bodies: Vec<Body> = (scene.shapes.iter())
        .filter(|shape| shape.boundary.is_some())
        .map(|shape| {
            let (surface, bounds) = match &shape.geometry {
                Geometry::Mesh(mesh) => {
                    let triangles = Triangles::of(mesh);
                    let bounds = triangles.bounds;
                    (Surface::Mesh(triangles), bounds)
                }
                Geometry::Sphere { center, radius, .. } => (
                    Surface::Sphere { center: *center, radius: *radius },
                    Bounds { low: *center - *radius, high: *center + *radius },
                ),
            };
            Body { name: &shape.name, surface, bounds }
        })
        .collect();
    let mut doubts = Vec::new();
    for body in &bodies {
        if let Surface::Mesh(triangles) = &body.surface
            && let Some(place) = crosses_itself(triangles).map(rounded)
        {
            doubts.push(format!("\"{}\" is the boundary of a medium but crosses itself, near {place}", body.name));
        }
    }
    // Sorted by their lower ends, so that those that cannot meet are not even compared.
    let mut order: Vec<usize> = (0..bodies.len()).collect();
    order.sort_by(|&a, &b| bodies[a].bounds.low.x.total_cmp(&bodies[b].bounds.low.x).then(a.cmp(&b)));
    let mut pairs = Vec::new();
    for (at, &a) in order.iter().enumerate() {
        let behind = order[at + 1..].iter().take_while(|b| bodies[**b].bounds.low.x <= bodies[a].bounds.high.x);
        pairs.extend(behind.filter(|b| bodies[a].bounds.meets(&bodies[**b].bounds)).map(|&b| (a.min(b), a.max(b))));
    }
    pairs.sort_unstable();
    doubts.extend(pairs.into_iter().filter_map(|(a, b)| {
        let place = rounded(cross(&bodies[a], &bodies[b])?);
        Some(format!(
            "the boundaries \"{}\" and \"{}\" cross each other, near {place}: where they overlap no medium is defined",
            bodies[a].name, bodies[b].name
        ))
    }));
    doubts
}

/// A place with as many digits as people need.
fn rounded(place: DVec3) -> DVec3 {
    let digits = |value: f64| format!("{value:.5e}").parse().unwrap_or(value);
    DVec3::new(digits(place.x), digits(place.y), digits(place.z))
}

fn tolerance(a: &Bounds, b: &Bounds) -> f64 {
    let largest = [a.low, a.high, b.low, b.high].into_iter().fold(0.0, |most: f64, p| most.max(p.abs().max_element()));
    (TOLERANCE * a.extent().min(b.extent())).max(ROUNDING * largest)
}

/// A place where two boundaries cross.
fn cross(a: &Body, b: &Body) -> Option<DVec3> {
    let tolerance = tolerance(&a.bounds, &b.bounds);
    match (&a.surface, &b.surface) {
        (Surface::Sphere { center: p, radius: r }, Surface::Sphere { center: q, radius: s }) => {
            let distance = p.distance(*q);
            let crossing = distance > (r - s).abs() + tolerance && distance < r + s - tolerance;
            // On the line of the centres, where the other sphere enters this one.
            crossing.then(|| *p + (*q - *p) / distance * (distance - s).max(-*r).min(*r))
        }
        (Surface::Sphere { center, radius }, Surface::Mesh(mesh))
        | (Surface::Mesh(mesh), Surface::Sphere { center, radius }) => {
            sphere_crosses(mesh, *center, *radius, tolerance)
        }
        (Surface::Mesh(a), Surface::Mesh(b)) => {
            // The smaller one asks, the larger one answers.
            let (few, many) = if a.corners.len() <= b.corners.len() { (a, b) } else { (b, a) };
            meshes_cross(few, many, tolerance).or_else(|| overlap(few, many, tolerance))
        }
    }
}

/// A triangle with points on both sides of a sphere.
fn sphere_crosses(mesh: &Triangles, center: DVec3, radius: f64, tolerance: f64) -> Option<DVec3> {
    let mut found = None;
    mesh.near(&Bounds { low: center - radius, high: center + radius }, |index| {
        let triangle = &mesh.corners[index];
        let close = nearest(center, triangle);
        let outside = triangle.iter().find(|corner| corner.distance(center) > radius + tolerance);
        if let Some(&far) = outside
            && close.distance(center) < radius - tolerance
        {
            // Where the way from the nearest to the far point leaves the sphere.
            let (start, way) = (close - center, far - close);
            let (a, half_b, c) = (way.length_squared(), start.dot(way), start.length_squared() - radius * radius);
            found = Some(close + way * ((half_b * half_b - a * c).max(0.0).sqrt() - half_b) / a);
        }
        found.is_some()
    });
    found
}

/// Where an edge of one mesh goes through a triangle of the other: in the order of the triangles of the first.
fn meshes_cross(few: &Triangles, many: &Triangles, tolerance: f64) -> Option<DVec3> {
    (0..few.corners.len()).into_par_iter().find_map_first(|i| {
        let corners = &few.corners[i];
        let mut found = None;
        many.near(&Bounds::of(*corners).grown(tolerance), |j| {
            let other = (&many.corners[j], many.normals[j]);
            if let Meeting::Crossing(place) = meeting((corners, few.normals[i]), other, tolerance) {
                found = Some(place);
            }
            found.is_some()
        });
        found
    })
}

/// Where two triangles of a mesh that have no corner in common cross.
fn crosses_itself(mesh: &Triangles) -> Option<DVec3> {
    let tolerance = tolerance(&mesh.bounds, &mesh.bounds);
    (0..mesh.corners.len()).into_par_iter().find_map_first(|i| {
        let corners = &mesh.corners[i];
        let mut found = None;
        mesh.near(&Bounds::of(*corners), |j| {
            let neighbours = || mesh.corners[j].iter().any(|corner| corners.contains(corner));
            if i < j
                && let Meeting::Crossing(place) =
                    meeting((corners, mesh.normals[i]), (&mesh.corners[j], mesh.normals[j]), tolerance)
                && !neighbours()
            {
                found = Some(place);
            }
            found.is_some()
        });
        found
    })
}

/// Where a mesh lies partly inside and partly outside of another that it only touches.
fn overlap(a: &Triangles, b: &Triangles, tolerance: f64) -> Option<DVec3> {
    let touching: Vec<(usize, usize)> = (0..a.corners.len())
        .into_par_iter()
        .flat_map_iter(|i| {
            let mut found = Vec::new();
            b.near(&Bounds::of(a.corners[i]).grown(tolerance), |j| {
                let meeting = meeting((&a.corners[i], a.normals[i]), (&b.corners[j], b.normals[j]), tolerance);
                if meeting == Meeting::Touching {
                    found.push((i, j));
                }
                false
            });
            found
        })
        .collect();
    let stride = (4 * touching.len()).div_ceil(PROBES).max(1);
    let some = || touching.iter().step_by(stride);
    partly_inside(b, some().flat_map(|&(i, _)| probes(&a.corners[i])), tolerance)
        .or_else(|| partly_inside(a, some().flat_map(|&(_, j)| probes(&b.corners[j])), tolerance))
}

/// The middle of a triangle, and points near its corners.
fn probes(triangle: &[DVec3; 3]) -> [DVec3; 4] {
    let [a, b, c] = *triangle;
    let middle = (a + b + c) / 3.0;
    [middle, a.lerp(middle, 0.01), b.lerp(middle, 0.01), c.lerp(middle, 0.01)]
}

/// One of the points that lie well inside of a mesh, if others lie well outside.
fn partly_inside(mesh: &Triangles, points: impl Iterator<Item = DVec3>, tolerance: f64) -> Option<DVec3> {
    let (mut inside, mut outside) = (None, false);
    for point in points {
        if mesh.is_near(point, 4.0 * tolerance) {
            continue;
        }
        let winding = mesh.corners.iter().map(|triangle| super::solid_angle(triangle, point)).sum::<f64>();
        // Full turns, in either direction. What is neither is near a hole.
        let turns = winding.abs() / (4.0 * std::f64::consts::PI);
        if turns > 0.75 {
            inside = Some(point);
        }
        outside |= turns < 0.25;
        if inside.is_some() && outside {
            return inside;
        }
    }
    None
}
