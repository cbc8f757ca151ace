//! The text of attributes as numbers, colours and vectors.

use glam::DVec3;

use crate::scene::bitmap::srgb_to_linear;

/// A finite number.
pub(super) fn float(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        Ok(_) => Err(format!("\"{text}\" is not a finite number")),
        Err(_) => Err(format!("\"{text}\" is not a number")),
    }
}

/// A whole number.
pub(super) fn integer(text: &str) -> Result<i64, String> {
    text.trim().parse().map_err(|_| format!("\"{text}\" is not a whole number"))
}

/// `true` or `false`, in upper or lower case.
pub(super) fn boolean(text: &str) -> Result<bool, String> {
    match text.trim().to_ascii_lowercase().as_str() {
        "true" => Ok(true),
        "false" => Ok(false),
        _ => Err(format!("\"{text}\" is neither \"true\" nor \"false\"")),
    }
}

/// Numbers with commas or spaces between them.
pub(super) fn floats(text: &str) -> Result<Vec<f64>, String> {
    text.split(|c: char| c == ',' || c.is_whitespace()).filter(|token| !token.is_empty()).map(float).collect()
}

/// Three numbers.
pub(super) fn triple(text: &str) -> Result<DVec3, String> {
    match floats(text)?[..] {
        [x, y, z] => Ok(DVec3::new(x, y, z)),
        ref other => Err(format!("\"{text}\" has {} numbers; 3 are needed", other.len())),
    }
}

/// Three numbers, or one that stands for all three.
pub(super) fn one_or_three(text: &str) -> Result<DVec3, String> {
    match floats(text)?[..] {
        [v] => Ok(DVec3::splat(v)),
        [x, y, z] => Ok(DVec3::new(x, y, z)),
        ref other => Err(format!("\"{text}\" has {} numbers; 1 or 3 are needed", other.len())),
    }
}

/// A colour in linear sRGB: one or three numbers, or `#rrggbb`, which is decoded with sRGB's transfer function.
pub(super) fn rgb(text: &str) -> Result<DVec3, String> {
    let Some(digits) = text.trim().strip_prefix('#') else { return one_or_three(text) };
    if digits.len() != 6 || !digits.bytes().all(|b| b.is_ascii_hexdigit()) {
        return Err(format!("\"{text}\" is not a colour of the form #rrggbb"));
    }
    let code = u32::from_str_radix(digits, 16).expect("six hexadecimal digits were checked");
    let channel = |shift: u32| srgb_to_linear(f64::from(code >> shift & 0xff) / 255.0);
    Ok(DVec3::new(channel(16), channel(8), channel(0)))
}

/// `camelCase` to `snake_case`, by Mitsuba's rule: an underscore goes where a capital follows a small letter.
pub(super) fn snake_case(name: &str) -> String {
    let mut out = String::with_capacity(name.len() + 4);
    let mut after_lower = false;
    let mut in_capitals = false;
    for c in name.chars() {
        let capital = c.is_ascii_uppercase();
        if capital && after_lower {
            out.push('_');
            in_capitals = true;
        }
        in_capitals &= capital;
        out.push(if in_capitals { c.to_ascii_lowercase() } else { c });
        after_lower = c.is_ascii_lowercase();
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours() {
        assert_eq!(rgb("0.5"), Ok(DVec3::splat(0.5)));
        assert_eq!(rgb(" 1, 2 ,3"), Ok(DVec3::new(1.0, 2.0, 3.0)));
        assert_eq!(rgb("#ff0000"), Ok(DVec3::X));
        // IEC 61966-2-1: code 188 of 255 is 0.502886 of white.
        let gray = rgb("#bcBCbc").expect("a colour");
        assert!((gray - DVec3::splat(0.502_886_458)).length() < 1e-8, "{gray}");
        for bad in ["", "1 2", "1 2 3 4", "#ff00", "#gg0000", "#+10000", "NaN", "1e999", "1;2;3"] {
            assert!(rgb(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn names_of_the_old_dialect() {
        for (old, new) in [
            ("toWorld", "to_world"),
            ("lookAt", "look_at"),
            ("sigmaT", "sigma_t"),
            ("intIOR", "int_ior"),
            ("rrDepth", "rr_depth"),
            ("g", "g"),
            ("near_clip", "near_clip"),
        ] {
            assert_eq!(snake_case(old), new);
        }
    }
}
