//! Directions past a lamp: drawn as their density says, at the ends of the random numbers as well.

use crate::common::comparison::Comparison;
use crate::common::random::Random;
use crate::common::statistics::check_uniform;
use crate::common::tolerances::comparison;
use crate::common::units::{run, vec4};
use glam::{DVec2, DVec3};
use std::f64::consts::PI;
use tyndall::reference::toward_light::{sample_toward_light, toward_light_pdf};

/// The largest of the program's random numbers.
const LAST: f64 = 1.0 - 1.0 / 16_777_216.0;

/// Directions and densities of the kernel.
fn ask(asked: &[(DVec3, DVec2)]) -> Vec<(DVec3, f64)> {
    let inputs: Vec<[f32; 4]> = asked
        .iter()
        .flat_map(|(axis, u)| [vec4(&[axis.x, axis.y, axis.z, u.x]), vec4(&[0.0, 0.0, 0.0, u.y])])
        .collect();
    let outputs: Vec<[f32; 4]> = run("toward_light", &inputs, &[], asked.len(), asked.len());
    outputs.into_iter().map(|output| output.map(f64::from)).map(|[x, y, z, pdf]| (DVec3::new(x, y, z), pdf)).collect()
}

#[test]
fn directions_past_a_lamp_are_those_of_the_reference() {
    let mut random = Random(97);
    let ends = [0.0, 1.0 / 16_777_216.0, 1e-4, 0.5, 0.999, LAST];
    let mut asked: Vec<(DVec3, DVec2)> = Vec::new();
    for _ in 0..400 {
        let axis = random.direction().as_vec3().normalize().as_dvec3();
        asked.extend(ends.map(|u| (axis, DVec2::new(u, random.unit()))));
        asked.push((axis, DVec2::new(random.unit(), random.unit())));
    }
    let [mut directions, mut pdfs] = ["sample_toward_light", "toward_light_pdf"].map(comparison);
    for ((axis, u), (direction, pdf)) in asked.iter().zip(ask(&asked)) {
        let case = format!("{axis}, {u}");
        let found = direction.to_array().map(|x| x as f32);
        directions.vector(&case, &found, sample_toward_light(*axis, *u));
        assert!(pdf.is_finite() && pdf > 0.0, "{case}: {pdf}");
        // The sine of a small angle between rounded directions has few digits.
        let sine = axis.cross(direction).length();
        if sine > 0.2 {
            pdfs.scalar(&case, pdf as f32, toward_light_pdf(*axis, direction));
        } else if sine > 1e-3 {
            let want = toward_light_pdf(*axis, direction);
            assert!((pdf / want - 1.0).abs() < 1e-6 / sine, "{case}: {pdf} for {want}");
        }
    }
    [directions, pdfs].into_iter().for_each(Comparison::finish);
}

/// Whether the angles to the lamp lie as their density says, and the density integrates to 1: the mean of 1/pdf over directions drawn
/// by it is the solid angle of all directions.
fn check(found: &[(DVec3, f64)], axis: DVec3) -> Result<(), String> {
    let angle = |direction: DVec3| axis.cross(direction).length().atan2(axis.dot(direction));
    // The integral of (π − θ) / (π³ sin θ) · 2π sin θ.
    let rank = |theta: f64| 1.0 - (1.0 - theta / PI).powi(2);
    check_uniform(found.iter().map(|(direction, _)| rank(angle(*direction)).min(LAST)), 40)?;
    let solid_angle = found.iter().map(|(_, pdf)| 1.0 / pdf).sum::<f64>() / found.len() as f64;
    let off = solid_angle / (4.0 * PI) - 1.0;
    if off.abs() < 2e-3 { Ok(()) } else { Err(format!("the density integrates to {}", 1.0 + off)) }
}

#[test]
fn directions_past_a_lamp_are_drawn_as_their_density_says() {
    let axis = DVec3::new(0.48, -0.6, 0.64);
    let count = 200;
    let grid = |k: i32| (f64::from(k) + 0.5) / f64::from(count);
    let asked: Vec<(DVec3, DVec2)> =
        (0..count * count).map(|k| (axis, DVec2::new(grid(k / count), grid(k % count)))).collect();
    let found = ask(&asked);
    check(&found, axis).unwrap();
    let wrong: Vec<(DVec3, f64)> = found.iter().map(|(direction, pdf)| (*direction, pdf * 1.01)).collect();
    check(&wrong, axis).expect_err("a density that is 1 % off");
    check(&found, DVec3::new(0.6, -0.48, 0.64)).expect_err("another lamp");
}
