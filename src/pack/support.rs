//! What the kernels cannot render yet is refused by name, so that nothing of a scene is silently left out. Whoever teaches the
//! kernels something takes its line out here.

use super::PackError;
use crate::scene::{Bsdf, Geometry, Scene};

/// Refuses the first thing that cannot be rendered.
pub fn check(scene: &Scene) -> Result<(), PackError> {
    for shape in &scene.shapes {
        if let Some(what) = unsupported_bsdf(&shape.bsdf) {
            return Err(PackError::Unsupported { what, name: shape.name.clone() });
        }
        let bare = matches!(&shape.geometry, Geometry::Mesh(mesh) if mesh.uvs.is_empty());
        if let (true, Some(why)) = (bare, shape.bsdf.needs_uvs()) {
            return Err(PackError::MissingUvs { why, name: shape.name.clone() });
        }
    }
    Ok(())
}

fn unsupported_bsdf(bsdf: &Bsdf) -> Option<&'static str> {
    match bsdf {
        Bsdf::Mask { nested, .. } if matches!(**nested, Bsdf::Mask { .. }) => Some("the mask inside of a mask"),
        Bsdf::Mask { nested, .. } | Bsdf::Relief { nested, .. } => unsupported_bsdf(nested),
        Bsdf::Blend { first, second, .. } | Bsdf::Sides { front: first, back: second } => {
            if [first, second].iter().any(|part| matches!(***part, Bsdf::Mask { .. } | Bsdf::Null)) {
                return Some("the mask or null inside of a BSDF of two parts");
            }
            if parts(first) > 1 && parts(second) > 1 {
                return Some("the BSDF of two parts each of which has several parts");
            }
            unsupported_bsdf(first).or(unsupported_bsdf(second))
        }
        _ => None,
    }
}

/// How many models a BSDF is made of.
fn parts(bsdf: &Bsdf) -> usize {
    match bsdf {
        Bsdf::Mask { nested, .. } | Bsdf::Relief { nested, .. } => parts(nested),
        Bsdf::Blend { first, second, .. } | Bsdf::Sides { front: first, back: second } => parts(first) + parts(second),
        _ => 1,
    }
}
