//! BSDFs, lights and phase functions: defaults, properties, and numbers of Mitsuba 3.9.1.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};
use tyndall::scene::*;

use crate::{SENSOR, parse, scene};

/// Everything that Mitsuba's textures of 1 are.
fn one() -> Texture {
    DVec3::ONE.into()
}

fn bsdf(plugin: &str, inside: &str) -> Bsdf {
    scene(&format!(r#"<shape type="rectangle"><bsdf type="{plugin}">{inside}</bsdf></shape>"#)).shapes[0].bsdf.clone()
}

fn light(plugin: &str, inside: &str) -> Light {
    let text = format!("<scene version=\"3.0.0\">{SENSOR}<emitter type=\"{plugin}\">{inside}</emitter></scene>");
    parse(&text).unwrap().scene.lights[0].clone()
}

fn phase(inside: &str) -> Phase {
    let body = format!(
        r#"<shape type="sphere"><bsdf type="null"/><medium name="interior" type="homogeneous">{inside}</medium></shape>"#
    );
    scene(&body).media[0].phase.clone()
}

const BECKMANN: Roughness = Roughness { distribution: Distribution::Beckmann, alpha_u: 0.1, alpha_v: 0.1 };

#[test]
fn defaults_are_those_of_mitsuba() {
    let (int_ior, ext_ior) = (1.5046, 1.000_277);
    let (specular_reflectance, specular_transmittance) = (one(), one());
    assert_eq!(
        bsdf("dielectric", ""),
        Bsdf::Dielectric { int_ior, ext_ior, specular_reflectance, specular_transmittance }
    );
    let (specular_reflectance, specular_transmittance) = (one(), one());
    assert_eq!(
        bsdf("thindielectric", ""),
        Bsdf::ThinDielectric { int_ior, ext_ior, specular_reflectance, specular_transmittance }
    );
    let (specular_reflectance, specular_transmittance) = (one(), one());
    assert_eq!(
        bsdf("roughdielectric", ""),
        Bsdf::RoughDielectric { roughness: BECKMANN, int_ior, ext_ior, specular_reflectance, specular_transmittance }
    );
    // A perfect mirror.
    let (eta, k) = (DVec3::ZERO, DVec3::ONE);
    assert_eq!(bsdf("conductor", ""), Bsdf::Conductor { eta, k, specular_reflectance: one(), two_sided: false });
    assert_eq!(bsdf("conductor", r#"<string name="material" value="none"/>"#), bsdf("conductor", ""));
    assert_eq!(
        bsdf("roughconductor", ""),
        Bsdf::RoughConductor { roughness: BECKMANN, eta, k, specular_reflectance: one(), two_sided: false }
    );
    let plastic = || Bsdf::Plastic {
        diffuse_reflectance: DVec3::splat(0.5).into(),
        specular_reflectance: one(),
        int_ior: 1.49,
        ext_ior,
        nonlinear: false,
        two_sided: false,
    };
    assert_eq!(bsdf("plastic", ""), plastic());
    assert_eq!(
        bsdf("roughplastic", ""),
        Bsdf::RoughPlastic {
            roughness: BECKMANN,
            diffuse_reflectance: DVec3::splat(0.5).into(),
            specular_reflectance: one(),
            int_ior: 1.49,
            ext_ior,
            nonlinear: false,
            two_sided: false,
        }
    );
    assert_eq!(
        bsdf("mask", r#"<bsdf type="plastic"/>"#),
        Bsdf::Mask { opacity: DVec3::splat(0.5).into(), nested: Box::new(plastic()) }
    );
}

#[test]
fn properties_of_bsdfs() {
    let Bsdf::Dielectric { int_ior, ext_ior, specular_transmittance, .. } = bsdf(
        "dielectric",
        r#"<string name="intIOR" value="Diamond"/><integer name="ext_ior" value="2"/>
        <rgb name="specular_transmittance" value="0.1 0.2 0.3"/>"#,
    ) else {
        panic!()
    };
    assert_eq!((int_ior, ext_ior), (2.419, 2.0));
    assert_eq!(specular_transmittance.constant(), Some(DVec3::new(0.1, 0.2, 0.3)));

    let Bsdf::RoughConductor { roughness, eta, k, .. } = bsdf(
        "roughconductor",
        r#"<string name="material" value="Cu"/><string name="distribution" value="GGX"/><float name="alpha_u" value="0.2"/>
        <float name="alpha_v" value="1"/><boolean name="sample_visible" value="false"/>"#,
    ) else {
        panic!()
    };
    assert_eq!(roughness, Roughness { distribution: Distribution::Ggx, alpha_u: 0.2, alpha_v: 1.0 });
    assert!(roughness.is_anisotropic() && !BECKMANN.is_anisotropic());
    // What Mitsuba 3.9.1 shows as the parameters of `material` Cu, in the variant scalar_rgb.
    let near = |got: DVec3, want: [f64; 3]| (got - DVec3::from(want)).abs().max_element() < 1e-5;
    assert!(near(eta, [0.201_005, 0.923_750, 1.102_215]) && near(k, [3.913_262, 2.453_045, 2.142_090]), "{eta} {k}");
    assert!(!near(eta, [0.201_025, 0.923_750, 1.102_215]), "another metal is noticed");

    let given = bsdf("conductor", r#"<rgb name="eta" value="0.2 0.9 1.1"/><float name="k" value="3"/>"#);
    let Bsdf::Conductor { eta, k, .. } = given else { panic!() };
    assert_eq!((eta, k), (DVec3::new(0.2, 0.9, 1.1), DVec3::splat(3.0)));

    let Bsdf::RoughPlastic { nonlinear, roughness, .. } =
        bsdf("roughplastic", r#"<boolean name="nonlinear" value="true"/><float name="alpha" value="0.3"/>"#)
    else {
        panic!()
    };
    assert_eq!((nonlinear, roughness.alpha_u, roughness.alpha_v), (true, 0.3, 0.3));

    // Mitsuba takes the mean of a colour: `eval_null_transmission` is 0.7 for this one.
    let Bsdf::Mask { opacity, .. } = bsdf("mask", r#"<rgb name="opacity" value="0.2 0.3 0.4"/><bsdf type="diffuse"/>"#)
    else {
        panic!()
    };
    assert!((opacity.constant().unwrap() - DVec3::splat(0.3)).length() < 1e-12);
}

#[test]
fn two_sides() {
    for plugin in ["diffuse", "conductor", "roughconductor", "plastic", "roughplastic"] {
        let one = bsdf(plugin, "");
        assert!(one.sides_differ(), "{plugin}");
        let two = bsdf("twosided", &format!(r#"<bsdf type="{plugin}"/>"#));
        assert!(!two.sides_differ() && two.plugin() == plugin, "{plugin}");
        assert_eq!(one.two_sided(), Some(two));
    }
    let leaf = bsdf("mask", r#"<bsdf type="twosided"><bsdf type="diffuse"/></bsdf>"#);
    assert!(!leaf.sides_differ());
    for plugin in ["dielectric", "roughdielectric", "thindielectric", "null"] {
        assert_eq!(bsdf(plugin, "").two_sided(), None, "{plugin}");
    }
}

#[test]
fn a_boundary_may_carry_any_bsdf() {
    let s = scene(
        r#"<shape type="sphere"><bsdf type="dielectric"/><medium name="interior" type="homogeneous" id="m"/></shape>"#,
    );
    assert!(matches!(s.shapes[0].bsdf, Bsdf::Dielectric { .. }));
    assert_eq!(s.shapes[0].boundary, Some(Boundary { interior: Some(MediumId(0)), exterior: None }));
}

#[test]
fn spots() {
    let Light::Spot { position, direction, intensity, cutoff_angle, beam_width, .. } = light("spot", "") else {
        panic!()
    };
    assert_eq!((position, direction, intensity), (DVec3::ZERO, DVec3::Z, DVec3::ONE));
    assert_eq!((cutoff_angle, beam_width), (20.0, 15.0));
    let Light::Spot { position, direction, cutoff_angle, beam_width, .. } = light(
        "spot",
        r#"<float name="cutoff_angle" value="90"/><float name="beam_width" value="90"/>
        <transform name="to_world"><scale value="3"/><lookat origin="1 2 3" target="1 2 -7" up="0 1 0"/></transform>"#,
    ) else {
        panic!()
    };
    assert!((position - DVec3::new(1.0, 2.0, 3.0)).length() < 1e-12 && (direction + DVec3::Z).length() < 1e-12);
    assert_eq!((cutoff_angle, beam_width), (90.0, 90.0));
}

#[test]
fn directional_lights() {
    let of = |inside: &str| match light("directional", inside) {
        Light::Directional { direction, irradiance } => (direction, irradiance),
        other => panic!("{other:?}"),
    };
    assert_eq!(of(""), (DVec3::Z, DVec3::ONE));
    let (direction, irradiance) =
        of(r#"<vector name="direction" value="0 -3 4"/><rgb name="irradiance" value="1 2 3"/>"#);
    assert!((direction - DVec3::new(0.0, -0.6, 0.8)).length() < 1e-12);
    assert_eq!(irradiance, DVec3::new(1.0, 2.0, 3.0));
    // Mitsuba 3.9.1: light arrives from +y, at 3 times the length.
    let turned = r#"<transform name="to_world"><scale value="3"/><rotate x="1" angle="90"/></transform>"#;
    assert!((of(turned).0 + DVec3::Y).length() < 1e-12);
}

#[test]
fn skies() {
    let file = r#"<string name="filename" value="textures/sky.exr"/>"#;
    let Light::Envmap { bitmap, scale, to_world } = light("envmap", file) else { panic!() };
    assert_eq!((bitmap.width(), bitmap.height(), scale, to_world), (8, 4, 1.0, DMat3::IDENTITY));
    let more = r#"<float name="scale" value="2"/><transform name="to_world"><rotate x="1" angle="30"/>
        <rotate y="1" angle="70"/></transform>"#;
    let Light::Envmap { bitmap, scale, to_world } = light("envmap", &format!("{file}{more}")) else { panic!() };
    let seen = |to_world: DMat3, d: [f64; 3]| bitmap.sky(Light::sky_uv(to_world.transpose() * DVec3::from(d))) * scale;
    // What `eval` of Mitsuba 3.9.1 says about the same element.
    let expected = [
        ([1.0, 0.0, 0.0], [26.64541, 5.98685, 2.06586]),
        ([0.0, 0.0, 1.0], [36.94025, 10.22243, 2.67178]),
        ([0.0, 0.0, -1.0], [35.50462, 2.22243, 3.32822]),
        ([-1.0, 0.0, 0.0], [53.32829, 13.98685, 3.93414]),
        ([0.6, 0.8, 0.0], [8.33734, 4.03451, 0.43028]),
        ([-0.36, -0.48, 0.8], [49.34458, 10.47216, 3.88724]),
        ([0.48, 0.64, -0.6], [18.42025, 2.62805, 1.57922]),
    ];
    let error = |to_world: DMat3| {
        expected.iter().map(|(d, want)| (seen(to_world, *d) - DVec3::from(*want)).length()).fold(0.0, f64::max)
    };
    assert!(error(to_world) < 1e-4, "{}", error(to_world));
    // The inverse rotation, and a mirrored sky, are noticed.
    assert!(error(to_world.transpose()) > 1.0);
    assert!(error(to_world * DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0))) > 1.0);
}

#[test]
fn directions_of_the_sky() {
    let uv = |x: f64, y: f64, z: f64| Light::sky_uv(DVec3::new(x, y, z)).to_array();
    for (got, want) in [
        (uv(0.0, 0.0, -1.0), [0.0, 0.5]),
        (uv(1.0, 0.0, 0.0), [0.25, 0.5]),
        (uv(0.0, 0.0, 1.0), [0.5, 0.5]),
        (uv(-1.0, 0.0, 0.0), [0.75, 0.5]),
        (uv(0.0, 0.6, 0.8), [0.5, 0.6f64.acos() / PI]),
    ] {
        assert!((got[0] - want[0]).abs() < 1e-12 && (got[1] - want[1]).abs() < 1e-12, "{got:?} {want:?}");
    }
    assert_eq!((uv(0.0, 1.0, 0.0)[1], uv(0.0, -1.0, 0.0)[1]), (0.0, 1.0));
}

/// The largest distance of 4π times the phase function from expected values at cosines −1, −1/2, 0, 1/2 and 1.
fn phase_error(phase: &Phase, expected: [f64; 5]) -> f64 {
    let cosines = [-1.0, -0.5, 0.0, 0.5, 1.0];
    cosines.iter().zip(expected).map(|(cos, want)| (4.0 * PI * phase.eval(*cos) - want).abs()).fold(0.0, f64::max)
}

#[test]
fn phase_functions_have_the_values_of_mitsuba() {
    let half = r#"<phase type="hg"><float name="g" value="0.5"/></phase>"#;
    let rayleigh = r#"<phase type="rayleigh"/>"#;
    let blend = format!(
        r#"<phase type="blendphase"><float name="weight" value="0.25"/><phase type="isotropic"/>{half}</phase>"#
    );
    let table = r#"<phase type="tabphase"><string name="values" value="1,2 5"/></phase>"#;
    // 4π `eval_pdf` of Mitsuba 3.9.1.
    for (text, expected) in [
        (half, [0.22222, 0.32397, 0.53666, 1.1547, 6.0]),
        (rayleigh, [1.5, 0.9375, 0.75, 0.9375, 1.5]),
        (&blend, [0.80556, 0.83099, 0.88416, 1.03868, 2.25]),
        (table, [0.4, 0.6, 0.8, 1.4, 2.0]),
    ] {
        let phase = phase(text);
        assert!(phase_error(&phase, expected) < 1e-5, "{phase:?}");
        // Turned around or rescaled it is another function.
        let mut wrong = expected.map(|value| value * 1.01);
        assert!(phase_error(&phase, wrong) > 1e-3);
        wrong = expected;
        wrong.reverse();
        assert!(phase_error(&phase, wrong) > 1e-3 || text == rayleigh);
    }
}

/// The integral over the sphere, by the midpoint rule.
fn integral(phase: &Phase) -> f64 {
    let steps = 100_000;
    (0..steps).map(|k| phase.eval((2 * k + 1) as f64 / steps as f64 - 1.0)).sum::<f64>() * 4.0 * PI / steps as f64
}

#[test]
fn phase_functions_are_normalised() {
    let table = |values: &[f64]| Phase::tabulated(values.to_vec()).unwrap();
    let blend = Phase::Blend { weight: 0.3, a: Box::new(Phase::Rayleigh), b: Box::new(table(&[0.0, 3.0, 1.0, 7.0])) };
    for phase in [
        Phase::Isotropic,
        Phase::HenyeyGreenstein { g: -0.7 },
        Phase::Rayleigh,
        table(&[1.0, 2.0, 5.0]),
        table(&[0.0, 1e-300]),
        table(&[1e308, 1e308, 0.0]),
        blend,
    ] {
        assert!((integral(&phase) - 1.0).abs() < 1e-7, "{phase:?}: {}", integral(&phase));
    }
    let wrong = Phase::Tabulated { values: vec![1.0, 2.0] };
    assert!((integral(&wrong) - 1.0).abs() > 0.1, "the check can fail");
    for bad in [&[][..], &[1.0], &[0.0, 0.0], &[1.0, -1.0], &[1.0, f64::NAN], &[1.0, f64::INFINITY]] {
        assert_eq!(Phase::tabulated(bad.to_vec()), None, "{bad:?}");
    }
}
