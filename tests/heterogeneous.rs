//! Media whose coefficients depend on the place, in whole images.

mod common;

use common::fields::{self, field, grid, uneven, unit_to};
use common::images;
use common::scenes::{self, v};
use common::statistics::mean_and_error;
use common::vdb_files;
use glam::{DMat4, DVec3};
use tyndall::gpu::Renderer;
use tyndall::gpu::shader::Variant;
use tyndall::scene::{Camera, Film, Light, Medium, Phase, Scene, Volume};

#[test]
fn device_and_reference_follow_the_same_paths() {
    let cases = [
        ("voxels", fields::voxels()),
        ("smoke", fields::smoke()),
        ("fine smoke", fields::fine_smoke()),
        ("smoke in a dark ball", fields::smoke_in_a_dark_ball()),
        ("fog", fields::height_fog()),
    ];
    for (name, scene) in cases {
        let packed = scenes::pack(&scene, 7);
        let (device, reference) = (images::on_device(&packed, 16), images::by_reference(&packed, 16));
        let share = images::compare(&device, &reference).unwrap_or_else(|why| panic!("{name}: {why}"));
        eprintln!("{name}: {:.2} % of the pixels agree", share * 100.0);
        let mut thicker = packed.clone();
        thicker.media.iter_mut().for_each(|medium| medium.sigma_t *= 0.9);
        images::compare(&device, &images::by_reference(&thicker, 16)).expect_err("a tenth less extinction");
    }
}

/// How far the means of two scenes are apart, in units of the error of their difference.
fn apart(one: &Scene, two: &Scene, spp: u32) -> f64 {
    let [a, b] = [(one, 1), (two, 2)].map(|(scene, seed)| images::on_device(&scenes::pack(scene, seed), spp));
    let differences: Vec<f64> = a.iter().zip(&b).map(|(a, b)| (*a - *b).element_sum() / 3.0).collect();
    let batch = |first: usize| differences.iter().skip(first).step_by(images::BATCHES).sum::<f64>();
    let (mean, error) = mean_and_error(&(0..images::BATCHES).map(batch).collect::<Vec<_>>());
    eprintln!("apart by {:.2e} of {:.4}: z = {:.2}", mean / 4.0, images::average(&a).element_sum() / 3.0, mean / error);
    mean / error
}

/// Voxels that are all alike are a homogeneous medium, with or without a box around them, gray or coloured, that glows or not.
#[test]
fn constant_voxels_are_a_homogeneous_medium() {
    let homogeneous = [
        scenes::gray(2.0, 0.8, 0.4),
        Medium {
            emission: v(0.5, 1.0, 0.2),
            ..Medium::new("rgb", v(0.5, 2.0, 4.0), v(0.9, 0.5, 0.8), Phase::Isotropic)
        },
    ];
    for medium in homogeneous {
        let mut scene = scenes::gray_box();
        scene.film = Film::new(16, 16);
        scene.lights.push(Light::Point { position: v(-0.7, 0.5, 0.6), intensity: v(1.0, 1.5, 2.0) });
        let ball = scene.shapes.iter().position(|shape| shape.boundary.is_some()).expect("a medium");
        let place = unit_to(v(-0.6, -0.9, -0.7), v(0.7, 0.3, 0.6));
        scene.media[0] = medium.clone();
        scene.shapes[ball] = fields::box_of("box", place, tyndall::scene::MediumId(0));
        let mut voxels = scene.clone();
        let sigma = medium.sigma_t;
        let density = grid([3, 2, 2], 3, |_, _, _, c| sigma[c] / 4.0);
        let emission = grid([2, 2, 2], 1, |_, _, _, _| 1.0);
        voxels.media[0].sigma_t = DVec3::splat(4.0);
        voxels.media[0].volumes.sigma_t = Some(Volume::Grid(field(density, place)));
        voxels.media[0].volumes.emission = Some(field(emission.clone(), place));
        assert!(apart(&scene, &voxels, 256).abs() < 4.0);
        // Glowing voxels in a homogeneous medium.
        let mut glowing = scene.clone();
        glowing.media[0].volumes.emission = Some(field(emission, place));
        assert!(apart(&scene, &glowing, 256).abs() < 4.0);
        let mut denser = voxels.clone();
        denser.media[0].sigma_t *= 2.0;
        assert!(apart(&scene, &denser, 256).abs() > 4.0, "twice the extinction passes");
    }
}

/// Voxels outside of all shapes end with their box, which needs no boundary.
#[test]
fn voxels_that_fill_all_space_end_with_their_box() {
    let mut bounded = fields::smoke();
    bounded.film = Film::new(16, 16);
    bounded.lights.push(Light::Point { position: v(0.5, 0.4, 1.0), intensity: v(1.0, 1.5, 2.0) });
    let box_of_smoke = bounded.shapes.iter().position(|shape| shape.name == "smoke").expect("the box");
    let mut endless = bounded.clone();
    let smoke = endless.shapes.remove(box_of_smoke).boundary.expect("it is a boundary").interior;
    endless.camera.medium = smoke;
    assert!(apart(&bounded, &endless, 256).abs() < 4.0);
    // The camera's way into the box begins inside of it.
    for scene in [&mut bounded, &mut endless] {
        let inside = Camera::look_at(v(0.1, 0.2, 0.1), v(-0.6, -0.3, 0.0), DVec3::Y, 70.0);
        scene.camera = Camera { medium: scene.camera.medium, ..inside };
    }
    assert!(apart(&bounded, &endless, 256).abs() < 4.0);
    let mut without = bounded.clone();
    without.shapes.remove(box_of_smoke);
    assert!(apart(&bounded, &without, 256).abs() > 4.0, "no smoke at all passes");
}

/// Radiance of what glows and takes nothing away is its emission times the way through it; empty voxels glow as well.
#[test]
fn empty_voxels_glow() {
    for (density, wanted) in [(0.0, 3.0), (2.0, 1.5 * (1.0 - (-4f64).exp()))] {
        let mut scene = scenes::one_ray(v(0.1, 0.2, 4.0), v(0.1, 0.2, 0.0), 16);
        scene.camera.near_clip = 0.01;
        let mut glow = Medium { emission: v(1.5, 3.0, 0.75), ..scenes::gray(1.0, 0.0, 0.0) };
        let place = unit_to(v(-1.0, -1.0, -1.0), v(1.0, 1.0, 1.0));
        let voxels = grid([4, 4, 4], 1, |_, _, _, _| density);
        glow.volumes.sigma_t = Some(Volume::Grid(field(voxels, place)));
        glow.volumes.emission = Some(field(grid([3, 3, 3], 1, |_, _, _, _| 0.5), place));
        let id = scene.add_medium(glow);
        scene.shapes.push(fields::box_of("glow", place, id));
        // With extinction σ = 2 over the way 2: q/σ (1 − exp(−4)), else q times the way; q is 0.75, 1.5 and 0.375.
        let expected = if density > 0.0 { wanted / 4.0 } else { wanted / 2.0 };
        for (channel, factor) in [1.0, 2.0, 0.5].into_iter().enumerate() {
            let batches: Vec<f64> = images::batches(&scene, 3, 256).iter().map(|rgb| rgb[channel]).collect();
            let (mean, error) = mean_and_error(&batches);
            assert!(
                ((mean - expected * factor) / error).abs() < 4.5,
                "{density}: {mean} ± {error}, not {}",
                expected * factor
            );
            assert!((mean * 1.02 - expected * factor).abs() > 4.5 * error, "two per cent are not noticed");
        }
    }
}

/// A medium that absorbs nothing, before a sky of radiance 1, is not seen, whatever its density: all estimators together.
#[test]
fn voxels_that_absorb_nothing_are_not_seen_in_a_white_sky() {
    for (channels, inside) in [(1, false), (3, false), (3, true)] {
        let mut scene = scenes::furnace(scenes::cuboid(DMat4::from_scale(DVec3::splat(0.9))), 3.0, 0.5);
        scene.film = Film::new(16, 16);
        if inside {
            scene.camera = Camera::look_at(v(0.1, 0.2, 0.3), v(1.0, 0.3, -0.5), DVec3::Y, 60.0);
        }
        let place = DMat4::from_rotation_z(0.2) * unit_to(v(-0.7, -0.8, -0.6), v(0.8, 0.7, 0.9));
        scene.media[0].volumes.sigma_t = Some(Volume::Grid(field(uneven([9, 8, 7], channels), place)));
        let batches: Vec<f64> = images::batches(&scene, 5, 256).iter().map(|rgb| rgb.element_sum() / 3.0).collect();
        let (mean, error) = mean_and_error(&batches);
        eprintln!("{channels} channels: {mean:.5} ± {error:.1e}");
        assert!((mean - 1.0).abs() < 4.0 * error + 1e-5 && error < 5e-3, "{channels}: {mean} ± {error}");
        let mut absorbing = scene.clone();
        absorbing.media[0].albedo = DVec3::splat(0.95);
        let batches: Vec<f64> = images::batches(&absorbing, 5, 256).iter().map(|rgb| rgb.element_sum() / 3.0).collect();
        let (mean, error) = mean_and_error(&batches);
        assert!((mean - 1.0).abs() > 4.0 * error + 1e-5, "an albedo of 0.95 passes");
    }
}

/// A table that is larger than a descriptor can bind is read by address, or refused.
#[test]
fn voxels_beyond_the_binding_range() {
    let device = common::device();
    let mut scene = fields::smoke();
    scene.film = Film::new(8, 8);
    let small = scenes::pack(&scene, 3);
    let mut large = small.clone();
    // The same voxels and cells, behind as many numbers as no descriptor reaches.
    let before = device.max_binding as usize / size_of::<f32>();
    if before > 1 << 28 {
        return; // More than a test should ask of a device.
    }
    large.values = vec![f32::NAN; before];
    large.values.extend(&small.values);
    for grid in &mut large.grids {
        grid.first_value += before as u32;
        grid.first_cell += before as u32;
    }
    let features = small.features;
    let variant = |buffer_reference| Variant {
        features,
        immediates: small.immediates().to_vec(),
        workgroup: device.subgroup_size,
        buffer_reference,
    };
    if device.buffer_reference {
        assert_eq!(images::on_device(&large, 16), images::on_device(&small, 16));
    }
    let refused =
        Renderer::with_variant(device, &large, &variant(false)).err().expect("it cannot be bound").to_string();
    assert!(refused.contains("values take") && refused.contains("can bind"), "{refused}");
}

/// Voxels of a `.vdb` and a `.nvdb` that are all ½, turned and moved by the file: a homogeneous medium in that box.
#[test]
fn constant_voxels_of_a_file_are_a_homogeneous_medium() {
    let [file, other] = ["constant.nvdb", "constant.vdb"]
        .map(|name| vdb_files::read(name, &vdb_files::data(name), None).unwrap_or_else(|why| panic!("{name}: {why}")));
    assert!(file.grid == other.grid && file.to_world.abs_diff_eq(other.to_world, 1e-15), "{file:?} {other:?}");
    // 6 x 5 x 4 voxels of a fifth of a unit, the first of which has its centre at (-0.25, -0.75, -0.5); turned by the angle of (4, 3, 5).
    let turned = DMat4::from_translation(v(-0.25, -0.75, -0.5)) * DMat4::from_rotation_z(0.6f64.asin());
    let place = turned * unit_to(v(-0.1, -0.1, -0.1), v(1.1, 0.9, 0.7));
    let mut scene = scenes::gray_box();
    scene.film = Film::new(16, 16);
    scene.lights.push(Light::Point { position: v(-0.7, 0.5, 0.6), intensity: v(1.0, 1.5, 2.0) });
    let ball = scene.shapes.iter().position(|shape| shape.boundary.is_some()).expect("a medium");
    scene.media[0] = scenes::gray(4.0, 0.5, 0.4);
    scene.shapes[ball] = fields::box_of("box", place, tyndall::scene::MediumId(0));
    let mut voxels = scene.clone();
    // The shape is larger than the voxels, which end where the file says.
    let larger = place * unit_to(v(-0.1, -0.1, -0.1), v(1.1, 1.1, 1.1));
    voxels.shapes[ball] = fields::box_of("box", larger, tyndall::scene::MediumId(0));
    voxels.media[0].sigma_t = DVec3::splat(8.0);
    let with = |to_world: DMat4| {
        let mut scene = voxels.clone();
        scene.media[0].volumes.sigma_t = Some(Volume::Grid(field(file.grid.clone(), to_world)));
        scene
    };
    assert!(apart(&scene, &with(file.to_world), 256).abs() < 4.0);
    assert!(apart(&scene, &with(DMat4::IDENTITY), 256).abs() > 4.0, "voxels in the unit cube pass");
    let beyond = file.to_world * unit_to(v(-0.1, -0.1, -0.1), v(1.1, 1.1, 1.1));
    assert!(apart(&scene, &with(beyond), 256).abs() > 4.0, "voxels a tenth larger on all sides pass");
}
