//! Lobes of guides: drawn as their density says, whether broad or sharp, and at the ends of the random numbers as well.

use crate::common::comparison::Comparison;
use crate::common::random::Random;
use crate::common::statistics::check_uniform;
use crate::common::tolerances::comparison;
use crate::common::units::{run, vec4};
use glam::{DVec2, DVec3};
use std::f64::consts::PI;
use tyndall::pack::layout::GUIDE_CELLS;
use tyndall::reference::guide::{Guide, guide_cell, guide_pdf, sample_guide};

/// The largest of the program's random numbers.
const LAST: f64 = 1.0 - 1.0 / 16_777_216.0;

/// Directions, densities and, of the axis as a place, cells by the kernel.
fn ask(asked: &[(Guide, DVec2)]) -> Vec<(DVec3, f64, u32)> {
    let inputs: Vec<[f32; 4]> = asked
        .iter()
        .flat_map(|(Guide { axis, sharpness, chance }, u)| {
            [vec4(&[axis.x, axis.y, axis.z, *sharpness]), vec4(&[u.x, u.y, *chance])]
        })
        .collect();
    let outputs: Vec<[f32; 4]> = run("guide", &inputs, &[], asked.len(), 2 * asked.len());
    let wide = |output: &[[f32; 4]]| {
        let [x, y, z, pdf] = output[0].map(f64::from);
        (DVec3::new(x, y, z), pdf, output[1][0] as u32)
    };
    outputs.chunks(2).map(wide).collect()
}

#[test]
fn lobes_are_those_of_the_reference() {
    let mut random = Random(71);
    let ends = [0.0, 1.0 / 16_777_216.0, 1e-4, 0.5, 0.999, LAST];
    let mut asked: Vec<(Guide, DVec2)> = Vec::new();
    for _ in 0..200 {
        let axis = random.direction().as_vec3().normalize().as_dvec3();
        for sharpness in [0.1, 1.0, 7.0, 300.0] {
            let guide = Guide { axis, sharpness, chance: f64::from(random.unit() as f32) };
            asked.extend(ends.map(|u| (guide, DVec2::new(u, random.unit()))));
            asked.push((guide, DVec2::new(random.unit(), random.unit())));
        }
    }
    let [mut directions, mut pdfs] = ["sample_guide", "guide_pdf"].map(comparison);
    for ((guide, u), (direction, pdf, _)) in asked.iter().zip(ask(&asked)) {
        let case = format!("{guide:?}, {u}");
        let expected = sample_guide(guide, *u);
        // Next to the opposite of the axis 1 − cos has lost the digits of the sine, and a last number those of how unlikely it is.
        if guide.axis.dot(expected) > -0.98 && u.x < 0.9999 {
            directions.vector(&case, &direction.to_array().map(|x| x as f32), expected);
        } else {
            assert!((direction.length() - 1.0).abs() < 1e-6, "{case}: {direction}");
            assert!(direction.distance(expected) < 0.02, "{case}: {direction} for {expected}");
        }
        // Where the density falls by many powers of ten, the direction's rounding counts in it.
        let want = guide_pdf(guide, direction);
        let slope = guide.sharpness * (direction - guide.axis).length() * 1e-7;
        if slope < 1e-6 {
            pdfs.scalar(&case, pdf as f32, want);
        } else {
            assert!((pdf / want - 1.0).abs() < 4.0 * slope, "{case}: {pdf} for {want}");
        }
    }
    [directions, pdfs].into_iter().for_each(Comparison::finish);
}

/// Whether cosines lie as the density says, and it integrates to the chance: the mean of 1/pdf over directions drawn by a broad lobe is the
/// solid angle of all directions over the chance.
fn check(found: &[(DVec3, f64, u32)], guide: &Guide) -> Result<(), String> {
    let k = guide.sharpness;
    let rank = |direction: DVec3| {
        let one_minus_cos = 0.5 * (direction - guide.axis).length_squared();
        (1.0 - (-k * one_minus_cos).exp()) / (1.0 - (-2.0 * k).exp())
    };
    check_uniform(found.iter().map(|(direction, _, _)| rank(*direction).clamp(0.0, LAST)), 40)?;
    let all = found.iter().map(|(_, pdf, _)| guide.chance / pdf).sum::<f64>() / found.len() as f64;
    let off = all / (4.0 * PI) - 1.0;
    if off.abs() < 5e-3 { Ok(()) } else { Err(format!("the density integrates to {}", 1.0 + off)) }
}

#[test]
fn lobes_are_drawn_as_their_density_says() {
    let guide = Guide { axis: DVec3::new(0.48, -0.6, 0.64), sharpness: 1.5, chance: 0.4 };
    let count = 200;
    let grid = |k: i32| (f64::from(k) + 0.5) / f64::from(count);
    let asked: Vec<(Guide, DVec2)> =
        (0..count * count).map(|k| (guide, DVec2::new(grid(k / count), grid(k % count)))).collect();
    let found = ask(&asked);
    check(&found, &guide).unwrap();
    check(&found, &Guide { chance: 0.41, ..guide }).expect_err("another chance");
    check(&found, &Guide { sharpness: 1.55, ..guide }).expect_err("another sharpness");
    check(&found, &Guide { axis: -guide.axis, ..guide }).expect_err("another axis");
}

#[test]
fn cells_are_those_of_the_reference() {
    let mut random = Random(72);
    let side = f64::from(GUIDE_CELLS);
    let mut places: Vec<DVec3> = (0..2000)
        .map(|_| (random.in_cube() * 0.7 + 0.5) * side)
        .map(|place| place.as_vec3().as_dvec3())
        .filter(|place| (*place - place.round()).abs().min_element() > 1e-4)
        .collect();
    // Outside of the grid the nearest cell counts.
    places.extend([DVec3::splat(-1e9), DVec3::splat(1e9), DVec3::new(-3.0, 2.5, 99.0)]);
    let of = |place: &DVec3| (Guide { axis: *place, sharpness: 1.0, chance: 1.0 }, DVec2::splat(0.5));
    let found: Vec<u32> =
        ask(&places.iter().map(of).collect::<Vec<_>>()).into_iter().map(|(_, _, cell)| cell).collect();
    let wanted: Vec<u32> = places.iter().map(|place| guide_cell(*place)).collect();
    assert_eq!(found, wanted);
    let all = GUIDE_CELLS * GUIDE_CELLS * GUIDE_CELLS;
    assert!(wanted.iter().all(|cell| *cell < all) && wanted.iter().any(|cell| *cell == all - 1), "{all} cells");
}
