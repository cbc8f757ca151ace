//! Rays against primitives and the walk through the hierarchy: the kernels against the reference, and closed meshes
//! that must not leak.

mod common;

use common::random::Random;
use common::scenes;
use common::tolerances::comparison;
use common::units::{run, run_variant, variant, vec4, widen};
use glam::{DMat4, DVec2, DVec3};
use tyndall::gpu::shader::Variant;
use tyndall::pack::features::Features;
use tyndall::reference::ray;
use tyndall::scene::{Geometry, Mesh, Scene, Shape};

#[test]
fn rays_meet_triangles_and_spheres() {
    let mut random = Random(6);
    let mut inputs = Vec::new();
    for k in 0..6000 {
        // Of any size, anywhere; some are needles.
        let scale = random.log_between(1e-6, 1e6);
        let thin = if k % 5 == 0 { 1e-3 } else { 1.0 };
        let [a, b] = [random.in_cube() * scale, random.in_cube() * scale];
        let c = a + (b - a) * 0.4 + random.in_cube() * scale * thin;
        let [a, b, c] = [a, b, c].map(|p| p.as_vec3().as_dvec3());
        let origin = (random.in_cube() * scale * 3.0).as_vec3().as_dvec3();
        let target = if k % 2 == 0 { a * 0.3 + b * 0.3 + c * 0.4 } else { random.in_cube() * scale };
        let direction = (target - origin).normalize();
        let (center, radius) = (random.in_cube() * scale, random.between(0.1, 1.0) * scale);
        inputs.extend([vec4(&origin.to_array()), vec4(&direction.to_array())]);
        inputs.extend([a, b, c].map(|p| vec4(&p.to_array())));
        inputs.push(vec4(&[center.x, center.y, center.z, radius]));
    }
    let count = inputs.len() / 6;
    let outputs: Vec<[f32; 4]> = run("ray", &inputs, &[], count, 2 * count);
    let mut t = comparison("intersect_triangle t");
    let mut barycentric = comparison("intersect_triangle barycentric");
    let mut sphere = comparison("intersect_sphere");
    let (mut hits, mut close) = (0, 0);
    for (input, output) in inputs.chunks(6).zip(outputs.chunks(2)) {
        let [origin, direction, a, b, c] = [0, 1, 2, 3, 4].map(|k| widen(&input[k][..3]));
        let seen = ray::Ray::new(origin, direction);
        let hit = ray::intersect_triangle(&seen, a, b, c);
        // Rounding decides what lies within it of an edge, and what is seen from the side.
        let size = (b - a).length().max((c - a).length());
        let reach = (a - origin).length() + size;
        let normal = (b - a).cross(c - a);
        let height = normal.length() / size;
        let grazing = normal.normalize().dot(direction).abs();
        let DVec2 { x, y } = hit.barycentric;
        let inside = x.min(y).min(1.0 - x - y);
        if inside.abs() * height * grazing < 1e-5 * reach {
            close += 1;
        } else {
            assert_eq!(output[0][0] == 1.0, hit.hit, "{input:?}");
            if hit.hit {
                hits += 1;
                assert_eq!(output[0][1] == 1.0, hit.along_normal, "{input:?}");
                // Well seen: the error of the distance grows with the slant and with how thin the triangle is.
                if height * grazing > 0.05 * reach {
                    t.scalar(format!("{input:?}"), output[0][2], hit.t);
                    barycentric.scalar(format!("{input:?}"), output[1][0], x);
                    barycentric.scalar(format!("{input:?}"), output[1][1], y);
                }
            }
        }
        let (center, radius) = (widen(&input[5][..3]), f64::from(input[5][3]));
        let ends = ray::intersect_sphere(&seen, center, radius);
        // Where the ray passes at less than .95 of the radius; near the rim the distance has half the digits.
        if ends.y - ends.x > 0.6 * radius && ends.x.abs().min(ends.y.abs()) > 0.05 * ends.x.abs().max(ends.y.abs()) {
            sphere.scalar(format!("{input:?}"), output[1][2], ends.x);
            sphere.scalar(format!("{input:?}"), output[1][3], ends.y);
        }
    }
    assert!(hits > 1000 && close < count / 5, "{hits} hits, {close} of {count} are too close to call");
    t.finish();
    barycentric.finish();
    sphere.finish();
}

#[test]
fn a_grazing_ray_meets_a_sphere_near_where_it_should() {
    // The ray passes at (1 − d) R: half the chord is R √(2 d − d²), for d down to the resolution of single precision.
    let mut inputs = Vec::new();
    let distances: Vec<f64> = (1..=23).map(|k| f64::powi(0.5, k)).collect();
    for d in &distances {
        inputs.extend([vec4(&[1.0 - d, 0.0, -2.0]), vec4(&[0.0, 0.0, 1.0])]);
        inputs.extend([[0.0; 4], [0.0; 4], [0.0; 4], vec4(&[0.0, 0.0, 0.0, 1.0])]);
    }
    let outputs: Vec<[f32; 4]> = run("ray", &inputs, &[], distances.len(), 2 * distances.len());
    let mut sphere = comparison("intersect_sphere");
    for (d, output) in distances.iter().zip(outputs.chunks(2)) {
        let half = (d * (2.0 - d)).sqrt();
        sphere.scalar(d, output[1][2], 2.0 - half);
        sphere.scalar(d, output[1][3], 2.0 + half);
    }
    sphere.finish();
}

/// Rays in general position, before those through corners and edges, which may pass by an edge of the outline.
const GENERAL: usize = 6000;

/// The tables of a closed mesh, and rays that a walk through it should answer.
struct Walks {
    packed: tyndall::pack::Packed,
    /// Origin, direction; in the coordinates of the tables.
    rays: Vec<[DVec3; 2]>,
    /// From inside or from outside?
    inside: Vec<bool>,
}

impl Walks {
    /// Rays in general position, and rays exactly through corners and edges, from outside and from the centre.
    fn new(mesh: Mesh, seed: u64) -> Walks {
        let mut scene: Scene = scenes::gray_box();
        scene.shapes = vec![Shape::diffuse("mesh", Geometry::Mesh(mesh), DVec3::ONE)];
        let packed = scenes::pack(&scene, 1).with_immediates(0);
        let mut random = Random(seed);
        let (mut rays, mut inside) = (Vec::new(), Vec::new());
        let mut add = |origin: DVec3, direction: DVec3, from_inside| {
            rays.push([origin.as_vec3().as_dvec3(), direction.as_vec3().as_dvec3()]);
            inside.push(from_inside);
        };
        for _ in 0..GENERAL / 2 {
            let origin = random.direction() * 3.0;
            add(origin, (random.in_cube() - origin).normalize(), false);
            add(DVec3::ZERO, random.direction(), true);
        }
        for primitive in &packed.primitives {
            let [a, b, c] = [primitive.a, primitive.b, primitive.c].map(|p| p.as_dvec3());
            for target in [a, b, c, (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0, (a + b + c) / 3.0] {
                let origin = random.direction() * 3.0;
                add(origin, (target - origin).normalize(), false);
                add(DVec3::ZERO, target.normalize(), true);
                add(target * 3.0, -target.normalize(), false);
                // Along an axis the projection is exact, so the edge function of a corner or a middle is exactly 0.
                for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
                    add(target - axis * (4.0 + target.dot(axis)), axis, false);
                    add(target + axis * (4.0 - target.dot(axis)), -axis, false);
                }
            }
        }
        Walks { packed, rays, inside }
    }

    fn run(&self) -> Vec<[f32; 4]> {
        let features = Features { walk_stack: self.packed.bvh.stack, ..variant().features };
        let rays = self.rays.iter();
        let inputs: Vec<[f32; 4]> =
            rays.flat_map(|[o, d]| [vec4(&[o.x, o.y, o.z, 100.0]), vec4(&d.to_array())]).collect();
        let tables: [&[u8]; 3] = [
            bytemuck::cast_slice(&self.packed.bvh.nodes),
            bytemuck::cast_slice(&self.packed.primitives),
            bytemuck::bytes_of(&self.packed.params),
        ];
        run_variant("bvh", &Variant { features, ..variant() }, &inputs, &tables, self.rays.len(), self.rays.len())
    }
}

/// Counts rays that leave a closed mesh other than they should: as often as they enter it, once more if they begin
/// inside.
fn leaks(outputs: &[[f32; 4]], inside: &[bool]) -> usize {
    let right = |(output, inside): (&[f32; 4], &bool)| output[3] == if *inside { 1.0 } else { 0.0 };
    outputs.iter().zip(inside).filter(|pair| !right(*pair)).count()
}

fn octahedron() -> Mesh {
    let positions = vec![DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y, DVec3::Z, -DVec3::Z];
    let mut triangles = Vec::new();
    for (x, y, z) in [(0, 2, 4), (0, 2, 5), (0, 3, 4), (0, 3, 5), (1, 2, 4), (1, 2, 5), (1, 3, 4), (1, 3, 5)] {
        let even = (x % 2 + y % 2 + z % 2) % 2 == 0;
        triangles.push(if even { [x, y, z] } else { [x, z, y] });
    }
    Mesh { positions, triangles, ..Mesh::default() }
}

#[test]
fn walks_find_the_nearest_triangle_and_never_leak() {
    let Geometry::Mesh(cube) = scenes::cuboid(DMat4::IDENTITY) else { unreachable!("a cuboid is a mesh") };
    for (name, mesh) in [("cube", cube), ("octahedron", octahedron()), ("icosphere", scenes::icosphere(3))] {
        let walks = Walks::new(mesh, 7);
        let outputs = walks.run();
        let mut nearest = comparison("nearest hit");
        for (k, ([origin, direction], output)) in walks.rays.iter().zip(&outputs).enumerate() {
            // By trying all triangles, in double precision.
            let seen = ray::Ray::new(*origin, *direction);
            let hits = walks.packed.primitives.iter().filter_map(|primitive| {
                let [a, b, c] = [primitive.a, primitive.b, primitive.c].map(|p| p.as_dvec3());
                let hit = ray::intersect_triangle(&seen, a, b, c);
                let normal = (b - a).cross(c - a).normalize();
                (hit.hit && hit.t > 0.0).then_some((hit.t, normal.dot(*direction).abs()))
            });
            // A ray near a rim hits or misses, and near an edge hits one or the other side, by rounding; neighbours
            // differ by up to .2 in their cosine, and the distance to one that is seen from the side has fewer digits.
            if let Some((t, cosine)) = hits.min_by(|one, two| one.0.total_cmp(&two.0))
                && cosine > 0.3
                && (k < GENERAL || output[1].to_bits() != u32::MAX)
            {
                nearest.scalar(format!("{origin}, {direction}"), output[0], t);
            }
        }
        nearest.finish();
        let leaks = leaks(&outputs, &walks.inside);
        assert_eq!(leaks, 0, "{name}: rays leak, of {}", outputs.len());
    }
}

/// Triangles that shrink towards a point, as far as the bounds' grid tells them apart: a deep tree.
fn shrinking() -> Mesh {
    let mut mesh = Mesh::default();
    let mut random = Random(11);
    for k in 0..400u32 {
        let size = 0.98_f64.powi(k as i32);
        let first = mesh.positions.len() as u32;
        mesh.positions.extend([0; 3].map(|_| DVec3::splat(size) + random.in_cube() * 0.3 * size));
        mesh.triangles.push([first, first + 1, first + 2]);
    }
    mesh
}

#[test]
fn the_tree_misses_nothing() {
    for (name, mesh) in [("icosphere", scenes::icosphere(2)), ("shrinking triangles", shrinking())] {
        let mut walks = Walks::new(mesh, 8);
        let outputs = walks.run();
        let crossings: f32 = outputs.iter().map(|output| output[2]).sum();
        assert!(crossings > 1000.0, "{name}: {crossings} crossings prove little");
        // The same where all bounds are as wide as can be: every ray tries every triangle.
        let bounds = walks.packed.bvh.nodes.clone();
        for node in &mut walks.packed.bvh.nodes {
            *node = [0, 0, 0, !0, !0, !0, 0, 0x0fff_0000, node[8], node[9]];
        }
        let exhaustive = walks.run();
        let differ = |others: &[[f32; 4]]| {
            let pairs = exhaustive.iter().zip(others);
            pairs.filter(|(a, b)| (a[0], a[2], a[3]) != (b[0], b[2], b[3])).count()
        };
        assert_eq!(differ(&outputs), 0, "{name}: rays that the tree answers otherwise");
        // With all children on it, a stack that is too small loses some.
        let stack = std::mem::replace(&mut walks.packed.bvh.stack, 1);
        assert!(differ(&walks.run()) > 0, "{name}: a stack of one entry goes unseen");
        walks.packed.bvh.stack = stack;
        // So does a bound that cuts off a half.
        walks.packed.bvh.nodes = bounds;
        let root = &mut walks.packed.bvh.nodes[0];
        root[3] = (root[3] & !0xff) | ((root[3] & 0xff) / 2);
        assert!(differ(&walks.run()) > 0, "{name}: a bound that cuts off a part goes unseen");
    }
    // Without a hole there is no leak, with one there is: the counter is not blind.
    let mut open = scenes::icosphere(3);
    open.triangles.truncate(open.triangles.len() - 5);
    let open = Walks::new(open, 8);
    assert!(leaks(&open.run(), &open.inside) > 0, "a mesh with holes must leak");
}
