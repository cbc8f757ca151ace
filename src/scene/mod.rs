//! What is to be rendered: a plain description in double precision, in world space, free of any GPU type.
//!
//! A [`Scene`] comes from a Mitsuba 3 file ([`mitsuba::load`]) or is built in Rust field by field:
//!
//! ```
//! use tyndall::scene::*;
//! use glam::DVec3;
//! let mut scene = Scene::new(Camera::look_at(DVec3::new(0.0, 0.0, 4.0), DVec3::ZERO, DVec3::Y, 40.0), Film::new(64, 64));
//! let haze = scene.add_medium(Medium::new("haze", DVec3::splat(0.5), DVec3::splat(0.9), Phase::HenyeyGreenstein { g: 0.6 }));
//! scene.shapes.push(Shape::boundary("ball", Geometry::Sphere { center: DVec3::ZERO, radius: 1.0, flipped: false }, haze));
//! scene.lights.push(Light::Constant { radiance: DVec3::ONE });
//! ```
//!
//! Units: lengths in scene units, `sigma_*` in 1/scene unit, radiance in W/(m² sr) for each of the three linear sRGB
//! channels, intensity in W/sr, irradiance in W/m². Angles are in degrees where a scene file has them in degrees.

use std::sync::Arc;

use glam::{DMat3, DMat4, DVec2, DVec3};

pub mod bitmap;
mod bitmap_formats;
mod bsdf;
pub mod check;
mod error;
mod filter;
pub mod mesh;
pub mod mitsuba;
mod output;
mod phase;
mod principled;
pub mod spectrum;
mod texture;
mod vdb;
pub mod volume;
mod volume_formats;

pub use bitmap::Bitmap;
pub use bsdf::{Bsdf, Distribution, Relief, ReliefMap, Roughness};
pub use error::SceneError;
pub use filter::ReconstructionFilter;
pub use output::{Aov, AovKind, Colors, PixelFormat};
pub use phase::Phase;
pub use principled::Principled;
pub use texture::{Filter, Texture, Wrap};
pub use volume::{Grid, GridVolume, HeightVolume, Volume, Volumes};
pub use volume_formats::GridFile;

/// Index of a medium in [`Scene::media`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MediumId(pub u32);

/// Everything that is needed to render one picture.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Where the picture is taken from.
    pub camera: Camera,
    /// Size of the picture, and the part of it to render.
    pub film: Film,
    /// How long paths may get.
    pub integrator: Integrator,
    /// Surfaces: walls, lamps, and boundaries of media.
    pub shapes: Vec<Shape>,
    /// Media, named by shapes and by the camera through their [`MediumId`].
    pub media: Vec<Medium>,
    /// Light sources that are not shapes.
    pub lights: Vec<Light>,
    /// Channels that are written beside the radiance.
    pub aovs: Vec<Aov>,
    /// Name of the channels with second moments of the samples, if these are asked for.
    pub moments: Option<String>,
    /// Samples a pixel that the scene asks for; the command line may ask for others.
    pub sample_count: u32,
}

impl Scene {
    /// A scene with a camera and a film and nothing else.
    pub fn new(camera: Camera, film: Film) -> Self {
        Scene {
            camera,
            film,
            integrator: Integrator::default(),
            shapes: Vec::new(),
            media: Vec::new(),
            lights: Vec::new(),
            aovs: Vec::new(),
            moments: None,
            sample_count: 16,
        }
    }

    /// Adds a medium and returns the name by which shapes refer to it.
    pub fn add_medium(&mut self, medium: Medium) -> MediumId {
        self.media.push(medium);
        MediumId(self.media.len() as u32 - 1)
    }

    /// The boundaries whose interior is a medium.
    pub fn filled_with(&self, medium: MediumId) -> impl Iterator<Item = &Shape> {
        self.shapes.iter().filter(move |shape| shape.boundary.is_some_and(|both| both.interior == Some(medium)))
    }
}

/// How rays leave a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lens {
    /// All through one point.
    Pinhole,
    /// From a disk about that point, so that what is not at one distance is blurred.
    Thin {
        /// Radius of the disk, scene units, > 0.
        aperture_radius: f64,
        /// Distance of the plane in focus from the camera along the optical axis, scene units, > 0.
        focus_distance: f64,
    },
    /// All in the same direction, from a rectangle. The camera's field of view has no meaning.
    Orthographic {
        /// Half the width of the rectangle that the whole film sees, scene units.
        half_width: f64,
        /// Half its height, scene units.
        half_height: f64,
    },
}

/// A camera with Mitsuba's conventions: camera space looks along +z, with +y up and +x to the *left*.
#[derive(Clone, Debug)]
pub struct Camera {
    /// Camera space to world space, a rigid motion (a uniform scale is tolerated; it does not change the picture).
    pub to_world: DMat4,
    /// Horizontal field of view of the *whole* film, in degrees, in (0, 180).
    pub fov_x: f64,
    /// Nothing nearer than this plane is seen; rays (and so media) begin there. Scene units.
    pub near_clip: f64,
    /// Surfaces beyond this plane are not seen by camera rays. Scene units.
    pub far_clip: f64,
    /// Shift of the principal point, as a fraction of the film's size.
    pub principal_point_offset: DVec2,
    /// How rays leave the camera.
    pub lens: Lens,
    /// The scene-wide medium: what fills the space that no boundary encloses. `None` is vacuum.
    pub medium: Option<MediumId>,
}

impl Camera {
    /// A camera at `origin` that looks at `target`, with a horizontal field of view of `fov_x` degrees, in vacuum.
    pub fn look_at(origin: DVec3, target: DVec3, up: DVec3, fov_x: f64) -> Self {
        Camera {
            to_world: look_at(origin, target, up),
            fov_x,
            near_clip: 1e-2,
            far_clip: 1e4,
            principal_point_offset: DVec2::ZERO,
            lens: Lens::Pinhole,
            medium: None,
        }
    }
}

/// The transform that Mitsuba's `<lookat>` stands for: +z to the target, +x to the left, +y up.
pub fn look_at(origin: DVec3, target: DVec3, up: DVec3) -> DMat4 {
    let forward = (target - origin).normalize();
    let left = up.cross(forward).normalize();
    let true_up = forward.cross(left);
    DMat4::from_cols(left.extend(0.0), true_up.extend(0.0), forward.extend(0.0), origin.extend(1.0))
}

/// The film: `width × height` pixels, of which the crop window is rendered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Film {
    /// Pixels in a row of the whole film.
    pub width: u32,
    /// Rows of the whole film.
    pub height: u32,
    /// The part that is rendered and written.
    pub crop: Crop,
    /// How the samples about a pixel make up its value.
    pub filter: ReconstructionFilter,
    /// Where the samples of a filter that is wider than a pixel may lie: at the edges of this part of the film the filter is
    /// cut off, and what is left of it normalised. `None` lets samples lie beyond the edges of the film.
    pub sample_area: Option<Crop>,
    /// How the pixels are written.
    pub pixel_format: PixelFormat,
}

impl Film {
    /// Longest side of a film, in pixels: both coordinates of a pixel fit in 16 bits.
    pub const MAX_SIDE: u32 = 65_535;

    /// Most pixels in a crop window. One block of samples holds 24 bytes a pixel, 6.4 GB at this limit.
    pub const MAX_PIXELS: u64 = 1 << 28;

    /// A film that is rendered whole, with a box filter of one pixel.
    pub fn new(width: u32, height: u32) -> Self {
        let crop = Crop { x: 0, y: 0, width, height };
        Film {
            width,
            height,
            crop,
            filter: ReconstructionFilter::PIXEL,
            sample_area: Some(crop),
            pixel_format: PixelFormat::default(),
        }
    }
}

/// A window of the film in pixels, from the top left corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crop {
    /// First column.
    pub x: u32,
    /// First row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

/// How long paths may get. Depth counts as in Mitsuba 3: 1 is light seen directly, 2 has one bounce or scattering
/// event, and so on. Crossing a boundary without a surface does not count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Integrator {
    /// Longest path; `None` is no limit.
    pub max_depth: Option<u32>,
    /// Depth from which Russian roulette may end a path.
    pub rr_depth: u32,
    /// Emitters are not seen by the camera directly.
    pub hide_emitters: bool,
}

impl Default for Integrator {
    fn default() -> Self {
        Integrator { max_depth: None, rr_depth: 3, hide_emitters: false }
    }
}

/// One surface: a wall, a lamp, or the boundary of a medium, or several of these at once.
#[derive(Clone, Debug)]
pub struct Shape {
    /// For messages: the id in the scene file, or the file of the mesh.
    pub name: String,
    /// Points of the surface, in world space.
    pub geometry: Geometry,
    /// What the surface does to light.
    pub bsdf: Bsdf,
    /// Radiance emitted on the side of the normal; a lamp if not `None`.
    pub emission: Option<DVec3>,
    /// Factor of `emission` that depends on the place, ≥ 0; of meshes with texture coordinates alone.
    pub emission_texture: Option<Texture>,
    /// Of a sphere: its own axes, unit vectors perpendicular to each other, from which its texture coordinates are taken.
    pub axes: DMat3,
    /// `Some` makes the surface a boundary between media.
    pub boundary: Option<Boundary>,
}

impl Shape {
    /// A closed, invisible surface filled with a medium.
    pub fn boundary(name: &str, geometry: Geometry, interior: MediumId) -> Self {
        Shape {
            name: name.to_owned(),
            geometry,
            bsdf: Bsdf::Null,
            emission: None,
            emission_texture: None,
            axes: DMat3::IDENTITY,
            boundary: Some(Boundary { interior: Some(interior), exterior: None }),
        }
    }

    /// A surface that reflects diffusely on both sides.
    pub fn diffuse(name: &str, geometry: Geometry, reflectance: DVec3) -> Self {
        let bsdf = Bsdf::Diffuse { reflectance: reflectance.into(), two_sided: true };
        Shape {
            name: name.to_owned(),
            geometry,
            bsdf,
            emission: None,
            emission_texture: None,
            axes: DMat3::IDENTITY,
            boundary: None,
        }
    }

    /// A black surface that emits `radiance` on the side of its normal.
    pub fn lamp(name: &str, geometry: Geometry, radiance: DVec3) -> Self {
        Shape {
            bsdf: Bsdf::Diffuse { reflectance: DVec3::ZERO.into(), two_sided: false },
            emission: Some(radiance),
            ..Shape::diffuse(name, geometry, DVec3::ZERO)
        }
    }
}

/// The media on the two sides of a boundary. The interior is the side that the normals point away from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Boundary {
    /// Inside; `None` is a hole of vacuum.
    pub interior: Option<MediumId>,
    /// Outside; `None` is whatever encloses the shape, found by geometry.
    pub exterior: Option<MediumId>,
}

/// The points of a surface.
#[derive(Clone, Debug)]
pub enum Geometry {
    /// Triangles.
    Mesh(Mesh),
    /// A sphere; its normals point outwards unless `flipped`. Texture coordinates of the point with the unit outward
    /// direction d, in the [`Shape::axes`]: u = atan2(d.y, d.x) / 2π in \[0, 1), v = acos(d.z) / π.
    Sphere {
        /// Centre, in world space.
        center: DVec3,
        /// Radius, in scene units.
        radius: f64,
        /// Normals point inwards.
        flipped: bool,
    },
}

/// Triangles in world space, counter-clockwise seen from the side that the geometric normal points to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertices. One place may be several vertices, with different normals or texture coordinates.
    pub positions: Vec<DVec3>,
    /// Unit shading normal of each vertex, on the side of the geometric normals; empty if the triangles are flat.
    pub normals: Vec<DVec3>,
    /// Texture coordinates of each vertex, (0, 0) at the upper left of an image; empty if there are none.
    pub uvs: Vec<DVec2>,
    /// Three indices into `positions` (and `normals` and `uvs`) for each triangle.
    pub triangles: Vec<[u32; 3]>,
}

/// A participating medium: homogeneous, unless `volumes` says what depends on the place.
#[derive(Clone, Debug)]
pub struct Medium {
    /// For messages.
    pub name: String,
    /// Extinction coefficient of each channel, 1/scene unit, ≥ 0.
    pub sigma_t: DVec3,
    /// Single-scattering albedo `sigma_s / sigma_t` of each channel, in \[0, 1\].
    pub albedo: DVec3,
    /// Where scattered light goes.
    pub phase: Phase,
    /// Radiance that is added per unit length in every direction, W/(m² sr) per scene unit, ≥ 0. It does not depend on
    /// `sigma_t`: a medium that neither absorbs nor scatters may glow.
    pub emission: DVec3,
    /// Factors of the coefficients that depend on the place.
    pub volumes: Volumes,
}

impl Medium {
    /// A medium from its extinction coefficient and albedo, which does not emit.
    pub fn new(name: &str, sigma_t: DVec3, albedo: DVec3, phase: Phase) -> Self {
        Medium { name: name.to_owned(), sigma_t, albedo, phase, emission: DVec3::ZERO, volumes: Volumes::default() }
    }
}

/// A light source without a surface.
#[derive(Clone, Debug)]
pub enum Light {
    /// Isotropic point source.
    Point {
        /// World space.
        position: DVec3,
        /// Radiant intensity, W/sr.
        intensity: DVec3,
    },
    /// The same radiance from every direction, from infinitely far.
    Constant {
        /// W/(m² sr).
        radiance: DVec3,
    },
    /// A point that emits into a cone. With θ the angle to `direction` the intensity is `intensity` up to `beam_width`, falls
    /// linearly *with the angle* to 0 at `cutoff_angle`, and is 0 beyond: `intensity · (cutoff − θ) / (cutoff − beam)`.
    Spot {
        /// World space.
        position: DVec3,
        /// The axis of the cone, a unit vector from the light into the scene.
        direction: DVec3,
        /// Radiant intensity on the axis, W/sr.
        intensity: DVec3,
        /// Half the opening angle of the cone, degrees, in (0, 180].
        cutoff_angle: f64,
        /// Half the opening angle of the part at full intensity, degrees, in \[0, cutoff_angle\]; where both are the same
        /// the edge is hard.
        beam_width: f64,
        /// A picture in front of the light.
        slide: Option<Slide>,
    },
    /// Parallel light from infinitely far.
    Directional {
        /// Where the light goes, a unit vector.
        direction: DVec3,
        /// On a surface that faces the light, W/m².
        irradiance: DVec3,
    },
    /// Radiance from infinitely far, from an image in latitude-longitude format.
    ///
    /// The radiance that *arrives from* the unit direction `d` (a vector from the scene to the sky, world space) is
    /// [`Light::sky_uv`]`(to_world⁻¹ d)` looked up by [`Bitmap::sky`] and multiplied by `scale`.
    Envmap {
        /// At least 2 × 3 pixels; W/(m² sr), ≥ 0.
        bitmap: Arc<Bitmap>,
        /// Factor of the pixels, ≥ 0.
        scale: f64,
        /// From the image's axes to the world's: a rotation, possibly with a mirror.
        to_world: DMat3,
    },
}

/// A picture in front of a spot, which colours its light. In axes of which z is the direction of the spot and x is the one here, light in
/// the direction d meets the point (u, v) = (1/2, 1/2) + (d.x, d.y) / (2 d.z tan(cutoff)), as in Mitsuba 3.9.1.
#[derive(Clone, Debug, PartialEq)]
pub struct Slide {
    /// Factor of the intensity, ≥ 0.
    pub texture: Texture,
    /// The axis along which u grows, a unit vector perpendicular to the direction of the spot.
    pub x_axis: DVec3,
    /// The axis along which v grows.
    pub y_axis: DVec3,
}

impl Light {
    /// Where an environment map has the direction `d`, a unit vector in its own axes.
    ///
    /// v = acos(d.y) / π, so the first row of the image is up (+y) and the last one down. u = atan2(d.x, −d.z) / 2π in
    /// \[0, 1): the left edge (u = 0 and 1) is −z, u = 1/4 is +x, the middle of the image is +z and u = 3/4 is −x; seen from
    /// inside with +y up, x of the image grows to the right from −z over +x. Convention of Mitsuba's `envmap`, checked with 3.9.1.
    pub fn sky_uv(d: DVec3) -> DVec2 {
        let u = d.x.atan2(-d.z) / std::f64::consts::TAU;
        DVec2::new(u - u.floor(), d.y.clamp(-1.0, 1.0).acos() / std::f64::consts::PI)
    }

    /// Whether it gives any light at all.
    pub fn shines(&self) -> bool {
        let value = match *self {
            Light::Point { intensity, .. } | Light::Spot { intensity, .. } => intensity,
            Light::Constant { radiance } => radiance,
            Light::Directional { irradiance, .. } => irradiance,
            Light::Envmap { ref bitmap, scale, .. } => DVec3::splat(scale * f64::from(bitmap.max())),
        };
        value.max_element() > 0.0
    }
}
