//! Pictures of Mitsuba's dialect: expected pixels are those of Mitsuba 3.9.1 (`llvm_ad_rgb`) at many samples. Each test names how
//! they were rendered; `mitsuba` stands for `mi.render(mi.load_file(FILE, **parameters), spp=…)`.

mod common;

use common::images::{Image, average, by_reference, mean, on_device, with_variant};
use common::scenes::pack;
use std::path::Path;
use tyndall::gpu::shader::Variant;
use tyndall::scene::{Film, Light, ReconstructionFilter, Scene, mitsuba};

/// A scene of `tests/data/mitsuba` with parameters.
fn load(name: &str, parameters: &[(&str, &str)]) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/mitsuba").join(name);
    let parameters: Vec<(String, String)> = parameters.iter().map(|&(a, b)| (a.to_owned(), b.to_owned())).collect();
    let loaded = mitsuba::load(&path, &parameters).expect("the scene is good");
    assert_eq!(loaded.warnings, [""; 0], "{name}");
    loaded.scene
}

/// The pixel whose green value is farthest from what is expected, if it is farther than a tolerance.
fn farthest(image: &Image, expected: &[f64], tolerance: f64) -> Option<String> {
    assert_eq!(image.len(), expected.len());
    let far = |(pixel, expected): (&glam::DVec3, &f64)| (pixel.y - expected).abs();
    let (index, distance) =
        image.iter().zip(expected).map(far).enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).expect("there are pixels");
    (distance > tolerance).then(|| format!("pixel {index} is {} instead of {}", image[index].y, expected[index]))
}

/// Expected values with a standard error near 0.0008:
/// `mitsuba edge.xml filter=… border=…`, the mean of 16 renders of 65,536 samples.
const EDGES: [(&str, &str, [f64; 20]); 7] = [
    (
        "box",
        "false",
        [
            1.9970, 2.0000, 2.0000, 2.0000, 0.3669, 1.9927, 2.0000, 2.0000, 2.0000, 1.0961, 1.5316, 2.0000, 2.0000,
            2.0000, 1.7667, 0.8060, 1.9992, 1.6033, 0.8753, 0.1786,
        ],
    ),
    (
        "tent",
        "false",
        [
            1.9989, 2.0000, 2.0000, 1.9055, 0.6066, 1.9795, 2.0000, 2.0000, 1.9937, 1.2386, 1.6422, 1.9999, 2.0000,
            1.9793, 1.6700, 1.0136, 1.9720, 1.6970, 1.0179, 0.4389,
        ],
    ),
    (
        "gaussian",
        "false",
        [
            1.9987, 2.0000, 1.9996, 1.8462, 0.7248, 1.9660, 1.9993, 2.0000, 1.9543, 1.2728, 1.6367, 1.9852, 1.9885,
            1.9200, 1.5943, 1.1041, 1.9133, 1.6864, 1.0779, 0.5515,
        ],
    ),
    (
        "mitchell",
        "false",
        [
            2.0002, 2.0000, 2.0051, 1.9064, 0.5991, 1.9867, 2.0011, 2.0001, 2.0083, 1.2342, 1.6268, 2.0138, 2.0129,
            1.9977, 1.6674, 1.0047, 1.9879, 1.6923, 1.0086, 0.4320,
        ],
    ),
    (
        "catmullrom",
        "false",
        [
            2.0011, 1.9999, 2.0087, 1.9694, 0.4737, 2.0061, 2.0001, 1.9998, 2.0533, 1.1970, 1.6237, 2.0323, 2.0288,
            2.0632, 1.7502, 0.9063, 2.0569, 1.7020, 0.9408, 0.3118,
        ],
    ),
    (
        "lanczos",
        "false",
        [
            1.9937, 1.9978, 2.0031, 2.0025, 0.4319, 2.0204, 1.9985, 1.9656, 2.0861, 1.1846, 1.6212, 2.0623, 2.0361,
            2.1339, 1.7829, 0.8629, 2.1144, 1.6879, 0.9166, 0.2760,
        ],
    ),
    (
        "gaussian",
        "true",
        [
            1.7239, 1.9437, 1.9896, 1.8017, 0.5520, 1.7635, 1.9983, 2.0000, 1.9520, 1.0697, 1.3851, 1.9825, 1.9867,
            1.9160, 1.3433, 0.8326, 1.7107, 1.4303, 0.9068, 0.3921,
        ],
    ),
];

#[test]
fn reconstruction_filters_have_the_expected_pixels_of_mitsuba() {
    for (filter, border, expected) in EDGES {
        let image = on_device(&pack(&load("edge.xml", &[("filter", filter), ("border", border)]), 3), 8192);
        // Weights of both signs make noise.
        let tolerance = if ["mitchell", "catmullrom", "lanczos"].contains(&filter) { 1.5e-2 } else { 6e-3 };
        assert_eq!(farthest(&image, &expected, tolerance), None, "{filter}, sample_border {border}");
        // The planted fault: the filter of the next line.
        let (_, _, other) = EDGES[(EDGES.iter().position(|line| line.2 == expected).unwrap() + 1) % EDGES.len()];
        assert!(farthest(&image, &other, tolerance).is_some(), "{filter} is taken for another");
    }
}

#[test]
fn a_constant_picture_stays_constant_up_to_the_borders() {
    let mut scene = load("edge.xml", &[]);
    scene.shapes.clear();
    scene.lights.push(Light::Constant { radiance: glam::DVec3::ONE });
    for filter in [
        ReconstructionFilter::DEFAULT,
        ReconstructionFilter::Mitchell { b: 1.0 / 3.0, c: 1.0 / 3.0 },
        ReconstructionFilter::Lanczos { lobes: 3.0 },
    ] {
        scene.film = Film { filter, ..Film::new(8, 6) };
        for image in [on_device(&pack(&scene, 1), 8192), by_reference(&pack(&scene, 1), 8192)] {
            // Weights of both signs make noise; all others are 1.
            let tolerance = if filter == ReconstructionFilter::DEFAULT { 1e-6 } else { 2e-2 };
            assert_eq!(farthest(&image, &[1.0; 48], tolerance), None, "{filter:?}");
            assert!((average(&image).y - 1.0).abs() < 1e-3, "{filter:?}: {}", average(&image));
            assert!(farthest(&image, &[1.05; 48], tolerance).is_some());
        }
    }
}

#[test]
fn device_and_reference_draw_the_same_places() {
    for (filter, border, _) in EDGES {
        let packed = pack(&load("edge.xml", &[("filter", filter), ("border", border)]), 3);
        assert_eq!(packed.features.filter, filter != "box");
        let (device, reference) = (on_device(&packed, 64), by_reference(&packed, 64));
        // A sample at the very edge of the lamp may fall on either side of it: 2/64 times a weight.
        for (a, b) in device.iter().zip(&reference) {
            assert!((*a - *b).abs().max_element() < 0.15, "{filter}: {a} and {b}");
        }
        assert!((average(&device) - average(&reference)).abs().max_element() < 0.01, "{filter}");
        let apart = device.iter().zip(&reference).filter(|(a, b)| (**a - **b).abs().max_element() > 1e-4).count();
        assert!(apart <= 1, "{filter}: {apart} pixels differ");
    }
}

#[test]
fn a_box_of_one_pixel_costs_nothing_and_is_the_filter_of_the_general_kernel() {
    let packed = pack(&load("edge.xml", &[("filter", "box")]), 3);
    assert!(!packed.features.filter && packed.values.is_empty() && packed.params.filter_cells == 0);
    // The same picture by the general way, with a box that is a hair wider.
    let mut scene = load("edge.xml", &[("filter", "box")]);
    scene.film.filter = ReconstructionFilter::Box { radius: 0.5000001 };
    let general = pack(&scene, 3);
    assert!(general.features.filter);
    let variant =
        Variant { features: general.features, workgroup: common::device().subgroup_size, buffer_reference: false };
    let image = mean(&with_variant(&general, 4096, &variant));
    assert_eq!(farthest(&image, &EDGES[0].2, 6e-3), None);
}
