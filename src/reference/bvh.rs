//! Mirror of `shaders/lib/bvh.glsl`: one step of the walk through the hierarchy. See [`crate::pack::bvh`] for the layout.

use glam::{DVec3, UVec3};

/// The ray in the grid of the nodes' bounds: the slab test is bound · scale + offset.
#[derive(Clone, Copy, Debug)]
pub struct GridRay {
    scale: DVec3,
    offset: DVec3,
    near_shift: UVec3,
    octant: u32,
}

/// Where a walk stands.
#[derive(Clone, Copy, Debug)]
pub struct Walk {
    /// The next node.
    pub node: u32,
    /// Behind the last node.
    pub end: u32,
    /// 0: none pending; else 1 + (first primitive << 3 | primitives left − 1).
    pub leaf: u32,
}

impl Walk {
    /// Whether nothing is left to visit.
    pub fn is_done(&self) -> bool {
        self.node >= self.end && self.leaf == 0
    }
}

/// The ray in the grid.
pub fn grid_ray(origin: DVec3, direction: DVec3, grid_origin: DVec3, grid_step: DVec3) -> GridRay {
    // A component too small to be inverted is as good as a small one: it moves the slabs by less than their margin.
    let safe = DVec3::select(direction.abs().cmplt(DVec3::splat(1e-9)), DVec3::splat(1e-9), direction);
    let inverse = 1.0 / safe;
    let negative = safe.cmplt(DVec3::ZERO);
    let bits = UVec3::new(u32::from(negative.x), u32::from(negative.y), u32::from(negative.z));
    GridRay {
        scale: inverse * grid_step,
        offset: (grid_origin - origin) * inverse,
        near_shift: bits * 16,
        octant: bits.x | bits.y << 1 | bits.z << 2,
    }
}

/// The walk's start in the copy of the tree for the ray's octant.
pub fn start_walk(ray: &GridRay, node_count: u32, copies: u32) -> Walk {
    let first = if copies == 8 { ray.octant * node_count } else { 0 };
    Walk { node: first, end: first + node_count, leaf: 0 }
}

/// Tests one node.
pub fn step_walk(node: [u32; 4], ray: &GridRay, t_max: f64, copies: u32, walk: &mut Walk) {
    let words = UVec3::new(node[0], node[1], node[2]);
    let near_shift = if copies == 8 { UVec3::ZERO } else { ray.near_shift };
    let near = (words >> near_shift) & 0xffff;
    let far = (words >> (UVec3::splat(16) - near_shift)) & 0xffff;
    let t_near = near.as_dvec3() * ray.scale + ray.offset;
    let t_far = far.as_dvec3() * ray.scale + ray.offset;
    let enter = t_near.max_element().max(0.0);
    let leave = t_far.min_element().min(t_max);
    let hit = enter <= leave;
    let leaf = (node[3] as i32) < 0;
    walk.node = if hit || leaf { walk.node + 1 } else { node[3] };
    walk.leaf = if hit && leaf { (node[3] & 0x7fff_ffff) + 1 } else { 0 };
}

/// The primitive that a pending leaf asks for; the leaf moves on to its next one.
pub fn next_primitive(walk: &mut Walk) -> u32 {
    let word = walk.leaf - 1;
    // One further, one fewer left: + 8 − 1 in the word.
    walk.leaf = if word & 7 == 0 { 0 } else { walk.leaf + 7 };
    word >> 3
}
