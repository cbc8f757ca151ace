//! `<emitter>`: light sources.

use glam::DVec3;

use super::build::Context;
use super::props::{Child, Given, unknown_plugin};
use super::tree::Kind;
use crate::scene::{Light, SceneError};

const TYPES: [&str; 3] = ["area", "point", "constant"];

/// The radiance of an `area` emitter inside a shape.
pub(super) fn area<'a>(context: &Context<'a>, child: Child<'a>) -> Result<DVec3, SceneError> {
    match child.object.plugin.as_str() {
        "area" => {}
        "point" | "constant" => {
            return Err(child.at.error(format!(
                "{} cannot be part of a shape; put it directly into <scene>",
                child.object.describe()
            )));
        }
        _ => return Err(unknown_plugin(child.object, &TYPES)),
    }
    let props = context.props(child);
    let radiance = positive("radiance", props.emission("radiance")?)?;
    props.float("sampling_weight")?;
    props.finish()?;
    Ok(radiance)
}

/// An emitter that stands directly in the scene.
pub(super) fn light<'a>(context: &mut Context<'a>, child: Child<'a>) -> Result<Light, SceneError> {
    let props = context.props(child);
    // The weight only says how often Mitsuba picks the emitter.
    let light = match child.object.plugin.as_str() {
        "point" => {
            let intensity = positive("intensity", props.emission("intensity")?)?;
            let (position, to_world) = (props.vector("position")?, props.transform("to_world")?);
            props.float("sampling_weight")?;
            if let Some(medium) = props.children(Kind::Medium).first() {
                context.warnings.push(
                    medium.at.warning("this medium is ignored: the medium at a light is found from the geometry"),
                );
            }
            let position = match (position, to_world) {
                (Some(_), Some(second)) => {
                    return Err(second.at.error("a point emitter has either position or to_world, not both"));
                }
                (Some(position), None) => position.value,
                (None, Some(to_world)) => to_world.value.w_axis.truncate(),
                (None, None) => DVec3::ZERO,
            };
            Light::Point { position, intensity }
        }
        "constant" => {
            let radiance = positive("radiance", props.emission("radiance")?)?;
            props.float("sampling_weight")?;
            Light::Constant { radiance }
        }
        "area" => {
            return Err(child.at.error("<emitter type=\"area\"> must be inside the <shape> that is to shine"));
        }
        _ => return Err(unknown_plugin(child.object, &TYPES)),
    };
    props.finish()?;
    Ok(light)
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
