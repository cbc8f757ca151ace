//! Images and patterns: how files are decoded, and what is seen at texture coordinates.

use std::path::PathBuf;

use glam::{DVec2, DVec3};
use tyndall::scene::*;

use crate::{data, scene};

fn image(name: &str) -> PathBuf {
    data("textures").join(name)
}

/// The texture of a surface.
fn texture(inside: &str) -> Texture {
    let body = format!(
        r#"<shape type="rectangle"><bsdf type="diffuse"><texture name="reflectance" {inside}</texture></bsdf></shape>"#
    );
    let Bsdf::Diffuse { reflectance, .. } = scene(&body).shapes[0].bsdf.clone() else { panic!() };
    reflectance
}

fn pixel(name: &str, raw: bool, x: u32, y: u32) -> [f32; 3] {
    Bitmap::read(&image(name), raw).unwrap_or_else(|error| panic!("{name}: {error}")).pixel(x, y).to_array()
}

fn near(got: [f32; 3], want: [f64; 3]) -> bool {
    got.iter().zip(want).all(|(got, want)| (f64::from(*got) - want).abs() < 1e-6)
}

#[test]
fn png_files() {
    // IEC 61966-2-1: code 188 of 255 is 0.502886 of white; 10, 20 and 30 are 0.003035, 0.006995 and 0.012983.
    let gray = 0.502_886_5;
    for name in ["colors.png", "colors16.png", "palette.png", "alpha.png"] {
        let bitmap = Bitmap::read(&image(name), false).unwrap();
        assert_eq!((bitmap.width(), bitmap.height()), (4, 2), "{name}");
        assert!(near(pixel(name, false, 0, 0), [1.0, 0.0, 0.0]), "{name}");
        assert!(near(pixel(name, false, 3, 0), [gray; 3]), "{name}");
        assert!(near(pixel(name, false, 1, 1), [1.0; 3]), "{name}");
        assert!(near(pixel(name, false, 2, 1), [0.003_035_27, 0.006_995_41, 0.012_983_03]), "{name}");
        assert!(near(pixel(name, true, 2, 1), [10.0 / 255.0, 20.0 / 255.0, 30.0 / 255.0]), "{name}");
    }
    assert!(near(pixel("gray.png", false, 1, 0), [gray; 3]) && near(pixel("gray.png", true, 1, 1), [64.0 / 255.0; 3]));
    assert!(!near(pixel("gray.png", true, 1, 0), [gray; 3]), "raw and decoded values differ");
}

#[test]
fn openexr_files() {
    assert_eq!(pixel("sky.exr", false, 5, 2), [25.0, 5.0, 2.0]);
    assert_eq!(pixel("sky.exr", true, 5, 2), [25.0, 5.0, 2.0]);
    assert_eq!(pixel("luminance.exr", false, 5, 2), [25.0; 3]);
}

#[test]
fn jpeg_files() {
    let bitmap = Bitmap::read(&image("colors.jpg"), true).unwrap();
    assert_eq!((bitmap.width(), bitmap.height()), (16, 8));
    // As Mitsuba 3.9.1 reads them; decoders may differ by a code or two.
    for ((x, y), expected) in
        [((0, 0), [0.0, 5.0, 236.0]), ((5, 3), [80.0, 96.0, 191.0]), ((15, 7), [243.0, 218.0, 100.0])]
    {
        let got = bitmap.pixel(x, y).to_array().map(|value| 255.0 * f64::from(value));
        let far = |wanted: [f64; 3]| got.iter().zip(wanted).any(|(got, wanted)| (got - wanted).abs() > 3.0);
        assert!(!far(expected) && far(expected.map(|code| code + 8.0)), "({x}, {y}) is {got:?}");
    }
    let decoded = pixel("colors.jpg", false, 5, 3)[1];
    let code = f64::from(pixel("colors.jpg", true, 5, 3)[1]);
    assert!((f64::from(decoded) - bitmap::srgb_to_linear(code)).abs() < 1e-6);
}

#[test]
fn radiance_files() {
    // As Mitsuba 3.9.1, which wrote it, reads it.
    assert_eq!(pixel("sky.hdr", false, 3, 0), [1.609_375, 1.25, 2.046_875]);
    assert_eq!(pixel("sky.hdr", false, 5, 2), [5.0, 2.781_25, 2.0625]);
    assert_eq!(pixel("sky.hdr", true, 15, 3), [2.765_625, 0.781_25, 0.1875]);
}

#[test]
fn bitmaps_are_checked() {
    assert!(matches!(Bitmap::new(0, 4, vec![]), Err(bitmap::BitmapError::Size { width: 0, height: 4 })));
    assert!(matches!(Bitmap::new(usize::MAX, 2, vec![]), Err(bitmap::BitmapError::Size { .. })));
    let mut pixels = vec![[0.0; 3]; 6];
    pixels[4][1] = f32::INFINITY;
    assert!(matches!(Bitmap::new(3, 2, pixels), Err(bitmap::BitmapError::NotFinite { x: 1, y: 1 })));
}

#[test]
fn a_bitmap_is_named_by_all_its_bits() {
    let of = |value: f32| format!("{:?}", Bitmap::new(2, 1, vec![[1.0; 3], [1.0, value, 1.0]]).unwrap());
    assert_eq!(of(1.0), of(1.0));
    assert_ne!(of(1.0), of(1.0 + f32::EPSILON));
    assert_ne!(of(0.0), of(-0.0));
}

/// The largest distance of look-ups from expected values.
fn lookup_error(texture: &Texture, expected: &[((f64, f64), [f64; 3])]) -> f64 {
    expected.iter().map(|&(uv, want)| texture.eval(DVec2::from(uv)).distance(DVec3::from(want))).fold(0.0, f64::max)
}

#[test]
fn lookups_agree_with_mitsuba() {
    let bitmap = std::sync::Arc::new(Bitmap::read(&image("sky.exr"), false).unwrap());
    // The same transform as in the scene that Mitsuba 3.9.1 was given.
    let body = r#"type="bitmap"><string name="filename" value="textures/colors.png"/><transform name="to_uv"><scale x="1.5"/>
        <rotate z="1" angle="30"/><translate x="0.2" y="-0.1"/></transform>"#;
    let Texture::Bitmap { to_uv, .. } = texture(body) else { panic!() };
    let uvs = [(0.1, 0.2), (0.93, 0.41), (-1.3, 2.7), (3.21, -0.6)];
    for (filter, wrap, values) in [
        (Filter::Nearest, Wrap::Repeat, [[1.0, 1.0, 0.0], [31.0, 1.0, 3.0], [11.0, 1.0, 1.0], [35.0, 5.0, 3.0]]),
        (Filter::Nearest, Wrap::Mirror, [[1.0, 1.0, 0.0], [36.0, 6.0, 3.0], [26.0, 6.0, 2.0], [5.0, 5.0, 0.0]]),
        (Filter::Nearest, Wrap::Clamp, [[1.0, 1.0, 0.0], [37.0, 7.0, 3.0], [30.0, 0.0, 3.0], [37.0, 7.0, 3.0]]),
        (
            Filter::Bilinear,
            Wrap::Repeat,
            [
                [2.26743, 1.33923, 0.09282],
                [21.81639, 1.12484, 2.06915],
                [6.32075, 0.79, 0.55307],
                [31.37469, 4.8593, 2.65154],
            ],
        ),
        (
            Filter::Bilinear,
            Wrap::Mirror,
            [
                [2.26743, 1.33923, 0.09282],
                [35.87516, 5.87516, 3.0],
                [30.67925, 6.21, 2.44693],
                [8.34391, 4.8593, 0.34846],
            ],
        ),
        (
            Filter::Bilinear,
            Wrap::Clamp,
            [[2.26743, 1.33923, 0.09282], [37.0, 7.0, 3.0], [30.0, 0.0, 3.0], [37.0, 7.0, 3.0]],
        ),
    ] {
        let expected: Vec<_> = uvs.into_iter().zip(values).collect();
        let texture = |to_uv| Texture::Bitmap { bitmap: bitmap.clone(), filter, wrap, to_uv };
        assert!(lookup_error(&texture(to_uv), &expected) < 1e-4, "{filter:?} {wrap:?}");
        assert!(lookup_error(&texture(to_uv.inverse()), &expected) > 0.1, "the inverse is noticed");
    }
}

#[test]
fn checkerboards() {
    let plain = texture(r#"type="checkerboard">"#);
    // `eval` of Mitsuba 3.9.1: 0.4 is `color0`.
    for (uv, value) in
        [((0.25, 0.25), 0.4), ((0.75, 0.25), 0.2), ((0.75, 0.75), 0.4), ((0.5, 0.5), 0.4), ((0.5, 0.25), 0.4)]
    {
        assert_eq!(plain.eval(uv.into()), DVec3::splat(value), "{uv:?}");
    }
    let scaled = texture(
        r#"type="checkerboard"><rgb name="color0" value="1 0 0"/><transform name="to_uv"><scale x="2" y="4"/></transform>"#,
    );
    assert_eq!(scaled.eval(DVec2::new(0.1, 0.1)), DVec3::X);
    assert_eq!(scaled.eval(DVec2::new(0.3, 0.1)), DVec3::splat(0.2));
    assert_eq!(scaled.eval(DVec2::new(0.3, 0.2)), DVec3::X);
}

#[test]
fn properties_of_bitmaps() {
    let file = r#"type="bitmap"><string name="filename" value="textures/colors.png"/>"#;
    let Texture::Bitmap { bitmap, filter, wrap, to_uv } = texture(file) else { panic!() };
    assert_eq!((filter, wrap, to_uv), (Filter::Bilinear, Wrap::Repeat, glam::DAffine2::IDENTITY));
    assert!(near(bitmap.pixel(3, 0).to_array(), [0.502_886_5; 3]));
    let Texture::Bitmap { bitmap, filter, wrap, .. } = texture(&format!(
        r#"{file}<boolean name="raw" value="true"/><string name="filter_type" value="nearest"/>
        <string name="wrap_mode" value="clamp"/>"#
    )) else {
        panic!()
    };
    assert_eq!((filter, wrap), (Filter::Nearest, Wrap::Clamp));
    assert!(near(bitmap.pixel(3, 0).to_array(), [188.0 / 255.0; 3]));
}

#[test]
fn images_are_read_once() {
    let file = r#"type="bitmap"><string name="filename" value="textures/colors.png"/></texture>"#;
    let shape = format!(
        r#"<shape type="rectangle"><bsdf type="plastic"><texture name="diffuse_reflectance" {file}
        <texture name="specular_reflectance" {file}</bsdf></shape>"#
    );
    let Bsdf::Plastic { diffuse_reflectance, specular_reflectance, .. } = scene(&shape).shapes[0].bsdf.clone() else {
        panic!()
    };
    let (Texture::Bitmap { bitmap: a, .. }, Texture::Bitmap { bitmap: b, .. }) =
        (diffuse_reflectance, specular_reflectance)
    else {
        panic!()
    };
    assert!(std::sync::Arc::ptr_eq(&a, &b));
}

#[test]
fn opacity_is_gray() {
    let body = r#"<shape type="rectangle"><bsdf type="mask"><bsdf type="diffuse"/><texture name="opacity" type="bitmap">
        <string name="filename" value="textures/colors.png"/></texture></bsdf></shape>"#;
    let Bsdf::Mask { opacity: Texture::Bitmap { bitmap, .. }, .. } = scene(body).shapes[0].bsdf.clone() else {
        panic!()
    };
    // The luminance of red, as in Mitsuba.
    assert!(near(bitmap.pixel(0, 0).to_array(), [0.212_671; 3]));
}
