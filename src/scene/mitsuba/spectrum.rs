//! `<spectrum>`: from a list, a file or a plugin to three channels.

use glam::DVec3;

use super::props::{Given, Props, unknown_plugin};
use super::tree::{Kind, ObjectId, Tree, Value};
use super::values;
use crate::scene::SceneError;
use crate::scene::error::Location;
use crate::scene::spectrum::{Illuminant, blackbody, to_rgb};

pub(super) const TYPES: [&str; 5] = ["uniform", "d65", "blackbody", "regular", "irregular"];

/// What a spectrum is the spectrum of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Meaning {
    /// Radiance, intensity or irradiance.
    Emitted,
    /// A coefficient, an index of refraction: any value, as daylight shows it.
    Factor,
    /// A reflectance or an albedo, which does not exceed 1.
    Fraction,
}

impl Meaning {
    /// Three channels of a list; what is out of the gamut of sRGB is moved to its border and said, as Mitsuba does.
    fn color(self, samples: &[(f64, f64)], tree: &Tree, at: &Location) -> DVec3 {
        let illuminant = if self == Meaning::Emitted { Illuminant::Emitted } else { Illuminant::D65 };
        let color = to_rgb(samples, illuminant);
        let most = if self == Meaning::Fraction { 1.0 } else { f64::INFINITY };
        let inside = color.clamp(DVec3::ZERO, DVec3::splat(most));
        if inside != color {
            let text =
                format!("the colour of this spectrum, {color} in sRGB, is outside of its gamut; it becomes {inside}");
            tree.warn(at.warning(text));
        }
        inside
    }

    /// A constant spectrum of 1. What is emitted is white point E, which is reddish in sRGB, whose white is D65: the XYZ to sRGB
    /// matrix (IEC 61966-2-1) times (1, 1, 1). Mitsuba 3.9 converts in the same way.
    fn one(self) -> DVec3 {
        match self {
            Meaning::Emitted => DVec3::new(1.204_794, 0.948_291, 0.908_916),
            _ => DVec3::ONE,
        }
    }
}

/// The three channels of a value, if it has any.
pub(super) fn color_of(
    tree: &Tree,
    value: &Value,
    at: &Location,
    meaning: Meaning,
) -> Result<Option<DVec3>, SceneError> {
    Ok(Some(match value {
        Value::Rgb(v) => *v,
        Value::Float(v) => DVec3::splat(*v),
        Value::Integer(v) => DVec3::splat(*v as f64),
        Value::Spectrum(v) => *v * meaning.one(),
        Value::Samples(samples) => meaning.color(samples, tree, at),
        Value::Object(id) if tree.objects[*id].kind == Kind::Spectrum => plugin(tree, *id, meaning)?,
        _ => return Ok(None),
    }))
}

/// `<spectrum type="…">`.
fn plugin(tree: &Tree, id: ObjectId, meaning: Meaning) -> Result<DVec3, SceneError> {
    let object = &tree.objects[id];
    let props = Props::new(tree, object);
    let needed =
        |name: &str, tag: &str| object.at.error(format!("{} needs <{tag} name=\"{name}\"/>", object.describe()));
    let numbers = |name: &'static str| -> Result<Vec<f64>, SceneError> {
        let given = props.string(name)?.ok_or_else(|| needed(name, "string"))?;
        values::floats(&given.value).map_err(|message| given.at.error(message))
    };
    let color = match object.plugin.as_str() {
        // Mitsuba's RGB variants take the value for all three channels, unlike that of a <spectrum> without a type.
        "uniform" => DVec3::splat(props.float("value")?.map_or(1.0, |given| given.value)),
        // White, since the white of sRGB is this.
        "d65" => {
            let scale = props.float("scale")?.map_or(1.0, |given| given.value);
            props.color("color")?.map_or(DVec3::ONE, |given| given.value) * scale
        }
        "blackbody" => {
            let temperature = props.float("temperature")?.ok_or_else(|| needed("temperature", "float"))?;
            if temperature.value <= 0.0 || meaning != Meaning::Emitted {
                return Err(temperature.at.error(match meaning {
                    Meaning::Emitted => format!("temperature is {} K; it must be greater than 0", temperature.value),
                    _ => "only what emits can have the spectrum of a black body".to_owned(),
                }));
            }
            let color = blackbody(temperature.value);
            let inside = color.max(DVec3::ZERO);
            if inside != color {
                let text = format!("{color} is outside of the gamut of sRGB; it becomes {inside}");
                tree.warn(temperature.at.warning(text));
            }
            inside
        }
        "regular" => {
            let (first, last) = (props.float("wavelength_min")?, props.float("wavelength_max")?);
            let first = first.ok_or_else(|| needed("wavelength_min", "float"))?;
            let last = last.ok_or_else(|| needed("wavelength_max", "float"))?;
            let values = numbers("values")?;
            let step = (last.value - first.value) / (values.len().max(2) - 1) as f64;
            let samples = values.iter().enumerate().map(|(k, v)| (first.value + step * k as f64, *v)).collect();
            meaning.color(&checked(samples).map_err(|message| first.at.error(message))?, tree, &object.at)
        }
        "irregular" => {
            let (wavelengths, values) = (numbers("wavelengths")?, numbers("values")?);
            if wavelengths.len() != values.len() {
                let (w, v) = (wavelengths.len(), values.len());
                return Err(object.at.error(format!("there are {w} wavelengths but {v} values")));
            }
            let samples = checked(wavelengths.into_iter().zip(values).collect());
            meaning.color(&samples.map_err(|message| object.at.error(message))?, tree, &object.at)
        }
        _ => return Err(unknown_plugin(object, &TYPES)),
    };
    props.finish()?;
    Ok(color)
}

/// `400:0.1, 500:0.2`: wavelengths in nm with values.
pub(super) fn samples(text: &str) -> Result<Vec<(f64, f64)>, String> {
    let pair = |token: &str| {
        let (wavelength, value) = token.split_once(':').ok_or_else(|| {
            format!(
                "\"{token}\" is not a wavelength and a value; a <spectrum> is one number or like \"400:0.1, 500:0.2\""
            )
        })?;
        Ok((values::float(wavelength)?, values::float(value)?))
    };
    let tokens = text.split(|c: char| c == ',' || c.is_whitespace()).filter(|token| !token.is_empty());
    checked(tokens.map(pair).collect::<Result<_, String>>()?)
}

/// The lines of an `.spd` file: a wavelength in nm and a value in each, `#` begins a comment. An error comes with its line, from
/// 1.
pub(super) fn file(text: &str) -> Result<Vec<(f64, f64)>, (u32, String)> {
    let mut samples: Vec<(f64, f64)> = Vec::new();
    let mut lines = 0;
    for line in text.lines() {
        lines += 1;
        let wrong = |message: String| (lines, message);
        let line = line.split('#').next().unwrap_or_default();
        match values::floats(line).map_err(wrong)?[..] {
            [] => {}
            [wavelength, _] if samples.last().is_some_and(|(last, _)| *last >= wavelength) => {
                return Err((
                    lines,
                    format!("wavelengths must ascend, but {wavelength} is not greater than the last one"),
                ));
            }
            [wavelength, value] => samples.push((wavelength, value)),
            ref other => return Err((lines, format!("{} numbers; a line has a wavelength and a value", other.len()))),
        }
    }
    checked(samples).map_err(|message| (lines.max(1), message))
}

fn checked(samples: Vec<(f64, f64)>) -> Result<Vec<(f64, f64)>, String> {
    if samples.len() < 2 {
        return Err(format!("a spectrum needs at least two wavelengths; this one has {}", samples.len()));
    }
    let finite = samples.iter().all(|(w, v)| w.is_finite() && v.is_finite());
    match samples.windows(2).find(|pair| pair[0].0 >= pair[1].0) {
        None if finite => Ok(samples),
        None => Err("a wavelength or a value is not finite".to_owned()),
        Some(pair) => Err(format!("wavelengths must ascend, but {} is followed by {}", pair[0].0, pair[1].0)),
    }
}

/// A colour and where it stands.
pub(super) type Color<'a> = Given<'a, DVec3>;
