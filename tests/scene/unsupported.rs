//! What kernels cannot render yet is refused with its name before anything is rendered.

use tyndall::pack::{PackError, Packed};

use crate::{data, scene};

fn refusal(body: &str) -> Option<String> {
    match Packed::new(&scene(body), 0) {
        Ok(_) => None,
        Err(error @ PackError::Unsupported { .. }) => Some(error.to_string()),
        Err(other) => panic!("{body}: {other}"),
    }
}

#[test]
fn nothing_is_left_out_silently() {
    let shape = |bsdf: &str| format!(r#"<shape type="rectangle" id="thing">{bsdf}</shape>"#);
    let inside = r#"<bsdf type="diffuse"/>"#;
    let masked = format!(r#"<bsdf type="mask">{inside}</bsdf>"#);
    assert_eq!(refusal(&shape(&masked)), None);
    let two = |first: &str, second: &str| {
        format!(r#"<bsdf type="blendbsdf"><float name="weight" value="0.5"/>{first}{second}</bsdf>"#)
    };
    let nested = two(inside, &two(inside, inside));
    assert_eq!(refusal(&shape(&nested)), None);
    assert_eq!(
        refusal(&shape(&two(&nested, &nested))).unwrap(),
        "the BSDF of two parts each of which has several parts of \"thing\" cannot be rendered yet"
    );
    assert_eq!(
        refusal(&shape(&two(&masked, inside))).unwrap(),
        "the mask or null inside of a BSDF of two parts of \"thing\" cannot be rendered yet"
    );
    let twice = format!(r#"<bsdf type="mask">{masked}</bsdf>"#);
    assert_eq!(refusal(&shape(&twice)).unwrap(), "the mask inside of a mask of \"thing\" cannot be rendered yet");
    for plugin in
        ["roughplastic", "dielectric", "thindielectric", "roughdielectric", "conductor", "roughconductor", "plastic"]
    {
        assert_eq!(refusal(&shape(&format!(r#"<bsdf type="{plugin}"/>"#))), None);
    }
    let brushed =
        r#"<bsdf type="roughconductor"><float name="alpha_u" value="0.1"/><float name="alpha_v" value="0.2"/></bsdf>"#;
    assert_eq!(refusal(&shape(brushed)), None);
    let checker = r#"<bsdf type="diffuse"><texture type="checkerboard" name="reflectance"/></bsdf>"#;
    assert_eq!(refusal(&shape(checker)), None);
    assert_eq!(refusal(&shape(inside)), None);
    let medium = |inside: &str| {
        format!(
            r#"<shape type="cube"><bsdf type="null"/><medium type="homogeneous" name="interior" id="fog">{inside}</medium></shape>"#
        )
    };
    let hg = r#"<phase type="hg"/>"#;
    for phase in [
        hg,
        r#"<phase type="rayleigh"/>"#,
        &format!(r#"<phase type="blendphase"><float name="weight" value="0.5"/>{hg}{hg}</phase>"#),
        r#"<phase type="tabphase"><string name="values" value="1 1"/></phase>"#,
    ] {
        assert_eq!(refusal(&medium(phase)), None);
    }
    assert_eq!(refusal(&medium(r#"<rgb name="emission" value="1"/>"#)), None);
    let sky = r#"<emitter type="envmap"><string name="filename" value="textures/sky.exr"/></emitter>"#;
    for body in [r#"<emitter type="spot"/>"#, r#"<emitter type="directional"/>"#, sky] {
        assert_eq!(refusal(body), None);
    }
}

#[test]
fn vertex_normals_are_used_unless_the_scene_says_otherwise() {
    let packed = |inside: &str| {
        let body = format!(r#"<shape type="obj"><string name="filename" value="meshes/ball.obj"/>{inside}</shape>"#);
        Packed::new(&scene(&body), 0).unwrap()
    };
    assert!(data("meshes/ball.obj").exists());
    let smooth = packed("");
    assert!(smooth.features.shading_normals && smooth.warnings.is_empty(), "{:?}", smooth.warnings);
    // One entry for each primitive, in the order of the tree: every normal belongs to its corner.
    assert_eq!(smooth.corners.len(), smooth.primitives.len());
    for (corners, primitive) in smooth.corners.iter().zip(&smooth.primitives) {
        let flat = (primitive.b - primitive.a).cross(primitive.c - primitive.a);
        assert!(corners.normal_a.dot(flat) > 0.0 && corners.normal_b.dot(flat) > 0.0, "{corners:?}");
    }
    for inside in [r#"<boolean name="face_normals" value="true"/>"#, r#"<bsdf type="null"/>"#] {
        let flat = packed(inside);
        assert!(!flat.features.shading_normals && flat.corners.is_empty(), "{inside}");
    }
}
