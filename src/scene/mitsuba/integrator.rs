//! `<integrator>`: how long paths may get.

use super::build::Context;
use super::props::{Child, unknown_plugin};
use crate::scene::{Integrator, SceneError};

const TYPES: [&str; 4] = ["volpath", "volpathmis", "path", "direct"];

/// The integrator of the scene. All types stand for the same estimator; `direct` is one of depth 2.
pub(super) fn convert<'a>(context: &Context<'a>, child: Child<'a>) -> Result<Integrator, SceneError> {
    let plugin = child.object.plugin.as_str();
    if !TYPES.contains(&plugin) {
        return Err(unknown_plugin(child.object, &TYPES));
    }
    let props = context.props(child);
    let mut integrator = Integrator::default();
    if plugin == "direct" {
        integrator.max_depth = Some(2);
    } else {
        if let Some(depth) = props.integer("max_depth")? {
            integrator.max_depth = match depth.value {
                -1 => None,
                1.. => Some(u32::try_from(depth.value).unwrap_or(u32::MAX)),
                other => {
                    return Err(depth
                        .at
                        .error(format!("max_depth is {other}; it must be -1 (no limit) or at least 1")));
                }
            };
        }
        if let Some(depth) = props.integer("rr_depth")? {
            if depth.value < 1 {
                return Err(depth.at.error(format!("rr_depth is {}; it must be at least 1", depth.value)));
            }
            integrator.rr_depth = u32::try_from(depth.value).unwrap_or(u32::MAX);
        }
        if plugin == "volpathmis" {
            props.ignore_boolean("use_spectral_mis")?;
        }
    }
    if let Some(hide) = props.boolean("hide_emitters")? {
        integrator.hide_emitters = hide.value;
    }
    // How Mitsuba cuts the work up, which does not change what is computed.
    props.integer("block_size")?;
    props.integer("samples_per_pass")?;
    props.finish()?;
    Ok(integrator)
}

/// Mitsuba's surface integrators see no media; ours always does.
pub(super) fn warn_about_media<'a>(context: &mut Context<'a>, child: Child<'a>) {
    let plugin = child.object.plugin.as_str();
    if matches!(plugin, "path" | "direct") && !context.media.is_empty() {
        let text = format!("the media of the scene are rendered, which Mitsuba's \"{plugin}\" would ignore");
        context.warnings.push(child.at.warning(text));
    }
}
