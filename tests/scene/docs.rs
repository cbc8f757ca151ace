//! `docs/SCENES.md` lists what the reader accepts, neither less nor more.

use std::collections::BTreeSet;

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
        ("### `<film type=\"hdrfilm\">`", film, &[]),
        ("### `<sampler type=\"independent\">`", sampler, &[]),
        ("### `<integrator type=\"volpath\">`", r#"<integrator type="volpathmis">‸</integrator>"#, &[]),
        ("### `<medium type=\"homogeneous\">`", r#"<medium type="homogeneous">‸</medium>"#, &[]),
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
        ("### `<bsdf type=\"mask\">`", r#"<bsdf type="mask"><bsdf type="null"/>‸</bsdf>"#, &[]),
        ("### `<texture type=\"bitmap\">`", bitmap, &[]),
        ("### `<texture type=\"checkerboard\">`", r#"<texture type="checkerboard">‸</texture>"#, &[]),
        ("### `<emitter type=\"spot\">`", r#"<emitter type="spot">‸</emitter>"#, &[]),
        ("### `<emitter type=\"directional\">`", r#"<emitter type="directional">‸</emitter>"#, &[]),
        ("### `<emitter type=\"envmap\">`", sky, &[]),
        ("### `<emitter type=\"area\">`", r#"<shape type="cube"><emitter type="area">‸</emitter></shape>"#, &[]),
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
