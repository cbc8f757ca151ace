//! Boundaries that cross each other are found, and those that are nested, apart or touching are not.

use glam::{DMat4, DVec3};
use tyndall::scene::check::{around_camera, doubts, is_closed, parents};
use tyndall::scene::*;

/// A scene in which each of the meshes and spheres is filled with a medium.
fn filled(geometries: impl IntoIterator<Item = Geometry>) -> Scene {
    let mut scene =
        Scene::new(Camera::look_at(DVec3::new(0.0, 0.0, 99.0), DVec3::ZERO, DVec3::Y, 40.0), Film::new(4, 4));
    let fog = scene.add_medium(Medium::new("fog", DVec3::ONE, DVec3::ZERO, Phase::Isotropic));
    for (index, geometry) in geometries.into_iter().enumerate() {
        scene.shapes.push(Shape::boundary(&format!("shape {index}"), geometry, fog));
    }
    scene
}

/// A box between two corners.
fn block(low: [f64; 3], high: [f64; 3]) -> Geometry {
    let (low, high) = (DVec3::from(low), DVec3::from(high));
    let mut mesh = mesh::cube();
    mesh.transform(&(DMat4::from_translation((low + high) / 2.0) * DMat4::from_scale((high - low) / 2.0)));
    Geometry::Mesh(mesh)
}

fn ball(center: [f64; 3], radius: f64) -> Geometry {
    Geometry::Sphere { center: center.into(), radius, flipped: false }
}

/// A sphere of `4 rings²` triangles without those at the poles, which have no area.
fn globe(rings: u32, center: [f64; 3], radius: f64) -> Geometry {
    let (around, pi) = (2 * rings, std::f64::consts::PI);
    let mut mesh = Mesh::default();
    for i in 0..=rings {
        for j in 0..around {
            let (theta, phi) = (pi * f64::from(i) / f64::from(rings), 2.0 * pi * f64::from(j) / f64::from(around));
            // The poles are one place each, to the last bit.
            let sine = if i % rings == 0 { 0.0 } else { theta.sin() };
            let direction = DVec3::new(sine * phi.cos(), sine * phi.sin(), theta.cos());
            mesh.positions.push(DVec3::from(center) + direction * radius);
            if i < rings {
                let at = |i: u32, j: u32| i * around + j % around;
                mesh.triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
                mesh.triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }
    mesh.drop_degenerate();
    Geometry::Mesh(mesh)
}

/// Both orders, moved and scaled: the answer is the same.
#[track_caller]
fn two(a: Geometry, b: Geometry) -> usize {
    let moved = |geometry: &Geometry, scale: f64| {
        let shift = DVec3::new(7.0, -3.0, 11.0);
        match geometry.clone() {
            Geometry::Sphere { center, radius, flipped } => {
                Geometry::Sphere { center: (center + shift) * scale, radius: radius * scale, flipped }
            }
            Geometry::Mesh(mut mesh) => {
                mesh.positions.iter_mut().for_each(|p| *p = (*p + shift) * scale);
                Geometry::Mesh(mesh)
            }
        }
    };
    let count = doubts(&filled([a.clone(), b.clone()])).len();
    assert_eq!(doubts(&filled([b.clone(), a.clone()])).len(), count, "the other way round");
    for scale in [1e-30, 1.0, 1e30] {
        let found = doubts(&filled([moved(&a, scale), moved(&b, scale)]));
        assert_eq!(found.len(), count, "moved and scaled by {scale}: {found:#?}");
    }
    count
}

const UNIT: ([f64; 3], [f64; 3]) = ([-1.0; 3], [1.0; 3]);

#[test]
fn nested_separate_and_touching_boxes_do_not_cross() {
    let unit = || block(UNIT.0, UNIT.1);
    for (what, low, high) in [
        ("nested", [-0.5; 3], [0.5; 3]),
        ("apart", [3.0; 3], [4.0; 3]),
        ("side by side", [1.0, -1.0, -1.0], [2.0, 1.0, 1.0]),
        ("side by side, shifted", [1.0, -0.3, 0.2], [2.0, 1.6, 0.9]),
        ("edge on edge", [1.0, 1.0, -1.0], [2.0, 2.0, 1.0]),
        ("edge across edge", [1.0, 1.0, -3.0], [2.0, 2.0, 3.0]),
        ("corner on corner", [1.0; 3], [2.0; 3]),
        ("on the floor of the other", [-0.5, -1.0, -0.5], [0.5, 0.5, 0.5]),
        ("in a corner of the other", [-1.0; 3], [0.3; 3]),
        ("half of the other", [-1.0; 3], [1.0, 0.25, 1.0]),
        ("the same", [-1.0; 3], [1.0; 3]),
        ("the other on its floor", [-2.0, -1.0, -2.0], [2.0, 3.0, 2.0]),
        ("rounded to single precision", [0.999_999_94, -1.0, -1.0], [2.0, 1.0, 1.0]),
    ] {
        assert_eq!(two(unit(), block(low, high)), 0, "{what}");
    }
}

#[test]
fn boxes_that_overlap_cross() {
    let unit = || block(UNIT.0, UNIT.1);
    for (what, low, high) in [
        ("at a corner", [0.3, 0.2, 0.1], [2.3, 2.2, 2.1]),
        ("through two walls", [-0.5, -2.0, -0.3], [0.4, 2.0, 0.2]),
        ("a little", [0.999, -0.3, -0.2], [2.0, 0.4, 0.5]),
        ("shifted along x", [-0.5, -1.0, -1.0], [1.5, 1.0, 1.0]),
        ("shifted along x and y", [-0.5, -0.5, -1.0], [1.5, 1.5, 1.0]),
        ("through, with common walls", [-2.0, -1.0, -1.0], [2.0, 0.5, 1.0]),
        ("about the diagonals", [0.0; 3], [2.0; 3]),
    ] {
        assert_eq!(two(unit(), block(low, high)), 1, "{what}");
    }
    let text = doubts(&filled([unit(), block([0.5, -0.5, -0.5], [1.5, 0.5, 0.5])])).remove(0);
    assert!(text.starts_with("the boundaries \"shape 0\" and \"shape 1\" cross each other, near [1, "), "{text}");
}

#[test]
fn spheres() {
    for (what, center, radius, crossing) in [
        ("apart", [3.0, 0.0, 0.0], 1.0, 0),
        ("side by side", [2.0, 0.0, 0.0], 1.0, 0),
        ("nested", [0.2, 0.0, 0.0], 0.5, 0),
        ("touching from inside", [0.5, 0.0, 0.0], 0.5, 0),
        ("the same", [0.0; 3], 1.0, 0),
        ("overlapping", [1.5, 0.0, 0.0], 1.0, 1),
        ("overlapping a little", [0.51, 0.0, 0.0], 0.5, 1),
    ] {
        assert_eq!(two(ball([0.0; 3], 1.0), ball(center, radius)), crossing, "two spheres {what}");
        let mesh = globe(20, center, radius);
        if what != "side by side" && what != "touching from inside" {
            assert_eq!(two(ball([0.0; 3], 1.0), mesh), crossing, "a sphere and a mesh {what}");
        }
    }
    assert_eq!(two(ball([0.0; 3], 1.0), block(UNIT.0, UNIT.1)), 0, "a sphere that touches all walls");
    assert_eq!(two(ball([0.0; 3], 1.01), block(UNIT.0, UNIT.1)), 1, "a sphere that goes through all walls");
    assert_eq!(two(ball([0.0; 3], 1.74), block(UNIT.0, UNIT.1)), 0, "a sphere around a box");
}

#[test]
fn a_mesh_that_crosses_itself() {
    let merged = |shift: f64| {
        let (Geometry::Mesh(mut a), Geometry::Mesh(b)) =
            (block(UNIT.0, UNIT.1), block([shift, -0.6, -0.7], [shift + 2.0, 0.5, 0.4]))
        else {
            unreachable!()
        };
        let first = a.positions.len() as u32;
        a.positions.extend(b.positions);
        a.uvs.clear();
        a.triangles.extend(b.triangles.iter().map(|triangle| triangle.map(|corner| corner + first)));
        filled([Geometry::Mesh(a)])
    };
    let found = doubts(&merged(0.2));
    assert!(
        found.len() == 1 && found[0].contains("\"shape 0\" is the boundary of a medium but crosses itself"),
        "{found:?}"
    );
    assert_eq!(doubts(&merged(1.0)), [""; 0], "touching");
    assert_eq!(doubts(&merged(2.0)), [""; 0], "apart");
    // What is no boundary may do as it likes.
    let mut walls = merged(0.2);
    walls.shapes[0].boundary = None;
    assert_eq!(doubts(&walls), [""; 0]);
}

#[test]
fn many_triangles_take_no_time() {
    // 20,000 triangles each: apart by a hundredth, and crossing along a circle.
    let large = || globe(72, [0.0; 3], 1.0);
    let start = std::time::Instant::now();
    assert_eq!(doubts(&filled([large(), globe(72, [0.0; 3], 0.99)])), [""; 0]);
    assert_eq!(doubts(&filled([large(), large()])), [""; 0], "the same surface twice");
    assert_eq!(doubts(&filled([large(), globe(72, [0.4, 0.3, 0.2], 0.99)])).len(), 1);
    let elapsed = start.elapsed();
    // A pair by pair comparison takes minutes.
    assert!(elapsed.as_secs() < 100, "{elapsed:?}");
}

#[test]
fn the_tree_of_boundaries() {
    let mut scene =
        filled([block([-9.0; 3], [9.0; 3]), ball([0.0; 3], 3.0), block(UNIT.0, UNIT.1), ball([20.0; 3], 1.0)]);
    scene.shapes.push(Shape::diffuse("wall", Geometry::Mesh(mesh::rectangle()), DVec3::ONE));
    assert_eq!(parents(&scene), [None, Some(0), Some(1), None, None]);
    assert_eq!(around_camera(&scene), None);
    scene.camera.to_world = look_at(DVec3::new(0.0, 0.0, 2.0), DVec3::ZERO, DVec3::Y);
    assert_eq!(around_camera(&scene), Some(1));
    let mut cube = mesh::cube();
    assert!(is_closed(&cube) && !is_closed(&mesh::rectangle()));
    cube.triangles[5].swap(0, 1);
    assert!(!is_closed(&cube));
}
