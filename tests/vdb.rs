//! Voxels of `.nvdb` and `.vdb` files. The files in `tests/data/vdb` were written by OpenVDB 10.0.1 and its `nanovdb_convert`.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should say so")]

use glam::{DMat4, DVec3};
use tyndall::scene::GridFile;

#[path = "common/vdb_files.rs"]
mod vdb_files;

use vdb_files::{data, read};

fn refused(name: &str, bytes: &[u8], grid: Option<&str>) -> String {
    read(name, bytes, grid).expect_err("it is wrong")
}

/// The value that the files have at an index, and within which error.
fn rule(i: i32, j: i32, k: i32) -> f32 {
    (7 * i + 13 * j + 29 * k).rem_euclid(11) as f32 / 16.0
}

/// Of the grid "density": voxels by the rule, a tile, and the background.
fn density(i: i32, j: i32, k: i32) -> f32 {
    match (i, j, k) {
        (-3..=10, 2..=7, -9..=4) => rule(i, j, k),
        (16..=23, 0..=7, 0..=7) => 0.5,
        _ => 0.0,
    }
}

/// Compares all voxels of the box that begins at an index.
fn compare(file: &GridFile, first: [i32; 3], error: f32, value: impl Fn(i32, i32, i32) -> f32) -> Result<(), String> {
    let [x, y, z] = file.grid.resolution();
    for (k, (j, i)) in (0..z).flat_map(|k| (0..y).flat_map(move |j| (0..x).map(move |i| (k, (j, i))))) {
        let [a, b, c] = [first[0] + i as i32, first[1] + j as i32, first[2] + k as i32];
        let (got, expected) = (file.grid.voxel(i, j, k)[0], value(a, b, c));
        if (got - expected).abs() > error {
            return Err(format!("({a}, {b}, {c}): {got}, not {expected}"));
        }
    }
    Ok(())
}

/// The box [least − ½, greatest + ½] of indices.
fn index_box(first: [i32; 3], size: [u32; 3]) -> DMat4 {
    let low = DVec3::from_array(first.map(f64::from)) - 0.5;
    DMat4::from_translation(low) * DMat4::from_scale(DVec3::from_array(size.map(f64::from)))
}

const FIRST: [i32; 3] = [-3, 0, -9];
const SIZE: [u32; 3] = [27, 8, 17];

/// (i, j, k)/4 + (1, 2, 3).
fn quarter() -> DMat4 {
    DMat4::from_translation(DVec3::new(1.0, 2.0, 3.0)) * DMat4::from_scale(DVec3::splat(0.25))
}

#[test]
fn every_voxel_of_every_codec() {
    // Codes of 4, 8 and 16 bits between 0 and 10/16: half a step. Variable ones are within a hundredth of the range.
    for (name, error) in [
        ("density.nvdb", 0.0),
        ("density_blosc.nvdb", 0.0),
        ("fog.nvdb", 0.0),
        ("fog.vdb", 0.0),
        ("fog_zip.vdb", 0.0),
        ("density_active.vdb", 0.0),
        ("density_plain.vdb", 0.0),
        ("fp4.nvdb", 0.625 / 15.0 / 2.0),
        ("fp8.nvdb", 0.625 / 255.0 / 2.0),
        ("fp16.nvdb", 0.625 / 65535.0 / 2.0),
        ("fpN.nvdb", 0.01),
    ] {
        let file = read(name, &data(name), None).unwrap_or_else(|why| panic!("{name}: {why}"));
        assert_eq!((file.grid.resolution(), file.grid.channels()), (SIZE, 1), "{name}");
        compare(&file, FIRST, error + 1e-7, density).unwrap_or_else(|why| panic!("{name}: {why}"));
        assert_eq!((file.to_world, file.places_itself), (quarter() * index_box(FIRST, SIZE), true), "{name}");
        // Voxels that are a place off, or a little thicker, are noticed.
        compare(&file, FIRST, error + 1e-7, |i, j, k| density(i, k, j)).expect_err("two axes exchanged");
        let thicker = |i, j, k| density(i, j, k) * (1.001 + 5.0 * error);
        compare(&file, FIRST, error + 1e-7, thicker).expect_err("thicker");
    }
}

#[test]
fn grids_are_named() {
    for name in ["fog.nvdb", "fog.vdb", "fog_zip.vdb"] {
        let bytes = data(name);
        let grid = |grid| read(name, &bytes, Some(grid)).unwrap_or_else(|why| panic!("{name}: {why}"));
        assert_eq!(grid("density").grid, read(name, &bytes, None).unwrap().grid);
        // Of half precision in the .vdb, with inactive voxels that are not the background, mirrored and stretched.
        let heat = grid("heat");
        assert_eq!(heat.grid.resolution(), [3, 2, 4]);
        let value = |i, j, k| match (i, j, k) {
            (1, 1, 1) => 0.5,
            (1, 0, 1) => 0.25,
            _ => rule(i, j, k),
        };
        compare(&heat, [0, 0, 0], 0.0, value).unwrap();
        let scale = DMat4::from_scale(DVec3::new(-0.5, 1.0, 2.0));
        assert_eq!(heat.to_world, scale * index_box([0; 3], [3, 2, 4]));
        // Three channels; turned, sheared and moved.
        let tint = grid("tint");
        assert_eq!((tint.grid.resolution(), tint.grid.channels()), ([3, 2, 1], 3));
        assert_eq!(tint.grid.voxel(2, 1, 0), [0.5, 0.5, 1.0]);
        assert_eq!(tint.grid.voxel(1, 0, 0), [0.25, 0.0, 1.0]);
        // The voxel (2, 1, −1): 2 (0.6, 0.8, 0) + (−0.8, 0.6, 0) − (0, 0.5, 2) + (1, 0, −1).
        let center = tint.to_world.transform_point3(DVec3::new(2.5 / 3.0, 0.75, 0.5));
        assert!((center - DVec3::new(1.4, 1.7, -3.0)).length() < 1e-12, "{center}");

        // Of the grids that OpenVDB packs by zlib, the class is unknown, and the distances of a level set are negative inside.
        let surface = if name == "fog_zip.vdb" {
            "must be finite and not negative"
        } else {
            "it is a level set; fog volumes are"
        };
        assert!(refused(name, &bytes, Some("surface")).contains(surface));
        assert!(refused(name, &bytes, Some("mask")).contains("bool"));
        assert!(refused(name, &bytes, Some("nothing")).contains("grid \"nothing\": it has no active voxels"));
        let unknown = refused(name, &bytes, Some("Density"));
        assert!(unknown.contains("no grid \"Density\"; its grids: \"density\", \"heat\""), "{unknown}");
    }
    let twins = data("twins.vdb");
    assert!(refused("a.vdb", &twins, None).contains("which grid?"), "{}", refused("a.vdb", &twins, None));
    assert!(refused("a.vdb", &twins, Some("twin")).contains("2 grids called \"twin\""));
}

/// OpenVDB writes a tree once that two grids share.
#[test]
fn grids_that_share_their_voxels() {
    let file = read("a.vdb", &data("instances.vdb"), Some("copy")).unwrap();
    compare(&file, FIRST, 0.0, density).unwrap();
    assert_eq!(file.to_world, DMat4::from_scale(DVec3::splat(2.0)) * index_box(FIRST, SIZE));
}

#[test]
fn a_sparse_grid_without_room_is_refused_with_its_size() {
    let why = refused("wide.vdb", &data("wide.vdb"), None);
    assert!(why.contains("a box of 3001 x 2001 x 1001") && why.contains("22.4 GiB"), "{why}");
    let why = refused("stray.vdb", &data("stray.vdb"), None);
    assert!(why.contains("its 2 active voxels are scattered over a box of 1001 x 601 x 501, 1.1 GiB"), "{why}");
}

#[test]
fn segments_and_bare_grids() {
    let (one, two) = (data("density.nvdb"), data("fog.nvdb"));
    let both = [&two[..], &one].concat();
    assert!(refused("both.nvdb", &both, None).contains("which grid?"));
    assert!(refused("both.nvdb", &both, Some("density")).contains("2 grids called"));
    assert!(read("both.nvdb", &both, Some("tint")).is_ok());
    // After the segment's head, 176 bytes and the name with its zero, the grid as it is in memory.
    let head = 16 + 176 + "density".len() + 1;
    let mut bare = one[head..].to_vec();
    bare[..8].copy_from_slice(b"NanoVDB1");
    let file = read("bare.nvdb", &bare, None).unwrap();
    compare(&file, FIRST, 0.0, density).unwrap();
    // Newer files begin with other letters than their grids; the layout is that of all versions 32.
    let mut newer = one;
    newer[..8].copy_from_slice(b"NanoVDB2");
    newer[head..head + 8].copy_from_slice(b"NanoVDB1");
    [8, head + 16].iter().for_each(|at| newer[*at..at + 4].copy_from_slice(&(32u32 << 21 | 9 << 10).to_le_bytes()));
    compare(&read("newer.nvdb", &newer, None).unwrap(), FIRST, 0.0, density).unwrap();
}

#[test]
fn files_that_are_wrong_are_refused_with_byte_and_cause() {
    let (nano, open) = (data("density.nvdb"), data("fog.vdb"));
    assert!(refused("a.nvdb", &open, None).contains("it is an OpenVDB file"));
    assert!(refused("a.vdb", &nano, None).contains("it is a NanoVDB file"));
    assert!(refused("a.vol", &nano, None).contains("should end in .nvdb"));
    assert!(refused("a.nvdb", b"VOL", None).contains("byte 0: it does not begin with \"NanoVDB0\""));
    assert!(refused("a.vdb", b"", None).contains("byte 0: it does not begin"));
    assert!(refused("a.vol", b"VOL\x03", Some("density")).contains("only .nvdb and .vdb files have names"));
    let changed = |bytes: &[u8], at: usize, new: &[u8]| {
        let mut bytes = bytes.to_vec();
        bytes[at..at + new.len()].copy_from_slice(new);
        bytes
    };
    let grid = 16 + 176 + "density".len() + 1;
    let root = grid + 672 + 64;
    for (bytes, expected) in [
        (changed(&nano, 8, &(31u32 << 21).to_le_bytes()), "byte 8: version 31.0.0; 32 is accepted".to_owned()),
        (changed(&nano, 14, &7u16.to_le_bytes()), format!("byte {grid}: codec 7; none, ZIP (1) and BLOSC (2)")),
        (changed(&nano, grid + 632, &[5]), format!("byte {}: it is a point data", grid + 632)),
        (changed(&nano, grid + 636, &[2]), format!("byte {}: its values are double", grid + 636)),
        (changed(&nano, grid + 636, &[200]), "of an unknown type".to_owned()),
        (changed(&nano, grid + 672 + 24, &[0xff; 8]), "the root is within".to_owned()),
        (changed(&nano, root + 64 + 8, &[0xff; 7]), "leads out of the grid".to_owned()),
        (changed(&nano, root + 64 + 32, &nano[root + 64..root + 72]), "at the same place".to_owned()),
        (changed(&nano, grid + 296 + 88, &[0; 8]), "its transform has no inverse".to_owned()),
        (nano[..nano.len() - 1].to_vec(), format!("byte {grid}: ")),
        ([&nano[..], b"tail"].concat(), format!("byte {}: 8 bytes are needed", nano.len())),
    ] {
        let why = refused("a.nvdb", &bytes, None);
        assert!(why.contains(&expected), "{expected}\n{why}");
    }
    for (bytes, expected) in [
        (changed(&open, 8, &[221]), "byte 8: format version 221; 222 to 224"),
        (changed(&open, 20, &[0]), "byte 20: it was written to a stream"),
        (open[..open.len() / 4].to_vec(), "bytes are needed here, but it ends at byte"),
    ] {
        let why = refused("a.vdb", &bytes, None);
        assert!(why.contains(expected), "{expected}\n{why}");
    }
}

/// Files that are cut, and files with some bytes changed, are read or refused, and nothing else happens.
#[test]
fn hostile_files_neither_panic_nor_take_long() {
    let mut state = 0x853c_49e6_748f_ea9bu64;
    let mut random = |below: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((state >> 33) as usize) % below
    };
    let folder = tempfile::tempdir().unwrap();
    let mut refusals = 0;
    for name in ["density_blosc.nvdb", "fog.nvdb", "fpN.nvdb", "density.nvdb", "fog.vdb", "density_plain.vdb"] {
        let good = data(name);
        let path = folder.path().join(name);
        for round in 0..60 {
            let mut bytes = good.clone();
            if round % 3 == 0 {
                bytes.truncate(random(good.len()));
            } else {
                for _ in 0..1 + random(8) {
                    // Heads and sizes are where it hurts. The last bytes are those of the smaller nodes; in nodes of 32³ a changed byte
                    // makes tiles of millions of active voxels, and files that may ask for gigabytes.
                    let among = good.len().min(if random(2) == 0 { 1100 } else { 150_000 });
                    let at = random(among);
                    bytes[if among == 1100 { at } else { good.len() - 1 - at }] = [0, 1, 0x7f, 0x80, 0xff][random(5)];
                }
            }
            std::fs::write(&path, &bytes).unwrap();
            for grid in [None, Some("tint"), Some("heat")] {
                refusals += usize::from(GridFile::read(&path, grid).is_err());
            }
        }
    }
    assert!(refusals > 500, "{refusals}");
}
