//! `tyndall check` from outside: what it says about a scene, for people and for programs, and how it ends.
#![allow(clippy::unwrap_used, reason = "a failed unwrap fails the test")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::{Value, json};

fn tyndall(arguments: &[&str], scene: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_tyndall")).args(arguments).arg(scene).output().unwrap()
}

fn stdout(output: &Output) -> String {
    assert_eq!(String::from_utf8_lossy(&output.stderr), "", "nothing on standard error");
    String::from_utf8(output.stdout.clone()).unwrap()
}

/// A folder with a scene: a droplet of ice in a box of fog in a room of haze, in which the camera stands.
fn droplet(extra: &str) -> (PathBuf, tempfile::TempDir) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("droplet.xml");
    let text = format!(
        r#"<scene version="3.0.0"><default name="size" value="0.5"/>
        <sensor type="perspective"><float name="fov" value="40"/>
            <film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="16"/><rfilter type="box"/></film>
            <transform name="to_world"><lookat origin="0 0 -5" target="0 0 0"/></transform></sensor>
        <medium type="homogeneous" id="haze"><float name="sigma_t" value="0.01"/></medium>
        <medium type="homogeneous" id="fog"><rgb name="sigma_t" value="1 2 3"/></medium>
        <medium type="homogeneous" id="ice"><float name="albedo" value="0.9"/><phase type="hg"><float name="g" value="0.5"/></phase></medium>
        <shape type="cube" id="room"><transform name="to_world"><scale value="9"/></transform><bsdf type="null"/><ref name="interior" id="haze"/></shape>
        <shape type="cube" id="box"><bsdf type="null"/><ref name="interior" id="fog"/></shape>
        <shape type="sphere" id="ball"><float name="radius" value="$size"/><bsdf type="null"/><ref name="interior" id="ice"/></shape>
        <shape type="rectangle" id="lamp"><transform name="to_world"><translate z="-8"/></transform>
            <emitter type="area"><rgb name="radiance" value="3 2 1"/></emitter></shape>
        {extra}</scene>"#
    );
    std::fs::write(&path, text).unwrap();
    (path, folder)
}

#[test]
fn a_good_scene_is_described() {
    let (path, _folder) = droplet("");
    let output = tyndall(&["check", "--strict"], &path);
    assert_eq!(output.status.code(), Some(0));
    let text = stdout(&output);
    for line in [
        "32×16 pixels of a film of 32×16, 4 samples a pixel",
        "  \"box\": 12 triangles, closed, null, (-1, -1, -1) to (1, 1, 1)",
        "  \"lamp\": 2 triangles, open, diffuse, (-1, -1, -8) to (1, 1, -8)",
        "  \"fog\": sigma_t (1, 2, 3), albedo 0.75, isotropic",
        "  \"ice\": sigma_t 1, albedo 0.9, Henyey-Greenstein, g 0.5",
        concat!(
            "nesting\n  outside of all boundaries: vacuum\n",
            "  \"room\": \"haze\" inside, vacuum outside (found)\n",
            "    the camera: in \"haze\"\n",
            "    \"box\": \"fog\" inside, \"haze\" outside (found)\n",
            "      \"ball\": \"ice\" inside, \"fog\" outside (found)\n"
        ),
        "lights: 1\n  area \"lamp\": radiance (3, 2, 1)\n",
        "HAS_CHROMATIC",
        "warnings: none",
        "doubts: none",
    ] {
        assert!(text.contains(line), "{line:?} is not in\n{text}");
    }
    assert!(!text.contains("HAS_DIELECTRIC"), "{text}");
}

#[test]
fn programs_get_json() {
    let (path, _folder) = droplet("");
    let report: Value = serde_json::from_str(&stdout(&tyndall(&["check", "--json"], &path))).unwrap();
    assert_eq!(report["film"]["width"], 32);
    assert_eq!(report["camera"], json!({ "inside_of": 0, "medium": 0 }));
    assert_eq!(
        report["boundaries"][2],
        json!({ "shape": 2, "inside_of": 1, "interior": 2, "exterior": 1, "exterior_given": false })
    );
    assert_eq!(report["media"][1]["sigma_t"], json!([1.0, 2.0, 3.0]));
    assert_eq!(report["shapes"][1]["bounds"], json!([[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]]));
    assert_eq!(report["lights"][0], json!({ "kind": "area", "shape": 3, "radiance": [3.0, 2.0, 1.0] }));
    assert_eq!((&report["warnings"], &report["doubts"]), (&json!([]), &json!([])));
    let memory = &report["memory"];
    // 512 pixels of two sums of three doubles and a number, and eight times a sum and a number of what they may share.
    assert_eq!(memory["host"]["film"], 512 * (240 + 36));
    let sum = |part: &Value, names: &[&str]| names.iter().map(|name| part[name].as_u64().unwrap()).sum::<u64>();
    assert_eq!(memory["host"]["total"], sum(&memory["host"], &["scene", "tables", "film", "blocks"]));
    assert_eq!(memory["device"]["total"], sum(&memory["device"], &["tables", "samples"]));
    assert!(memory["device"]["tables"].as_u64().unwrap() > 27 * 48, "{memory}");
}

#[test]
fn doubts_are_listed_and_fail_only_a_strict_check() {
    let (path, _folder) = droplet("");
    // The ball comes out of the box.
    let crossing = ["check", "-D", "size=1.25"];
    let output = tyndall(&crossing, &path);
    assert_eq!(output.status.code(), Some(0));
    let text = stdout(&output);
    assert!(text.contains("the boundaries \"box\" and \"ball\" cross each other, near ["), "{text}");
    let strict = tyndall(&["check", "--strict", "-D", "size=1.25"], &path);
    assert_eq!((strict.status.code(), stdout(&strict)), (Some(1), text));
    // A warning of the reader is as good as a doubt.
    let (path, _folder) = droplet(r#"<bsdf type="diffuse" id="unused"/>"#);
    let output = tyndall(&["check", "--strict"], &path);
    assert_eq!(output.status.code(), Some(1));
    assert!(stdout(&output).contains("warnings: 1\n"));
}

#[test]
fn a_wrong_scene_is_exit_code_2() {
    let (path, _folder) = droplet(r#"<shape type="teapot"/>"#);
    let output = tyndall(&["check"], &path);
    assert_eq!((output.status.code(), output.stdout.len()), (Some(2), 0));
    assert!(String::from_utf8_lossy(&output.stderr).contains("<shape type=\"teapot\"> is not supported"));
    let output = tyndall(&["check"], &path.with_file_name("missing.xml"));
    assert_eq!((output.status.code(), output.stdout.len()), (Some(2), 0));
}

#[test]
fn rendering_says_that_there_are_doubts() {
    let (path, folder) = droplet("");
    let image = folder.path().join("a.exr");
    let render = |arguments: &[&str]| {
        let fixed = ["render", "--device", "reference", "--spp", "1", "-o", image.to_str().unwrap()];
        let output = tyndall(&[&fixed, arguments].concat(), &path);
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    let hint = format!("warning: 1 doubt about the scene; `tyndall check {}` lists them\n", path.display());
    assert!(render(&["-D", "size=1.25"]).contains(&hint));
    assert!(!render(&[]).contains("doubt"));
    assert_eq!(render(&["-q", "-D", "size=1.25"]), "");
}
