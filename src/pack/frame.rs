//! The canonical frame: the kernel's coordinates.
//!
//! The scene is moved so that the centre of its bounds lies at the origin, and scaled by a power of two so that its
//! largest half extent lies in (1/2, 1]. So single precision is spent on the scene and not on where it lies, no quantity
//! under- or overflows because of the unit of length, and no constant of the kernel needs to know the scale. Lengths are
//! multiplied by [`Frame::scale`], coefficients per length divided by it; radiance has no length in it.

use crate::scene::{Geometry, Light, Scene};
use glam::{DVec3, Vec3};

/// From world space to the canonical frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// What moves to the origin, in world space.
    pub center: DVec3,
    /// Canonical units in a scene unit, a power of two.
    pub scale: f64,
    /// Radius of a sphere about the origin that holds all shapes, in canonical units.
    pub radius: f64,
}

impl Frame {
    /// The frame of a scene: of its shapes, and the voxels of a scene-wide medium. Without any shape the camera, the point lights and the spots span it.
    pub fn of(scene: &Scene) -> Frame {
        let mut bounds = super::grid::bounds(scene);
        for shape in &scene.shapes {
            bounds = bounds.union(Bounds::of(&shape.geometry));
        }
        if bounds.is_empty() {
            bounds.grow(scene.camera.to_world.w_axis.truncate());
            for light in &scene.lights {
                if let Light::Point { position, .. } | Light::Spot { position, .. } = light {
                    bounds.grow(*position);
                }
            }
        }
        let half = (bounds.max - bounds.min).max_element() / 2.0;
        let scale = if half > 0.0 { (-half.log2().ceil()).exp2() } else { 1.0 };
        Frame {
            center: (bounds.min + bounds.max) / 2.0,
            scale,
            radius: (bounds.max - bounds.min).length() / 2.0 * scale,
        }
    }

    /// A point.
    pub fn point(&self, world: DVec3) -> Vec3 {
        ((world - self.center) * self.scale).as_vec3()
    }

    /// A length.
    pub fn length(&self, world: f64) -> f32 {
        (world * self.scale) as f32
    }

    /// A coefficient per length.
    pub fn per_length(&self, world: DVec3) -> Vec3 {
        (world / self.scale).as_vec3()
    }
}

/// An axis-aligned box in world space.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    /// Lower corner.
    pub min: DVec3,
    /// Upper corner.
    pub max: DVec3,
}

impl Bounds {
    /// Holds nothing.
    pub const EMPTY: Bounds = Bounds { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// The bounds of a surface.
    pub fn of(geometry: &Geometry) -> Bounds {
        let mut bounds = Bounds::EMPTY;
        match geometry {
            Geometry::Mesh(mesh) => {
                // Corners that no triangle uses do not count.
                for corner in mesh.triangles.iter().flatten() {
                    bounds.grow(mesh.positions[*corner as usize]);
                }
            }
            Geometry::Sphere { center, radius, .. } => {
                bounds.grow(*center - DVec3::splat(*radius));
                bounds.grow(*center + DVec3::splat(*radius));
            }
        }
        bounds
    }

    /// Makes room for a point.
    pub fn grow(&mut self, point: DVec3) {
        self.min = self.min.min(point);
        self.max = self.max.max(point);
    }

    /// What holds both.
    pub fn union(self, other: Bounds) -> Bounds {
        Bounds { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Whether it holds nothing.
    pub fn is_empty(&self) -> bool {
        self.min.x > self.max.x
    }

    /// Whether it holds a point.
    pub fn contains(&self, point: DVec3) -> bool {
        point.cmpge(self.min).all() && point.cmple(self.max).all()
    }
}
