//! `<emitter>`: light sources.

use std::sync::Arc;

use glam::{DMat3, DMat4, DVec3};

use super::build::Context;
use super::props::{Child, Colored, Given, Props, unknown_plugin};
use super::texture;
use super::transform::rigid;
use super::tree::Kind;
use crate::scene::{Light, SceneError, Slide, Texture};

pub(super) const TYPES: [&str; 7] = ["area", "point", "spot", "directional", "constant", "envmap", "volumelight"];

/// The radiance of an `area` emitter inside a shape, and a factor of it that depends on the place.
pub(super) fn area<'a>(context: &mut Context<'a>, child: Child<'a>) -> Result<(DVec3, Option<Texture>), SceneError> {
    match child.object.plugin.as_str() {
        "area" => {}
        "point" | "spot" | "directional" | "constant" | "envmap" => {
            return Err(child.at.error(format!(
                "{} cannot be part of a shape; put it directly into <scene>",
                child.object.describe()
            )));
        }
        _ => return Err(unknown_plugin(child.object, &TYPES)),
    }
    let props = context.props(child);
    let radiance = match props.emission_or_texture("radiance")? {
        Some(Colored::Texture(picture)) => (DVec3::ONE, Some(shining(context, picture, "radiance")?)),
        Some(Colored::Constant(given)) => (positive("radiance", Some(given))?, None),
        None => (DVec3::ONE, None),
    };
    props.float("sampling_weight")?;
    props.finish()?;
    Ok(radiance)
}

/// A texture in front of a light.
fn shining<'a>(context: &mut Context<'a>, child: Child<'a>, name: &str) -> Result<Texture, SceneError> {
    if child.object.plugin == "mesh_attribute" {
        return Err(child
            .at
            .error(format!("{name} cannot be a \"mesh_attribute\"; use \"bitmap\" with texture coordinates")));
    }
    let texture = texture::convert(context, child)?;
    let negative = match &texture {
        Texture::Bitmap { bitmap, .. } => bitmap.pixels().iter().flatten().any(|value| *value < 0.0),
        _ => false,
    };
    if negative {
        return Err(child.at.error(format!("the image of {name} has negative pixels; light must not be negative")));
    }
    Ok(texture)
}

/// An emitter that stands directly in the scene.
pub(super) fn light<'a>(context: &mut Context<'a>, child: Child<'a>) -> Result<Light, SceneError> {
    let props = context.props(child);
    let light = match child.object.plugin.as_str() {
        "point" => {
            let intensity = positive("intensity", props.emission("intensity")?)?;
            ignore_medium(context, &props);
            let position = match (props.vector("position")?, props.transform("to_world")?) {
                (Some(_), Some(second)) => {
                    return Err(second.at.error("a point emitter has either position or to_world, not both"));
                }
                (Some(position), None) => position.value,
                (None, Some(to_world)) => to_world.value.w_axis.truncate(),
                (None, None) => DVec3::ZERO,
            };
            Light::Point { position, intensity }
        }
        "spot" => spot(context, &props)?,
        "directional" => {
            let irradiance = positive("irradiance", props.emission("irradiance")?)?;
            let direction = match (props.vector("direction")?, props.transform("to_world")?) {
                (Some(_), Some(second)) => {
                    return Err(second.at.error("a directional emitter has either direction or to_world, not both"));
                }
                (Some(direction), None) => direction
                    .value
                    .try_normalize()
                    .ok_or_else(|| direction.at.error("direction is zero; it must point to where the light goes"))?,
                (None, Some(to_world)) => {
                    let axis = to_world.value.z_axis.truncate().try_normalize();
                    axis.ok_or_else(|| to_world.at.error("to_world leaves nothing of the direction +z"))?
                }
                (None, None) => DVec3::Z,
            };
            Light::Directional { direction, irradiance }
        }
        "constant" => Light::Constant { radiance: positive("radiance", props.emission("radiance")?)? },
        "envmap" => envmap(context, child, &props)?,
        "area" => {
            return Err(child.at.error("<emitter type=\"area\"> must be inside the <shape> that is to shine"));
        }
        "volumelight" => {
            return Err(child
                .at
                .error("<emitter type=\"volumelight\"> must be inside the <shape> whose medium is to shine"));
        }
        _ => return Err(unknown_plugin(child.object, &TYPES)),
    };
    // The weight only says how often Mitsuba picks the emitter.
    props.float("sampling_weight")?;
    props.finish()?;
    Ok(light)
}

/// A cone of light from the origin of `to_world` along its +z.
fn spot<'a>(context: &mut Context<'a>, props: &Props<'a>) -> Result<Light, SceneError> {
    let intensity = positive("intensity", props.emission("intensity")?)?;
    let (cutoff, beam) = (props.float("cutoff_angle")?, props.float("beam_width")?);
    ignore_medium(context, props);
    let cutoff_angle = cutoff.as_ref().map_or(20.0, |given| given.value);
    if let Some(given) = &cutoff
        && !(cutoff_angle > 0.0 && cutoff_angle <= 180.0)
    {
        return Err(given
            .at
            .error(format!("cutoff_angle is {cutoff_angle} degrees; it must be greater than 0 and at most 180")));
    }
    let beam_width = beam.as_ref().map_or(cutoff_angle * 0.75, |given| given.value);
    if let Some(given) = &beam
        && !(0.0..=cutoff_angle).contains(&beam_width)
    {
        return Err(given.at.error(format!(
            "beam_width is {beam_width} degrees; it must lie between 0 and cutoff_angle, which is {cutoff_angle}"
        )));
    }
    let to_world = match props.transform("to_world")? {
        Some(given) => rigid(given, "the spot's to_world")?,
        None => DMat4::IDENTITY,
    };
    let (position, direction) = (to_world.w_axis.truncate(), to_world.z_axis.truncate());
    let texture = match props.texture("texture")? {
        Some(picture) => Some(shining(context, picture, "texture")?),
        None => None,
    };
    if let (true, Some(given)) = (texture.is_some() && cutoff_angle >= 90.0, &cutoff) {
        return Err(given.at.error("the cutoff_angle of a spot with a texture must be less than 90"));
    }
    let [x_axis, y_axis] = [to_world.x_axis.truncate(), to_world.y_axis.truncate()];
    let slide = texture.map(|texture| Slide { texture, x_axis, y_axis });
    Ok(Light::Spot { position, direction, intensity, cutoff_angle, beam_width, slide })
}

/// An image of the sky.
fn envmap<'a>(context: &mut Context<'a>, child: Child<'a>, props: &Props<'a>) -> Result<Light, SceneError> {
    let scale = match props.float("scale")? {
        Some(given) if given.value < 0.0 => {
            return Err(given.at.error(format!("scale is {}; it must not be negative", given.value)));
        }
        Some(given) => given.value,
        None => 1.0,
    };
    let to_world = match props.transform("to_world")? {
        Some(given) => DMat3::from_mat4(rigid(given, "the environment map's to_world")?),
        None => DMat3::IDENTITY,
    };
    // Steers Mitsuba's sampling.
    props.ignore_boolean("mis_compensation")?;
    let mut bitmap = texture::image(context, child, props, false)?;
    if bitmap.width() < 2 || bitmap.height() < 3 {
        let (width, height) = (bitmap.width(), bitmap.height());
        let text =
            format!("the image of an environment map has {width} x {height} pixels; it must have at least 2 x 3");
        return Err(child.object.at.error(text));
    }
    let negative = bitmap.pixels().iter().filter(|pixel| pixel.iter().any(|value| *value < 0.0)).count();
    if negative > 0 {
        let text = format!("{negative} pixels of the environment map are negative; they count as 0");
        context.warnings.push(child.object.at.warning(text));
        bitmap = Arc::new(bitmap.map(|pixel| pixel.map(|value| value.max(0.0))));
    }
    Ok(Light::Envmap { bitmap, scale, to_world })
}

fn ignore_medium<'a>(context: &mut Context<'a>, props: &Props<'a>) {
    if let Some(medium) = props.children(Kind::Medium).first() {
        let text = "this medium is ignored: the medium at a light is found from the geometry";
        context.warnings.push(medium.at.warning(text));
    }
}

fn positive(name: &str, given: Option<Given<DVec3>>) -> Result<DVec3, SceneError> {
    match given {
        Some(given) if given.value.min_element() < 0.0 => {
            Err(given.at.error(format!("{name} is {}; it must not be negative", given.value)))
        }
        Some(given) => Ok(given.value),
        None => Ok(DVec3::ONE),
    }
}
