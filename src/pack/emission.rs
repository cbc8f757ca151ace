//! What media emit: their radiance per length, and how it is best counted.

use super::PackError;
use super::frame::{Bounds, Frame};
use super::nesting::volume;
use crate::scene::{Geometry, MediumId, Scene};
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

/// `emission` and `collision_share` of a medium's entry in the table. `endless`: it fills the space outside of all boundaries.
///
/// Of the emission along a flight, the share w is counted where the flight ends in the medium, as 1/σ, and the rest along the way.
/// Both alone are unbiased, and they are correlated negatively: a flight that gets far tends to leave. For a way of optical depth
/// τ the variance of their sum is least for
///
///   w = (1 − (1 + τ) exp(−τ)) / (1 − exp(−τ)),
///
/// which follows from E\[min(s, τ)²\] = 2 (1 − (1 + τ) exp(−τ)) and E\[s; s < τ\] = half of that for an exponential s. A seventh of
/// the variance of the way alone is left at τ = 1, and nothing where τ is large. How far it is to the boundary is not known when
/// a flight ends before, so τ is that of the mean chord of the medium.
pub fn pack(scene: &Scene, frame: &Frame, id: MediumId, endless: bool) -> Result<(Vec3, f32), PackError> {
    let medium = &scene.media[id.0 as usize];
    if medium.emission == DVec3::ZERO {
        return Ok((Vec3::ZERO, 0.0));
    }
    let emission = frame.per_length(medium.emission);
    if !emission.is_finite() {
        let value = (medium.emission / frame.scale).max_element();
        return Err(PackError::OutOfRange { what: "emission", name: medium.name.clone(), value });
    }
    if medium.volumes.sigma_t.is_some() || medium.volumes.emission.is_some() {
        // Voxels end with their box, and are counted along the way alone.
        return Ok((emission, 0.0));
    }
    if endless && (medium.sigma_t.cmple(DVec3::ZERO) & medium.emission.cmpgt(DVec3::ZERO)).any() {
        return Err(PackError::EndlessEmission(medium.name.clone()));
    }
    let chord = if endless { 2.0 * frame.radius / frame.scale } else { mean_chord(scene, id) };
    Ok((emission, collision_share(medium.sigma_t.element_sum() / 3.0 * chord) as f32))
}

/// The share w of the documentation above, without cancellation for small τ.
fn collision_share(tau: f64) -> f64 {
    if tau < 1e-3 { tau / 2.0 } else { 1.0 + tau * (-tau).exp() / (-tau).exp_m1() }
}

/// Mean length of a chord of what a medium fills, 4 V/A (Cauchy 1841), in scene units.
fn mean_chord(scene: &Scene, id: MediumId) -> f64 {
    let volume: f64 = scene.filled_with(id).map(|shape| volume(&shape.geometry).abs()).sum();
    let area: f64 = scene.filled_with(id).map(|shape| area(&shape.geometry)).sum();
    if area > 0.0 { 4.0 * volume / area } else { 0.0 }
}

/// The sphere about what an emitting medium fills, and its volume, in canonical units.
#[derive(Clone, Copy, Debug)]
pub struct EmittingVolume {
    /// Of the sphere.
    pub center: Vec3,
    /// Of the sphere; all of the medium is inside.
    pub radius: f32,
    /// Of the medium itself, without what is nested in it.
    pub volume: f64,
}

/// The volume of an emitting medium; `None` if it does not emit, or is not the interior of any shape.
pub fn enclosing_volume(scene: &Scene, frame: &Frame, id: MediumId) -> Option<EmittingVolume> {
    let filled = || scene.filled_with(id);
    let volumes = &scene.media[id.0 as usize].volumes;
    if volumes.sigma_t.is_some() || volumes.emission.is_some() {
        // Light sampling has one density for all points of a homogeneous medium.
        return None;
    }
    if scene.media[id.0 as usize].emission == DVec3::ZERO || filled().next().is_none() {
        return None;
    }
    let bounds = filled().fold(Bounds::EMPTY, |bounds, shape| bounds.union(Bounds::of(&shape.geometry)));
    if bounds.is_empty() {
        return None;
    }
    let center = (bounds.min + bounds.max) / 2.0;
    let reach = |geometry: &Geometry| match geometry {
        Geometry::Sphere { center: other, radius, .. } => center.distance(*other) + radius,
        Geometry::Mesh(mesh) => {
            let corners = mesh.triangles.iter().flatten().map(|corner| mesh.positions[*corner as usize]);
            corners.map(|corner| corner.distance(center)).fold(0.0, f64::max)
        }
    };
    let radius = filled().map(|shape| reach(&shape.geometry)).fold(0.0, f64::max);
    let volume = filled().map(|shape| volume(&shape.geometry).abs()).sum::<f64>() * frame.scale.powi(3);
    // A little larger, so that rounding leaves nothing outside.
    Some(EmittingVolume { center: frame.point(center), radius: frame.length(radius * 1.00001), volume })
}

/// Area of a surface.
fn area(geometry: &Geometry) -> f64 {
    match geometry {
        Geometry::Sphere { radius, .. } => 4.0 * PI * radius.powi(2),
        Geometry::Mesh(mesh) => {
            let doubled = mesh.triangles.iter().map(|triangle| {
                let [a, b, c] = triangle.map(|corner| mesh.positions[corner as usize]);
                (b - a).cross(c - a).length()
            });
            doubled.sum::<f64>() / 2.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_share_is_the_best_one() {
        // The variance of w 1[s < τ] + (1 − w) min(s, τ), by midpoints over the distribution function of s.
        let variance = |tau: f64, share: f64| {
            let count = 20_000;
            let values = (0..count).map(|k| -(1.0 - (f64::from(k) + 0.5) / f64::from(count)).ln());
            let values = values.map(|s| share * f64::from(u8::from(s < tau)) + (1.0 - share) * s.min(tau));
            let (sum, squares) = values.fold((0.0, 0.0), |(sum, squares), x| (sum + x, squares + x * x));
            squares / f64::from(count) - (sum / f64::from(count)).powi(2)
        };
        for tau in [1e-2, 0.3, 1.0, 4.0] {
            let best = collision_share(tau);
            let least = variance(tau, best);
            assert!(least < variance(tau, best - 0.05) && least < variance(tau, best + 0.05), "{tau}: {best}");
        }
        assert!((variance(1.0, 0.0) / variance(1.0, collision_share(1.0)) - 7.0).abs() < 0.2);
        assert!((collision_share(0.999e-3) - collision_share(1.001e-3)).abs() < 2e-6);
        assert_eq!((collision_share(0.0), collision_share(1e30)), (0.0, 1.0));
    }

    #[test]
    fn chords_of_a_cube() {
        let side = |k: usize, bit: usize| (k >> bit & 1) as f64 * 3.0;
        let positions = (0..8).map(|k| DVec3::new(side(k, 0), side(k, 1), side(k, 2)) + DVec3::splat(5.0)).collect();
        let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let triangles = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
        let mesh = crate::scene::Mesh { positions, triangles, ..Default::default() };
        let cube = Geometry::Mesh(mesh);
        let (volume, area) = (volume(&cube), area(&cube));
        assert!((volume - 27.0).abs() < 1e-9 && (area - 54.0).abs() < 1e-9, "{volume}, {area}");
    }
}
