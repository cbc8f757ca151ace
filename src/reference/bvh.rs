//! Mirror of `shaders/lib/bvh.glsl`: one step of the walk through the hierarchy. See [`crate::pack::bvh`] for the layout.

use crate::pack::bvh::{INNER, Node};
use glam::{BVec3, DVec3, UVec3};

/// The ray in the grid of the nodes' bounds: the slab test is bound · scale + offset.
#[derive(Clone, Copy, Debug)]
pub struct GridRay {
    scale: DVec3,
    offset: DVec3,
    negative: BVec3,
}

/// Where a walk stands. The kernel has the number of places on the stack that the tree needs.
#[derive(Clone, Debug)]
pub struct Walk {
    node: Option<u32>,
    first: u32,
    pending: u32,
    stack: Vec<u32>,
}

impl Walk {
    /// The next node, unless primitives are to be tested first.
    pub fn next_node(&self) -> Option<u32> {
        self.node.filter(|_| self.pending == 0)
    }
}

/// The ray in the grid.
pub fn grid_ray(origin: DVec3, direction: DVec3, grid_origin: DVec3, grid_step: DVec3) -> GridRay {
    // A component too small to be inverted is as good as a small one: it moves the slabs by less than their margin.
    let safe = DVec3::select(direction.abs().cmplt(DVec3::splat(1e-9)), DVec3::splat(1e-9), direction);
    let inverse = 1.0 / safe;
    GridRay { scale: inverse * grid_step, offset: (grid_origin - origin) * inverse, negative: safe.cmplt(DVec3::ZERO) }
}

/// A walk that begins at the root, if the ray meets the tree at all: from the corner 0 of its grid to `size`.
pub fn start_walk(ray: &GridRay, size: DVec3, t_max: f64) -> Walk {
    let (one, other) = (ray.offset, size * ray.scale + ray.offset);
    let met = one.min(other).max_element().max(0.0) <= one.max(other).min_element().min(t_max);
    Walk { node: met.then_some(0), first: 0, pending: 0, stack: Vec::new() }
}

/// On from a node whose first inner child this is, to those of its children that are hit, the nearest first.
fn advance_walk(first_child: u32, mut hits: Vec<(f64, u32)>, walk: &mut Walk) {
    hits.sort_by(|one, two| one.0.total_cmp(&two.0));
    if let Some(&(_, next)) = hits.get(1) {
        let after = hits.get(2).map_or(next, |hit| hit.1);
        let last = hits.get(3).map_or(after, |hit| hit.1);
        walk.stack.push(first_child << 6 | next << 4 | after << 2 | last);
    }
    if let Some((_, nearest)) = hits.first() {
        walk.node = Some(first_child + nearest);
        return;
    }
    walk.node = walk.stack.pop().map(|top| {
        let (of_top, next, last) = (top >> 4 & 3, top >> 2 & 3, top & 3);
        if next != of_top {
            walk.stack.push(top & !63 | next << 4 | last << 2 | last);
        }
        (top >> 6) + of_top
    });
}

/// Tests the children of one node.
pub fn step_walk(node: &Node, ray: &GridRay, t_max: f64, walk: &mut Walk) {
    let origin = UVec3::new(node[6] & 0xffff, node[6] >> 16, node[7] & 0xffff).as_dvec3();
    let offset = origin * ray.scale + ray.offset;
    let steps = [16, 20, 24].map(|shift| f64::from(1u32 << (node[7] >> shift & 15)));
    let scale = ray.scale * DVec3::from(steps);
    let bound =
        |first: usize, k: u32| UVec3::from([0, 1, 2].map(|axis| node[first + axis] >> (8 * k) & 0xff)).as_dvec3();
    let kinds = node[8] & 63 | (node[9] & 63) << 6;
    let mut before = 0;
    walk.first = node[9] >> 6;
    let mut hits: Vec<(f64, u32)> = Vec::new();
    for k in 0..4 {
        let (low, high) = (bound(0, k), bound(3, k));
        let t_near = DVec3::select(ray.negative, high, low) * scale + offset;
        let t_far = DVec3::select(ray.negative, low, high) * scale + offset;
        let enter = t_near.max_element().max(0.0);
        let hit = enter <= t_far.min_element().min(t_max);
        let kind = kinds >> (3 * k) & 7;
        let inner = kind == INNER;
        if hit && inner {
            hits.push((enter, k));
        }
        let count = if inner { 0 } else { kind };
        walk.pending |= if hit { ((1 << count) - 1) << before } else { 0 };
        before += count;
    }
    advance_walk(node[8] >> 6, hits, walk);
}

/// The next primitive of those that wait for their test.
pub fn next_primitive(walk: &mut Walk) -> Option<u32> {
    let bit = walk.pending.trailing_zeros();
    (bit < u32::BITS).then(|| {
        walk.pending &= walk.pending - 1;
        walk.first + bit
    })
}
