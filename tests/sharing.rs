//! Pixels that share their paths: the kernels against the reference, and that sharing changes no expectation.

mod common;

use common::scenes::{self, pack, v};
use common::statistics::mean_and_error;
use common::{device, fields, images};
use glam::DVec3;
use tyndall::gpu::shader::Variant;
use tyndall::pack::Packed;
use tyndall::pilot;
use tyndall::scene::{
    Film, Geometry, HeightVolume, Integrator, Light, Medium, Mesh, ReconstructionFilter, Scene, Shape, Volume, Volumes,
};

const SIDE: u32 = 64;

/// The scenes whose paths can be shared, on a film that ends within a tile and within a group.
fn cases(side: u32) -> Vec<(&'static str, Scene)> {
    let mut cases = scenes::all();
    let mut wide = scenes::gray_box();
    wide.film.filter = ReconstructionFilter::Gaussian { stddev: 0.5 };
    let mut eager = scenes::nested_media();
    eager.integrator = Integrator { rr_depth: 1, ..eager.integrator };
    let absorbing = |sigma_t: DVec3| {
        let mut scene = scenes::nested_media();
        for medium in &mut scene.media[1..] {
            *medium = Medium { sigma_t, ..scenes::gray(1.0, 0.0, 0.0) };
        }
        scene
    };
    let gray = |albedo: f64| {
        let mut scene = scenes::gray_box();
        scene.media[0] = scenes::gray(2.0, albedo, 0.6);
        scene
    };
    // A lamp that both ways to light find, seen through a pane of haze: neighbours meet the same vertex from far different directions.
    let mut glare = Scene::new(scenes::camera(4.0), Film::new(side, side));
    let haze = glare.add_medium(scenes::gray(20.0, 1.0, 0.9));
    let pane = glam::DMat4::from_scale(v(1.5, 1.5, 0.05));
    glare.shapes.push(Shape::boundary("pane", scenes::cuboid(pane), haze));
    let behind = scenes::quad(v(-1.0, -1.0, -0.5), DVec3::X * 2.0, DVec3::Y * 2.0);
    glare.shapes.push(Shape::lamp("lamp", behind, v(1.0, 2.0, 3.0)));
    glare.integrator.max_depth = Some(6);
    // A lamp that is small, and near to what is seen.
    let mut lantern = Scene::new(scenes::camera(4.0), Film::new(side, side));
    let fog = lantern.add_medium(scenes::gray(0.2, 0.9, 0.6));
    lantern.camera.medium = Some(fog);
    let floor = scenes::quad(v(-3.0, -1.0, 3.0), DVec3::X * 6.0, DVec3::NEG_Z * 6.0);
    lantern.shapes.push(Shape::diffuse("floor", floor, DVec3::splat(0.5)));
    let small = scenes::quad(v(0.3, 0.2, 0.0), DVec3::X * 0.1, DVec3::Z * 0.1);
    lantern.shapes.push(Shape::lamp("lamp", small, v(90.0, 80.0, 70.0)));
    lantern.lights.push(Light::Constant { radiance: v(0.1, 0.2, 0.3) });
    // Lamps in a coloured fog whose boundaries flights and connections leave: into the clear, and into other fog.
    let mut harbour = Scene::new(scenes::camera(4.0), Film::new(side, side));
    let colored = |sigma_t: DVec3| Medium { sigma_t, ..scenes::gray(1.0, 0.8, 0.4) };
    let [thin, thick] = [v(0.2, 0.4, 0.6), v(3.0, 2.0, 1.0)].map(|sigma_t| harbour.add_medium(colored(sigma_t)));
    let bank = scenes::cuboid(glam::DMat4::from_scale(v(1.3, 0.7, 1.0)));
    harbour.shapes.push(Shape::boundary("bank", bank, thin));
    let core = glam::DMat4::from_translation(v(-0.6, 0.0, 0.2)) * glam::DMat4::from_scale(DVec3::splat(0.3));
    harbour.shapes.push(Shape::boundary("core", scenes::cuboid(core), thick));
    let quay = scenes::quad(v(-3.0, -0.9, 3.0), DVec3::X * 6.0, DVec3::NEG_Z * 6.0);
    harbour.shapes.push(Shape::diffuse("quay", quay, v(0.8, 0.5, 0.3)));
    harbour.lights.push(Light::Point { position: v(0.7, 0.3, 0.2), intensity: v(0.5, 0.4, 0.3) });
    let light = scenes::quad(v(-0.2, 0.5, 0.0), DVec3::X * 0.2, DVec3::Z * 0.2);
    harbour.shapes.push(Shape::lamp("lamp", light, v(20.0, 30.0, 40.0)));
    // Voxels and a density that falls with height, both with an albedo that depends on the place: the light through them is only estimated.
    let smoky = |size: [usize; 3]| {
        let mut smoky = Scene::new(scenes::camera(4.0), Film::new(side, side));
        scenes::walls(&mut smoky);
        smoky.shapes.push(scenes::lamp());
        let place = fields::unit_to(v(-0.8, -0.7, -0.6), v(0.7, 0.6, 0.7));
        let smoke = Medium {
            volumes: Volumes {
                sigma_t: Some(Volume::Grid(fields::field(fields::uneven(size, 1), place))),
                albedo: Some(fields::field(
                    fields::grid([2, 2, 2], 3, |x, y, z, c| (1 + x + y + z + c) as f64 / 6.0),
                    place,
                )),
                emission: None,
            },
            ..scenes::gray(3.0, 0.9, 0.6)
        };
        let smoke = smoky.add_medium(smoke);
        smoky.shapes.push(fields::box_of("smoke", place, smoke));
        let height = HeightVolume { scale_height: 0.3, base: v(0.0, -0.9, 0.0), up: DVec3::Y };
        let mist = Medium {
            volumes: Volumes { sigma_t: Some(Volume::Height(height)), ..Volumes::default() },
            ..scenes::gray(2.0, 0.8, 0.3)
        };
        let mist = smoky.add_medium(mist);
        let bottom = fields::unit_to(v(-0.95, -0.95, -0.9), v(0.95, -0.72, 0.9));
        smoky.shapes.push(fields::box_of("mist", bottom, mist));
        smoky
    };
    // Shading normals, first and second: a floor that leans as far as one can without a gap in what it reflects, and a ball of few facets.
    let mut smooth = Scene::new(scenes::camera(4.0), Film::new(side, side));
    scenes::walls(&mut smooth);
    smooth.shapes.push(scenes::lamp());
    let corners = [(-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)];
    let floor = Mesh {
        positions: corners.map(|(x, z)| v(x, -0.6, z)).to_vec(),
        normals: vec![v(0.8, 0.6, 0.0); 4],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    };
    smooth.shapes.push(Shape::diffuse("floor", Geometry::Mesh(floor), v(0.8, 0.8, 0.8)));
    let ball = scenes::smooth_ball(1, v(0.3, -0.1, 0.0), 0.4);
    smooth.shapes.push(Shape::diffuse("ball", ball, v(0.8, 0.6, 0.5)));
    cases.extend([
        ("smooth", smooth),
        ("glare", glare),
        ("lantern", lantern),
        ("harbour", harbour),
        ("smoky", smoky([5, 4, 6])),
        // So fine that light is tracked.
        ("fine smoke", smoky([5, 900, 6])),
        ("wide filter", wide),
        ("eager roulette", eager),
        ("absorbing", absorbing(v(2.0, 2.0, 2.0))),
        ("colours absorbed", absorbing(v(0.5, 2.0, 4.0))),
        ("black ball", gray(0.0)),
        ("dim ball", gray(0.2)),
    ]);
    for (_, scene) in &mut cases {
        scene.film = Film { filter: scene.film.filter, ..Film::new(side, side) };
    }
    cases.retain(|(_, scene)| pilot::can_share_paths(&pack(scene, 1)));
    assert!(cases.len() >= 12, "{} scenes", cases.len());
    cases
}

fn shared(packed: &Packed, sharers: u32) -> Packed {
    let mut packed = packed.clone();
    packed.features.sharers = sharers;
    packed
}

#[test]
fn device_and_reference_share_alike() {
    for (index, (name, scene)) in cases(21).into_iter().enumerate() {
        let sharers = [8, 4][index % 2];
        let packed = shared(&pack(&scene, 7), sharers);
        let (device, reference) = (images::on_device(&packed, 4), images::by_reference(&packed, 4));
        let share = images::compare(&device, &reference).unwrap_or_else(|why| panic!("{name}: {why}"));
        eprintln!("{name}, {sharers}: {:.2} % of the pixels agree", share * 100.0);
        images::compare(&device, &images::on_device(&pack(&scene, 7), 4)).expect_err("what is not shared differs");
    }
}

#[test]
fn the_two_forms_of_the_kernels_share_alike() {
    let packed = shared(&pack(&cases(21)[0].1, 7), 8);
    let variant = |buffer_reference| Variant {
        features: packed.features,
        immediates: packed.immediates().to_vec(),
        workgroup: device().subgroup_size,
        buffer_reference,
    };
    let [one, two] = [false, true].map(|form| images::mean(&images::with_variant(&packed, 4, &variant(form))));
    images::compare(&one, &two).unwrap();
}

/// Means of the tiles of an image: pixels of a group have common noise, tiles have none.
fn tiles(image: &[DVec3]) -> Vec<DVec3> {
    let mut sums = vec![DVec3::ZERO; (SIDE / 8 * SIDE / 8) as usize];
    for (index, pixel) in (0..).zip(image) {
        sums[(index / SIDE / 8 * (SIDE / 8) + index % SIDE / 8) as usize] += *pixel / 64.0;
    }
    sums
}

/// z-values of the mean relative difference, and its largest standard error.
fn differences(one: &[DVec3], two: &[DVec3]) -> ([f64; 3], f64) {
    let brightness = two.iter().sum::<DVec3>() / two.len() as f64;
    let mut coarsest = 0.0f64;
    let z = std::array::from_fn(|channel| {
        let floor = 0.1 * brightness[channel];
        let relative = |(a, b): (&DVec3, &DVec3)| (a[channel] - b[channel]) / (b[channel] + floor);
        let (mean, error) = mean_and_error(&one.iter().zip(two).map(relative).collect::<Vec<f64>>());
        coarsest = coarsest.max(error);
        mean / error
    });
    (z, coarsest)
}

#[test]
fn sharing_changes_no_expectation() {
    for (index, (name, scene)) in cases(SIDE).into_iter().enumerate() {
        // Those that are made for it, those where distances go by lamps or flights end rarely, and every other one besides.
        let features = pack(&scene, 4).features;
        let made_for_it = matches!(name, "glare" | "smooth" | "wide filter");
        if index % 2 == 1 && !made_for_it && !features.equiangular && !features.absorbing && !features.grids {
            continue;
        }
        let sharers = [4, 8][index / 2 % 2];
        // Two that take more samples to tell right from wrong.
        let samples = if matches!(name, "glare" | "lantern" | "harbour") { 256 } else { 24 };
        let truth = tiles(&images::on_device(&pack(&scene, 4), samples));
        let image = tiles(&images::reconstructed(&shared(&pack(&scene, 5), sharers), SIDE, samples));
        let (z, coarsest) = differences(&image, &truth);
        eprintln!("{name}, {sharers}: z = {z:.2?}, standard errors below {:.2} %", coarsest * 100.0);
        assert!(z.iter().all(|z| z.abs() < 4.0), "{name}: z = {z:?}");
        let brighter: Vec<DVec3> = image.iter().map(|tile| *tile * v(1.05, 1.05, 1.05)).collect();
        let (z, _) = differences(&brighter, &truth);
        assert!(z.iter().any(|z| z.abs() > 4.0), "{name}: 5 % more would be seen, z = {z:?}");
    }
}

#[test]
fn a_pilot_shares_where_it_pays() {
    let mut packed = pack(&cases(SIDE)[0].1, 3);
    pilot::run(&mut packed, true);
    assert!(packed.features.sharers > 0);
    let mut alone = pack(&cases(SIDE)[0].1, 3);
    pilot::run(&mut alone, false);
    assert_eq!(alone.features.sharers, 0);
    // Where paths are short as well, but for those without a second vertex that scatters.
    for (max_depth, shares) in [(3, true), (2, false)] {
        let mut short = cases(SIDE)[0].1.clone();
        short.integrator.max_depth = Some(max_depth);
        let mut packed = pack(&short, 3);
        pilot::run(&mut packed, true);
        assert_eq!(packed.features.sharers > 0, shares, "paths of at most {max_depth} segments");
        assert!(!packed.features.pilot);
    }
    // A floor under a lamp: light that is scattered twice is rare.
    let mut open = Scene::new(scenes::camera(4.0), Film::new(SIDE, SIDE));
    let floor = scenes::quad(v(-3.0, -1.0, 3.0), DVec3::X * 6.0, DVec3::NEG_Z * 6.0);
    open.shapes.extend([Shape::diffuse("floor", floor, DVec3::splat(0.5)), scenes::lamp()]);
    let mut packed = pack(&open, 3);
    pilot::run(&mut packed, true);
    assert_eq!(packed.features.sharers, 0);
}
