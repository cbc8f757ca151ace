//! `<film>` and `<sampler>`: how many pixels, and how many samples in each.

use super::build::Context;
use super::props::{Child, Props, unknown_plugin};
use super::tree::Kind;
use crate::scene::{Crop, Film, SceneError};

pub(super) const FILM_TYPES: [&str; 1] = ["hdrfilm"];
pub(super) const SAMPLER_TYPES: [&str; 5] = ["independent", "stratified", "multijitter", "orthogonal", "ldsampler"];
pub(super) const FILTER_TYPES: [&str; 6] = ["box", "tent", "gaussian", "mitchell", "catmullrom", "lanczos"];

/// The film that Mitsuba takes where a sensor has none.
pub(super) fn default_film() -> Film {
    Film::new(768, 576)
}

/// Samples a pixel that Mitsuba takes where a scene does not say.
pub(super) const DEFAULT_SAMPLE_COUNT: u32 = 4;

/// The size of the film and its crop window.
pub(super) fn convert<'a>(context: &mut Context<'a>, child: Child<'a>) -> Result<Film, SceneError> {
    if !FILM_TYPES.contains(&child.object.plugin.as_str()) {
        return Err(unknown_plugin(child.object, &FILM_TYPES));
    }
    let props = context.props(child);
    let whole = default_film();
    let width = side(&props, "width", whole.width)?;
    let height = side(&props, "height", whole.height)?;
    let columns = span(&props, "crop_offset_x", "crop_width", ("width", width))?;
    let rows = span(&props, "crop_offset_y", "crop_height", ("height", height))?;
    let crop = Crop { x: columns.0, y: rows.0, width: columns.1, height: rows.1 };
    let pixels = u64::from(crop.width) * u64::from(crop.height);
    if pixels > Film::MAX_PIXELS {
        return Err(child.object.at.error(format!(
            "{} x {} pixels are to be rendered, which is more than the limit of {}; make the film smaller, or render \
             it in crop windows",
            crop.width,
            crop.height,
            Film::MAX_PIXELS
        )));
    }

    match props.string("pixel_format")? {
        Some(given) if !matches!(given.value.to_ascii_lowercase().as_str(), "rgb" | "rgba") => {
            let text = format!("the image is written as RGB, not as \"{}\"", given.value);
            context.warnings.push(given.at.warning(text));
        }
        _ => {}
    }
    // What the file is like is up to the command line; the others do not matter with a box filter of one pixel.
    props.string("component_format")?;
    props.string("file_format")?;
    props.ignore_boolean("compensate")?;
    props.ignore_boolean("sample_border")?;
    let filter = props.child(Kind::Rfilter)?;
    props.finish()?;
    match filter {
        Some(filter) => self::filter(context, filter)?,
        None => {
            let text = "a box filter of one pixel is used, where Mitsuba's default is \"gaussian\"; add \
                        <rfilter type=\"box\"/> for the same picture in both";
            context.warnings.push(child.object.at.warning(text));
        }
    }
    Ok(Film { width, height, crop })
}

/// One side of the film.
fn side(props: &Props, name: &'static str, default: u32) -> Result<u32, SceneError> {
    let Some(given) = props.integer(name)? else { return Ok(default) };
    match u32::try_from(given.value) {
        Ok(side @ 1..=Film::MAX_SIDE) => Ok(side),
        _ => Err(given.at.error(format!("{name} is {}; it must lie between 1 and {}", given.value, Film::MAX_SIDE))),
    }
}

/// First pixel and number of pixels of the crop window on one axis. As in Mitsuba, the size does not shrink to fit the
/// offset.
fn span(
    props: &Props,
    offset_name: &'static str,
    size_name: &'static str,
    (side_name, side): (&str, u32),
) -> Result<(u32, u32), SceneError> {
    let (offset, size) = (props.integer(offset_name)?, props.integer(size_name)?);
    let Some(at) = size.as_ref().or(offset.as_ref()).map(|given| given.at) else { return Ok((0, side)) };
    let offset = offset.map_or(0, |given| given.value);
    let size = size.map_or(i64::from(side), |given| given.value);
    match (u32::try_from(offset), u32::try_from(size)) {
        (Ok(first), Ok(count @ 1..)) if first.checked_add(count).is_some_and(|end| end <= side) => Ok((first, count)),
        _ => Err(at.error(format!(
            "the crop window does not lie in the film: {offset_name} {offset} and {size_name} {size} with {side_name} \
             {side}"
        ))),
    }
}

fn filter<'a>(context: &mut Context<'a>, child: Child<'a>) -> Result<(), SceneError> {
    let plugin = child.object.plugin.as_str();
    if !FILTER_TYPES.contains(&plugin) {
        return Err(unknown_plugin(child.object, &FILTER_TYPES));
    }
    let props = context.props(child);
    if plugin != "box" {
        for name in ["stddev", "radius", "lobes", "A", "B"] {
            props.float(name)?;
        }
        let text = format!("a box filter of one pixel is used, not \"{plugin}\"");
        context.warnings.push(child.at.warning(text));
    }
    props.finish()
}

/// Samples a pixel. The sampler's type does not matter: there is one, and it is better than these.
pub(super) fn sample_count<'a>(context: &Context<'a>, child: Child<'a>) -> Result<u32, SceneError> {
    if !SAMPLER_TYPES.contains(&child.object.plugin.as_str()) {
        return Err(unknown_plugin(child.object, &SAMPLER_TYPES));
    }
    let props = context.props(child);
    let count = props.integer("sample_count")?;
    props.integer("seed")?;
    props.ignore_boolean("jitter")?;
    props.integer("strength")?;
    props.finish()?;
    match count {
        None => Ok(DEFAULT_SAMPLE_COUNT),
        Some(given) => match u32::try_from(given.value) {
            Ok(count @ 1..) => Ok(count),
            _ => {
                Err(given.at.error(format!("sample_count is {}; it must lie between 1 and {}", given.value, u32::MAX)))
            }
        },
    }
}
