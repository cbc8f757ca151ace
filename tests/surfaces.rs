//! What surfaces are made of: textures, varnish, masks and shading normals, against their definitions and closed forms.

mod common;

use common::images;
use common::random::Random;
use common::scenes::{self, v};
use common::statistics::mean_and_error;
use common::tolerances::comparison;
use common::units::{run, vec4};
use glam::{DVec2, DVec3};
use tyndall::pack::material;
use tyndall::pack::texture::TextureTable;
use tyndall::reference::bindings;
use tyndall::reference::bsdf::eval_bsdf;
use tyndall::reference::texture::eval_texture;
use tyndall::scene::{Bsdf, Camera, Distribution, Film, Filter, Light, Roughness, Scene, Shape, Texture, Wrap};

fn textures() -> Vec<Texture> {
    let mut all = vec![scenes::squares(v(0.1, 0.2, 0.3), v(0.9, 0.5, 0.4), 1.7)];
    for filter in [Filter::Nearest, Filter::Bilinear] {
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            all.extend([scenes::picture(filter, wrap, 1.0), scenes::picture(filter, wrap, 0.37)]);
        }
    }
    all
}

#[test]
fn textures_are_looked_up_as_defined() {
    let (mut table, mut values) = (TextureTable::default(), Vec::new());
    let all = textures();
    for (index, texture) in all.iter().enumerate() {
        assert_eq!(table.add(texture, &mut values).1 as usize, index + 1);
    }
    // A texture that is known is not added.
    assert_eq!(table.add(&all[3], &mut values).1, 4);
    let mut random = Random(91);
    let mut inputs = Vec::new();
    for index in 0..all.len() {
        for k in 0..400 {
            let uv = if k < 8 {
                // Corners and edges of the unit square, exactly.
                [[0.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.5, 0.5], [1.0, 0.25], [-1.0, 2.0], [0.5, 0.0], [2.0, -3.0]][k]
            } else {
                [random.between(-3.0, 3.0), random.between(-3.0, 3.0)]
            };
            inputs.push(vec4(&[uv[0], uv[1], index as f64]));
        }
    }
    let tables = [bytemuck::cast_slice(&table.textures), bytemuck::cast_slice(&values)];
    let outputs: Vec<[f32; 4]> = run("texture", &inputs, &tables, inputs.len(), inputs.len());
    let mut check = comparison("eval_texture");
    let mut edges = 0;
    for (input, output) in inputs.iter().zip(&outputs) {
        let (uv, index) = (DVec2::new(f64::from(input[0]), f64::from(input[1])), input[2] as usize);
        let entry = bindings::Texture::from(&table.textures[index]);
        let reference = |uv: DVec2| eval_texture(&entry, &values, uv);
        // At the edge of a pixel or square rounding decides.
        let near = [DVec2::X, DVec2::Y, DVec2::NEG_X, DVec2::NEG_Y].map(|step| reference(uv + step * 2e-6));
        if near.iter().any(|color| (*color - reference(uv)).length() > 1e-3) {
            edges += 1;
            continue;
        }
        assert!((reference(uv) - all[index].eval(uv)).length() < 1e-5, "{uv}: {:?}", all[index]);
        check.vector(format!("{index} at {uv}"), &output[..3], reference(uv));
    }
    assert!(edges < inputs.len() / 20, "{edges} look-ups are left out");
    check.finish();
}

/// Distribution, roughness, index, nonlinear; cosines of both directions and the azimuth between them; the BSDF times cosine of
/// Mitsuba 3.9.1's `roughplastic` with the body (0.8, 0.5, 0.2).
type Row = (&'static str, f64, f64, bool, [f64; 3], [f64; 3]);
#[allow(clippy::approx_constant, reason = "the azimuth of these rows is 3.14, which is not π")]
const MITSUBA: &[Row] = &[
    ("ggx", 0.1, 1.5, false, [0.95, 0.7, 3.0], [0.168142, 0.108028, 0.0479134]),
    ("ggx", 0.1, 1.5, false, [0.7, 0.5, 0.5], [0.108355, 0.0677653, 0.0271757]),
    ("ggx", 0.1, 1.5, false, [0.4, 0.97, 2.0], [0.204799, 0.128402, 0.0520045]),
    ("ggx", 0.1, 1.5, false, [0.15, 0.2, 3.14], [15.5038, 15.4948, 15.4858]),
    ("ggx", 0.3, 1.5, true, [0.95, 0.7, 3.0], [0.119759, 0.0703083, 0.0342806]),
    ("ggx", 0.3, 1.5, true, [0.7, 0.5, 0.5], [0.0704723, 0.0375456, 0.0135565]),
    ("ggx", 0.3, 1.5, true, [0.4, 0.97, 2.0], [0.139981, 0.0766261, 0.0304679]),
    ("ggx", 0.3, 1.5, true, [0.15, 0.2, 3.14], [1.02192, 1.01272, 1.00602]),
    ("beckmann", 0.1, 1.2, true, [0.95, 0.7, 3.0], [0.163549, 0.0904819, 0.0325636]),
    ("beckmann", 0.1, 1.2, true, [0.7, 0.5, 0.5], [0.113543, 0.062757, 0.0225006]),
    ("beckmann", 0.1, 1.2, true, [0.4, 0.97, 2.0], [0.214732, 0.118686, 0.042553]),
    ("beckmann", 0.1, 1.2, true, [0.15, 0.2, 3.14], [14.0927, 14.0811, 14.0719]),
    ("beckmann", 0.3, 1.5, false, [0.95, 0.7, 3.0], [0.174595, 0.117499, 0.0604034]),
    ("beckmann", 0.3, 1.5, false, [0.7, 0.5, 0.5], [0.102229, 0.0638931, 0.0255573]),
    ("beckmann", 0.3, 1.5, false, [0.4, 0.97, 2.0], [0.19734, 0.124346, 0.0513514]),
    ("beckmann", 0.3, 1.5, false, [0.15, 0.2, 3.14], [1.74651, 1.73581, 1.7251]),
];

#[test]
fn rough_plastic_is_that_of_mitsuba() {
    for &(distribution, alpha, eta, nonlinear, [ci, co, phi], expected) in MITSUBA {
        let distribution = if distribution == "ggx" { Distribution::Ggx } else { Distribution::Beckmann };
        let bsdf = |alpha| Bsdf::RoughPlastic {
            roughness: Roughness { distribution, alpha_u: alpha, alpha_v: alpha },
            diffuse_reflectance: v(0.8, 0.5, 0.2).into(),
            specular_reflectance: DVec3::ONE.into(),
            int_ior: eta,
            ext_ior: 1.0,
            nonlinear,
            two_sided: false,
        };
        let found = |alpha| {
            let mut values = Vec::new();
            let surface = material::pack_chain(&bsdf(alpha), &mut TextureTable::default(), &mut values)[0];
            let towards = |cosine: f64, phi: f64| {
                let sine = (1.0 - cosine * cosine).sqrt();
                v(sine * phi.cos(), sine * phi.sin(), cosine)
            };
            eval_bsdf(&bindings::Surface::from(&surface), &values, towards(ci, 0.0), towards(co, phi)).value
        };
        let expected = DVec3::from_array(expected);
        // Mitsuba has Walter et al.'s (2007) approximation of Beckmann's masking, which is up to 0.35 % off for either direction.
        let tolerance = if distribution == Distribution::Beckmann { 7e-3 } else { 2e-3 };
        let agrees = |found: DVec3| (found - expected).abs().cmple(expected * tolerance).all();
        assert!(agrees(found(alpha)), "{distribution:?} {alpha} {eta} {ci} {co}: {}, {expected}", found(alpha));
        assert!(!agrees(found(alpha * 1.5)), "the comparison is blind to the roughness");
    }
}

fn masked(opacity: f64, nested: Bsdf) -> Bsdf {
    Bsdf::Mask { opacity: DVec3::splat(opacity).into(), nested: Box::new(nested) }
}

fn white() -> Bsdf {
    Bsdf::Diffuse { reflectance: DVec3::ONE.into(), two_sided: true }
}

#[test]
fn shadow_rays_are_dimmed_by_every_mask() {
    // A floor under a point light at a height of 2, with two veils between: each sample is rho/pi I/4 (1 - a)(1 - b).
    let render = |a: f64, b: f64| {
        let mut scene = scenes::one_ray(v(0.0, 0.2, 3.0), DVec3::ZERO, 4);
        let level = |height: f64| scenes::quad(v(-4.0, height, 4.0), DVec3::X * 8.0, DVec3::NEG_Z * 8.0);
        scene.shapes.push(Shape::diffuse("floor", level(0.0), DVec3::splat(0.5)));
        for (height, opacity) in [(0.5, a), (1.0, b)] {
            let mut veil = Shape::diffuse("veil", level(height), DVec3::ONE);
            veil.bsdf = masked(opacity, white());
            scene.shapes.push(veil);
        }
        scene.lights.push(Light::Point { position: v(0.0, 2.0, 0.0), intensity: DVec3::ONE });
        scene.integrator.max_depth = Some(2);
        images::average(&images::on_device(&scenes::pack(&scene, 1), 16)).x
    };
    for (a, b) in [(0.25, 0.5), (0.0, 0.3), (1.0, 0.5)] {
        let expected = 0.5 / std::f64::consts::PI / 4.0 * (1.0 - a) * (1.0 - b);
        let found = render(a, b);
        assert!((found - expected).abs() <= 1e-5 * expected, "{a}, {b}: {found}, expected {expected}");
        assert!(expected == 0.0 || (found - expected * 1.001).abs() > 1e-5 * expected, "the comparison is blind");
    }
}

/// A mean that must be 1 within three standard errors of at most 2e-3, and would be noticed if it were 1 % less.
fn is_one(name: &str, packed: &tyndall::pack::Packed, expected: f64) {
    let batches: Vec<f64> = images::batches_of(packed, 512).iter().map(|batch| batch.x / expected).collect();
    let (mean, error) = mean_and_error(&batches);
    eprintln!("{name}: {mean:.5} ± {error:.1e}");
    assert!(error <= 2.5e-3 && (mean - 1.0).abs() <= 3.0 * error + 1e-5, "{name}: {mean} ± {error}");
    assert!((mean * 0.98 - 1.0).abs() > 3.0 * error + 1e-5, "{name}: the comparison is blind");
}

#[test]
fn masks_keep_what_they_do_not_reflect() {
    // White under a white sky, with a medium that absorbs nothing inside the mask: the picture is 1.
    for (name, opacity) in
        [("half", DVec3::splat(0.5).into()), ("squares", scenes::squares(DVec3::ONE, DVec3::splat(0.2), 4.0))]
    {
        let mut scene = scenes::furnace(scenes::ball(DVec3::ZERO, 1.0), 2.0, 0.3);
        scene.shapes[0].bsdf = Bsdf::Mask { opacity, nested: Box::new(white()) };
        scene.camera = Camera::look_at(v(0.05, 0.1, 4.0), DVec3::ZERO, DVec3::Y, 24.0);
        scene.film = Film::new(16, 16);
        is_one(name, &scenes::pack(&scene, 5), 1.0);
    }
    // A black mask before a sky of 1 lets 1 - opacity through, and a lamp behind one shines on the floor through it just as on
    // the sampled way: both ways of finding it share their weights with the mask in between.
    let floor_under_lamp = |opacity: Option<f64>| {
        let mut scene = scenes::one_ray(v(0.0, 0.3, 3.0), v(0.0, -0.2, 0.0), 16);
        let level = |height: f64, side: f64| {
            scenes::quad(v(-side, height, side), DVec3::X * 2.0 * side, DVec3::NEG_Z * 2.0 * side)
        };
        scene.shapes.push(Shape::diffuse("floor", level(-0.2, 4.0), DVec3::splat(0.5)));
        let lamp = scenes::quad(v(-1.0, 1.0, -1.0), DVec3::X * 2.0, DVec3::Z * 2.0);
        scene.shapes.push(Shape::lamp("lamp", lamp, DVec3::ONE));
        if let Some(opacity) = opacity {
            let mut veil = Shape::diffuse("veil", level(0.9, 4.0), DVec3::ONE);
            veil.bsdf = masked(opacity, Bsdf::Diffuse { reflectance: DVec3::ZERO.into(), two_sided: true });
            scene.shapes.push(veil);
        }
        scene.integrator.max_depth = Some(2);
        scenes::pack(&scene, 6)
    };
    let bare = images::average(&images::on_device(&floor_under_lamp(None), 2048)).x;
    is_one("lamp behind a veil", &floor_under_lamp(Some(0.4)), 0.6 * bare);
}

#[test]
fn shading_normals_reflect_as_a_sphere_and_leak_nothing() {
    // A coarse mesh with the normals of a sphere looks like the sphere, which its flat triangles do not; from inside of a closed one
    // nothing is seen of the sky.
    let render = |geometry| {
        let mut scene = Scene::new(Camera::look_at(v(0.0, 0.0, 4.0), DVec3::ZERO, DVec3::Y, 12.0), Film::new(16, 16));
        scene.shapes.push(Shape::diffuse("ball", geometry, DVec3::splat(0.8)));
        scene.lights.push(Light::Point { position: v(3.0, 3.0, 4.0), intensity: DVec3::splat(30.0) });
        images::on_device(&scenes::pack(&scene, 3), 64)
    };
    let smooth = render(scenes::smooth_ball(2, DVec3::ZERO, 1.0));
    let sphere = render(scenes::ball(DVec3::ZERO, 1.0));
    let flat = render(tyndall::scene::Geometry::Mesh(scenes::icosphere(2)));
    let distance =
        |image: &images::Image| image.iter().zip(&sphere).map(|(a, b)| (a.x / b.x - 1.0).abs()).fold(0.0, f64::max);
    eprintln!("smooth {:.4}, flat {:.4}", distance(&smooth), distance(&flat));
    assert!(distance(&smooth) < 0.06 && distance(&flat) > 0.3);

    let mut scene = Scene::new(Camera::look_at(v(0.0, 0.0, 0.5), DVec3::ZERO, DVec3::Y, 60.0), Film::new(8, 8));
    scene.shapes.push(Shape::diffuse("ball", scenes::smooth_ball(0, DVec3::ZERO, 1.0), DVec3::splat(0.9)));
    scene.lights.push(Light::Constant { radiance: DVec3::ONE });
    scene.lights.push(Light::Point { position: v(0.0, 3.0, 0.0), intensity: DVec3::splat(30.0) });
    scene.integrator.max_depth = Some(20);
    assert_eq!(images::average(&images::on_device(&scenes::pack(&scene, 4), 64)), DVec3::ZERO, "light leaks in");
}

#[test]
fn gradients_of_textures_are_those_of_their_values() {
    use tyndall::reference::texture::texture_gradient;
    let mut random = Random(5);
    for (wrap, turn) in [(Wrap::Repeat, 0.0), (Wrap::Mirror, 0.7), (Wrap::Clamp, -2.0)] {
        let to_uv = glam::DAffine2::from_scale_angle_translation(DVec2::new(1.5, 2.5), turn, DVec2::new(0.3, -0.2));
        let texture = Texture::Bitmap { bitmap: scenes::image(), filter: Filter::Bilinear, wrap, to_uv };
        let (mut table, mut values) = (TextureTable::default(), Vec::new());
        table.add(&texture, &mut values);
        let entry = bindings::Texture::from(&table.textures[0]);
        let value = |uv: DVec2| eval_texture(&entry, &values, uv).x;
        let (mut good, mut flat) = (0, 0);
        for _ in 0..500 {
            let uv = DVec2::new(random.unit(), random.unit()) * 3.0 - 1.0;
            let step = 1e-6;
            let slope = |axis: DVec2| (value(uv + axis * step) - value(uv - axis * step)) / (2.0 * step);
            let (got, expected) = (texture_gradient(&entry, &values, uv), DVec2::new(slope(DVec2::X), slope(DVec2::Y)));
            // Where two cells meet there are two slopes.
            good += u32::from((got - expected).length() < 1e-4 * (1.0 + expected.length()));
            flat += u32::from(got == DVec2::ZERO);
        }
        assert!(good >= 497 && (flat < 100 || wrap == Wrap::Clamp), "{wrap:?}: {good} agree, {flat} are flat");
    }
}
