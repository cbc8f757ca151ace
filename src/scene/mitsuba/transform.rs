//! `<transform>`: operations that are applied one after the other, the first in the file first.

use glam::{DMat3, DMat4, DVec3};

use super::props::Given;
use super::values;
use crate::scene::{SceneError, look_at};

/// The operations, as their tags are named. `look_at` is what `lookAt` becomes.
pub(super) const OPERATIONS: [&str; 6] = ["translate", "rotate", "scale", "matrix", "lookat", "look_at"];

/// Attributes that an operation accepts.
pub(super) fn attributes(operation: &str) -> &'static [&'static str] {
    match operation {
        "translate" | "scale" => &["value", "x", "y", "z"],
        "rotate" => &["value", "x", "y", "z", "angle"],
        "matrix" => &["value"],
        _ => &["origin", "target", "up"],
    }
}

/// The matrix of one operation. `get` returns the value of an attribute.
pub(super) fn operation<'a>(name: &str, get: impl Fn(&str) -> Option<&'a str>) -> Result<DMat4, String> {
    match name {
        "translate" => Ok(DMat4::from_translation(xyz(&get, 0.0)?)),
        "scale" => Ok(DMat4::from_scale(xyz(&get, 1.0)?)),
        "rotate" => rotate(&get),
        "matrix" => matrix(get("value").ok_or("<matrix> needs a value of 9 or 16 numbers, row by row")?),
        _ => lookat(&get),
    }
}

/// Three components from `value` or from `x`, `y` and `z`; those that are not given are `missing`.
pub(super) fn xyz<'a>(get: &impl Fn(&str) -> Option<&'a str>, missing: f64) -> Result<DVec3, String> {
    let components = ["x", "y", "z"].map(get);
    if let Some(value) = get("value") {
        if components.iter().any(Option::is_some) {
            return Err("give either \"value\" or \"x\", \"y\" and \"z\", not both".to_owned());
        }
        return values::one_or_three(value);
    }
    let component = |text: Option<&str>| text.map_or(Ok(missing), values::float);
    Ok(DVec3::new(component(components[0])?, component(components[1])?, component(components[2])?))
}

/// A rotation by `angle` degrees, counter-clockwise for somebody towards whom the axis points.
fn rotate<'a>(get: &impl Fn(&str) -> Option<&'a str>) -> Result<DMat4, String> {
    let angle = values::float(get("angle").ok_or("<rotate> needs an angle in degrees")?)?;
    let axis = xyz(get, 0.0)?
        .try_normalize()
        .ok_or("the axis of <rotate> is zero; give it as x, y and z or as value=\"x y z\"")?;
    Ok(DMat4::from_axis_angle(axis, angle.to_radians()))
}

fn matrix(text: &str) -> Result<DMat4, String> {
    let m = values::floats(text)?;
    match m.len() {
        9 => {
            let rows: [f64; 9] = m.try_into().expect("nine numbers were counted");
            Ok(DMat4::from_mat3(DMat3::from_cols_array(&rows).transpose()))
        }
        16 => {
            if m[12..] != [0.0, 0.0, 0.0, 1.0] {
                return Err("the last row of a <matrix> must be 0 0 0 1".to_owned());
            }
            let rows: [f64; 16] = m.try_into().expect("sixteen numbers were counted");
            Ok(DMat4::from_cols_array(&rows).transpose())
        }
        n => Err(format!("a <matrix> has 9 or 16 numbers, row by row; this one has {n}")),
    }
}

fn lookat<'a>(get: &impl Fn(&str) -> Option<&'a str>) -> Result<DMat4, String> {
    let needed = |name: &str| get(name).ok_or(format!("<lookat> needs \"{name}\", three numbers"));
    let origin = values::triple(needed("origin")?)?;
    let target = values::triple(needed("target")?)?;
    let forward = (target - origin).try_normalize().ok_or("\"origin\" and \"target\" of <lookat> are the same")?;
    let up = match get("up") {
        Some(text) => values::triple(text)?,
        None => DVec3::ZERO,
    };
    let up = if up == DVec3::ZERO { any_perpendicular(forward) } else { up };
    if up.cross(forward).length() <= 1e-9 * up.length() {
        return Err("\"up\" of <lookat> is parallel to the view direction".to_owned());
    }
    Ok(look_at(origin, target, up))
}

/// The first tangent of Duff et al., "Building an Orthonormal Basis, Revisited" (JCGT 6(1), 2017), which Mitsuba
/// takes for `up` where none is given.
fn any_perpendicular(n: DVec3) -> DVec3 {
    let sign = 1f64.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    DVec3::new(1.0 + sign * n.x * n.x * a, sign * n.x * n.y * a, -sign * n.x)
}

/// Takes a uniform scale out of the matrix of something that has no size: a camera (for which Mitsuba refuses all scales; the
/// tolerance is the 1e-3 with which it looks for them), a spot, an environment. `what` is its name in messages.
pub(super) fn rigid(given: Given<DMat4>, what: &str) -> Result<DMat4, SceneError> {
    const TOLERANCE: f64 = 1e-3;
    let m = given.value;
    let axes = [m.x_axis.truncate(), m.y_axis.truncate(), m.z_axis.truncate()];
    let scale = (axes[0].length() * axes[1].length() * axes[2].length()).cbrt();
    let off = |value: f64| value.is_nan() || value.abs() > TOLERANCE;
    let stretched = axes.iter().any(|axis| off(axis.length() / scale - 1.0));
    let sheared = [(0, 1), (1, 2), (2, 0)].iter().any(|&(i, j)| off(axes[i].dot(axes[j]) / (scale * scale)));
    if stretched || sheared {
        return Err(given.at.error(format!(
            "{what} stretches or shears; only rotations, translations, mirrors and a uniform scale are accepted"
        )));
    }
    let [x, y, z] = axes.map(|axis| (axis / scale).extend(0.0));
    Ok(DMat4::from_cols(x, y, z, m.w_axis))
}
