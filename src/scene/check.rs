//! What is doubtful about a scene: faults that no reader can refuse, since a scene with them is complete, but its picture
//! is hardly the one that was meant.

use std::collections::HashMap;

use glam::DVec3;

use super::{Boundary, Geometry, MediumId, Mesh, Scene, Shape};

mod crossings;
mod triangles;

/// All doubts, each a sentence that names the shape. Takes O(n log n) for n triangles, without allocating more than a few
/// words for each.
///
/// - any mesh: triangles that are there twice, triangles without area, shading normals that look to the other side;
/// - boundaries of media: holes, neighbouring triangles with opposite orientation, normals that point inwards, an
///   exterior that is named but is not what lies around the boundary, and boundaries that cross each other or themselves.
pub fn doubts(scene: &Scene) -> Vec<String> {
    let mut doubts = Vec::new();
    for shape in &scene.shapes {
        match &shape.geometry {
            Geometry::Mesh(mesh) => mesh_doubts(shape, mesh, &mut doubts),
            Geometry::Sphere { flipped: true, .. } if shape.boundary.is_some() => doubts.push(inside_out(shape)),
            Geometry::Sphere { .. } => {}
        }
    }
    contradictions(scene, &mut doubts);
    doubts.extend(crossings::doubts(scene));
    doubts
}

/// For each shape that is a boundary: the smallest boundary around it, by geometry, as an index into [`Scene::shapes`]; asked
/// just outside of its first triangle. `None` for the others, and for those that nothing encloses. A parent has the larger
/// bounds, so even where boundaries overlap this is a tree.
pub fn parents(scene: &Scene) -> Vec<Option<usize>> {
    let mut enclosing = Enclosing::default();
    let parent = |(index, shape): (usize, &Shape)| {
        shape.boundary?;
        let around = enclosing.innermost(scene, *probes(&shape.geometry).first()?, Some(index))?;
        let [own, parents] = [index, around].map(|index| {
            let (low, high) = bounds(&scene.shapes[index].geometry);
            ((high - low).element_product(), index)
        });
        (own < parents).then_some(around)
    };
    scene.shapes.iter().enumerate().map(parent).collect()
}

/// The smallest boundary around the camera, as an index into [`Scene::shapes`].
pub fn around_camera(scene: &Scene) -> Option<usize> {
    Enclosing::default().innermost(scene, scene.camera.to_world.w_axis.truncate(), None)
}

/// Whether every edge of a mesh belongs to as many triangles on one side as on the other; seams of texture coordinates do
/// not count.
pub fn is_closed(mesh: &Mesh) -> bool {
    let places = weld(mesh);
    let triangles: Vec<[u32; 3]> = mesh.triangles.iter().map(|t| t.map(|corner| places[corner as usize])).collect();
    let edges = Edges::of(triangles.iter().filter(|&&[a, b, c]| a != b && b != c && c != a));
    edges.open == 0 && edges.inconsistent == 0
}

fn mesh_doubts(shape: &Shape, mesh: &Mesh, doubts: &mut Vec<String>) {
    let name = &shape.name;
    let places = weld(mesh);
    let triangles: Vec<[u32; 3]> = mesh.triangles.iter().map(|t| t.map(|corner| places[corner as usize])).collect();
    // A triangle with two corners in one place is none; its edges would show holes where there are none.
    let solid = |&[a, b, c]: &[u32; 3]| a != b && b != c && c != a;
    let flat = |triangle: &[u32; 3]| normal_of(mesh, triangle) == DVec3::ZERO;
    let degenerate = triangles.iter().zip(&mesh.triangles).filter(|(t, original)| !solid(t) || flat(original)).count();
    if degenerate > 0 {
        doubts.push(format!("\"{name}\" has {degenerate} triangles without area"));
    }

    let mut sorted: Vec<[u32; 3]> = triangles
        .iter()
        .filter(|triangle| solid(triangle))
        .map(|triangle| {
            let mut corners = *triangle;
            corners.sort_unstable();
            corners
        })
        .collect();
    sorted.sort_unstable();
    let twice = sorted.windows(2).filter(|pair| pair[0] == pair[1]).count();
    if twice > 0 {
        doubts.push(format!("\"{name}\" has {twice} triangles that lie exactly on another one"));
    }

    if !mesh.normals.is_empty() {
        let away = |t: &&[u32; 3]| t.iter().any(|&corner| mesh.normals[corner as usize].dot(normal_of(mesh, t)) < 0.0);
        let away = mesh.triangles.iter().filter(away).count();
        if away > 0 {
            doubts.push(format!("\"{name}\" has {away} triangles with a shading normal on their other side"));
        }
    }

    if shape.boundary.is_none() {
        return;
    }
    let edges = Edges::of(triangles.iter().filter(|triangle| solid(triangle)));
    let place = |vertex: u32| mesh.positions[vertex as usize];
    if let Some((a, b)) = edges.first_open {
        doubts.push(format!(
            "\"{name}\" is the boundary of a medium but is not closed: {} edges belong to an odd number of triangles, the \
             first from {} to {}",
            edges.open,
            place(a),
            place(b)
        ));
    }
    if let Some((a, b)) = edges.first_inconsistent {
        doubts.push(format!(
            "\"{name}\" is the boundary of a medium but its triangles are not oriented alike: at {} edges front meets back, \
             the first from {} to {}",
            edges.inconsistent,
            place(a),
            place(b)
        ));
    }
    if edges.open == 0 && edges.inconsistent == 0 && signed_volume(mesh) < 0.0 {
        doubts.push(inside_out(shape));
    }
}

fn inside_out(shape: &Shape) -> String {
    format!(
        "\"{}\" is the boundary of a medium but its normals point inwards, so its interior medium is outside of it",
        shape.name
    )
}

/// For each vertex the one that stands for all in its place: seams of texture coordinates are no holes.
fn weld(mesh: &Mesh) -> Vec<u32> {
    // Adding 0 makes one zero of the two.
    let key = |p: DVec3| (p + DVec3::ZERO).to_array().map(f64::to_bits);
    let mut order: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    let keys: Vec<[u64; 3]> = mesh.positions.iter().map(|p| key(*p)).collect();
    order.sort_unstable_by_key(|&vertex| (keys[vertex as usize], vertex));
    let mut places = vec![0; keys.len()];
    let mut first = 0;
    for &vertex in &order {
        if keys[first as usize] != keys[vertex as usize] || vertex == order[0] {
            first = vertex;
        }
        places[vertex as usize] = first;
    }
    places
}

/// Normal of a triangle, of no particular length; zero if it has no area. Edges are scaled so that nothing underflows.
fn normal_of(mesh: &Mesh, triangle: &[u32; 3]) -> DVec3 {
    let [a, b, c] = triangle.map(|corner| mesh.positions[corner as usize]);
    let size = (b - a).abs().max((c - a).abs()).max_element();
    if size > 0.0 { ((b - a) / size).cross((c - a) / size) } else { DVec3::ZERO }
}

/// Volume that the normals enclose (the divergence theorem), about the first corner, in units of the mesh's size cubed.
fn signed_volume(mesh: &Mesh) -> f64 {
    let Some(origin) = mesh.triangles.first().map(|triangle| mesh.positions[triangle[0] as usize]) else { return 0.0 };
    let size = mesh.positions.iter().fold(0.0, |size: f64, p| size.max((*p - origin).abs().max_element()));
    let corner = |index: u32| (mesh.positions[index as usize] - origin) / size;
    mesh.triangles.iter().map(|&[a, b, c]| corner(a).dot(corner(b).cross(corner(c)))).sum()
}

/// How triangles meet at edges.
#[derive(Default)]
struct Edges {
    /// Edges of an odd number of triangles.
    open: usize,
    first_open: Option<(u32, u32)>,
    /// Edges that are passed more often in one direction than in the other, by an even number of triangles.
    inconsistent: usize,
    first_inconsistent: Option<(u32, u32)>,
}

impl Edges {
    fn of<'a>(triangles: impl Iterator<Item = &'a [u32; 3]>) -> Edges {
        let mut directed: Vec<(u32, u32, bool)> = triangles
            .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
            .map(|(from, to)| (from.min(to), from.max(to), from < to))
            .collect();
        directed.sort_unstable();
        let mut edges = Edges::default();
        for edge in directed.chunk_by(|one, other| (one.0, one.1) == (other.0, other.1)) {
            let (count, upwards) = (edge.len(), edge.iter().filter(|(_, _, upwards)| *upwards).count());
            let ends = (edge[0].0, edge[0].1);
            if count % 2 == 1 {
                edges.open += 1;
                edges.first_open.get_or_insert(ends);
            } else if 2 * upwards != count {
                edges.inconsistent += 1;
                edges.first_inconsistent.get_or_insert(ends);
            }
        }
        edges
    }
}

/// Triangles of a shape that are asked for what lies outside of them.
const PROBES: usize = 5;

/// Boundaries whose `exterior` is not the medium that geometry finds around them.
fn contradictions(scene: &Scene, doubts: &mut Vec<String>) {
    let eye = scene.camera.to_world.w_axis.truncate();
    let mut enclosing = Enclosing::default();
    // Inside a boundary the camera's medium only repeats what that boundary says.
    let world = if enclosing.innermost(scene, eye, None).is_some() { None } else { scene.camera.medium };
    for (index, shape) in scene.shapes.iter().enumerate() {
        let Some(Boundary { exterior: Some(named), .. }) = shape.boundary else { continue };
        let found: Vec<(Option<usize>, Option<MediumId>)> = probes(&shape.geometry)
            .into_iter()
            .map(|probe| match enclosing.innermost(scene, probe, Some(index)) {
                Some(around) => (Some(around), scene.shapes[around].boundary.and_then(|boundary| boundary.interior)),
                None => (None, world),
            })
            .collect();
        // A boundary that overlaps others lies in several media; that is another doubt.
        let Some(&(around, medium)) = found.first() else { continue };
        if found.iter().any(|(_, medium)| *medium == Some(named)) {
            continue;
        }
        let name_of = |medium: Option<MediumId>| match medium {
            Some(MediumId(index)) => format!("the medium \"{}\"", scene.media[index as usize].name),
            None => "vacuum".to_owned(),
        };
        let place = match around {
            Some(around) => {
                format!("inside \"{}\", which is filled with {}", scene.shapes[around].name, name_of(medium))
            }
            None => format!("in {}", name_of(medium)),
        };
        doubts.push(format!("\"{}\" names {} as its exterior, but lies {place}", shape.name, name_of(Some(named))));
    }
}

/// Which boundary is around a point, with the bounds of those that were asked for.
#[derive(Default)]
struct Enclosing {
    bounds: HashMap<usize, (DVec3, DVec3)>,
}

impl Enclosing {
    /// The smallest boundary that holds a point.
    fn innermost(&mut self, scene: &Scene, point: DVec3, except: Option<usize>) -> Option<usize> {
        let mut smallest: Option<(f64, usize)> = None;
        for (index, shape) in scene.shapes.iter().enumerate() {
            if shape.boundary.is_none() || except == Some(index) {
                continue;
            }
            let (low, high) = *self.bounds.entry(index).or_insert_with(|| bounds(&shape.geometry));
            let volume = (high - low).element_product();
            let inside = point.cmpge(low).all() && point.cmple(high).all();
            if inside && smallest.is_none_or(|(least, _)| volume < least) && holds(&shape.geometry, point) {
                smallest = Some((volume, index));
            }
        }
        smallest.map(|(_, index)| index)
    }
}

fn bounds(geometry: &Geometry) -> (DVec3, DVec3) {
    match geometry {
        Geometry::Sphere { center, radius, .. } => (center - *radius, center + *radius),
        Geometry::Mesh(mesh) => mesh
            .triangles
            .iter()
            .flatten()
            .map(|&corner| mesh.positions[corner as usize])
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p))),
    }
}

/// Whether a surface winds about a point: the sum of the solid angles of its triangles (van Oosterom and Strackee 1983)
/// is that of the sphere, in either direction, as for the generalised winding number (Jacobson et al. 2013).
fn holds(geometry: &Geometry, point: DVec3) -> bool {
    match geometry {
        Geometry::Sphere { center, radius, .. } => point.distance(*center) < *radius,
        Geometry::Mesh(mesh) => {
            let corners = |triangle: &[u32; 3]| triangle.map(|corner| mesh.positions[corner as usize]);
            let total: f64 = mesh.triangles.iter().map(|triangle| solid_angle(&corners(triangle), point)).sum();
            total.abs() > 2.0 * std::f64::consts::PI
        }
    }
}

/// Signed solid angle of a triangle (van Oosterom and Strackee 1983).
fn solid_angle(triangle: &[DVec3; 3], point: DVec3) -> f64 {
    let [a, b, c] = triangle.map(|corner| corner - point);
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let cosine = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    2.0 * a.dot(b.cross(c)).atan2(cosine)
}

/// Points just outside of a surface.
fn probes(geometry: &Geometry) -> Vec<DVec3> {
    match geometry {
        Geometry::Sphere { center, radius, flipped } => {
            let distance = radius * if *flipped { 1.0 - 1e-6 } else { 1.0 + 1e-6 };
            [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z]
                .map(|axis| center + axis * distance)
                .to_vec()
        }
        Geometry::Mesh(mesh) => mesh
            .triangles
            .iter()
            .step_by(mesh.triangles.len().div_ceil(PROBES).max(1))
            .map(|triangle| {
                let [a, b, c] = triangle.map(|corner| mesh.positions[corner as usize]);
                let size = (b - a).length().max((c - a).length());
                (a + b + c) / 3.0 + normal_of(mesh, triangle).normalize_or_zero() * size * 1e-6
            })
            .collect(),
    }
}
