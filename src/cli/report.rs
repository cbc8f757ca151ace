//! The report of `tyndall check`: one value, printed as JSON for programs and as text for people.

use std::fmt::Write;

use serde_json::{Value, json};
use tyndall::pack::Packed;
use tyndall::pack::frame::Bounds;
use tyndall::pack::nesting::Nesting;
use tyndall::scene::{Geometry, GridVolume, Light, MediumId, Phase, Scene, Volume, Volumes, check};

use super::backend;

/// Everything about a scene. Lengths are in scene units, memory in bytes; a colour is an array of linear sRGB. Shapes and media
/// are numbered in the order of `shapes` and `media`; `null` for a medium is vacuum.
pub fn of(path: &str, scene: &Scene, packed: &Packed, warnings: &[String], doubts: &[String]) -> Value {
    let nesting = Nesting::of(scene);
    let film = &scene.film;
    let crop = film.crop;
    let medium = |medium: Option<MediumId>| medium.map(|MediumId(index)| index);
    let parents = check::parents(scene);
    let boundaries = scene.shapes.iter().enumerate().filter_map(|(index, shape)| {
        let boundary = shape.boundary?;
        Some(json!({
            "shape": index,
            "inside_of": parents[index],
            "interior": medium(boundary.interior),
            "exterior": medium(nesting.exteriors[index]),
            "exterior_given": boundary.exterior.is_some(),
        }))
    });
    json!({
        "scene": path,
        "film": {
            "width": film.width,
            "height": film.height,
            "crop": { "x": crop.x, "y": crop.y, "width": crop.width, "height": crop.height },
        },
        "sample_count": scene.sample_count,
        "camera": { "inside_of": check::around_camera(scene), "medium": medium(nesting.camera) },
        "world_medium": medium(nesting.world),
        "shapes": scene.shapes.iter().map(|shape| {
            let bounds = Bounds::of(&shape.geometry);
            let (kind, triangles, closed) = match &shape.geometry {
                Geometry::Mesh(mesh) => ("mesh", mesh.triangles.len(), check::is_closed(mesh)),
                Geometry::Sphere { .. } => ("sphere", 0, true),
            };
            json!({
                "name": shape.name,
                "kind": kind,
                "triangles": triangles,
                "closed": closed,
                "bounds": [bounds.min.to_array(), bounds.max.to_array()],
                "bsdf": shape.bsdf.plugin(),
                "radiance": shape.emission.map(|radiance| radiance.to_array()),
            })
        }).collect::<Vec<_>>(),
        "media": scene.media.iter().map(|medium| json!({
            "name": medium.name,
            "sigma_t": medium.sigma_t.to_array(),
            "albedo": medium.albedo.to_array(),
            "phase": phase(&medium.phase),
            "emission": medium.emission.to_array(),
            "volumes": volumes(&medium.volumes),
        })).collect::<Vec<_>>(),
        "boundaries": boundaries.collect::<Vec<_>>(),
        "lights": lights(scene),
        "features": features(packed),
        "memory": memory(scene, packed),
        "warnings": warnings,
        "doubts": doubts,
    })
}

/// Which coefficients of a medium depend on the place, and how.
fn volumes(volumes: &Volumes) -> Value {
    let voxels = |field: &GridVolume| {
        let ([x, y, z], channels) = (field.grid.resolution(), field.grid.channels());
        format!("{x} x {y} x {z} voxels, {channels} channels, up to {}", field.grid.max())
    };
    json!({
        "sigma_t": volumes.sigma_t.as_ref().map(|field| match field {
            Volume::Grid(field) => voxels(field),
            Volume::Height(height) => format!("scale height {}", height.scale_height),
        }),
        "albedo": volumes.albedo.as_ref().map(voxels),
        "emission": volumes.emission.as_ref().map(voxels),
    })
}

/// A phase function in a few words.
fn phase(phase: &Phase) -> String {
    match phase {
        Phase::Isotropic => "isotropic".to_owned(),
        Phase::HenyeyGreenstein { g } => format!("Henyey-Greenstein, g {g}"),
        Phase::Rayleigh => "Rayleigh".to_owned(),
        Phase::Blend { weight, a, b } => {
            format!("{} of ({}) and {weight} of ({})", 1.0 - weight, self::phase(a), self::phase(b))
        }
        Phase::Tabulated { values } => format!("table of {} values", values.len()),
    }
}

/// Lamps and emitters, each with the quantity that it is given by.
fn lights(scene: &Scene) -> Vec<Value> {
    let lamps = scene.shapes.iter().enumerate().filter_map(|(index, shape)| {
        let radiance = shape.emission?;
        Some(json!({ "kind": "area", "shape": index, "radiance": radiance.to_array() }))
    });
    let others = scene.lights.iter().map(|light| match light {
        Light::Point { position, intensity } => {
            json!({ "kind": "point", "position": position.to_array(), "intensity": intensity.to_array() })
        }
        Light::Constant { radiance } => json!({ "kind": "constant", "radiance": radiance.to_array() }),
        Light::Spot { position, direction, intensity, .. } => json!({
            "kind": "spot",
            "position": position.to_array(),
            "direction": direction.to_array(),
            "intensity": intensity.to_array(),
        }),
        Light::Directional { direction, irradiance } => json!({
            "kind": "directional",
            "direction": direction.to_array(),
            "irradiance": irradiance.to_array(),
        }),
        Light::Envmap { bitmap, scale, .. } => json!({
            "kind": "envmap",
            "width": bitmap.width(),
            "height": bitmap.height(),
            "largest_radiance": scale * f64::from(bitmap.max()),
        }),
    });
    lamps.chain(others).collect()
}

/// Names of what is compiled into the kernel, as they stand in its text.
fn features(packed: &Packed) -> Vec<String> {
    let text = packed.features.glsl();
    let switched_on = |line: &str| Some(line.strip_prefix("const bool ")?.strip_suffix(" = true;")?.to_owned());
    text.lines().filter_map(switched_on).collect()
}

/// Bytes: of the scene's tables, of what is rendered, and of the scene as it was read.
fn memory(scene: &Scene, packed: &Packed) -> Value {
    let tables = size_of_val(&packed.bvh.nodes[..])
        + size_of_val(&packed.primitives[..])
        + size_of_val(&packed.surfaces[..])
        + size_of_val(&packed.media[..])
        + size_of_val(&packed.lights[..])
        + size_of_val(&packed.phases[..])
        + size_of_val(&packed.corners[..])
        + size_of_val(&packed.textures[..])
        + size_of_val(&packed.grids[..])
        + size_of_val(&packed.values[..]);
    let meshes: usize = (scene.shapes.iter())
        .map(|shape| match &shape.geometry {
            Geometry::Sphere { .. } => 0,
            Geometry::Mesh(mesh) => {
                size_of_val(&mesh.positions[..])
                    + size_of_val(&mesh.normals[..])
                    + size_of_val(&mesh.uvs[..])
                    + size_of_val(&mesh.triangles[..])
            }
        })
        .sum();
    let crop = scene.film.crop;
    // Whether pixels share their paths is known only after a pilot run: the most that it may take.
    let may_share = scene.moments.is_none() && tyndall::pilot::can_share_paths(packed);
    let sharers = if may_share { tyndall::pilot::MOST_SHARERS } else { 0 };
    let (device_work, host_blocks) = backend::working_memory([crop.width, crop.height], sharers);
    // Sums and sums of squares of three channels in double precision, and where pixels share paths a sum for each half and shift; and
    // numbers of samples.
    let shifts = if may_share { 2 * tyndall::render::RUN_SHIFTS as usize } else { 0 };
    let of_pixel = (2 + shifts) * size_of::<[f64; 3]>() + (1 + shifts) * size_of::<u32>();
    let film = u64::from(crop.width) * u64::from(crop.height) * of_pixel as u64;
    let (tables, meshes) = (tables as u64, meshes as u64);
    json!({
        "device": { "tables": tables, "samples": device_work, "total": tables + device_work },
        "host": {
            "scene": meshes,
            "tables": tables,
            "film": film,
            "blocks": host_blocks,
            "total": meshes + tables + film + host_blocks,
        },
    })
}

/// Most shapes, and most lights, that the text lists.
const LISTED: usize = 200;

/// The report for people.
pub fn text(report: &Value) -> String {
    let mut out = String::new();
    let mut line = |text: String| writeln!(out, "{text}").expect("a string takes any text");
    let crop = &report["film"]["crop"];
    line(word(&report["scene"]));
    line(format!(
        "  {}×{} pixels of a film of {}×{}, {} samples a pixel",
        crop["width"], crop["height"], report["film"]["width"], report["film"]["height"], report["sample_count"]
    ));
    let (device, host) = (&report["memory"]["device"], &report["memory"]["host"]);
    line(format!(
        "  memory: {} on the device, of which tables {}; {} on the host",
        bytes(&device["total"]),
        bytes(&device["tables"]),
        bytes(&host["total"])
    ));
    line(format!("  compiled in: {}", or_nothing(list(report, "features").iter().map(word).collect())));

    heading(&mut line, "shapes", report, "shapes");
    for shape in list(report, "shapes").iter().take(LISTED) {
        let mut what = match word(&shape["kind"]).as_str() {
            "mesh" => {
                let closed = if shape["closed"] == true { "closed" } else { "open" };
                format!("{} triangles, {closed}", shape["triangles"])
            }
            kind => kind.to_owned(),
        };
        write!(what, ", {}, {} to {}", word(&shape["bsdf"]), place(&shape["bounds"][0]), place(&shape["bounds"][1]))
            .expect("a string takes any text");
        line(format!("  {}: {what}", shape["name"]));
    }
    and_more(&mut line, list(report, "shapes").len());

    heading(&mut line, "media", report, "media");
    for medium in list(report, "media") {
        let mut glow = String::new();
        if medium["emission"] != json!([0.0, 0.0, 0.0]) {
            glow = format!(", emission {}", triple(&medium["emission"]));
        }
        let fields: String = ["sigma_t", "albedo", "emission"]
            .iter()
            .filter_map(|name| Some(format!("; {name} times {}", medium["volumes"][name].as_str()?)))
            .collect();
        line(format!(
            "  {}: sigma_t {}, albedo {}, {}{glow}{fields}",
            medium["name"],
            triple(&medium["sigma_t"]),
            triple(&medium["albedo"]),
            word(&medium["phase"])
        ));
    }

    line(format!("\nnesting\n  outside of all boundaries: {}", filling(report, &report["world_medium"])));
    tree(&mut line, report, &Value::Null, 1);

    heading(&mut line, "lights", report, "lights");
    for light in list(report, "lights").iter().take(LISTED) {
        let whose = match light["shape"].as_u64() {
            Some(index) => format!(" {}", report["shapes"][index as usize]["name"]),
            None => String::new(),
        };
        let values: Vec<String> = (light.as_object().into_iter().flatten())
            .filter(|(key, _)| *key != "kind" && *key != "shape")
            .map(|(key, value)| match key.as_str() {
                "position" | "direction" => format!("{key} {}", place(value)),
                _ if value.is_array() => format!("{key} {}", triple(value)),
                _ => format!("{key} {value}"),
            })
            .collect();
        line(format!("  {}{whose}: {}", word(&light["kind"]), values.join(", ")));
    }
    and_more(&mut line, list(report, "lights").len());

    for (what, key) in [("warnings", "warnings"), ("doubts", "doubts")] {
        heading(&mut line, what, report, key);
        list(report, key).iter().for_each(|text| line(format!("  {}", word(text))));
    }
    out
}

/// "shapes: 3", or "shapes: none".
fn heading(line: &mut impl FnMut(String), what: &str, report: &Value, key: &str) {
    let count = list(report, key).len();
    line(format!("\n{what}: {}", if count == 0 { "none".to_owned() } else { count.to_string() }));
}

fn and_more(line: &mut impl FnMut(String), count: usize) {
    if count > LISTED {
        line(format!("  and {} more, which --json lists", count - LISTED));
    }
}

/// The boundaries inside of `parent`, each with those inside of it.
fn tree(line: &mut impl FnMut(String), report: &Value, parent: &Value, depth: usize) {
    let indent = "  ".repeat(depth);
    if report["camera"]["inside_of"] == *parent {
        line(format!("{indent}the camera: in {}", filling(report, &report["camera"]["medium"])));
    }
    for boundary in list(report, "boundaries").iter().filter(|boundary| boundary["inside_of"] == *parent) {
        let how = if boundary["exterior_given"] == true { "as the scene says" } else { "found" };
        let shape = &boundary["shape"];
        line(format!(
            "{indent}{}: {} inside, {} outside ({how})",
            report["shapes"][shape.as_u64().unwrap_or_default() as usize]["name"],
            filling(report, &boundary["interior"]),
            filling(report, &boundary["exterior"])
        ));
        tree(line, report, shape, depth + 1);
    }
}

/// The name of a medium.
fn filling(report: &Value, medium: &Value) -> String {
    medium.as_u64().map_or("vacuum".to_owned(), |index| report["media"][index as usize]["name"].to_string())
}

fn list<'a>(report: &'a Value, key: &str) -> &'a [Value] {
    report[key].as_array().map_or(&[], Vec::as_slice)
}

/// A text without quotation marks.
fn word(value: &Value) -> String {
    value.as_str().unwrap_or_default().to_owned()
}

fn or_nothing(words: Vec<String>) -> String {
    if words.is_empty() { "nothing".to_owned() } else { words.join(" ") }
}

/// "(0.1, 0.2, 0.3)", six digits each.
fn place(value: &Value) -> String {
    let short = |number: f64| {
        let digits: f64 = format!("{number:.5e}").parse().unwrap_or(number);
        if digits != 0.0 && !(1e-4..1e6).contains(&digits.abs()) { format!("{digits:e}") } else { digits.to_string() }
    };
    let numbers: Vec<String> = value.as_array().into_iter().flatten().filter_map(Value::as_f64).map(short).collect();
    format!("({})", numbers.join(", "))
}

/// The same, or one number if all three are alike.
fn triple(value: &Value) -> String {
    let alike = value[0] == value[1] && value[1] == value[2];
    let text = place(value);
    let first = text.split(", ").next().map(|first| first.trim_start_matches('(').to_owned());
    first.filter(|_| alike).unwrap_or(text)
}

/// "1.5 MiB".
fn bytes(value: &Value) -> String {
    let mut amount = value.as_f64().unwrap_or_default();
    let mut unit = "bytes";
    for larger in ["KiB", "MiB", "GiB", "TiB"] {
        if amount < 1024.0 {
            break;
        }
        (amount, unit) = (amount / 1024.0, larger);
    }
    if unit == "bytes" { format!("{amount} bytes") } else { format!("{amount:.1} {unit}") }
}
