//! Tiny scenes, built in Rust.

use super::fields;
use glam::{DAffine2, DMat3, DMat4, DVec2, DVec3};
use std::sync::Arc;
use tyndall::pack::Packed;
use tyndall::scene::{
    Bitmap, Bsdf, Camera, Distribution, Film, Filter, Geometry, Light, Medium, Mesh, Phase, Roughness, Scene, Shape,
    Texture, Wrap,
};

/// The tables of a scene.
pub fn pack(scene: &Scene, seed: u32) -> Packed {
    Packed::new(scene, seed).expect("the scene can be packed")
}

/// A vector from its components.
pub fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// A parallelogram, counter-clockwise from a corner along the first edge.
pub fn quad(corner: DVec3, edge_1: DVec3, edge_2: DVec3) -> Geometry {
    let positions = vec![corner, corner + edge_1, corner + edge_1 + edge_2, corner + edge_2];
    Geometry::Mesh(Mesh { positions, triangles: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() })
}

/// A sphere with normals outwards.
pub fn ball(center: DVec3, radius: f64) -> Geometry {
    Geometry::Sphere { center, radius, flipped: false }
}

/// A box with normals outwards: the image of the cube from −1 to 1.
pub fn cuboid(to_world: DMat4) -> Geometry {
    let positions = (0..8)
        .map(|k| {
            let sign = |bit: u32| if k >> bit & 1 == 1 { 1.0 } else { -1.0 };
            to_world.transform_point3(v(sign(0), sign(1), sign(2)))
        })
        .collect();
    let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    Geometry::Mesh(Mesh { positions, triangles, ..Mesh::default() })
}

/// An icosahedron whose triangles are split `level` times, on a unit sphere.
pub fn icosphere(level: u32) -> Mesh {
    let phi = (1.0 + 5f64.sqrt()) / 2.0;
    let mut positions: Vec<DVec3> = [(-1.0, phi), (1.0, phi), (-1.0, -phi), (1.0, -phi)]
        .iter()
        .flat_map(|&(a, b)| [v(a, b, 0.0), v(0.0, a, b), v(b, 0.0, a)])
        .map(DVec3::normalize)
        .collect();
    // Faces are the triples of corners at the edge's distance from each other.
    let near = |a: DVec3, b: DVec3| a.distance(b) < 1.06;
    let mut triangles = Vec::new();
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                let [a, b, c] = [positions[i], positions[j], positions[k]];
                if near(a, b) && near(b, c) && near(c, a) {
                    let outwards = (b - a).cross(c - a).dot(a) > 0.0;
                    triangles.push(if outwards { [i, j, k] } else { [i, k, j] }.map(|index| index as u32));
                }
            }
        }
    }
    for _ in 0..level {
        let mut middles = std::collections::HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                positions.push(((positions[a as usize] + positions[b as usize]) / 2.0).normalize());
                positions.len() as u32 - 1
            })
        };
        triangles = triangles
            .iter()
            .flat_map(|&[a, b, c]| {
                let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    Mesh { positions, triangles, ..Mesh::default() }
}

/// Henyey and Greenstein's phase function.
pub fn phase(g: f64) -> Phase {
    if g == 0.0 { Phase::Isotropic } else { Phase::HenyeyGreenstein { g } }
}

/// A medium with the same coefficients in all channels.
pub fn gray(sigma_t: f64, albedo: f64, g: f64) -> Medium {
    Medium::new("gray", DVec3::splat(sigma_t), DVec3::splat(albedo), phase(g))
}

/// The walls of an open box from −1 to 1, seen from +z.
pub fn walls(scene: &mut Scene) {
    let (white, red, green) = (v(0.7, 0.7, 0.65), v(0.6, 0.1, 0.05), v(0.1, 0.5, 0.1));
    let (x, y, z) = (DVec3::X * 2.0, DVec3::Y * 2.0, DVec3::Z * 2.0);
    scene.shapes.push(Shape::diffuse("floor", quad(v(-1.0, -1.0, 1.0), x, -z), white));
    scene.shapes.push(Shape::diffuse("ceiling", quad(v(-1.0, 1.0, -1.0), x, z), white));
    scene.shapes.push(Shape::diffuse("back", quad(v(-1.0, -1.0, -1.0), x, y), white));
    scene.shapes.push(Shape::diffuse("left", quad(v(-1.0, -1.0, 1.0), -z, y), red));
    let mut right = Shape::diffuse("right", quad(v(1.0, -1.0, -1.0), z, y), green);
    right.bsdf = Bsdf::Diffuse { reflectance: green.into(), two_sided: false };
    scene.shapes.push(right);
}

/// A lamp under the ceiling.
pub fn lamp() -> Shape {
    Shape::lamp("lamp", quad(v(-0.3, 0.98, -0.3), DVec3::X * 0.6, DVec3::Z * 0.6), v(12.0, 10.0, 6.0))
}

/// A camera before the origin.
pub fn camera(distance: f64) -> Camera {
    Camera::look_at(v(0.05, 0.1, distance), DVec3::ZERO, DVec3::Y, 42.0)
}

/// A Cornell box with a ball of gray, forward-scattering medium.
pub fn gray_box() -> Scene {
    let mut scene = Scene::new(camera(4.0), Film::new(24, 24));
    walls(&mut scene);
    scene.shapes.push(lamp());
    let haze = scene.add_medium(gray(4.0, 0.85, 0.6));
    scene.shapes.push(Shape::boundary("ball", ball(v(0.1, -0.2, 0.0), 0.6), haze));
    scene
}

/// Chromatic media in each other, a mesh in a box in a box, with the camera inside the outer one; two kinds of light.
pub fn nested_media() -> Scene {
    let mut scene = Scene::new(camera(2.0), Film::new(24, 24));
    let chromatic = |name, sigma_t, albedo, g| Medium::new(name, sigma_t, albedo, phase(g));
    let outer = scene.add_medium(chromatic("outer", v(0.2, 0.4, 0.8), v(0.9, 0.8, 0.5), -0.4));
    let inner = scene.add_medium(chromatic("inner", v(5.0, 1.0, 0.2), v(0.95, 0.3, 0.9), 0.8));
    let core = scene.add_medium(chromatic("core", v(0.0, 3.0, 9.0), v(0.0, 0.99, 0.6), 0.0));
    scene.shapes.push(Shape::boundary("outer", cuboid(DMat4::from_scale(DVec3::splat(3.0))), outer));
    let turned = DMat4::from_rotation_y(0.5) * DMat4::from_rotation_x(0.3) * DMat4::from_scale(DVec3::splat(0.6));
    scene.shapes.push(Shape::boundary("inner", cuboid(turned), inner));
    let mut mesh = icosphere(2);
    mesh.positions.iter_mut().for_each(|p| *p *= 0.4);
    scene.shapes.push(Shape::boundary("core", Geometry::Mesh(mesh), core));
    scene.shapes.push(Shape::lamp("lamp", quad(v(-1.0, 2.0, -1.0), DVec3::X * 2.0, DVec3::Z * 2.0), v(3.0, 4.0, 5.0)));
    scene.lights.push(Light::Constant { radiance: v(0.5, 0.3, 0.2) });
    scene
}

/// A medium that absorbs nothing, before a constant environment.
pub fn furnace(geometry: Geometry, sigma_t: f64, g: f64) -> Scene {
    let mut scene = Scene::new(camera(4.0), Film::new(24, 24));
    let medium = scene.add_medium(gray(sigma_t, 1.0, g));
    scene.shapes.push(Shape::boundary("medium", geometry, medium));
    scene.lights.push(Light::Constant { radiance: DVec3::ONE });
    scene
}

/// A point light in fog that fills everything, over a floor, beside a dense ball.
pub fn point_light() -> Scene {
    let mut scene = Scene::new(camera(4.0), Film::new(24, 24));
    let fog = scene.add_medium(gray(0.15, 0.95, 0.3));
    let dense = scene.add_medium(gray(8.0, 0.9, 0.0));
    scene.camera.medium = Some(fog);
    let floor = quad(v(-3.0, -1.0, 3.0), DVec3::X * 6.0, DVec3::NEG_Z * 6.0);
    scene.shapes.push(Shape::diffuse("floor", floor, DVec3::splat(0.5)));
    scene.shapes.push(Shape::boundary("ball", ball(v(-0.5, -0.3, 0.0), 0.5), dense));
    scene.lights.push(Light::Point { position: v(0.7, 0.6, 0.4), intensity: v(3.0, 2.0, 4.0) });
    scene
}

/// A glowing ball in a box, and a triangle that glows.
pub fn sphere_light() -> Scene {
    let mut scene = Scene::new(camera(4.0), Film::new(24, 24));
    walls(&mut scene);
    scene.shapes.push(Shape::lamp("ball", ball(v(-0.3, 0.3, -0.2), 0.25), v(4.0, 5.0, 6.0)));
    let corners = vec![v(0.2, 0.9, -0.2), v(0.7, 0.9, -0.2), v(0.5, 0.9, 0.4)];
    let triangle = Geometry::Mesh(Mesh { positions: corners, triangles: vec![[0, 1, 2]], ..Mesh::default() });
    scene.shapes.push(Shape::lamp("triangle", triangle, v(9.0, 6.0, 3.0)));
    let haze = scene.add_medium(gray(1.5, 0.7, 0.0));
    scene.shapes.push(Shape::boundary("haze", ball(v(0.3, -0.5, 0.2), 0.4), haze));
    scene
}

/// An environment map: the value of each pixel (x, y).
pub fn sky(width: usize, height: usize, pixel: impl Fn(usize, usize) -> DVec3) -> Arc<Bitmap> {
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let pixels = pixels.map(|(x, y)| pixel(x, y).as_vec3().to_array()).collect();
    Arc::new(Bitmap::new(width, height, pixels).expect("the pixels are finite"))
}

/// A blue sky with a sun, brown below the horizon; not symmetric in any axis.
pub fn sunny() -> Arc<Bitmap> {
    sky(24, 13, |x, y| match (x, y) {
        (5, 3) => v(400.0, 350.0, 250.0),
        (_, 0..6) => v(0.2, 0.3, 0.6) * (1.0 + 0.04 * x as f64),
        _ => v(0.1, 0.08, 0.05),
    })
}

/// A floor, a ball of haze and a metal one.
pub fn still_life(fog: bool) -> Scene {
    let mut scene = Scene::new(camera(4.0), Film::new(24, 24));
    let floor = quad(v(-3.0, -1.0, 3.0), DVec3::X * 6.0, DVec3::NEG_Z * 6.0);
    scene.shapes.push(Shape::diffuse("floor", floor, v(0.5, 0.6, 0.7)));
    let haze = scene.add_medium(gray(5.0, 0.9, 0.5));
    scene.shapes.push(Shape::boundary("haze", ball(v(-0.6, -0.3, 0.0), 0.5), haze));
    let mut metal = Shape::diffuse("metal", ball(v(0.6, -0.4, 0.3), 0.5), DVec3::ZERO);
    metal.bsdf = Bsdf::RoughConductor {
        eta: v(0.2, 0.9, 1.1),
        k: v(3.9, 2.4, 2.1),
        specular_reflectance: DVec3::ONE.into(),
        roughness: Roughness { distribution: Distribution::Ggx, alpha_u: 0.3, alpha_v: 0.3 },
        two_sided: true,
    };
    scene.shapes.push(metal);
    if fog {
        let thin = scene.add_medium(gray(0.1, 0.8, 0.0));
        scene.shapes.push(Shape::boundary("fog", cuboid(DMat4::from_scale(v(3.5, 2.5, 3.5))), thin));
    }
    scene
}

/// A spot and parallel light, through fog that ends somewhere.
pub fn spot_and_directional() -> Scene {
    let mut scene = still_life(true);
    let (position, direction) = (v(1.0, 1.5, 1.0), v(-0.8, -1.0, -0.7).normalize());
    let intensity = v(8.0, 6.0, 5.0);
    scene.lights.push(Light::Spot {
        position,
        direction,
        intensity,
        cutoff_angle: 35.0,
        beam_width: 20.0,
        slide: None,
    });
    scene.lights.push(Light::Directional { direction: v(0.5, -1.0, -0.3).normalize(), irradiance: v(0.5, 0.7, 1.0) });
    scene
}

/// An environment map, turned.
pub fn envmap() -> Scene {
    let mut scene = still_life(false);
    let to_world = DMat3::from_rotation_x(0.4) * DMat3::from_rotation_y(1.0);
    scene.lights.push(Light::Envmap { bitmap: sunny(), scale: 0.8, to_world });
    scene
}

/// Lights of every kind at once, some of them twice.
pub fn all_lights() -> Scene {
    let mut scene = spot_and_directional();
    scene.shapes.push(Shape::lamp("ball", ball(v(-0.3, 0.9, -0.2), 0.1), v(4.0, 5.0, 6.0)));
    scene.shapes.push(lamp());
    scene.lights.push(Light::Envmap { bitmap: sunny(), scale: 0.3, to_world: DMat3::from_rotation_z(1.0) });
    scene.lights.push(Light::Point { position: v(0.7, 0.6, 0.4), intensity: v(0.3, 0.2, 0.4) });
    scene.lights.push(Light::Constant { radiance: v(0.05, 0.1, 0.2) });
    // Mirrored, as a scene file can have it.
    let to_world = DMat3::from_diagonal(v(-1.0, 1.0, 1.0));
    let small = sky(2, 3, |x, y| v(0.1, 0.2, 0.3) * (x + 2 * y) as f64);
    scene.lights.push(Light::Envmap { bitmap: small, scale: 1.0, to_world });
    scene
}

/// Media with phase functions of all kinds, beside and in each other.
pub fn mixed_phases() -> Scene {
    let mut scene = Scene::new(camera(4.0), Film::new(24, 24));
    walls(&mut scene);
    scene.shapes.push(lamp());
    let table = |values: &[f64]| Phase::tabulated(values.to_vec()).expect("a table");
    let blend = |weight, a, b| Phase::Blend { weight, a: Box::new(a), b: Box::new(b) };
    let inner = blend(0.3, Phase::HenyeyGreenstein { g: 0.6 }, table(&[2.0, 0.0, 1.0, 0.2, 0.0, 5.0]));
    let three = blend(0.7, Phase::Rayleigh, inner);
    let medium = |name, phase| Medium::new(name, v(2.0, 3.0, 5.0), v(0.9, 0.95, 0.8), phase);
    let cases =
        [("air", Phase::Rayleigh), ("cloud", table(&[1.0, 0.2, 0.0, 4.0])), ("blend", three), ("plain", phase(0.4))];
    for (k, (name, phase)) in cases.into_iter().enumerate() {
        let id = scene.add_medium(medium(name, phase));
        let center = v(if k % 2 == 0 { -0.4 } else { 0.4 }, if k < 2 { -0.5 } else { 0.3 }, 0.1);
        scene.shapes.push(Shape::boundary(name, ball(center, 0.35), id));
    }
    scene.lights.push(Light::Constant { radiance: v(0.2, 0.3, 0.4) });
    scene
}

/// Media that glow: a gray one that scatters, a chromatic one in it, and one that is nothing but light, over a floor.
pub fn glow() -> Scene {
    let mut scene = Scene::new(camera(4.0), Film::new(24, 24));
    walls(&mut scene);
    let mut add = |name: &str, sigma_t, albedo, emission, center, radius| {
        let medium = Medium { emission, ..Medium::new(name, sigma_t, albedo, phase(0.4)) };
        let id = scene.add_medium(medium);
        scene.shapes.push(Shape::boundary(name, ball(center, radius), id));
    };
    add("fire", v(2.0, 2.0, 2.0), DVec3::splat(0.8), v(3.0, 1.5, 0.4), v(-0.3, -0.3, 0.0), 0.5);
    add("core", v(0.5, 3.0, 9.0), v(0.2, 0.6, 0.9), v(1.0, 4.0, 9.0), v(-0.3, -0.3, 0.1), 0.25);
    add("light", DVec3::ZERO, DVec3::ZERO, v(0.5, 0.7, 1.0), v(0.5, 0.3, 0.0), 0.3);
    scene
}

/// A small image of many colours.
pub fn image() -> Arc<Bitmap> {
    let channel = |k: usize, step: usize| 0.1 + 0.8 * ((k * step) % 11) as f32 / 10.0;
    let pixels = (0..20).map(|k| [channel(k, 3), channel(k, 5), channel(k, 7)]).collect();
    Arc::new(Bitmap::new(5, 4, pixels).expect("it is small"))
}

/// The image as a texture, scaled.
pub fn picture(filter: Filter, wrap: Wrap, scale: f64) -> Texture {
    let to_uv = DAffine2::from_scale_angle_translation(DVec2::splat(scale), 0.3, DVec2::new(0.1, -0.2));
    Texture::Bitmap { bitmap: image(), filter, wrap, to_uv }
}

/// Squares, `scale` pairs of them in each direction.
pub fn squares(color0: DVec3, color1: DVec3, scale: f64) -> Texture {
    Texture::Checkerboard { color0, color1, to_uv: DAffine2::from_scale(DVec2::splat(scale)) }
}

/// With the normals of a unit sphere about the origin, and the texture coordinates of Mitsuba's sphere (but for the seam).
pub fn smooth_ball(level: u32, center: DVec3, radius: f64) -> Geometry {
    let mut mesh = icosphere(level);
    mesh.normals = mesh.positions.clone();
    mesh.uvs = mesh
        .normals
        .iter()
        .map(|d| DVec2::new(d.y.atan2(d.x) / std::f64::consts::TAU, d.z.acos() / std::f64::consts::PI))
        .collect();
    mesh.positions.iter_mut().for_each(|position| *position = center + *position * radius);
    Geometry::Mesh(mesh)
}

/// A parallelogram with texture coordinates from 0 to 1.
fn textured_quad(corner: DVec3, edge_1: DVec3, edge_2: DVec3) -> Geometry {
    let Geometry::Mesh(mut mesh) = quad(corner, edge_1, edge_2) else { unreachable!("a quad is a mesh") };
    mesh.uvs = vec![DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y];
    Geometry::Mesh(mesh)
}

fn rough(alpha_u: f64, alpha_v: f64, distribution: Distribution) -> Roughness {
    Roughness { distribution, alpha_u, alpha_v }
}

/// Textures, smooth shading, rough plastic and masks, one of them on the boundary of a medium.
pub fn surfaces() -> Scene {
    let mut scene = Scene::new(camera(4.0), Film::new(24, 24));
    walls(&mut scene);
    scene.shapes.push(lamp());
    let textured = |texture| Bsdf::Diffuse { reflectance: texture, two_sided: true };
    let mut floor =
        Shape::diffuse("tiles", textured_quad(v(-1.0, -0.95, 1.0), DVec3::X * 2.0, DVec3::Z * -2.0), DVec3::ONE);
    floor.bsdf = textured(squares(v(0.8, 0.7, 0.2), v(0.1, 0.2, 0.3), 3.0));
    let mut painting =
        Shape::diffuse("painting", textured_quad(v(-0.8, -0.6, -0.9), DVec3::X, DVec3::Y * 1.2), DVec3::ONE);
    painting.bsdf = textured(picture(Filter::Bilinear, Wrap::Mirror, 2.0));
    let mut veil = Shape::diffuse("veil", textured_quad(v(-0.9, -0.2, 0.7), DVec3::X, DVec3::Y), DVec3::ONE);
    let opacity = squares(DVec3::splat(0.9), DVec3::splat(0.2), 2.0);
    veil.bsdf = Bsdf::Mask { opacity, nested: Box::new(textured(picture(Filter::Nearest, Wrap::Clamp, 1.3))) };
    let mut plastic = Shape::diffuse("plastic", smooth_ball(2, v(0.45, -0.5, 0.3), 0.4), DVec3::ONE);
    plastic.bsdf = Bsdf::RoughPlastic {
        roughness: rough(0.2, 0.2, Distribution::Ggx),
        diffuse_reflectance: squares(v(0.7, 0.3, 0.2), v(0.2, 0.3, 0.7), 4.0),
        specular_reflectance: DVec3::ONE.into(),
        int_ior: 1.5,
        ext_ior: 1.0,
        nonlinear: true,
        two_sided: false,
    };
    let haze = scene.add_medium(gray(3.0, 0.8, 0.3));
    let mut frosted = Shape::boundary("frosted", ball(v(-0.4, -0.5, 0.0), 0.35), haze);
    frosted.bsdf = Bsdf::Mask {
        opacity: squares(DVec3::ZERO, DVec3::splat(0.7), 3.0),
        nested: Box::new(textured(DVec3::splat(0.6).into())),
    };
    let mut ring = Shape::diffuse("ring", ball(v(0.3, 0.4, -0.4), 0.3), DVec3::ONE);
    ring.bsdf = Bsdf::Mask { opacity: DVec3::splat(0.5).into(), nested: Box::new(textured(DVec3::splat(0.9).into())) };
    scene.shapes.extend([floor, painting, veil, plastic, frosted, ring]);
    scene
}

/// Metal and glass whose roughness has a direction, and smooth shading around a medium.
pub fn metals() -> Scene {
    let mut scene = Scene::new(camera(4.0), Film::new(24, 24));
    walls(&mut scene);
    scene.shapes.push(lamp());
    scene.lights.push(Light::Constant { radiance: v(0.1, 0.15, 0.2) });
    let metal = |distribution| Bsdf::RoughConductor {
        roughness: rough(0.08, 0.35, distribution),
        eta: v(0.2, 0.92, 1.1),
        k: v(3.9, 2.45, 2.14),
        specular_reflectance: picture(Filter::Bilinear, Wrap::Repeat, 2.0),
        two_sided: true,
    };
    let mut pan =
        Shape::diffuse("pan", textured_quad(v(-0.9, -0.9, 0.8), DVec3::X * 1.8, v(0.0, 0.2, -1.6)), DVec3::ONE);
    pan.bsdf = metal(Distribution::Ggx);
    let mut pot = Shape::diffuse("pot", ball(v(-0.45, -0.2, -0.2), 0.4), DVec3::ONE);
    pot.bsdf = metal(Distribution::Beckmann);
    let haze = scene.add_medium(gray(2.0, 0.9, 0.4));
    let mut vase = Shape::boundary("vase", smooth_ball(2, v(0.4, -0.3, 0.3), 0.4), haze);
    vase.bsdf = Bsdf::RoughDielectric {
        roughness: rough(0.3, 0.1, Distribution::Ggx),
        int_ior: 1.5,
        ext_ior: 1.0,
        specular_reflectance: DVec3::ONE.into(),
        specular_transmittance: v(0.9, 1.0, 0.8).into(),
    };
    scene.shapes.extend([pan, pot, vase]);
    scene
}

/// All scenes of this file, and those of fields in space, by name.
pub fn all() -> Vec<(&'static str, Scene)> {
    vec![
        ("gray box", gray_box()),
        ("nested media", nested_media()),
        ("furnace", furnace(cuboid(DMat4::IDENTITY), 3.0, 0.5)),
        ("point light", point_light()),
        ("sphere light", sphere_light()),
        ("environment map", envmap()),
        ("all lights", all_lights()),
        ("mixed phases", mixed_phases()),
        ("glow", glow()),
        ("surfaces", surfaces()),
        ("metals", metals()),
        ("voxels", fields::voxels()),
        ("smoke", fields::smoke()),
        ("height fog", fields::height_fog()),
    ]
}

/// A scene of one ray: all pixels look along it, from `origin` towards `target`.
pub fn one_ray(origin: DVec3, target: DVec3, side: u32) -> Scene {
    let up = if (target - origin).normalize().dot(DVec3::Y).abs() < 0.9 { DVec3::Y } else { DVec3::X };
    Scene::new(Camera::look_at(origin, target, up, 1e-5), Film::new(side, side))
}

/// A torus about the y axis: closed, and not convex.
pub fn torus(major: f64, minor: f64) -> Geometry {
    let (around, across) = (24u32, 12u32);
    let angle = |k: u32, of: u32| 2.0 * std::f64::consts::PI * f64::from(k) / f64::from(of);
    let mut mesh = Mesh::default();
    for i in 0..around {
        for j in 0..across {
            let (phi, theta) = (angle(i, around), angle(j, across));
            let distance = major + minor * theta.cos();
            mesh.positions.push(v(distance * phi.cos(), minor * theta.sin(), distance * phi.sin()));
            let corner = |i: u32, j: u32| (i % around) * across + j % across;
            let [a, b, c, d] = [corner(i, j), corner(i, j + 1), corner(i + 1, j + 1), corner(i + 1, j)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    Geometry::Mesh(mesh)
}

/// A ball about the origin, along a ray that passes its centre at a distance, from two diameters away.
pub fn through_ball(medium: Medium, diameter: f64, distance: f64) -> Scene {
    let mut scene = one_ray(v(distance, 0.0, 2.0 * diameter), v(distance, 0.0, 0.0), 16);
    scene.camera.near_clip = 0.0;
    let medium = scene.add_medium(medium);
    scene.shapes.push(Shape::boundary("ball", ball(DVec3::ZERO, diameter / 2.0), medium));
    scene
}

/// A scene of `tests/data/mitsuba` with parameters.
pub fn from_file(name: &str, parameters: &[(&str, &str)]) -> Scene {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/mitsuba").join(name);
    let parameters: Vec<(String, String)> = parameters.iter().map(|&(a, b)| (a.to_owned(), b.to_owned())).collect();
    let loaded = tyndall::scene::mitsuba::load(&path, &parameters).expect("the scene is good");
    assert_eq!(loaded.warnings, [""; 0], "{name}");
    loaded.scene
}
