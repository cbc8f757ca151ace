//! Images: the device against the reference, and both against closed forms.

mod common;

use common::{images, scenes};

#[test]
fn device_and_reference_follow_the_same_paths() {
    for (name, scene) in scenes::all() {
        let packed = scenes::pack(&scene, 7, 16);
        let (device, reference) = (images::on_device(&packed, 16), images::by_reference(&packed, 16));
        let share = images::compare(&device, &reference).unwrap_or_else(|why| panic!("{name}: {why}"));
        eprintln!("{name}: {:.2} % of the pixels agree", share * 100.0);
    }
}
