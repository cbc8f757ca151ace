//! Triangles of one surface, with a hierarchy that finds those near a place, and tests of how two triangles meet.

use glam::DVec3;

use crate::scene::Mesh;

/// The triangles of a mesh that have an area.
pub(super) struct Triangles {
    /// Corners in world space.
    pub corners: Vec<[DVec3; 3]>,
    /// Unit normal of each.
    pub normals: Vec<DVec3>,
    /// Bounds of all.
    pub bounds: Bounds,
    nodes: Vec<Node>,
    /// Indices into `corners`, in the order of the leaves.
    order: Vec<u32>,
}

/// An axis-aligned box: lower and upper corner.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub low: DVec3,
    pub high: DVec3,
}

impl Bounds {
    /// Bounds of some points.
    pub fn of(points: impl IntoIterator<Item = DVec3>) -> Bounds {
        let empty = Bounds { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };
        points.into_iter().fold(empty, |all, p| Bounds { low: all.low.min(p), high: all.high.max(p) })
    }

    /// The box that is larger by `margin` on each side.
    pub fn grown(self, margin: f64) -> Bounds {
        Bounds { low: self.low - margin, high: self.high + margin }
    }

    /// Whether two boxes have a point in common.
    pub fn meets(&self, other: &Bounds) -> bool {
        self.low.cmple(other.high).all() && other.low.cmple(self.high).all()
    }

    /// The longest side.
    pub fn extent(&self) -> f64 {
        (self.high - self.low).max_element()
    }
}

/// A node of the hierarchy; its left child follows it.
struct Node {
    bounds: Bounds,
    /// The right child of an inner node, the first entry of `order` of a leaf.
    link: u32,
    /// Triangles of a leaf; 0 is an inner node.
    count: u32,
}

const LEAF: usize = 4;

impl Triangles {
    /// Those of a mesh.
    pub fn of(mesh: &Mesh) -> Triangles {
        let mut corners = Vec::with_capacity(mesh.triangles.len());
        let mut normals = Vec::with_capacity(mesh.triangles.len());
        for triangle in &mesh.triangles {
            let normal = super::normal_of(mesh, triangle).normalize_or_zero();
            if normal != DVec3::ZERO {
                corners.push(triangle.map(|corner| mesh.positions[corner as usize]));
                normals.push(normal);
            }
        }
        let boxes: Vec<Bounds> = corners.iter().map(|corners| Bounds::of(*corners)).collect();
        let mut order: Vec<u32> = (0..corners.len() as u32).collect();
        let mut nodes = Vec::with_capacity(corners.len());
        if !order.is_empty() {
            build(&boxes, &mut order, 0, &mut nodes);
        }
        let bounds = Bounds::of(corners.iter().flatten().copied());
        Triangles { corners, normals, bounds, nodes, order }
    }

    /// Calls `visit` with each triangle whose bounds meet a box, until it returns `true`.
    pub fn near(&self, bounds: &Bounds, mut visit: impl FnMut(usize) -> bool) {
        let mut stack = vec![0];
        while let Some(index) = stack.pop() {
            let Some(node) = self.nodes.get(index) else { return };
            if !node.bounds.meets(bounds) {
                continue;
            }
            if node.count == 0 {
                stack.extend([node.link as usize, index + 1]);
                continue;
            }
            let first = node.link as usize;
            for &triangle in &self.order[first..first + node.count as usize] {
                if visit(triangle as usize) {
                    return;
                }
            }
        }
    }

    /// Whether a point is nearer than `distance` to a triangle.
    pub fn is_near(&self, point: DVec3, distance: f64) -> bool {
        let mut near = false;
        self.near(&Bounds::of([point]).grown(distance), |triangle| {
            near = nearest(point, &self.corners[triangle]).distance(point) <= distance;
            near
        });
        near
    }
}

/// Splits at the median of the centroids, along the longest side of the box.
fn build(boxes: &[Bounds], order: &mut [u32], first: usize, nodes: &mut Vec<Node>) {
    let bounds = Bounds::of(order.iter().flat_map(|&k| [boxes[k as usize].low, boxes[k as usize].high]));
    let index = nodes.len();
    nodes.push(Node { bounds, link: first as u32, count: order.len() as u32 });
    if order.len() <= LEAF {
        return;
    }
    let size = bounds.high - bounds.low;
    let axis = (0..3).max_by(|&a, &b| size[a].total_cmp(&size[b])).unwrap_or(0);
    let middle = order.len() / 2;
    let center = |k: u32| boxes[k as usize].low[axis] + boxes[k as usize].high[axis];
    order.select_nth_unstable_by(middle, |&a, &b| center(a).total_cmp(&center(b)).then(a.cmp(&b)));
    let (left, right) = order.split_at_mut(middle);
    build(boxes, left, first, nodes);
    nodes[index].link = nodes.len() as u32;
    nodes[index].count = 0;
    build(boxes, right, first + middle, nodes);
}

/// How two triangles meet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Meeting {
    /// Not at all.
    Apart,
    /// No deeper than the tolerance, or along a border of one of the two.
    Touching,
    /// An edge of one goes through the middle of the other, here.
    Crossing(DVec3),
}

/// How two triangles with unit normals meet. Depths and distances up to `tolerance` count as none.
pub(super) fn meeting(a: (&[DVec3; 3], DVec3), b: (&[DVec3; 3], DVec3), tolerance: f64) -> Meeting {
    let mut touching = false;
    for ((edges, _), (face, normal)) in [(a, b), (b, a)] {
        let heights = edges.map(|corner| normal.dot(corner - face[0]));
        if heights.iter().all(|h| *h > tolerance) || heights.iter().all(|h| *h < -tolerance) {
            return Meeting::Apart;
        }
        for (from, to) in [(0, 1), (1, 2), (2, 0)] {
            let (h0, h1) = (heights[from], heights[to]);
            if h0.min(h1) >= -tolerance || h0.max(h1) <= tolerance {
                touching |= h0.abs().min(h1.abs()) <= tolerance;
                continue;
            }
            let point = edges[from].lerp(edges[to], h0 / (h0 - h1));
            let depth = depth_in(point, face, normal);
            if depth > tolerance {
                return Meeting::Crossing(point);
            }
            touching |= depth >= -tolerance;
        }
    }
    if touching { Meeting::Touching } else { Meeting::Apart }
}

/// Distance from a point in the plane of a triangle to its border, positive inside.
fn depth_in(point: DVec3, face: &[DVec3; 3], normal: DVec3) -> f64 {
    [(0, 1), (1, 2), (2, 0)]
        .map(|(from, to)| normal.cross(face[to] - face[from]).normalize_or_zero().dot(point - face[from]))
        .into_iter()
        .fold(f64::INFINITY, f64::min)
}

/// The point of a triangle that is nearest to `point`: its projection, or the nearest of those on the edges.
pub(super) fn nearest(point: DVec3, triangle: &[DVec3; 3]) -> DVec3 {
    let [a, b, c] = *triangle;
    let normal = (b - a).cross(c - a).normalize_or_zero();
    if normal != DVec3::ZERO && depth_in(point, triangle, normal) >= 0.0 {
        return point - normal * normal.dot(point - a);
    }
    let on_edge = |from: DVec3, to: DVec3| {
        let edge = to - from;
        let length = edge.length_squared();
        from + edge * if length > 0.0 { ((point - from).dot(edge) / length).clamp(0.0, 1.0) } else { 0.0 }
    };
    [on_edge(a, b), on_edge(b, c), on_edge(c, a)]
        .into_iter()
        .min_by(|p, q| p.distance_squared(point).total_cmp(&q.distance_squared(point)))
        .expect("a triangle has three edges")
}
