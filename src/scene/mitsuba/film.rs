//! `<film>` and `<sampler>`: how many pixels, and how many samples in each.

use super::build::Context;
use super::props::{Child, Props, unknown_plugin};
use super::texture::choice;
use super::tree::Kind;
use crate::scene::{Colors, Crop, Film, PixelFormat, ReconstructionFilter, SceneError};

pub(super) const FILM_TYPES: [&str; 1] = ["hdrfilm"];
pub(super) const SAMPLER_TYPES: [&str; 5] = ["independent", "stratified", "multijitter", "orthogonal", "ldsampler"];
pub(super) const FILTER_TYPES: [&str; 6] = ["box", "tent", "gaussian", "mitchell", "catmullrom", "lanczos"];

/// The film that Mitsuba takes where a sensor has none.
pub(super) fn default_film() -> Film {
    Film { filter: ReconstructionFilter::DEFAULT, ..Film::new(768, 576) }
}

/// How far a filter may reach, in pixels.
const MAX_FILTER_RADIUS: f64 = 32.0;

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

    let pixel_format = pixel_format(&props)?;
    // Sums are exact here without compensation.
    props.ignore_boolean("compensate")?;
    // Of Mitsuba's older versions; newer ones read over it.
    props.ignore_boolean("banner")?;
    let beyond = props.boolean("sample_border")?.is_some_and(|given| given.value);
    let filter = props.child(Kind::Rfilter)?;
    props.finish()?;
    let filter = match filter {
        Some(filter) => self::filter(context, filter)?,
        None => ReconstructionFilter::DEFAULT,
    };
    let sample_area = if beyond { None } else { Some(crop) };
    Ok(Film { width, height, crop, filter, sample_area, pixel_format })
}

/// How pixels are written.
fn pixel_format(props: &Props) -> Result<PixelFormat, SceneError> {
    let formats = [
        ("rgb", (Colors::Rgb, false)),
        ("rgba", (Colors::Rgb, true)),
        ("xyz", (Colors::Xyz, false)),
        ("xyza", (Colors::Xyz, true)),
        ("luminance", (Colors::Luminance, false)),
        ("luminance_alpha", (Colors::Luminance, true)),
    ];
    let (colors, alpha) = choice(props, "pixel_format", &formats)?;
    // Mitsuba's default is float16, which is a matter of the file alone: here nothing is lost unless the scene asks for it.
    let half = choice(props, "component_format", &[("float32", false), ("float16", true)])?;
    choice(props, "file_format", &[("openexr", ()), ("exr", ())])?;
    Ok(PixelFormat { colors, alpha, half })
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

/// A reconstruction filter.
fn filter<'a>(context: &Context<'a>, child: Child<'a>) -> Result<ReconstructionFilter, SceneError> {
    let props = context.props(child);
    // A length in pixels. Wider filters than the limit would have no use, and their tables none of their accuracy.
    let length = |name, default: f64, most: f64| match props.float(name)? {
        None => Ok(default),
        Some(given) if given.value > 0.0 && given.value <= most => Ok(given.value),
        Some(given) => Err(given.at.error(format!(
            "{name} of a filter is {}; it must be greater than 0 and at most {most} pixels",
            given.value
        ))),
    };
    let weight = |name, default: f64| match props.float(name)? {
        None => Ok(default),
        Some(given) if (-1.0..=1.0).contains(&given.value) => Ok(given.value),
        Some(given) => {
            Err(given.at.error(format!("{name} of a filter is {}; it must lie between -1 and 1", given.value)))
        }
    };
    let filter = match child.object.plugin.as_str() {
        "box" => ReconstructionFilter::Box { radius: length("radius", 0.5, MAX_FILTER_RADIUS)? },
        "tent" => ReconstructionFilter::Tent { radius: length("radius", 1.0, MAX_FILTER_RADIUS)? },
        "gaussian" => ReconstructionFilter::Gaussian { stddev: length("stddev", 0.5, MAX_FILTER_RADIUS / 4.0)? },
        "mitchell" => ReconstructionFilter::Mitchell { b: weight("B", 1.0 / 3.0)?, c: weight("C", 1.0 / 3.0)? },
        "catmullrom" => ReconstructionFilter::CATMULL_ROM,
        "lanczos" => match props.integer("lobes")? {
            None => ReconstructionFilter::Lanczos { lobes: 3.0 },
            Some(given) if (1..=MAX_FILTER_RADIUS as i64).contains(&given.value) => {
                ReconstructionFilter::Lanczos { lobes: given.value as f64 }
            }
            Some(given) => {
                let text = format!("lobes is {}; it must lie between 1 and {MAX_FILTER_RADIUS}", given.value);
                return Err(given.at.error(text));
            }
        },
        _ => return Err(unknown_plugin(child.object, &FILTER_TYPES)),
    };
    props.finish()?;
    Ok(filter)
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
