//! `docs/SCENES.md` lists what the reader accepts, neither less nor more.

use std::collections::BTreeSet;

use tyndall::scene::mitsuba::{refused_plugins, supported_plugins};

use crate::{LIGHT, SENSOR, parse};

const PAGE: &str = include_str!("../../docs/SCENES.md");

/// Names in the first column of the tables in a section.
fn documented(page: &str, heading: &str) -> BTreeSet<String> {
    let start = page.find(heading).unwrap_or_else(|| panic!("no section {heading}")) + heading.len();
    let section = page[start..].split("\n##").next().unwrap();
    let first_cells = section.lines().filter(|line| line.starts_with("| `")).filter_map(|line| line.split('|').nth(1));
    first_cells.flat_map(|cell| cell.split('`').skip(1).step_by(2)).map(str::to_owned).collect()
}

/// Names that the reader lists when it meets a property that does not exist.
fn accepted(element: &str) -> BTreeSet<String> {
    let bad = r#"<string name="no_such_property" value=""/>"#;
    let text = element.replace('‸', bad);
    // A second sensor would be ignored.
    let sensor = if text.contains("<sensor") { "" } else { SENSOR };
    let error = parse(&format!("<scene version=\"3.0.0\">{sensor}{LIGHT}{text}</scene>")).unwrap_err().to_string();
    let (_, list) = error.split_once("accepted: ").unwrap_or_else(|| panic!("{element}: {error}"));
    list.split(", ").filter(|name| *name != "nothing").map(str::to_owned).collect()
}

/// The difference between a section and the reader.
fn difference(page: &str, heading: &str, element: &str, common: &[&str]) -> Vec<String> {
    let mut documented = documented(page, heading);
    documented.extend(common.iter().flat_map(|heading| self::documented(page, heading)));
    documented.symmetric_difference(&accepted(element)).cloned().collect()
}

#[test]
fn every_property_is_documented() {
    let shape = &["Every shape accepts\n"][..];
    let film = r#"<sensor type="perspective"><float name="fov" value="1"/><film type="hdrfilm">‸</film></sensor>"#;
    let sampler =
        r#"<sensor type="perspective"><float name="fov" value="1"/><sampler type="ldsampler">‸</sampler></sensor>"#;
    let ball = r#"<shape type="obj"><string name="filename" value="meshes/ball.obj"/>‸</shape>"#;
    let ply = r#"<shape type="ply"><string name="filename" value="meshes/triangle.ply"/>‸</shape>"#;
    let serialized =
        r#"<shape type="serialized"><string name="filename" value="meshes/triangle.serialized"/>‸</shape>"#;
    let instance = r#"<shape type="shapegroup" id="group"/><shape type="instance"><ref id="group"/>‸</shape>"#;
    let blend = format!(
        r#"<phase type="blendphase"><float name="weight" value="0"/>{0}{0}‸</phase>"#,
        r#"<phase type="isotropic"/>"#
    );
    let bitmap = r#"<texture type="bitmap"><string name="filename" value="textures/colors.png"/>‸</texture>"#;
    let sky = r#"<emitter type="envmap"><string name="filename" value="textures/sky.exr"/>‸</emitter>"#;
    for (heading, element, common) in [
        (
            "### `<sensor type=\"perspective\">`",
            r#"<sensor type="perspective"><float name="fov" value="1"/>‸</sensor>"#,
            &[][..],
        ),
        (
            "### `<sensor type=\"thinlens\">`",
            r#"<sensor type="thinlens"><float name="fov" value="1"/><float name="aperture_radius" value="1"/>‸</sensor>"#,
            &[],
        ),
        ("### `<sensor type=\"orthographic\">`", r#"<sensor type="orthographic">‸</sensor>"#, &[]),
        ("### `<film type=\"hdrfilm\">`", film, &[]),
        ("### `<sampler type=\"independent\">`", sampler, &[]),
        ("### `<integrator type=\"volpath\">`", r#"<integrator type="volpathmis">‸</integrator>"#, &[]),
        (
            "### `<integrator type=\"moment\">`",
            r#"<integrator type="aov"><integrator type="path"/>‸</integrator>"#,
            &[],
        ),
        ("### `<medium type=\"homogeneous\">`", r#"<medium type="homogeneous">‸</medium>"#, &[]),
        ("### `<medium type=\"heterogeneous\">`", r#"<medium type="heterogeneous">‸</medium>"#, &[]),
        (
            "### `<volume type=\"gridvolume\">`",
            r#"<medium type="heterogeneous"><volume type="gridvolume" name="sigma_t"><string name="filename" value="volumes/small.vol"/>‸</volume></medium>"#,
            &[],
        ),
        (
            "### `<volume type=\"heightvolume\">`",
            r#"<medium type="heterogeneous"><volume type="heightvolume" name="sigma_t"><float name="scale_height" value="1"/>‸</volume></medium>"#,
            &[],
        ),
        ("### `<phase type=\"hg\">`", r#"<phase type="hg">‸</phase>"#, &[]),
        ("### `<phase type=\"blendphase\">`", &blend, &[]),
        (
            "### `<phase type=\"tabphase\">`",
            r#"<phase type="tabphase"><string name="values" value="1 1"/>‸</phase>"#,
            &[],
        ),
        ("### `<shape type=\"obj\">`", ball, shape),
        ("### `<shape type=\"ply\">`", ply, shape),
        ("### `<shape type=\"serialized\">`", serialized, shape),
        ("### `<shape type=\"disk\">`", r#"<shape type="disk">‸</shape>"#, shape),
        ("### `<shape type=\"cylinder\">`", r#"<shape type="cylinder">‸</shape>"#, shape),
        ("### `<shape type=\"instance\">`", instance, &[]),
        ("### `<shape type=\"rectangle\">`", r#"<shape type="rectangle">‸</shape>"#, shape),
        ("### `<shape type=\"cube\">`", r#"<shape type="cube">‸</shape>"#, shape),
        ("### `<shape type=\"sphere\">`", r#"<shape type="sphere">‸</shape>"#, shape),
        ("### `<bsdf type=\"diffuse\">`", r#"<bsdf type="diffuse">‸</bsdf>"#, &[]),
        ("### `<bsdf type=\"null\">`", r#"<bsdf type="null">‸</bsdf>"#, &[]),
        ("### `<bsdf type=\"dielectric\">`", r#"<bsdf type="dielectric">‸</bsdf>"#, &[]),
        ("### `<bsdf type=\"dielectric\">`", r#"<bsdf type="thindielectric">‸</bsdf>"#, &[]),
        ("### `<bsdf type=\"roughdielectric\">`", r#"<bsdf type="roughdielectric">‸</bsdf>"#, &[]),
        ("### `<bsdf type=\"conductor\">`", r#"<bsdf type="conductor">‸</bsdf>"#, &[]),
        ("### `<bsdf type=\"roughconductor\">`", r#"<bsdf type="roughconductor">‸</bsdf>"#, &[]),
        ("### `<bsdf type=\"plastic\">`", r#"<bsdf type="plastic">‸</bsdf>"#, &[]),
        ("### `<bsdf type=\"roughplastic\">`", r#"<bsdf type="roughplastic">‸</bsdf>"#, &[]),
        ("### `<bsdf type=\"principled\">`", r#"<bsdf type="principled">‸</bsdf>"#, &[]),
        ("### `<bsdf type=\"mask\">`", r#"<bsdf type="mask"><bsdf type="null"/>‸</bsdf>"#, &[]),
        (
            "### `<bsdf type=\"blendbsdf\">`",
            r#"<bsdf type="blendbsdf"><float name="weight" value="0"/><bsdf type="diffuse"/><bsdf type="diffuse"/>‸</bsdf>"#,
            &[],
        ),
        (
            "### `<bsdf type=\"normalmap\">`",
            r#"<bsdf type="normalmap"><rgb name="normalmap" value="0.5, 0.5, 1"/><bsdf type="diffuse"/>‸</bsdf>"#,
            &[],
        ),
        ("### `<bsdf type=\"bumpmap\">`", &example("bsdf", "bumpmap"), &[]),
        ("### `<texture type=\"bitmap\">`", bitmap, &[]),
        ("### `<texture type=\"checkerboard\">`", r#"<texture type="checkerboard">‸</texture>"#, &[]),
        ("### `<emitter type=\"spot\">`", r#"<emitter type="spot">‸</emitter>"#, &[]),
        ("### `<emitter type=\"directional\">`", r#"<emitter type="directional">‸</emitter>"#, &[]),
        ("### `<emitter type=\"envmap\">`", sky, &[]),
        ("### `<emitter type=\"area\">`", r#"<shape type="cube"><emitter type="area">‸</emitter></shape>"#, &[]),
        (
            "### `<emitter type=\"volumelight\">`",
            r#"<shape type="cube"><medium type="homogeneous" name="interior"/><emitter type="volumelight">‸</emitter></shape>"#,
            &[],
        ),
        (
            "### `<volume type=\"constvolume\">`",
            r#"<medium type="heterogeneous"><volume type="constvolume" name="sigma_t">‸</volume></medium>"#,
            &[],
        ),
        (
            "### `<texture type=\"mesh_attribute\">`",
            r#"<texture type="mesh_attribute"><string name="name" value="vertex_color"/>‸</texture>"#,
            &[],
        ),
        ("### `<emitter type=\"point\">`", r#"<emitter type="point">‸</emitter>"#, &[]),
        ("### `<emitter type=\"constant\">`", r#"<emitter type="constant">‸</emitter>"#, &[]),
    ] {
        assert_eq!(difference(PAGE, heading, element, common), [""; 0], "{heading}");
        // A page that lost a line, and one that promises too much, are noticed.
        if let Some(name) = documented(PAGE, heading).first() {
            for replacement in ["other", ""] {
                let wrong = PAGE.replace(&format!("`{name}`"), &format!("`{replacement}`"));
                assert_ne!(difference(&wrong, heading, element, common), [""; 0], "{heading} {name}");
            }
        }
    }
}

/// A plugin with what it needs, and the place of a property that does not exist.
fn example(tag: &str, kind: &str) -> String {
    let string = |name: &str, value: &str| format!(r#"<string name="{name}" value="{value}"/>"#);
    let inside = match (tag, kind) {
        ("integrator", "moment" | "aov") => r#"<integrator type="path"/>"#.to_owned(),
        ("sensor", "perspective") => r#"<float name="fov" value="1"/>"#.to_owned(),
        ("sensor", "thinlens") => {
            r#"<float name="fov" value="1"/><float name="aperture_radius" value="1"/>"#.to_owned()
        }
        ("phase", "blendphase") => r#"<float name="weight" value="0"/><phase type="hg"/><phase type="hg"/>"#.to_owned(),
        ("phase", "tabphase") => string("values", "1 1"),
        ("shape", "obj") => string("filename", "meshes/ball.obj"),
        ("shape", "ply" | "serialized") => string("filename", &format!("meshes/triangle.{kind}")),
        ("shape", "instance") => r#"<shape type="shapegroup"/>"#.to_owned(),
        ("bsdf", "mask" | "twosided") => r#"<bsdf type="diffuse"/>"#.to_owned(),
        ("bsdf", "blendbsdf") => {
            r#"<float name="weight" value="0"/><bsdf type="diffuse"/><bsdf type="diffuse"/>"#.to_owned()
        }
        ("bsdf", "normalmap") => r#"<rgb name="normalmap" value="0.5, 0.5, 1"/><bsdf type="diffuse"/>"#.to_owned(),
        ("bsdf", "bumpmap") => {
            format!(
                r#"<texture type="bitmap">{}</texture><bsdf type="diffuse"/>"#,
                string("filename", "textures/gray.png")
            )
        }
        ("texture", "mesh_attribute") => string("name", "vertex_color"),
        ("texture", "bitmap") => string("filename", "textures/colors.png"),
        ("emitter", "envmap") => string("filename", "textures/sky.exr"),
        ("spectrum", "blackbody") => r#"<float name="temperature" value="1"/>"#.to_owned(),
        ("spectrum", "regular") => {
            let limits = r#"<float name="wavelength_min" value="400"/><float name="wavelength_max" value="700"/>"#;
            limits.to_owned() + &string("values", "1 1")
        }
        ("volume", "gridvolume") => string("filename", "volumes/small.vol"),
        ("volume", "heightvolume") => r#"<float name="scale_height" value="1"/>"#.to_owned(),
        ("spectrum", "irregular") => string("wavelengths", "400 700") + &string("values", "1 1"),
        _ => String::new(),
    };
    let name = match tag {
        "spectrum" => r#"name="radiance" "#,
        "volume" => r#"name="sigma_t" "#,
        _ => "",
    };
    let plugin = format!(r#"<{tag} {name}type="{kind}">{inside}‸</{tag}>"#);
    let sensor = |inside: &str| format!(r#"<sensor type="perspective"><float name="fov" value="1"/>{inside}</sensor>"#);
    match (tag, kind) {
        ("film" | "sampler", _) => sensor(&plugin),
        ("rfilter", _) => sensor(&format!(r#"<film type="hdrfilm">{plugin}</film>"#)),
        ("spectrum", _) => format!(r#"<emitter type="constant">{plugin}</emitter>"#),
        ("volume", _) => format!(r#"<medium type="heterogeneous">{plugin}</medium>"#),
        ("emitter", "volumelight") => {
            format!(r#"<shape type="cube"><medium type="homogeneous" name="interior"/>{plugin}</shape>"#)
        }
        ("emitter", "area") => format!(r#"<shape type="cube">{plugin}</shape>"#),
        _ => plugin,
    }
}

/// The tables at the end of the page.
fn tables() -> String {
    let mut text = "| supported | properties |\n|---|---|\n".to_owned();
    for (tag, kinds) in supported_plugins() {
        for kind in kinds {
            let names: Vec<String> =
                accepted(&example(&tag, kind)).into_iter().map(|name| format!("`{name}`")).collect();
            let names = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
            text += &format!("| `<{tag} type=\"{kind}\">` | {names} |\n");
        }
    }
    text += "\n| not supported | instead |\n|---|---|\n";
    for (tag, kind, advice) in refused_plugins() {
        text += &format!("| `<{tag} type=\"{kind}\">` | {advice} |\n");
    }
    text
}

#[test]
fn the_tables_of_plugins_are_current() {
    let (begin, end) = ("<!-- begin: plugins -->\n", "<!-- end: plugins -->\n");
    let (before, rest) = PAGE.split_once(begin).expect("the page has the mark");
    let (found, after) = rest.split_once(end).expect("the page has the mark");
    let tables = tables();
    if std::env::var_os("TYNDALL_WRITE_DOCS").is_some() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/SCENES.md");
        std::fs::write(path, format!("{before}{begin}{tables}{end}{after}")).unwrap();
        return;
    }
    assert_eq!(found, tables, "TYNDALL_WRITE_DOCS=1 cargo test --test scene docs writes the tables");
}

#[test]
fn plugins_that_are_not_supported_say_what_to_use() {
    for (tag, kind, advice) in refused_plugins() {
        let text = example(&tag, kind).replace('‸', "");
        let sensor = if text.contains("<sensor") { "" } else { SENSOR };
        let error = parse(&format!("<scene version=\"3.0.0\">{sensor}{LIGHT}{text}</scene>")).unwrap_err().to_string();
        let expected = format!("<{tag} type=\"{kind}\"> is not supported; {advice}; accepted types: ");
        assert!(error.contains(&expected), "{expected}\n{error}");
    }
}
