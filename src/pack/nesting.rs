//! Which medium is where: found by geometry, so that a scene need not say it.
//!
//! A boundary without an `exterior` gets the medium that encloses it, and the camera the medium that it stands in. What a
//! closed surface encloses is decided by the generalised winding number (Jacobson, Kavan and Sorkine-Hornung 2013): the
//! solid angle under which the surface is seen, over 4π, which needs no ray and is exact for closed meshes.

use super::frame::Bounds;
use crate::scene::{Geometry, Lens, MediumId, Mesh, Scene, Shape};
use glam::{DVec2, DVec3};

/// The media that geometry decides.
#[derive(Clone, Debug, PartialEq)]
pub struct Nesting {
    /// For each shape that is a boundary: the medium outside.
    pub exteriors: Vec<Option<MediumId>>,
    /// The medium outside of all boundaries.
    pub world: Option<MediumId>,
    /// The medium at the camera.
    pub camera: Option<MediumId>,
    /// A shape whose surface rays from a lens or a rectangle begin on both sides of, so that there is no one medium at the camera.
    pub straddled: Option<usize>,
    /// What contradicts itself, for people.
    pub warnings: Vec<String>,
}

/// Triangles of a shape that are asked for what lies outside of them.
const PROBES: usize = 9;

impl Nesting {
    /// Finds all of it.
    pub fn of(scene: &Scene) -> Nesting {
        let enclosures: Vec<Enclosure> = scene.shapes.iter().enumerate().filter_map(Enclosure::of).collect();
        // Rays begin on the near plane, and so does the medium.
        let forward = scene.camera.to_world.z_axis.truncate().normalize();
        let eye = scene.camera.to_world.w_axis.truncate() + forward * scene.camera.near_clip;
        let mut warnings = Vec::new();

        let around_camera = innermost(&enclosures, eye, |_| true);
        // A medium named by the camera fills the space outside of all boundaries, unless the camera stands inside of one:
        // then the name only repeats what that boundary says.
        let world = if around_camera.is_some() { None } else { scene.camera.medium };
        let camera = around_camera.map_or(world, |enclosure| enclosure.interior);
        if let Some(enclosure) = around_camera
            && scene.camera.medium.is_some()
            && scene.camera.medium != enclosure.interior
        {
            warnings.push(format!(
                "the sensor names {}, but it stands inside \"{}\", which is filled with {}; the latter is used",
                medium_name(scene, scene.camera.medium),
                scene.shapes[enclosure.shape].name,
                medium_name(scene, enclosure.interior)
            ));
        }

        let mut exteriors = vec![None; scene.shapes.len()];
        for (index, shape) in scene.shapes.iter().enumerate() {
            let Some(boundary) = shape.boundary else { continue };
            if boundary.exterior.is_some() {
                exteriors[index] = boundary.exterior;
                continue;
            }
            let mut votes: Vec<(Option<MediumId>, usize)> = Vec::new();
            let own = volume(&shape.geometry);
            for probe in probes(&shape.geometry) {
                let around = |enclosure: &Enclosure| enclosure.is_around(index, own);
                let medium = innermost(&enclosures, probe, around).map_or(world, |enclosure| enclosure.interior);
                match votes.iter_mut().find(|(candidate, _)| *candidate == medium) {
                    Some((_, count)) => *count += 1,
                    None => votes.push((medium, 1)),
                }
            }
            votes.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
            if votes.len() > 1 {
                let names: Vec<String> = votes.iter().map(|(medium, _)| medium_name(scene, *medium)).collect();
                warnings.push(format!(
                    "\"{}\" lies partly in {}: boundaries that overlap have no defined medium; {} is taken as its exterior",
                    shape.name,
                    names.join(" and partly in "),
                    names[0]
                ));
            }
            exteriors[index] = votes.first().and_then(|(medium, _)| *medium);
        }
        Nesting { exteriors, world, camera, straddled: straddled(scene), warnings }
    }
}

/// The first boundary that cuts the part of the near plane on which the rays of a camera with a lens, or without a centre, begin. A
/// triangle is taken for the rectangle about its cut, so that some are found that only come near.
fn straddled(scene: &Scene) -> Option<usize> {
    let (camera, film) = (&scene.camera, &scene.film);
    let (half_width, half_height, blur) = match camera.lens {
        Lens::Pinhole => return None,
        Lens::Thin { aperture_radius, focus_distance } => {
            let half_width = camera.near_clip * (camera.fov_x.to_radians() / 2.0).tan();
            let half_height = half_width * f64::from(film.height) / f64::from(film.width);
            (half_width, half_height, aperture_radius * (1.0 - camera.near_clip / focus_distance).abs())
        }
        Lens::Orthographic { half_width, half_height } => (half_width, half_height, 0.0),
    };
    // Samples lie beyond the edges of the film by no more than the filter's radius.
    let beyond = 2.0 * half_width / f64::from(film.width) * film.filter.radius() + blur;
    let center = -2.0 * camera.principal_point_offset * DVec2::new(half_width, half_height);
    let half = DVec2::new(half_width, half_height) + beyond;
    let (low, high) = (center - half, center + half);
    let to_camera = camera.to_world.inverse();
    // A uniform scale of the camera is of no account to its clip planes.
    let scale = camera.to_world.z_axis.truncate().length();
    let place = |point: DVec3| {
        let point = to_camera.transform_point3(point) * scale;
        (point.truncate(), point.z - camera.near_clip)
    };
    let overlaps = |points: &[DVec2]| {
        let least = points.iter().copied().reduce(DVec2::min).expect("a cut has points");
        let most = points.iter().copied().reduce(DVec2::max).expect("a cut has points");
        least.cmple(high).all() && most.cmpge(low).all()
    };
    scene.shapes.iter().position(|shape| {
        shape.boundary.is_some()
            && match &shape.geometry {
                Geometry::Sphere { center, radius, .. } => {
                    let (middle, depth) = place(*center);
                    let cut = (radius * radius - depth * depth).max(0.0).sqrt();
                    let corners = [low, high, DVec2::new(low.x, high.y), DVec2::new(high.x, low.y)];
                    let inside = corners.iter().all(|corner| corner.distance(middle) < cut);
                    cut > 0.0 && !inside && overlaps(&[middle - cut, middle + cut])
                }
                Geometry::Mesh(mesh) => mesh.triangles.iter().any(|triangle| {
                    let corners = triangle.map(|corner| place(mesh.positions[corner as usize]));
                    let cuts: Vec<DVec2> = [(0, 1), (1, 2), (2, 0)]
                        .into_iter()
                        .filter(|&(i, j)| (corners[i].1 >= 0.0) != (corners[j].1 >= 0.0))
                        .map(|(i, j)| corners[i].0.lerp(corners[j].0, corners[i].1 / (corners[i].1 - corners[j].1)))
                        .collect();
                    !cuts.is_empty() && overlaps(&cuts)
                }),
            }
    })
}

fn medium_name(scene: &Scene, medium: Option<MediumId>) -> String {
    match medium {
        Some(MediumId(index)) => format!("the medium \"{}\"", scene.media[index as usize].name),
        None => "vacuum".to_owned(),
    }
}

/// A boundary seen as a region of space.
struct Enclosure<'a> {
    shape: usize,
    geometry: &'a Geometry,
    bounds: Bounds,
    interior: Option<MediumId>,
    volume: f64,
}

impl<'a> Enclosure<'a> {
    fn of((shape, value): (usize, &'a Shape)) -> Option<Enclosure<'a>> {
        let boundary = value.boundary?;
        Some(Enclosure {
            shape,
            geometry: &value.geometry,
            bounds: Bounds::of(&value.geometry),
            interior: boundary.interior,
            volume: volume(&value.geometry),
        })
    }

    /// Whether it can enclose another shape, of a volume: it is larger. Of two that are the same, the first encloses the second.
    fn is_around(&self, shape: usize, volume: f64) -> bool {
        self.shape != shape
            && (self.volume.abs() > volume.abs() || (self.volume.abs() == volume.abs() && self.shape < shape))
    }

    fn contains(&self, point: DVec3) -> bool {
        self.bounds.contains(point) && winding_number(self.geometry, point).abs() > 0.5
    }
}

/// The smallest region that holds a point, among some. Regions that hold the same point are nested, so the smallest is the
/// innermost.
fn innermost<'a, 'b>(
    enclosures: &'b [Enclosure<'a>],
    point: DVec3,
    among: impl Fn(&Enclosure) -> bool,
) -> Option<&'b Enclosure<'a>> {
    enclosures
        .iter()
        .filter(|enclosure| among(enclosure) && enclosure.contains(point))
        .min_by(|a, b| a.volume.abs().total_cmp(&b.volume.abs()))
}

/// Points next to a surface, on the side where what is around it can be asked for: just inside, so that faces which it shares with
/// what encloses it do not count as outside of that; or just outside of a surface that is inside out.
fn probes(geometry: &Geometry) -> Vec<DVec3> {
    match geometry {
        Geometry::Sphere { center, radius, .. } => [DVec3::X, DVec3::Y, DVec3::Z]
            .iter()
            .flat_map(|axis| [*center + *axis * radius * (1.0 - 1e-6), *center - *axis * radius * (1.0 - 1e-6)])
            .collect(),
        Geometry::Mesh(mesh) => {
            let stride = mesh.triangles.len().div_ceil(PROBES).max(1);
            mesh.triangles.iter().step_by(stride).map(|triangle| inside_of(mesh, triangle)).collect()
        }
    }
}

/// Volume within a closed surface (by Gauss's theorem); negative if it is inside out.
pub fn volume(geometry: &Geometry) -> f64 {
    match geometry {
        Geometry::Sphere { radius, flipped, .. } => {
            4.0 / 3.0 * std::f64::consts::PI * radius.powi(3) * if *flipped { -1.0 } else { 1.0 }
        }
        Geometry::Mesh(mesh) => {
            let Some(&origin) = mesh.positions.first() else { return 0.0 };
            let six_fold = |triangle: &[u32; 3]| {
                let [a, b, c] = triangle.map(|corner| mesh.positions[corner as usize] - origin);
                a.dot(b.cross(c))
            };
            mesh.triangles.iter().map(six_fold).sum::<f64>() / 6.0
        }
    }
}

fn inside_of(mesh: &Mesh, triangle: &[u32; 3]) -> DVec3 {
    let [a, b, c] = triangle.map(|corner| mesh.positions[corner as usize]);
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let size = (b - a).length().max((c - a).length());
    (a + b + c) / 3.0 - normal * size * 1e-6
}

/// How often a surface winds about a point: 1 inside of a closed surface, −1 if it is inside out, 0 outside.
pub fn winding_number(geometry: &Geometry, point: DVec3) -> f64 {
    match geometry {
        Geometry::Sphere { center, radius, flipped } => {
            let inside = point.distance(*center) < *radius;
            f64::from(u8::from(inside)) * if *flipped { -1.0 } else { 1.0 }
        }
        Geometry::Mesh(mesh) => {
            let total: f64 = mesh.triangles.iter().map(|triangle| solid_angle(mesh, triangle, point)).sum();
            total / (4.0 * std::f64::consts::PI)
        }
    }
}

/// Signed solid angle of a triangle (van Oosterom and Strackee 1983).
fn solid_angle(mesh: &Mesh, triangle: &[u32; 3], point: DVec3) -> f64 {
    let [a, b, c] = triangle.map(|corner| mesh.positions[corner as usize] - point);
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    2.0 * a.dot(b.cross(c)).atan2(denominator)
}
