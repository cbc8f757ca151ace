//! The checker of scenes: each planted fault is found, and nothing is found in good scenes.

use glam::DVec3;
use tyndall::scene::check::doubts;
use tyndall::scene::*;

use crate::scene;

/// A scene with a boundary.
fn with_mesh(mesh: Mesh) -> Scene {
    let mut scene = empty();
    let fog = scene.add_medium(Medium::new("fog", DVec3::ONE, DVec3::ZERO, Phase::Isotropic));
    scene.shapes.push(Shape::boundary("thing", Geometry::Mesh(mesh), fog));
    scene
}

fn empty() -> Scene {
    Scene::new(Camera::look_at(DVec3::new(0.0, 0.0, 9.0), DVec3::ZERO, DVec3::Y, 40.0), Film::new(4, 4))
}

/// The one doubt about a scene.
fn doubt(scene: &Scene) -> String {
    let found = doubts(scene);
    assert_eq!(found.len(), 1, "{found:#?}");
    found[0].clone()
}

#[test]
fn good_meshes_raise_no_doubt() {
    assert_eq!(doubts(&empty()), [""; 0]);
    assert_eq!(doubts(&with_mesh(mesh::cube())), [""; 0]);
    let mut smooth = mesh::cube();
    smooth.complete_normals();
    assert_eq!(doubts(&with_mesh(smooth)), [""; 0]);
    // A wall may be open, and look to any side.
    let mut wall = empty();
    wall.shapes.push(Shape::diffuse("wall", Geometry::Mesh(mesh::rectangle()), DVec3::ONE));
    assert_eq!(doubts(&wall), [""; 0]);
    // At any scale, and far from the origin.
    for scale in [1e-120, 1.0, 1e100] {
        let mut cube = mesh::cube();
        cube.positions.iter_mut().for_each(|p| *p = *p * scale + DVec3::splat(1e3 * scale));
        assert_eq!(doubts(&with_mesh(cube.clone())), [""; 0], "{scale}");
        cube.flip();
        assert!(doubt(&with_mesh(cube)).contains("point inwards"), "{scale}");
    }
}

#[test]
fn holes() {
    let mut cube = mesh::cube();
    cube.triangles.pop();
    let text = doubt(&with_mesh(cube));
    assert!(text.contains("\"thing\" is the boundary of a medium but is not closed: 3 edges"), "{text}");
    let text = doubt(&with_mesh(mesh::rectangle()));
    assert!(text.contains("not closed: 4 edges"), "{text}");
}

#[test]
fn orientation() {
    let mut cube = mesh::cube();
    cube.triangles[5].swap(0, 1);
    let text = doubt(&with_mesh(cube));
    assert!(text.contains("not oriented alike: at 3 edges"), "{text}");
    let mut inside_out = mesh::cube();
    inside_out.flip();
    let text = doubt(&with_mesh(inside_out));
    assert!(text.contains("\"thing\"") && text.contains("normals point inwards"), "{text}");
    let mut ball = empty();
    let fog = ball.add_medium(Medium::new("fog", DVec3::ONE, DVec3::ZERO, Phase::Isotropic));
    for flipped in [false, true] {
        let geometry = Geometry::Sphere { center: DVec3::ZERO, radius: 1.0, flipped };
        ball.shapes = vec![Shape::boundary("ball", geometry, fog)];
        assert_eq!(doubts(&ball).len(), usize::from(flipped));
    }
}

#[test]
fn triangles() {
    let mut twice = mesh::cube();
    let [a, b, c] = twice.triangles[3];
    twice.triangles.push([b, c, a]);
    let found = doubts(&with_mesh(twice));
    assert!(found[0].contains("1 triangles that lie exactly on another one"), "{found:#?}");
    // Two skins in one place: closed, but one of the two is too much.
    let mut skins = mesh::cube();
    skins.triangles.extend(skins.triangles.clone());
    assert!(doubt(&with_mesh(skins)).contains("12 triangles that lie exactly"));

    let mut flat = mesh::cube();
    flat.triangles.push([0, 0, 1]);
    assert!(doubt(&with_mesh(flat)).contains("1 triangles without area"));
    // Vertices of one place are one corner.
    let mut line = mesh::cube();
    line.positions.push(line.positions[0]);
    line.uvs.clear();
    line.triangles.push([0, 24, 1]);
    assert!(doubt(&with_mesh(line)).contains("1 triangles without area"));

    let mut normals = mesh::cube();
    normals.complete_normals();
    normals.normals[0] = -normals.normals[0];
    assert!(doubt(&with_mesh(normals)).contains("2 triangles with a shading normal on their other side"));
}

#[test]
fn contradictory_exteriors() {
    // A ball of ice in a box of fog in the haze that fills everything.
    let build = |exterior: &str, box_exterior: &str| {
        let reference = |id: &str| {
            if id.is_empty() { String::new() } else { format!(r#"<ref name="exterior" id="{id}"/>"#) }
        };
        let mut scene = scene(&format!(
            r#"<medium type="homogeneous" id="haze"/><medium type="homogeneous" id="fog"/><medium type="homogeneous" id="ice"/>
            <shape type="cube" id="box"><bsdf type="null"/><ref name="interior" id="fog"/>{}</shape>
            <shape type="sphere" id="ball"><float name="radius" value="0.5"/><bsdf type="null"/><ref name="interior" id="ice"/>{}</shape>
            <shape type="sphere" id="far"><point name="center" x="5" y="0" z="0"/><bsdf type="null"/><ref name="interior" id="haze"/></shape>"#,
            reference(box_exterior),
            reference(exterior)
        ));
        scene.camera.to_world = look_at(DVec3::new(0.0, 0.0, 9.0), DVec3::ZERO, DVec3::Y);
        scene
    };
    let haze = |mut scene: Scene| {
        scene.camera.medium = scene.media.iter().position(|m| m.name == "haze").map(|index| MediumId(index as u32));
        scene
    };
    assert_eq!(doubts(&build("", "")), [""; 0]);
    assert_eq!(doubts(&build("fog", "")), [""; 0]);
    assert_eq!(doubts(&haze(build("fog", "haze"))), [""; 0]);
    let text = doubt(&build("haze", ""));
    assert_eq!(
        text,
        "\"ball\" names the medium \"haze\" as its exterior, but lies inside \"box\", which is filled with the medium \"fog\""
    );
    let text = doubt(&build("", "haze"));
    assert_eq!(text, "\"box\" names the medium \"haze\" as its exterior, but lies in vacuum");
    let text = doubt(&haze(build("fog", "fog")));
    assert_eq!(text, "\"box\" names the medium \"fog\" as its exterior, but lies in the medium \"haze\"");
}

#[test]
fn a_million_triangles_take_no_time() {
    // A torus of 1000 × 500 quads.
    let (rings, sides) = (1000, 500);
    let tau = std::f64::consts::TAU;
    let mut torus = Mesh::default();
    for i in 0..rings {
        for j in 0..sides {
            let (around, along) = (tau * f64::from(i) / f64::from(rings), tau * f64::from(j) / f64::from(sides));
            let radius = 2.0 + along.cos();
            torus.positions.push(DVec3::new(radius * around.cos(), radius * around.sin(), along.sin()));
            let at = |i: u32, j: u32| (i % rings) * sides + j % sides;
            torus.triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            torus.triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    let mut scene = with_mesh(torus);
    assert_eq!(doubts(&scene), [""; 0]);
    let Geometry::Mesh(mesh) = &mut scene.shapes[0].geometry else { panic!() };
    mesh.triangles.swap_remove(123_456);
    assert!(doubt(&scene).contains("not closed: 3 edges"));
}
