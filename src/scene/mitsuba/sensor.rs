//! `<sensor>`: the camera, its film and its sampler.

use glam::{DMat4, DVec2, DVec3};

use super::build::Context;
use super::film;
use super::props::{Child, Given, Props, unknown_plugin};
use super::transform::rigid;
use super::tree::Kind;
use crate::scene::{Camera, Film, Lens, SceneError};

pub(super) const TYPES: [&str; 3] = ["perspective", "thinlens", "orthographic"];
const FOV_AXES: [&str; 5] = ["x", "y", "smaller", "larger", "diagonal"];

/// What a sensor says.
pub(super) struct Sensor {
    pub camera: Camera,
    pub film: Film,
    pub sample_count: u32,
}

/// A camera.
pub(super) fn convert<'a>(context: &mut Context<'a>, child: Child<'a>) -> Result<Sensor, SceneError> {
    if !TYPES.contains(&child.object.plugin.as_str()) {
        return Err(unknown_plugin(child.object, &TYPES));
    }
    let props = context.props(child);
    let film = match props.child(Kind::Film)? {
        Some(film) => film::convert(context, film)?,
        None => {
            let text = "the sensor has no film; it gets Mitsuba's of 768 x 576 pixels";
            context.warnings.push(child.object.at.warning(text));
            film::default_film()
        }
    };
    let sample_count = match props.child(Kind::Sampler)? {
        Some(sampler) => film::sample_count(context, sampler)?,
        None => film::DEFAULT_SAMPLE_COUNT,
    };
    let medium = match props.child(Kind::Medium)? {
        Some(medium) => Some(context.medium(medium)?),
        None => None,
    };
    let (near_clip, far_clip) = clip_planes(&props, child)?;
    let given = props.transform("to_world")?;
    // Nothing moves.
    props.float("shutter_open")?;
    props.float("shutter_close")?;
    let focus = props.float("focus_distance")?;
    let camera = if child.object.plugin == "orthographic" {
        orthographic(given, &film, near_clip, far_clip)?
    } else {
        let to_world = given.map_or(Ok(DMat4::IDENTITY), |given| rigid(given, "the camera's to_world"))?;
        let fov_x = fov_x(&props, child, &film)?;
        let (lens, principal_point_offset) = if child.object.plugin == "thinlens" {
            (thin_lens(&props, child, focus, far_clip)?, DVec2::ZERO)
        } else {
            let offset = |name| Ok::<f64, SceneError>(props.float(name)?.map_or(0.0, |given| given.value));
            (Lens::Pinhole, DVec2::new(offset("principal_point_offset_x")?, offset("principal_point_offset_y")?))
        };
        Camera { to_world, fov_x, near_clip, far_clip, principal_point_offset, lens, medium: None }
    };
    props.finish()?;
    Ok(Sensor { camera: Camera { medium, ..camera }, film, sample_count })
}

/// The lens of a `thinlens` camera.
fn thin_lens(props: &Props, child: Child, focus: Option<Given<f64>>, far_clip: f64) -> Result<Lens, SceneError> {
    let positive = |name: &str, given: &Given<f64>| match given.value {
        value if value > 0.0 => Ok(value),
        value => Err(given.at.error(format!("{name} is {value}; it must be greater than 0"))),
    };
    let aperture = props.float("aperture_radius")?.ok_or_else(|| {
        let what = child.object.describe();
        child.object.at.error(format!("{what} needs <float name=\"aperture_radius\" value=\"…\"/>"))
    })?;
    let aperture_radius = positive("aperture_radius", &aperture)?;
    // As in Mitsuba, what is in focus by default is the far clip plane.
    let focus_distance = focus.map_or(Ok(far_clip), |given| positive("focus_distance", &given))?;
    Ok(Lens::Thin { aperture_radius, focus_distance })
}

/// A camera that sees the square [-1, 1]² of the xy plane, as far as the film is square, along +z. The matrix may stretch each axis. As
/// in Mitsuba the stretching along z acts on the near plane but not on the distance to the far plane.
fn orthographic(given: Option<Given<DMat4>>, film: &Film, near: f64, far: f64) -> Result<Camera, SceneError> {
    const TOLERANCE: f64 = 1e-3;
    let m = given.as_ref().map_or(DMat4::IDENTITY, |given| given.value);
    let axes = [m.x_axis.truncate(), m.y_axis.truncate(), m.z_axis.truncate()];
    let lengths = axes.map(DVec3::length);
    let usable = lengths.iter().all(|length| *length > 0.0 && length.is_finite());
    let units = [0, 1, 2].map(|k| axes[k] / lengths[k]);
    let sheared = [(0, 1), (1, 2), (2, 0)].iter().any(|&(i, j)| units[i].dot(units[j]).abs() > TOLERANCE);
    if let (Some(given), true) = (&given, !usable || sheared) {
        return Err(given.at.error(
            "the camera's to_world shears or has no inverse; only rotations, translations, mirrors and scales are accepted",
        ));
    }
    let [x, y, z] = units.map(|axis| axis.extend(0.0));
    let near_clip = near * lengths[2];
    let half_height = lengths[1] * f64::from(film.height) / f64::from(film.width);
    Ok(Camera {
        to_world: DMat4::from_cols(x, y, z, m.w_axis),
        fov_x: 90.0,
        near_clip,
        far_clip: near_clip + far - near,
        principal_point_offset: DVec2::ZERO,
        lens: Lens::Orthographic { half_width: lengths[0], half_height },
        medium: None,
    })
}

/// The horizontal field of view of the whole film in degrees, by the rules of Mitsuba's `parse_fov`.
fn fov_x(props: &Props, child: Child, film: &Film) -> Result<f64, SceneError> {
    let (fov, axis, focal_length) = (props.float("fov")?, props.string("fov_axis")?, props.string("focal_length")?);
    let aspect = f64::from(film.width) / f64::from(film.height);
    let (degrees, at, axis) = match (&fov, &focal_length) {
        (Some(_), Some(second)) => return Err(second.at.error("give either fov or focal_length, not both")),
        (None, None) => (diagonal_fov(DEFAULT_FOCAL_LENGTH), &child.object.at, "diagonal".to_owned()),
        (Some(fov), None) => {
            let name = axis.as_ref().map_or("x".to_owned(), |given| given.value.to_ascii_lowercase());
            if !FOV_AXES.contains(&name.as_str()) {
                let at = axis.as_ref().map_or(fov.at, |given| given.at);
                return Err(at.error(format!("fov_axis is \"{name}\"; accepted: {}", FOV_AXES.join(", "))));
            }
            (fov.value, fov.at, name)
        }
        (None, Some(length)) => (diagonal_fov(millimetres(length)?), length.at, "diagonal".to_owned()),
    };
    if !(degrees > 0.0 && degrees < 180.0) {
        return Err(at.error(format!("the field of view is {degrees} degrees; it must lie between 0 and 180")));
    }
    let half_tan = (0.5 * degrees.to_radians()).tan();
    let half_width = match axis.as_str() {
        "x" => return Ok(degrees),
        "larger" if aspect > 1.0 => return Ok(degrees),
        "smaller" if aspect <= 1.0 => return Ok(degrees),
        "diagonal" => half_tan / (1.0 + 1.0 / (aspect * aspect)).sqrt(),
        _ => half_tan * aspect,
    };
    let fov_x = 2.0 * half_width.atan().to_degrees();
    if !(fov_x > 0.0 && fov_x < 180.0) {
        return Err(at.error(format!("the horizontal field of view is {fov_x} degrees; it must lie between 0 and 180")));
    }
    Ok(fov_x)
}

/// The focal length in millimetres that Mitsuba takes where a sensor says nothing of its field of view.
const DEFAULT_FOCAL_LENGTH: f64 = 50.0;

/// The diagonal field of view in degrees of a lens of so many millimetres on 35 mm film (36 mm × 24 mm).
fn diagonal_fov(millimetres: f64) -> f64 {
    2.0 * (f64::hypot(36.0, 24.0) / (2.0 * millimetres)).atan().to_degrees()
}

/// A focal length.
fn millimetres(length: &Given<String>) -> Result<f64, SceneError> {
    let text = length.value.trim();
    let number = text.strip_suffix("mm").unwrap_or(text);
    match super::values::float(number) {
        Ok(millimetres) if millimetres > 0.0 => Ok(millimetres),
        _ => Err(length.at.error(format!(
            "focal_length is \"{}\"; it must be a positive number of millimetres, like \"50mm\"",
            length.value
        ))),
    }
}

fn clip_planes(props: &Props, child: Child) -> Result<(f64, f64), SceneError> {
    let (near, far) = (props.float("near_clip")?, props.float("far_clip")?);
    let at = near.as_ref().or(far.as_ref()).map_or(&child.object.at, |given| given.at);
    let near = near.map_or(1e-2, |given| given.value);
    let far = far.map_or(1e4, |given| given.value);
    if near <= 0.0 || near >= far {
        return Err(at.error(format!("near_clip is {near} and far_clip {far}; they must be 0 < near_clip < far_clip")));
    }
    Ok((near, far))
}
