//! Pictures of Mitsuba's dialect: expected pixels are those of Mitsuba 3.9.1 (`llvm_ad_rgb`) at many samples. Each test names how
//! they were rendered; `mitsuba` stands for `mi.render(mi.load_file(FILE, **parameters), spp=…)`.

mod common;

use common::images::{Image, average, by_reference, mean, on_device, with_variant};
use common::scenes::{from_file, pack};
use glam::DVec3;
use tyndall::gpu::shader::Variant;
use tyndall::pack::{PackError, Packed};
use tyndall::render::{aov, picture};
use tyndall::scene::{Colors, Film, Geometry, Lens, Light, Medium, Phase, ReconstructionFilter, Shape};

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
        let image = on_device(&pack(&from_file("edge.xml", &[("filter", filter), ("border", border)]), 3), 8192);
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
    let mut scene = from_file("edge.xml", &[]);
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
        let packed = pack(&from_file("edge.xml", &[("filter", filter), ("border", border)]), 3);
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
    let packed = pack(&from_file("edge.xml", &[("filter", "box")]), 3);
    assert!(!packed.features.filter && packed.values.is_empty() && packed.params.filter_cells == 0);
    // The same picture by the general way, with a box that is a hair wider.
    let mut scene = from_file("edge.xml", &[("filter", "box")]);
    scene.film.filter = ReconstructionFilter::Box { radius: 0.5000001 };
    let general = pack(&scene, 3);
    assert!(general.features.filter);
    let variant = Variant {
        features: general.features,
        immediates: general.immediates().to_vec(),
        workgroup: common::device().subgroup_size,
        buffer_reference: false,
    };
    let image = mean(&with_variant(&general, 4096, &variant));
    assert_eq!(farthest(&image, &EDGES[0].2, 6e-3), None);
}

/// Expected values with a standard error near 0.001: `mitsuba sensors.xml camera=…`, the mean of 16 renders of 65,536 samples.
const CAMERAS: [(&str, [f64; 24]); 3] = [
    (
        "perspective",
        [
            0.0000, 0.0000, 0.0017, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 1.2777, 1.6064, 0.9132, 0.0000, 0.0000,
            0.2814, 1.9748, 2.0000, 0.8259, 0.0000, 0.6210, 0.6262, 1.8455, 1.7949, 0.0594, 0.0000,
        ],
    ),
    (
        "thinlens",
        [
            1.9987, 2.0000, 2.0000, 0.5841, 0.0000, 0.0000, 1.8886, 2.0000, 2.0000, 1.5375, 0.0007, 0.0009, 1.1151,
            2.0000, 2.0000, 1.9982, 0.4784, 0.2516, 0.2322, 1.9134, 1.8739, 0.7751, 0.2999, 0.7557,
        ],
    ),
    (
        "orthographic",
        [
            1.4744, 2.0000, 1.9935, 0.2717, 0.0000, 0.0000, 0.7492, 2.0000, 2.0000, 0.9869, 0.0000, 0.0000, 0.0877,
            1.8953, 2.0000, 1.6432, 0.5224, 0.0000, 0.0000, 1.2193, 1.9902, 1.2473, 0.9513, 0.0163,
        ],
    ),
];

#[test]
fn cameras_have_the_expected_pixels_of_mitsuba() {
    for (name, expected) in CAMERAS {
        let packed = pack(&from_file("sensors.xml", &[("camera", name)]), 3);
        assert_eq!((packed.features.lens, packed.features.orthographic), (name == "thinlens", name == "orthographic"));
        // Four dimensions make more noise than two.
        let (spp, tolerance) = if packed.features.lens { (32_768, 1e-2) } else { (8192, 6e-3) };
        assert_eq!(farthest(&on_device(&packed, spp), &expected, tolerance), None, "{name}");
        assert_eq!(farthest(&by_reference(&packed, spp), &expected, tolerance), None, "{name}");
        // The planted fault: mirrored pictures.
        let mirrored: Vec<f64> = expected.chunks(6).flat_map(|row| row.iter().rev().copied()).collect();
        assert!(farthest(&on_device(&packed, 1024), &mirrored, 6e-3).is_some(), "{name}");
    }
}

#[test]
fn a_lens_without_width_is_a_pinhole() {
    let scene = from_file("sensors.xml", &[("camera", "thinlens")]);
    let mut narrow = scene.clone();
    narrow.camera.lens = Lens::Thin { aperture_radius: 1e-9, focus_distance: 5.5 };
    let mut pinhole = scene.clone();
    pinhole.camera.lens = Lens::Pinhole;
    let (narrow, pinhole) = (pack(&narrow, 3), pack(&pinhole, 3));
    assert!(narrow.features.lens && !pinhole.features.lens);
    let difference =
        |a: &Image, b: &Image| a.iter().zip(b).map(|(a, b)| (*a - *b).abs().max_element()).fold(0.0, f64::max);
    let plain = on_device(&pinhole, 256);
    assert!(difference(&on_device(&narrow, 256), &plain) < 0.02);
    assert!(difference(&on_device(&pack(&scene, 3), 256), &plain) > 0.2, "a wide lens blurs");
}

#[test]
fn rays_that_would_begin_in_different_media_are_refused() {
    let mut scene = from_file("sensors.xml", &[("camera", "orthographic")]);
    let fog = scene.add_medium(Medium::new("fog", DVec3::ONE, DVec3::ONE, Phase::HenyeyGreenstein { g: 0.0 }));
    let eye = scene.camera.to_world.w_axis.truncate();
    let forward = scene.camera.to_world.z_axis.truncate();
    let start = eye + forward * scene.camera.near_clip;
    let ball = |center: DVec3, radius: f64| Geometry::Sphere { center, radius, flipped: false };
    let with = |geometry: Geometry, lens: Lens| {
        let mut scene = scene.clone();
        scene.shapes.push(Shape::boundary("fog", geometry, fog));
        scene.camera.lens = lens;
        Packed::new(&scene, 1).map(|packed| packed.params.camera_medium)
    };
    let rectangle = scene.camera.lens;
    let lens = Lens::Thin { aperture_radius: 0.4, focus_distance: 5.5 };
    let cube = |center: DVec3, half: f64| {
        common::scenes::cuboid(glam::DMat4::from_translation(center) * glam::DMat4::from_scale(DVec3::splat(half)))
    };
    let refused = Err(PackError::StraddlingCamera("fog".to_owned()));
    assert_eq!(with(ball(start, 0.3), rectangle), refused);
    assert_eq!(with(cube(start, 0.3), rectangle), refused);
    assert_eq!(with(ball(start, 0.1), lens), refused);
    // A pinhole has one place where rays begin, and large or distant shapes do not cut it.
    assert_eq!(with(ball(start, 0.3), Lens::Pinhole), Ok(1));
    for around in [ball(start, 9.0), cube(start, 9.0)] {
        assert_eq!(with(around.clone(), rectangle), Ok(1));
        assert_eq!(with(around, lens), Ok(1));
    }
    for distant in [ball(start + forward * 3.0, 1.0), cube(start - forward * 4.0, 1.0)] {
        assert_eq!(with(distant.clone(), rectangle), Ok(0));
        assert_eq!(with(distant, lens), Ok(0));
    }
}

/// Expected values, `mitsuba channels.xml`, the mean of 4 renders of 16,384 samples.
const CHANNELS: [(&str, [f64; 24]); 11] = [
    (
        "A",
        [
            0.3245, 0.5337, 0.6839, 0.5852, 0.1030, 0.0000, 0.5638, 1.0000, 1.0000, 0.5863, 0.4188, 0.6172, 0.4421,
            1.0000, 1.0000, 0.6724, 0.9044, 1.0000, 0.3190, 0.8461, 0.6362, 0.3332, 0.2361, 0.4139,
        ],
    ),
    (
        "d.T",
        [
            1.4298, 2.4122, 3.3902, 3.5218, 1.1227, 0.0000, 2.4692, 4.4839, 4.5430, 2.9020, 1.6504, 2.3311, 1.9418,
            4.4922, 4.6936, 3.3173, 3.3738, 3.6375, 1.4236, 3.8513, 3.0183, 1.6617, 0.9109, 1.5818,
        ],
    ),
    (
        "p.X",
        [
            -0.393, -0.4229, -0.0763, 0.4110, 0.2308, 0.0000, -0.6941, -0.8404, -0.2721, 0.1323, 0.3998, 0.8160,
            -0.5569, -0.8975, -0.3517, 0.1023, 0.7531, 1.2768, -0.4104, -0.8139, -0.2637, 0.0380, 0.2108, 0.5153,
        ],
    ),
    (
        "p.Y",
        [
            0.2793, 0.4498, 0.7371, 0.7548, 0.2267, 0.0000, 0.2485, 0.3913, 0.3265, 0.1759, 0.0512, 0.0572, -0.0570,
            -0.2003, -0.2869, -0.2549, -0.2442, -0.2958, -0.2221, -0.6313, -0.5085, -0.2831, -0.1524, -0.2789,
        ],
    ),
    (
        "p.Z",
        [
            0.1331, 0.0901, 0.7632, 1.0000, 0.3171, 0.0000, 0.2380, 0.1965, 0.0202, -0.1116, 0.2975, 0.4866, 0.1939,
            0.2295, -0.0856, -0.2532, 0.7375, 0.9600, 0.1449, 0.2256, -0.0314, -0.1182, 0.1770, 0.3437,
        ],
    ),
    (
        "u.U",
        [
            0.0292, 0.1768, 0.3108, 0.2554, 0.0760, 0.0000, 0.0439, 0.3035, 0.5577, 0.4885, 0.1481, 0.1258, 0.0271,
            0.2705, 0.5856, 0.5894, 0.4395, 0.4902, 0.0146, 0.1974, 0.3495, 0.2848, 0.1499, 0.3172,
        ],
    ),
    (
        "u.V",
        [
            0.3019, 0.4917, 0.2729, 0.6110, 0.2945, 0.0000, 0.4061, 0.6957, 0.5811, 0.3716, 0.1499, 0.1655, 0.1926,
            0.3999, 0.3565, 0.2088, 0.2204, 0.1072, 0.0484, 0.1074, 0.0638, 0.0251, 0.0701, 0.0988,
        ],
    ),
    (
        "g.X",
        [
            0.1622, 0.2669, 0.0714, 0.0000, 0.0000, 0.0000, 0.2819, 0.5000, 0.4320, 0.2481, -0.1841, 0.1256, 0.2211,
            0.5000, 0.5000, 0.3362, -0.5536, 0.1280, 0.1595, 0.4230, 0.3181, 0.1666, -0.1210, 0.0310,
        ],
    ),
    (
        "s.Y",
        [
            0.0000, 0.0000, 0.0000, -0.0007, -0.0103, 0.0000, 0.0000, 0.0000, -0.0472, -0.0833, 0.2665, 0.4040, 0.0000,
            0.0000, 0.0000, 0.0000, 0.0452, 0.0070, 0.0000, 0.0000, 0.0000, 0.0000, -0.1359, -0.2579,
        ],
    ),
    (
        "s.Z",
        [
            0.2810, 0.4622, 0.8903, 0.9993, 0.3084, 0.0000, 0.4882, 0.8660, 0.8371, 0.4689, 0.2086, 0.3995, 0.3829,
            0.8660, 0.8660, 0.5823, 0.6262, 0.9333, 0.2762, 0.7327, 0.5509, 0.2886, 0.1376, 0.2969,
        ],
    ),
    (
        "a.G",
        [
            0.1298, 0.2135, 0.0571, 0.0000, 0.0000, 0.0000, 0.2255, 0.4000, 0.3456, 0.1985, 0.2082, 0.3086, 0.1768,
            0.4000, 0.4000, 0.2690, 0.4522, 0.5000, 0.1276, 0.3384, 0.2545, 0.1333, 0.1181, 0.2070,
        ],
    ),
];

#[test]
fn channels_are_those_of_mitsuba() {
    let mut scene = from_file("channels.xml", &[]);
    let packed = pack(&scene, 3);
    let channels = aov::render(&packed, &scene.aovs, true, 4096);
    let names: Vec<&str> = channels.iter().map(|(name, _)| name.as_str()).collect();
    let expected = "d.T p.X p.Y p.Z u.U u.V g.X g.Y g.Z s.X s.Y s.Z a.R a.G a.B A";
    assert_eq!(names.join(" "), expected);
    for (name, expected) in CHANNELS {
        let (_, found) = channels.iter().find(|(known, _)| known == name).unwrap();
        let image: Image = found.iter().map(|value| DVec3::splat(f64::from(*value))).collect();
        // Values up to 5 at edges between them and 0.
        let tolerance = if name == "d.T" { 0.06 } else { 0.02 };
        assert_eq!(farthest(&image, &expected, tolerance), None, "{name}");
        let wrong = expected.map(|value| 0.9 * value + 0.05);
        assert!(farthest(&image, &wrong, tolerance).is_some(), "{name}");
    }
    // Where the sky is seen there is something everywhere.
    scene.integrator.hide_emitters = false;
    let channels = aov::render(&pack(&scene, 3), &[], true, 1);
    assert_eq!(channels, [("A".to_owned(), vec![1.0; 24])]);
}

#[test]
fn pictures_are_written_in_the_colors_of_mitsuba() {
    let mut image = tyndall::image::Image::new(1, 1);
    // Pixel (2, 1) of `mitsuba channels.xml format=…`: rgb, xyz and luminance, of different renders of 16,384 samples.
    for (name, value) in ["R", "G", "B", "sampleCount"].into_iter().zip([0.1778, 0.3315, 0.4566, 16.0]) {
        image.push(name, vec![value]);
    }
    let further = || vec![("A".to_owned(), vec![0.5])];
    let written = |colors| {
        let image = picture::finish(image.clone(), colors, further());
        image.channels.into_iter().map(|channel| (channel.name, channel.samples[0])).collect::<Vec<_>>()
    };
    for (colors, expected) in [
        (Colors::Rgb, &[("R", 0.1778), ("G", 0.3315), ("B", 0.4566), ("A", 0.5), ("sampleCount", 16.0)][..]),
        (Colors::Xyz, &[("X", 0.2735), ("Y", 0.3070), ("Z", 0.4753), ("A", 0.5), ("sampleCount", 16.0)]),
        (Colors::Luminance, &[("Y", 0.3070), ("A", 0.5), ("sampleCount", 16.0)]),
    ] {
        let found = written(colors);
        assert_eq!(found.len(), expected.len());
        for ((name, value), (expected_name, expected)) in found.iter().zip(expected) {
            assert!(name == expected_name && (value - expected).abs() < 2e-3, "{colors:?}: {name} is {value}");
        }
    }
}

/// Expected values, `mitsuba surfaces.xml material=…`, the mean of 4 renders of 16,384 samples.
const SURFACES: [(&str, [f64; 24]); 6] = [
    (
        "blend",
        [
            0.2230, 0.1798, 0.1982, 0.1721, 0.1709, 0.2023, 0.2085, 0.1544, 0.1684, 0.1830, 0.1842, 0.1862, 0.1996,
            0.1694, 0.1392, 0.3288, 0.2248, 0.2698, 0.2803, 0.2889, 0.3000, 0.2226, 0.1645, 0.2219,
        ],
    ),
    (
        "sides",
        [
            0.1303, 0.1135, 0.1506, 0.1915, 0.1850, 0.1906, 0.0949, 0.0852, 0.1168, 0.2097, 0.1833, 0.1907, 0.1043,
            0.0796, 0.1072, 0.1615, 0.0970, 0.2370, 0.2607, 0.2848, 0.3000, 0.1087, 0.0770, 0.1904,
        ],
    ),
    (
        "normals",
        [
            0.1246, 0.1083, 0.1498, 0.0842, 0.0786, 0.0887, 0.0894, 0.0792, 0.1163, 0.1413, 0.1111, 0.1255, 0.1070,
            0.0671, 0.1027, 0.1575, 0.0905, 0.2365, 0.2614, 0.2841, 0.3000, 0.1030, 0.0740, 0.1904,
        ],
    ),
    (
        "bumps",
        [
            0.2222, 0.2139, 0.2195, 0.1883, 0.1844, 0.1877, 0.2202, 0.1842, 0.1830, 0.2067, 0.1865, 0.1874, 0.1997,
            0.1647, 0.1783, 0.2489, 0.2025, 0.2610, 0.2791, 0.2897, 0.3000, 0.1991, 0.1516, 0.2254,
        ],
    ),
    (
        "turns",
        [
            0.2298, 0.2073, 0.2345, 0.1887, 0.1889, 0.2074, 0.2051, 0.1822, 0.1998, 0.2213, 0.1971, 0.1893, 0.2182,
            0.1555, 0.1769, 0.2475, 0.1949, 0.2605, 0.2825, 0.2904, 0.3000, 0.1987, 0.1701, 0.2297,
        ],
    ),
    (
        "several",
        [
            0.2362, 0.2069, 0.2195, 0.2003, 0.1890, 0.1771, 0.2110, 0.1878, 0.1943, 0.2095, 0.1878, 0.2068, 0.2080,
            0.1770, 0.1784, 0.3182, 0.2271, 0.2659, 0.2809, 0.2918, 0.3000, 0.2283, 0.2032, 0.2434,
        ],
    ),
];

#[test]
fn surfaces_have_the_expected_pixels_of_mitsuba() {
    for (name, expected) in SURFACES {
        let packed = pack(&from_file("surfaces.xml", &[("material", name)]), 3);
        assert_eq!(packed.features.blends, ["blend", "sides", "several"].contains(&name));
        assert_eq!(packed.features.reliefs, ["normals", "bumps", "turns", "several"].contains(&name));
        let image = on_device(&packed, 2048);
        assert_eq!(farthest(&image, &expected, 0.016), None, "{name}");
        let (mean, expected_mean) = (average(&image).y, expected.iter().sum::<f64>() / 24.0);
        assert!((mean / expected_mean - 1.0).abs() < 6e-3, "{name}: a mean of {mean} instead of {expected_mean}");
        // The planted fault: the next material.
        let (_, other) = SURFACES[(SURFACES.iter().position(|line| line.0 == name).unwrap() + 1) % SURFACES.len()];
        assert!(farthest(&image, &other, 0.016).is_some(), "{name} is taken for another");
        // Light sampling alone finds the same as with multiple importance sampling: values and densities belong together.
        if ["blend", "bumps"].contains(&name) {
            let mut alone = packed.clone();
            alone.features.mis = false;
            assert_eq!(farthest(&on_device(&alone, 2048), &expected, 0.03), None, "{name}, without MIS");
        }
        // The reference follows the same paths.
        let (device, reference) = (on_device(&packed, 16), by_reference(&packed, 16));
        let apart = device.iter().zip(&reference).filter(|(a, b)| (**a - **b).abs().max_element() > 1e-3).count();
        assert!(apart <= 1, "{name}: {apart} pixels differ");
    }
}
