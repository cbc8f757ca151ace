//! What the kernels cannot render yet is refused by name, so that nothing of a scene is silently left out. Whoever teaches the
//! kernels something takes its line out here.

use super::PackError;
use crate::scene::{Bsdf, Geometry, Light, Phase, Scene};
use glam::DVec3;

/// Refuses the first thing that cannot be rendered; returns what is rendered in a simpler way, for people.
pub fn check(scene: &Scene) -> Result<Vec<String>, PackError> {
    let unsupported = |what: &'static str, name: String| Err(PackError::Unsupported { what, name });
    for medium in &scene.media {
        let what = match medium.phase {
            Phase::Isotropic | Phase::HenyeyGreenstein { .. } => None,
            Phase::Rayleigh => Some("the Rayleigh phase function"),
            Phase::Blend { .. } => Some("the blended phase function"),
            Phase::Tabulated { .. } => Some("the tabulated phase function"),
        };
        if let Some(what) = what {
            return unsupported(what, medium.name.clone());
        }
        if medium.emission != DVec3::ZERO {
            return unsupported("the emission", medium.name.clone());
        }
    }
    for (index, light) in scene.lights.iter().enumerate() {
        let what = match light {
            Light::Point { .. } | Light::Constant { .. } => continue,
            Light::Spot { .. } => "the spot",
            Light::Directional { .. } => "the directional light",
            Light::Envmap { .. } => "the environment map",
        };
        return unsupported(what, format!("emitter {}", index + 1));
    }
    let warnings = Vec::new();
    for shape in &scene.shapes {
        if let Some(what) = unsupported_bsdf(&shape.bsdf) {
            return unsupported(what, shape.name.clone());
        }
        let bare = matches!(&shape.geometry, Geometry::Mesh(mesh) if mesh.uvs.is_empty());
        if let (true, Some(why)) = (bare, shape.bsdf.needs_uvs()) {
            return Err(PackError::MissingUvs { why, name: shape.name.clone() });
        }
    }
    Ok(warnings)
}

fn unsupported_bsdf(bsdf: &Bsdf) -> Option<&'static str> {
    match bsdf {
        Bsdf::Mask { nested, .. } if matches!(**nested, Bsdf::Mask { .. }) => Some("the mask inside of a mask"),
        _ => None,
    }
}
