//! The parameters of the principled BSDF.

use super::Texture;

/// Burley's (2012, 2015) principled BSDF, with the choices of Mitsuba 3.9.1. All numbers but `eta` lie in \[0, 1\].
#[derive(Clone, Debug, PartialEq)]
pub struct Principled {
    /// Colour of the body and of metal; that of clear material is its square root.
    pub base_color: Texture,
    /// Its square is the roughness of the microfacets; gray: its three channels are the same.
    pub roughness: Texture,
    /// How much the roughness depends on the direction: 0 not at all.
    pub anisotropic: f64,
    /// Share of metal.
    pub metallic: f64,
    /// Share of clear material in what is not metal.
    pub spec_trans: f64,
    /// Refractive index inside over the one outside, > 0; not 1 where light is refracted.
    pub eta: f64,
    /// How much of the base colour's hue the reflection of what is not metal has.
    pub spec_tint: f64,
    /// Weight of the sheen.
    pub sheen: f64,
    /// How much of the base colour's hue the sheen has.
    pub sheen_tint: f64,
    /// Share of what looks as if light had gone some way below the surface in the diffuse part.
    pub flatness: f64,
    /// Weight of the clear coat.
    pub clearcoat: f64,
    /// How smooth the clear coat is.
    pub clearcoat_gloss: f64,
}

impl Principled {
    /// Whether it lets light through.
    pub fn refracts(&self) -> bool {
        self.spec_trans > 0.0
    }
}
