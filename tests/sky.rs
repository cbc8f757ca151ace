//! Environment maps: what the kernel looks up and draws, against the definition, the reference, and quadrature.

mod common;

use common::comparison::Comparison;
use common::random::Random;
use common::scenes::{self, v};
use common::statistics::chi_squared_tail;
use common::tolerances::comparison;
use common::units::{run, vec4, widen};
use glam::{DVec2, DVec3};
use std::f64::consts::PI;
use std::sync::Arc;
use tyndall::pack::layout::Texture;
use tyndall::pack::sky;
use tyndall::reference;
use tyndall::scene::{Bitmap, Light};

/// A map as tables.
struct Map {
    bitmap: Arc<Bitmap>,
    texture: Texture,
    values: Vec<f32>,
    mean: f64,
}

impl Map {
    /// Under which media scatter, or not. Other numbers come first in the table.
    fn new(bitmap: Arc<Bitmap>, scattering: bool) -> Map {
        let mut values = vec![f32::NAN; 7];
        let packed = sky::pack(&bitmap, 1.0, scattering, &mut values);
        Map { bitmap, texture: packed.texture, values, mean: packed.mean }
    }

    fn widened(&self) -> reference::bindings::Texture {
        (&self.texture).into()
    }

    fn grid(&self) -> [u32; 2] {
        [reference::sky::sky_columns(&self.widened()), reference::sky::sky_rows(&self.widened())]
    }

    /// Runs the unit kernel on numbers to sample by and directions to look up.
    fn ask(&self, numbers: &[[f64; 4]], directions: &[DVec3]) -> Vec<Answer> {
        let inputs: Vec<[f32; 4]> =
            numbers.iter().zip(directions).flat_map(|(u, d)| [vec4(u), vec4(&d.to_array())]).collect();
        let tables = [bytemuck::bytes_of(&self.texture), bytemuck::cast_slice(&self.values)];
        let outputs: Vec<[f32; 4]> = run("sky", &inputs, &tables, numbers.len(), 4 * numbers.len());
        outputs.chunks(4).map(|o| Answer([o[0], o[1], o[2], o[3]])).collect()
    }

    /// Draws from the kernel.
    fn draw(&self, count: usize, random: &mut Random) -> Vec<Answer> {
        let numbers: Vec<[f64; 4]> = (0..count).map(|_| [0; 4].map(|_| random.unit())).collect();
        self.ask(&numbers, &vec![DVec3::Y; count])
    }
}

/// What the kernel answers.
struct Answer([[f32; 4]; 4]);

impl Answer {
    fn direction(&self) -> DVec3 {
        widen(&self.0[0][..3])
    }

    fn pdf(&self) -> f64 {
        f64::from(self.0[0][3])
    }

    fn radiance(&self) -> DVec3 {
        widen(&self.0[1][..3])
    }

    fn radiance_asked(&self) -> DVec3 {
        widen(&self.0[2][..3])
    }

    fn pdf_asked(&self) -> f64 {
        f64::from(self.0[2][3])
    }
}

/// A map of random pixels around 1.
fn gentle(width: usize, height: usize) -> Arc<Bitmap> {
    let mut random = Random(width as u64);
    let pixels: Vec<DVec3> = (0..width * height).map(|_| DVec3::ONE + random.in_cube() * 0.5).collect();
    scenes::sky(width, height, |x, y| pixels[y * width + x])
}

/// Maps that could break a sampler: the smallest, suns anywhere (at the edges and at the poles too), nothing but a sun, black,
/// values whose sum single precision cannot hold, sizes that are no powers of two.
fn maps() -> Vec<(&'static str, Map)> {
    let sun = |width, height, place: (usize, usize), bright: f64, rest: f64| {
        scenes::sky(width, height, move |x, y| DVec3::splat(if (x, y) == place { bright } else { rest }))
    };
    let maps = vec![
        ("smallest", scenes::sky(2, 3, |x, y| v(0.1, 0.2, 0.3) * (x + 2 * y) as f64)),
        ("sunny", scenes::sunny()),
        ("a sun of 1e6", sun(64, 33, (40, 9), 1e6, 1.0)),
        ("a sun and nothing else", sun(50, 21, (0, 10), 1.0, 0.0)),
        ("a sun at the zenith", sun(16, 9, (3, 0), 1e3, 0.1)),
        ("black", sun(8, 5, (0, 0), 0.0, 0.0)),
        ("gentle", gentle(37, 22)),
        ("too much for a sum", gentle(16, 9).map(|pixel| pixel.map(|value| value * 2e37)).into()),
    ];
    // Each for surfaces and for media.
    let pair =
        |(name, bitmap): (_, Arc<Bitmap>)| [(name, Map::new(bitmap.clone(), false)), (name, Map::new(bitmap, true))];
    maps.into_iter().flat_map(pair).collect()
}

#[test]
fn device_and_reference_agree() {
    let mut random = Random(61);
    let names = ["sky direction", "sky coordinates", "sky radiance", "sky pdf"];
    let [mut direction, mut coordinates, mut radiance, mut pdf] = names.map(comparison);
    // Half of the last one is left out.
    let patchy = scenes::sky(16, 9, |x, y| DVec3::splat(if (x / 4 + y / 3) % 2 == 0 { 0.4 } else { 1.6 }));
    let maps = [gentle(37, 22), gentle(2, 3), gentle(256, 128), patchy];
    for map in maps.map(|bitmap| Map::new(bitmap, false)) {
        let last = 1.0 - 1.0 / 16_777_216.0;
        let mut numbers: Vec<[f64; 4]> = (0..4000).map(|_| [0; 4].map(|_| random.unit())).collect();
        numbers.extend((0..16).map(|k| [0, 1, 2, 3].map(|bit| if k >> bit & 1 == 1 { last } else { 0.0 })));
        let mut directions: Vec<DVec3> = numbers.iter().map(|_| random.direction()).collect();
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        directions.splice(..6, axes.into_iter().flat_map(|axis| [axis, -axis]));
        directions[6] = v(1e-20, 1.0, 0.0);
        directions[7] = v(-1e-4, 1.0, 1e-4).normalize().as_vec3().as_dvec3();
        let answers = map.ask(&numbers, &directions);
        for ((u, d), answer) in numbers.iter().zip(&directions).zip(&answers) {
            let case = format!("{u:?}, {d}");
            let found = reference::sky::sample_sky(&map.values, &map.widened(), DVec2::new(u[0], u[1]));
            direction.vector(&case, &answer.0[0][..3], found.direction);
            radiance.vector(&case, &answer.0[1][..3], found.radiance);
            pdf.scalar(&case, answer.0[0][3], found.pdf);
            let uv = reference::sky::sky_uv(*d);
            // Between the left and the right edge, either is right.
            if (uv.x - uv.x.round()).abs() > 1e-6 {
                coordinates.vector(&case, &answer.0[3][..2], uv.extend(0.0));
            }
            radiance.vector(&case, &answer.0[2][..3], reference::sky::sky_radiance(&map.values, &map.widened(), uv));
            // On the border of two cells, either is right.
            let cell = DVec2::new(uv.x, 0.5 - 0.5 * d.y) * DVec2::from(map.grid().map(f64::from));
            if (cell - cell.round()).abs().min_element() > 1e-3 {
                let expected = reference::sky::sky_pdf(&map.values, &map.widened(), uv.x, d.y);
                pdf.scalar(&case, answer.0[2][3], expected);
            }
        }
    }
    [direction, coordinates, radiance, pdf].into_iter().for_each(Comparison::finish);
}

/// Whether radiance is that of the definition, in a direction.
fn check_definition(bitmap: &Bitmap, direction: DVec3, found: DVec3) -> Result<(), String> {
    let expected = bitmap.sky(Light::sky_uv(direction));
    // Single precision moves the place in the image by some 1e-7 of it; neighbouring pixels differ by as much as the largest.
    let slope = f64::from(bitmap.max()) * 5e-7 * f64::from(bitmap.width().max(bitmap.height()));
    let near = (found - expected).abs().cmple(expected * 3e-5 + slope).all();
    if near { Ok(()) } else { Err(format!("{found} from {direction}, expected {expected}")) }
}

#[test]
fn radiance_is_that_of_the_definition() {
    let mut random = Random(62);
    for (name, map) in maps() {
        let directions: Vec<DVec3> = (0..3000).map(|_| random.direction()).collect();
        let numbers: Vec<[f64; 4]> = directions.iter().map(|_| [0; 4].map(|_| random.unit())).collect();
        let answers = map.ask(&numbers, &directions);
        let check = |turn: fn(DVec3) -> DVec3, factor: f64| {
            directions.iter().zip(&answers).try_for_each(|(direction, answer)| {
                check_definition(&map.bitmap, turn(*direction), answer.radiance_asked() * factor)?;
                check_definition(&map.bitmap, turn(answer.direction()), answer.radiance() * factor)
            })
        };
        check(|d| d, 1.0).unwrap_or_else(|why| panic!("{name}: {why}"));
        if name == "sunny" || name == "gentle" {
            check(|d| d, 1.02).expect_err("2 % too bright");
            check(|d| v(-d.x, d.y, d.z), 1.0).expect_err("u the wrong way round");
            check(|d| v(d.x, -d.y, d.z), 1.0).expect_err("upside down");
        }
    }
}

/// Density of each cell, row by row.
fn cell_densities(map: &Map) -> Vec<f64> {
    let [columns, rows] = map.grid();
    let cells = (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
    let density = |(row, column)| {
        let (u, y) =
            ((f64::from(column) + 0.5) / f64::from(columns), 1.0 - (2.0 * f64::from(row) + 1.0) / f64::from(rows));
        reference::sky::sky_pdf(&map.values, &map.widened(), u, y)
    };
    cells.map(density).collect()
}

/// Integral of the density over the sphere: exact, since it is constant in each cell.
fn density_integral(map: &Map) -> f64 {
    let densities = cell_densities(map);
    densities.iter().sum::<f64>() * 4.0 * PI / densities.len() as f64
}

#[test]
fn densities_integrate_to_one() {
    for (name, map) in maps() {
        let integral = density_integral(&map);
        assert!((integral - 1.0).abs() < 1e-6, "{name}: {integral}");
    }
}

/// Whether the densities are those of a share of the radiance: what exceeds `left_out` times its mean. In cells much smaller than pixels
/// the radiance is that in the middle; where it has kinks, some are off.
fn check_share(map: &Map, left_out: f64) -> Result<(), String> {
    let [columns, rows] = map.grid().map(f64::from);
    let above: Vec<f64> = (0..cell_densities(map).len())
        .map(|cell| {
            let (row, column) = ((cell as f64 / columns).floor(), cell as f64 % columns);
            let theta = (1.0 - (2.0 * row + 1.0) / rows).acos();
            let radiance = map.bitmap.sky(DVec2::new((column + 0.5) / columns, theta / PI));
            (radiance.element_sum() / 3.0 - left_out * map.mean).max(0.0)
        })
        .collect();
    let mean = above.iter().sum::<f64>() / above.len() as f64;
    let densities = cell_densities(map);
    let off: f64 = densities.iter().zip(&above).map(|(density, above)| (density * 4.0 * PI - above / mean).abs()).sum();
    let off = off / densities.len() as f64;
    if off < 0.02 { Ok(()) } else { Err(format!("off by {off:.4} on average")) }
}

#[test]
fn light_sampling_has_what_exceeds_a_share_of_the_mean() {
    // A sky over dark ground, which keeps three quarters above the mean; waves of a tenth about their mean, which keep little; one colour.
    let dome = || scenes::sky(16, 9, |_, y| v(1.0, 2.0, 3.0) * if y < 4 { 1.0 } else { 0.1 });
    let waves = || scenes::sky(16, 9, |x, _| DVec3::splat(1.0 + 0.1 * (x as f64 * PI / 4.0).sin()));
    for (name, bitmap, expected) in [("dome", dome(), [1.0, 0.5]), ("waves", waves(), [0.5, 0.5])] {
        for (scattering, expected) in [false, true].into_iter().zip(expected) {
            let map = Map::new(bitmap.clone(), scattering);
            check_share(&map, expected).unwrap_or_else(|why| panic!("{name}, {scattering}: {why}"));
            check_share(&map, 1.5 - expected).expect_err("the other share");
            check_share(&map, 0.0).expect_err("all of the radiance");
        }
    }
    for map in [false, true].map(|scattering| Map::new(scenes::sky(7, 4, |_, _| v(0.3, 0.2, 0.1)), scattering)) {
        assert!(cell_densities(&map).into_iter().all(|density| (density * 4.0 * PI - 1.0).abs() < 1e-2));
    }
}

/// χ² of directions in the cells of the grid (those that expect too few together) and in eight parts of the cells, against a
/// density.
fn check_drawn(map: &Map, answers: &[Answer], pdf: impl Fn(f64, f64) -> f64) -> Result<(), String> {
    let [columns, rows] = map.grid();
    let (parts, total) = (2u32, answers.len() as f64);
    let (across, down) = (columns * parts, rows * parts);
    let mut counts = vec![0.0; (across * down) as usize];
    for answer in answers {
        let (uv, y) = (Light::sky_uv(answer.direction()), answer.direction().y);
        let column = ((uv.x * f64::from(across)) as u32).min(across - 1);
        let row = (((0.5 - 0.5 * y) * f64::from(down)).max(0.0) as u32).min(down - 1);
        counts[(row * across + column) as usize] += 1.0;
    }
    let (mut chi_squared, mut bins, mut rest) = (0.0, -1.0, [0.0; 2]);
    for row in 0..down {
        for column in 0..across {
            let (u, t) = ((f64::from(column) + 0.5) / f64::from(across), (f64::from(row) + 0.5) / f64::from(down));
            let expected = total * pdf(u, 1.0 - 2.0 * t) * 4.0 * PI / f64::from(across * down);
            rest[0] += counts[(row * across + column) as usize];
            rest[1] += expected;
            if rest[1] >= 10.0 {
                chi_squared += (rest[0] - rest[1]).powi(2) / rest[1];
                bins += 1.0;
                rest = [0.0; 2];
            }
        }
    }
    let probability = chi_squared_tail(chi_squared, bins);
    if probability < 1e-4 { Err(format!("chi² = {chi_squared:.1}, {bins} bins: {probability:e}")) } else { Ok(()) }
}

#[test]
fn the_sky_is_drawn_as_its_density_says() {
    for (seed, (name, map)) in (63..).zip(maps()) {
        let answers = map.draw(200_000, &mut Random(seed));
        let pdf = |u: f64, y: f64| reference::sky::sky_pdf(&map.values, &map.widened(), u, y);
        check_drawn(&map, &answers, pdf).unwrap_or_else(|why| panic!("{name}: {why}"));
        if name == "sunny" {
            check_drawn(&map, &answers, |u, y| pdf(1.0 - u, y)).expect_err("u the wrong way round");
            check_drawn(&map, &answers, |u, y| pdf(u, -y)).expect_err("upside down");
        }
        if name == "smallest" {
            // Few bins and many samples show a density that is 2 % too large in one half, and too small in the other.
            let many = map.draw(1_000_000, &mut Random(seed));
            check_drawn(&map, &many, pdf).unwrap_or_else(|why| panic!("{name}: {why}"));
            check_drawn(&map, &many, |u, y| pdf(u, y) * if u < 0.5 { 1.02 } else { 0.98 }).expect_err("2 % off");
        }
        for answer in &answers {
            assert!((answer.direction().length() - 1.0).abs() < 2e-6, "{name}: {}", answer.direction());
            assert!(answer.radiance().min_element() >= 0.0 && answer.pdf() > 0.0, "{name}");
        }
        // The density that is asked for afterwards is the one that was drawn with, except where rounding has crossed a border.
        let directions: Vec<DVec3> = answers.iter().take(20_000).map(Answer::direction).collect();
        let asked = map.ask(&vec![[0.5; 4]; directions.len()], &directions);
        let same = |factor: f64| {
            let pairs = asked.iter().zip(&answers);
            pairs.filter(|(asked, drawn)| (asked.pdf_asked() * factor / drawn.pdf() - 1.0).abs() < 1e-3).count()
        };
        assert!(same(1.0) as f64 > 0.998 * directions.len() as f64, "{name}: only {} densities agree", same(1.0));
        assert_eq!(same(1.02), same(1.0 / 1.02), "a density that is 2 % off is never the right one");
    }
}

/// Whether numbers in ascending order draw heights, or azimuths within a row, in one order: numbers that are well spread then stay so.
fn check_order(places: impl Iterator<Item = f64>) -> Result<(), String> {
    let places: Vec<f64> = places.collect();
    match places.windows(2).find(|pair| pair[0] > pair[1]) {
        Some(pair) => Err(format!("{} comes before {}", pair[0], pair[1])),
        None => Ok(()),
    }
}

#[test]
fn the_sky_is_drawn_in_order() {
    for (name, map) in maps() {
        let place = |u: f64, v: f64| {
            let direction = reference::sky::sample_sky(&map.values, &map.widened(), DVec2::new(u, v)).direction;
            DVec2::new(Light::sky_uv(direction).x, 0.5 - 0.5 * direction.y)
        };
        let steps = || (0..4096).map(|k| f64::from(k) / 4096.0);
        for other in [0.1, 0.37, 0.9] {
            check_order(steps().map(|u| place(u, other).y)).unwrap_or_else(|why| panic!("{name}, heights: {why}"));
            check_order(steps().map(|v| place(other, v).x)).unwrap_or_else(|why| panic!("{name}, azimuths: {why}"));
            check_order(steps().map(|u| place(1.0 - u, other).y)).expect_err("the other way round");
        }
    }
}

/// Mean of the radiance's channels over all directions, by the midpoint rule in the azimuth and in the angle from +y, on the
/// definition.
fn mean_radiance(bitmap: &Bitmap, moment: impl Fn(DVec3) -> f64) -> f64 {
    let (across, down) = (16 * bitmap.width(), 16 * (bitmap.height() - 1));
    let places = (0..down).flat_map(|row| (0..across).map(move |column| (row, column)));
    let sum: f64 = places
        .map(|(row, column)| {
            let uv =
                DVec2::new((f64::from(column) + 0.5) / f64::from(across), (f64::from(row) + 0.5) / f64::from(down));
            let (theta, phi) = (PI * uv.y, 2.0 * PI * uv.x);
            let direction = v(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos());
            bitmap.sky(uv).element_sum() / 3.0 * theta.sin() * moment(direction)
        })
        .sum();
    sum * PI / 2.0 / f64::from(across * down)
}

#[test]
fn weights_have_the_expectation_of_quadrature() {
    // Together with uniform directions, by the balance heuristic: those find what the distribution leaves out.
    // The mean over all directions of the radiance, and of the radiance times (1 + x)(2 + y)(3 + z), which tells the axes and
    // their signs apart.
    let moment = |d: DVec3| (1.0 + d.x) * (2.0 + d.y) * (3.0 + d.z);
    for (seed, (name, map)) in (80..).zip(maps()) {
        let expected = [mean_radiance(&map.bitmap, |_| 1.0), mean_radiance(&map.bitmap, moment)];
        assert!((map.mean - expected[0]).abs() <= 2e-3 * expected[0], "{name}: {} is not {}", map.mean, expected[0]);
        if name == "black" {
            continue;
        }
        let mut random = Random(seed);
        let directions: Vec<DVec3> = (0..200_000).map(|_| random.direction()).collect();
        let numbers: Vec<[f64; 4]> = directions.iter().map(|_| [0; 4].map(|_| random.unit())).collect();
        let answers = map.ask(&numbers, &directions);
        let z = |fault: &dyn Fn(DVec3) -> DVec3, factor: f64| {
            let mut worst = 0f64;
            for (k, expected) in expected.iter().enumerate() {
                let numbers = answers.iter().zip(&directions).map(|(answer, direction)| {
                    let share = |radiance: DVec3, pdf: f64, direction: DVec3| {
                        let weight = radiance.element_sum() / 3.0 / (4.0 * PI * pdf + 1.0);
                        factor * weight * if k == 0 { 1.0 } else { moment(fault(direction)) }
                    };
                    share(answer.radiance(), answer.pdf(), answer.direction())
                        + share(answer.radiance_asked(), answer.pdf_asked(), *direction)
                });
                let (sum, squares) = numbers.fold((0.0, 0.0), |(sum, squares), x| (sum + x, squares + x * x));
                let count = answers.len() as f64;
                let error = ((squares / count - (sum / count).powi(2)) / count).sqrt();
                // Quadrature and rounding are off by less than 1e-3.
                let z = (sum / count - expected).abs() / (error.powi(2) + (1e-3 * expected).powi(2)).sqrt();
                worst = worst.max(z);
            }
            worst
        };
        assert!(z(&|d| d, 1.0) < 4.0, "{name}: z = {}", z(&|d| d, 1.0));
        assert!(z(&|d| d, 1.02) > 4.0, "{name}: weights that are 2 % too large are not noticed");
        if name == "sunny" || name == "a sun of 1e6" {
            assert!(z(&|d| v(-d.x, d.y, d.z), 1.0) > 4.0, "{name}: blind to a flipped u");
            assert!(z(&|d| v(d.x, -d.y, d.z), 1.0) > 4.0, "{name}: blind to a flipped v");
        }
        // A sun is found by most samples.
        if name == "a sun of 1e6" {
            let bright = answers.iter().filter(|answer| answer.radiance().x > 100.0).count();
            assert!(bright as f64 > 0.3 * answers.len() as f64, "only {bright} of {} see the sun", answers.len());
        }
    }
}

#[test]
fn a_sun_of_one_pixel_in_a_large_map_is_not_lost_between_cells() {
    // 16 pixels of the map share a cell. Wherever the sun stands, its cell has most of the choice, as its share of the light says.
    for place in [(4095, 5), (2049, 1000), (3, 2047), (1, 1023)] {
        let mut pixels = vec![[1e-3; 3]; 4096 * 2048];
        pixels[place.1 * 4096 + place.0] = [1e6; 3];
        let map = Map::new(Arc::new(Bitmap::new(4096, 2048, pixels).unwrap()), false);
        assert_eq!(map.grid(), [2048, 1024]);
        let place = (place.0 as f64 + 0.5, place.1 as f64);
        let (u, theta) = (place.0 / 4096.0, place.1 / 2047.0 * PI);
        let pdf = reference::sky::sky_pdf(&map.values, &map.widened(), u, theta.cos());
        // The hat of a pixel covers at most two cells in each direction, near the poles more in azimuth.
        assert!(pdf * 4.0 * PI / (2048.0 * 1024.0) > 0.03, "{place:?}: {pdf}");
    }
}
