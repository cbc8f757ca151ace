//! Media whose coefficients depend on the place: what is read, and what is refused.

use std::io::Read;

use glam::{DMat4, DVec3};
use tyndall::pack::Packed;
use tyndall::scene::*;

use crate::{parse, scene, with_warnings};

const SMALL: &str = r#"<string name="filename" value="volumes/small.vol"/>"#;

fn grid(name: &str, inside: &str) -> String {
    format!(r#"<volume type="gridvolume" name="{name}">{SMALL}{inside}</volume>"#)
}

/// A cube filled with a medium.
fn cube(inside: &str) -> String {
    format!(
        r#"<shape type="cube"><bsdf type="null"/><medium type="heterogeneous" id="m" name="interior">{inside}</medium></shape>"#
    )
}

fn medium(inside: &str) -> Medium {
    scene(&cube(inside)).media[0].clone()
}

fn voxels(volume: &Option<Volume>) -> &GridVolume {
    let Some(Volume::Grid(field)) = volume else { panic!("{volume:?} is no grid") };
    field
}

#[test]
fn defaults_and_constants() {
    let plain = medium("");
    assert!(plain.volumes.is_empty());
    assert_eq!((plain.sigma_t, plain.albedo, plain.emission), (DVec3::ONE, DVec3::splat(0.75), DVec3::ZERO));
    let constant = medium(
        r#"<volume type="constvolume" name="sigma_t"><rgb name="value" value="1 2 3"/>
           <transform name="to_world"><translate x="-0.5" y="-0.5" z="-0.5"/><scale value="3"/></transform></volume><float name="scale" value="2"/>
           <volume type="constvolume" name="albedo"><float name="value" value="0.5"/></volume><rgb name="emission" value="1 0 2"/>"#,
    );
    assert!(constant.volumes.is_empty());
    assert_eq!(constant.sigma_t, DVec3::new(2.0, 4.0, 6.0));
    assert_eq!((constant.albedo, constant.emission), (DVec3::splat(0.5), DVec3::new(1.0, 0.0, 2.0)));
}

#[test]
fn grids() {
    let read = medium(&format!(r#"{}{}<float name="scale" value="3"/>"#, grid("sigma_t", ""), grid("albedo", "")));
    assert_eq!((read.sigma_t, read.albedo), (DVec3::splat(3.0), DVec3::ONE));
    let field = voxels(&read.volumes.sigma_t);
    assert_eq!((field.grid.resolution(), field.grid.channels(), field.grid.max()), ([2, 3, 2], 1, 11.0 / 16.0));
    assert_eq!(field.grid.voxel(1, 2, 0), [5.0 / 16.0; 3]);
    assert_eq!((field.filter, field.wrap, field.to_world), (Filter::Bilinear, Wrap::Clamp, DMat4::IDENTITY));
    // A file that is named twice is read once.
    assert!(std::sync::Arc::ptr_eq(&field.grid, &read.volumes.albedo.as_ref().unwrap().grid));
    let read = medium(&grid(
        "sigma_t",
        r#"<string name="filter_type" value="nearest"/><string name="wrap_mode" value="mirror"/><boolean name="raw" value="true"/>
           <boolean name="use_grid_bbox" value="true"/><transform name="to_world"><scale value="2"/></transform>"#,
    ));
    let field = voxels(&read.volumes.sigma_t);
    assert_eq!((field.filter, field.wrap), (Filter::Nearest, Wrap::Mirror));
    // The file's box goes from (-1, 0, 2) to (3, 2, 5).
    assert_eq!(field.to_world.transform_point3(DVec3::ZERO), DVec3::new(-2.0, 0.0, 4.0));
    assert_eq!(field.to_world.transform_point3(DVec3::ONE), DVec3::new(6.0, 4.0, 10.0));
}

/// The voxels of a `.nvdb` are where the file has them, and `to_world` comes after that.
#[test]
fn grids_of_other_formats() {
    let packed = std::fs::read(crate::data("../vdb/fog.nvdb.gz")).unwrap();
    let mut bytes = Vec::new();
    flate2::read::GzDecoder::new(&*packed).read_to_end(&mut bytes).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("fog.nvdb");
    std::fs::write(&path, bytes).unwrap();
    let volume = |name: &str, inside: &str| {
        let file = path.display();
        format!(r#"<volume type="gridvolume" name="{name}"><string name="filename" value="{file}"/>{inside}</volume>"#)
    };
    let named = r#"<string name="grid" value="heat"/>"#;
    let scaled = r#"<transform name="to_world"><scale value="2"/></transform>"#;
    let read = medium(&(volume("sigma_t", scaled) + &volume("emission", named)));
    let (density, heat) = (voxels(&read.volumes.sigma_t), read.volumes.emission.as_ref().unwrap());
    assert_eq!((density.grid.resolution(), heat.grid.resolution()), ([27, 8, 17], [3, 2, 4]));
    // The first voxel, (-3, 0, -9), has its centre at (0.25, 2, 0.75); half a voxel is 1/8.
    let first = density.to_world.transform_point3(DVec3::ZERO);
    assert!((first - 2.0 * DVec3::new(0.125, 1.875, 0.625)).length() < 1e-12, "{first}");
    assert_eq!(heat.to_world.transform_point3(DVec3::ZERO), DVec3::new(0.25, -0.5, -1.0));
    let unit = r#"<boolean name="use_grid_bbox" value="false"/>"#;
    let read = medium(&volume("sigma_t", &(unit.to_owned() + scaled)));
    assert_eq!(voxels(&read.volumes.sigma_t).to_world, DMat4::from_scale(DVec3::splat(2.0)));
    let text = cube(&volume("sigma_t", r#"<string name="grid" value="fire"/>"#));
    let text = format!("<scene version=\"3.0.0\">{}{}{text}</scene>", crate::SENSOR, crate::LIGHT);
    let error = parse(&text).unwrap_err().to_string();
    assert!(error.contains("fog.nvdb: it has no grid \"fire\"; its grids: \"density\", \"heat\""), "{error}");
}

#[test]
fn fog_over_everything() {
    let text = r#"<volume type="heightvolume" name="sigma_t"><rgb name="value" value="1 2 4"/><vector name="up" value="0 0 2"/>
        <point name="base" value="1 2 3"/><float name="scale_height" value="0.5"/></volume><float name="scale" value="2"/>"#;
    let fog = medium(text);
    assert_eq!(fog.sigma_t, DVec3::new(2.0, 4.0, 8.0));
    let Some(Volume::Height(height)) = fog.volumes.sigma_t else { panic!() };
    let expected = HeightVolume { base: DVec3::new(1.0, 2.0, 3.0), up: DVec3::Z, scale_height: 0.5 };
    assert_eq!(height, expected);
}

#[test]
fn a_medium_of_voxels_needs_no_shape() {
    let inside = grid("sigma_t", r#"<transform name="to_world"><scale x="-1" y="2" z="3"/></transform>"#);
    let loaded = with_warnings(&format!(r#"<medium type="heterogeneous" id="smoke">{inside}</medium>"#));
    assert_eq!(loaded.warnings, [""; 0]);
    let [shape] = &loaded.scene.shapes[..] else { panic!("{:?}", loaded.scene.shapes) };
    assert_eq!((shape.name.as_str(), shape.boundary.unwrap().interior), ("smoke", Some(MediumId(0))));
    assert!((tyndall::pack::nesting::volume(&shape.geometry) - 6.0).abs() < 1e-12, "its normals point outwards");
    let packed = Packed::new(&loaded.scene, 0).unwrap();
    assert!(packed.features.fields && packed.features.grids && !packed.features.heights);
    // A homogeneous one is nowhere.
    let warnings = with_warnings(r#"<medium type="homogeneous" id="haze"/>"#).warnings;
    assert!(warnings[0].contains("never used"), "{warnings:?}");
}

#[test]
fn a_scene_of_homogeneous_media_pays_nothing() {
    let text = r#"<shape type="cube"><bsdf type="null"/><medium type="homogeneous" name="interior"/></shape>"#;
    let features = Packed::new(&scene(text), 0).unwrap().features;
    assert!(!features.grids && !features.voxels && !features.heights);
}

#[test]
fn what_is_wrong_is_refused() {
    let volume = |name: &str, text: &str| format!(r#"<volume type="{name}" name="sigma_t">{text}</volume>"#);
    let emitting = r#"<rgb name="emission" value="1"/>"#.to_owned();
    let height = r#"<float name="scale_height" value="1"/>"#;
    for (inside, expected) in [
        (volume("gridvolume", ""), "needs <string name=\"filename\""),
        (volume("gridvolume", r#"<string name="filename" value="volumes/none.vol"/>"#), "cannot read the volume"),
        (
            volume("gridvolume", r#"<string name="filename" value="volumes/wrong.vol"/>"#),
            "voxel (1, 0, 0) is -2; voxels must be finite and not negative",
        ),
        (volume("gridvolume", r#"<string name="filename" value="textures/sky.exr"/>"#), "letters \"VOL\""),
        (grid("sigma_t", r#"<string name="grid" value="density"/>"#), "only .nvdb and .vdb files have names"),
        (grid("sigma_t", r#"<string name="filter_type" value="cubic"/>"#), "accepted: trilinear, nearest"),
        (grid("sigma_t", r#"<string name="wrap_mode" value="black"/>"#), "accepted: clamp, repeat, mirror"),
        (grid("sigma_t", r#"<transform name="to_world"><scale x="0"/></transform>"#), "no inverse"),
        (volume("heightvolume", ""), "needs <float name=\"scale_height\""),
        (volume("heightvolume", r#"<float name="scale_height" value="0"/>"#), "must be greater than 0"),
        (volume("heightvolume", &format!(r#"{height}<vector name="up" value="0 0 0"/>"#)), "must not be zero"),
        (volume("heightvolume", height) + &emitting, "cannot emit"),
        (volume("heightvolume", height).replace("sigma_t", "albedo"), "only sigma_t can"),
        (volume("sparsevolume", ""), "accepted types: constvolume, gridvolume, heightvolume"),
        (volume("constvolume", r#"<float name="value" value="-1"/>"#), "must not be negative"),
        (volume("constvolume", r#"<float name="value" value="1.5"/>"#).replace("sigma_t", "albedo"), "between 0 and 1"),
        (r#"<float name="scale" value="-1"/>"#.to_owned(), "must not be negative"),
        (r#"<float name="sigma_s" value="1"/>"#.to_owned(), "no property \"sigma_s\""),
    ] {
        let text = format!("<scene version=\"3.0.0\">{}{}{}</scene>", crate::SENSOR, crate::LIGHT, cube(&inside));
        let error = parse(&text).expect_err(&inside).to_string();
        assert!(error.contains(expected), "{inside}\n{error}");
    }
}

#[test]
fn the_scenes_of_this_repository_are_read() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/volumes");
    let fog = mitsuba::load(&folder.join("height_fog.xml"), &[]).unwrap();
    assert_eq!(fog.warnings, [""; 0]);
    assert!(Packed::new(&fog.scene, 0).unwrap().features.heights);
    // The voxels of the smoke are not part of the repository.
    let other = ("volume".to_owned(), crate::data("volumes/small.vol").display().to_string());
    let smoke = mitsuba::load(&folder.join("smoke.xml"), &[other]).unwrap();
    assert_eq!(smoke.warnings, [""; 0]);
    assert!(Packed::new(&smoke.scene, 0).unwrap().features.fields);
}
