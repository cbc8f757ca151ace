//! The principled BSDF: values and densities of Mitsuba, energy, and what scene files may say of it.
#![allow(clippy::unwrap_used, reason = "a failed unwrap fails the test")]

mod common;

use common::random::Random;
use common::statistics::mean_and_error;
use common::surfaces::{Query, ask};
use glam::{DVec2, DVec3};
use std::path::Path;
use tyndall::pack::Packed;
use tyndall::pack::layout::Surface;
use tyndall::reference::bindings;
use tyndall::reference::path_vertex::eval_surface;
use tyndall::reference::principled::{coat_density, sample_coat};
use tyndall::scene::mitsuba;

/// By Mitsuba 3.9.1; the file says what its columns are.
const TABLE: &str = include_str!("data/bsdf/principled.txt");

fn load(bsdf: &str) -> Result<Packed, String> {
    let text = format!(
        r#"<scene version="3.0.0"><sensor type="perspective"><float name="fov" value="40"/></sensor>
        <shape type="sphere">{bsdf}</shape><emitter type="constant"/></scene>"#
    );
    let loaded = mitsuba::parse_str(&text, Path::new("scene.xml"), &[]).map_err(|error| error.to_string())?;
    Packed::new(&loaded.scene, 0).map_err(|error| error.to_string())
}

/// The surface of `<bsdf type="principled">` with some numbers.
fn surface(base_color: &str, numbers: &[(String, f64)]) -> Surface {
    let numbers: String =
        numbers.iter().map(|(name, value)| format!(r#"<float name="{name}" value="{value}"/>"#)).collect();
    let bsdf = format!(r#"<bsdf type="principled"><rgb name="base_color" value="{base_color}"/>{numbers}</bsdf>"#);
    load(&bsdf).unwrap().surfaces[0]
}

fn numbers(text: &str) -> Vec<(String, f64)> {
    let pair = |pair: &str| {
        let (name, value) = pair.split_once('=').unwrap();
        (name.to_owned(), value.parse().unwrap())
    };
    text.split(' ').filter(|pair| !pair.is_empty()).map(pair).collect()
}

/// The largest difference of the table to the surfaces that its parameters make, with `change` done to these.
fn check_table(change: impl Fn(&mut Surface)) -> Result<f64, String> {
    let (mut now, mut parameters, mut worst) = (Surface::default(), "", 0.0f64);
    for line in TABLE.lines().filter(|line| !line.starts_with('#')) {
        if let Some(text) = line.strip_prefix("parameters ") {
            (now, parameters) = (surface("0.7 0.35 0.1", &numbers(text)), text);
            change(&mut now);
            continue;
        }
        let row: Vec<f64> = line.split(' ').map(|number| number.parse().unwrap()).collect();
        let (wi, wo) = (DVec3::from_slice(&row[0..3]), DVec3::from_slice(&row[3..6]));
        let found = eval_surface(&bindings::Surface::from(&now), &[], wi, wo);
        let pairs = found.value.to_array().into_iter().chain([found.pdf]).zip(&row[6..10]);
        for (got, want) in pairs {
            // Single precision on their side, of directions that lie in a narrow peak.
            let error = (got - want).abs() / (2e-3 * want.abs() + 1e-6);
            if error > 1.0 {
                return Err(format!("{parameters}: {line}: {got}, expected {want}"));
            }
            worst = worst.max(error);
        }
    }
    Ok(worst)
}

#[test]
fn values_and_densities_are_those_of_mitsuba() {
    let worst = check_table(|_| ()).unwrap_or_else(|why| panic!("{why}"));
    eprintln!("largest error {worst:.3} of the tolerance");
    for (name, change) in [
        ("roughness", (|surface| surface.specular *= 1.02) as fn(&mut Surface)),
        ("base colour", |surface| surface.reflectance *= 0.98),
        ("index", |surface| surface.eta *= 1.02),
        ("metallic", |surface| surface.transmittance.x *= 0.97),
        ("spec_trans", |surface| surface.transmittance.y *= 0.97),
        ("flatness", |surface| surface.transmittance.z *= 0.9),
        ("sheen", |surface| surface.extinction.x *= 0.9),
        ("sheen_tint", |surface| surface.extinction.y *= 0.9),
        ("spec_tint", |surface| surface.extinction.z *= 0.9),
        ("clear coat", |surface| surface.internal_reflectance *= 0.97),
        ("gloss", |surface| surface.specular_weight *= 1.02),
        ("anisotropy", |surface| std::mem::swap(&mut surface.alpha, &mut surface.alpha_v)),
    ] {
        assert!(check_table(change).is_err(), "the comparison is blind to {name}");
    }
}

/// The mean of what comes back or gets through of one unit of light, without the change of radiance by refraction.
fn albedo(surface: Surface, cosine: f64) -> (f64, f64) {
    let mut random = Random(5);
    let wi = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
    let queries: Vec<Query> = (0..20_000)
        .map(|_| {
            let u = [random.unit(), random.unit()];
            Query { surface: 0, wi, wo: DVec3::Z, u, lobe: random.unit() }
        })
        .collect();
    let weights: Vec<f64> = ask(&[surface], &queries)
        .iter()
        .map(|answer| f64::from(answer.weight[1]) * f64::from(answer.eta).powi(2))
        .collect();
    mean_and_error(&weights)
}

#[test]
fn metal_and_clear_material_make_no_light() {
    for (what, cosines) in [("metallic=1", &[0.95, 0.5, 0.1][..]), ("spec_trans=1", &[0.95, 0.5, 0.1, -0.9, -0.4])] {
        for roughness in [0.1, 0.4, 0.8] {
            let white = surface("1 1 1", &numbers(&format!("roughness={roughness} {what}")));
            for &cosine in cosines {
                let (mean, error) = albedo(white, cosine);
                eprintln!("{what}, roughness {roughness}, cosine {cosine}: {mean:.4} ± {error:.4}");
                let lossless = |mean: f64| mean <= 1.0 + 4.0 * error + 1e-5;
                assert!(lossless(mean) && mean > 0.4, "{what}, {roughness}, {cosine}: {mean} ± {error}");
                // Smooth facets lose nothing, so that a few per cent more would be seen.
                if roughness == 0.1 && cosine.abs() > 0.4 {
                    assert!(mean > 0.98 && !lossless(mean * 1.03), "{what}, {cosine}: {mean} ± {error}");
                }
            }
        }
    }
}

#[test]
fn the_whole_model_has_the_albedo_of_its_values() {
    // The diffuse body is not dimmed by what is reflected above it (Burley 2012), so a white one may exceed 1; what is sampled must be
    // the integral of the values all the same.
    for text in ["roughness=0.5", "roughness=0.5 clearcoat=1", "roughness=0.5 sheen=1", "roughness=0.6 flatness=1"] {
        let white = surface("1 1 1", &numbers(text));
        let cosine: f64 = 0.6;
        let wi = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
        let (rows, columns) = (600, 600);
        let mut sum = 0.0;
        for k in 0..rows * columns {
            // Midpoints, equal in solid angle.
            let z = ((k / columns) as f64 + 0.5) / rows as f64;
            let phi = ((k % columns) as f64 + 0.5) / columns as f64 * std::f64::consts::TAU;
            let wo = (DVec2::from_angle(phi) * (1.0 - z * z).sqrt()).extend(z);
            sum += eval_surface(&bindings::Surface::from(&white), &[], wi, wo).value.y;
        }
        let expected = sum * std::f64::consts::TAU / (rows * columns) as f64;
        let (mean, error) = albedo(white, cosine);
        eprintln!("{text}: {mean:.4} ± {error:.4}, expected {expected:.4}");
        let agrees = |mean: f64| (mean - expected).abs() < 4.0 * error + 2e-3;
        assert!(error < 5e-3 && agrees(mean) && !agrees(mean * 1.03), "{text}: {mean} ± {error}, expected {expected}");
    }
}

#[test]
fn normals_of_the_clear_coat_have_their_density() {
    // P(z² > c) has the closed form 1 - ln(1 - (1 - a²) c) / ln a².
    for alpha in [0.1, 0.02, 0.001] {
        let a2: f64 = alpha * alpha;
        for u in [0.0, 0.1, 0.5, 0.9, 0.999_999] {
            let m = sample_coat(DVec2::new(u, 0.3), alpha);
            let rank = 1.0 - (1.0 - (1.0 - a2) * m.z * m.z).ln() / a2.ln();
            assert!((m.length() - 1.0).abs() < 1e-9, "{m}");
            assert!((rank - u).abs() < 1e-6, "{alpha}: {rank}, expected {u}");
        }
        // The integral of the density times z, over the logarithm of the tangent, in which it is smooth.
        let steps = 20_000;
        let mut integral = 0.0;
        for k in 0..steps {
            let width = 40.0 / f64::from(steps);
            let tangent = (-20.0 + (f64::from(k) + 0.5) * width).exp();
            let z = 1.0 / (1.0 + tangent * tangent).sqrt();
            let m = DVec3::new(tangent * z, 0.0, z);
            integral += std::f64::consts::TAU * coat_density(m, alpha) * z.powi(4) * tangent * tangent * width;
        }
        assert!((integral - 1.0).abs() < 1e-4, "{alpha}: {integral}");
    }
}

#[test]
fn what_scene_files_may_say() {
    let with = |inside: &str| load(&format!(r#"<bsdf type="principled">{inside}</bsdf>"#));
    let error = |inside: &str| with(inside).map(|_| "nothing").unwrap_err();
    let checker = |name: &str| format!(r#"<texture type="checkerboard" name="{name}"/>"#);
    for name in ["base_color", "roughness"] {
        assert!(with(&checker(name)).unwrap().features.textures, "{name}");
    }
    for name in [
        "anisotropic",
        "metallic",
        "spec_trans",
        "spec_tint",
        "sheen",
        "sheen_tint",
        "flatness",
        "clearcoat",
        "clearcoat_gloss",
    ] {
        let text = error(&checker(name));
        let expected = format!("{name} of \"principled\" is a texture; it must be a <float> here");
        assert!(text.contains(&expected), "{text}");
        let text = error(&format!(r#"<float name="{name}" value="1.5"/>"#));
        assert!(text.contains(&format!("{name} is 1.5; it must lie between 0 and 1")), "{text}");
    }
    let float = |name: &str, value: f64| format!(r#"<float name="{name}" value="{value}"/>"#);
    let both = float("eta", 1.5) + &float("specular", 0.5);
    assert!(error(&both).contains("give either eta or specular, not both"));
    assert!(error(&float("eta", 0.0)).contains("eta is 0; it must be greater than 0"));
    assert!(error(&float("specular", 2.0)).contains("specular is 2; it must lie between 0 and 1"));
    // Mitsuba's default of specular is an index of 1.5.
    assert!((with("").unwrap().surfaces[0].eta - 1.5).abs() < 1e-6);
    assert_eq!(with(&float("eta", 1.0)).unwrap().surfaces[0].eta, 1.0);
    assert_eq!(with(&(float("eta", 1.0) + &float("spec_trans", 0.5))).unwrap().surfaces[0].eta, 1.001);
    // Only what needs it pays for it.
    let features = with("").unwrap().features;
    assert!(features.principled && !features.dielectric && !features.anisotropic && !features.textures);
    assert!(with(&float("spec_trans", 0.5)).unwrap().features.dielectric);
    assert!(with(&float("anisotropic", 0.5)).unwrap().features.anisotropic);
    assert!(!load(r#"<bsdf type="roughplastic"/>"#).unwrap().features.principled);
    // Two sides only where nothing gets through.
    let twice =
        |inside: &str| load(&format!(r#"<bsdf type="twosided"><bsdf type="principled">{inside}</bsdf></bsdf>"#));
    assert!(!twice("").unwrap().features.one_sided);
    assert!(twice(&float("spec_trans", 0.5)).unwrap_err().contains("lets light through"));
}
