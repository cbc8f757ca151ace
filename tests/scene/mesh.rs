//! Shapes: points in world space, the side of the normals, and OBJ files.

use glam::{DVec2, DVec3};
use proptest::prelude::*;
use tyndall::scene::mesh::{self, obj};
use tyndall::scene::mitsuba::{Loaded, parse_str};
use tyndall::scene::*;

use crate::{LIGHT, SENSOR, data, scene, warning};

fn mesh_of(body: &str) -> Mesh {
    let Geometry::Mesh(mesh) = scene(body).shapes[0].geometry.clone() else { panic!("{body}") };
    mesh
}

/// Volume that the normals enclose, by the divergence theorem; negative if they point inwards.
fn volume(mesh: &Mesh) -> f64 {
    let corner = |index: u32| mesh.positions[index as usize];
    mesh.triangles.iter().map(|&[a, b, c]| corner(a).dot(corner(b).cross(corner(c))) / 6.0).sum()
}

fn shape(plugin: &str, inside: &str) -> String {
    let two_sided = r#"<bsdf type="twosided"><bsdf type="diffuse"/></bsdf>"#;
    format!(r#"<shape type="{plugin}">{two_sided}{inside}</shape>"#)
}

const FLIP: &str = r#"<boolean name="flip_normals" value="true"/>"#;
const MIRROR: &str = r#"<transform name="to_world"><scale x="-1"/></transform>"#;
const BALL: &str = r#"<string name="filename" value="meshes/ball.obj"/><boolean name="face_normals" value="true"/>"#;

#[test]
fn normals_point_outwards_unless_flipped() {
    assert_eq!(volume(&mesh::cube()), 8.0);
    assert_eq!(volume(&mesh_of(&shape("cube", ""))), 8.0);
    assert_eq!(volume(&mesh_of(&shape("cube", FLIP))), -8.0);
    // Mitsuba's normals from which light is emitted: outwards for a cube, turned around for a mesh.
    assert_eq!(volume(&mesh_of(&shape("cube", MIRROR))), 8.0);
    assert_eq!(volume(&mesh_of(&shape("cube", &format!("{MIRROR}{FLIP}")))), -8.0);
    let ball = |inside: &str| volume(&mesh_of(&shape("obj", &format!("{BALL}{inside}"))));
    assert!((ball("") - 4.0 / 3.0).abs() < 1e-12 && (ball(FLIP) + 4.0 / 3.0).abs() < 1e-12);
    assert!((ball(MIRROR) + 4.0 / 3.0).abs() < 1e-12);
    assert!((ball(&format!("{MIRROR}{FLIP}")) - 4.0 / 3.0).abs() < 1e-12);
}

#[test]
fn the_normal_of_a_rectangle() {
    let normal = |inside: &str| {
        let mesh = mesh_of(&shape("rectangle", inside));
        let [a, b, c] = mesh.triangles[0].map(|index| mesh.positions[index as usize]);
        (b - a).cross(c - a).normalize()
    };
    let to_world = |inside: &str| format!(r#"<transform name="to_world">{inside}</transform>"#);
    assert_eq!(normal(""), DVec3::Z);
    assert_eq!(normal(FLIP), -DVec3::Z);
    // As Mitsuba 3.9.1 emits from such rectangles.
    assert_eq!(normal(&to_world(r#"<scale x="-1"/>"#)), DVec3::Z);
    assert_eq!(normal(&to_world(r#"<scale z="-1"/>"#)), -DVec3::Z);
    assert!((normal(&to_world(r#"<rotate y="1" angle="90"/>"#)) - DVec3::X).length() < 1e-12);
}

#[test]
fn spheres() {
    let sphere = |inside: &str| match scene(&shape("sphere", inside)).shapes[0].geometry {
        Geometry::Sphere { center, radius, flipped } => (center, radius, flipped),
        Geometry::Mesh(_) => panic!(),
    };
    assert_eq!(sphere(""), (DVec3::ZERO, 1.0, false));
    assert_eq!(sphere(FLIP), (DVec3::ZERO, 1.0, true));
    // Mitsuba 3.9.1: centre (3, 0, 0), radius 6.
    let inside = r#"<point name="center" x="1" y="0" z="0"/><float name="radius" value="3"/>
        <transform name="to_world"><scale value="2"/><translate x="1"/></transform>"#;
    let (center, radius, flipped) = sphere(inside);
    assert!((center - DVec3::new(3.0, 0.0, 0.0)).length() < 1e-12 && (radius - 6.0).abs() < 1e-12 && !flipped);
    assert!(sphere(MIRROR).2, "a mirror turns the normals of a sphere around");
}

#[test]
fn a_mirror_that_matters_warns() {
    for plugin in ["sphere", "cube", "obj"] {
        let file = if plugin == "obj" { BALL } else { "" };
        let body = format!(r#"<shape type="{plugin}">{file}{MIRROR}<emitter type="area"/></shape>"#);
        assert!(warning(&body).contains("mirrors this"), "{plugin}");
    }
}

#[test]
fn polygons_become_fans() {
    let obj = obj::parse(b"v 0 0 0\nv 1 0 0\nv 2 1 0\nv 1 2 0\nv 0 1 0\nf 1 2 3 4 5\n").unwrap();
    assert_eq!(obj.mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
    assert!(!obj.has_normals);
}

#[test]
fn what_an_obj_file_may_hold() {
    let text = String::new()
        + "# comment\r\nmtllib a b.mtl\r\no thing\r\nv 9 9 9\r\nv 0 0 0 1\r\n  v 1 0 0 0.5 0.5 0.5\r\n\r\nv 0 1e0 0\t# end\r\n"
        + "vt 0 1\nvt 0.5\nvn 0 0 1\ng a b\ns 1\nusemtl x\nl 1 2 3\np 1\nf -3/1/1 -2//-1 4/-1\n";
    let obj = obj::parse(text.as_bytes()).unwrap();
    // The corner that no face uses is not kept.
    assert_eq!(obj.mesh.positions, [DVec3::ZERO, DVec3::X, DVec3::Y]);
    assert_eq!(obj.mesh.triangles, [[0, 1, 2]]);
    assert!(obj.has_normals);
    // Corners without a normal or texture coordinates in a file that has some.
    assert_eq!(obj.mesh.normals, [DVec3::Z, DVec3::Z, DVec3::ZERO]);
    assert_eq!(obj.mesh.uvs, [DVec2::new(0.0, 1.0), DVec2::ZERO, DVec2::new(0.5, 0.0)]);
    assert_eq!(obj.missing_uvs, 1);
}

#[test]
fn seams_split_vertices() {
    let square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
    let plain = obj::parse(format!("{square}f 1 2 3\nf 1 3 4\n").as_bytes()).unwrap().mesh;
    assert_eq!((plain.positions.len(), plain.uvs.len(), plain.normals.len()), (4, 0, 0));
    // One of the shared corners has another texture coordinate in the second triangle, the other the same.
    let seam = format!("{square}vt 0 0\nvt 1 0\nvt 1 1\nvt 0.5 0.5\nf 1/1 2/2 3/3\nf 1/4 3/3 4/1\n");
    let seam = obj::parse(seam.as_bytes()).unwrap().mesh;
    assert_eq!(seam.triangles, [[0, 1, 2], [3, 2, 4]]);
    assert_eq!(seam.positions[0], seam.positions[3]);
    assert_eq!((seam.uvs[0], seam.uvs[3], seam.uvs[4]), (DVec2::ZERO, DVec2::splat(0.5), DVec2::ZERO));
    // Normals come out as unit vectors, whatever their length; those of length 0 are none.
    let normals = format!("{square}vn 0 0 5\nvn 1e-300 0 0\nvn 0 0 0\nf 1//1 2//2 3//3\n");
    assert_eq!(obj::parse(normals.as_bytes()).unwrap().mesh.normals, [DVec3::Z, DVec3::X, DVec3::ZERO]);
}

/// The largest distance of a mesh's vertex normals from expected ones, for each position in turn.
fn normal_error(mesh: &Mesh, expected: &[(DVec3, DVec3)]) -> f64 {
    assert_eq!(mesh.normals.len(), expected.len());
    expected
        .iter()
        .map(|(position, normal)| {
            let vertex = mesh.positions.iter().position(|p| p == position).unwrap();
            mesh.normals[vertex].distance(*normal)
        })
        .fold(0.0, f64::max)
}

#[test]
fn normals_are_made_as_mitsuba_makes_them() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 3 0\nv 0 0 2\nv 1 0 2\nf 1 2 3\nf 1 3 4\nf 1 4 2\nf 2 4 5\n";
    let Geometry::Mesh(mesh) = with_obj(text).unwrap().scene.shapes[0].geometry.clone() else { panic!() };
    // What Mitsuba 3.9.1 has as `vertex_normals` of this file, in single precision.
    let v = DVec3::new;
    let mut expected = [
        (v(0.0, 0.0, 0.0), DVec3::splat(0.577_350_26)),
        (v(1.0, 0.0, 0.0), v(0.0, 0.782_710_55, 0.622_385_8)),
        (v(0.0, 3.0, 0.0), v(0.877_253_83, 0.0, 0.480_026_66)),
        (v(0.0, 0.0, 2.0), v(0.530_404_8, 0.847_744_5, 0.0)),
        (v(1.0, 0.0, 2.0), DVec3::Y),
    ];
    assert!(normal_error(&mesh, &expected) < 1e-6, "{:?}", mesh.normals);
    // Means without weights, and weighted by area, are other directions.
    expected[2].1 = v(1.0, 0.0, 1.0).normalize();
    assert!(normal_error(&mesh, &expected) > 0.1);
}

#[test]
fn normals_follow_the_triangles() {
    // A tilted normal in the file, on the side of the triangle.
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0.6 0 0.8\nf 1//1 2//1 3//1\n";
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("m.obj"), text).unwrap();
    let read = |inside: &str| {
        let body = format!(
            r#"<scene version="3.0.0">{SENSOR}{LIGHT}<shape type="obj"><string name="filename" value="m.obj"/>{inside}</shape></scene>"#
        );
        let scene = parse_str(&body, &folder.path().join("s.xml"), &[]).unwrap().scene;
        let Geometry::Mesh(mesh) = scene.shapes[0].geometry.clone() else { panic!() };
        let [a, b, c] = mesh.triangles[0].map(|corner| mesh.positions[corner as usize]);
        (mesh.normals.first().copied(), (b - a).cross(c - a).normalize())
    };
    let near = |(normal, flat): (Option<DVec3>, DVec3), expected: DVec3| {
        let normal = normal.unwrap();
        assert!(normal.distance(expected) < 1e-12 && normal.dot(flat) > 0.0, "{normal} beside {flat}");
    };
    near(read(""), DVec3::new(0.6, 0.0, 0.8));
    near(read(FLIP), DVec3::new(-0.6, 0.0, -0.8));
    // A normal is scaled by the inverse: (0.6 / 2, 0, 0.8).
    let stretch = r#"<transform name="to_world"><scale x="2"/></transform>"#;
    near(read(stretch), DVec3::new(0.3, 0.0, 0.8).normalize());
    // A mirror moves the normal, and the triangle has its front there, as in Mitsuba 3.9.1.
    near(read(MIRROR), DVec3::new(-0.6, 0.0, 0.8));
    near(read(&format!("{MIRROR}{FLIP}")), DVec3::new(0.6, 0.0, -0.8));
    assert_eq!(read(r#"<boolean name="face_normals" value="true"/>"#).0, None);
}

#[test]
fn texture_coordinates() {
    let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0.1 0.2\nvt 0.9 0.2\nvt 0.9 0.7\nf 1/1 2/2 3/3\n";
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("m.obj"), text).unwrap();
    let uvs = |inside: &str| {
        let body = format!(
            r#"<scene version="3.0.0">{SENSOR}{LIGHT}<shape type="obj"><string name="filename" value="m.obj"/>{inside}</shape></scene>"#
        );
        let loaded = parse_str(&body, &folder.path().join("s.xml"), &[]).unwrap();
        assert_eq!(loaded.warnings, [""; 0]);
        let Geometry::Mesh(mesh) = loaded.scene.shapes[0].geometry.clone() else { panic!() };
        assert!(mesh.normals.is_empty(), "a flat mesh needs none");
        mesh.uvs
    };
    // What Mitsuba 3.9.1 has as `vertex_texcoords`.
    let flipped = [(0.1, 0.8), (0.9, 0.8), (0.9, 0.3)].map(|(u, v)| DVec2::new(u, v));
    assert!(uvs("").iter().zip(flipped).all(|(got, want)| got.distance(want) < 1e-12));
    let plain = uvs(r#"<boolean name="flip_tex_coords" value="false"/>"#);
    assert_eq!(plain[2], DVec2::new(0.9, 0.7));
    // Mitsuba 3.9.1 at (0.5, 0.25) of a rectangle and at points of a cube's faces.
    assert_eq!(uv_at(&mesh::rectangle(), DVec3::new(0.5, 0.25, 0.0)), DVec2::new(0.75, 0.625));
    for (point, expected) in [
        ((1.0, 0.5, 0.25), (0.75, 0.375)),
        ((-1.0, 0.5, 0.25), (0.75, 0.625)),
        ((0.25, 1.0, 0.5), (0.375, 0.25)),
        ((0.25, -1.0, 0.5), (0.75, 0.625)),
        ((0.5, 0.25, 1.0), (0.625, 0.75)),
        ((0.5, 0.25, -1.0), (0.375, 0.75)),
    ] {
        assert_eq!(uv_at(&mesh::cube(), point.into()), expected.into(), "{point:?}");
    }
}

/// Texture coordinates at a point of a mesh.
fn uv_at(mesh: &Mesh, point: DVec3) -> DVec2 {
    let areas = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|corner| mesh.positions[corner as usize]);
        let normal = (b - a).cross(c - a);
        let weight = |p: DVec3, q: DVec3| (p - point).cross(q - point).dot(normal) / normal.length_squared();
        let inside = (point - a).dot(normal).abs() < 1e-9;
        inside.then(|| [weight(b, c), weight(c, a), weight(a, b)])
    };
    let found = mesh.triangles.iter().find_map(|triangle| {
        let weights = areas(triangle).filter(|weights| weights.iter().all(|weight| *weight > -1e-9))?;
        Some((0..3).map(|k| mesh.uvs[triangle[k] as usize] * weights[k]).sum())
    });
    found.unwrap_or_else(|| panic!("{point} is on no triangle"))
}

#[test]
fn malformed_obj_files() {
    // `^` marks the place of the fault.
    for (text, message) in [
        ("^v 1 2", "2 numbers are given; at least 3 are needed"),
        ("v 0 0 0\nv 1 ^x 3", "\"x\" is not a number"),
        ("# a\n\nv 0 0 ^nan", "\"nan\" is not a finite number"),
        ("v 0 ^inf 0", "not a finite number"),
        ("v 0 ^1e999 0", "not a finite number"),
        ("^v 0 0 0 2", "weight"),
        ("^v 0 0 0 1 1", "5 numbers"),
        ("v 0 0 0 1 1 1 1 ^1", "at most 7"),
        ("v 0 0 0\nv 1 0 0\nf 1 2 ^3\nv 0 1 0", "there is no vertex 3: the file has 2"),
        ("v 0 0 0\nf ^0 1 1", "there is no vertex 0"),
        ("v 0 0 0\nf 1 1 ^-2", "there is no vertex -2"),
        ("v 0 0 0\nf 1 1 ^9223372036854775807", "there is no vertex"),
        ("v 0 0 0\nf 1 1 ^-9223372036854775808", "there is no vertex"),
        ("v 0 0 0\nf 1 1 ^99999999999999999999", "not the index of a vertex"),
        ("v 0 0 0\n^f 1 1", "2 corners"),
        ("v 0 0 0\n^f", "0 corners"),
        ("v 0 0 0\nf 1 ^/1 1", "not the index of a vertex"),
        ("v 0 0 0\nf 1/^1 1 1", "there is no texture coordinate 1"),
        ("v 0 0 0\nf 1 1 1 ^1//1", "there is no normal 1"),
        ("v 0 0 0\nf 1 1 ^1//// 1", "not a corner"),
        ("v 0 0 0\nf 1 1 ^1,2", "not the index of a vertex"),
        ("v 0 0 0\nf 1 1 ^\\", "not the index"),
        ("vn 0 0 ^up", "not a number"),
        ("^<html>", "\"<html>\" is not a statement"),
        ("^curv 0 1", "not a statement of a polygon mesh"),
        ("^\u{0}\u{1}", "not a statement"),
    ] {
        let fault = text.find('^').unwrap();
        let line = text[..fault].matches('\n').count() as u32 + 1;
        let mut col = (fault - text[..fault].rfind('\n').map_or(0, |at| at + 1)) as u32 + 1;
        let error = obj::parse(text.replace('^', "").as_bytes()).unwrap_err();
        if text.contains("f 1/^") {
            col -= 2; // The place of a corner is its start.
        }
        assert!(error.message.contains(message), "{text}: {error:?}");
        assert_eq!((error.line, error.col), (line, col), "{text}: {error:?}");
    }
}

/// A scene with one OBJ file, in a folder of its own.
fn with_obj(text: &str) -> Result<Loaded, SceneError> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("m.obj"), text).unwrap();
    let body = format!(
        "<scene version=\"3.0.0\">{SENSOR}{LIGHT}\n<shape type=\"obj\">\n<string name=\"filename\" value=\"m.obj\"/></shape></scene>"
    );
    parse_str(&body, &folder.path().join("s.xml"), &[])
}

#[test]
fn a_fault_in_a_mesh_names_both_files() {
    let error = with_obj("v 0 0 0\nv NaN 0 0\n").unwrap_err();
    assert!(matches!(error, SceneError::Asset { line: 2, col: 3, .. }), "{error}");
    let error = error.to_string();
    assert!(error.contains("m.obj:2:3: ") && error.contains("s.xml:3:1)"), "{error}");
    let error = with_obj("v 0 0 0\n").unwrap_err().to_string();
    assert!(error.contains("s.xml:3:1: ") && error.contains("m.obj has no faces"), "{error}");
    let missing = format!(
        r#"<scene version="3.0.0">{SENSOR}<shape type="obj">
        <string name="filename" value="no.obj"/></shape></scene>"#
    );
    let error = parse_str(&missing, &data("s.xml"), &[]).unwrap_err().to_string();
    assert!(error.contains("s.xml:2:9: cannot read the mesh ") && error.contains("no.obj"), "{error}");
}

#[test]
fn triangles_without_area_are_counted() {
    let square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.1 0.1 0.3\nv 0.2 0.2 0.6\nv 0.7 0.7 2.1\n";
    let loaded = with_obj(&format!("{square}f 1 2 3\nf 1 1 2\nf 5 6 7\nf 1 3 4\n")).unwrap();
    let Geometry::Mesh(mesh) = &loaded.scene.shapes[0].geometry else { panic!() };
    assert_eq!(mesh.triangles.len(), 2);
    assert!(loaded.warnings.len() == 1 && loaded.warnings[0].contains("2 of 4 triangles"), "{:?}", loaded.warnings);
    let loaded = with_obj(&format!("{square}f 1 1 2\n")).unwrap();
    assert!(loaded.scene.shapes.is_empty() && loaded.warnings[0].contains("all 1 triangles"), "{:?}", loaded.warnings);
    // Small triangles are not degenerate ones.
    for scale in ["1e-150", "1e-6", "1e150"] {
        let text = square.replace("1 ", &format!("{scale} "));
        let loaded = with_obj(&format!("{text}f 1 2 3\n")).unwrap();
        assert_eq!((loaded.scene.shapes.len(), loaded.warnings), (1, vec![]), "{scale}");
    }
}

#[test]
fn a_large_file_is_read() {
    let mut text = String::new();
    let side = 200;
    for y in 0..=side {
        for x in 0..=side {
            text += &format!("v {x} {y} {}\n", (x * y) % 7);
        }
    }
    for y in 0..side {
        for x in 0..side {
            let a = y * (side + 1) + x + 1;
            text += &format!("f {} {} {} {}\n", a, a + 1, a + side + 2, a + side + 1);
        }
    }
    assert_eq!(obj::parse(text.as_bytes()).unwrap().mesh.triangles.len(), 2 * side * side);
}

/// Triangles as corners, as our reader and as `tobj` see them.
fn both(text: &str) -> (Vec<DVec3>, Vec<DVec3>) {
    let ours = obj::parse(text.as_bytes()).unwrap().mesh;
    let ours = ours.triangles.iter().flatten().map(|&index| ours.positions[index as usize]).collect();
    let options = tobj::LoadOptions { triangulate: true, single_index: true, ..Default::default() };
    let (models, _) = tobj::load_obj_buf(&mut text.as_bytes(), &options, |_| Ok(Default::default())).unwrap();
    let theirs = models
        .iter()
        .flat_map(|model| &model.mesh.indices)
        .map(|&index| (&models[0].mesh.positions, index as usize))
        .map(|(p, i)| DVec3::new(p[3 * i], p[3 * i + 1], p[3 * i + 2]))
        .collect();
    (ours, theirs)
}

proptest! {
    #![proptest_config(ProptestConfig { rng_seed: proptest::test_runner::RngSeed::Fixed(11), failure_persistence: None, ..ProptestConfig::default() })]

    /// Two readers that know nothing of each other find the same triangles.
    #[test]
    fn obj_files_read_as_tobj_reads_them(
        vertices in prop::collection::vec((-1e3..1e3f64, -1e3..1e3f64, -1e-3..1e-3f64), 3..20),
        faces in prop::collection::vec(prop::collection::vec(any::<prop::sample::Index>(), 3..7), 1..20),
        from_end in any::<bool>(),
    ) {
        let mut text: String = vertices.iter().map(|(x, y, z)| format!("v {x} {y} {z:e}\n")).collect();
        for face in &faces {
            text += "f";
            for corner in face {
                let index = corner.index(vertices.len()) as i64;
                text += &format!(" {}", if from_end { index - vertices.len() as i64 } else { index + 1 });
            }
            text += "\n";
        }
        let (ours, theirs) = both(&text);
        prop_assert_eq!(ours, theirs);
    }
}

#[test]
fn the_comparison_with_tobj_can_fail() {
    // `tobj` takes a polyline for a triangle.
    let (ours, theirs) = both("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nl 1 2 3\n");
    assert_ne!(ours, theirs);
}
