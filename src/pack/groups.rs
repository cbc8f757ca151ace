//! Groups of pixels that share their paths: how they lie on the crop window, and how they shift from run to run of samples.
//! `shaders/lib/film.glsl` has the same for the kernels.

use crate::render::{RUN_SAMPLES, RUN_SHIFTS};

/// Columns and rows of a group of 4 or 8 pixels; without sharing (0) a pixel is alone.
pub fn group_size(sharers: u32) -> [u32; 2] {
    match sharers {
        0 => [1, 1],
        4 => [2, 2],
        _ => [2, 4],
    }
}

/// Which of the [`RUN_SHIFTS`] shifts a sample has.
pub fn run_shift(sample_index: u32) -> u32 {
    sample_index / (2 * RUN_SAMPLES) % RUN_SHIFTS
}

/// A sample that has the shift.
pub fn first_of_shift(shift: u32) -> u32 {
    2 * RUN_SAMPLES * shift
}

/// Which half of the render a sample belongs to, 0 or 1.
pub fn run_half(sample_index: u32) -> u32 {
    sample_index / RUN_SAMPLES % 2
}

/// By how many columns and rows the groups are shifted for a sample: pixel (x, y) belongs to the group with the column
/// (x + shift) / columns, and its row alike. All groups meet all their neighbours in turn.
pub fn group_offset(sharers: u32, sample_index: u32) -> [u32; 2] {
    let shift = run_shift(sample_index);
    let (x, y) = (shift & 1, shift >> 1);
    match sharers {
        0 => [0, 0],
        4 => [x, x ^ y],
        _ => [x, 2 * x + y],
    }
}

/// The largest of these shifts.
pub fn group_margin(sharers: u32) -> [u32; 2] {
    match sharers {
        0 => [0, 0],
        4 => [1, 1],
        _ => [1, 3],
    }
}

/// The groups of a crop window for a sample, each with the pixels of it that lie in the window, row by row.
pub fn groups(crop: [u32; 2], sharers: u32, sample_index: u32) -> Vec<Vec<[u32; 2]>> {
    let ([columns, rows], [dx, dy]) = (group_size(sharers), group_offset(sharers, sample_index));
    let mut groups = Vec::new();
    for top in (0..crop[1] + dy).step_by(rows as usize) {
        for left in (0..crop[0] + dx).step_by(columns as usize) {
            let places = (0..rows).flat_map(|y| (0..columns).map(move |x| [left + x, top + y]));
            let inside = places.filter(|[x, y]| (dx..crop[0] + dx).contains(x) && (dy..crop[1] + dy).contains(y));
            groups.push(inside.map(|[x, y]| [x - dx, y - dy]).collect());
        }
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn each_sample_has_each_pixel_in_one_group() {
        for (sharers, sample) in [(0, 5), (4, 0), (4, 13), (8, 8), (8, 31)] {
            let groups = groups([7, 5], sharers, sample);
            assert!(groups.iter().all(|group| group.len() <= sharers.max(1) as usize));
            let pixels: Vec<[u32; 2]> = groups.into_iter().flatten().collect();
            assert_eq!(pixels.len(), 35);
            assert_eq!(pixels.into_iter().collect::<HashSet<_>>().len(), 35);
        }
    }

    #[test]
    fn each_half_has_all_shifts_and_joins_all_pixels() {
        for sharers in [4, 8] {
            for half in 0..2 {
                let samples = (0..2 * RUN_SAMPLES * RUN_SHIFTS).filter(|sample| run_half(*sample) == half);
                let shifts: HashSet<[u32; 2]> = samples.map(|sample| group_offset(sharers, sample)).collect();
                assert_eq!(shifts.len(), RUN_SHIFTS as usize);
                let margin = [0, 1].map(|k| shifts.iter().map(|shift| shift[k]).max().unwrap());
                assert_eq!(margin, group_margin(sharers));
                // From one pixel over the groups to all others.
                let mut reached = HashSet::from([[0u32, 0u32]]);
                for _ in 0..20 {
                    for sample in (0..2 * RUN_SAMPLES * RUN_SHIFTS).filter(|sample| run_half(*sample) == half) {
                        for group in groups([6, 9], sharers, sample) {
                            if group.iter().any(|pixel| reached.contains(pixel)) {
                                reached.extend(group);
                            }
                        }
                    }
                }
                assert_eq!(reached.len(), 54);
            }
        }
    }
}
