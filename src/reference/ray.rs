//! Mirror of `shaders/lib/ray.glsl`: rays against primitives.

use super::math::orthonormal_frame;
use glam::{DVec2, DVec3};

/// A ray with the frame in which triangles are seen along it.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Where it begins.
    pub origin: DVec3,
    /// Unit.
    pub direction: DVec3,
    /// First axis of the frame.
    pub tangent: DVec3,
    /// Second axis of the frame.
    pub bitangent: DVec3,
}

impl Ray {
    /// The ray with the frame about its direction.
    pub fn new(origin: DVec3, direction: DVec3) -> Ray {
        let (tangent, bitangent) = orthonormal_frame(direction);
        Ray { origin, direction, tangent, bitangent }
    }
}

/// A hit on a plane figure.
#[derive(Clone, Copy, Debug)]
pub struct TriangleHit {
    /// Whether there is one; otherwise the rest means nothing.
    pub hit: bool,
    /// The ray goes along the normal (leaves) and not against it.
    pub along_normal: bool,
    /// Distance.
    pub t: f64,
    /// Barycentric coordinates of the second and third corner.
    pub barycentric: DVec2,
}

/// Whether a point lies to the left of a directed edge; points on the line belong to one side by the edge's direction
/// alone.
pub fn left_of(cross_product: f64, edge: DVec2) -> bool {
    let upward = edge.y > 0.0 || (edge.y == 0.0 && edge.x > 0.0);
    cross_product > 0.0 || (cross_product == 0.0 && upward)
}

/// Watertight test (Woop, Benthin and Wald 2013, with an orthonormal frame for their shear).
pub fn intersect_triangle(ray: &Ray, a: DVec3, b: DVec3, c: DVec3) -> TriangleHit {
    let (ra, rb, rc) = (a - ray.origin, b - ray.origin, c - ray.origin);
    let pa = DVec2::new(ray.tangent.dot(ra), ray.bitangent.dot(ra));
    let pb = DVec2::new(ray.tangent.dot(rb), ray.bitangent.dot(rb));
    let pc = DVec2::new(ray.tangent.dot(rc), ray.bitangent.dot(rc));
    let u = pb.x * pc.y - pb.y * pc.x;
    let v = pc.x * pa.y - pc.y * pa.x;
    let w = pa.x * pb.y - pa.y * pb.x;
    let (su, sv, sw) = (left_of(u, pc - pb), left_of(v, pa - pc), left_of(w, pb - pa));
    let determinant = u + v + w;
    let inverse = 1.0 / determinant;
    TriangleHit {
        barycentric: DVec2::new(v, w) * inverse,
        t: (u * ray.direction.dot(ra) + v * ray.direction.dot(rb) + w * ray.direction.dot(rc)) * inverse,
        along_normal: determinant > 0.0,
        hit: su == sv && sv == sw && determinant != 0.0,
    }
}

/// Distances to the two points of a sphere on the line of a ray; far < near if there are none (Haines et al. 2019).
pub fn intersect_sphere(ray: &Ray, center: DVec3, radius: f64) -> DVec2 {
    let offset = ray.origin - center;
    let along = offset.dot(ray.direction);
    let closest = offset - along * ray.direction;
    let discriminant = radius * radius - closest.dot(closest);
    if discriminant < 0.0 {
        return DVec2::new(1.0, -1.0);
    }
    let half_chord = discriminant.sqrt();
    DVec2::new(-along - half_chord, -along + half_chord)
}

/// How far a ray that leaves a surface begins from it. The reference has no such need in double precision; it keeps the
/// offset so that its paths are those of the kernel.
pub fn offset_distance(largest_coordinate: f64) -> f64 {
    4e-7 * largest_coordinate
}

/// How far from a surface a vertex in a medium is kept: one rounding of the largest coordinate.
pub fn vertex_clearance(largest_coordinate: f64) -> f64 {
    1.2e-7 * largest_coordinate
}
