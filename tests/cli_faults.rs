//! Faulty scenes given to the program: the message names file, line and cause, the exit code is 2, and nothing is written.
#![allow(clippy::unwrap_used, reason = "a failed unwrap fails the test")]

use std::path::Path;
use std::process::Command;

/// A good scene, in which each case replaces one part. The mesh is `mesh.obj` beside it.
const SCENE: &str = r#"<scene version="3.0.0">
<sensor type="perspective"><float name="fov" value="40"/>
<transform name="to_world"><lookat origin="0,0,4" target="0,0,0" up="0,1,0"/></transform>
<film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/><rfilter type="box"/></film></sensor>
<emitter type="constant"><rgb name="radiance" value="1"/></emitter>
<shape type="obj"><string name="filename" value="mesh.obj"/><bsdf type="null"/>
<medium name="interior" type="homogeneous"><float name="sigma_t" value="1"/><phase type="hg"><float name="g" value="0.5"/></phase></medium></shape>
</scene>
"#;

/// A closed tetrahedron.
const MESH: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

struct Case {
    name: &'static str,
    scene: [&'static str; 2],
    mesh: [&'static str; 2],
    /// Parts of the message: where, and what.
    expected: &'static [&'static str],
}

const SAME: [&str; 2] = ["", ""];

const CASES: &[Case] = &[
    Case { name: "missing OBJ", scene: ["mesh.obj", "none.obj"], mesh: SAME, expected: &["scene.xml:6:", "none.obj"] },
    Case {
        name: "unknown plugin",
        scene: ["\"hdrfilm\"", "\"tapefilm\""],
        mesh: SAME,
        expected: &["scene.xml:4:", "tapefilm", "hdrfilm"],
    },
    Case {
        name: "unknown property",
        scene: ["\"sigma_t\"", "\"sigma_x\""],
        mesh: SAME,
        expected: &["scene.xml:7:", "sigma_x", "sigma_t"],
    },
    Case { name: "malformed XML", scene: ["</sensor>", ""], mesh: SAME, expected: &["scene.xml:", "sensor"] },
    Case { name: "NaN vertex", scene: SAME, mesh: ["v 1 0 0", "v nan 0 0"], expected: &["mesh.obj:2", "nan"] },
    Case { name: "index out of range", scene: SAME, mesh: ["f 2 3 4", "f 2 3 9"], expected: &["mesh.obj:8", "9"] },
    Case { name: "empty mesh", scene: SAME, mesh: [MESH, "# nothing\n"], expected: &["mesh.obj", "no "] },
    Case { name: "g = 1", scene: ["value=\"0.5\"", "value=\"1\""], mesh: SAME, expected: &["scene.xml:7:", "g"] },
    Case {
        name: "negative sigma_t",
        scene: ["sigma_t\" value=\"1\"", "sigma_t\" value=\"-1\""],
        mesh: SAME,
        expected: &["scene.xml:7:", "sigma_t"],
    },
    Case {
        name: "huge film",
        scene: [
            "\"width\" value=\"8\"/><integer name=\"height\" value=\"8\"",
            "\"width\" value=\"60000\"/><integer name=\"height\" value=\"60000\"",
        ],
        mesh: SAME,
        expected: &["scene.xml:4:", "268435456"],
    },
];

/// Exit code and messages of a render, and whether it wrote an image.
fn render(folder: &Path, scene: &str, mesh: &str) -> (Option<i32>, String, bool) {
    std::fs::write(folder.join("scene.xml"), scene).unwrap();
    std::fs::write(folder.join("mesh.obj"), mesh).unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_tyndall"))
        .args(["render", "scene.xml", "-o", "out.exr", "--spp", "1"])
        .current_dir(folder)
        .output()
        .unwrap();
    let written = folder.join("out.exr").exists();
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned(), written)
}

#[test]
fn faults_are_named_and_nothing_is_written() {
    for case in CASES {
        let folder = tempfile::tempdir().unwrap();
        let scene = SCENE.replace(case.scene[0], case.scene[1]);
        let mesh = MESH.replace(case.mesh[0], case.mesh[1]);
        assert!(scene != SCENE || mesh != MESH, "{}: the case changes nothing", case.name);
        let (code, message, written) = render(folder.path(), &scene, &mesh);
        assert_eq!(code, Some(2), "{}: {message}", case.name);
        for part in case.expected {
            assert!(message.contains(part), "{}: no {part:?} in {message:?}", case.name);
        }
        assert!(!written, "{}", case.name);
    }
}

#[test]
fn the_scene_without_a_fault_renders() {
    let folder = tempfile::tempdir().unwrap();
    let (code, message, written) = render(folder.path(), SCENE, MESH);
    assert_eq!(code, Some(0), "{message}");
    assert!(written && !message.contains("warning"), "{message}");
}

#[test]
fn a_scene_without_light_is_black_and_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let scene = SCENE.replace(r#"<emitter type="constant"><rgb name="radiance" value="1"/></emitter>"#, "");
    let (code, message, written) = render(folder.path(), &scene, MESH);
    assert_eq!(code, Some(0), "{message}");
    assert!(written && message.contains("warning") && message.contains("black"), "{message}");
    let image = tyndall::image::exr::read(&folder.path().join("out.exr")).unwrap();
    assert!(image.rgb().unwrap().iter().all(|channel| channel.iter().all(|value| *value == 0.0)));
}
