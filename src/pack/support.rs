//! What the kernels cannot render yet is refused by name, so that nothing of a scene is silently left out. Whoever teaches the
//! kernels something takes its line out here.

use super::PackError;
use crate::scene::{Bsdf, Geometry, Scene, Shape, Texture};

/// Refuses the first thing that cannot be rendered; returns what is rendered in a simpler way, for people.
pub fn check(scene: &Scene) -> Result<Vec<String>, PackError> {
    let unsupported = |what: &'static str, name: String| Err(PackError::Unsupported { what, name });
    let mut warnings = Vec::new();
    for shape in &scene.shapes {
        if let Some(what) = unsupported_bsdf(&shape.bsdf) {
            return unsupported(what, shape.name.clone());
        }
        if shape.bsdf != Bsdf::Null && has_normals(shape) {
            warnings.push(format!(
                "flat normals are used for \"{}\", not its vertex normals; add <boolean name=\"face_normals\" \
                 value=\"true\"/> for the same picture in Mitsuba",
                shape.name
            ));
        }
    }
    Ok(warnings)
}

fn unsupported_bsdf(bsdf: &Bsdf) -> Option<&'static str> {
    match bsdf {
        Bsdf::RoughPlastic { .. } => Some("the roughplastic BSDF"),
        Bsdf::Mask { .. } => Some("the mask BSDF"),
        Bsdf::RoughDielectric { roughness, .. } | Bsdf::RoughConductor { roughness, .. }
            if roughness.is_anisotropic() =>
        {
            Some("the anisotropic roughness")
        }
        _ if bsdf.textures().iter().any(|texture| !matches!(texture, Texture::Constant(_))) => Some("the texture"),
        _ => None,
    }
}

fn has_normals(shape: &Shape) -> bool {
    matches!(&shape.geometry, Geometry::Mesh(mesh) if !mesh.normals.is_empty())
}
