//! The camera and its film. Fields of view are those that Mitsuba 3.9.1 prints for the same elements.

use glam::{DMat4, DVec2, DVec3};
use tyndall::scene::*;

use crate::{LIGHT, parse};

const BOX: &str = r#"<rfilter type="box"/>"#;

fn load(sensor: &str) -> mitsuba::Loaded {
    parse(&format!("<scene version=\"3.0.0\">{LIGHT}<sensor type=\"perspective\">{sensor}</sensor></scene>")).unwrap()
}

fn sensor(inside: &str) -> Scene {
    let loaded = load(inside);
    assert_eq!(loaded.warnings, [""; 0], "{inside}");
    loaded.scene
}

fn film(inside: &str) -> String {
    format!(r#"<film type="hdrfilm">{BOX}{inside}</film>"#)
}

fn size(width: u32, height: u32) -> String {
    film(&format!(r#"<integer name="width" value="{width}"/><integer name="height" value="{height}"/>"#))
}

#[test]
fn fields_of_view() {
    let fov = |axis: &str, film: &str| {
        let axis = format!(r#"<float name="fov" value="40"/><string name="fov_axis" value="{axis}"/>"#);
        sensor(&format!("{axis}{film}")).camera.fov_x
    };
    let wide = size(768, 576);
    let tall = size(576, 768);
    for (axis, film, expected) in [
        ("x", &wide, 40.0),
        ("y", &wide, 51.774009704589844),
        ("smaller", &wide, 51.774009704589844),
        ("larger", &wide, 40.0),
        ("diagonal", &wide, 32.468605041503906),
        ("X", &tall, 40.0),
        ("smaller", &tall, 40.0),
        // 2 atan(tan(20°) · 3/4)
        ("larger", &tall, 30.536943262765),
        ("y", &tall, 30.536943262765),
    ] {
        let got = fov(axis, film);
        assert!((got - expected).abs() < 1e-5, "{axis}: {got} instead of {expected}");
    }
    for text in ["50mm", "50", " 50mm"] {
        let got = sensor(&format!(r#"<string name="focal_length" value="{text}"/>{wide}"#)).camera.fov_x;
        assert!((got - 38.18484115600586).abs() < 1e-5, "{text}: {got}");
    }
    // Where nothing is said, 50 mm.
    let got = sensor(&wide).camera.fov_x;
    assert!((got - 38.18484115600586).abs() < 1e-5, "by default: {got}");
    // The crop window does not change the field of view.
    let crop = r#"<integer name="width" value="768"/><integer name="height" value="576"/><integer name="crop_width" value="10"/>"#;
    assert!((fov("y", &film(crop)) - 51.774009704589844).abs() < 1e-5);
}

#[test]
fn films() {
    let film_of = |inside: &str| sensor(&format!(r#"<float name="fov" value="40"/>{}"#, film(inside))).film;
    assert_eq!(film_of(""), Film::new(768, 576));
    let inside = r#"<integer name="width" value="30"/><integer name="height" value="20"/>
        <string name="pixel_format" value="rgb"/><string name="component_format" value="float32"/>
        <string name="file_format" value="openexr"/>"#;
    assert_eq!(film_of(inside), Film::new(30, 20));
    let crop = r#"<integer name="crop_offset_x" value="5"/><integer name="crop_offset_y" value="6"/>
        <integer name="crop_width" value="7"/><integer name="crop_height" value="14"/>"#;
    let window = Crop { x: 5, y: 6, width: 7, height: 14 };
    let expected = Film { crop: window, sample_area: Some(window), ..Film::new(30, 20) };
    assert_eq!(film_of(&format!("{inside}{crop}")), expected);
    let beyond = r#"<boolean name="sample_border" value="true"/>"#;
    assert_eq!(film_of(&format!("{inside}{crop}{beyond}")), Film { sample_area: None, ..expected });
    let format = |text: &str, component: &str| {
        let both = format!(
            r#"<string name="pixel_format" value="{text}"/><string name="component_format" value="{component}"/>"#
        );
        film_of(&both).pixel_format
    };
    for (text, colors, alpha) in [
        ("rgb", Colors::Rgb, false),
        ("RGBA", Colors::Rgb, true),
        ("xyz", Colors::Xyz, false),
        ("xyza", Colors::Xyz, true),
        ("luminance", Colors::Luminance, false),
        ("luminance_alpha", Colors::Luminance, true),
    ] {
        assert_eq!(format(text, "float32"), PixelFormat { colors, alpha, half: false });
        assert_eq!(format(text, "float16"), PixelFormat { colors, alpha, half: true });
    }
    // A film beyond the limit may be rendered in parts.
    let part = r#"<integer name="width" value="60000"/><integer name="height" value="60000"/>
        <integer name="crop_width" value="100"/><integer name="crop_height" value="100"/>"#;
    assert_eq!(film_of(part).crop.width, 100);
}

#[test]
fn film_warnings() {
    let fov = r#"<float name="fov" value="40"/>"#;
    let warnings = load(fov).warnings;
    assert!(warnings.len() == 1 && warnings[0].contains("no film"), "{warnings:?}");
}

#[test]
fn filters() {
    let filter = |inside: &str| {
        sensor(&format!(r#"<float name="fov" value="40"/><film type="hdrfilm">{inside}</film>"#)).film.filter
    };
    let float = |name: &str, value: f64| format!(r#"<float name="{name}" value="{value}"/>"#);
    let of = |plugin: &str, inside: &str| filter(&format!(r#"<rfilter type="{plugin}">{inside}</rfilter>"#));
    assert_eq!(filter(""), ReconstructionFilter::Gaussian { stddev: 0.5 }, "Mitsuba's default");
    assert_eq!(of("box", ""), ReconstructionFilter::PIXEL);
    assert_eq!(of("box", &float("radius", 1.5)), ReconstructionFilter::Box { radius: 1.5 });
    assert_eq!(of("tent", ""), ReconstructionFilter::Tent { radius: 1.0 });
    assert_eq!(of("gaussian", &float("stddev", 0.75)), ReconstructionFilter::Gaussian { stddev: 0.75 });
    assert_eq!(of("mitchell", ""), ReconstructionFilter::Mitchell { b: 1.0 / 3.0, c: 1.0 / 3.0 });
    assert_eq!(of("mitchell", &float("B", 0.25)), ReconstructionFilter::Mitchell { b: 0.25, c: 1.0 / 3.0 });
    assert_eq!(of("catmullrom", ""), ReconstructionFilter::Mitchell { b: 0.0, c: 0.5 });
    assert_eq!(of("lanczos", ""), ReconstructionFilter::Lanczos { lobes: 3.0 });
    let two = r#"<integer name="lobes" value="2"/>"#;
    assert_eq!(of("lanczos", two), ReconstructionFilter::Lanczos { lobes: 2.0 });
}

#[test]
fn samplers() {
    let count = |inside: &str| sensor(&format!(r#"<float name="fov" value="40"/>{}{inside}"#, film(""))).sample_count;
    assert_eq!(count(""), 4);
    for plugin in ["independent", "stratified", "multijitter", "orthogonal", "ldsampler"] {
        let inside = r#"<integer name="sample_count" value="128"/><integer name="seed" value="3"/>"#;
        assert_eq!(count(&format!(r#"<sampler type="{plugin}">{inside}</sampler>"#)), 128);
    }
}

#[test]
fn cameras() {
    let camera = |inside: &str| sensor(&format!(r#"<float name="fov" value="40"/>{}{inside}"#, film(""))).camera;
    let plain = camera("");
    assert_eq!((plain.to_world, plain.near_clip, plain.far_clip), (DMat4::IDENTITY, 1e-2, 1e4));
    assert_eq!((plain.principal_point_offset, plain.medium), (DVec2::ZERO, None));
    let inside = r#"<float name="near_clip" value="0.5"/><float name="far_clip" value="7"/>
        <float name="principal_point_offset_x" value="0.25"/><float name="principal_point_offset_y" value="-0.5"/>
        <medium type="homogeneous"/>"#;
    let full = camera(inside);
    assert_eq!((full.near_clip, full.far_clip), (0.5, 7.0));
    assert_eq!((full.principal_point_offset, full.medium), (DVec2::new(0.25, -0.5), Some(MediumId(0))));
    // A uniform scale is taken out; a mirror is not.
    let look = look_at(DVec3::new(1.0, 2.0, 3.0), DVec3::ZERO, DVec3::Y);
    let turned = r#"<lookat origin="1 2 3" target="0 0 0" up="0 1 0"/>"#;
    for (before, expected) in [
        ("", look),
        (r#"<scale value="2"/>"#, look),
        (r#"<scale x="-1"/>"#, look * DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0))),
    ] {
        let got = camera(&format!(r#"<transform name="to_world">{before}{turned}</transform>"#)).to_world;
        assert!(got.abs_diff_eq(expected, 1e-12), "{before}: {got} instead of {expected}");
    }
}
