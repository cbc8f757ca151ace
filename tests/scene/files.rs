//! Whole files: the dialects, includes, and files that are not there.

use glam::{DMat4, DVec3};
use tyndall::scene::mitsuba::{Loaded, load};
use tyndall::scene::*;

use crate::data;

fn quiet(name: &str) -> Scene {
    let Loaded { scene, warnings } = load(&data(name), &[]).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(warnings, [""; 0], "{name}");
    scene
}

#[test]
fn the_sphere_in_the_box() {
    for (name, albedo, phase) in [
        ("a_absorb.xml", 0.166666667, Phase::Isotropic),
        ("b_scatter.xml", 0.833333333, Phase::Isotropic),
        ("f_hg.xml", 0.833333333, Phase::HenyeyGreenstein { g: -0.5 }),
    ] {
        let scene = quiet(name);
        assert_eq!(scene.integrator, Integrator { max_depth: None, rr_depth: 5, hide_emitters: false });
        assert_eq!((scene.film, scene.sample_count), (Film::new(128, 128), 16));
        let camera = &scene.camera;
        assert!((camera.fov_x - 41.5).abs() < 1e-12, "a square film has one field of view");
        assert_eq!((camera.near_clip, camera.far_clip, camera.medium), (0.001, 1000.0, None));
        // Mitsuba's cameras look along +z with +x to the left, so this one is turned by 180 degrees about y.
        let expected =
            DMat4::from_translation(DVec3::new(0.0, 0.0, 7.4)) * DMat4::from_scale(DVec3::new(-1.0, 1.0, -1.0));
        assert!(camera.to_world.abs_diff_eq(expected, 1e-12));

        let [wall, lamp, ball] = &scene.shapes[..] else { panic!("{name} has {} shapes", scene.shapes.len()) };
        let reflectance = DVec3::new(0.725, 0.71, 0.68);
        assert_eq!(wall.bsdf, Bsdf::Diffuse { reflectance: reflectance.into(), two_sided: true });
        assert_eq!(lamp.emission, Some(DVec3::new(17.0, 12.0, 4.0)));
        assert_eq!(lamp.bsdf, Bsdf::Diffuse { reflectance: DVec3::ZERO.into(), two_sided: false });
        assert_eq!(ball.bsdf, Bsdf::Null);
        assert_eq!(ball.boundary, Some(Boundary { interior: Some(MediumId(0)), exterior: None }));
        assert_eq!((wall.emission, wall.boundary, ball.emission), (None, None, None));
        let [medium] = &scene.media[..] else { panic!() };
        assert_eq!((medium.sigma_t, medium.albedo), (DVec3::splat(6.0), DVec3::splat(albedo)));
        assert_eq!((&medium.phase, medium.name.as_str()), (&phase, "m"));
    }
}

#[test]
fn the_box_with_and_without_fog() {
    let fog = quiet("c_fog.xml");
    assert_eq!(fog.camera.medium, Some(MediumId(0)));
    assert_eq!(fog.film, Film::new(96, 128));
    let expected = 2.0 * ((21f64.to_radians()).tan() * 0.75).atan().to_degrees();
    assert!((fog.camera.fov_x - expected).abs() < 1e-12);
    assert_eq!((fog.media.len(), fog.shapes.len()), (1, 3));
    let clear = quiet("d_nofog.xml");
    assert_eq!((clear.media.len(), clear.shapes.len(), clear.camera.medium), (0, 2, None));
}

#[test]
fn the_names_of_mitsuba_06() {
    let scene = quiet("v06.xml");
    assert_eq!(scene.integrator, Integrator { max_depth: Some(8), rr_depth: 4, hide_emitters: false });
    assert_eq!(scene.camera.near_clip, 0.5);
    let fov_x = 2.0 * (2.0 * 20f64.to_radians().tan()).atan().to_degrees();
    assert!((scene.camera.fov_x - fov_x).abs() < 1e-12);
    assert_eq!(scene.media[0].sigma_t, DVec3::new(8.0, 8.0, 0.0));
    assert_eq!(scene.media[0].albedo, DVec3::new(0.25, 0.5, 0.0));
    let Geometry::Sphere { center, radius, flipped } = scene.shapes[0].geometry else { panic!() };
    assert_eq!((center, radius, flipped), (DVec3::new(1.0, 2.0, 3.0), 1.0, true));
    assert_eq!(scene.shapes[1].bsdf, Bsdf::Diffuse { reflectance: DVec3::splat(0.25).into(), two_sided: false });
}

#[test]
fn includes_paths_and_aliases() {
    let scene = quiet("includes.xml");
    assert_eq!(scene.film, Film::new(32, 32));
    let names: Vec<&str> = scene.shapes.iter().map(|shape| shape.name.as_str()).collect();
    assert_eq!(names, ["lamp", "floor", "sphere"]);
    assert_eq!(scene.shapes[0].emission, Some(DVec3::splat(2.0)));
    let reflectance = DVec3::new(0.6, 0.3, 0.2);
    assert_eq!(scene.shapes[1].bsdf, Bsdf::Diffuse { reflectance: reflectance.into(), two_sided: true });
    assert_eq!(scene.shapes[2].boundary, Some(Boundary { interior: Some(MediumId(0)), exterior: None }));
    assert_eq!(scene.media[0].sigma_t, DVec3::splat(0.25));
    // Parameters of the scene reach the files that it includes.
    let overrides = [("power".to_owned(), "5".to_owned()), ("res".to_owned(), "8".to_owned())];
    let scene = load(&data("includes.xml"), &overrides).unwrap().scene;
    assert_eq!((scene.film, scene.shapes[0].emission), (Film::new(8, 8), Some(DVec3::splat(5.0))));
}

#[test]
fn an_include_cycle_is_refused() {
    let error = load(&data("cycle_a.xml"), &[]).unwrap_err().to_string();
    assert!(error.contains("cycle_b.xml:2:14: ") && error.contains("includes itself"), "{error}");
}

#[test]
fn a_scene_that_is_not_there() {
    let error = load(&data("nowhere.xml"), &[]).unwrap_err();
    assert!(matches!(error, SceneError::Unreadable { .. }), "{error}");
    assert!(error.to_string().contains("nowhere.xml: cannot read the scene"), "{error}");
    assert!(matches!(load(&data(""), &[]), Err(SceneError::Unreadable { .. })), "a folder is not a scene");
}

#[test]
fn bytes_that_are_not_text() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("latin.xml");
    std::fs::write(&path, b"<scene version=\"3.0.0\">\n<!-- caf\xe9 -->\n</scene>").unwrap();
    let error = load(&path, &[]).unwrap_err().to_string();
    assert!(error.ends_with("latin.xml:2:9: the file is not UTF-8 text"), "{error}");
    // A byte order mark is no fault, and does not shift columns.
    std::fs::write(&path, "\u{feff}<scene version=\"3.0.0\"><oops/></scene>").unwrap();
    let error = load(&path, &[]).unwrap_err().to_string();
    assert!(error.contains("latin.xml:1:24: "), "{error}");
}
