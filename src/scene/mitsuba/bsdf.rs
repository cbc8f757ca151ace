//! `<bsdf>`: what a surface does to light.

use glam::DVec3;

use super::build::Context;
use super::props::{Child, unknown_plugin};
use super::tree::Kind;
use crate::scene::{Bsdf, SceneError};

const TYPES: [&str; 3] = ["diffuse", "null", "twosided"];

/// What Mitsuba gives to a shape without a BSDF, and the reflectance of a `diffuse` that does not say.
pub(super) const DEFAULT_REFLECTANCE: DVec3 = DVec3::splat(0.5);

/// A BSDF.
pub(super) fn convert<'a>(context: &Context<'a>, child: Child<'a>) -> Result<Bsdf, SceneError> {
    let props = context.props(child);
    let bsdf = match child.object.plugin.as_str() {
        "diffuse" => {
            let given = match props.color("reflectance")? {
                Some(given) => Some(given),
                // The name that Mitsuba 0.6 accepts as well.
                None if child.object.properties.iter().any(|p| p.name.as_deref() == Some("diffuse_reflectance")) => {
                    props.color("diffuse_reflectance")?
                }
                None => None,
            };
            if let Some(given) = &given
                && (given.value.min_element() < 0.0 || given.value.max_element() > 1.0)
            {
                return Err(given.at.error(format!("reflectance is {}; it must lie between 0 and 1", given.value)));
            }
            let reflectance = given.map_or(DEFAULT_REFLECTANCE, |given| given.value);
            Bsdf::Diffuse { reflectance, two_sided: false }
        }
        "null" => Bsdf::Null,
        "twosided" => {
            let inside = props.children(Kind::Bsdf);
            let [inner] = inside[..] else {
                return Err(child.object.at.error(format!(
                    "<bsdf type=\"twosided\"> holds {} BSDFs; it must hold one, of type \"diffuse\"",
                    inside.len()
                )));
            };
            if inner.object.plugin != "diffuse" {
                return Err(inner.at.error(format!(
                    "<bsdf type=\"twosided\"> cannot hold {}; it must hold one of type \"diffuse\"",
                    inner.object.describe()
                )));
            }
            match convert(context, inner)? {
                Bsdf::Diffuse { reflectance, .. } => Bsdf::Diffuse { reflectance, two_sided: true },
                Bsdf::Null => Bsdf::Null,
            }
        }
        _ => return Err(unknown_plugin(child.object, &TYPES)),
    };
    props.finish()?;
    Ok(bsdf)
}
