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
    for plugin in ["roughplastic", "mask"] {
        let inside = if plugin == "mask" { inside } else { "" };
        let text = refusal(&shape(&format!(r#"<bsdf type="{plugin}">{inside}</bsdf>"#)));
        assert_eq!(text, Some(format!("the {plugin} BSDF of \"thing\" cannot be rendered yet")));
    }
    for plugin in ["dielectric", "thindielectric", "roughdielectric", "conductor", "roughconductor", "plastic"] {
        assert_eq!(refusal(&shape(&format!(r#"<bsdf type="{plugin}"/>"#))), None);
    }
    let brushed =
        r#"<bsdf type="roughconductor"><float name="alpha_u" value="0.1"/><float name="alpha_v" value="0.2"/></bsdf>"#;
    assert_eq!(refusal(&shape(brushed)).unwrap(), "the anisotropic roughness of \"thing\" cannot be rendered yet");
    let checker = r#"<bsdf type="diffuse"><texture type="checkerboard" name="reflectance"/></bsdf>"#;
    assert_eq!(refusal(&shape(checker)).unwrap(), "the texture of \"thing\" cannot be rendered yet");
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
fn vertex_normals_are_not_used_yet() {
    let warnings = |inside: &str| {
        let body = format!(r#"<shape type="obj"><string name="filename" value="meshes/ball.obj"/>{inside}</shape>"#);
        Packed::new(&scene(&body), 0).unwrap().warnings
    };
    let smooth = warnings("");
    assert!(smooth.len() == 1 && smooth[0].starts_with("flat normals are used for \"meshes/ball.obj\""), "{smooth:?}");
    assert_eq!(warnings(r#"<boolean name="face_normals" value="true"/>"#), [""; 0]);
    assert_eq!(warnings(r#"<bsdf type="null"/>"#), [""; 0]);
    assert!(data("meshes/ball.obj").exists());
}
