//! A table of faults, each with its place and what the message must say.

use crate::{LIGHT, SENSOR, parse};

/// Checks that `text` is refused at the place that `‸` marks, with a message that contains all of `parts`.
fn refused(text: &str, parts: &[&str]) -> Result<(), String> {
    let fault = text.find('‸').ok_or("the text marks no place")?;
    let line = text[..fault].matches('\n').count() + 1;
    let col = text[..fault].rsplit('\n').next().unwrap_or_default().chars().count() + 1;
    let error = match parse(&text.replace('‸', "")) {
        Ok(_) => return Err(format!("accepted: {text}")),
        Err(error) => error.to_string(),
    };
    let place = format!("scene.xml:{line}:{col}: ");
    let at = error.find(&place).ok_or(format!("not at {place}\n{error}\n{text}"))?;
    let message = &error[at + place.len()..];
    match parts.iter().find(|part| !message.contains(**part)) {
        None => Ok(()),
        Some(part) => Err(format!("\"{part}\" is missing in\n{error}\n{text}")),
    }
}

/// Checks faults in the body of a scene that is good otherwise.
pub fn table(faults: &[(&str, &[&str])]) {
    let failures: Vec<String> = faults
        .iter()
        .filter_map(|(body, parts)| {
            let text = format!("<scene version=\"3.0.0\">{SENSOR}{LIGHT}\n{body}\n</scene>");
            refused(&text, parts).err()
        })
        .collect();
    assert!(failures.is_empty(), "{}", failures.join("\n\n"));
}

#[test]
fn the_table_can_fail() {
    let good = format!("<scene version=\"3.0.0\">{SENSOR}{LIGHT}</scene>");
    assert!(refused(&format!("‸{good}"), &[]).is_err(), "a good scene");
    let bad = good.replace("<emitter", "‸<oops/><emitter");
    assert_eq!(refused(&bad, &["unknown element <oops>"]), Ok(()));
    assert!(refused(&bad, &["something else"]).is_err(), "another message");
    assert!(refused(&bad.replace("‸<oops/>", "<oops/>‸"), &[]).is_err(), "another place");
}

#[test]
fn documents() {
    for (text, parts) in [
        ("‸", &["not well-formed XML"][..]),
        ("<scene version=\"3.0.0\">\n<shape type=\"cube\">‸</scene>", &["not well-formed XML"]),
        ("‸<scene/>", &["<scene> needs the attribute \"version\""]),
        ("<scene ‸version=\"4.0\"/>", &["\"4.0\"", "supported: 0.x, 2.x and 3.x"]),
        ("<scene ‸version=\"three\"/>", &["\"three\""]),
        ("‸<shape version=\"3.0.0\" type=\"cube\"/>", &["the root is <shape>; it must be <scene>"]),
        ("‸<scene version=\"3.0.0\"/>", &["no sensor", "<sensor type=\"perspective\">"]),
        ("<scene version=\"3.0.0\" ‸colour=\"1\"/>", &["no attribute \"colour\"", "accepted: version"]),
    ] {
        refused(text, parts).unwrap_or_else(|failure| panic!("{failure}"));
    }
}

#[test]
fn elements_and_attributes() {
    table(&[
        ("‸<lamp/>", &["unknown element <lamp>", "accepted: ", "emitter"]),
        ("‸<shpe type=\"cube\"/>", &["did you mean \"shape\"?"]),
        ("‸<shape/>", &["<shape> needs the attribute \"type\""]),
        ("<shape type=\"cube\" ‸typ=\"x\"/>", &["no attribute \"typ\"", "did you mean \"type\"?"]),
        ("<shape type=\"sphere\">‸<float value=\"1\"/></shape>", &["needs the attribute \"name\""]),
        ("<shape type=\"sphere\">‸<float name=\"radius\"/></shape>", &["needs the attribute \"value\""]),
        (
            "<shape type=\"sphere\"><float name=\"radius\" value=\"1\">‸<bsdf/></float></shape>",
            &["cannot have children"],
        ),
        ("<shape type=\"sphere\">\n  ‸hello</shape>", &["text between elements"]),
        ("‸<translate x=\"1\"/>", &["only stand inside a <transform>"]),
        ("‸<scene version=\"3.0.0\"/>", &["only be the root"]),
        ("<shape type=\"cube\">‸<path value=\"meshes\"/></shape>", &["directly inside <scene>"]),
        ("<path ‸value=\"nowhere\"/>", &["no folder", "nowhere"]),
        ("<include ‸filename=\"nowhere.xml\"/>", &["cannot read the included file", "nowhere.xml"]),
        ("<default ‸name=\"\" value=\"1\"/>", &["must not be empty"]),
        ("‸<string name=\"a\" value=\"1\"/>", &["<scene> has no property \"a\""]),
    ]);
}

#[test]
fn names_and_references() {
    table(&[
        (
            "<shape type=\"cube\" id=\"a\"/>\n<shape type=\"cube\" ‸id=\"a\"/>",
            &["\"a\" is already taken at", "scene.xml:2:1"],
        ),
        (
            "<shape type=\"cube\">‸<ref id=\"clai\"/></shape><bsdf type=\"null\" id=\"clay\"/>",
            &["no", "\"clai\"", "did you mean \"clay\"?"],
        ),
        ("<alias ‸id=\"a\" as=\"b\"/>", &["nothing has the id \"a\""]),
        ("<bsdf type=\"null\" id=\"a\"/><alias id=\"a\" ‸as=\"a\"/>", &["already taken"]),
        (
            "<shape type=\"sphere\"><float name=\"radius\" ‸value=\"$r\"/></shape>",
            &["$r has no value", "<default name=\"r\"", "-D r="],
        ),
        ("<default name=\"spp\" value=\"1\"/><shape type=\"sphere\" ‸id=\"$sp\"/>", &["did you mean \"spp\"?"]),
        (
            "<shape type=\"sphere\"><float name=\"radius\" value=\"1\"/>\n‸<float name=\"radius\" value=\"2\"/></shape>",
            &["given twice", "scene.xml:2:22"],
        ),
        ("<shape type=\"cube\" id=\"a\"/>‸<ref id=\"a\"/>", &["part of the scene already"]),
        ("<shape type=\"cube\" id=\"a\">‸<ref id=\"a\"/></shape>", &["no use for <shape type=\"cube\">"]),
        ("<bsdf type=\"twosided\" id=\"a\">‸<ref id=\"a\"/></bsdf>", &["cannot hold <bsdf type=\"twosided\">"]),
    ]);
}

#[test]
fn values() {
    table(&[
        ("<shape type=\"sphere\"><float name=\"radius\" ‸value=\"1,5\"/></shape>", &["\"1,5\" is not a number"]),
        ("<shape type=\"sphere\"><float name=\"radius\" ‸value=\"inf\"/></shape>", &["not a finite number"]),
        ("<shape type=\"sphere\"><float name=\"radius\" ‸value=\"\"/></shape>", &["is not a number"]),
        (
            "<integrator type=\"path\"><integer name=\"max_depth\" ‸value=\"2.5\"/></integrator>",
            &["not a whole number"],
        ),
        (
            "<shape type=\"cube\"><boolean name=\"flip_normals\" ‸value=\"yes\"/></shape>",
            &["neither \"true\" nor \"false\""],
        ),
        ("<shape type=\"sphere\">‸<point name=\"center\" x=\"1\" y=\"2\"/></shape>", &["needs the attribute \"z\""]),
        ("<shape type=\"sphere\">‸<point name=\"center\" value=\"1 2\"/></shape>", &["2 numbers; 1 or 3"]),
        ("<shape type=\"sphere\">‸<point name=\"center\" value=\"1\" x=\"1\"/></shape>", &["not both"]),
        ("<bsdf type=\"diffuse\"><rgb name=\"reflectance\" ‸value=\"1 2\"/></bsdf>", &["2 numbers"]),
        ("<bsdf type=\"diffuse\"><rgb name=\"reflectance\" ‸value=\"#12345\"/></bsdf>", &["#rrggbb"]),
        (
            "<bsdf type=\"diffuse\"><spectrum name=\"reflectance\" ‸value=\"400:1,700\"/></bsdf>",
            &["\"700\" is not a wavelength and a value"],
        ),
        (
            "<bsdf type=\"diffuse\">‸<spectrum name=\"reflectance\" type=\"d66\"/></bsdf>",
            &["<spectrum type=\"d66\"> is not supported", "did you mean \"d65\"?"],
        ),
        (
            "<bsdf type=\"diffuse\"><spectrum name=\"reflectance\" ‸filename=\"a.spd\"/></bsdf>",
            &["cannot read the spectrum", "a.spd"],
        ),
        (
            "<medium type=\"homogeneous\">‸<texture name=\"sigma_t\" type=\"bitmap\"/></medium>",
            &["given as <texture type=\"bitmap\">", "accepted: <rgb>"],
        ),
        (
            "<bsdf type=\"roughconductor\">‸<texture name=\"alpha\" type=\"checkerboard\"/></bsdf>",
            &["given as <texture type=\"checkerboard\">", "accepted: <float>"],
        ),
        (
            "<bsdf type=\"diffuse\">‸<bsdf name=\"reflectance\" type=\"null\"/></bsdf>",
            &["given as <bsdf type=\"null\">", "<texture>"],
        ),
        ("<bsdf type=\"diffuse\">‸<string name=\"reflectance\" value=\"red\"/></bsdf>", &["given as <string>"]),
        (
            "<integrator type=\"path\">‸<float name=\"max_depth\" value=\"2\"/></integrator>",
            &["given as <float>; accepted: <integer>"],
        ),
    ]);
}

#[test]
fn transforms() {
    let shape =
        |inside: &str| format!("<shape type=\"cube\">\n<transform name=\"to_world\">{inside}</transform></shape>");
    for (inside, part) in [
        ("‸<rotate x=\"1\"/>", "needs an angle"),
        ("‸<rotate angle=\"5\"/>", "the axis of <rotate> is zero"),
        ("‸<translate x=\"a\"/>", "\"a\" is not a number"),
        ("<translate ‸w=\"1\"/>", "no attribute \"w\""),
        ("‸<scale value=\"1 2\"/>", "2 numbers"),
        ("‸<matrix value=\"1 2 3\"/>", "9 or 16 numbers, row by row; this one has 3"),
        ("‸<matrix value=\"1 0 0 0 0 1 0 0 0 0 1 0 0 0 1 1\"/>", "last row"),
        ("‸<lookat origin=\"0 0 0\" target=\"0 0 0\"/>", "are the same"),
        ("‸<lookat origin=\"0 0 0\" target=\"0 2 0\" up=\"0 1 0\"/>", "parallel"),
        ("‸<lookat origin=\"0 0 0\"/>", "needs \"target\""),
        ("‸<lookat origin=\"0 0\" target=\"0 0 0\"/>", "2 numbers; 3 are needed"),
        ("<scale value=\"1e300\"/>‸<scale value=\"1e300\"/>", "overflows"),
        ("‸<bsdf type=\"null\"/>", "cannot stand inside a <transform>"),
        ("‸<rotat x=\"1\"/>", "did you mean \"rotate\"?"),
    ] {
        table(&[(&shape(inside), &[part])]);
    }
    table(&[
        (
            "<shape type=\"cube\">\n‸<transform name=\"to_world\"><scale x=\"0\"/></transform></shape>",
            &["has no inverse"],
        ),
        (
            "<shape type=\"sphere\">\n‸<transform name=\"to_world\"><scale x=\"2\"/></transform></shape>",
            &["scaled non-uniformly"],
        ),
    ]);
}

#[test]
fn shapes() {
    table(&[
        (
            "‸<shape type=\"heightfield\"/>",
            &[
                "<shape type=\"heightfield\"> is not supported",
                "accepted types: obj, ply, serialized, rectangle, cube, sphere, disk",
            ],
        ),
        ("‸<shape type=\"spheer\"/>", &["did you mean \"sphere\"?"]),
        (
            "<shape type=\"sphere\">‸<float name=\"radiuss\" value=\"1\"/></shape>",
            &["no property \"radiuss\"", "did you mean \"radius\"?", "accepted: ", "center"],
        ),
        ("<shape type=\"sphere\">‸<float name=\"radius\" value=\"-1\"/></shape>", &["greater than 0"]),
        (
            "<shape type=\"cube\">‸<float name=\"radius\" value=\"1\"/></shape>",
            &["<shape type=\"cube\"> has no property"],
        ),
        ("‸<shape type=\"obj\"/>", &["needs <string name=\"filename\""]),
        ("<shape type=\"cube\"><bsdf type=\"null\"/>‸<bsdf type=\"null\"/></shape>", &["only one <bsdf>"]),
        ("<shape type=\"cube\">‸<medium type=\"homogeneous\"/></shape>", &["no name", "\"interior\" or \"exterior\""]),
        ("<shape type=\"cube\">‸<medium type=\"homogeneous\" name=\"inside\"/></shape>", &["\"inside\""]),
        ("<shape type=\"cube\">‸<emitter type=\"point\"/></shape>", &["put it directly into <scene>"]),
        ("<shape type=\"cube\">‸<emitter type=\"spot\"/></shape>", &["put it directly into <scene>"]),
        ("<shape type=\"cube\">‸<emitter type=\"sunsky\"/></shape>", &["not supported", "area"]),
        (
            "‸<shape type=\"obj\"><string name=\"filename\" value=\"meshes/ball.obj\"/><bsdf type=\"diffuse\"><texture type=\"checkerboard\" name=\"reflectance\"/></bsdf></shape>",
            &["has a texture", "no texture coordinates"],
        ),
        (
            "‸<shape type=\"obj\"><string name=\"filename\" value=\"meshes/ball.obj\"/><bsdf type=\"mask\"><bsdf type=\"roughconductor\"><float name=\"alpha_u\" value=\"0.1\"/><float name=\"alpha_v\" value=\"0.2\"/></bsdf></bsdf></shape>",
            &["has anisotropic roughness", "no texture coordinates"],
        ),
        (
            "<shape type=\"sphere\">‸<emitter type=\"area\"><texture type=\"checkerboard\" name=\"radiance\"/></emitter></shape>",
            &["the radiance of this lamp is a texture", "needs a mesh"],
        ),
        ("<shape type=\"cube\">‸<sensor type=\"perspective\"/></shape>", &["no use for <sensor"]),
        ("<shape type=\"cube\">‸<volume type=\"gridvolume\" name=\"a\"/></shape>", &["no use for <volume"]),
    ]);
}

#[test]
fn materials_and_media() {
    let inside = |text: &str| format!("<medium type=\"homogeneous\" id=\"m\">{text}</medium>");
    for (text, part) in [
        ("‸<float name=\"sigma_t\" value=\"-1\"/>", "must not be negative"),
        ("<float name=\"sigma_t\" ‸value=\"nan\"/>", "not a finite number"),
        ("<float name=\"sigma_t\" ‸value=\"inf\"/>", "not a finite number"),
        ("‸<rgb name=\"albedo\" value=\"0.5 0.5 1.01\"/>", "between 0 and 1"),
        ("‸<float name=\"albedo\" value=\"-0.1\"/>", "between 0 and 1"),
        ("‸<float name=\"scale\" value=\"-1\"/>", "must not be negative"),
        ("‸<float name=\"sigma_s\" value=\"1\"/>", "only accepted together"),
        (
            "‸<float name=\"albedo\" value=\"1\"/><float name=\"sigma_a\" value=\"1\"/><float name=\"sigma_s\" value=\"1\"/>",
            "contradicts",
        ),
        ("<phase type=\"hg\">‸<float name=\"g\" value=\"1\"/></phase>", "between -1 and 1"),
        ("<phase type=\"hg\">‸<float name=\"g\" value=\"-1.5\"/></phase>", "between -1 and 1"),
        ("‸<phase type=\"sggx\"/>", "accepted types: isotropic, hg, rayleigh, blendphase, tabphase"),
        (
            "‸<phase type=\"blendphase\"><phase type=\"hg\"/><phase type=\"hg\"/></phase>",
            "needs <float name=\"weight\"",
        ),
        (
            "<phase type=\"blendphase\">‸<float name=\"weight\" value=\"1.5\"/><phase type=\"hg\"/><phase type=\"hg\"/></phase>",
            "weight is 1.5; it must lie between 0 and 1",
        ),
        (
            "‸<phase type=\"blendphase\"><float name=\"weight\" value=\"1\"/><phase type=\"hg\"/></phase>",
            "holds 1 phase functions",
        ),
        ("‸<phase type=\"tabphase\"/>", "needs <string name=\"values\""),
        ("<phase type=\"tabphase\">‸<string name=\"values\" value=\"1\"/></phase>", "at least two numbers"),
        ("<phase type=\"tabphase\">‸<string name=\"values\" value=\"1, -1\"/></phase>", "not negative"),
        ("<phase type=\"tabphase\">‸<string name=\"values\" value=\"0 0\"/></phase>", "one greater than 0"),
        (
            "<phase type=\"tabphase\">‸<string name=\"values\" value=\"1 nan\"/></phase>",
            "\"nan\" is not a finite number",
        ),
        ("‸<rgb name=\"emission\" value=\"0 -1 0\"/>", "emission is [0, -1, 0]; it must not be negative"),
        ("<phase type=\"isotropic\">‸<float name=\"g\" value=\"0\"/></phase>", "no property \"g\""),
        ("‸<float name=\"sigmat\" value=\"0\"/>", "did you mean \"sigma_t\"?"),
    ] {
        table(&[(&inside(text), &[part])]);
    }
    table(&[
        ("‸<medium type=\"cloud\" id=\"m\"/>", &["accepted types: homogeneous, heterogeneous"]),
        (
            "‸<medium type=\"homogeneous\"><float name=\"sigma_t\" value=\"1e300\"/><float name=\"scale\" value=\"1e300\"/></medium>",
            &["overflows"],
        ),
        ("‸<bsdf type=\"principledthin\" id=\"b\"/>", &["accepted types: diffuse, null, twosided, dielectric"]),
        ("‸<bsdf type=\"roughdielectrik\" id=\"b\"/>", &["did you mean \"roughdielectric\"?"]),
        ("<bsdf type=\"twosided\">‸<bsdf type=\"null\"/></bsdf>", &["cannot hold <bsdf type=\"null\">"]),
        ("‸<bsdf type=\"twosided\"/>", &["holds 0 BSDFs"]),
        (
            "‸<bsdf type=\"twosided\"><bsdf type=\"diffuse\"/><bsdf type=\"diffuse\"/><bsdf type=\"diffuse\"/></bsdf>",
            &["holds 3 BSDFs"],
        ),
        ("‸<bsdf type=\"blendbsdf\"><bsdf type=\"diffuse\"/><bsdf type=\"diffuse\"/></bsdf>", &["needs a weight"]),
        (
            "‸<bsdf type=\"blendbsdf\"><float name=\"weight\" value=\"0.5\"/><bsdf type=\"diffuse\"/></bsdf>",
            &["holds 1 BSDFs; it must hold two"],
        ),
        (
            "<bsdf type=\"blendbsdf\">‸<float name=\"weight\" value=\"1.5\"/><bsdf type=\"diffuse\"/><bsdf type=\"diffuse\"/></bsdf>",
            &["between 0 and 1"],
        ),
        (
            "<bsdf type=\"blendbsdf\" id=\"a\"><float name=\"weight\" value=\"0.5\"/>‸<ref id=\"a\"/><ref id=\"a\"/></bsdf>",
            &["is inside of itself"],
        ),
        ("<bsdf type=\"mask\" id=\"a\">‸<ref id=\"a\"/></bsdf>", &["is inside of itself"]),
        ("‸<bsdf type=\"normalmap\"><bsdf type=\"diffuse\"/></bsdf>", &["needs <texture name=\"normalmap\""]),
        ("‸<bsdf type=\"bumpmap\"><bsdf type=\"diffuse\"/></bsdf>", &["holds 0 textures; it must hold one"]),
        (
            "<bsdf type=\"bumpmap\">‸<texture type=\"checkerboard\"/><bsdf type=\"diffuse\"/></bsdf>",
            &["must change smoothly"],
        ),
        (
            "<bsdf type=\"normalmap\"><rgb name=\"normalmap\" value=\"0.5, 0.5, 1\"/>‸<bsdf type=\"null\"/></bsdf>",
            &["cannot hold <bsdf type=\"null\">"],
        ),
        (
            "<bsdf type=\"twosided\">‸<bsdf type=\"blendbsdf\"><float name=\"weight\" value=\"0.5\"/><bsdf type=\"dielectric\"/><bsdf type=\"diffuse\"/></bsdf></bsdf>",
            &["lets light through"],
        ),
        ("<bsdf type=\"diffuse\">‸<rgb name=\"reflectance\" value=\"1.5\"/></bsdf>", &["between 0 and 1"]),
        ("<bsdf type=\"null\">‸<rgb name=\"reflectance\" value=\"1\"/></bsdf>", &["accepted: nothing"]),
    ]);
}

#[test]
fn lights_and_integrators() {
    table(&[
        ("‸<emitter type=\"area\"/>", &["must be inside the <shape>"]),
        (
            "‸<emitter type=\"sunsky\"/>",
            &["not supported", "accepted types: area, point, spot, directional, constant, envmap"],
        ),
        ("<emitter type=\"constant\">‸<rgb name=\"radiance\" value=\"1 -1 1\"/></emitter>", &["must not be negative"]),
        (
            "<emitter type=\"point\"><point name=\"position\" x=\"0\" y=\"0\" z=\"0\"/>‸<transform name=\"to_world\"/></emitter>",
            &["not both"],
        ),
        ("‸<integrator type=\"depth\"/>", &["accepted types: volpath, volpathmis, path, ptracer, direct"]),
        ("<integrator type=\"path\">‸<integer name=\"max_depth\" value=\"0\"/></integrator>", &["at least 1"]),
        ("<integrator type=\"path\">‸<integer name=\"max_depth\" value=\"-2\"/></integrator>", &["-1 (no limit)"]),
        ("<integrator type=\"path\">‸<integer name=\"rr_depth\" value=\"0\"/></integrator>", &["at least 1"]),
        (
            "<integrator type=\"path\">‸<integer name=\"max_depht\" value=\"3\"/></integrator>",
            &["did you mean \"max_depth\"?"],
        ),
        ("<integrator type=\"path\"/>\n‸<integrator type=\"path\"/>", &["only one <integrator>", "scene.xml:2:1"]),
    ]);
}

#[test]
fn sensors() {
    let sensor =
        |inside: &str| format!("<scene version=\"3.0.0\"><sensor type=\"perspective\">\n{inside}</sensor></scene>");
    let fov = "<float name=\"fov\" value=\"40\"/>";
    let film = |inside: &str| format!("{fov}<film type=\"hdrfilm\">{inside}</film>");
    let film_size = |size: &str| {
        format!(
            "{fov}‸<film type=\"hdrfilm\"><integer name=\"width\" value=\"{size}\"/><integer name=\"height\" value=\"{size}\"/></film>"
        )
    };
    for (inside, parts) in [
        ("‸<float name=\"fov\" value=\"0\"/>".to_owned(), &["between 0 and 180"][..]),
        ("‸<float name=\"fov\" value=\"180\"/>".to_owned(), &["between 0 and 180"]),
        (format!("{fov}‸<string name=\"fov_axis\" value=\"z\"/>"), &["x, y, smaller, larger, diagonal"]),
        (format!("{fov}‸<string name=\"focal_length\" value=\"50mm\"/>"), &["not both"]),
        ("‸<string name=\"focal_length\" value=\"wide\"/>".to_owned(), &["millimetres"]),
        (format!("{fov}‸<float name=\"near_clip\" value=\"0\"/>"), &["0 < near_clip < far_clip"]),
        (format!("{fov}‸<float name=\"far_clip\" value=\"0.001\"/>"), &["0 < near_clip < far_clip"]),
        (format!("{fov}‸<transform name=\"to_world\"><scale x=\"2\"/></transform>"), &["stretches or shears"]),
        (format!("{fov}‸<transform name=\"to_world\"><scale value=\"0\"/></transform>"), &["stretches or shears"]),
        (format!("{fov}‸<float name=\"aperture_radius\" value=\"1\"/>"), &["no property \"aperture_radius\""]),
        (format!("{fov}<medium type=\"homogeneous\"/>‸<medium type=\"homogeneous\"/>"), &["only one <medium>"]),
        (format!("{fov}‸<film type=\"ldrfilm\"/>"), &["accepted types: hdrfilm"]),
        (format!("{fov}‸<sampler type=\"sobol\"/>"), &["accepted types: independent"]),
        (
            format!("{fov}<sampler type=\"independent\">‸<integer name=\"sample_count\" value=\"0\"/></sampler>"),
            &["between 1 and"],
        ),
        (film("‸<integer name=\"width\" value=\"0\"/>"), &["between 1 and 65535"]),
        (film("‸<integer name=\"width\" value=\"65536\"/>"), &["between 1 and 65535"]),
        (film("‸<integer name=\"height\" value=\"-5\"/>"), &["between 1 and 65535"]),
        (film_size("60000"), &["60000 x 60000", "limit of 268435456"]),
        (film("‸<integer name=\"crop_offset_x\" value=\"5\"/>"), &["does not lie in the film", "crop_width 768"]),
        (film("‸<integer name=\"crop_width\" value=\"0\"/>"), &["does not lie in the film"]),
        (
            film("<integer name=\"crop_offset_y\" value=\"-1\"/>‸<integer name=\"crop_height\" value=\"2\"/>"),
            &["does not lie"],
        ),
        (film("‸<rfilter type=\"bx\"/>"), &["did you mean \"box\"?"]),
        (film("<rfilter type=\"tent\">‸<float name=\"radius\" value=\"0\"/></rfilter>"), &["greater than 0"]),
        (film("<rfilter type=\"tent\">‸<float name=\"stddev\" value=\"1\"/></rfilter>"), &["no property \"stddev\""]),
        (film("<rfilter type=\"lanczos\">‸<integer name=\"lobes\" value=\"99\"/></rfilter>"), &["between 1 and"]),
        (film("<rfilter type=\"mitchell\">‸<float name=\"B\" value=\"9\"/></rfilter>"), &["between -1 and 1"]),
        (film("‸<string name=\"pixel_format\" value=\"cmyk\"/>"), &["accepted: rgb, rgba"]),
        (film("‸<string name=\"component_format\" value=\"uint32\"/>"), &["accepted: float32, float16"]),
        (film("‸<string name=\"file_format\" value=\"pfm\"/>"), &["accepted: openexr"]),
    ] {
        refused(&sensor(&inside), parts).unwrap_or_else(|failure| panic!("{failure}"));
    }
    refused("<scene version=\"3.0.0\">‸<sensor type=\"distant\"/></scene>", &["accepted types: perspective"]).unwrap();
    let of = |plugin: &str, inside: &str| {
        format!("<scene version=\"3.0.0\"><sensor type=\"{plugin}\">{inside}</sensor></scene>")
    };
    let lens = |inside: &str| of("thinlens", &format!("{fov}{inside}"));
    for (text, parts) in [
        (lens("‸<float name=\"aperture_radius\" value=\"0\"/>"), &["greater than 0"][..]),
        (
            lens("<float name=\"aperture_radius\" value=\"1\"/>‸<float name=\"focus_distance\" value=\"-1\"/>"),
            &["greater than 0"],
        ),
        (
            of("orthographic", "‸<transform name=\"to_world\"><matrix value=\"1 1 0 0 1 0 0 0 1\"/></transform>"),
            &["shears"],
        ),
        (of("orthographic", "‸<transform name=\"to_world\"><scale value=\"0\"/></transform>"), &["no inverse"]),
        (of("orthographic", "‸<float name=\"fov\" value=\"1\"/>"), &["no property \"fov\""]),
    ] {
        refused(&text, parts).unwrap_or_else(|failure| panic!("{failure}"));
    }
}
