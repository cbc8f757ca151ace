//! `<texture>`: images and patterns, and the files that they and environment maps come from.

use std::sync::Arc;

use glam::{DAffine2, DMat4, DVec3};

use super::build::Context;
use super::props::{Child, Colored, Given, Props, unknown_plugin};
use super::source;
use crate::scene::error::Location;
use crate::scene::{Bitmap, Filter, SceneError, Texture, Wrap, bitmap};

pub(super) const TYPES: [&str; 3] = ["bitmap", "checkerboard", "mesh_attribute"];

/// A reflectance or another factor that must lie in \[0, 1\], constant or textured.
pub(super) fn fraction<'a>(
    context: &mut Context<'a>,
    props: &Props<'a>,
    name: &'static str,
    default: f64,
) -> Result<Texture, SceneError> {
    match props.color_or_texture(name)? {
        None => Ok(DVec3::splat(default).into()),
        Some(Colored::Constant(given)) => {
            refuse_outside(name, given.value, given.at)?;
            Ok(given.value.into())
        }
        Some(Colored::Texture(child)) => {
            let texture = convert(context, child)?;
            match &texture {
                Texture::Constant(color) => refuse_outside(name, *color, child.at)?,
                Texture::Checkerboard { color0, color1, .. } => {
                    refuse_outside(name, *color0, child.at)?;
                    refuse_outside(name, *color1, child.at)?;
                }
                Texture::Bitmap { bitmap, .. } | Texture::Attribute { bitmap } => {
                    let outside = |pixel: &[f32; 3]| pixel.iter().any(|value| !(0.0..=1.0).contains(value));
                    // Of the four pixels of an attribute's triangle the last one is no value of it.
                    let attribute = !texture.needs_uvs();
                    let counts = |index: usize| {
                        let (x, y) = (index % bitmap.width() as usize, index / bitmap.width() as usize);
                        !attribute || x % 2 == 0 || y % 2 == 0
                    };
                    let pixels = || bitmap.pixels().iter().enumerate();
                    if let Some((index, [r, g, b])) = pixels().find(|(index, pixel)| counts(*index) && outside(pixel)) {
                        if attribute {
                            return Err(child.at.error(format!(
                                "{name} is [{r}, {g}, {b}] at a corner of the mesh; it must lie between 0 and 1"
                            )));
                        }
                        let (width, [r, g, b]) = (bitmap.width() as usize, bitmap.pixels()[index]);
                        let (x, y) = (index % width, index / width);
                        return Err(child.at.error(format!(
                            "{name} is [{r}, {g}, {b}] in pixel ({x}, {y}) of the image; it must lie between 0 and 1"
                        )));
                    }
                }
            }
            Ok(texture)
        }
    }
}

fn refuse_outside(name: &str, value: DVec3, at: &Location) -> Result<(), SceneError> {
    if value.min_element() < 0.0 || value.max_element() > 1.0 {
        return Err(at.error(format!("{name} is {value}; it must lie between 0 and 1")));
    }
    Ok(())
}

/// A factor without colour: the mean of a colour's channels, the luminance of an image's pixels, as in Mitsuba 3.9.1.
pub(super) fn gray_fraction<'a>(
    context: &mut Context<'a>,
    props: &Props<'a>,
    name: &'static str,
    default: f64,
) -> Result<Texture, SceneError> {
    fraction(context, props, name, default).map(gray)
}

/// A texture without colour.
pub(super) fn gray(texture: Texture) -> Texture {
    let mean = |color: DVec3| DVec3::splat(color.element_sum() / 3.0);
    match texture {
        Texture::Constant(color) => mean(color).into(),
        Texture::Checkerboard { color0, color1, to_uv } => {
            Texture::Checkerboard { color0: mean(color0), color1: mean(color1), to_uv }
        }
        Texture::Bitmap { bitmap, filter, wrap, to_uv } => {
            Texture::Bitmap { bitmap: gray_image(bitmap), filter, wrap, to_uv }
        }
        Texture::Attribute { bitmap } => Texture::Attribute { bitmap: gray_image(bitmap) },
    }
}

fn gray_image(bitmap: Arc<Bitmap>) -> Arc<Bitmap> {
    let gray = bitmap.pixels().iter().all(|[r, g, b]| r == g && g == b);
    if gray { bitmap } else { Arc::new(bitmap.map(|pixel| [bitmap::luminance(pixel); 3])) }
}

/// A texture.
pub(super) fn convert<'a>(context: &mut Context<'a>, child: Child<'a>) -> Result<Texture, SceneError> {
    let props = context.props(child);
    match child.object.plugin.as_str() {
        "bitmap" => {
            let filter =
                choice(&props, "filter_type", &[("bilinear", Filter::Bilinear), ("nearest", Filter::Nearest)])?;
            let wraps = [("repeat", Wrap::Repeat), ("mirror", Wrap::Mirror), ("clamp", Wrap::Clamp)];
            let wrap = choice(&props, "wrap_mode", &wraps)?;
            let raw = props.boolean("raw")?.is_some_and(|given| given.value);
            let to_uv = to_uv(&props)?;
            // How Mitsuba stores the pixels, and whether a GPU's texture units look them up.
            props.string("format")?;
            props.ignore_boolean("accel")?;
            let bitmap = image(context, child, &props, raw)?;
            props.finish()?;
            Ok(Texture::Bitmap { bitmap, filter, wrap, to_uv })
        }
        "checkerboard" => {
            let color = |name, default| {
                Ok::<DVec3, SceneError>(props.fraction(name)?.map_or(DVec3::splat(default), |given| given.value))
            };
            let (color0, color1) = (color("color0", 0.4)?, color("color1", 0.2)?);
            let to_uv = to_uv(&props)?;
            props.finish()?;
            Ok(Texture::Checkerboard { color0, color1, to_uv })
        }
        "mesh_attribute" => {
            let name = props.string("name")?.ok_or_else(|| {
                let what = child.object.describe();
                child
                    .object
                    .at
                    .error(format!("{what} needs <string name=\"name\" value=\"vertex_color\"/>, or another attribute"))
            })?;
            let scale = props.float("scale")?.map_or(1.0, |given| given.value);
            props.finish()?;
            let image = context.attributes.image(&name.value, scale).map_err(|message| name.at.error(message))?;
            Ok(match image {
                None => Texture::Constant(DVec3::splat(0.5)),
                Some(bitmap) => Texture::Attribute { bitmap },
            })
        }
        _ => Err(unknown_plugin(child.object, &TYPES)),
    }
}

/// The image that `filename` names. Files that are named twice are read once.
pub(super) fn image<'a>(
    context: &mut Context<'a>,
    child: Child<'a>,
    props: &Props<'a>,
    raw: bool,
) -> Result<Arc<Bitmap>, SceneError> {
    let filename = props.string("filename")?.ok_or_else(|| {
        let what = child.object.describe();
        child.object.at.error(format!("{what} needs <string name=\"filename\" value=\"…\"/>"))
    })?;
    let path = source::find(&filename.value, child.object.folders.iter());
    if let Some(known) = context.images.get(&(path.clone(), raw)) {
        return Ok(known.clone());
    }
    let read = Bitmap::read(&path, raw)
        .map_err(|cause| filename.at.error(format!("cannot read the image {}: {cause}", path.display())))?;
    let read = Arc::new(read);
    context.images.insert((path, raw), read.clone());
    Ok(read)
}

/// One of some words; the first if none is given.
pub(super) fn choice<T: Copy>(props: &Props, name: &'static str, words: &[(&str, T)]) -> Result<T, SceneError> {
    let Some(given) = props.string(name)? else { return Ok(words[0].1) };
    let wanted = given.value.to_ascii_lowercase();
    words.iter().find(|(word, _)| *word == wanted).map(|(_, value)| *value).ok_or_else(|| {
        let accepted: Vec<&str> = words.iter().map(|(word, _)| *word).collect();
        given.at.error(format!("{name} is \"{}\"; accepted: {}", given.value, accepted.join(", ")))
    })
}

/// The part of `to_uv` that acts on x and y.
fn to_uv(props: &Props) -> Result<DAffine2, SceneError> {
    let Some(Given { value: m, at }) = props.transform("to_uv")? else { return Ok(DAffine2::IDENTITY) };
    let DMat4 { x_axis, y_axis, w_axis, .. } = m;
    if x_axis.z != 0.0 || x_axis.w != 0.0 || y_axis.z != 0.0 || y_axis.w != 0.0 {
        return Err(at.error("to_uv turns the plane of texture coordinates out of itself; only rotations about z, scales and translations are accepted"));
    }
    Ok(DAffine2::from_cols(x_axis.truncate().truncate(), y_axis.truncate().truncate(), w_axis.truncate().truncate()))
}
