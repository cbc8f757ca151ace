//! Images: the device against the reference.

mod common;

use common::scenes::v;
use common::{device, images, scenes};
use glam::DVec3;
use tyndall::gpu::shader::Variant;
use tyndall::scene::{Camera, Film, Light, Scene};

#[test]
fn device_and_reference_follow_the_same_paths() {
    for (name, scene) in scenes::all() {
        let packed = scenes::pack(&scene, 7);
        let (device, reference) = (images::on_device(&packed, 16), images::by_reference(&packed, 16));
        let share = images::compare(&device, &reference).unwrap_or_else(|why| panic!("{name}: {why}"));
        eprintln!("{name}: {:.2} % of the pixels agree", share * 100.0);
    }
}

#[test]
fn samples_that_are_not_numbers_are_counted() {
    use tyndall::render::Backend;
    let mut packed = scenes::pack(&scenes::gray_box(), 9);
    let invalid = |packed: &tyndall::pack::Packed| {
        let mut renderer = tyndall::gpu::Renderer::new(device(), packed).expect("the kernels compile");
        let on_device = renderer.render(0..16).expect("it renders")[0].invalid;
        let mut reference = tyndall::reference::Renderer::new(packed.clone());
        [on_device, reference.render(0..16).expect("it renders")[0].invalid]
    };
    assert_eq!(invalid(&packed), [[0; 3]; 2]);
    for surface in &mut packed.surfaces {
        surface.reflectance = glam::Vec3::NAN;
    }
    for counts in invalid(&packed) {
        assert!(counts[0] > 0, "{counts:?}");
    }
}

#[test]
fn more_features_than_needed_do_not_change_the_image() {
    // With all primitives in the tree the kernel that has everything is one and the same, for all scenes of one depth.
    for (name, scene) in scenes::all() {
        let packed = scenes::pack(&scene, 8).with_immediates(0);
        let variant = |features| Variant {
            features,
            immediates: Vec::new(),
            workgroup: device().subgroup_size,
            buffer_reference: device().buffer_reference,
        };
        let needed = images::mean(&images::with_variant(&packed, 16, &variant(packed.features)));
        let everything = images::mean(&images::with_variant(&packed, 16, &variant(packed.features.everything())));
        let share = images::compare(&needed, &everything).unwrap_or_else(|why| panic!("{name}: {why}"));
        let same = needed.iter().zip(&everything).filter(|(a, b)| a == b).count() as f64 / needed.len() as f64;
        eprintln!("{name}: {:.2} % agree, {:.2} % bit-identical", share * 100.0, same * 100.0);
    }
}

#[test]
fn primitives_in_the_kernel_and_in_the_tree_are_met_alike() {
    let mut scene_without_tree = 0;
    for (name, scene) in scenes::all().into_iter().step_by(6) {
        let packed = scenes::pack(&scene, 8);
        scene_without_tree += usize::from(!packed.features.tree);
        let images = [0, 3].map(|most| images::on_device(&packed.clone().with_immediates(most), 16));
        let kernel = images::on_device(&packed, 16);
        for tree in images {
            let share = images::compare(&kernel, &tree).unwrap_or_else(|why| panic!("{name}: {why}"));
            assert!(share > 0.999, "{name}: {share}");
        }
    }
    assert!(scene_without_tree > 0, "some scene is small enough");
    // One face of a cube in the tree, which is flat.
    let mut scene = scenes::furnace(scenes::cuboid(glam::DMat4::from_rotation_y(0.5)), 1.0, 0.0);
    scene.media[0].albedo = DVec3::splat(0.5);
    let packed = scenes::pack(&scene, 8);
    let [kernel, tree] = [12, 10].map(|most| images::on_device(&packed.clone().with_immediates(most), 64));
    assert!(images::compare(&kernel, &tree).expect("the same paths") > 0.999);
}

#[test]
fn the_comparison_rejects_a_brighter_image_and_the_wrong_sign_of_g() {
    let packed = scenes::pack(&scenes::gray_box(), 7);
    let right = images::on_device(&packed, 16);
    let brighter = right.iter().map(|pixel| *pixel * 1.02).collect();
    images::compare(&right, &brighter).expect_err("an image that is 2 % brighter");
    let mut flipped = packed.clone();
    flipped.media.iter_mut().for_each(|medium| medium.g = -medium.g);
    images::compare(&right, &images::by_reference(&flipped, 16)).expect_err("scattering in the wrong direction");
}

#[test]
fn a_scene_without_surfaces_renders() {
    // Rays of all octants, through a tree in which there is nothing to be found. The first scattering of light of intensity 1
    // from the place of the camera itself would be infinite; the light is a little off.
    for target in [v(1.0, 2.0, 3.0), v(-1.0, 2.0, -3.0), v(1.0, -2.0, -3.0), v(-1.0, -2.0, 3.0)] {
        let mut scene = Scene::new(Camera::look_at(DVec3::ZERO, target, DVec3::Y, 100.0), Film::new(8, 8));
        scene.camera.medium = Some(scene.add_medium(scenes::gray(0.5, 0.5, 0.0)));
        scene.lights.push(Light::Point { position: v(0.0, 4.0, 0.0), intensity: DVec3::ONE });
        scene.integrator.max_depth = Some(2);
        let packed = scenes::pack(&scene, 1);
        let (device, reference) = (images::on_device(&packed, 16), images::by_reference(&packed, 16));
        images::compare(&device, &reference).expect("both render the same");
        assert!(images::average(&device).min_element() > 0.0, "fog scatters light");
    }
}
