//! Writes the smoke of `scenes/volumes/smoke.xml`: 128³ voxels of a plume that rises and curls, the same on every machine.
//!
//!     cargo run --release --example smoke [-- FILE [SIDE [FACTOR]]]
//!
//! `FILE` is `scenes/volumes/smoke.vol` unless given, `SIDE` the voxels along each side, and `FACTOR` makes one voxel brighter: what
//! that costs stands in `docs/BENCHMARKS.md`.

use glam::DVec3;
use std::path::PathBuf;
use tyndall::scene::Grid;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = PathBuf::from(arguments.next().unwrap_or_else(|| "scenes/volumes/smoke.vol".to_owned()));
    let side: usize = arguments.next().map_or(Ok(128), |text| text.parse())?;
    let factor: f32 = arguments.next().map_or(Ok(1.0), |text| text.parse())?;
    let mut voxels = Vec::with_capacity(side.pow(3));
    for index in 0..side.pow(3) {
        let at = [index % side, index / side % side, index / side / side];
        voxels.push(density(DVec3::from_array(at.map(|k| (k as f64 + 0.5) / side as f64))) as f32);
    }
    // A place in the middle of the plume.
    voxels[(side / 2 * side + side * 2 / 5) * side + side / 2] *= factor;
    let grid = Grid::new([side; 3], 1, voxels)?;
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    std::fs::write(&path, grid.encode([DVec3::ZERO, DVec3::ONE]))?;
    println!("{}: {side} x {side} x {side} voxels, up to {}", path.display(), grid.max());
    Ok(())
}

/// Density in \[0, 1\] at a point of the unit cube: a plume about the axis x = z = 1/2 that widens with y and is carried around by
/// noise, with holes where noise is low.
fn density(p: DVec3) -> f64 {
    let swirl = DVec3::new(noise(p * 3.0, 1), noise(p * 3.0, 2), noise(p * 3.0, 3)) - 0.5;
    let q = p + 0.35 * p.y * swirl;
    let sway = DVec3::new(0.06 * (7.0 * q.y).sin(), 0.0, 0.05 * (5.0 * q.y + 1.0).cos());
    let axis = DVec3::new(0.5, q.y, 0.5) + sway * q.y;
    let radius = 0.07 + 0.27 * q.y;
    let inside = 1.0 - q.distance(axis) / radius;
    let billows: f64 =
        (0..5).map(|octave| noise(q * 5.0 * 2f64.powi(octave), 4 + octave as u32) / 2f64.powi(octave)).sum();
    let ends = smooth(p.y / 0.08) * smooth((0.97 - p.y) / 0.25);
    let edges = smooth(p.x.min(1.0 - p.x) / 0.05) * smooth(p.z.min(1.0 - p.z) / 0.05);
    (2.5 * (inside + 1.1 * (billows - 1.0))).clamp(0.0, 1.0) * ends * edges
}

/// From 0 to 1 with level ends.
fn smooth(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

/// Noise in \[0, 1\]: hashed values at whole coordinates, interpolated smoothly.
fn noise(p: DVec3, seed: u32) -> f64 {
    let (cell, part) = (p.floor(), p - p.floor());
    let part = part * part * (3.0 - 2.0 * part);
    let corner = |dx: i32, dy: i32, dz: i32| hash([cell.x as i32 + dx, cell.y as i32 + dy, cell.z as i32 + dz], seed);
    let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
    let edge = |dy: i32, dz: i32| mix(corner(0, dy, dz), corner(1, dy, dz), part.x);
    let face = |dz: i32| mix(edge(0, dz), edge(1, dz), part.y);
    mix(face(0), face(1), part.z)
}

/// A number in \[0, 1) for a point of the lattice (the finaliser of MurmurHash3, Appleby 2011).
fn hash(at: [i32; 3], seed: u32) -> f64 {
    let mut h = seed.wrapping_mul(0x9e37_79b9);
    for word in at {
        h = (h ^ word as u32).wrapping_mul(0x85eb_ca6b);
        h = (h ^ h >> 13).wrapping_mul(0xc2b2_ae35);
        h ^= h >> 16;
    }
    f64::from(h) / 4_294_967_296.0
}
