//! What surfaces do to light.

use glam::DVec3;

use super::{Principled, Texture};

/// What a surface does to light. The interior is the side that the normals point away from, the exterior the other one.
///
/// Refractive indices are those of the material alone (1 is vacuum), real, > 0 and the same for all channels; what counts is
/// `int_ior / ext_ior`. Factors named `specular_*` and `*_reflectance` lie in \[0, 1\] and are 1 for real materials.
/// `two_sided` surfaces treat their back like their front; otherwise the back is black. Models and parameters are
/// Mitsuba's (`docs/SCENES.md`).
#[derive(Clone, Debug, PartialEq)]
pub enum Bsdf {
    /// Nothing: light goes straight on.
    Null,
    /// Lambert's law.
    Diffuse {
        /// Reflected fraction of each channel, in \[0, 1\].
        reflectance: Texture,
        /// Reflects on both sides; otherwise the back is black.
        two_sided: bool,
    },
    /// A smooth boundary between two transparent materials: Fresnel's equations and Snell's law.
    Dielectric {
        /// Refractive index inside.
        int_ior: f64,
        /// Refractive index outside.
        ext_ior: f64,
        /// Factor of reflected light.
        specular_reflectance: Texture,
        /// Factor of refracted light.
        specular_transmittance: Texture,
    },
    /// A thin smooth pane seen as one surface: all reflections inside it are summed, and light leaves in the direction in
    /// which it came. With F of one face, 2F/(1+F) is reflected.
    ThinDielectric {
        /// Refractive index of the pane.
        int_ior: f64,
        /// Refractive index on both sides of it.
        ext_ior: f64,
        /// Factor of reflected light.
        specular_reflectance: Texture,
        /// Factor of transmitted light.
        specular_transmittance: Texture,
    },
    /// A rough boundary between two transparent materials: microfacets (Walter et al. 2007).
    RoughDielectric {
        /// Slopes of the microfacets.
        roughness: Roughness,
        /// Refractive index inside, not the one outside.
        int_ior: f64,
        /// Refractive index outside.
        ext_ior: f64,
        /// Factor of reflected light.
        specular_reflectance: Texture,
        /// Factor of refracted light.
        specular_transmittance: Texture,
    },
    /// A smooth metal: Fresnel's equations with the complex refractive index `eta + i k`, seen from vacuum.
    Conductor {
        /// Real part for each channel, ≥ 0.
        eta: DVec3,
        /// Imaginary part (extinction coefficient) for each channel, ≥ 0. 0 and 1 make a perfect mirror.
        k: DVec3,
        /// Factor of reflected light.
        specular_reflectance: Texture,
        /// Reflects on both sides; otherwise the back is black.
        two_sided: bool,
    },
    /// A rough metal: microfacets (Walter et al. 2007).
    RoughConductor {
        /// Slopes of the microfacets.
        roughness: Roughness,
        /// Real part of the refractive index for each channel, ≥ 0.
        eta: DVec3,
        /// Its imaginary part for each channel, ≥ 0.
        k: DVec3,
        /// Factor of reflected light.
        specular_reflectance: Texture,
        /// Reflects on both sides; otherwise the back is black.
        two_sided: bool,
    },
    /// A diffuse base under a smooth dielectric coat. Light that the coat reflects back to the base counts.
    Plastic {
        /// Reflected fraction of the base.
        diffuse_reflectance: Texture,
        /// Factor of light that the coat reflects.
        specular_reflectance: Texture,
        /// Refractive index of the coat.
        int_ior: f64,
        /// Refractive index outside.
        ext_ior: f64,
        /// The colour of the base deepens with each reflection between coat and base; otherwise it counts once.
        nonlinear: bool,
        /// Reflects on both sides; otherwise the back is black.
        two_sided: bool,
    },
    /// A diffuse base under a rough dielectric coat.
    RoughPlastic {
        /// Slopes of the coat's microfacets, the same in all directions.
        roughness: Roughness,
        /// Reflected fraction of the base.
        diffuse_reflectance: Texture,
        /// Factor of light that the coat reflects.
        specular_reflectance: Texture,
        /// Refractive index of the coat, not the one outside.
        int_ior: f64,
        /// Refractive index outside.
        ext_ior: f64,
        /// The colour of the base deepens with each reflection between coat and base; otherwise it counts once.
        nonlinear: bool,
        /// Reflects on both sides; otherwise the back is black.
        two_sided: bool,
    },
    /// Burley's (2012, 2015) principled BSDF.
    Principled {
        /// What it is like.
        parameters: Principled,
        /// Reflects on both sides; otherwise the back is black, or clear where light is let through.
        two_sided: bool,
    },
    /// Two models in one place: the second counts with the weight, the first with what is left of 1.
    Blend {
        /// In \[0, 1\], gray: its three channels are the same.
        weight: Texture,
        /// With the weight 0 all of it.
        first: Box<Bsdf>,
        /// With the weight 1 all of it.
        second: Box<Bsdf>,
    },
    /// A surface whose sides differ: each of them is seen as if it were the front.
    Sides {
        /// On the side of the normals.
        front: Box<Bsdf>,
        /// On the other one.
        back: Box<Bsdf>,
    },
    /// A surface whose normals are turned from place to place.
    Relief {
        /// How.
        relief: Relief,
        /// What is seen in the turned frame.
        nested: Box<Bsdf>,
    },
    /// A surface with holes: light meets `nested` with the probability `opacity` and goes straight on otherwise.
    Mask {
        /// In \[0, 1\], gray: its three channels are the same.
        opacity: Texture,
        /// What is there where there is no hole.
        nested: Box<Bsdf>,
    },
}

/// How normals are turned, relative to the frame of the interpolated normal n, of s along the direction in which u grows, and t = n × s.
#[derive(Clone, Debug, PartialEq)]
pub struct Relief {
    /// The turned normals, or heights.
    pub map: ReliefMap,
    /// A normal that the viewer would see from behind is turned to the other side of n instead (Schüssler et al. 2017).
    pub flips: bool,
    /// Light that would end abruptly where it grazes the surface itself fades out (Conty Estevez, Lecocq and Stein 2019).
    pub fades: bool,
    /// The model inside has two equal sides of its own, so that its back is turned with the front rather than mirrored.
    pub around_two_sides: bool,
}

/// Where turned normals come from.
#[derive(Clone, Debug, PartialEq)]
pub enum ReliefMap {
    /// 2 · colour − 1 is the normal in (s, t, n), not normalised.
    Normals(Texture),
    /// A gray image of heights above the surface, scene units, times a factor; what counts is their slope.
    Heights(Texture, f64),
}

/// Distribution of microfacet normals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Distribution {
    /// Beckmann's, of a surface with Gaussian slopes.
    Beckmann,
    /// Trowbridge and Reitz's, with long tails.
    Ggx,
}

/// How rough a surface is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Roughness {
    /// Distribution of microfacet normals.
    pub distribution: Distribution,
    /// Roughness along the tangent (u), in (0, 1]; for Beckmann the root mean square of the slope.
    pub alpha_u: f64,
    /// Roughness along the bitangent (v), in (0, 1].
    pub alpha_v: f64,
}

impl Roughness {
    /// Whether the roughness depends on the direction, so that the surface needs texture coordinates.
    pub fn is_anisotropic(&self) -> bool {
        self.alpha_u != self.alpha_v
    }
}

impl Bsdf {
    /// The name of the model in scene files.
    pub fn plugin(&self) -> &'static str {
        match self {
            Bsdf::Null => "null",
            Bsdf::Diffuse { .. } => "diffuse",
            Bsdf::Dielectric { .. } => "dielectric",
            Bsdf::ThinDielectric { .. } => "thindielectric",
            Bsdf::RoughDielectric { .. } => "roughdielectric",
            Bsdf::Conductor { .. } => "conductor",
            Bsdf::RoughConductor { .. } => "roughconductor",
            Bsdf::Plastic { .. } => "plastic",
            Bsdf::RoughPlastic { .. } => "roughplastic",
            Bsdf::Principled { .. } => "principled",
            Bsdf::Mask { .. } => "mask",
            Bsdf::Blend { .. } => "blendbsdf",
            Bsdf::Sides { .. } => "twosided",
            Bsdf::Relief { relief: Relief { map: ReliefMap::Normals(_), .. }, .. } => "normalmap",
            Bsdf::Relief { .. } => "bumpmap",
        }
    }

    /// Whether front and back differ.
    pub fn sides_differ(&self) -> bool {
        match self {
            Bsdf::Null | Bsdf::ThinDielectric { .. } => false,
            Bsdf::Diffuse { two_sided, .. }
            | Bsdf::Conductor { two_sided, .. }
            | Bsdf::RoughConductor { two_sided, .. }
            | Bsdf::Plastic { two_sided, .. }
            | Bsdf::RoughPlastic { two_sided, .. }
            | Bsdf::Principled { two_sided, .. } => !two_sided,
            Bsdf::Dielectric { .. } | Bsdf::RoughDielectric { .. } => true,
            Bsdf::Mask { nested, .. } | Bsdf::Relief { nested, .. } => nested.sides_differ(),
            Bsdf::Blend { first, second, .. } => first.sides_differ() || second.sides_differ(),
            Bsdf::Sides { .. } => true,
        }
    }

    /// The same with the back like the front; `None` for models that let light through, which have two sides of their own.
    pub fn two_sided(mut self) -> Option<Bsdf> {
        match &mut self {
            Bsdf::Diffuse { two_sided, .. }
            | Bsdf::Conductor { two_sided, .. }
            | Bsdf::RoughConductor { two_sided, .. }
            | Bsdf::Plastic { two_sided, .. }
            | Bsdf::RoughPlastic { two_sided, .. } => *two_sided = true,
            Bsdf::Principled { parameters, two_sided } if !parameters.refracts() => *two_sided = true,
            Bsdf::Blend { first, second, .. } => {
                **first = (**first).clone().two_sided()?;
                **second = (**second).clone().two_sided()?;
            }
            Bsdf::Relief { nested, .. } => **nested = (**nested).clone().two_sided()?,
            _ => return None,
        }
        Some(self)
    }

    /// Its textures, and those of the models in it.
    pub fn textures(&self) -> Vec<&Texture> {
        match self {
            Bsdf::Null => vec![],
            Bsdf::Diffuse { reflectance, .. } => vec![reflectance],
            Bsdf::Dielectric { specular_reflectance, specular_transmittance, .. }
            | Bsdf::ThinDielectric { specular_reflectance, specular_transmittance, .. }
            | Bsdf::RoughDielectric { specular_reflectance, specular_transmittance, .. } => {
                vec![specular_reflectance, specular_transmittance]
            }
            Bsdf::Conductor { specular_reflectance, .. } | Bsdf::RoughConductor { specular_reflectance, .. } => {
                vec![specular_reflectance]
            }
            Bsdf::Plastic { diffuse_reflectance, specular_reflectance, .. }
            | Bsdf::RoughPlastic { diffuse_reflectance, specular_reflectance, .. } => {
                vec![diffuse_reflectance, specular_reflectance]
            }
            Bsdf::Principled { parameters, .. } => vec![&parameters.base_color, &parameters.roughness],
            Bsdf::Mask { opacity, nested } => [nested.textures(), vec![opacity]].concat(),
            Bsdf::Blend { weight, first, second } => [first.textures(), second.textures(), vec![weight]].concat(),
            Bsdf::Sides { front, back } => [front.textures(), back.textures()].concat(),
            Bsdf::Relief {
                relief: Relief { map: ReliefMap::Normals(map) | ReliefMap::Heights(map, _), .. },
                nested,
            } => [nested.textures(), vec![map]].concat(),
        }
    }

    /// Whether it depends on the direction in which a texture coordinate grows.
    pub fn needs_tangents(&self) -> bool {
        match self {
            Bsdf::RoughDielectric { roughness, .. } | Bsdf::RoughConductor { roughness, .. } => {
                roughness.is_anisotropic()
            }
            Bsdf::Principled { parameters, .. } => parameters.anisotropic > 0.0,
            Bsdf::Mask { nested, .. } => nested.needs_tangents(),
            Bsdf::Blend { first, second, .. } | Bsdf::Sides { front: first, back: second } => {
                first.needs_tangents() || second.needs_tangents()
            }
            Bsdf::Relief { .. } => true,
            _ => false,
        }
    }

    /// Why it needs texture coordinates, if it does.
    pub fn needs_uvs(&self) -> Option<&'static str> {
        let anisotropic = match self {
            Bsdf::RoughDielectric { roughness, .. } | Bsdf::RoughConductor { roughness, .. } => {
                roughness.is_anisotropic()
            }
            Bsdf::Principled { parameters, .. } => parameters.anisotropic > 0.0,
            Bsdf::Mask { nested, .. } if nested.needs_uvs().is_some() => return nested.needs_uvs(),
            Bsdf::Blend { first, second, .. } | Bsdf::Sides { front: first, back: second }
                if first.needs_uvs().or(second.needs_uvs()).is_some() =>
            {
                return first.needs_uvs().or(second.needs_uvs());
            }
            Bsdf::Relief { .. } => return Some("a map of normals or heights"),
            _ => false,
        };
        if self.textures().iter().any(|texture| texture.needs_uvs()) {
            Some("a texture")
        } else {
            anisotropic.then_some("anisotropic roughness")
        }
    }
}
