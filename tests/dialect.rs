//! Pictures of what public scenes of Mitsuba have. Expected pixels are those of Mitsuba 3.9.1 (`llvm_ad_rgb`), the mean of 16 renders of
//! 16,384 samples: `mi.render(mi.load_file(FILE, **parameters), spp=16384)`.

mod common;

use common::device;
use common::images::{Image, average, by_reference, mean, on_device};
use common::scenes::{from_file, pack};
use glam::{DVec3, Vec3Swizzles};
use std::path::Path;
use tyndall::gpu::Renderer;
use tyndall::pack::Packed;
use tyndall::pack::layout::Surface;
use tyndall::render::Backend;
use tyndall::scene::{Scene, mitsuba};

/// With many samples, and with few: the kernels are made once.
fn twice_on_device(packed: &Packed, many: u32, few: u32) -> (Image, Image) {
    let mut renderer = Renderer::new(device(), packed).expect("the kernels compile");
    let mut image = |spp: u32| mean(&renderer.render(0..spp).expect("it renders"));
    (image(many), image(few))
}

/// The largest difference of a channel, beyond `relative` of what is expected.
fn excess(image: &Image, expected: &[[f64; 3]], relative: f64) -> f64 {
    assert_eq!(image.len(), expected.len());
    let pairs = image.iter().zip(expected).map(|(pixel, expected)| (*pixel, DVec3::from(*expected)));
    pairs.map(|(pixel, expected)| ((pixel - expected).abs() - relative * expected).max_element()).fold(0.0, f64::max)
}

fn brighter(expected: &[[f64; 3]], factor: f64) -> Vec<[f64; 3]> {
    expected.iter().map(|pixel| pixel.map(|value| value * factor)).collect()
}

#[rustfmt::skip]
const BUBBLE: [[f64; 3]; 24] = [
    [0.3000, 0.3000, 0.3000], [0.2957, 0.2895, 0.2835], [0.3155, 0.2805, 0.2447], [0.7815, 0.8133, 0.8411],
    [0.3339, 0.3279, 0.3206], [0.3000, 0.3000, 0.3000], [0.3000, 0.3000, 0.3000], [0.2682, 0.2412, 0.2157],
    [0.2709, 0.2231, 0.1733], [0.3259, 0.2773, 0.1941], [0.3266, 0.2908, 0.2511], [0.3000, 0.3000, 0.3000],
    [0.2904, 0.2906, 0.2909], [0.2383, 0.2150, 0.1933], [0.2140, 0.1795, 0.1362], [0.2236, 0.1972, 0.1191],
    [0.2768, 0.2523, 0.2206], [0.3000, 0.3000, 0.3000], [0.1652, 0.1676, 0.1698], [0.1626, 0.1601, 0.1574],
    [0.1572, 0.1390, 0.1211], [0.1690, 0.1530, 0.1341], [0.2375, 0.2468, 0.2550], [0.2540, 0.2715, 0.2884],
];

#[rustfmt::skip]
const DIM_BUBBLE: [[f64; 3]; 24] = [
    [0.3000, 0.3000, 0.3000], [0.2674, 0.2658, 0.2641], [0.1776, 0.1683, 0.1581], [0.6119, 0.6742, 0.7343],
    [0.2918, 0.2924, 0.2924], [0.3000, 0.3000, 0.3000], [0.3000, 0.3000, 0.3000], [0.1621, 0.1551, 0.1481],
    [0.1141, 0.1022, 0.0886], [0.1316, 0.1199, 0.0959], [0.1805, 0.1712, 0.1600], [0.3000, 0.3000, 0.3000],
    [0.2903, 0.2905, 0.2908], [0.1412, 0.1357, 0.1301], [0.0891, 0.0814, 0.0704], [0.0930, 0.0882, 0.0669],
    [0.1606, 0.1558, 0.1484], [0.3000, 0.3000, 0.3000], [0.1560, 0.1585, 0.1610], [0.1283, 0.1290, 0.1297],
    [0.0676, 0.0638, 0.0600], [0.0756, 0.0734, 0.0703], [0.1999, 0.2129, 0.2257], [0.2477, 0.2659, 0.2840],
];

#[rustfmt::skip]
const TINTED_BUBBLE: [[f64; 3]; 24] = [
    [0.3000, 0.3000, 0.3000], [0.2878, 0.2631, 0.2554], [0.2770, 0.1553, 0.1189], [0.7341, 0.6575, 0.6856], [0.3221, 0.2882, 0.2797],
    [0.3000, 0.3000, 0.3000], [0.3000, 0.3000, 0.3000], [0.2387, 0.1455, 0.1179], [0.2280, 0.0903, 0.0513], [0.2726, 0.1039, 0.0522],
    [0.2860, 0.1577, 0.1189], [0.3000, 0.3000, 0.3000], [0.2903, 0.2905, 0.2908], [0.2114, 0.1275, 0.1026], [0.1801, 0.0733, 0.0428],
    [0.1885, 0.0803, 0.0460], [0.2448, 0.1463, 0.1171], [0.3000, 0.3000, 0.3000], [0.1628, 0.1581, 0.1577], [0.1536, 0.1277, 0.1200],
    [0.1331, 0.0605, 0.0392], [0.1439, 0.0700, 0.0485], [0.2277, 0.2121, 0.2161], [0.2525, 0.2663, 0.2832],
];

#[rustfmt::skip]
const GREEN_BUBBLE: [[f64; 3]; 24] = [
    [0.3000, 0.3000, 0.3000], [0.2557, 0.2802, 0.2543], [0.1208, 0.2367, 0.1137], [0.5410, 0.7599, 0.6792], [0.2742, 0.3142, 0.2780],
    [0.3000, 0.3000, 0.3000], [0.3000, 0.3000, 0.3000], [0.1192, 0.2069, 0.1138], [0.0538, 0.1723, 0.0462], [0.0558, 0.2120, 0.0463],
    [0.1208, 0.2435, 0.1134], [0.3000, 0.3000, 0.3000], [0.2902, 0.2906, 0.2908], [0.1029, 0.1824, 0.0987], [0.0434, 0.1358, 0.0387],
    [0.0464, 0.1470, 0.0427], [0.1150, 0.2121, 0.1125], [0.3000, 0.3000, 0.3000], [0.1527, 0.1635, 0.1568], [0.1161, 0.1455, 0.1174],
    [0.0374, 0.1028, 0.0340], [0.0442, 0.1147, 0.0428], [0.1869, 0.2305, 0.2128], [0.2460, 0.2681, 0.2825],
];

#[rustfmt::skip]
const ATTRIBUTES: [[f64; 3]; 24] = [
    [0.8557, 0.9639, 1.0743], [0.5157, 0.6272, 0.9453], [0.4307, 0.4191, 0.9834], [0.4019, 0.3890, 0.9793], [0.2052, 0.2073, 0.9915],
    [0.3924, 0.4692, 1.0401], [0.4140, 0.6019, 0.7164], [0.4911, 0.4051, 0.7692], [0.2927, 0.2264, 0.8630], [0.3742, 0.1743, 0.8588],
    [0.2148, 0.2093, 0.8859], [0.4496, 0.5898, 0.9628], [0.6400, 0.6985, 0.8960], [0.4580, 0.2974, 0.6531], [0.3074, 0.1776, 0.8525],
    [0.3574, 0.1868, 0.8358], [0.1817, 0.2585, 0.8153], [0.4818, 0.7239, 0.8832], [0.8996, 0.9990, 1.0988], [0.6496, 0.5283, 0.8166],
    [0.4205, 0.3152, 0.8034], [0.4031, 0.3187, 0.7759], [0.2866, 0.5363, 0.6030], [0.5818, 0.8269, 0.8907],
];

#[rustfmt::skip]
const SLIDES: [[f64; 3]; 54] = [
    [0.3654, 0.2375, 0.2445], [0.5259, 0.3420, 0.5215], [0.4311, 0.2827, 0.3227], [0.1684, 0.1397, 0.0506],
    [0.1201, 0.1049, 0.0771], [0.0363, 0.0630, 0.1102], [0.0030, 0.0030, 0.0042], [0.0000, 0.0000, 0.0000],
    [0.0000, 0.0000, 0.0000], [0.3624, 0.2332, 0.2246], [0.5075, 0.3330, 0.5123], [0.4409, 0.2876, 0.3205],
    [0.1744, 0.1278, 0.0825], [0.0636, 0.0869, 0.1103], [0.0288, 0.0822, 0.0831], [0.0000, 0.0000, 0.0000],
    [0.0000, 0.0000, 0.0000], [0.0000, 0.0000, 0.0000], [0.1132, 0.1116, 0.1261], [0.1167, 0.1272, 0.1761],
    [0.1492, 0.1219, 0.1588], [0.1612, 0.1057, 0.1566], [0.1047, 0.1460, 0.1490], [0.0684, 0.1127, 0.1319],
    [0.0804, 0.0803, 0.1284], [0.0936, 0.0936, 0.1414], [0.1044, 0.1044, 0.1417], [0.1269, 0.1266, 0.1631],
    [0.1219, 0.1433, 0.1894], [0.1006, 0.1929, 0.2023], [0.1039, 0.1517, 0.2033], [0.0965, 0.1087, 0.1718],
    [0.0940, 0.0746, 0.1589], [0.0965, 0.0408, 0.0952], [0.1016, 0.0756, 0.1189], [0.1100, 0.1101, 0.1356],
    [0.1220, 0.1252, 0.1665], [0.0971, 0.1542, 0.1858], [0.0637, 0.2858, 0.2296], [0.0739, 0.2847, 0.2328],
    [0.0815, 0.1329, 0.1597], [0.0921, 0.0538, 0.1412], [0.0969, 0.0301, 0.1018], [0.0965, 0.0444, 0.1067],
    [0.1093, 0.1093, 0.1233], [0.1204, 0.1188, 0.1463], [0.0982, 0.1539, 0.1795], [0.0677, 0.2520, 0.2097],
    [0.0794, 0.2604, 0.2043], [0.0939, 0.1495, 0.1558], [0.1046, 0.0965, 0.1488], [0.0954, 0.0527, 0.1016],
    [0.1032, 0.0824, 0.1073], [0.1115, 0.1115, 0.1190],
];

#[test]
fn light_passes_panes_without_an_event() {
    for (parameters, expected) in [
        (&[][..], &BUBBLE),
        (&[("factor", "0.6"), ("depth", "3")][..], &DIM_BUBBLE),
        (&[("factor", "0.9, 0.5, 0.2")][..], &TINTED_BUBBLE),
        (&[("factor", "0.2, 0.9, 0"), ("depth", "3")][..], &GREEN_BUBBLE),
    ] {
        let packed = pack(&from_file("panes.xml", parameters), 5);
        assert!(packed.features.panes);
        assert_eq!(packed.features.tints, parameters.iter().any(|(_, value)| value.contains(',')));
        let (device, few) = twice_on_device(&packed, 16384, 64);
        // Standard errors of Mitsuba's pixels are up to 0.0024, where the lamp is seen as a reflection.
        let far = excess(&device, expected, 0.02);
        assert!(far < 6e-3, "{parameters:?}: {far}");
        // The planted faults: another brightness, and a path of one event less.
        assert!(excess(&device, &brighter(expected, 1.08), 0.02) > 6e-3);
        if packed.features.tints {
            // The colour of another channel.
            let mut wrong = packed.clone();
            wrong.surfaces.iter_mut().for_each(|surface| surface.transmittance = surface.transmittance.yzx());
            assert!(excess(&by_reference(&wrong, 1024), expected, 0.02) > 3e-2, "{parameters:?}");
        } else {
            let mut short = from_file("panes.xml", parameters);
            short.integrator.max_depth = short.integrator.max_depth.map(|depth| depth - 1);
            assert!(excess(&on_device(&pack(&short, 5), 1024), expected, 0.02) > 6e-3, "{parameters:?}");
        }
        let (device, reference) = (few, by_reference(&packed, 64));
        let apart = device.iter().zip(&reference).filter(|(a, b)| (**a - **b).abs().max_element() > 1e-3).count();
        assert!(apart <= 2, "{apart} pixels differ");
    }
}

#[test]
fn pictures_in_front_of_lamps_and_colours_of_meshes() {
    let scene = from_file("slides.xml", &[]);
    let packed = pack(&scene, 5);
    assert!(packed.features.slides);
    let (device, few) = twice_on_device(&packed, 16384, 64);
    // Standard errors of Mitsuba's pixels are up to 0.001.
    let far = excess(&device, &SLIDES, 0.02);
    assert!(far < 3e-3, "{far}");
    assert!(excess(&device, &brighter(&SLIDES, 1.06), 0.02) > 3e-3);
    // The planted faults: no picture in front of a lamp, and a ball whose axes are not turned.
    let lamp = scene.shapes.iter().position(|shape| shape.emission_texture.is_some()).expect("there is one");
    let ball = scene.shapes.iter().position(|shape| shape.axes != glam::DMat3::IDENTITY).expect("there is one");
    let mut bare = scene.clone();
    bare.shapes[lamp].emission_texture = None;
    let mut straight = scene.clone();
    straight.shapes[ball].axes = glam::DMat3::IDENTITY;
    for wrong in [bare, straight] {
        let far = excess(&on_device(&pack(&wrong, 5), 4096), &SLIDES, 0.02);
        assert!(far > 6e-3, "{far}");
    }
    let (device, reference) = (few, by_reference(&packed, 64));
    assert!((average(&device) - average(&reference)).abs().max_element() < 1e-3);
}

#[rustfmt::skip]
const PRINCIPLED: [[f64; 3]; 24] = [
    [0.1865, 0.2092, 0.2477], [0.1776, 0.1957, 0.2326], [0.2140, 0.2177, 0.2228], [0.1712, 0.1692, 0.1853],
    [0.1602, 0.1635, 0.1847], [0.1657, 0.1658, 0.1744], [0.2096, 0.1812, 0.1657], [0.1764, 0.1753, 0.1922],
    [0.1644, 0.1864, 0.2223], [0.1636, 0.2054, 0.2624], [0.1505, 0.1690, 0.1994], [0.1602, 0.1756, 0.1967],
    [0.1751, 0.1769, 0.1915], [0.1503, 0.1526, 0.1727], [0.1315, 0.1624, 0.2120], [0.2632, 0.2434, 0.2348],
    [0.1916, 0.1937, 0.2143], [0.1660, 0.2572, 0.3634], [0.2059, 0.2761, 0.3443], [0.1920, 0.2894, 0.3901],
    [0.2000, 0.3000, 0.3999], [0.1894, 0.2028, 0.2312], [0.1448, 0.1627, 0.2051], [0.1705, 0.2402, 0.3091],
];

#[rustfmt::skip]
const CLEAR: [[f64; 3]; 24] = [
    [0.1755, 0.1896, 0.1713], [0.1606, 0.1763, 0.1573], [0.1637, 0.2019, 0.2107], [0.2228, 0.2886, 0.2747],
    [0.2268, 0.2944, 0.2803], [0.2269, 0.2979, 0.2923], [0.1622, 0.1655, 0.1301], [0.1489, 0.1566, 0.1254],
    [0.1491, 0.1759, 0.1712], [0.2127, 0.2892, 0.3128], [0.2155, 0.2872, 0.2963], [0.2190, 0.2943, 0.3075],
    [0.1560, 0.1705, 0.1486], [0.1406, 0.1500, 0.1209], [0.1399, 0.1652, 0.1594], [0.1946, 0.2021, 0.1845],
    [0.1593, 0.1553, 0.1072], [0.1738, 0.2502, 0.3159], [0.1902, 0.2737, 0.3497], [0.1957, 0.2895, 0.3805],
    [0.2000, 0.3000, 0.3999], [0.1546, 0.1598, 0.1255], [0.1425, 0.1486, 0.1015], [0.1534, 0.2146, 0.2563],
];

#[test]
fn principled_surfaces_look_as_in_mitsuba() {
    for (material, expected) in [("principled", &PRINCIPLED), ("clear", &CLEAR)] {
        let parameters = [("material", material)];
        let packed = pack(&from_file("surfaces.xml", &parameters), 5);
        assert!(packed.features.principled);
        assert_eq!(packed.features.dielectric, material == "clear");
        let (device, few) = twice_on_device(&packed, 8192, 64);
        // Standard errors of Mitsuba's pixels are up to 0.0004.
        let far = excess(&device, expected, 0.005);
        assert!(far < 1.5e-3, "{material}: {far}");
        // The planted faults: another brightness, and surfaces a little rougher or with less of a coat.
        assert!(excess(&device, &brighter(expected, 1.03), 0.005) > 1.5e-3);
        let rough = |surface: &mut Surface| {
            (surface.alpha, surface.alpha_v) = (2.0 * surface.alpha, 2.0 * surface.alpha_v);
        };
        for change in [rough as fn(&mut Surface), |surface| surface.internal_reflectance = 0.0] {
            let mut wrong = packed.clone();
            wrong.surfaces.iter_mut().for_each(change);
            let far = excess(&by_reference(&wrong, 4096), expected, 0.005);
            assert!(far > 3e-3, "{material}: {far}");
        }
        let (device, reference) = (few, by_reference(&packed, 64));
        let apart = device.iter().zip(&reference).filter(|(a, b)| (**a - **b).abs().max_element() > 1e-3).count();
        assert!(apart <= 2, "{material}: {apart} pixels differ");
    }
}

/// What a camera sees through a pane of a colour, which reflects nothing, and a medium that absorbs and glows, before a white sky.
fn through_a_pane(color: &str, medium: &str) -> Scene {
    let text = format!(
        r#"<scene version="3.0.0"><integrator type="volpath"><integer name="max_depth" value="2"/></integrator>
        <sensor type="perspective"><float name="fov" value="0.5"/>
            <transform name="to_world"><lookat origin="0 0 5" target="0 0 0" up="0 1 0"/></transform>
            <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/><rfilter type="box"/></film>
        </sensor>
        <shape type="rectangle"><transform name="to_world"><translate z="3"/></transform>
            <bsdf type="thindielectric"><float name="int_ior" value="1"/><float name="ext_ior" value="1"/>{color}</bsdf></shape>
        <shape type="cube"><bsdf type="null"/>{medium}</shape>
        <emitter type="constant"><rgb name="radiance" value="1"/></emitter></scene>"#
    );
    mitsuba::parse_str(&text, Path::new("scene.xml"), &[]).expect("the scene is valid").scene
}

#[test]
fn panes_take_their_colour_from_what_is_behind() {
    let (sigma_t, emission) = (DVec3::new(0.2, 0.5, 1.0), DVec3::new(0.5, 0.3, 0.9));
    let glow = r#"<rgb name="emission" value="0.5, 0.3, 0.9"/><rgb name="albedo" value="0"/>"#;
    let plain = format!(
        r#"<medium name="interior" type="homogeneous"><rgb name="sigma_t" value="0.2, 0.5, 1"/>{glow}</medium>"#
    );
    let constant = |color: &str| format!(r#"<rgb name="specular_transmittance" value="{color}"/>"#);
    let texture = |color: &str| {
        format!(
            r#"<texture type="checkerboard" name="specular_transmittance"><rgb name="color0" value="{color}"/><rgb name="color1" value="{color}"/></texture>"#
        )
    };
    // What passes a pane must not hang on the number that chooses where on the way the medium glows.
    // Radiance through 2 units of length: what comes from behind, and what is added on the way.
    let left = (-2.0 * sigma_t).exp();
    let behind = left + emission / sigma_t * (DVec3::ONE - left);
    for (text, color, kinds) in [
        ("0.9, 0.5, 0.2", DVec3::new(0.9, 0.5, 0.2), &["constant", "texture"][..]),
        ("0, 0.3, 1", DVec3::new(0.0, 0.3, 1.0), &["constant"]),
        ("0.5, 0.5, 0.5", DVec3::splat(0.5), &["constant"]),
    ] {
        for &kind in kinds {
            let transmittance = if kind == "texture" { texture(text) } else { constant(text) };
            let packed = pack(&through_a_pane(&transmittance, &plain), 3);
            assert_eq!(packed.features.tints, kind == "texture" || text != "0.5, 0.5, 0.5");
            let expected = color * behind;
            for (name, image) in [("device", on_device(&packed, 4096)), ("reference", by_reference(&packed, 1536))] {
                let mean = average(&image);
                let agrees = |factor: f64| (mean - expected * factor).abs().max_element() < 4e-3;
                assert!(agrees(1.0), "{name}, {kind} {text}: {mean}, expected {expected}");
                assert!(!agrees(1.03) && !agrees(0.97), "{name}: the comparison is blind");
            }
        }
    }
}

#[test]
fn numbers_of_a_mesh_stand_beside_images() {
    let scene = from_file("attributes.xml", &[]);
    let packed = pack(&scene, 5);
    assert!(packed.features.attributes && packed.features.textures);
    let (device, few) = twice_on_device(&packed, 8192, 64);
    let far = excess(&device, &ATTRIBUTES, 0.01);
    // Standard errors of Mitsuba's pixels are up to 0.001.
    assert!(far < 5e-3, "{far}");
    assert!(excess(&device, &brighter(&ATTRIBUTES, 1.03), 0.01) > 5e-3);
    // The planted faults: the numbers of other triangles, and an image by other coordinates.
    let mut turned = packed.clone();
    turned.corners.iter_mut().for_each(|corners| corners.number = (corners.number + 1) % 3);
    let mut moved = packed.clone();
    moved.corners.iter_mut().for_each(|corners| corners.v += 0.3);
    for wrong in [turned, moved] {
        let far = excess(&by_reference(&wrong, 1024), &ATTRIBUTES, 0.01);
        assert!(far > 3e-2, "{far}");
    }
    let (device, reference) = (few, by_reference(&packed, 64));
    let apart = device.iter().zip(&reference).filter(|(a, b)| (**a - **b).abs().max_element() > 1e-3).count();
    assert!(apart <= 2, "{apart} pixels differ");
}
