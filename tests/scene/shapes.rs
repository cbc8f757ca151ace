//! Mesh files of other formats, round shapes, and instances.

use std::io::Write;
use std::path::Path;

use flate2::{Compression, write::ZlibEncoder};
use glam::{DVec2, DVec3};
use tyndall::scene::mesh::{cylinder, disk, obj, ply, serialized};
use tyndall::scene::mitsuba::{Loaded, parse_str};
use tyndall::scene::*;

use crate::{LIGHT, SENSOR, scene, with_warnings};

/// A scene whose files lie in `folder`.
fn in_folder(folder: &Path, body: &str) -> Result<Loaded, SceneError> {
    let text = format!("<scene version=\"3.0.0\">{SENSOR}{LIGHT}\n{body}\n</scene>");
    parse_str(&text, &folder.join("scene.xml"), &[])
}

fn mesh_of(shape: &Shape) -> &Mesh {
    let Geometry::Mesh(mesh) = &shape.geometry else { panic!("{} is no mesh", shape.name) };
    mesh
}

fn error_of(body: &str) -> String {
    let text = format!("<scene version=\"3.0.0\">{SENSOR}{LIGHT}\n{body}\n</scene>");
    crate::parse(&text).unwrap_err().to_string()
}

/// A house: a quad and a triangle above it. Columns: x y z nx ny nz u v.
const HOUSE: [[f32; 8]; 5] = [
    [0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0],
    [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0],
    [1.0, 1.5, 0.25, 0.0, 0.0, 2.0, 1.0, 0.5],
    [0.0, 1.5, 0.25, 0.0, 0.0, 1.0, 0.0, 0.5],
    [0.5, 2.0, 0.0, 0.0, 0.0, 0.0, 0.5, 1.0],
];
const FACES: [&[u32]; 2] = [&[0, 1, 2, 3], &[3, 2, 4]];

fn house_obj() -> Mesh {
    let mut text = String::new();
    for [x, y, z, nx, ny, nz, u, v] in HOUSE {
        text += &format!("v {x} {y} {z}\nvn {nx} {ny} {nz}\nvt {u} {v}\n");
    }
    for face in FACES {
        let corners: String = face.iter().map(|i| format!(" {0}/{0}/{0}", i + 1)).collect();
        text += &format!("f{corners}\n");
    }
    obj::parse(text.as_bytes()).unwrap().mesh
}

/// The house as PLY, among elements and properties that have no meaning here.
fn house_ply(format: &str) -> Vec<u8> {
    let mut file = format!(
        "ply\nformat {format} 1.0\ncomment a house\nelement material 1\nproperty list uchar short numbers\n\
         element vertex 5\nproperty float x\nproperty double y\nproperty float z\nproperty uchar red\n\
         property float nx\nproperty float ny\nproperty float nz\nproperty float u\nproperty float v\n\
         element face 2\nproperty list uchar ushort other\nproperty list ushort int vertex_indices\nproperty char flag\n\
         end_header\n"
    )
    .into_bytes();
    let mut put = |bytes: &[u8], text: String| match format {
        "ascii" => file.extend(format!("{text}\n").bytes()),
        "binary_little_endian" => file.extend(bytes),
        _ => file.extend(bytes.iter().rev()),
    };
    put(&[2], "2".into());
    put(&7i16.to_le_bytes(), "7".into());
    put(&(-8i16).to_le_bytes(), "-8".into());
    for row in HOUSE {
        for (column, value) in row.into_iter().enumerate() {
            match column {
                1 => put(&f64::from(value).to_le_bytes(), value.to_string()),
                _ => put(&value.to_le_bytes(), value.to_string()),
            }
            if column == 2 {
                put(&[200], "200".into());
            }
        }
    }
    for face in FACES {
        put(&[1], "1".into());
        put(&9u16.to_le_bytes(), "9".into());
        put(&(face.len() as u16).to_le_bytes(), face.len().to_string());
        face.iter().for_each(|index| put(&index.to_le_bytes(), index.to_string()));
        put(&(-1i8).to_le_bytes(), "-1".into());
    }
    file
}

#[test]
fn ply_files_mean_the_same_in_all_formats() {
    let expected = house_obj();
    assert_eq!(expected.triangles, [[0, 1, 2], [0, 2, 3], [3, 2, 4]]);
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let file = house_ply(format);
        assert_eq!(ply::parse(&file).unwrap().mesh, expected, "{format}");
        // A file that ends early is an error wherever it does, and nothing makes the reader panic.
        for length in 0..file.len() - usize::from(format == "ascii") * 3 {
            assert!(ply::parse(&file[..length]).is_err(), "{format}, {length} bytes of {}", file.len());
        }
        for at in 0..file.len() {
            for byte in [0, b'\n', b'9', b'-', 255] {
                let mut broken = file.clone();
                broken[at] = byte;
                if let Ok(read) = ply::parse(&broken) {
                    let count = read.mesh.positions.len() as u32;
                    assert!(read.mesh.triangles.iter().flatten().all(|index| *index < count), "{format} {at} {byte}");
                }
            }
        }
    }
    let windows = String::from_utf8(house_ply("ascii")).unwrap().replace('\n', "\r\n");
    assert_eq!(ply::parse(windows.as_bytes()).unwrap().mesh, expected);
}

#[test]
fn errors_in_ply_files_have_a_place() {
    let good = String::from_utf8(house_ply("ascii")).unwrap();
    for (old, new, message) in [
        ("ply\n", "plx\n", "line 1: the file does not start with \"ply\""),
        ("ascii", "ebcdic", "line 2: the format must be ascii"),
        ("1.0", "2.0", "line 2: only version 1.0"),
        ("property float x", "property half x", "line 7: a property is"),
        ("property float x\n", "", "the vertices have no properties x, y and z"),
        ("vertex_indices", "corners", "the faces have no list vertex_indices"),
        ("element face", "element fence", "the file has no element \"face\""),
        ("end_header", "begin", "unknown statement in the header"),
        ("element vertex 5", "element vertex five", "line 6: the number of elements is not a number"),
        ("list ushort int vertex", "list float int vertex", "the length of a list must be a whole number"),
        ("0.25", "0.2.5", "line 44: \"0.2.5\" is not a number"),
        ("0.25", "NaN", "is not finite"),
        ("\n4\n", "\n2\n", "a face has 2 corners"),
        ("\n4\n0\n1\n", "\n4\n0\n5\n", "a face names vertex 5, but the file has 5 vertices, which count from 0"),
        ("\n4\n0\n1\n", "\n4\n0\n-1\n", "-1 is not the number of a vertex"),
        ("\n4\n0\n1\n", "\n4\n0\n1.5\n", "1.5 is not the number of a vertex"),
    ] {
        assert!(good.contains(old), "{old:?}");
        let error = ply::parse(good.replacen(old, new, 1).as_bytes()).unwrap_err();
        assert!(error.contains(message), "{old:?} → {new:?}: {error}");
    }
    let mut binary = house_ply("binary_little_endian");
    let end = binary.len();
    // The x of the last vertex: behind it are 12 + 8·1 … the faces.
    binary.truncate(end - 3);
    let error = ply::parse(&binary).unwrap_err();
    assert!(error.starts_with("byte ") && error.ends_with("the file ends before its last element"), "{error}");
}

/// The house as one mesh of a `.serialized` file.
fn house_serialized(version: u16, double: bool, name: &str) -> Vec<u8> {
    let mut data = (0x1u32 | 0x2 | 0x8 | if double { 0x2000 } else { 0x1000 }).to_le_bytes().to_vec();
    if version == 4 {
        data.extend(name.bytes().chain([0]));
    }
    data.extend(5u64.to_le_bytes().into_iter().chain(3u64.to_le_bytes()));
    let mut put = |value: f32| match double {
        true => data.extend(f64::from(value).to_le_bytes()),
        false => data.extend(value.to_le_bytes()),
    };
    for columns in [0..3, 3..6, 6..8, 0..3] {
        HOUSE.iter().for_each(|row| row[columns.clone()].iter().for_each(|value| put(*value)));
    }
    for index in [0u32, 1, 2, 0, 2, 3, 3, 2, 4] {
        data.extend(index.to_le_bytes());
    }
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(&data).unwrap();
    [&0x041cu16.to_le_bytes()[..], &version.to_le_bytes(), &encoder.finish().unwrap()].concat()
}

fn serialized_file(version: u16, meshes: &[Vec<u8>]) -> Vec<u8> {
    let mut file = meshes.concat();
    let mut offset = 0u64;
    for mesh in meshes {
        match version {
            4 => file.extend(offset.to_le_bytes()),
            _ => file.extend((offset as u32).to_le_bytes()),
        }
        offset += mesh.len() as u64;
    }
    file.extend((meshes.len() as u32).to_le_bytes());
    file
}

#[test]
fn serialized_files() {
    let expected = house_obj();
    let mut other = house_serialized(4, false, "");
    other[2] = 9;
    for version in [3, 4] {
        let meshes = [house_serialized(version, false, "a house"), house_serialized(version, true, "")];
        let file = serialized_file(version, &meshes);
        for index in [0, 1] {
            assert_eq!(serialized::parse(&file, index).unwrap().mesh, expected, "version {version}, mesh {index}");
        }
        let error = serialized::parse(&file, 2).unwrap_err();
        assert_eq!(error, "shape_index is 2, but the file has 2 meshes, which count from 0");
        for length in 0..file.len() {
            assert!(serialized::parse(&file[..length], 0).is_err(), "{length} bytes");
        }
        for at in 0..file.len() {
            let mut broken = file.clone();
            broken[at] ^= 0x55;
            // Whatever comes out, it is no panic, and no index without a vertex.
            if let Ok(read) = serialized::parse(&broken, 0) {
                assert!(read.mesh.triangles.iter().flatten().all(|index| *index < 5));
            }
        }
    }
    let error = serialized::parse(&serialized_file(4, &[other]), 0).unwrap_err();
    assert!(error.contains("version 9 of the format is not known"), "{error}");
    assert!(serialized::parse(b"PNG and more than that", 0).unwrap_err().contains("not a .serialized file"));
}

#[test]
fn shapes_from_files() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("house.ply"), house_ply("binary_little_endian")).unwrap();
    let houses = serialized_file(4, &[house_serialized(4, true, "one"), house_serialized(4, true, "two")]);
    std::fs::write(folder.path().join("houses.serialized"), houses).unwrap();
    let body = |plugin: &str, file: &str, extra: &str| {
        format!(r#"<shape type="{plugin}"><string name="filename" value="{file}"/>{extra}</shape>"#)
    };
    let read = |body: &str| in_folder(folder.path(), body);
    let moved = r#"<transform name="to_world"><translate z="3"/></transform>"#;
    let index = r#"<integer name="shape_index" value="1"/>"#;
    for body in [body("ply", "house.ply", moved), body("serialized", "houses.serialized", &(moved.to_owned() + index))]
    {
        let loaded = read(&body).unwrap();
        assert_eq!(loaded.warnings, [""; 0]);
        let mesh = mesh_of(&loaded.scene.shapes[0]);
        assert_eq!(mesh.positions[2], DVec3::new(1.0, 1.5, 3.25));
        // As they are in the file, unlike those of OBJ files.
        assert_eq!(mesh.uvs[2], DVec2::new(1.0, 0.5));
        assert_eq!((mesh.triangles.len(), mesh.normals[2]), (3, DVec3::Z));
        let flipped = body.replace("</shape>", r#"<boolean name="flip_tex_coords" value="true"/></shape>"#);
        assert_eq!(mesh_of(&read(&flipped).unwrap().scene.shapes[0]).uvs[1], DVec2::new(1.0, 1.0));
    }
    for (body, message) in [
        (body("ply", "houses.serialized", ""), "scene.xml:2:19: cannot read the mesh"),
        (body("serialized", "house.ply", ""), "this is not a .serialized file"),
        (body("serialized", "houses.serialized", &index.replace('1', "2")), "shape_index is 2, but"),
        (body("serialized", "houses.serialized", &index.replace('1', "-2")), "it must not be negative"),
        (body("ply", "house.ply", index), "has no property \"shape_index\""),
        (r#"<shape type="ply"/>"#.to_owned(), "needs <string name=\"filename\""),
    ] {
        let error = read(&body).unwrap_err().to_string();
        assert!(error.contains(message), "{body}: {error}");
    }
}

fn areas(mesh: &Mesh) -> (f64, f64) {
    let corners = |t: &[u32; 3]| t.map(|index| mesh.positions[index as usize]);
    let area = |t: &[u32; 3]| {
        let [a, b, c] = corners(t);
        (b - a).cross(c - a).length() / 2.0
    };
    // The volume of the cone from the origin over each triangle.
    let volume = |t: &[u32; 3]| {
        let [a, b, c] = corners(t);
        a.dot(b.cross(c)) / 6.0
    };
    (mesh.triangles.iter().map(area).sum(), mesh.triangles.iter().map(volume).sum())
}

#[test]
fn round_shapes() {
    let pi = std::f64::consts::PI;
    let mesh = disk();
    assert!((areas(&mesh).0 - pi).abs() < 1e-12, "the area of the disk");
    assert!(mesh.positions.iter().all(|p| p.z == 0.0 && p.length() < 1.0001));
    let [a, b, c] = mesh.triangles[7].map(|index| mesh.positions[index as usize]);
    assert!((b - a).cross(c - a).z > 0.0, "the normal is +z");

    // Moved and turned; the ends are disks about the ends of the axis.
    let (p0, p1, radius) = (DVec3::new(1.0, -2.0, 0.5), DVec3::new(2.0, 0.0, 2.5), 0.75);
    let mesh = cylinder(p0, p1, radius);
    let axis = (p1 - p0).normalize();
    let side = 2.0 * pi * radius * 3.0;
    assert!((areas(&mesh).0 / side - 1.0).abs() < 5e-5, "the area of the side");
    for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
        let height = (*p - p0).dot(axis);
        assert!(height.abs() < 1e-12 || (height - 3.0).abs() < 1e-12);
        let radial = *p - p0 - axis * height;
        assert!((radial.length() / radius - 1.0).abs() < 1e-4);
        assert!(radial.normalize().distance(*n) < 1e-12, "vertex normals point outwards");
    }
    // Triangles are on the side of the normals, and the volume between the side and the axis' ends is the cylinder's: the
    // caps add a third of their area times the distance of their planes from the origin.
    let cap = pi * radius * radius;
    let caps = cap * (p1.dot(axis) - p0.dot(axis)) / 3.0;
    assert!((areas(&mesh).1 + caps - cap * 3.0).abs() < 1e-9, "{}", areas(&mesh).1 + caps);

    let warning = |body: &str| crate::warning(body);
    assert!(
        warning(r#"<shape type="disk"/>"#).ends_with("this disk is rendered with 256 flat faces, with the same area")
    );
    let body = r#"<shape type="cylinder"><point name="p0" x="1" y="0" z="0"/><point name="p1" x="1" y="0" z="2"/>
        <float name="radius" value="2"/><boolean name="flip_normals" value="true"/></shape>"#;
    let loaded = with_warnings(body);
    let mesh = mesh_of(&loaded.scene.shapes[0]);
    let outwards = |k: usize| {
        let [a, b, c] = mesh.triangles[k].map(|index| mesh.positions[index as usize]);
        (b - a).cross(c - a).dot(a - DVec3::new(1.0, 0.0, a.z))
    };
    assert!((0..512).all(|k| outwards(k) < 0.0), "flip_normals turns them inwards");
    for (body, message) in [
        (r#"<shape type="cylinder"><point name="p1" x="0" y="0" z="0"/></shape>"#, "they must be different points"),
        (
            r#"<shape type="cylinder"><float name="radius" value="0"/></shape>"#,
            "radius is 0; it must be greater than 0",
        ),
    ] {
        assert!(error_of(body).contains(message), "{}", error_of(body));
    }
}

#[test]
fn a_can_is_closed() {
    // A cylinder with two disks as its ends is what Mitsuba's cylinders need to hold a medium. They meet in each corner.
    let can = cylinder(DVec3::ZERO, DVec3::Z, 1.0);
    let place = |p: &DVec3| [p.x, p.y].map(|c| (c * 1e12).round() as i64);
    let rim: Vec<[i64; 2]> = can.positions.iter().filter(|p| p.z == 0.0).map(place).collect();
    let disk = disk();
    assert!(disk.positions.iter().filter(|p| p.length() > 0.5).all(|p| rim.contains(&place(p))));
}

const GROUP: &str = r#"<medium type="homogeneous" id="fog"/><medium type="homogeneous" id="ice"/>
    <shape type="shapegroup" id="drop">
        <shape type="cube" id="shell"><bsdf type="null"/><ref name="interior" id="fog"/></shape>
        <shape type="sphere" id="core"><float name="radius" value="0.5"/><bsdf type="null"/><ref name="interior" id="ice"/>
            <transform name="to_world"><translate x="0.25"/></transform></shape>
    </shape>"#;

#[test]
fn instances_are_copies() {
    let place = |id: &str, transform: &str| {
        format!(
            r#"<shape type="instance" {id}><ref id="drop"/><transform name="to_world">{transform}</transform></shape>"#
        )
    };
    let body = format!(
        "{GROUP}{}{}",
        place(r#"id="left""#, r#"<scale value="2"/><translate x="-5"/>"#),
        place("", r#"<rotate z="1" angle="90"/><translate x="5"/>"#)
    );
    let scene = scene(&body);
    let names: Vec<&str> = scene.shapes.iter().map(|shape| shape.name.as_str()).collect();
    assert_eq!(names, ["left/shell", "left/core", "shell", "core"]);
    assert_eq!(scene.media.len(), 2);
    let sphere = |shape: &Shape| {
        let Geometry::Sphere { center, radius, .. } = shape.geometry else { panic!() };
        (center, radius)
    };
    // The shape's own transform comes first.
    assert_eq!(sphere(&scene.shapes[1]), (DVec3::new(-4.5, 0.0, 0.0), 1.0));
    let (center, radius) = sphere(&scene.shapes[3]);
    assert!(center.distance(DVec3::new(5.0, 0.25, 0.0)) < 1e-15 && radius == 0.5, "{center}");
    assert_eq!(mesh_of(&scene.shapes[0]).positions[0], DVec3::new(-3.0, -2.0, -2.0));
    // Media are nested by geometry, copy by copy.
    assert_eq!(check::parents(&scene), [None, Some(0), None, Some(2)]);
    assert_eq!(check::doubts(&scene), [""; 0]);
}

#[test]
fn what_groups_and_instances_cannot_be() {
    let text = crate::warning(GROUP);
    assert!(text.ends_with("the group \"drop\" has no instance, so nothing of it is seen"), "{text}");
    let instance = |inside: &str| format!(r#"{GROUP}<shape type="instance">{inside}</shape>"#);
    for (body, message) in [
        (instance(""), "holds 0 shapes; it must hold one <ref>"),
        (instance(r#"<ref id="drop"/><ref id="shell"/>"#), "holds 2 shapes"),
        (instance(r#"<ref id="shell"/>"#), "cannot hold <shape type=\"cube\">"),
        (instance(r#"<ref id="drop"/><bsdf type="null"/>"#), "has no use for <bsdf type=\"null\">"),
        (
            instance(r#"<ref id="drop"/><transform name="to_world"><scale x="2"/></transform>"#),
            "a sphere cannot be scaled non-uniformly",
        ),
        (
            r#"<shape type="shapegroup"><shape type="instance"><ref id="x"/></shape></shape><shape type="cube" id="x"/>"#.into(),
            "<shape type=\"shapegroup\"> cannot hold <shape type=\"instance\">",
        ),
        (r#"<shape type="shapegroup"><float name="scale" value="1"/></shape>"#.into(), "has no property \"scale\""),
        // A fault in a group without instances is found.
        (r#"<shape type="shapegroup"><shape type="teapot"/></shape>"#.into(), "<shape type=\"teapot\"> is not supported"),
    ] {
        let error = error_of(&body);
        assert!(error.contains(message), "{body}\n{error}");
    }
}
