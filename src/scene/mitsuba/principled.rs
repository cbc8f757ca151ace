//! `<bsdf type="principled">`: its parameters.

use super::build::Context;
use super::props::{Given, Props};
use super::texture::{fraction, gray_fraction};
use crate::scene::{Principled, SceneError};

/// What Mitsuba takes in the place of a refractive index of 1, and of a `specular` of 0, where light is refracted.
const LEAST_REFRACTION: (f64, f64) = (1.001, 1e-3);

/// The parameters, with Mitsuba's defaults.
pub(super) fn read<'a>(context: &mut Context<'a>, props: &Props<'a>) -> Result<Principled, SceneError> {
    let base_color = fraction(context, props, "base_color", 0.5)?;
    let roughness = gray_fraction(context, props, "roughness", 0.5)?;
    let weight = |name: &'static str| {
        if let Some(texture) = props.texture(name)? {
            return Err(texture.at.error(format!(
                "{name} of \"principled\" is a texture; it must be a <float> here: only base_color and roughness can be textures"
            )));
        }
        let given = props.float(name)?;
        given.map_or(Ok(0.0), |given| in_unit(name, given))
    };
    let spec_trans = weight("spec_trans")?;
    let parameters = Principled {
        base_color,
        roughness,
        anisotropic: weight("anisotropic")?,
        metallic: weight("metallic")?,
        spec_trans,
        eta: index(props, spec_trans > 0.0)?,
        spec_tint: weight("spec_tint")?,
        sheen: weight("sheen")?,
        sheen_tint: weight("sheen_tint")?,
        flatness: weight("flatness")?,
        clearcoat: weight("clearcoat")?,
        clearcoat_gloss: weight("clearcoat_gloss")?,
    };
    // How Mitsuba samples.
    for name in ["diffuse_reflectance_sampling_rate", "main_specular_sampling_rate", "clearcoat_sampling_rate"] {
        props.float(name)?;
    }
    Ok(parameters)
}

/// The relative refractive index, from `eta` or `specular`.
fn index(props: &Props, refracts: bool) -> Result<f64, SceneError> {
    let (eta, specular) = (props.float("eta")?, props.float("specular")?);
    if let (Some(_), Some(extra)) = (&eta, &specular) {
        return Err(extra.at.error("give either eta or specular, not both"));
    }
    let (least_eta, least_specular) = LEAST_REFRACTION;
    if let Some(eta) = eta {
        if eta.value <= 0.0 {
            return Err(eta.at.error(format!("eta is {}; it must be greater than 0", eta.value)));
        }
        return Ok(if refracts && eta.value == 1.0 { least_eta } else { eta.value });
    }
    let specular = specular.map_or(Ok(0.5), |given| in_unit("specular", given))?;
    let specular = if refracts && specular == 0.0 { least_specular } else { specular };
    // The index whose reflectance at normal incidence is 0.08 · specular.
    Ok(2.0 / (1.0 - (0.08 * specular).sqrt()) - 1.0)
}

fn in_unit(name: &str, given: Given<f64>) -> Result<f64, SceneError> {
    if (0.0..=1.0).contains(&given.value) {
        return Ok(given.value);
    }
    Err(given.at.error(format!("{name} is {}; it must lie between 0 and 1", given.value)))
}
