//! `<bsdf>`: what a surface does to light.

use glam::DVec3;

use super::build::Context;
use super::material::{self, AIR, BK7, POLYPROPYLENE};
use super::principled;
use super::props::{Child, Colored, Given, NumberOrName, Props, unknown_plugin};
use super::suggest::{did_you_mean, list};
use super::texture::{self, choice, fraction, gray, gray_fraction};
use super::tree::Kind;
use crate::scene::{Bsdf, Distribution, Filter, Relief, ReliefMap, Roughness, SceneError, Texture};

pub(super) const TYPES: [&str; 15] = [
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
    "principled",
    "mask",
    "blendbsdf",
    "normalmap",
    "bumpmap",
];

/// What `twosided` can hold.
const ONE_SIDED: [&str; 9] = [
    "diffuse",
    "conductor",
    "roughconductor",
    "plastic",
    "roughplastic",
    "principled",
    "blendbsdf",
    "normalmap",
    "bumpmap",
];

/// What Mitsuba gives to a shape without a BSDF, and the reflectance of a `diffuse` that does not say.
pub(super) const DEFAULT_REFLECTANCE: f64 = 0.5;

/// Roughness that Mitsuba takes where a scene does not say.
const DEFAULT_ALPHA: f64 = 0.1;

/// A BSDF.
pub(super) fn convert<'a>(context: &mut Context<'a>, child: Child<'a>) -> Result<Bsdf, SceneError> {
    // By a <ref>, one could hold itself.
    if context.open_bsdfs.contains(&child.id) {
        return Err(child.at.error(format!("{} is inside of itself", child.object.describe())));
    }
    context.open_bsdfs.push(child.id);
    let bsdf = plugin(context, child);
    context.open_bsdfs.pop();
    bsdf
}

fn plugin<'a>(context: &mut Context<'a>, child: Child<'a>) -> Result<Bsdf, SceneError> {
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
        "principled" => Bsdf::Principled { parameters: principled::read(context, &props)?, two_sided: false },
        "mask" => {
            let opacity = gray_fraction(context, &props, "opacity", 0.5)?;
            let nested = only_child(child, &props)?;
            Bsdf::Mask { opacity, nested: Box::new(convert(context, nested)?) }
        }
        "blendbsdf" => blend(context, child, &props)?,
        "normalmap" => {
            let map = named_texture(context, child, &props, "normalmap")?;
            relief(context, child, &props, ReliefMap::Normals(map))?
        }
        "bumpmap" => {
            let scale = props.float("scale")?.map_or(1.0, |given| given.value);
            let inside = props.children(Kind::Texture);
            let [texture] = inside[..] else {
                let (what, count) = (child.object.describe(), inside.len());
                return Err(child.object.at.error(format!("{what} holds {count} textures; it must hold one")));
            };
            let map = gray(texture::convert(context, texture)?);
            if let Texture::Bitmap { filter: Filter::Nearest, .. } | Texture::Checkerboard { .. } = map {
                return Err(texture.at.error(
                    "heights must change smoothly to have a slope; use a \"bitmap\" with the filter_type \"bilinear\"",
                ));
            }
            relief(context, child, &props, ReliefMap::Heights(map, scale))?
        }
        _ => return Err(unknown_plugin(child.object, &TYPES)),
    };
    props.finish()?;
    Ok(bsdf)
}

/// Two BSDFs, weighted. Where one of them is `null` it is a mask.
fn blend<'a>(context: &mut Context<'a>, child: Child<'a>, props: &Props<'a>) -> Result<Bsdf, SceneError> {
    if !props.has("weight") {
        let what = child.object.describe();
        return Err(child.object.at.error(format!("{what} needs a weight, a <float> or <texture>")));
    }
    let weight = gray_fraction(context, props, "weight", 0.5)?;
    let inside = props.children(Kind::Bsdf);
    let [first, second] = inside[..] else {
        let (what, count) = (child.object.describe(), inside.len());
        return Err(child.object.at.error(format!("{what} holds {count} BSDFs; it must hold two")));
    };
    let (first, second) = (convert(context, first)?, convert(context, second)?);
    let mask = |opacity, nested| Ok(Bsdf::Mask { opacity, nested: Box::new(nested) });
    match (first, second) {
        (Bsdf::Null, second) => mask(weight, second),
        (first, Bsdf::Null) => match weight.constant() {
            Some(weight) => mask((DVec3::ONE - weight).into(), first),
            None => Err(child
                .object
                .at
                .error("a blend whose second BSDF is \"null\" needs a constant weight; let \"null\" be the first, or use \"mask\"")),
        },
        (first, second) => Ok(Bsdf::Blend { weight, first: Box::new(first), second: Box::new(second) }),
    }
}

/// The texture of a property that must be one.
fn named_texture<'a>(
    context: &mut Context<'a>,
    child: Child<'a>,
    props: &Props<'a>,
    name: &'static str,
) -> Result<Texture, SceneError> {
    match props.color_or_texture(name)? {
        Some(Colored::Texture(texture)) => texture::convert(context, texture),
        Some(Colored::Constant(given)) => Ok(given.value.into()),
        None => {
            let what = child.object.describe();
            Err(child.object.at.error(format!("{what} needs <texture name=\"{name}\" type=\"bitmap\">")))
        }
    }
}

/// A BSDF in a frame that a map turns.
fn relief<'a>(
    context: &mut Context<'a>,
    child: Child<'a>,
    props: &Props<'a>,
    map: ReliefMap,
) -> Result<Bsdf, SceneError> {
    if let ReliefMap::Normals(Texture::Attribute { .. }) | ReliefMap::Heights(Texture::Attribute { .. }, _) = map {
        let what = child.object.describe();
        return Err(child.object.at.error(format!("the map of {what} cannot be a \"mesh_attribute\"; use \"bitmap\"")));
    }
    let flips = props.boolean("flip_invalid_normals")?.is_none_or(|given| given.value);
    let fades = props.boolean("use_shadowing_function")?.is_none_or(|given| given.value);
    let inner = only_child(child, props)?;
    let nested = convert(context, inner)?;
    if matches!(nested, Bsdf::Null | Bsdf::Mask { .. } | Bsdf::Sides { .. } | Bsdf::Relief { .. }) {
        let (what, found) = (child.object.describe(), inner.object.describe());
        return Err(inner.at.error(format!("{what} cannot hold {found}; it must be inside of that")));
    }
    let around_two_sides = nested.clone().two_sided().is_some_and(|both| both == nested);
    Ok(Bsdf::Relief { relief: Relief { map, flips, fades, around_two_sides }, nested: Box::new(nested) })
}

fn two_sided<'a>(context: &mut Context<'a>, child: Child<'a>, props: &Props<'a>) -> Result<Bsdf, SceneError> {
    let inside = props.children(Kind::Bsdf);
    let (inner, back) = match inside[..] {
        [inner] => (inner, None),
        [front, back] => (front, Some(back)),
        _ => {
            let (what, count) = (child.object.describe(), inside.len());
            return Err(child.object.at.error(format!("{what} holds {count} BSDFs; it must hold one or two")));
        }
    };
    let front = one_side(context, inner)?;
    let Some(back) = back else { return Ok(front) };
    Ok(Bsdf::Sides { front: Box::new(front), back: Box::new(one_side(context, back)?) })
}

/// A BSDF inside of `twosided`, with the back like the front.
fn one_side<'a>(context: &mut Context<'a>, inner: Child<'a>) -> Result<Bsdf, SceneError> {
    if !ONE_SIDED.contains(&inner.object.plugin.as_str()) {
        return Err(inner.at.error(format!(
            "<bsdf type=\"twosided\"> cannot hold {}; it must hold one of type {}",
            inner.object.describe(),
            list(ONE_SIDED.into_iter())
        )));
    }
    convert(context, inner)?.two_sided().ok_or_else(|| {
        inner.at.error(format!(
            "{} lets light through, so that it cannot be inside of <bsdf type=\"twosided\">",
            inner.object.describe()
        ))
    })
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
