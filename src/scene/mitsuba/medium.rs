//! `<medium>` and `<phase>`.

use glam::DVec3;

use super::build::Context;
use super::props::{Child, Given, Props, VolumeOrColor, unknown_plugin};
use super::spectrum::Meaning;
use super::tree::Kind;
use super::volume;
use crate::scene::{Medium, MediumId, Phase, SceneError, Volume, Volumes};

pub(super) const TYPES: [&str; 2] = ["homogeneous", "heterogeneous"];
pub(super) const PHASE_TYPES: [&str; 5] = ["isotropic", "hg", "rayleigh", "blendphase", "tabphase"];

/// A medium; a homogeneous one from `sigma_t` and `albedo` as in Mitsuba 3 or from `sigma_s` and `sigma_a` as in 0.6.
pub(super) fn convert<'a>(context: &mut Context<'a>, child: Child<'a>) -> Result<Medium, SceneError> {
    match child.object.plugin.as_str() {
        "homogeneous" => {}
        "heterogeneous" => return heterogeneous(context, child),
        _ => return Err(unknown_plugin(child.object, &TYPES)),
    }
    let props = context.props(child);
    let (sigma_t, albedo) = (props.color("sigma_t")?, props.fraction("albedo")?);
    let (sigma_s, sigma_a) = (props.color("sigma_s")?, props.color("sigma_a")?);
    let (scale, emission) = (props.float("scale")?, props.emission("emission")?);
    estimators(context, &props)?;
    let phase = props.child(Kind::Phase)?;
    props.finish()?;

    let scale = factor(scale)?;
    let (sigma_t, albedo) = match (sigma_s, sigma_a) {
        (None, None) => {
            let sigma_t = coefficient("sigma_t", sigma_t)?.unwrap_or(DVec3::ONE);
            (sigma_t, fraction("albedo", albedo)?.unwrap_or(DVec3::splat(0.75)))
        }
        (Some(sigma_s), Some(sigma_a)) => {
            if let Some((name, extra)) = sigma_t.map(|g| ("sigma_t", g)).or(albedo.map(|g| ("albedo", g))) {
                return Err(extra.at.error(format!(
                    "{name} contradicts sigma_s and sigma_a; give either sigma_t and albedo or sigma_s and sigma_a"
                )));
            }
            let sigma_s = coefficient("sigma_s", Some(sigma_s))?.unwrap_or_default();
            let sigma_a = coefficient("sigma_a", Some(sigma_a))?.unwrap_or_default();
            let sigma_t = sigma_s + sigma_a;
            let ratio = |s: f64, t: f64| if t > 0.0 { s / t } else { 0.0 };
            let albedo =
                DVec3::new(ratio(sigma_s.x, sigma_t.x), ratio(sigma_s.y, sigma_t.y), ratio(sigma_s.z, sigma_t.z));
            (sigma_t, albedo)
        }
        (Some(given), None) | (None, Some(given)) => {
            return Err(given
                .at
                .error("sigma_s and sigma_a are only accepted together; give both of them, or sigma_t and albedo"));
        }
    };
    let sigma_t = sigma_t * scale;
    if !sigma_t.is_finite() {
        return Err(child.object.at.error("the extinction coefficient overflows: scale times sigma_t is infinite"));
    }
    let emission = coefficient("emission", emission)?.unwrap_or_default();
    let phase = match phase {
        Some(child) => self::phase(context, child)?,
        None => Phase::Isotropic,
    };
    Ok(Medium { name: name_of(child), sigma_t, albedo, phase, emission, volumes: Volumes::default() })
}

/// Choices of Mitsuba's estimators, some of a version to come; the medium is the same.
fn estimators<'a>(context: &mut Context<'a>, props: &Props<'a>) -> Result<(), SceneError> {
    props.ignore_boolean("has_spectral_extinction")?;
    props.ignore_boolean("sample_emitters")?;
    props.string("medium_sampling_mode")?;
    // Collisions without effect.
    let sigma_n = props.color_or_volume("sigma_n", Meaning::Factor)?;
    volume::coefficient(context, sigma_n, "sigma_n", DVec3::ZERO).map(drop)
}

/// Makes a medium shine, as the `volumelight` of a shape around it says.
pub(super) fn shine<'a>(context: &mut Context<'a>, id: MediumId, emitter: Child<'a>) -> Result<(), SceneError> {
    let props = context.props(emitter);
    let radiance = props.color_or_volume("radiance", Meaning::Emitted)?;
    props.float("sampling_weight")?;
    props.finish()?;
    let radiance = volume::coefficient(context, radiance, "emission", DVec3::ONE)?;
    // A shape of a group is read for each of its instances, and what several shapes refer to is one light.
    let known = context.volume_lights.insert(id, emitter.id);
    let medium = &mut context.media[id.0 as usize];
    if known.map_or(medium.emission != DVec3::ZERO, |known| known != emitter.id) {
        let name = &medium.name;
        return Err(emitter.at.error(format!("the medium \"{name}\" shines already; it can have one emission only")));
    }
    if matches!(medium.volumes.sigma_t, Some(Volume::Height(_))) {
        return Err(emitter.at.error("a medium whose sigma_t is a heightvolume cannot emit"));
    }
    medium.emission = radiance.factor;
    medium.volumes.emission = match radiance.field {
        Some(Volume::Grid(field)) => Some(field),
        _ => None,
    };
    Ok(())
}

/// What to call a medium in messages.
fn name_of(child: Child) -> String {
    child.object.id.clone().unwrap_or_else(|| format!("medium at {}", child.object.at))
}

/// The factor of a medium's coefficients.
fn factor(scale: Option<Given<'_, f64>>) -> Result<f64, SceneError> {
    match scale {
        Some(given) if given.value < 0.0 => {
            Err(given.at.error(format!("scale is {}; it must not be negative", given.value)))
        }
        Some(given) => Ok(given.value),
        None => Ok(1.0),
    }
}

/// A medium whose coefficients depend on the place.
fn heterogeneous<'a>(context: &mut Context<'a>, child: Child<'a>) -> Result<Medium, SceneError> {
    let props = context.props(child);
    let sigma_t = props.color_or_volume("sigma_t", Meaning::Factor)?;
    let albedo = props.color_or_volume("albedo", Meaning::Fraction)?;
    let emission = props.color_or_volume("emission", Meaning::Emitted)?;
    let scale = props.float("scale")?;
    estimators(context, &props)?;
    let phase = props.child(Kind::Phase)?;
    props.finish()?;
    let scale = factor(scale)?;
    if let Some(VolumeOrColor::Constant(given)) = &sigma_t {
        context.warnings.push(given.at.warning(
            "this medium fills all of its shape; with such a constant sigma_t Mitsuba fills the unit cube [0, 1]³ alone",
        ));
    }
    let at = |given: &Option<VolumeOrColor<'a>>| match given {
        Some(VolumeOrColor::Constant(given)) => given.at,
        Some(VolumeOrColor::Volume(child)) => child.at,
        None => &child.object.at,
    };
    let (albedo_at, emission_at) = (at(&albedo), at(&emission));
    let sigma_t = volume::coefficient(context, sigma_t, "sigma_t", DVec3::ONE)?;
    let albedo = volume::coefficient(context, albedo, "albedo", DVec3::splat(0.75))?;
    let emission = volume::coefficient(context, emission, "emission", DVec3::ZERO)?;
    let most = match &albedo.field {
        Some(Volume::Grid(field)) => f64::from(field.grid.max()),
        _ => albedo.factor.max_element(),
    };
    if most > 1.0 {
        return Err(albedo_at.error(format!("the largest albedo is {most}; it must lie between 0 and 1")));
    }
    if matches!(sigma_t.field, Some(Volume::Height(_))) && (emission.field.is_some() || emission.factor != DVec3::ZERO)
    {
        return Err(emission_at.error("a medium whose sigma_t is a heightvolume cannot emit"));
    }
    let only_grid = |field: Option<Volume>| match field {
        Some(Volume::Grid(field)) => Some(field),
        _ => None,
    };
    let most = match &sigma_t.field {
        Some(Volume::Grid(field)) => f64::from(field.grid.max()),
        _ => 1.0,
    };
    let extinction = sigma_t.factor * scale;
    if !(extinction * most).is_finite() {
        return Err(child.object.at.error("the extinction coefficient overflows: scale times sigma_t is infinite"));
    }
    let phase = match phase {
        Some(child) => self::phase(context, child)?,
        None => Phase::Isotropic,
    };
    let volumes =
        Volumes { sigma_t: sigma_t.field, albedo: only_grid(albedo.field), emission: only_grid(emission.field) };
    Ok(Medium {
        name: name_of(child),
        sigma_t: extinction,
        albedo: albedo.factor,
        phase,
        emission: emission.factor,
        volumes,
    })
}

/// A phase function.
pub(super) fn phase<'a>(context: &Context<'a>, child: Child<'a>) -> Result<Phase, SceneError> {
    let props = context.props(child);
    let phase = match child.object.plugin.as_str() {
        "isotropic" => Phase::Isotropic,
        "hg" => {
            let g = props.float("g")?;
            if let Some(given) = &g
                && given.value.abs() >= 1.0
            {
                return Err(given.at.error(format!("g is {}; it must lie between -1 and 1", given.value)));
            }
            Phase::HenyeyGreenstein { g: g.map_or(0.8, |given| given.value) }
        }
        "rayleigh" => Phase::Rayleigh,
        "blendphase" => blend(context, child, &props)?,
        "tabphase" => {
            let values = props.string("values")?.ok_or_else(|| {
                child.object.at.error("<phase type=\"tabphase\"> needs <string name=\"values\" value=\"…\"/>")
            })?;
            let table = super::values::floats(&values.value).map_err(|message| values.at.error(message))?;
            // Mitsuba's table and ours have the same sign: the last value is that of straight on.
            Phase::tabulated(table).ok_or_else(|| {
                values.at.error("values must be at least two numbers that are not negative, with one greater than 0")
            })?
        }
        _ => return Err(unknown_plugin(child.object, &PHASE_TYPES)),
    };
    props.finish()?;
    Ok(phase)
}

/// A mixture of two phase functions, in the order of the file.
fn blend<'a>(context: &Context<'a>, child: Child<'a>, props: &Props<'a>) -> Result<Phase, SceneError> {
    let weight = props.float("weight")?.ok_or_else(|| {
        child
            .object
            .at
            .error("<phase type=\"blendphase\"> needs <float name=\"weight\" value=\"…\"/>, the share of the second")
    })?;
    if !(0.0..=1.0).contains(&weight.value) {
        return Err(weight.at.error(format!("weight is {}; it must lie between 0 and 1", weight.value)));
    }
    let inside = props.children(Kind::Phase);
    let [a, b] = inside[..] else {
        let count = inside.len();
        return Err(child
            .object
            .at
            .error(format!("<phase type=\"blendphase\"> holds {count} phase functions; it must hold two")));
    };
    let [a, b] = [phase(context, a)?, phase(context, b)?].map(Box::new);
    Ok(Phase::Blend { weight: weight.value, a, b })
}

fn coefficient(name: &str, given: Option<Given<DVec3>>) -> Result<Option<DVec3>, SceneError> {
    match given {
        Some(given) if given.value.min_element() < 0.0 => {
            Err(given.at.error(format!("{name} is {}; it must not be negative", given.value)))
        }
        other => Ok(other.map(|given| given.value)),
    }
}

fn fraction(name: &str, given: Option<Given<DVec3>>) -> Result<Option<DVec3>, SceneError> {
    match given {
        Some(given) if given.value.min_element() < 0.0 || given.value.max_element() > 1.0 => {
            Err(given.at.error(format!("{name} is {}; it must lie between 0 and 1", given.value)))
        }
        other => Ok(other.map(|given| given.value)),
    }
}
