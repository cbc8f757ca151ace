//! Edges, vertices, faces that coincide, triangles without an area, slivers, and very many triangles.

use crate::common::images;
use crate::common::scenes::{self, gray, v};
use crate::{check_transmittance, estimate, judge, lit_through, seen_through, transmittance};
use glam::{DMat4, DQuat, DVec3};
use std::f64::consts::PI;
use std::time::Instant;
use tyndall::scene::{Bsdf, Geometry, Light, Mesh, Scene, Shape};

fn mesh_of(geometry: Geometry) -> Mesh {
    match geometry {
        Geometry::Mesh(mesh) => mesh,
        Geometry::Sphere { .. } => panic!("not a mesh"),
    }
}

/// A mesh about the origin, turned so that `direction` points to the light, and moved between floor and light.
fn turned(mesh: &Mesh, direction: DVec3) -> Geometry {
    let rotation = DQuat::from_rotation_arc(direction.normalize(), DVec3::Y);
    let positions = mesh.positions.iter().map(|at| rotation * *at * 0.5 + v(0.0, 1.5, 0.0)).collect();
    Geometry::Mesh(Mesh { positions, ..mesh.clone() })
}

/// Twice the distance at which the ray from the centre meets the mesh, from its triangles' planes: an oracle of one line for convex
/// meshes about the origin.
fn chord(mesh: &Mesh, direction: DVec3) -> f64 {
    let [one, other] = [direction.normalize(), -direction.normalize()].map(|direction| {
        let plane = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|corner| mesh.positions[corner as usize]);
            let normal = (b - a).cross(c - a);
            let slope = normal.dot(direction);
            if slope > 1e-9 * normal.length() { normal.dot(a) / slope } else { f64::INFINITY }
        };
        mesh.triangles.iter().map(plane).fold(f64::INFINITY, f64::min)
    });
    one + other
}

#[test]
fn rays_through_vertices_and_edges() {
    let cube = mesh_of(scenes::cuboid(DMat4::IDENTITY));
    let sphere = scenes::icosphere(2);
    let vertex = |index: usize| sphere.positions[index];
    let corner = |triangle: usize, k: usize| vertex(sphere.triangles[triangle][k] as usize);
    let cases = [
        ("cube, corner", &cube, v(1.0, 1.0, 1.0)),
        ("cube, middle of an edge", &cube, v(1.0, -1.0, 0.0)),
        ("cube, on an edge", &cube, v(1.0, -1.0, 0.3)),
        ("cube, diagonal of a face", &cube, v(0.0, 0.0, 1.0)),
        ("sphere, vertex of five", &sphere, vertex(0)),
        ("sphere, vertex of six", &sphere, vertex(30)),
        ("sphere, last vertex", &sphere, vertex(161)),
        ("sphere, edge", &sphere, corner(17, 0) + corner(17, 1)),
        ("sphere, on an edge", &sphere, corner(200, 1) * 0.7 + corner(200, 2) * 0.3),
    ];
    for (name, mesh, direction) in cases {
        // A ray that lost one of its crossings would see the depth of half the way to the light, or of none.
        let tau = 4.0 * 0.5 * chord(mesh, direction);
        let found = transmittance(vec![(gray(4.0, 0.0, 0.0), turned(mesh, direction))]).x;
        check_transmittance(found, tau, 1e-5).unwrap_or_else(|why| panic!("{name}: {why}"));
        check_transmittance(found * 1.001, tau, 1e-5).expect_err("one ray of a thousand leaks");
    }
}

/// A body that is not seen, before a black one: whoever loses count of the boundaries sees the sky.
fn counted(mesh: &Mesh, direction: DVec3, faults: bool) -> Scene {
    let mut first = turned(mesh, direction);
    if let (Geometry::Mesh(mesh), true) = (&mut first, faults) {
        // Open behind: the way out of the first body is lost.
        let behind = |corner: u32| mesh.positions[corner as usize].y < 1.5;
        let kept = mesh.triangles.iter().filter(|triangle| !triangle.iter().all(|corner| behind(*corner)));
        mesh.triangles = kept.copied().collect();
    }
    let black = scenes::cuboid(DMat4::from_scale(v(1.0, 0.25, 1.0)));
    let bodies = vec![(gray(0.0, 0.0, 0.0), first), (gray(1e4, 0.0, 0.0), black)];
    seen_through(bodies, v(0.0, 4.0, 0.0), DVec3::ZERO)
}

#[test]
fn a_medium_that_is_entered_is_left() {
    let (cube, sphere) = (mesh_of(scenes::cuboid(DMat4::IDENTITY)), scenes::icosphere(2));
    let dark = |scene: &Scene| images::average(&images::on_device(&scenes::pack(scene, 1), 64)).x;
    for (mesh, direction) in [(&cube, DVec3::ONE), (&cube, v(1.0, -1.0, 0.0)), (&sphere, sphere.positions[30])] {
        assert_eq!(dark(&counted(mesh, direction, false)), 0.0, "a ray along {direction} lost count");
    }
    assert!(dark(&counted(&sphere, sphere.positions[30], true)) > 0.5, "a ray that lost count would be seen");
}

#[test]
fn cameras_on_faces_edges_and_vertices() {
    for (name, start) in [("a face", v(0.2, 0.1, 1.0)), ("an edge", v(1.0, 0.1, 1.0)), ("a vertex", v(1.0, 1.0, 1.0))] {
        let inwards = (v(0.1, -0.2, -0.3) - start).normalize();
        // To where the ray leaves the cube. It begins on the near plane, a hundredth away.
        let way =
            (0..3).map(|axis| (inwards[axis].signum() - start[axis]) / inwards[axis]).fold(f64::INFINITY, f64::min);
        let cube = || vec![(gray(1.0, 0.0, 0.0), scenes::cuboid(DMat4::IDENTITY))];
        let scene = seen_through(cube(), start, start + inwards);
        judge(&format!("inwards from {name}"), estimate(&scene, 1, 64), (0.01 - way).exp(), 1e-5, 3e-2);
        let scene = seen_through(cube(), start, start - inwards);
        let outwards = images::on_device(&scenes::pack(&scene, 1), 64);
        assert!(outwards.iter().all(|pixel| *pixel == DVec3::ONE), "outwards from {name}: something is in the way");
        // With the near plane itself on the boundary, rounding decides on which side a ray begins. It is one of the two.
        let mut scene = seen_through(cube(), start - inwards * 0.25, start);
        scene.camera.near_clip = 0.25;
        let either = images::average(&images::on_device(&scenes::pack(&scene, 1), 64)).x;
        let possible = |found: f64| found > 0.95 * (-way).exp() && found <= 1.0;
        assert!(possible(either), "near plane on {name}: {either}");
        assert!(!possible(0.9 * (-way).exp()) && !possible(f64::NAN), "the comparison is blind");
    }
}

#[test]
fn triangles_without_area_are_not_there() {
    let plain = mesh_of(scenes::cuboid(DMat4::IDENTITY));
    let mut mesh = plain.clone();
    // Two corners that are one, three that are one, three on a line, and a triangle there and back.
    mesh.positions.push((mesh.positions[0] + mesh.positions[1]) * 0.5);
    mesh.triangles.extend([[0, 0, 1], [2, 2, 2], [0, 8, 1], [1, 8, 0], [5, 6, 5]]);
    for direction in [DVec3::Z, v(0.3, 0.2, 1.0), v(0.0, -1.0, -1.0), DVec3::ONE] {
        let [expected, found] =
            [&plain, &mesh].map(|mesh| transmittance(vec![(gray(2.0, 0.0, 0.0), turned(mesh, direction))]));
        assert_eq!(found, expected, "along {direction}");
        assert!(expected.x < 0.5);
    }
    // As walls as well, in light that meets them from everywhere.
    let walls = |mesh: &Mesh| {
        let mut scene = Scene::new(
            tyndall::scene::Camera::look_at(v(3.0, 4.0, 2.5), DVec3::ZERO, DVec3::Y, 30.0),
            tyndall::scene::Film::new(16, 16),
        );
        scene.shapes.push(Shape::diffuse("cube", Geometry::Mesh(mesh.clone()), DVec3::splat(0.5)));
        scene.lights.push(Light::Constant { radiance: DVec3::ONE });
        images::average(&images::on_device(&scenes::pack(&scene, 1), 16))
    };
    let (one, other) = (walls(&plain), walls(&mesh));
    assert!((one - other).abs().max_element() < 1e-6 && one.x > 0.1, "{one} and {other}");
}

/// A floor of 0.2 × 0.2 around the origin with `strips` slivers of the width 2e-7 in the middle.
fn strips(strips: i32) -> Mesh {
    let mut edges: Vec<f64> = (-strips / 2..=strips / 2).map(|k| 2e-7 * f64::from(k)).collect();
    edges.insert(0, -0.1);
    edges.push(0.1);
    let positions = edges.iter().flat_map(|&x| [v(x, 0.0, 0.1), v(x, 0.0, -0.1)]).collect();
    let pair = |k: u32| [[2 * k, 2 * k + 2, 2 * k + 3], [2 * k, 2 * k + 3, 2 * k + 1]];
    let triangles = (0..edges.len() as u32 - 1).flat_map(pair).collect();
    Mesh { positions, triangles, ..Mesh::default() }
}

#[test]
fn a_floor_of_slivers_is_a_floor() {
    // A million times as long as wide. Their own shadow once fell on them: a distance above 0 is found for the triangle that a ray
    // leaves.
    let mut scene = lit_through(vec![]);
    // Wide enough to see all the slivers, and no more.
    scene.camera.fov_x = (3e-5f64 / 2.5).to_degrees();
    for light in [v(0.0, 3.0, 0.0), v(2.0, 0.5, 0.1), v(0.0, 0.01, 2.0)] {
        scene.lights = vec![Light::Point { position: light, intensity: DVec3::ONE }];
        let [plain, slivers] = [0, 200].map(|strip| {
            scene.shapes[0].geometry = Geometry::Mesh(strips(strip));
            images::on_device(&scenes::pack(&scene, 1), 16)
        });
        let expected = 0.5 / PI * light.normalize().y / light.length_squared();
        assert!((images::average(&plain).x / expected - 1.0).abs() < 1e-4, "light at {light}, expected {expected}");
        let right = |one: f64, other: f64| (one / other - 1.0).abs() < 1e-5;
        for (plain, sliver) in plain.iter().zip(&slivers) {
            assert!(right(sliver.x, plain.x), "slivers, light at {light}: {}, expected {}", sliver.x, plain.x);
        }
        assert!(!right(plain[0].x * 15.0 / 16.0, plain[0].x), "a shadow on one sample is seen");
    }
}

#[test]
fn a_tube_of_long_facets_is_lit_as_by_the_reference() {
    let facets = 256u32;
    let at = |k: u32, y: f64| {
        let angle = 2.0 * PI * f64::from(k % facets) / f64::from(facets);
        v(angle.cos(), y, angle.sin())
    };
    let positions = (0..facets).flat_map(|k| [at(k, -20.0), at(k, 20.0)]).collect();
    let corner = |k: u32, side: u32| 2 * (k % facets) + side;
    let pair = |k: u32| {
        let [a, b, c, d] = [corner(k, 0), corner(k, 1), corner(k + 1, 1), corner(k + 1, 0)];
        [[a, b, c], [a, c, d]]
    };
    let triangles = (0..facets).flat_map(pair).collect();
    let mut scene = scenes::one_ray(v(0.1, 0.3, 0.0), v(1.0, 0.0, 0.05), 16);
    scene.camera.fov_x = 60.0;
    let mut tube =
        Shape::diffuse("tube", Geometry::Mesh(Mesh { positions, triangles, ..Mesh::default() }), DVec3::splat(0.8));
    tube.bsdf = Bsdf::Diffuse { reflectance: DVec3::splat(0.8).into(), two_sided: true };
    scene.shapes.push(tube);
    scene.lights.push(Light::Point { position: v(-0.3, 0.5, 0.2), intensity: DVec3::ONE });
    let packed = scenes::pack(&scene, 1);
    let [device, reference] =
        [images::on_device(&packed, 64), images::by_reference(&packed, 64)].map(|image| images::average(&image).x);
    let right = |found: f64| (found / reference - 1.0).abs() < 1e-3;
    assert!(right(device), "{device}, by the reference {reference}");
    assert!(!right(device * 0.998), "the comparison is blind");
}

#[test]
fn more_than_a_million_triangles() {
    let start = Instant::now();
    let mesh = scenes::icosphere(8);
    assert!(mesh.triangles.len() > 1_300_000);
    eprintln!("made after {:.1} s", start.elapsed().as_secs_f64());
    let direction = v(0.3, 1.0, 0.2);
    let chord = chord(&mesh, direction);
    assert!((chord - 2.0).abs() < 1e-4);
    let found = transmittance(vec![(gray(3.0, 0.0, 0.0), turned(&mesh, direction))]).x;
    eprintln!("rendered after {:.1} s", start.elapsed().as_secs_f64());
    check_transmittance(found, 1.5 * chord, 1e-5).unwrap_or_else(|why| panic!("{why}"));
    check_transmittance(found * 1.001, 1.5 * chord, 1e-5).expect_err("one ray of a thousand leaks");
}

fn cube(center: DVec3, half: f64) -> Geometry {
    scenes::cuboid(DMat4::from_translation(center) * DMat4::from_scale(DVec3::splat(half)))
}

#[test]
fn faces_that_coincide() {
    // Two cubes that share a face; and a cube in the corner of another, with three faces in common.
    let side_by_side = [cube(v(0.02, 1.0, 0.03), 0.5), cube(v(0.02, 2.0, 0.03), 0.5)];
    let in_a_corner = [cube(v(0.02, 1.5, 0.03), 0.5), cube(v(-0.23, 1.25, -0.22), 0.25)];
    let media = || [gray(1.0, 0.0, 0.0), gray(3.0, 0.0, 0.0)];
    for (name, geometry, tau) in [("side by side", side_by_side, 4.0), ("in a corner", in_a_corner, 2.0)] {
        let bodies = |media: [tyndall::scene::Medium; 2]| media.into_iter().zip(geometry.clone()).collect::<Vec<_>>();
        let found = transmittance(bodies(media())).x;
        check_transmittance(found, tau, 1e-5).unwrap_or_else(|why| panic!("{name}: {why}"));
        check_transmittance(found, tau + 1e-3, 1e-5).expect_err("another depth");
        // A path that took the wrong medium behind a face would still end, but not lose nothing: albedo 1 against 0.99 outside.
        let scene = |media| seen_through(bodies(media), v(0.0, 4.0, 0.0), v(-0.2, 1.5, -0.1));
        let lossless = scene([gray(1.0, 1.0, 0.3), gray(3.0, 1.0, -0.3)]);
        judge(name, estimate(&lossless, 1, 128), 1.0, 1e-5, 4e-3);
    }
}

#[test]
fn eight_media_in_each_other() {
    let of_ball = |half: f64, off: f64| 2.0 * (half * half - off * off).sqrt();
    type Shape = (fn(DVec3, f64) -> Geometry, fn(f64, f64) -> f64);
    let shapes: [Shape; 2] = [(cube, |half, _| 2.0 * half), (scenes::ball, of_ball)];
    for (geometry, chord) in shapes {
        let sigma = |k: i32| 0.3 * f64::from(k + 1);
        let half = |k: i32| f64::from(8 - k) / 16.0;
        let bodies = |albedo, center: DVec3| -> Vec<_> {
            (0..8).map(|k| (gray(sigma(k), albedo, 0.1 * f64::from(k)), geometry(center, half(k)))).collect()
        };
        // Each layer but the last is crossed twice.
        let way = |k: i32, off: f64| if k < 8 { chord(half(k), off) } else { 0.0 };
        let depth = |off: f64| (0..8).map(|k| sigma(k) * (way(k, off) - way(k + 1, off))).sum::<f64>();
        let (center, off) = (v(0.01, 1.5, 0.02), 0.01f64.hypot(0.02));
        let found = transmittance(bodies(0.0, center)).x;
        check_transmittance(found, depth(off), 1e-5).unwrap_or_else(|why| panic!("through all: {why}"));
        check_transmittance(found, depth(off) - 1e-3, 1e-5).expect_err("another depth");
        // From the innermost outwards.
        let from_within = |albedo| {
            let mut scene = seen_through(bodies(albedo, DVec3::ZERO), DVec3::ZERO, v(0.0, 0.0, 1.0));
            scene.camera.near_clip = 1e-6;
            scene
        };
        judge("out of the innermost", estimate(&from_within(0.0), 1, 64), (-0.5 * depth(0.0)).exp(), 1e-5, 8e-3);
        judge("furnace of eight", estimate(&from_within(1.0), 2, 64), 1.0, 1e-5, 8e-3);
    }
}

#[test]
fn grazing_rays() {
    // Within a slab for the length of 2 below an angle of 1e-4: the cosines of the faces have four digits fewer.
    let cosine = 1e-4f64;
    let slab = scenes::cuboid(DMat4::from_scale(v(4.0, cosine, 4.0)));
    let direction = v(0.8 * (1.0 - cosine * cosine).sqrt(), -cosine, 0.6 * (1.0 - cosine * cosine).sqrt());
    let mut scene = seen_through(vec![(gray(1.0, 0.0, 0.0), slab)], -direction * 3.0, DVec3::ZERO);
    scene.camera.fov_x = 1e-8;
    judge("grazing", estimate(&scene, 1, 256), (-2f64).exp(), 5e-3, 1e-2);
}
