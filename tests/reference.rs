//! Images: the device against the reference.

mod common;

use common::{device, images, scenes};
use tyndall::gpu::shader::Variant;

#[test]
fn device_and_reference_follow_the_same_paths() {
    for (name, scene) in scenes::all() {
        let packed = scenes::pack(&scene, 7, 16);
        let (device, reference) = (images::on_device(&packed, 16), images::by_reference(&packed, 16));
        let share = images::compare(&device, &reference).unwrap_or_else(|why| panic!("{name}: {why}"));
        eprintln!("{name}: {:.2} % of the pixels agree", share * 100.0);
    }
}

#[test]
fn more_features_than_needed_do_not_change_the_image() {
    for (name, scene) in scenes::all() {
        let packed = scenes::pack(&scene, 8, 16);
        let variant = |features| Variant {
            features,
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
fn the_comparison_rejects_a_brighter_image_and_the_wrong_sign_of_g() {
    let packed = scenes::pack(&scenes::gray_box(), 7, 16);
    let right = images::on_device(&packed, 16);
    let brighter = right.iter().map(|pixel| *pixel * 1.02).collect();
    images::compare(&right, &brighter).expect_err("an image that is 2 % brighter");
    let mut flipped = packed.clone();
    flipped.media.iter_mut().for_each(|medium| medium.g = -medium.g);
    images::compare(&right, &images::by_reference(&flipped, 16)).expect_err("scattering in the wrong direction");
}
