//! Spectra become the colours that Mitsuba 3.9.1's variant `scalar_rgb` has for them.

use glam::DVec3;
use tyndall::scene::mitsuba::parse_str;
use tyndall::scene::*;

use crate::{LIGHT, SENSOR, parse, scene, with_warnings};

/// What a constant light with a property `radiance` emits.
fn radiance(spectrum: &str) -> DVec3 {
    let scene = scene(&format!(r#"<emitter type="constant">{spectrum}</emitter>"#));
    let Light::Constant { radiance } = scene.lights[1] else { panic!() };
    radiance
}

fn reflectance(value: &str) -> (DVec3, Vec<String>) {
    let body = format!(r#"<shape type="cube"><bsdf type="diffuse">{value}</bsdf></shape>"#);
    let loaded = with_warnings(&body);
    let Bsdf::Diffuse { reflectance, .. } = &loaded.scene.shapes[0].bsdf else { panic!() };
    (reflectance.constant().unwrap(), loaded.warnings)
}

#[track_caller]
fn close(got: DVec3, expected: [f64; 3]) {
    let difference = (got - DVec3::from(expected)).abs().max_element();
    // Mitsuba prints six digits, of sums in single precision.
    assert!(difference < 5e-6 * got.abs().max_element().max(1.0), "got {got}, expected {expected:?}");
}

#[test]
fn what_emits() {
    for (list, expected) in [
        ("400:1, 700:1", [1.19969, 0.94952, 0.903443]),
        ("360:1, 830:1", [1.20488, 0.948228, 0.909267]),
        ("400:0, 500:1, 700:0.25", [0.549317, 0.847651, 0.443013]),
        ("400:0, 450:1, 500:1, 550:0.5, 600:0.25, 650:2, 700:0.25", [0.881878, 0.545567, 0.803463]),
        ("400:0 500:1 600:.7", [0.0698457, 0.901497, 0.446445]),
        ("400:1, 500:2,700:3", [3.19458, 2.12586, 1.2816]),
    ] {
        close(radiance(&format!(r#"<spectrum name="radiance" value="{list}"/>"#)), expected);
    }
    // Fault: the light of daylight on it would be another colour.
    let samples = [(400.0, 0.0), (500.0, 1.0), (700.0, 0.25)];
    let daylight = spectrum::to_rgb(&samples, spectrum::Illuminant::D65);
    assert!(daylight.distance(DVec3::new(0.549317, 0.847651, 0.443013)) > 0.05, "{daylight}");
}

#[test]
fn what_reflects() {
    for (list, expected) in [
        ("400:0, 450:1, 500:1, 550:0.5, 600:0.25, 650:.2, 700:0.25", [0.0263068, 0.639345, 0.909833]),
        ("400:0.1, 500:.3, 700:0.25", [0.256777, 0.297858, 0.197195]),
        ("400:0.1, 510:.3, 700:0.25", [0.259909, 0.298217, 0.186358]),
        ("400:0.5, 700:0.5", [0.497671, 0.499878, 0.497455]),
        ("300:1, 900:1", [0.998985, 0.998874, 0.998802]),
        ("400:0, 500:1, 700:.25", [0.424832, 0.891647, 0.506384]),
    ] {
        let (color, warnings) = reflectance(&format!(r#"<spectrum name="reflectance" value="{list}"/>"#));
        close(color, expected);
        assert_eq!(warnings, [""; 0]);
    }
    // Out of the gamut: moved to its border, as in Mitsuba, which warns as well.
    for (list, expected) in
        [("500:0, 520:1,540:0", [0.0, 0.246295, 0.0]), ("500:3.0, 520:1,540:0", [0.0, 0.501452, 0.0290807])]
    {
        let (color, warnings) = reflectance(&format!(r#"<spectrum name="reflectance" value="{list}"/>"#));
        close(color, expected);
        assert!(warnings.len() == 1 && warnings[0].contains("is outside of its gamut; it becomes"), "{warnings:?}");
    }
}

#[test]
fn coefficients_and_indices() {
    // Mitsuba makes reflectances of the coefficients of media, and 1 of what is greater; ours are not cut off.
    let fog = |sigma_t: &str, albedo: &str| {
        let body = format!(
            r#"<shape type="cube"><bsdf type="null"/><medium type="homogeneous" name="interior">
                <spectrum name="sigma_t" value="{sigma_t}"/><spectrum name="albedo" value="{albedo}"/></medium></shape>"#
        );
        scene(&body).media.remove(0)
    };
    let medium = fog("400:.3, 500:.1, 700:.2", "400:.3, 500:.1, 700:.2");
    close(medium.sigma_t, [0.177498, 0.111821, 0.198983]);
    close(medium.albedo, [0.177498, 0.111821, 0.198983]);
    close(fog("400:3, 500:1, 700:2", "0.5").sigma_t, [1.77498, 1.11821, 1.98983]);
    let metal = r#"<shape type="cube"><bsdf type="conductor"><spectrum name="eta" value="400:3, 500:1, 700:2"/>
        <spectrum name="k" value="400:3, 500:1, 700:2"/></bsdf></shape>"#;
    let Bsdf::Conductor { eta, k, .. } = scene(metal).shapes.remove(0).bsdf else { panic!() };
    close(eta, [1.77498, 1.11821, 1.98983]);
    assert_eq!(eta, k);
}

#[test]
fn files() {
    let folder = tempfile::tempdir().unwrap();
    let read = |text: &str| {
        std::fs::write(folder.path().join("a.spd"), text).unwrap();
        let body = r#"<emitter type="constant"><spectrum name="radiance" filename="a.spd"/></emitter>"#;
        let scene = format!("<scene version=\"3.0.0\">{SENSOR}{body}</scene>");
        parse_str(&scene, &folder.path().join("scene.xml"), &[]).map_err(|error| error.to_string()).map(|loaded| {
            let Light::Constant { radiance } = loaded.scene.lights[0] else { panic!() };
            radiance
        })
    };
    close(read("# a lamp\n400 0\n\n500\t1 # here\r\n 700.0 .25\n").unwrap(), [0.549317, 0.847651, 0.443013]);
    for (text, message) in [
        ("400 1\n500 x\n", "a.spd:2:1: \"x\" is not a number (used at"),
        ("400 1\n500\n", "a.spd:2:1: 1 numbers; a line has a wavelength and a value"),
        ("400 1\n500 1 1\n", "a.spd:2:1: 3 numbers"),
        ("400 1\n400 1\n", "a.spd:2:1: wavelengths must ascend"),
        ("400 1\n500 inf\n", "is not a finite number"),
        ("400 1\n", "needs at least two wavelengths; this one has 1"),
        ("", "needs at least two wavelengths; this one has 0"),
    ] {
        let error = read(text).unwrap_err();
        assert!(error.contains(message), "{text:?}: {error}");
    }
    std::fs::remove_file(folder.path().join("a.spd")).unwrap();
    let missing = r#"<emitter type="constant"><spectrum name="radiance" filename="missing.spd"/></emitter>"#;
    let error = parse(&format!("<scene version=\"3.0.0\">{SENSOR}{missing}</scene>")).unwrap_err().to_string();
    assert!(error.contains("cannot read the spectrum") && error.contains("missing.spd"), "{error}");
}

#[test]
fn plugins() {
    let plugin =
        |kind: &str, inside: &str| radiance(&format!(r#"<spectrum name="radiance" type="{kind}">{inside}</spectrum>"#));
    // What `scalar_rgb` renders of these two.
    assert_eq!(plugin("uniform", r#"<float name="value" value="3"/>"#), DVec3::splat(3.0));
    assert_eq!(plugin("d65", ""), DVec3::ONE);
    let tinted = plugin("d65", r#"<rgb name="color" value="1 2 3"/><float name="scale" value="2"/>"#);
    assert_eq!(tinted, DVec3::new(2.0, 4.0, 6.0));
    // Those that it cannot render mean what the same list means.
    let list = radiance(r#"<spectrum name="radiance" value="400:1, 500:2, 600:3, 700:4"/>"#);
    let regular = r#"<float name="wavelength_min" value="400"/><float name="wavelength_max" value="700"/><string name="values" value="1, 2, 3, 4"/>"#;
    assert!(plugin("regular", regular).distance(list) < 1e-12);
    let irregular = r#"<string name="wavelengths" value="400 500 600 700"/><string name="values" value="1 2 3 4"/>"#;
    assert_eq!(plugin("irregular", irregular), list);
    assert_eq!(plugin("blackbody", r#"<float name="temperature" value="5000"/>"#), spectrum::blackbody(5000.0));
    // Elsewhere as well, and by reference.
    let (color, _) =
        reflectance(r#"<spectrum name="reflectance" type="uniform"><float name="value" value="0.25"/></spectrum>"#);
    assert_eq!(color, DVec3::splat(0.25));
}

#[test]
fn errors() {
    for (value, message) in [
        (r#"<spectrum name="radiance" value="400:1"/>"#, "needs at least two wavelengths; this one has 1"),
        (r#"<spectrum name="radiance" value="400:1, 400:2"/>"#, "wavelengths must ascend, but 400 is followed by 400"),
        (r#"<spectrum name="radiance" value="400:1 500"/>"#, "\"500\" is not a wavelength and a value"),
        (r#"<spectrum name="radiance" value="400:1, x:2"/>"#, "\"x\" is not a number"),
        (r#"<spectrum name="radiance" value="1, 2, 3"/>"#, "a <spectrum> is one number for all wavelengths, or like"),
        (
            r#"<spectrum name="radiance" type="sun"/>"#,
            "<spectrum type=\"sun\"> is not supported; accepted types: uniform",
        ),
        (r#"<spectrum name="radiance" type="blackbody"/>"#, "needs <float name=\"temperature\"/>"),
        (
            r#"<spectrum name="radiance" type="blackbody"><float name="temperature" value="0"/></spectrum>"#,
            "temperature is 0 K; it must be greater than 0",
        ),
        (
            r#"<spectrum name="radiance" type="uniform"><float name="valued" value="1"/></spectrum>"#,
            "did you mean \"value\"?",
        ),
        (
            r#"<spectrum name="radiance" type="irregular"><string name="wavelengths" value="400 500"/><string name="values" value="1"/></spectrum>"#,
            "there are 2 wavelengths but 1 values",
        ),
        (r#"<spectrum name="sampling_weight" type="d65"/>"#, "\"sampling_weight\" is given as <spectrum type=\"d65\">"),
    ] {
        let text = format!("<scene version=\"3.0.0\">{SENSOR}<emitter type=\"constant\">{value}</emitter></scene>");
        let error = parse(&text).unwrap_err().to_string();
        assert!(error.contains(message), "{value}\n{error}");
    }
    let wall = r#"<bsdf type="diffuse"><spectrum name="reflectance" type="blackbody"><float name="temperature" value="5000"/></spectrum></bsdf>"#;
    let error = parse(&format!("<scene version=\"3.0.0\">{SENSOR}{LIGHT}{wall}</scene>")).unwrap_err().to_string();
    assert!(error.contains("only what emits can have the spectrum of a black body"), "{error}");
}
