//! Every plugin and property, one by one.

use glam::{DMat4, DVec3};
use tyndall::scene::*;

use crate::{LIGHT, SENSOR, parse, scene, warning, with_warnings};

fn medium(inside: &str) -> Medium {
    let body = format!(
        r#"<shape type="sphere"><bsdf type="null"/><medium name="interior" type="homogeneous">{inside}</medium></shape>"#
    );
    scene(&body).media[0].clone()
}

fn bsdf(inside: &str) -> Bsdf {
    scene(&format!(r#"<shape type="sphere">{inside}</shape>"#)).shapes[0].bsdf.clone()
}

fn light(inside: &str) -> Light {
    let text = format!("<scene version=\"3.0.0\">{SENSOR}{inside}</scene>");
    parse(&text).unwrap().scene.lights[0].clone()
}

fn integrator(inside: &str) -> Integrator {
    scene(inside).integrator
}

#[test]
fn media() {
    let m = medium("");
    assert_eq!((m.sigma_t, m.albedo, m.phase), (DVec3::ONE, DVec3::splat(0.75), Phase::Isotropic));
    assert_eq!(m.emission, DVec3::ZERO);

    let m = medium(
        r#"<rgb name="sigma_t" value="1 2 30"/><float name="scale" value="2"/><float name="albedo" value="0.5"/>
        <boolean name="has_spectral_extinction" value="false"/><boolean name="sample_emitters" value="FALSE"/>
        <phase type="hg"><float name="g" value="-0.25"/></phase>"#,
    );
    assert_eq!((m.sigma_t, m.albedo), (DVec3::new(2.0, 4.0, 60.0), DVec3::splat(0.5)));
    assert_eq!(m.phase, Phase::HenyeyGreenstein { g: -0.25 });

    assert_eq!(medium(r#"<phase type="hg"/>"#).phase, Phase::HenyeyGreenstein { g: 0.8 });
    assert_eq!(medium(r#"<spectrum name="sigma_t" value="3"/>"#).sigma_t, DVec3::splat(3.0));
    assert_eq!(medium(r#"<integer name="sigma_t" value="3"/>"#).sigma_t, DVec3::splat(3.0));

    let m = medium(r#"<rgb name="emission" value="1 2 3"/><float name="scale" value="7"/>"#);
    assert_eq!((m.sigma_t, m.emission), (DVec3::splat(7.0), DVec3::new(1.0, 2.0, 3.0)));

    // The albedo of a channel without extinction is 0, not 0/0.
    let m = medium(r#"<rgb name="sigma_s" value="1 2 0"/><rgb name="sigma_a" value="3 2 0"/>"#);
    assert_eq!((m.sigma_t, m.albedo), (DVec3::new(4.0, 4.0, 0.0), DVec3::new(0.25, 0.5, 0.0)));
}

#[test]
fn one_medium_for_all_references() {
    let s = scene(
        r#"<medium type="homogeneous" id="fog"/><medium type="homogeneous" id="ice"><float name="sigma_t" value="9"/></medium>
        <shape type="sphere"><bsdf type="null"/><ref name="interior" id="ice"/><ref name="exterior" id="fog"/></shape>
        <shape type="cube"><bsdf type="null"/><ref name="interior" id="fog"/></shape>"#,
    );
    assert_eq!(s.media.len(), 2);
    let ice = MediumId(s.media.iter().position(|m| m.name == "ice").unwrap() as u32);
    let fog = MediumId(s.media.iter().position(|m| m.name == "fog").unwrap() as u32);
    assert_eq!(s.shapes[0].boundary, Some(Boundary { interior: Some(ice), exterior: Some(fog) }));
    assert_eq!(s.shapes[1].boundary, Some(Boundary { interior: Some(fog), exterior: None }));
}

#[test]
fn bsdfs() {
    let one_sided = |v: f64| Bsdf::Diffuse { reflectance: DVec3::splat(v).into(), two_sided: false };
    assert_eq!(bsdf(""), one_sided(0.5));
    assert_eq!(bsdf(r#"<bsdf type="diffuse"/>"#), one_sided(0.5));
    assert_eq!(bsdf(r#"<bsdf type="diffuse"><float name="reflectance" value="0.25"/></bsdf>"#), one_sided(0.25));
    assert_eq!(bsdf(r#"<bsdf type="diffuse"><spectrum name="reflectance" value="0.25"/></bsdf>"#), one_sided(0.25));
    assert_eq!(bsdf(r##"<bsdf type="diffuse"><rgb name="reflectance" value="#ffffff"/></bsdf>"##), one_sided(1.0));
    assert_eq!(bsdf(r#"<bsdf type="null"/>"#), Bsdf::Null);
    let two_sided = Bsdf::Diffuse { reflectance: DVec3::new(0.1, 0.2, 0.3).into(), two_sided: true };
    let inner = r#"<bsdf type="diffuse"><rgb name="reflectance" value="0.1, 0.2, 0.3"/></bsdf>"#;
    assert_eq!(bsdf(&format!(r#"<bsdf type="twosided">{inner}</bsdf>"#)), two_sided);
}

#[test]
fn lamps() {
    let lamp = |inside: &str| {
        let s = scene(&format!(r#"<shape type="rectangle"><emitter type="area">{inside}</emitter></shape>"#));
        (s.shapes[0].emission.unwrap(), s.shapes[0].bsdf.clone())
    };
    let black = || Bsdf::Diffuse { reflectance: DVec3::ZERO.into(), two_sided: false };
    assert_eq!(lamp(""), (DVec3::ONE, black()));
    assert_eq!(lamp(r#"<rgb name="radiance" value="17,12,4"/>"#), (DVec3::new(17.0, 12.0, 4.0), black()));
    assert_eq!(lamp(r#"<float name="radiance" value="3"/>"#), (DVec3::splat(3.0), black()));
    // What Mitsuba 3.9.1 prints for the same element.
    let (radiance, _) = lamp(r#"<spectrum name="radiance" value="3"/>"#);
    assert!((radiance - DVec3::new(3.61438, 2.84487, 2.72675)).abs().max_element() < 1e-5, "{radiance}");
}

#[test]
fn lights() {
    let Light::Point { position, intensity } = light(r#"<emitter type="point"/>"#) else { panic!() };
    assert_eq!((position, intensity), (DVec3::ZERO, DVec3::ONE));
    let Light::Point { position, intensity } = light(
        r#"<emitter type="point"><point name="position" x="1" y="2" z="3"/><rgb name="intensity" value="4"/></emitter>"#,
    ) else {
        panic!()
    };
    assert_eq!((position, intensity), (DVec3::new(1.0, 2.0, 3.0), DVec3::splat(4.0)));
    let moved = r#"<transform name="to_world"><scale value="9"/><translate x="5"/></transform>"#;
    let Light::Point { position, .. } = light(&format!(r#"<emitter type="point">{moved}</emitter>"#)) else { panic!() };
    assert_eq!(position, DVec3::new(5.0, 0.0, 0.0));
    let Light::Constant { radiance } =
        light(r#"<emitter type="constant"><rgb name="radiance" value="1 2 3"/></emitter>"#)
    else {
        panic!()
    };
    assert_eq!(radiance, DVec3::new(1.0, 2.0, 3.0));
}

#[test]
fn integrators_around_others() {
    let inner = r#"<integrator type="path"><integer name="max_depth" value="5"/></integrator>"#;
    assert_eq!(integrator(&format!(r#"<integrator type="moment">{inner}</integrator>"#)).max_depth, Some(5));
    let aov = format!(r#"<integrator type="aov"><string name="aovs" value="d:depth"/>{inner}</integrator>"#);
    assert_eq!(scene(&aov).aovs, [Aov { name: "d".to_owned(), kind: AovKind::Depth }]);
    // Channels of second moments have Mitsuba's names.
    let named = |name: &str| aov.replace("<integrator type=\"path\"", &format!("<integrator {name}type=\"path\""));
    for (body, moments) in [
        (aov.clone(), None),
        (format!(r#"<integrator type="moment">{inner}</integrator>"#), Some("_arg_0")),
        (
            format!(r#"<integrator type="moment">{}</integrator>"#, inner.replace("type=", "name=\"a\" type=")),
            Some("a"),
        ),
        (format!(r#"<integrator type="moment">{aov}</integrator>"#), Some("_arg_0._arg_0")),
        (format!(r#"<integrator type="moment">{}</integrator>"#, named("name=\"b\" ")), Some("_arg_0.b")),
    ] {
        assert_eq!(scene(&body).moments.as_deref(), moments, "{body}");
    }
    let error = |body: &str| {
        let text = format!("<scene version=\"3.0.0\">{}{}{body}</scene>", crate::SENSOR, crate::LIGHT);
        crate::parse(&text).unwrap_err().to_string()
    };
    for (inside, message) in [
        (String::new(), "holds 0 integrators; it must hold one"),
        (inner.repeat(2), "holds 2 integrators; it must hold one"),
        (r#"<ref id="outer"/>"#.to_owned(), "cannot hold <integrator type=\"moment\">"),
        (r#"<integrator type="depth"/>"#.to_owned(), "<integrator type=\"depth\"> is not supported"),
    ] {
        let text = error(&format!(r#"<integrator type="moment" id="outer">{inside}</integrator>"#));
        assert!(text.contains(message), "{inside}: {text}");
    }
    let clash = aov.replace("d:depth", "m2__arg_0._arg_0:albedo");
    let text = error(&format!(r#"<integrator type="moment">{clash}</integrator>"#));
    assert!(text.contains("aovs has the name \"m2__arg_0._arg_0\", which is that of the second moments"), "{text}");
    let long = inner.replace("type=", &format!("name=\"{}\" type=", "a".repeat(201)));
    let text = error(&format!(r#"<integrator type="moment">{long}</integrator>"#));
    assert!(text.contains("longer than 200 bytes"), "{text}");
    for (aovs, message) in [
        ("d:dephth", "aovs has \"d:dephth\"; accepted: pairs name:type"),
        ("depth", "aovs has \"depth\""),
        ("d:depth,d:uv", "needs a name of its own for each; \"d\" is not"),
        (":depth", "needs a name of its own"),
    ] {
        let text = error(&aov.replace("d:depth", aovs));
        assert!(text.contains(message), "{aovs}: {text}");
    }
    let samples = r#"<integer name="emitter_samples" value="4"/><integer name="bsdf_samples" value="2"/>"#;
    assert_eq!(integrator(&format!(r#"<integrator type="direct">{samples}</integrator>"#)).max_depth, Some(2));
    let timeout = r#"<integrator type="path"><float name="timeout" value="90"/></integrator>"#;
    assert!(warning(timeout).ends_with("the timeout has no effect; use --time-limit 90s"));
    // Mitsuba's surface integrators see no media, in a wrapper or not.
    let fog = r#"<shape type="cube"><bsdf type="null"/><medium type="homogeneous" name="interior"/></shape>"#;
    assert!(warning(&format!(r#"{fog}<integrator type="moment">{inner}</integrator>"#)).contains("would ignore"));
}

#[test]
fn integrators() {
    assert_eq!(integrator(""), Integrator::default());
    for plugin in ["volpath", "volpathmis", "path"] {
        assert_eq!(integrator(&format!(r#"<integrator type="{plugin}"/>"#)), Integrator::default());
    }
    let inside = r#"<integer name="max_depth" value="7"/><integer name="rr_depth" value="9"/>
        <boolean name="hide_emitters" value="true"/>"#;
    assert_eq!(
        integrator(&format!(r#"<integrator type="volpath">{inside}</integrator>"#)),
        Integrator { max_depth: Some(7), rr_depth: 9, hide_emitters: true }
    );
    let unlimited = r#"<integrator type="path"><integer name="max_depth" value="-1"/></integrator>"#;
    assert_eq!(integrator(unlimited).max_depth, None);
    assert_eq!(integrator(r#"<integrator type="direct"/>"#).max_depth, Some(2));
}

#[test]
fn transforms_compose_in_the_order_of_the_file() {
    let matrix = |inside: &str| {
        let body = format!(r#"<shape type="rectangle"><transform name="to_world">{inside}</transform></shape>"#);
        let Geometry::Mesh(mesh) = scene(&body).shapes[0].geometry.clone() else { panic!() };
        mesh.positions
    };
    let corners = |m: DMat4| {
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, y)| m.transform_point3(DVec3::new(x, y, 0.0)))
            .to_vec()
    };
    let translate = DMat4::from_translation(DVec3::new(1.0, 2.0, 3.0));
    let scale = DMat4::from_scale(DVec3::new(2.0, 1.0, 1.0));
    let turn = DMat4::from_rotation_z(90f64.to_radians());
    for (inside, expected) in [
        ("", DMat4::IDENTITY),
        (r#"<translate x="1" y="2" z="3"/>"#, translate),
        (r#"<translate value="1,2,3"/>"#, translate),
        (r#"<scale value="2"/>"#, DMat4::from_scale(DVec3::splat(2.0))),
        (r#"<scale x="2"/>"#, scale),
        (r#"<scale x="2"/><translate value="1 2 3"/>"#, translate * scale),
        (r#"<translate value="1 2 3"/><scale x="2"/>"#, scale * translate),
        // An axis of any length.
        (r#"<rotate z="5" angle="90"/>"#, turn),
        (r#"<rotate value="0 0 1" angle="90"/><scale x="2"/>"#, scale * turn),
        (r#"<matrix value="1 0 0 1  0 1 0 2  0 0 1 3  0 0 0 1"/>"#, translate),
        (r#"<matrix value="0 -1 0  1 0 0  0 0 1"/>"#, turn),
        (
            r#"<lookat origin="1 2 3" target="1 2 4" up="0 1 0"/>"#,
            look_at(DVec3::new(1.0, 2.0, 3.0), DVec3::new(1.0, 2.0, 4.0), DVec3::Y),
        ),
        // What Mitsuba 3.9.1 makes of a missing up vector.
        (r#"<look_at origin="0 0 0" target="0 1 0"/>"#, look_at(DVec3::ZERO, DVec3::Y, DVec3::X)),
    ] {
        for (got, want) in matrix(inside).into_iter().zip(corners(expected)) {
            assert!((got - want).length() < 1e-12, "{inside}: {got} instead of {want}");
        }
    }
}

#[test]
fn parameters() {
    let text = format!(
        r#"<scene version="3.0.0">{SENSOR}{LIGHT}
        <default name="r" value="2"/><default name="re" value="0.5"/><default name="kind" value="sphere"/>
        <default name="twice" value="$r"/>
        <shape type="$kind"><float name="radius" value="$r$twice.5"/>
        <bsdf type="diffuse"><rgb name="reflectance" value="$re, $re, 0.$r"/></bsdf></shape>
        <shape type="sphere" id="a\$b"/></scene>"#
    );
    let read = |overrides: &[(&str, &str)]| {
        let overrides: Vec<_> = overrides.iter().map(|(n, v)| ((*n).to_owned(), (*v).to_owned())).collect();
        let shapes = mitsuba::parse_str(&text, std::path::Path::new("scene.xml"), &overrides).unwrap().scene.shapes;
        let Geometry::Sphere { radius, .. } = shapes[0].geometry else { panic!() };
        let Bsdf::Diffuse { reflectance: Texture::Constant(reflectance), .. } = shapes[0].bsdf else { panic!() };
        assert_eq!(shapes[1].name, "a$b");
        (radius, reflectance)
    };
    assert_eq!(read(&[]), (22.5, DVec3::new(0.5, 0.5, 0.2)));
    assert_eq!(read(&[("r", "1")]), (11.5, DVec3::new(0.5, 0.5, 0.1)));
    assert_eq!(read(&[("re", "1"), ("twice", "7")]), (27.5, DVec3::new(1.0, 1.0, 0.2)));
}

#[test]
fn an_override_that_nothing_mentions_is_refused() {
    let text = format!(r#"<scene version="3.0.0"><default name="spp" value="1"/>{SENSOR}{LIGHT}</scene>"#);
    let read = |names: &[&str]| {
        let overrides: Vec<_> = names.iter().map(|n| ((*n).to_owned(), "1".to_owned())).collect();
        mitsuba::parse_str(&text, std::path::Path::new("scene.xml"), &overrides).map(drop).map_err(|e| e.to_string())
    };
    assert_eq!(read(&["spp"]), Ok(()));
    assert_eq!(
        read(&["sp"]),
        Err("-D sp: the scene has no such parameter; did you mean \"spp\"?; it has: spp".to_owned())
    );
    assert_eq!(read(&["spp", "spp"]), Err("-D spp: given twice".to_owned()));
}

#[test]
fn what_is_read_differently_warns_with_its_place() {
    for (body, place, text) in [
        (r#"<medium type="homogeneous" id="x"/>"#, ":2:1: ", "the medium \"x\" is never used"),
        (
            r#"<shape type="sphere"><medium name="interior" type="homogeneous"/></shape>"#,
            ":2:1: ",
            "<bsdf type=\"null\"/>",
        ),
        (SENSOR, ":2:1: ", "the first of 2 sensors is used"),
        (
            r#"<emitter type="envmap"><string name="filename" value="textures/negative.exr"/></emitter>"#,
            ":2:1: ",
            "1 pixels of the environment map are negative",
        ),
        (r#"<texture type="checkerboard" id="t"/>"#, ":2:1: ", "the texture \"t\" is never used"),
        (r#"<emitter type="spot"><medium type="homogeneous"/></emitter>"#, ":2:22: ", "found from the geometry"),
        (r#"<emitter type="point"><medium type="homogeneous"/></emitter>"#, ":2:23: ", "found from the geometry"),
    ] {
        let got = warning(body);
        assert!(got.contains("scene.xml") && got.contains(place) && got.contains(text), "{body}\n{got}");
    }
    let fog = r#"<shape type="cube"><bsdf type="null"/><medium name="interior" type="homogeneous"/></shape>"#;
    assert!(warning(&format!("{fog}<integrator type=\"path\"/>")).contains("Mitsuba's \"path\" would ignore"));
    scene(&format!("{fog}<integrator type=\"volpath\"/>"));

    let dark = parse(&format!("<scene version=\"3.0.0\">{SENSOR}</scene>")).unwrap();
    assert!(dark.warnings[0].ends_with("scene.xml:1:1: the scene has no light: the picture will be black"));
    let glow = r#"<medium type="homogeneous"><rgb name="emission" value="1"/></medium>"#;
    let sensor = SENSOR.replace("<film", &format!("{glow}<film"));
    assert_eq!(parse(&format!("<scene version=\"3.0.0\">{sensor}</scene>")).unwrap().warnings, [""; 0]);
    let black = r#"<emitter type="constant"><rgb name="radiance" value="0"/></emitter>"#;
    assert_eq!(parse(&format!("<scene version=\"3.0.0\">{SENSOR}{black}</scene>")).unwrap().warnings.len(), 1);
    assert!(with_warnings("").warnings.is_empty());
}
