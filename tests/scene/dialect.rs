//! What public scenes of Mitsuba have: media that a `volumelight` makes shine, attributes of meshes, pictures in front of lights.

use glam::{DMat3, DVec2, DVec3};
use tyndall::pack::Packed;
use tyndall::pack::layout::{SURFACE_MASK, SURFACE_PANE};
use tyndall::reference::bindings::Tables;
use tyndall::reference::texture::eval_attribute;
use tyndall::scene::mesh::{attributes, ply};
use tyndall::scene::mitsuba::parse_str;
use tyndall::scene::*;

use crate::{LIGHT, SENSOR, parse, scene, with_warnings};

/// A cube with a medium and something else in it.
fn glowing(medium: &str, inside: &str) -> String {
    format!(r#"<shape type="cube"><bsdf type="null"/>{medium}{inside}</shape>"#)
}

const MEDIUM: &str = r#"<medium type="homogeneous" id="haze" name="interior"/>"#;
const GLOW: &str = r#"<emitter type="volumelight"><rgb name="radiance" value="2 0 5"/></emitter>"#;

#[test]
fn a_volumelight_is_the_emission_of_a_medium() {
    let read = scene(&glowing(MEDIUM, GLOW));
    assert_eq!((read.media[0].emission, read.shapes[0].emission), (DVec3::new(2.0, 0.0, 5.0), None));
    // White point E, as of all that emits.
    let white = r#"<emitter type="volumelight"><spectrum name="radiance" value="1"/></emitter>"#;
    assert!((scene(&glowing(MEDIUM, white)).media[0].emission - DVec3::new(1.2048, 0.9483, 0.9089)).length() < 1e-4);
    let grid = r#"<emitter type="volumelight"><volume type="gridvolume" name="radiance"><string name="filename" value="volumes/small.vol"/></volume></emitter>"#;
    assert!(scene(&glowing(MEDIUM, grid)).media[0].volumes.emission.is_some());
    // Two shapes with one medium, and one light.
    let two = format!(
        r#"<emitter type="volumelight" id="glow"/>{}<shape type="sphere"><bsdf type="null"/><ref id="haze" name="interior"/>{GLOW}</shape>"#,
        glowing(MEDIUM, "")
    );
    assert!(parse(&format!("<scene version=\"3.0.0\">{SENSOR}{two}</scene>")).is_err(), "a light stands alone");
    let group = format!(
        r#"<shape type="shapegroup" id="group">{}</shape>
           <shape type="instance"><ref id="group"/></shape>
           <shape type="instance"><ref id="group"/><transform name="to_world"><translate x="5"/></transform></shape>"#,
        glowing(MEDIUM, GLOW)
    );
    assert_eq!(scene(&group).media[0].emission, DVec3::new(2.0, 0.0, 5.0), "read for each instance");
    for (body, expected) in [
        (glowing("", GLOW), "no medium named \"interior\""),
        (GLOW.to_owned(), "must be inside the <shape>"),
        (
            glowing(&MEDIUM.replace("/>", r#"><rgb name="emission" value="1"/></medium>"#), GLOW),
            "the medium \"haze\" shines already",
        ),
        (
            glowing(MEDIUM, GLOW)
                + &format!(r#"<shape type="sphere"><bsdf type="null"/><ref id="haze" name="interior"/>{GLOW}</shape>"#),
            "shines already",
        ),
        (glowing(MEDIUM, &GLOW.replace("2 0 5", "-1 0 0")), "must not be negative"),
    ] {
        let error = parse(&format!("<scene version=\"3.0.0\">{SENSOR}{body}</scene>")).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}\n{expected}");
    }
}

#[test]
fn how_mitsuba_samples_a_medium_has_no_effect() {
    let with = r#"<float name="sigma_n" value="2"/><string name="medium_sampling_mode" value="analogue"/>"#;
    for plugin in ["homogeneous", "heterogeneous"] {
        let medium = |inside: &str| {
            let inside = format!(r#"<medium type="{plugin}" id="m" name="interior">{inside}</medium>"#);
            format!("{:?}", scene(&glowing(&inside, "")).media[0])
        };
        assert_eq!(medium(with), medium(""));
        assert_ne!(medium(r#"<float name="scale" value="2"/>"#), medium(""));
    }
}

#[test]
fn a_constant_volume_ends_with_its_box() {
    let cube = |transform: &str| {
        let volume = format!(
            r#"<volume type="constvolume" name="sigma_t"><rgb name="value" value="1 2 3"/>{transform}</volume>"#
        );
        glowing(&format!(r#"<medium type="heterogeneous" id="m" name="interior">{volume}</medium>"#), "")
    };
    let placed = |operations: &str| format!(r#"<transform name="to_world">{operations}</transform>"#);
    // The cube is [-1, 1]³: a box of its size holds all of it, and the medium is homogeneous.
    let whole = scene(&cube(&placed(r#"<scale value="2"/><translate x="-1" y="-1" z="-1"/>"#)));
    assert!(whole.media[0].volumes.is_empty());
    assert_eq!(whole.media[0].sigma_t, DVec3::new(1.0, 2.0, 3.0));
    let part = scene(&cube(&placed(r#"<scale value="2"/><translate x="-1.01" y="-1" z="-1"/>"#)));
    let Some(Volume::Grid(field)) = &part.media[0].volumes.sigma_t else { panic!("the box is gone") };
    assert_eq!((field.grid.resolution(), field.grid.max()), ([1; 3], 1.0));
    assert_eq!(field.to_world.transform_point3(DVec3::ONE), DVec3::new(0.99, 1.0, 1.0));
    let bare = with_warnings(&cube(""));
    assert!(bare.warnings[0].contains("the unit cube [0, 1]³ alone"), "{:?}", bare.warnings);
    assert!(!bare.scene.media[0].volumes.is_empty());
    // What Mitsuba would not do is said.
    let plain = with_warnings(&glowing(
        r#"<medium type="heterogeneous" id="m" name="interior"><float name="sigma_t" value="2"/></medium>"#,
        "",
    ));
    assert!(plain.warnings[0].contains("fills all of its shape"), "{:?}", plain.warnings);
    assert!(plain.scene.media[0].volumes.is_empty());
}

const COLORS: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
    property float r\nproperty float g\nproperty float b\nproperty float heat_0\nelement face 3\n\
    property list uchar int vertex_indices\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nproperty float odd\nend_header\n\
    0 0 0 1 0 0 0.25\n1 0 0 0 1 0 0.5\n1 1 0 0 0 1 0.75\n0 1 0 1 1 1 1\n\
    3 0 1 1 0 0 0 9\n3 0 1 2 255 0 51 9\n3 0 2 3 0 102 0 9\n";

#[test]
fn attributes_of_ply_files() {
    let read = ply::parse(COLORS.as_bytes()).unwrap();
    let found: Vec<(&str, bool, usize)> =
        read.attributes.iter().map(|a| (a.name.as_str(), a.per_face, a.channels)).collect();
    assert_eq!(found, [("vertex_color", false, 3), ("vertex_heat", false, 1), ("face_color", true, 3)]);
    assert_eq!(read.attributes[1].values, [0.25, 0.5, 0.75, 1.0]);
    assert_eq!(read.attributes[2].values[3..], [1.0, 0.0, 0.2, 0.0, 0.4, 0.0]);
    let group = "property float r\nproperty float g\nproperty float b";
    let named = COLORS.replace(group, "property float a_r\nproperty float a_g\nproperty float a_b");
    assert_eq!(ply::parse(named.as_bytes()).unwrap().attributes[0].name, "vertex_a_color");
    assert!(ply::parse(COLORS.replace("0 1 0 1 1 1 1\n", "0 1 0 1 1 nan 1\n").as_bytes()).is_err());
}

#[test]
fn attributes_are_textures() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("m.ply"), COLORS).unwrap();
    let read = |bsdf: &str| {
        let body = format!(
            r#"<scene version="3.0.0">{SENSOR}{LIGHT}<shape type="ply"><string name="filename" value="m.ply"/>{bsdf}</shape></scene>"#
        );
        parse_str(&body, &folder.path().join("s.xml"), &[])
    };
    let attribute = |tag: &str, name: &str| {
        format!(r#"<texture type="mesh_attribute" name="{tag}"><string name="name" value="{name}"/></texture>"#)
    };
    let diffuse = |name: &str| format!(r#"<bsdf type="diffuse">{}</bsdf>"#, attribute("reflectance", name));
    let at = |name: &str, triangle: u32, weights: DVec3| {
        let scene = read(&diffuse(name)).unwrap().scene;
        let Geometry::Mesh(mesh) = &scene.shapes[0].geometry else { panic!() };
        // Two of the triangles have an area, and share corners.
        assert_eq!((mesh.triangles.len(), mesh.positions.len()), (2, 4));
        let packed = Packed::new(&scene, 1).unwrap();
        assert!(packed.features.attributes);
        let tables = Tables::new(&packed);
        let mut numbers: Vec<u32> = tables.corners.iter().map(|corners| corners.number).collect();
        numbers.sort_unstable();
        assert_eq!(numbers, [0, 1]);
        eval_attribute(&tables.textures[0], &tables.values, triangle, DVec2::new(weights.y, weights.z))
    };
    let weights = DVec3::new(0.5, 0.3, 0.2);
    let close = |a: DVec3, b: DVec3| assert!((a - b).length() < 1e-6, "{a} is not {b}");
    // Corners 0, 1, 2 and 0, 2, 3, of which the colours are red, green, blue and white.
    close(at("vertex_color", 0, weights), weights);
    close(at("vertex_color", 1, weights), DVec3::new(0.7, 0.2, 0.5));
    close(at("vertex_heat", 1, weights), DVec3::splat(0.5 * 0.25 + 0.3 * 0.75 + 0.2));
    // The first face, which has no area, does not shift the others.
    close(at("face_color", 0, weights), DVec3::new(1.0, 0.0, 0.2));
    close(at("face_color", 1, weights), DVec3::new(0.0, 0.4, 0.0));
    let error = |bsdf: &str| read(bsdf).unwrap_err().to_string();
    let missing = error(&diffuse("vertex_colour"));
    assert!(missing.contains("it has: vertex_color, vertex_heat, face_color"), "{missing}");
    let scaled = diffuse("vertex_heat").replace("</texture>", r#"<float name="scale" value="1.5"/></texture>"#);
    assert!(error(&scaled).contains("between 0 and 1"));
    let mixed = format!(
        r#"<bsdf type="mask">{}<bsdf type="diffuse"><texture type="checkerboard" name="reflectance"/></bsdf></bsdf>"#,
        attribute("opacity", "vertex_heat")
    );
    // Another texture beside it needs coordinates, which this mesh does not have.
    assert!(error(&mixed).contains("has a texture, but its mesh has no texture coordinates"), "{}", error(&mixed));
    let map =
        format!(r#"<bsdf type="normalmap">{}<bsdf type="diffuse"/></bsdf>"#, attribute("normalmap", "vertex_color"));
    assert!(error(&map).contains("cannot be a \"mesh_attribute\""), "{}", error(&map));
    let on_a_cube = parse(&format!(
        "<scene version=\"3.0.0\">{SENSOR}{LIGHT}<shape type=\"cube\">{}</shape></scene>",
        diffuse("vertex_color")
    ));
    assert!(on_a_cube.unwrap_err().to_string().contains("it has: none"));
}

#[test]
fn faces_that_are_left_keep_their_numbers() {
    let before = [[0, 1, 1], [0, 1, 2], [2, 2, 3], [0, 1, 2], [3, 4, 5]];
    assert_eq!(attributes::faces_left(&before, &[[0, 1, 2], [0, 1, 2], [3, 4, 5]]), [1, 3, 4]);
}

const PICTURE: &str =
    r#"<texture type="bitmap" name="radiance"><string name="filename" value="textures/colors.png"/></texture>"#;

#[test]
fn pictures_in_front_of_lights() {
    let lamp = |shape: &str| format!(r#"<shape type="{shape}"><emitter type="area">{PICTURE}</emitter></shape>"#);
    let read = scene(&lamp("rectangle"));
    assert!(matches!(read.shapes[0].emission_texture, Some(Texture::Bitmap { .. })));
    assert_eq!(read.shapes[0].emission, Some(DVec3::ONE));
    let packed = Packed::new(&read, 1).unwrap();
    // The coordinates are the same on both triangles, which are one light.
    assert_eq!((packed.lights.iter().filter(|light| light.texture != 0).count(), packed.features.slides), (1, true));
    let sphere =
        parse(&format!("<scene version=\"3.0.0\">{SENSOR}{}</scene>", lamp("sphere"))).unwrap_err().to_string();
    assert!(sphere.contains("needs a mesh"), "{sphere}");
    let spot = |inside: &str| {
        let body = format!(r#"<emitter type="spot">{}{inside}</emitter>"#, PICTURE.replace("radiance", "texture"));
        parse(&format!("<scene version=\"3.0.0\">{SENSOR}{body}</scene>"))
    };
    let turned = spot(r#"<transform name="to_world"><rotate z="1" angle="90"/></transform>"#).unwrap();
    let Light::Spot { slide: Some(slide), .. } = &turned.scene.lights[0] else { panic!() };
    assert!(slide.x_axis.distance(DVec3::Y) < 1e-12 && slide.y_axis.distance(-DVec3::X) < 1e-12);
    let wide = spot(r#"<float name="cutoff_angle" value="90"/>"#).unwrap_err().to_string();
    assert!(wide.contains("less than 90"), "{wide}");
}

#[test]
fn a_turned_sphere_has_axes() {
    let text = r#"<shape type="sphere"><transform name="to_world"><scale value="2"/><rotate x="1" angle="90"/><scale x="-1"/></transform>
        <bsdf type="diffuse"><texture type="checkerboard" name="reflectance"/></bsdf></shape>"#;
    let axes = with_warnings(text).scene.shapes[0].axes;
    // A quarter turn about x takes y to z and z to -y; then x is mirrored.
    assert!(axes.abs_diff_eq(DMat3::from_cols(-DVec3::X, DVec3::Z, -DVec3::Y), 1e-12), "{axes}");
}

#[test]
fn panes_are_passed() {
    let flags = |factor: &str| {
        let body = format!(r#"<shape type="sphere"><bsdf type="thindielectric">{factor}</bsdf></shape>"#);
        let packed = Packed::new(&scene(&body), 1).unwrap();
        assert!(packed.surfaces[0].flags & SURFACE_PANE != 0 && packed.surfaces[0].flags & SURFACE_MASK != 0);
        (packed.features.tints, packed.surfaces[0].opacity)
    };
    assert_eq!(flags(""), (false, 1.0));
    assert_eq!(flags(r#"<float name="specular_transmittance" value="0.5"/>"#), (false, 0.5));
    assert_eq!(flags(r#"<rgb name="specular_transmittance" value="0.5, 0.6, 0.5"/>"#), (true, 0.6));
}

#[test]
fn channels_without_an_integrator() {
    let read = |text: &str| parse(&format!("<scene version=\"3.0.0\">{SENSOR}{LIGHT}{text}</scene>")).unwrap().scene;
    let alone = read(r#"<integrator type="aov"><string name="aovs" value="d:depth,p:prim_index"/></integrator>"#);
    assert_eq!((alone.aovs.len(), alone.integrator.max_depth, alone.integrator.hide_emitters), (2, Some(1), true));
    let nested = read(
        r#"<integrator type="moment"><integrator type="aov"><string name="aovs" value="d:depth"/><integrator type="ptracer">
           <integer name="max_depth" value="7"/></integrator></integrator></integrator>"#,
    );
    assert_eq!((nested.aovs.len(), nested.integrator.max_depth), (1, Some(7)));
}
