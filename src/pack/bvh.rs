//! The flattened bounding volume hierarchy: 16-byte nodes in depth-first order, walked without a stack.
//!
//! A node is hit or not: if it is, or if it is a leaf, the walk goes on with the next node; if an inner node is missed, with
//! the node behind its subtree. Bounds are 16-bit steps of a grid over the whole tree. With eight copies of the tree,
//! one for each octant of directions, children stand near one first and each bound stands where the ray enters it.
//!
//! Layout of a node, `[u32; 4]`: for x, y, z the near bound (low 16 bits) and the far bound (high 16 bits), then a word: of an
//! inner node the index of the node behind its subtree; of a leaf bit 31, the first primitive (<< 3) and the number of
//! primitives minus 1.

use super::layout::{PRIMITIVE_SPHERE, Primitive};
use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::{Boundable, BvhBuildParams};

/// Most primitives in a leaf: the count has three bits.
const MAX_LEAF: u32 = 8;
/// Eight copies of the tree are made as long as they take no more than this, in bytes: they must stay in a processor's own
/// caches. Beyond, a single copy costs 3 % more steps but a third less time (measured on 20,480 triangles).
const MAX_COPIES_SIZE: usize = 128 << 10;
/// Bits of a leaf's first primitive.
const FIRST_BITS: u32 = 28;
/// Most primitives that a tree can hold.
pub const MAX_PRIMITIVES: usize = 1 << FIRST_BITS;
const LEAF: u32 = 1 << 31;

/// A flattened tree. The primitives of its leaves are contiguous in the order that [`Bvh::new`] returns.
#[derive(Clone, Debug, PartialEq)]
pub struct Bvh {
    /// All copies, one behind the other.
    pub nodes: Vec<[u32; 4]>,
    /// Nodes of one copy.
    pub node_count: u32,
    /// 8, or 1 for a large tree. A single copy has the order of the octant (+, +, +).
    pub copies: u32,
    /// Lower corner of the grid.
    pub grid_origin: Vec3,
    /// Step of the grid.
    pub grid_step: Vec3,
}

struct Bounded(Aabb);

impl Boundable for Bounded {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

/// The bounds of a primitive.
pub fn bounds(primitive: &Primitive) -> (Vec3, Vec3) {
    if primitive.surface & PRIMITIVE_SPHERE != 0 {
        let radius = Vec3::splat(primitive.b.x);
        (primitive.a - radius, primitive.a + radius)
    } else {
        let Primitive { a, b, c, .. } = *primitive;
        (a.min(b).min(c), a.max(b).max(c))
    }
}

/// The bounds of all of some primitives; inside out if there are none.
pub fn bounds_of_all(primitives: &[Primitive]) -> (Vec3, Vec3) {
    let each = primitives.iter().map(bounds);
    each.fold((Vec3::MAX, Vec3::MIN), |(min, max), (low, high)| (min.min(low), max.max(high)))
}

impl Bvh {
    /// Builds the tree and returns it with the primitives in the order of its leaves.
    pub fn new(primitives: &[Primitive]) -> (Bvh, Vec<Primitive>) {
        let (bvh, order) = Bvh::with_order(primitives, 0, Vec3::ZERO);
        (bvh, order.iter().map(|&index| primitives[index as usize]).collect())
    }

    /// Builds the tree and returns it with the indices of the primitives in the order of its leaves. The leaves count from
    /// `first` on. `whole` is the extent of the scene, of which the primitives may be a part.
    pub fn with_order(primitives: &[Primitive], first: u32, whole: Vec3) -> (Bvh, Vec<u32>) {
        assert!(primitives.len() + first as usize <= MAX_PRIMITIVES, "the caller refuses larger scenes");
        if primitives.is_empty() {
            return (Bvh::empty(), Vec::new());
        }
        let boxes: Vec<Bounded> = primitives
            .iter()
            .map(|primitive| {
                let (min, max) = bounds(primitive);
                Bounded(Aabb::new(min.into(), max.into()))
            })
            .collect();
        let config = BvhBuildParams {
            max_prims_per_leaf: MAX_LEAF,
            collapse_traversal_cost: 1.0,
            ..BvhBuildParams::medium_build()
        };
        let tree = build_bvh2(&boxes, config, &mut Default::default());
        let grid = Grid::new(&tree, whole);
        let mut order = Vec::with_capacity(primitives.len());
        let mut leaf_starts = vec![0u32; tree.nodes.len()];
        number_leaves(&tree, first, &mut order, &mut leaf_starts);

        let node_count = count_nodes(&tree);
        let copies = if node_count * 16 * 8 <= MAX_COPIES_SIZE { 8 } else { 1 };
        let mut nodes = Vec::with_capacity(node_count * copies);
        for octant in 0..copies {
            flatten(&tree, &grid, &leaf_starts, octant as u32, &mut nodes);
        }
        let bvh = Bvh {
            nodes,
            node_count: node_count as u32,
            copies: copies as u32,
            grid_origin: grid.origin,
            grid_step: grid.step,
        };
        (bvh, order)
    }

    /// A tree that no ray hits.
    fn empty() -> Bvh {
        // For each octant an inner node whose near bounds lie behind its far bounds, and whose link leads behind it.
        Bvh {
            nodes: (1..=8).map(|end| [0xffff, 0xffff, 0xffff, end]).collect(),
            node_count: 1,
            copies: 8,
            grid_origin: Vec3::ZERO,
            grid_step: Vec3::ONE,
        }
    }
}

/// Steps by which bounds are rounded outwards beyond their own rounding. They make up for the rounding of the slab test.
const MARGIN: f32 = 1.0;

struct Grid {
    origin: Vec3,
    step: Vec3,
}

impl Grid {
    /// `whole` is the extent of the scene, of which the tree may hold a part: rounding does not shrink with the part.
    fn new(tree: &Bvh2, whole: Vec3) -> Grid {
        let root = tree.nodes[0].aabb;
        let (min, max) = (Vec3::from(root.min), Vec3::from(root.max));
        // Room for the margin on both sides, and some thickness for a flat scene.
        let extent = whole.max(max - min);
        let extent = extent.max(Vec3::splat(extent.max_element().max(1e-6) * 1e-4));
        let step = extent / (65535.0 - 2.0 * (MARGIN + 1.0));
        Grid { origin: min - step * (MARGIN + 1.0), step }
    }

    fn quantize(&self, aabb: &Aabb) -> [(u32, u32); 3] {
        let low = ((Vec3::from(aabb.min) - self.origin) / self.step - MARGIN).floor();
        let high = ((Vec3::from(aabb.max) - self.origin) / self.step + MARGIN).ceil();
        [0, 1, 2].map(|axis| (low[axis].clamp(0.0, 65535.0) as u32, high[axis].clamp(0.0, 65535.0) as u32))
    }
}

/// Calls `visit` for each node that the root reaches, parents first, the first child's subtree before the second's.
fn depth_first(tree: &Bvh2, mut visit: impl FnMut(usize)) {
    let mut stack = vec![0usize];
    while let Some(index) = stack.pop() {
        visit(index);
        let node = &tree.nodes[index];
        if !node.is_leaf() {
            stack.extend([node.first_index as usize + 1, node.first_index as usize]);
        }
    }
}

fn number_leaves(tree: &Bvh2, first_of_all: u32, order: &mut Vec<u32>, starts: &mut [u32]) {
    depth_first(tree, |index| {
        let node = &tree.nodes[index];
        if node.is_leaf() {
            starts[index] = first_of_all + order.len() as u32;
            let first = node.first_index as usize;
            order.extend(&tree.primitive_indices[first..first + node.prim_count as usize]);
        }
    });
}

fn count_nodes(tree: &Bvh2) -> usize {
    let mut count = 0;
    depth_first(tree, |_| count += 1);
    count
}

/// Appends one copy of the tree. Skip links are relative to the start of all copies.
fn flatten(tree: &Bvh2, grid: &Grid, leaf_starts: &[u32], octant: u32, nodes: &mut Vec<[u32; 4]>) {
    enum Step {
        Enter(usize),
        /// The subtree of the flattened node is complete.
        Close(usize),
    }
    let negative = |axis: usize| octant >> axis & 1 == 1;
    let toward = Vec3A::new(
        if negative(0) { -1.0 } else { 1.0 },
        if negative(1) { -1.0 } else { 1.0 },
        if negative(2) { -1.0 } else { 1.0 },
    );
    let mut stack = vec![Step::Enter(0)];
    while let Some(step) = stack.pop() {
        let index = match step {
            Step::Close(flat) => {
                nodes[flat][3] = nodes.len() as u32;
                continue;
            }
            Step::Enter(index) => index,
        };
        let node = &tree.nodes[index];
        let bounds = grid.quantize(&node.aabb);
        let word = |axis: usize| {
            let (low, high) = bounds[axis];
            if negative(axis) { high | low << 16 } else { low | high << 16 }
        };
        let link = if node.is_leaf() { LEAF | leaf_starts[index] << 3 | (node.prim_count - 1) } else { 0 };
        nodes.push([word(0), word(1), word(2), link]);
        if !node.is_leaf() {
            let left = node.first_index as usize;
            let center = |child: usize| tree.nodes[child].aabb.center();
            let left_first = toward.dot(center(left + 1) - center(left)) >= 0.0;
            let (near, far) = if left_first { (left, left + 1) } else { (left + 1, left) };
            stack.extend([Step::Close(nodes.len() - 1), Step::Enter(far), Step::Enter(near)]);
        }
    }
}
