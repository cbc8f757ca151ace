//! The flattened bounding volume hierarchy: nodes of up to four children, walked with a short stack in registers.
//!
//! A step of a walk tests all children of a node, takes the nearest of the inner ones that are hit, leaves the others on the stack and has
//! the primitives of the leaves among them tested. Steps wait for the loads of nodes, so that one load should answer as much as it can;
//! hence the bounds of children are bytes, in a grid of the node's own.
//!
//! Layout of a node, `[u32; 10]`: the lower bounds of the four children in x, y and z (child 0 in the lowest byte), the upper ones; the origin
//! of the node's grid in steps of the tree's (x and y, 16 bits each; z in 16 bits, then the binary logarithms of its own steps in those of the
//! tree, 4 bits for each axis); the index of its first inner child (26 bits) with the kinds of the children 0 and 1 (3 bits each); its first
//! primitive (26 bits) with those of the children 2 and 3. The inner children come first and are contiguous, and so are the primitives of
//! the leaves. A kind is 0: no child, 1 to 6: a leaf with so many primitives, 7: an inner node.
//!
//! The nodes with more than two children, bytes as bounds and primitives in a row are those of Ylitie, Karras and Laine (2017), "Efficient
//! incoherent ray traversal on GPUs through compressed wide BVHs".

use super::layout::{PRIMITIVE_SPHERE, Primitive};
use glam::{UVec3, Vec3};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::{Boundable, BvhBuildParams};

/// Most primitives in a leaf.
const MAX_LEAF: u32 = 6;
/// Kind of a child that is a node.
pub const INNER: u32 = 7;
/// Most children of a node.
const WIDTH: usize = 4;
/// Bits of a kind.
const KIND_BITS: u32 = 3;
/// Bits of the kinds that share a word with an index.
const KINDS_BITS: u32 = 2 * KIND_BITS;
/// Most primitives that a tree can hold, and more than it has nodes.
pub const MAX_PRIMITIVES: usize = 1 << (32 - KINDS_BITS);

/// A node: see the head of this file.
pub type Node = [u32; 10];

/// A flattened tree. The primitives of its leaves are contiguous in the order that [`Bvh::with_order`] returns.
#[derive(Clone, Debug, PartialEq)]
pub struct Bvh {
    /// The root, then the children of each node together.
    pub nodes: Vec<Node>,
    /// Most entries that a walk can have on its stack: nodes with more than one inner child on the way to a node.
    pub stack: u32,
    /// Lower corner of the grid.
    pub grid_origin: Vec3,
    /// Step of the grid.
    pub grid_step: Vec3,
    /// The corner opposite to `grid_origin`, in steps.
    pub size: Vec3,
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
            collapse_traversal_cost: 0.6,
            ..BvhBuildParams::medium_build()
        };
        let tree = build_bvh2(&boxes, config, &mut Default::default());
        let grid = Grid::new(&tree, whole);
        let mut flattened = Flattened { tree: &tree, grid: &grid, nodes: Vec::new(), order: Vec::new(), stack: 0 };
        flattened.build(first);
        let Flattened { nodes, order, stack, .. } = flattened;
        let size = grid.quantize(&tree.nodes[0].aabb).1.as_vec3();
        (Bvh { nodes, stack, grid_origin: grid.origin, grid_step: grid.step, size }, order)
    }

    /// A tree that no ray hits: its root has no children.
    fn empty() -> Bvh {
        Bvh { nodes: vec![[0; 10]], stack: 0, grid_origin: Vec3::ZERO, grid_step: Vec3::ONE, size: Vec3::ZERO }
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

    fn quantize(&self, aabb: &Aabb) -> (UVec3, UVec3) {
        let low = ((Vec3::from(aabb.min) - self.origin) / self.step - MARGIN).floor();
        let high = ((Vec3::from(aabb.max) - self.origin) / self.step + MARGIN).ceil();
        let most = Vec3::splat(65535.0);
        (low.clamp(Vec3::ZERO, most).as_uvec3(), high.clamp(Vec3::ZERO, most).as_uvec3())
    }
}

/// A tree as it is made from one of nodes of two.
struct Flattened<'a> {
    tree: &'a Bvh2,
    grid: &'a Grid,
    nodes: Vec<Node>,
    order: Vec<u32>,
    stack: u32,
}

impl Flattened<'_> {
    fn build(&mut self, first: u32) {
        self.nodes.push([0; 10]);
        // A node that is to be written, the node of two that it comes from, and what is on the stack when a walk comes to it.
        let mut stack = vec![(0usize, 0usize, 0u32)];
        while let Some((place, root, above)) = stack.pop() {
            let children = self.children(root);
            // Inner ones come first.
            let several = children.get(1).is_some_and(|&child| !self.tree.nodes[child].is_leaf());
            let above = above + u32::from(several);
            self.stack = self.stack.max(above);
            let first_inner = self.nodes.len();
            let first_primitive = first + self.order.len() as u32;
            let mut kinds = [0; WIDTH];
            for (kind, &child) in kinds.iter_mut().zip(&children) {
                let node = &self.tree.nodes[child];
                if node.is_leaf() {
                    *kind = node.prim_count;
                    let primitives = node.first_index as usize..(node.first_index + node.prim_count) as usize;
                    self.order.extend(&self.tree.primitive_indices[primitives]);
                } else {
                    *kind = INNER;
                    stack.push((self.nodes.len(), child, above));
                    self.nodes.push([0; 10]);
                }
            }
            self.nodes[place] = self.pack(&children, kinds, first_inner as u32, first_primitive);
        }
    }

    /// Up to four nodes that together hold what a node holds, inner ones first: of what is there, the node with the largest surface is
    /// opened as long as there is room. A root that is a leaf is its own child.
    fn children(&self, root: usize) -> Vec<usize> {
        let mut children = vec![root];
        while children.len() < WIDTH {
            let inner = (0..children.len()).filter(|&k| !self.tree.nodes[children[k]].is_leaf());
            let area = |k: &usize| self.tree.nodes[children[*k]].aabb.half_area();
            let Some(largest) = inner.max_by(|one, two| area(one).total_cmp(&area(two))) else { break };
            let left = self.tree.nodes[children.swap_remove(largest)].first_index as usize;
            children.extend([left, left + 1]);
        }
        children.sort_by_key(|&child| self.tree.nodes[child].is_leaf());
        children
    }

    fn pack(&self, children: &[usize], kinds: [u32; WIDTH], first_inner: u32, first_primitive: u32) -> Node {
        let bounds: Vec<_> = children.iter().map(|&child| self.grid.quantize(&self.tree.nodes[child].aabb)).collect();
        let origin = bounds.iter().fold(UVec3::MAX, |least, (low, _)| least.min(*low));
        let end = bounds.iter().fold(UVec3::ZERO, |most, (_, high)| most.max(*high));
        // The least shift with which the extent fits into a byte, rounded up.
        let fits = |extent: u32, shift: &u32| extent.div_ceil(1 << shift) <= 255;
        let shift = (end - origin)
            .to_array()
            .map(|extent| (0..16).find(|shift| fits(extent, shift)).expect("16 bits fit, shifted by 9"));
        let mut node = [0; 10];
        for (slot, (low, high)) in bounds.iter().enumerate() {
            for axis in 0..3 {
                let step = 1u32 << shift[axis];
                node[axis] |= ((low[axis] - origin[axis]) / step) << (8 * slot);
                node[3 + axis] |= (high[axis] - origin[axis]).div_ceil(step) << (8 * slot);
            }
        }
        node[6] = origin.x | origin.y << 16;
        node[7] = origin.z | shift[0] << 16 | shift[1] << 20 | shift[2] << 24;
        node[8] = first_inner << KINDS_BITS | kinds[1] << KIND_BITS | kinds[0];
        node[9] = first_primitive << KINDS_BITS | kinds[3] << KIND_BITS | kinds[2];
        node
    }
}
