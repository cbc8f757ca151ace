//! The table of lights and the alias table by which one is chosen in constant time (Walker 1977, Vose 1991).

use super::emission::EmittingVolume;
use super::frame::Frame;
use super::layout::{
    LIGHT_CONSTANT, LIGHT_DIRECTIONAL, LIGHT_ENVMAP, LIGHT_POINT, LIGHT_QUAD, LIGHT_RECTANGLE, LIGHT_SPHERE,
    LIGHT_SPOT, LIGHT_TEXTURE_SHIFT, LIGHT_TRIANGLE, LIGHT_VOLUME, Light,
};
use crate::scene;
use glam::{DMat3, DVec3, Vec3};
use std::f64::consts::PI;

/// Share of the choice that is uniform over the lights. The rest goes by power, which says little about what arrives.
const UNIFORM_SHARE: f64 = 0.1;
/// Share of that rest that goes to lights in the scene and to those infinitely far in equal halves. The power of a sky grows with the scene, and a
/// lamp in a wide landscape may still decide what its pictures show.
const HALVED_SHARE: f64 = 0.8;

/// Largest cosine between the edges of what counts as a rectangle.
const PERPENDICULAR: f64 = 1e-5;
/// Largest ratio of the edges of a rectangle that is sampled by solid angle. Above a narrow one, where its ends are seen in opposite
/// directions, the determinant of its corners is small beside numbers that cancel: at 16 the solid angle still is right to 1e-4.
const LARGEST_ASPECT: f64 = 16.0;

/// Collects lights with their power, then builds the table.
#[derive(Default)]
pub struct LightTable {
    lights: Vec<Light>,
    powers: Vec<f64>,
}

impl LightTable {
    /// Adds the triangles of a lamp and returns the index of the light of each. Two neighbours that make up a parallelogram
    /// are one light.
    ///
    /// `alike` says whether a triangle and the next one may be one light.
    pub fn add_triangles(
        &mut self,
        triangles: &[[Vec3; 3]],
        radiance: DVec3,
        alike: impl Fn(usize) -> bool,
    ) -> Vec<u32> {
        let mut indices = Vec::with_capacity(triangles.len());
        while indices.len() < triangles.len() {
            let first = triangles[indices.len()];
            let quad = triangles.get(indices.len() + 1).and_then(|second| parallelogram(first, *second));
            let quad = quad.filter(|_| alike(indices.len()));
            let [corner, one, two] = quad.unwrap_or(first);
            let cross = (one - corner).cross(two - corner);
            let area = cross.length() * if quad.is_some() { 1.0 } else { 0.5 };
            let light = Light {
                origin: corner,
                kind: match quad {
                    Some(_) if perpendicular(one - corner, two - corner) => LIGHT_RECTANGLE,
                    Some(_) => LIGHT_QUAD,
                    None => LIGHT_TRIANGLE,
                },
                edge_1: one - corner,
                edge_2: two - corner,
                area,
                radiance: radiance.as_vec3(),
                normal: cross.normalize_or_zero(),
                ..Light::default()
            };
            let index = self.push(light, mean(radiance) * f64::from(area) * PI);
            indices.push(index);
            if quad.is_some() {
                indices.push(index);
            }
        }
        indices
    }

    /// A light that was added.
    pub fn get(&self, index: u32) -> &Light {
        &self.lights[index as usize]
    }

    /// Puts a texture in front of a light: its index plus one, and its mean.
    pub fn paint(&mut self, index: u32, texture: u32, mean: f64) {
        self.lights[index as usize].texture = texture;
        self.powers[index as usize] *= mean;
    }

    /// Adds a sphere that emits outwards (`side` 1) or inwards (−1) and returns its index.
    pub fn add_sphere(&mut self, center: Vec3, radius: f32, side: f32, radiance: DVec3) -> u32 {
        let area = 4.0 * PI * f64::from(radius).powi(2);
        let light = Light {
            origin: center,
            kind: LIGHT_SPHERE,
            edge_1: Vec3::new(radius, side, 0.0),
            area: area as f32,
            radiance: radiance.as_vec3(),
            ..Light::default()
        };
        self.push(light, mean(radiance) * area * PI)
    }

    /// Adds a medium that emits, and returns the index of its light.
    pub fn add_volume(&mut self, volume: EmittingVolume, medium: u32, emission: Vec3) -> u32 {
        let light = Light {
            origin: volume.center,
            kind: LIGHT_VOLUME,
            edge_1: Vec3::new(volume.radius, medium as f32, 0.0),
            radiance: emission,
            ..Light::default()
        };
        self.push(light, mean(emission.as_dvec3()) * 4.0 * PI * volume.volume)
    }

    /// Adds a light that shines from one place or one direction, and returns its index; those of the whole sky are left out.
    pub fn add_place(&mut self, light: &scene::Light, frame: &Frame) -> Option<u32> {
        match light {
            scene::Light::Point { position, intensity } => {
                // Intensity over distance² is irradiance: it scales as an area.
                let scaled = *intensity * frame.scale.powi(2);
                let light = Light {
                    origin: frame.point(*position),
                    kind: LIGHT_POINT,
                    radiance: scaled.as_vec3(),
                    ..Light::default()
                };
                Some(self.push(light, mean(scaled) * 4.0 * PI))
            }
            scene::Light::Spot { position, direction, intensity, cutoff_angle, beam_width, slide } => {
                let scaled = *intensity * frame.scale.powi(2);
                let [cutoff, beam] = [cutoff_angle, beam_width].map(|angle| angle.to_radians() as f32);
                let slope = if cutoff > beam { 1.0 / (cutoff - beam) } else { 0.0 };
                let light = Light {
                    origin: frame.point(*position),
                    kind: LIGHT_SPOT,
                    edge_1: Vec3::new(cutoff, beam, slope),
                    radiance: scaled.as_vec3(),
                    normal: direction.as_vec3(),
                    edge_2: slide.as_ref().map_or(Vec3::ZERO, |slide| slide.x_axis.as_vec3()),
                    slide_y: slide.as_ref().map_or(Vec3::ZERO, |slide| slide.y_axis.as_vec3()),
                    ..Light::default()
                };
                Some(self.push(light, mean(scaled) * spot_solid_angle(f64::from(cutoff), f64::from(beam))))
            }
            scene::Light::Directional { direction, irradiance } => {
                // Irradiance has the unit of radiance, but for the solid angle: the unit of length does not change it.
                let light = Light {
                    kind: LIGHT_DIRECTIONAL,
                    radiance: irradiance.as_vec3(),
                    normal: direction.as_vec3(),
                    ..Light::default()
                };
                Some(self.push(light, mean(*irradiance) * disc_area(frame)))
            }
            scene::Light::Constant { .. } | scene::Light::Envmap { .. } => None,
        }
    }

    /// Adds the same radiance from all directions.
    pub fn add_constant(&mut self, radiance: DVec3, frame: &Frame) {
        let light = Light { kind: LIGHT_CONSTANT, radiance: radiance.as_vec3(), ..Light::default() };
        self.push(light, mean(radiance) * 4.0 * PI * disc_area(frame));
    }

    /// Adds an environment map with the mean radiance over all directions, the index of its texture, and the rotation from its
    /// axes to the world's.
    pub fn add_envmap(&mut self, mean_radiance: f64, texture: u32, to_world: &DMat3, frame: &Frame) {
        let light = Light {
            kind: LIGHT_ENVMAP | texture << LIGHT_TEXTURE_SHIFT,
            radiance: Vec3::splat(mean_radiance as f32),
            edge_1: to_world.x_axis.as_vec3(),
            edge_2: to_world.y_axis.as_vec3(),
            normal: to_world.z_axis.as_vec3(),
            ..Light::default()
        };
        self.push(light, mean_radiance * 4.0 * PI * disc_area(frame));
    }

    /// Lights so far.
    pub fn len(&self) -> u32 {
        self.lights.len() as u32
    }

    /// Whether there is none so far.
    pub fn is_empty(&self) -> bool {
        self.lights.is_empty()
    }

    fn push(&mut self, light: Light, power: f64) -> u32 {
        self.lights.push(light);
        self.powers.push(power);
        self.lights.len() as u32 - 1
    }

    /// The lights, with the probabilities and the alias table filled in.
    pub fn finish(mut self) -> Vec<Light> {
        let count = self.lights.len();
        let total: f64 = self.powers.iter().sum();
        let near: Vec<bool> = self.lights.iter().map(is_near).collect();
        let of_near: f64 = self.powers.iter().zip(&near).filter(|(_, near)| **near).map(|(power, _)| power).sum();
        let both = of_near > 0.0 && total > of_near;
        let probability = |(&power, &near): (&f64, &bool)| {
            let by_power = if total > 0.0 { power / total } else { 1.0 / count as f64 };
            let half = 0.5 * power / if near { of_near } else { total - of_near };
            let by_power = if both { (1.0 - HALVED_SHARE) * by_power + HALVED_SHARE * half } else { by_power };
            (1.0 - UNIFORM_SHARE) * by_power + UNIFORM_SHARE / count as f64
        };
        let probabilities: Vec<f64> = self.powers.iter().zip(&near).map(probability).collect();
        let strongest =
            (0..count).filter(|&index| near[index]).max_by(|&a, &b| self.powers[a].total_cmp(&self.powers[b]));
        if let Some((place, area)) = strongest.map(|index| (middle(&self.lights[index]), self.lights[index].area)) {
            for (light, _) in self.lights.iter_mut().zip(&near).filter(|(_, near)| !**near) {
                (light.origin, light.area) = (place, area);
            }
        }
        for ((light, probability), (threshold, alias)) in
            self.lights.iter_mut().zip(&probabilities).zip(alias_table(&probabilities))
        {
            light.probability = *probability as f32;
            light.alias_threshold = threshold as f32;
            light.alias = alias;
        }
        self.lights
    }
}

/// Whether a light is at some place, not infinitely far.
pub fn is_near(light: &Light) -> bool {
    let kind = light.kind & ((1 << LIGHT_TEXTURE_SHIFT) - 1);
    !matches!(kind, LIGHT_CONSTANT | LIGHT_DIRECTIONAL | LIGHT_ENVMAP)
}

/// A point in the middle of a light at some place.
fn middle(light: &Light) -> Vec3 {
    match light.kind {
        LIGHT_TRIANGLE => light.origin + (light.edge_1 + light.edge_2) / 3.0,
        LIGHT_QUAD | LIGHT_RECTANGLE => light.origin + (light.edge_1 + light.edge_2) / 2.0,
        _ => light.origin,
    }
}

/// Cross section of a sphere about the scene: what parallel light passes through.
fn disc_area(frame: &Frame) -> f64 {
    PI * frame.radius.max(0.5).powi(2)
}

/// Power of a spot over the intensity on its axis. With the cutoff c and the beam width b in radians,
///   2π ∫ falloff(θ) sin θ dθ = 2π (1 − cos b + ∫_b^c (c − θ)/(c − b) sin θ dθ) = 2π (1 − (sin c − sin b)/(c − b)).
fn spot_solid_angle(cutoff: f64, beam: f64) -> f64 {
    let mean_cosine = if cutoff > beam { (cutoff.sin() - beam.sin()) / (cutoff - beam) } else { cutoff.cos() };
    2.0 * PI * (1.0 - mean_cosine)
}

fn mean(value: DVec3) -> f64 {
    value.element_sum() / 3.0
}

/// Corner and its two neighbours, if the triangles are the halves of a parallelogram with the same orientation.
fn parallelogram(first: [Vec3; 3], second: [Vec3; 3]) -> Option<[Vec3; 3]> {
    // In each rotation of both, ask for (a, b, c) and (a, c, d), with a + c = b + d up to rounding.
    for i in 0..3 {
        for j in 0..3 {
            let [a, b, c] = [first[i], first[(i + 1) % 3], first[(i + 2) % 3]];
            let [a2, c2, d] = [second[j], second[(j + 1) % 3], second[(j + 2) % 3]];
            let size = (b - a).abs().max((d - a).abs()).max_element();
            if a == a2 && c == c2 && ((a + c) - (b + d)).abs().max_element() <= size * 1e-6 {
                return Some([a, b, d]);
            }
        }
    }
    None
}

/// Whether the edges of a parallelogram are those of a rectangle that can be sampled by solid angle.
fn perpendicular(one: Vec3, two: Vec3) -> bool {
    let (one, two) = (one.as_dvec3(), two.as_dvec3());
    let (length_one, length_two) = (one.length(), two.length());
    one.dot(two).abs() <= PERPENDICULAR * length_one * length_two
        && length_one.max(length_two) <= LARGEST_ASPECT * length_one.min(length_two)
}

/// For each line the threshold below which the line itself is taken, and the line that is taken otherwise.
pub fn alias_table(probabilities: &[f64]) -> Vec<(f64, u32)> {
    let count = probabilities.len();
    let mut scaled: Vec<f64> = probabilities.iter().map(|p| p * count as f64).collect();
    let mut table: Vec<(f64, u32)> = (0..count as u32).map(|index| (1.0, index)).collect();
    let (mut small, mut large): (Vec<usize>, Vec<usize>) = (0..count).partition(|&index| scaled[index] < 1.0);
    while let (Some(&less), Some(&more)) = (small.last(), large.last()) {
        small.pop();
        table[less] = (scaled[less], more as u32);
        scaled[more] -= 1.0 - scaled[less];
        if scaled[more] < 1.0 {
            large.pop();
            small.push(more);
        }
    }
    table
}
