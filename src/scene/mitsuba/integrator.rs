//! `<integrator>`: how long paths may get.

use super::build::Context;
use super::props::{Child, Given, Props, unknown_plugin};
use super::suggest::list;
use super::tree::Kind;
use crate::scene::{Aov, AovKind, Integrator, SceneError};

pub(super) const TYPES: [&str; 7] = ["volpath", "volpathmis", "path", "ptracer", "direct", "moment", "aov"];

/// The integrator of the scene. All types stand for the same estimator; `direct` is one of depth 2, and `moment` and `aov` are
/// the one inside of them.
pub(super) fn convert<'a>(context: &mut Context<'a>, child: Child<'a>) -> Result<Integrator, SceneError> {
    let plugin = child.object.plugin.as_str();
    if !TYPES.contains(&plugin) {
        return Err(unknown_plugin(child.object, &TYPES));
    }
    let props = context.props(child);
    if matches!(plugin, "moment" | "aov") {
        return wrapped(context, child, props);
    }
    let mut integrator = Integrator::default();
    if plugin == "direct" {
        integrator.max_depth = Some(2);
        // How often Mitsuba samples in each way.
        for name in ["shading_samples", "emitter_samples", "bsdf_samples"] {
            props.integer(name)?;
        }
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
    if let Some(timeout) = props.float("timeout")?
        && timeout.value > 0.0
    {
        let text = format!("the timeout has no effect; use --time-limit {}s", timeout.value);
        context.warnings.push(timeout.at.warning(text));
    }
    props.finish()?;
    Ok(integrator)
}

/// The integrator inside of `moment` or `aov`.
fn wrapped<'a>(context: &mut Context<'a>, child: Child<'a>, props: Props<'a>) -> Result<Integrator, SceneError> {
    let inside = props.children(Kind::Integrator);
    if child.object.plugin == "aov"
        && let Some(given) = props.string("aovs")?
    {
        let tokens = given.value.split([',', ' ']).filter(|token| !token.is_empty());
        let read = tokens.map(|token| aov(token, &given)).collect::<Result<Vec<Aov>, SceneError>>()?;
        for aov in &read {
            if aov.name.is_empty() || read.iter().filter(|other| other.name == aov.name).count() > 1 {
                return Err(given.at.error(format!("aovs needs a name of its own for each; \"{}\" is not", aov.name)));
            }
        }
        context.aovs = read;
    }
    props.integer("block_size")?;
    props.integer("samples_per_pass")?;
    props.finish()?;
    if child.object.plugin == "aov" && inside.is_empty() {
        // As in Mitsuba, there are the channels alone: the radiance is 0.
        return Ok(Integrator { max_depth: Some(1), hide_emitters: true, ..Integrator::default() });
    }
    let [inner] = inside[..] else {
        let (what, count) = (child.object.describe(), inside.len());
        return Err(child.object.at.error(format!("{what} holds {count} integrators; it must hold one")));
    };
    // One could hold itself by a <ref>.
    let plugin = inner.object.plugin.as_str();
    if plugin == "moment" || (plugin == "aov" && child.object.plugin == "aov") {
        let (what, found) = (child.object.describe(), inner.object.describe());
        return Err(inner.at.error(format!("{what} cannot hold {found}; it must hold one that renders")));
    }
    name_moments(context, child, inner)?;
    convert(context, inner)
}

/// Names the channels of second moments as Mitsuba does, by the integrators inside of `moment`, with dots between them.
fn name_moments(context: &mut Context, child: Child, inner: Child) -> Result<(), SceneError> {
    // Mitsuba's name of what has none.
    let name = inner.name.unwrap_or("_arg_0");
    let name = match &context.moments {
        Some(outer) => format!("{outer}.{name}"),
        None if child.object.plugin == "moment" => name.to_owned(),
        None => return Ok(()),
    };
    if name.len() > LONGEST_NAME {
        return Err(inner.at.error(format!("the name of the integrator is longer than {LONGEST_NAME} bytes")));
    }
    if context.aovs.iter().any(|aov| aov.name == format!("m2_{name}")) {
        return Err(child.at.error(format!("aovs has the name \"m2_{name}\", which is that of the second moments")));
    }
    context.moments = Some(name);
    Ok(())
}

/// Bytes of a name of channels that an OpenEXR file can hold with what is added to it.
const LONGEST_NAME: usize = 200;

/// One `name:type` of `aovs`.
fn aov(token: &str, given: &Given<String>) -> Result<Aov, SceneError> {
    let kinds = || AovKind::ALL.iter().map(|(name, ..)| *name);
    let found = token
        .split_once(':')
        .and_then(|(name, kind)| Some((name, AovKind::ALL.iter().find(|(known, ..)| *known == kind)?)));
    match found {
        Some((name, (_, kind, _))) => Ok(Aov { name: name.to_owned(), kind: *kind }),
        None => Err(given.at.error(format!(
            "aovs has \"{token}\"; accepted: pairs name:type with commas between them, and of types {}",
            list(kinds())
        ))),
    }
}

/// Mitsuba's surface integrators see no media; ours always does.
pub(super) fn warn_about_media<'a>(context: &mut Context<'a>, child: Child<'a>) {
    // What a wrapper holds was checked when it was read.
    let mut inner = child;
    while let Some(next) = context.props(inner).children(Kind::Integrator).first() {
        inner = *next;
    }
    let plugin = inner.object.plugin.as_str();
    if matches!(plugin, "path" | "ptracer" | "direct") && !context.media.is_empty() {
        let text = format!("the media of the scene are rendered, which Mitsuba's \"{plugin}\" would ignore");
        context.warnings.push(child.at.warning(text));
    }
}
