//! `<bsdf>`: what a surface does to light.

use glam::DVec3;

use super::build::Context;
use super::material::{self, AIR, BK7, POLYPROPYLENE};
use super::props::{Child, Given, NumberOrName, Props, unknown_plugin};
use super::suggest::{did_you_mean, list};
use super::texture::{choice, fraction, gray_fraction};
use super::tree::Kind;
use crate::scene::{Bsdf, Distribution, Roughness, SceneError};

pub(super) const TYPES: [&str; 11] = [
    "diffuse",
    "null",
    "twosided",
    "dielectric",
    "thindielectric",
    "roughdielectric",
    "conductor",
    "roughconductor",
    "plastic",
    "roughplastic",
    "mask",
];

/// What `twosided` can hold.
const ONE_SIDED: [&str; 5] = ["diffuse", "conductor", "roughconductor", "plastic", "roughplastic"];

/// What Mitsuba gives to a shape without a BSDF, and the reflectance of a `diffuse` that does not say.
pub(super) const DEFAULT_REFLECTANCE: f64 = 0.5;

/// Roughness that Mitsuba takes where a scene does not say.
const DEFAULT_ALPHA: f64 = 0.1;

/// A BSDF.
pub(super) fn convert<'a>(context: &mut Context<'a>, child: Child<'a>) -> Result<Bsdf, SceneError> {
    let props = context.props(child);
    let factor = |context: &mut Context<'a>, name| fraction(context, &props, name, 1.0);
    let bsdf = match child.object.plugin.as_str() {
        "diffuse" => {
            // The second is the name that Mitsuba 0.6 accepts as well.
            let old = !props.has("reflectance") && props.has("diffuse_reflectance");
            let name = if old { "diffuse_reflectance" } else { "reflectance" };
            let reflectance = fraction(context, &props, name, DEFAULT_REFLECTANCE)?;
            Bsdf::Diffuse { reflectance, two_sided: false }
        }
        "null" => Bsdf::Null,
        "twosided" => two_sided(context, child, &props)?,
        "dielectric" => {
            let (int_ior, ext_ior) = refractive_indices(&props, BK7)?;
            let specular_reflectance = factor(context, "specular_reflectance")?;
            let specular_transmittance = factor(context, "specular_transmittance")?;
            Bsdf::Dielectric { int_ior, ext_ior, specular_reflectance, specular_transmittance }
        }
        "thindielectric" => {
            let (int_ior, ext_ior) = refractive_indices(&props, BK7)?;
            let specular_reflectance = factor(context, "specular_reflectance")?;
            let specular_transmittance = factor(context, "specular_transmittance")?;
            Bsdf::ThinDielectric { int_ior, ext_ior, specular_reflectance, specular_transmittance }
        }
        "roughdielectric" => {
            let (int_ior, ext_ior) = different_indices(&props, child, BK7)?;
            let roughness = roughness(&props, true)?;
            let specular_reflectance = factor(context, "specular_reflectance")?;
            let specular_transmittance = factor(context, "specular_transmittance")?;
            Bsdf::RoughDielectric { roughness, int_ior, ext_ior, specular_reflectance, specular_transmittance }
        }
        "conductor" => {
            let (eta, k) = complex_index(&props)?;
            let specular_reflectance = factor(context, "specular_reflectance")?;
            Bsdf::Conductor { eta, k, specular_reflectance, two_sided: false }
        }
        "roughconductor" => {
            let (eta, k) = complex_index(&props)?;
            let roughness = roughness(&props, true)?;
            let specular_reflectance = factor(context, "specular_reflectance")?;
            Bsdf::RoughConductor { roughness, eta, k, specular_reflectance, two_sided: false }
        }
        "plastic" => {
            let (int_ior, ext_ior) = refractive_indices(&props, POLYPROPYLENE)?;
            let nonlinear = props.boolean("nonlinear")?.is_some_and(|given| given.value);
            let diffuse_reflectance = fraction(context, &props, "diffuse_reflectance", DEFAULT_REFLECTANCE)?;
            let specular_reflectance = factor(context, "specular_reflectance")?;
            let two_sided = false;
            Bsdf::Plastic { diffuse_reflectance, specular_reflectance, int_ior, ext_ior, nonlinear, two_sided }
        }
        "roughplastic" => {
            let (int_ior, ext_ior) = different_indices(&props, child, POLYPROPYLENE)?;
            let nonlinear = props.boolean("nonlinear")?.is_some_and(|given| given.value);
            let roughness = roughness(&props, false)?;
            let diffuse_reflectance = fraction(context, &props, "diffuse_reflectance", DEFAULT_REFLECTANCE)?;
            let specular_reflectance = factor(context, "specular_reflectance")?;
            let two_sided = false;
            Bsdf::RoughPlastic {
                roughness,
                diffuse_reflectance,
                specular_reflectance,
                int_ior,
                ext_ior,
                nonlinear,
                two_sided,
            }
        }
        "mask" => {
            let opacity = gray_fraction(context, &props, "opacity", 0.5)?;
            let nested = only_child(child, &props)?;
            Bsdf::Mask { opacity, nested: Box::new(convert(context, nested)?) }
        }
        _ => return Err(unknown_plugin(child.object, &TYPES)),
    };
    props.finish()?;
    Ok(bsdf)
}

fn two_sided<'a>(context: &mut Context<'a>, child: Child<'a>, props: &Props<'a>) -> Result<Bsdf, SceneError> {
    let inner = only_child(child, props)?;
    if !ONE_SIDED.contains(&inner.object.plugin.as_str()) {
        return Err(inner.at.error(format!(
            "<bsdf type=\"twosided\"> cannot hold {}; it must hold one of type {}",
            inner.object.describe(),
            list(ONE_SIDED.into_iter())
        )));
    }
    Ok(convert(context, inner)?.two_sided().expect("the one-sided types are those that have the flag"))
}

/// The one BSDF inside another.
fn only_child<'a>(child: Child<'a>, props: &Props<'a>) -> Result<Child<'a>, SceneError> {
    let inside = props.children(Kind::Bsdf);
    let [inner] = inside[..] else {
        let (what, count) = (child.object.describe(), inside.len());
        return Err(child.object.at.error(format!("{what} holds {count} BSDFs; it must hold one")));
    };
    Ok(inner)
}

/// `int_ior` and `ext_ior`.
fn refractive_indices(props: &Props, default_interior: f64) -> Result<(f64, f64), SceneError> {
    let index = |name, default| match props.number_or_name(name)? {
        None => Ok(default),
        Some(Given { value: NumberOrName::Number(value), at }) if value <= 0.0 => {
            Err(at.error(format!("{name} is {value}; it must be greater than 0")))
        }
        Some(Given { value: NumberOrName::Number(value), .. }) => Ok(value),
        Some(Given { value: NumberOrName::Name(material), at }) => {
            material::refractive_index(&material).ok_or_else(|| {
                let known = || material::REFRACTIVE_INDICES.iter().map(|(name, _)| *name);
                at.error(format!(
                    "the refractive index of \"{material}\" is not known{}; give a number or one of: {}",
                    did_you_mean(&material, known()),
                    list(known())
                ))
            })
        }
    };
    Ok((index("int_ior", default_interior)?, index("ext_ior", AIR)?))
}

/// `int_ior` and `ext_ior` of a rough surface, which has no limit where both are the same.
fn different_indices(props: &Props, child: Child, default_interior: f64) -> Result<(f64, f64), SceneError> {
    let (int_ior, ext_ior) = refractive_indices(props, default_interior)?;
    if int_ior == ext_ior {
        let what = child.object.describe();
        return Err(child
            .object
            .at
            .error(format!("int_ior and ext_ior of {what} are both {int_ior}; they must differ")));
    }
    Ok((int_ior, ext_ior))
}

/// `eta` and `k`, or those of `material`.
fn complex_index(props: &Props) -> Result<(DVec3, DVec3), SceneError> {
    let (material, eta, k) = (props.string("material")?, props.color("eta")?, props.color("k")?);
    let named = material.as_ref().filter(|given| given.value != "none");
    if let Some(named) = named {
        if let Some(extra) = eta.or(k) {
            return Err(extra.at.error("give either material or eta and k, not both"));
        }
        return material::complex_index(&named.value).ok_or_else(|| {
            let known = || material::METALS.iter().map(|(name, ..)| *name).chain(["none"]);
            named.at.error(format!(
                "the material \"{}\" is not known{}; give eta and k, or one of: {}",
                named.value,
                did_you_mean(&named.value, known()),
                list(known())
            ))
        });
    }
    let positive = |name: &str, given: Option<Given<DVec3>>, default: f64| match given {
        Some(given) if given.value.min_element() < 0.0 => {
            Err(given.at.error(format!("{name} is {}; it must not be negative", given.value)))
        }
        Some(given) => Ok(given.value),
        None => Ok(DVec3::splat(default)),
    };
    Ok((positive("eta", eta, 0.0)?, positive("k", k, 1.0)?))
}

/// `distribution` and `alpha`, or `alpha_u` and `alpha_v` where the model knows directions.
fn roughness(props: &Props, directions: bool) -> Result<Roughness, SceneError> {
    let words = [("beckmann", Distribution::Beckmann), ("ggx", Distribution::Ggx)];
    let distribution = choice(props, "distribution", &words)?;
    // Steers Mitsuba's sampling.
    props.ignore_boolean("sample_visible")?;
    let in_range = |name: &str, given: Given<f64>| {
        if given.value > 0.0 && given.value <= 1.0 {
            return Ok(given.value);
        }
        Err(given.at.error(format!("{name} is {}; it must be greater than 0 and at most 1", given.value)))
    };
    let alpha = props.float("alpha")?;
    let (alpha_u, alpha_v) = if directions { (props.float("alpha_u")?, props.float("alpha_v")?) } else { (None, None) };
    let (alpha_u, alpha_v) = match (alpha, alpha_u, alpha_v) {
        (None, None, None) => (DEFAULT_ALPHA, DEFAULT_ALPHA),
        (Some(alpha), None, None) => {
            let alpha = in_range("alpha", alpha)?;
            (alpha, alpha)
        }
        (None, Some(u), Some(v)) => (in_range("alpha_u", u)?, in_range("alpha_v", v)?),
        (Some(_), Some(extra), _) | (Some(_), None, Some(extra)) => {
            return Err(extra.at.error("give either alpha or alpha_u and alpha_v, not both"));
        }
        (None, Some(alone), None) | (None, None, Some(alone)) => {
            return Err(alone.at.error("alpha_u and alpha_v are only accepted together; give both of them, or alpha"));
        }
    };
    Ok(Roughness { distribution, alpha_u, alpha_v })
}
