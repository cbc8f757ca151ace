//! Materials as the kernel's surfaces hold them.

use super::layout::*;
use crate::scene::{Bsdf, Distribution, Roughness, Texture};
use glam::{DVec3, Vec3};

/// What a BSDF puts into a surface; the rest of it is left at its default. `support` has refused what has no place there.
pub fn pack(bsdf: &Bsdf) -> Surface {
    match bsdf {
        Bsdf::Diffuse { reflectance, two_sided } => {
            Surface { reflectance: constant(reflectance), flags: side(*two_sided), ..Surface::default() }
        }
        Bsdf::Dielectric { int_ior, ext_ior, specular_reflectance, specular_transmittance } => {
            glass(int_ior / ext_ior, specular_reflectance, specular_transmittance, SURFACE_ORIENTED)
        }
        Bsdf::ThinDielectric { int_ior, ext_ior, specular_reflectance, specular_transmittance } => {
            let flags = SURFACE_ORIENTED | SURFACE_THIN;
            glass(int_ior / ext_ior, specular_reflectance, specular_transmittance, flags)
        }
        Bsdf::RoughDielectric { roughness, int_ior, ext_ior, specular_reflectance, specular_transmittance } => {
            rough(glass(int_ior / ext_ior, specular_reflectance, specular_transmittance, SURFACE_ORIENTED), roughness)
        }
        Bsdf::Conductor { eta, k, specular_reflectance, two_sided } => {
            metal(*eta, *k, specular_reflectance, *two_sided)
        }
        Bsdf::RoughConductor { roughness, eta, k, specular_reflectance, two_sided } => {
            rough(metal(*eta, *k, specular_reflectance, *two_sided), roughness)
        }
        Bsdf::Plastic { diffuse_reflectance, specular_reflectance, int_ior, ext_ior, nonlinear, two_sided } => {
            let eta = int_ior / ext_ior;
            let (diffuse, specular) = (constant(diffuse_reflectance), constant(specular_reflectance));
            let nonlinear = if *nonlinear { SURFACE_NONLINEAR } else { 0 };
            let total = specular.element_sum() + diffuse.element_sum();
            Surface {
                reflectance: diffuse,
                specular,
                flags: side(*two_sided) | nonlinear | BSDF_PLASTIC << SURFACE_KIND_SHIFT,
                eta: eta as f32,
                internal_reflectance: diffuse_fresnel(1.0 / eta) as f32,
                specular_weight: if total > 0.0 { specular.element_sum() / total } else { 0.0 },
                ..Surface::default()
            }
        }
        Bsdf::Null | Bsdf::RoughPlastic { .. } | Bsdf::Mask { .. } => {
            Surface { flags: SURFACE_TWO_SIDED, ..Surface::default() }
        }
    }
}

/// A colour that is the same everywhere.
fn constant(texture: &Texture) -> Vec3 {
    match texture {
        Texture::Constant(value) => value.as_vec3(),
        _ => Vec3::ZERO, // `support` has refused these.
    }
}

fn side(two_sided: bool) -> u32 {
    if two_sided { SURFACE_TWO_SIDED } else { 0 }
}

fn glass(eta: f64, reflectance: &Texture, transmittance: &Texture, flags: u32) -> Surface {
    Surface {
        specular: constant(reflectance),
        transmittance: constant(transmittance),
        flags: flags | BSDF_DIELECTRIC << SURFACE_KIND_SHIFT,
        eta: eta as f32,
        ..Surface::default()
    }
}

fn metal(eta: DVec3, k: DVec3, reflectance: &Texture, two_sided: bool) -> Surface {
    Surface {
        specular: constant(reflectance),
        transmittance: eta.as_vec3(),
        extinction: k.as_vec3(),
        flags: side(two_sided) | BSDF_CONDUCTOR << SURFACE_KIND_SHIFT,
        eta: 1.0,
        ..Surface::default()
    }
}

fn rough(smooth: Surface, roughness: &Roughness) -> Surface {
    // Facets between equal indices neither bend nor reflect, however they lie.
    if smooth.flags >> SURFACE_KIND_SHIFT == BSDF_DIELECTRIC && smooth.eta == 1.0 {
        return smooth;
    }
    let ggx = if roughness.distribution == Distribution::Ggx { SURFACE_GGX } else { 0 };
    Surface { flags: smooth.flags | ggx, alpha: roughness.alpha_u as f32, ..smooth }
}

/// Fresnel reflectance for diffuse light, 2 ∫ F(cos) cos dcos, with the index `eta` of what light would enter over that of
/// where it is. Midpoint rule in √cos, in which the integrand has no steep ends; error below 1e-7.
pub fn diffuse_fresnel(eta: f64) -> f64 {
    const STEPS: u32 = 20_000;
    let sum: f64 = (0..STEPS)
        .map(|step| {
            let x = (f64::from(step) + 0.5) / f64::from(STEPS);
            let cos = x * x;
            fresnel(cos, eta) * cos * 2.0 * x
        })
        .sum();
    2.0 * sum / f64::from(STEPS)
}

fn fresnel(cos: f64, eta: f64) -> f64 {
    let sin_squared = (1.0 - cos * cos) / (eta * eta);
    if sin_squared >= 1.0 {
        return 1.0;
    }
    let t = (1.0 - sin_squared).sqrt();
    let s = (cos - eta * t) / (cos + eta * t);
    let p = (eta * cos - t) / (eta * cos + t);
    0.5 * (s * s + p * p)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn diffuse_fresnel_is_the_closed_form() {
        // From outside, Walsh (1926) as quoted by Egan and Hilgeman (1979): .0918 for 1.5. From inside, energy that goes in comes
        // out: (1 − inside) = (1 − outside) / n².
        let outside = diffuse_fresnel(1.5);
        assert!((outside - 0.0918).abs() < 5e-5, "{outside}");
        let inside = diffuse_fresnel(1.0 / 1.5);
        assert!((1.0 - inside - (1.0 - outside) / 2.25).abs() < 1e-6, "{inside}");
        assert!(diffuse_fresnel(1.0).abs() < 1e-12);
    }
}
