//! Primitives that are part of the kernel itself.
//!
//! Every ray meets the walls of a room, or is tested against them, so a tree only delays it. The largest primitives stand as constants in
//! the kernel and are tested by all rays in step, without a load; the tree holds the rest. A scene of a few primitives has no tree.
//! Corners that primitives share are projected once, since the compiler sees that it is the same computation.

use super::bvh::{bounds, bounds_of_all};
use super::layout::{PRIMITIVE_SPHERE, Primitive};
use glam::Vec3;

/// Most primitives in a kernel: each costs every ray about as much as a step through the tree.
pub const MOST: usize = 24;
/// A primitive is worth a constant test where this share of all lines through the scene meets its bounds (Cauchy: surface areas).
const LEAST_SHARE: f32 = 0.02;

/// Orders primitives so that those for the kernel, at most `most`, come first. Returns their indices in the new order, and how many go into the kernel.
pub fn order(primitives: &[Primitive], most: usize) -> (Vec<u32>, usize) {
    let all = 0..primitives.len() as u32;
    let few = primitives.len() <= most;
    let whole = half_area(bounds_of_all(primitives));
    let share = |index: u32| half_area(bounds(&primitives[index as usize])) / whole;
    let mut large: Vec<u32> = all
        .clone()
        .filter(|&index| (few || share(index) >= LEAST_SHARE) && is_broad(&primitives[index as usize]))
        .collect();
    large.sort_by(|&a, &b| share(b).total_cmp(&share(a)).then(a.cmp(&b)));
    large.truncate(most);
    large.sort_unstable();
    let mut chosen = vec![false; primitives.len()];
    for &index in &large {
        chosen[index as usize] = true;
    }
    let count = large.len();
    large.extend(all.filter(|&index| !chosen[index as usize]));
    (large, count)
}

/// Whether rays seldom pass exactly through an edge, as they do if a triangle is a line.
fn is_broad(primitive: &Primitive) -> bool {
    let Primitive { a, b, c, surface, .. } = *primitive;
    let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
    surface & PRIMITIVE_SPHERE != 0 || (b - a).cross(c - a).length() > 1e-4 * longest
}

fn half_area((min, max): (Vec3, Vec3)) -> f32 {
    let side = max - min;
    side.x * side.y + side.y * side.z + side.z * side.x
}

/// The text of `immediates.glsl`: a function that tests all of them. Corners are projected and edges computed once, however many triangles
/// share them. A ray that an edge passes through exactly is tested again by the general rule for edges.
pub fn glsl(primitives: &[Primitive]) -> String {
    let mut corners: Vec<Vec3> = Vec::new();
    let mut edges: Vec<(usize, usize)> = Vec::new();
    let (mut projections, mut tests) = (String::new(), String::new());
    for (index, primitive) in primitives.iter().enumerate() {
        let Primitive { a, surface, b, light, c, sigma_t_step } = *primitive;
        let constant =
            format!("Primitive({}, {surface}u, {}, {light}u, {}, {})", vec3(a), vec3(b), vec3(c), number(sigma_t_step));
        if surface & PRIMITIVE_SPHERE != 0 {
            tests += &format!("    test_primitive(path, ray, {index}u, {constant}, hit);\n");
            continue;
        }
        let [i, j, k] = [a, b, c].map(|corner| {
            corners.iter().position(|&known| known == corner).unwrap_or_else(|| {
                corners.push(corner);
                let n = corners.len() - 1;
                projections += &format!("    precise vec3 r{n} = {} - ray.origin;\n", vec3(corner));
                projections +=
                    &format!("    precise vec2 p{n} = vec2(dot(ray.tangent, r{n}), dot(ray.bitangent, r{n}));\n");
                projections += &format!("    float along{n} = dot(ray.direction, r{n});\n");
                n
            })
        });
        // The function of an edge changes its sign, and nothing else, with the edge's direction.
        let [u, v, w] = [(j, k), (k, i), (i, j)].map(|(from, to)| {
            let (edge, sign) = if from < to { ((from, to), "") } else { ((to, from), "-") };
            let n = edges.iter().position(|&known| known == edge).unwrap_or_else(|| {
                edges.push(edge);
                let (n, (i, j)) = (edges.len() - 1, edge);
                projections += &format!("    precise float edge{n} = p{i}.x * p{j}.y - p{i}.y * p{j}.x;\n");
                n
            });
            format!("{sign}edge{n}")
        });
        tests += &format!(
            "    test_projected(path, {index}u, {constant}, vec3({u}, {v}, {w}), \
             vec3(along{i}, along{j}, along{k}), hit, doubt);\n"
        );
    }
    format!(
        "void test_immediates(Path path, Ray ray, inout Hit hit) {{\n    Hit before = hit;\n    bool doubt = false;\n\
         {projections}{tests}    if (doubt) {{\n        hit = before;\n        \
         [[dont_unroll]] for (uint i = 0u; i < {count}u; ++i) {{\n            \
         test_primitive(path, ray, i, PRIMITIVE(i), hit);\n        }}\n    }}\n}}\n",
        count = primitives.len()
    )
}

fn vec3(v: Vec3) -> String {
    format!("vec3({}, {}, {})", number(v.x), number(v.y), number(v.z))
}

/// A literal that is read as just this number: the shortest decimals that single precision tells from its neighbours.
fn number(value: f32) -> String {
    format!("{value:e}")
}
