//! Disks and cylinders as many flat faces, which have the area of the circle that they stand for.

use std::f64::consts::TAU;

use glam::{DMat4, DVec2, DVec3};

use crate::scene::Mesh;

/// Corners of a circle.
pub const SEGMENTS: u32 = 256;

/// Direction number `k` of a circle.
fn direction(k: u32) -> DVec2 {
    // The last is the first, to the bit: surfaces close.
    DVec2::from_angle(TAU * f64::from(k % SEGMENTS) / f64::from(SEGMENTS))
}

/// Radius of a regular polygon with the area of the unit circle: its area is n/2 sin(2π/n) r². It is 5e-5 larger than 1.
fn corner_radius() -> f64 {
    let angle = TAU / f64::from(SEGMENTS);
    (angle / angle.sin()).sqrt()
}

/// The unit disk in the xy plane, whose normal is +z; a polygon with the same area. Texture coordinates are the distance from
/// the centre and the angle from +x over 2π.
pub fn disk() -> Mesh {
    let mut mesh = Mesh::default();
    for k in 0..=SEGMENTS {
        let v = f64::from(k) / f64::from(SEGMENTS);
        // The centre has no angle; each face has one of its own, with the angle of its middle.
        mesh.positions.extend([(direction(k) * corner_radius()).extend(0.0), DVec3::ZERO]);
        mesh.uvs.extend([DVec2::new(1.0, v), DVec2::new(0.0, v + 0.5 / f64::from(SEGMENTS))]);
    }
    mesh.triangles = (0..SEGMENTS).map(|k| [2 * k + 1, 2 * k, 2 * k + 2]).collect();
    mesh
}

/// The side of a cylinder from `p0` to `p1` (different points), without its ends, with normals outwards; a prism with the same volume,
/// whose area is 2.5e-5 larger. Vertex normals are those of the cylinder. Texture coordinates are the angle over 2π and the
/// fraction of the way from `p0`.
pub fn cylinder(p0: DVec3, p1: DVec3, radius: f64) -> Mesh {
    let axis = p1 - p0;
    let (x, y) = frame(axis.normalize());
    let place = DMat4::from_cols((x * radius).extend(0.0), (y * radius).extend(0.0), axis.extend(0.0), p0.extend(1.0));
    let mut mesh = Mesh::default();
    for k in 0..=SEGMENTS {
        let (around, u) = (direction(k), f64::from(k) / f64::from(SEGMENTS));
        for height in [0.0, 1.0] {
            mesh.positions.push(place.transform_point3((around * corner_radius()).extend(height)));
            mesh.normals.push(x * around.x + y * around.y);
            mesh.uvs.push(DVec2::new(u, height));
        }
    }
    mesh.triangles = (0..SEGMENTS)
        .flat_map(|k| {
            let [a, b, c, d] = [2 * k, 2 * k + 2, 2 * k + 3, 2 * k + 1];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    mesh
}

/// Two directions that make a right-handed frame with `z`, as Mitsuba's cylinders have it: Duff et al., "Building an
/// Orthonormal Basis, Revisited" (JCGT 6(1), 2017).
fn frame(z: DVec3) -> (DVec3, DVec3) {
    let sign = 1f64.copysign(z.z);
    let a = -1.0 / (sign + z.z);
    let b = z.x * z.y * a;
    (DVec3::new(1.0 + sign * z.x * z.x * a, sign * b, -sign * z.x), DVec3::new(b, sign + z.y * z.y * a, -z.y))
}
