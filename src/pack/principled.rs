//! The principled BSDF as the kernel's surfaces hold it: see `lib/principled.glsl`.

use super::layout::*;
use super::material::{Color, side};
use crate::scene::{Principled, Texture};
use glam::Vec3;

/// Roughness of a clear coat without gloss, and with all of it.
const COAT_ROUGHNESS: [f64; 2] = [0.1, 0.001];

/// What it puts into a surface. `color` packs a texture.
pub fn pack(parameters: &Principled, two_sided: bool, mut color: impl FnMut(&Texture) -> Color) -> Surface {
    let (base, base_texture) = color(&parameters.base_color);
    let (roughness, roughness_texture) = color(&parameters.roughness);
    let vector = |x: f64, y: f64, z: f64| Vec3::new(x as f32, y as f32, z as f32);
    // Ratio of the roughness across the tangent and along it is the square of this (Burley 2012, addendum).
    let aspect = (1.0 - 0.9 * parameters.anisotropic).sqrt();
    let [dull, glossy] = COAT_ROUGHNESS;
    let oriented = if parameters.refracts() { SURFACE_ORIENTED } else { 0 };
    Surface {
        reflectance: base,
        specular: roughness,
        textures_1: base_texture | roughness_texture << 16,
        transmittance: vector(parameters.metallic, parameters.spec_trans, parameters.flatness),
        extinction: vector(parameters.sheen, parameters.sheen_tint, parameters.spec_tint),
        internal_reflectance: parameters.clearcoat as f32,
        specular_weight: (dull + (glossy - dull) * parameters.clearcoat_gloss) as f32,
        eta: parameters.eta as f32,
        alpha: (1.0 / aspect) as f32,
        alpha_v: aspect as f32,
        flags: side(two_sided) | oriented | BSDF_PRINCIPLED << SURFACE_KIND_SHIFT,
        ..Surface::default()
    }
}
