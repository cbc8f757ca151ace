//! Whatever is in a file, the reader answers with a scene or with an error.

use std::fmt::Write;

use glam::{DMat4, DVec3};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use tyndall::scene::mesh::obj;
use tyndall::scene::mitsuba::parse_str;
use tyndall::scene::*;

use crate::{LIGHT, SENSOR, data, parse, scene};

fn config() -> ProptestConfig {
    ProptestConfig { cases: 400, rng_seed: RngSeed::Fixed(7), failure_persistence: None, ..ProptestConfig::default() }
}

/// One operation as XML and as glam's matrix.
fn operation() -> impl Strategy<Value = (String, DMat4)> {
    let number = || -3.0..3.0f64;
    let triple = move || (number(), number(), number()).prop_map(|(x, y, z)| DVec3::new(x, y, z));
    let size = || prop_oneof![0.2..3.0f64, -3.0..-0.2f64];
    prop_oneof![
        triple().prop_map(|t| {
            (format!(r#"<translate x="{}" y="{}" z="{}"/>"#, t.x, t.y, t.z), DMat4::from_translation(t))
        }),
        (size(), size(), size()).prop_map(|(x, y, z)| {
            (format!(r#"<scale value="{x}, {y}, {z}"/>"#), DMat4::from_scale(DVec3::new(x, y, z)))
        }),
        (triple(), -400.0..400.0f64).prop_filter_map("an axis", |(axis, angle)| {
            let unit = axis.try_normalize()?;
            let xml = format!(r#"<rotate x="{}" y="{}" z="{}" angle="{angle}"/>"#, axis.x, axis.y, axis.z);
            Some((xml, DMat4::from_axis_angle(unit, angle.to_radians())))
        }),
        (triple(), triple()).prop_filter_map("a direction", |(origin, target)| {
            let forward = (target - origin).try_normalize()?;
            if forward.cross(DVec3::Y).length() < 0.01 {
                return None;
            }
            let text = |v: DVec3| format!("{} {} {}", v.x, v.y, v.z);
            let xml = format!(r#"<lookat origin="{}" target="{}" up="0 1 0"/>"#, text(origin), text(target));
            // +z to the target, from glam's view matrix, which looks along -z.
            let view = glam::dcamera::rh::view::look_at_mat4(origin, origin - forward, DVec3::Y);
            Some((xml, view.inverse()))
        }),
    ]
}

/// Whether the operations move a rectangle like a matrix does.
fn agrees(operations: &str, expected: DMat4) -> bool {
    let s = scene(&format!(
        r#"<shape type="rectangle"><bsdf type="twosided"><bsdf type="diffuse"/></bsdf><transform name="to_world">{operations}</transform></shape>"#
    ));
    let Geometry::Mesh(mesh) = &s.shapes[0].geometry else { return false };
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    corners.iter().zip(&mesh.positions).all(|(&(x, y), got)| {
        let want = expected.transform_point3(DVec3::new(x, y, 0.0));
        (*got - want).length() <= 1e-11 * (1.0 + want.length())
    })
}

#[test]
fn the_comparison_of_transforms_can_fail() {
    let (move_x, double) = (DMat4::from_translation(DVec3::X), DMat4::from_scale(DVec3::splat(2.0)));
    let xml = r#"<translate x="1"/><scale value="2"/>"#;
    assert!(agrees(xml, double * move_x));
    assert!(!agrees(xml, move_x * double), "the wrong order");
    assert!(!agrees(xml, double * move_x * DMat4::from_rotation_z(1e-9)), "a small rotation");
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn transforms_agree_with_glam(operations in prop::collection::vec(operation(), 0..6)) {
        let xml: String = operations.iter().map(|(xml, _)| xml.as_str()).collect();
        let expected = operations.iter().fold(DMat4::IDENTITY, |total, (_, step)| *step * total);
        prop_assert!(agrees(&xml, expected), "{} is not {}", xml, expected);
    }

    #[test]
    fn mangled_scenes_do_not_panic(
        edits in prop::collection::vec((any::<prop::sample::Index>(), 0..4u8, any::<u8>()), 1..6),
    ) {
        let mut bytes = full_scene().into_bytes();
        for (place, kind, byte) in edits {
            let at = place.index(bytes.len());
            match kind {
                0 => drop(bytes.remove(at)),
                1 => bytes[at] = byte,
                2 => bytes[at] = b"<>\"/$ =-0."[usize::from(byte) % 10],
                _ => drop(bytes.drain(at..(at + usize::from(byte)).min(bytes.len() - 1))),
            }
        }
        if let Err(error) = parse_str(&String::from_utf8_lossy(&bytes), &data("mangled.xml"), &[]) {
            let text = error.to_string();
            prop_assert!(text.contains("mangled.xml:") || text.contains(".obj:"), "{}", text);
        }
    }

    #[test]
    fn random_obj_files_do_not_panic(text in "([vfnt#l/ ]{0,3}[-0-9. e/]{0,12}[\n\r]?){0,12}", bytes in prop::collection::vec(any::<u8>(), 0..64)) {
        for input in [text.as_bytes(), &bytes] {
            if let Err(error) = obj::parse(input) {
                let lines = input.split(|byte| *byte == b'\n').count() as u32;
                prop_assert!(error.line >= 1 && error.line <= lines && error.col >= 1, "{:?}", error);
            }
        }
    }
}

/// A scene with at least one of everything.
fn full_scene() -> String {
    format!(
        r##"<scene version="3.0.0"><default name="g" value="0.5"/><path value="meshes"/>
        <integrator type="volpath"><integer name="max_depth" value="7"/></integrator>
        <medium type="homogeneous" id="fog"><rgb name="sigma_t" value="1,2,3"/><float name="albedo" value="0.5"/>
        <phase type="hg"><float name="g" value="$g"/></phase></medium><alias id="fog" as="mist"/>
        {SENSOR}{LIGHT}<bsdf type="diffuse" id="clay"><rgb name="reflectance" value="#808080"/></bsdf>
        <shape type="obj"><string name="filename" value="ball.obj"/><bsdf type="null"/><ref name="interior" id="mist"/>
        <transform name="to_world"><rotate x="1" angle="30"/><matrix value="1 0 0 0 1 0 0 0 1"/></transform></shape>
        <shape type="cube"><ref id="clay"/><emitter type="area"><rgb name="radiance" value="3"/></emitter></shape>
        <emitter type="spot"><float name="cutoff_angle" value="30"/></emitter><emitter type="directional"/>
        <emitter type="envmap"><string name="filename" value="textures/sky.exr"/></emitter>
        <shape type="rectangle"><bsdf type="mask"><float name="opacity" value="0.25"/><bsdf type="plastic">
        <texture type="bitmap" name="diffuse_reflectance"><string name="filename" value="textures/colors.png"/></texture>
        </bsdf></bsdf></shape><bsdf type="roughconductor" id="gold"><string name="material" value="Au"/></bsdf>
        <shape type="sphere"><point name="center" x="1" y="2" z="3"/><bsdf type="dielectric"/></shape></scene>"##
    )
}

#[test]
fn the_scene_that_is_mangled_is_a_good_one() {
    let loaded = parse(&full_scene()).unwrap();
    assert_eq!((loaded.scene.shapes.len(), loaded.scene.lights.len(), loaded.scene.media.len()), (4, 4, 1));
}

#[test]
fn deep_nesting_is_refused() {
    let mut text = String::from("<scene version=\"3.0.0\">");
    for _ in 0..100_000 {
        text.write_str("<bsdf type=\"twosided\">").unwrap();
    }
    let error = parse(&text).unwrap_err().to_string();
    assert!(error.contains("scene.xml:"), "{error}");
    for _ in 0..100_000 {
        text += "</bsdf>";
    }
    let error = parse(&(text + "</scene>")).unwrap_err().to_string();
    assert!(error.contains("nested more than 64 levels"), "{error}");
}

#[test]
fn a_long_scene_is_read_quickly() {
    let spheres = r#"<shape type="sphere"><float name="radius" value="1"/></shape>
"#
    .repeat(20_000);
    assert_eq!(scene(&spheres).shapes.len(), 20_000);
}
