//! The program from outside, as far as it does not render: arguments, exit codes, messages, comparison of images.
#![allow(clippy::unwrap_used, reason = "a failed unwrap fails the test")]

use std::ffi::OsStr;
use std::path::Path;
use std::process::{Command, Output};

use tyndall::image::{Image, exr};

fn tyndall<S: AsRef<OsStr>>(arguments: impl IntoIterator<Item = S>) -> Output {
    Command::new(env!("CARGO_BIN_EXE_tyndall")).args(arguments).output().unwrap()
}

fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The program ends with `code`, prints `message` somewhere on standard error, and nothing on standard output.
#[track_caller]
fn fails<S: AsRef<OsStr>>(arguments: impl IntoIterator<Item = S>, code: i32, message: &str) {
    let output = tyndall(arguments);
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(code), "{text}");
    assert!(text.contains(message), "{message:?} is not in {text:?}");
    assert!(!text.contains("panicked"), "{text}");
    assert_eq!(stdout(&output), "");
}

#[test]
fn help_and_version_go_to_standard_output() {
    for (arguments, expected) in [
        (vec!["--help"], "Exit codes:"),
        (vec!["help", "render"], "--time-limit"),
        (vec!["render", "--help"], "a crop window in the scene is dropped"),
        (vec!["compare", "--help"], "REF.exr"),
        (vec!["--version"], concat!("tyndall ", env!("CARGO_PKG_VERSION"))),
    ] {
        let output = tyndall(&arguments);
        assert_eq!(output.status.code(), Some(0), "{arguments:?}");
        // Lines are wrapped to the width of the terminal.
        let text = stdout(&output).split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(text.contains(expected), "{arguments:?}: {text}");
        assert_eq!(stderr(&output), "");
    }
}

#[test]
fn a_wrong_command_line_is_exit_code_2() {
    fails(["rendre", "a.xml"], 2, "rendre");
    fails(["render"], 2, "SCENE.xml");
    fails(["compare", "a.exr"], 2, "REF.exr");
    fails(["render", "a.xml", "--frames", "3"], 2, "--frames");
    fails(["render", "a.xml", "--spp", "0"], 2, "--spp");
    fails(["render", "a.xml", "--spp", "4294967296"], 2, "--spp");
    fails(["render", "a.xml", "--time-limit", "10"], 2, "expected a time such as");
    fails(["render", "a.xml", "--resolution", "64"], 2, "expected a width and height");
    fails(["render", "a.xml", "--crop", "4,0,0,4"], 2, "expected four pixel numbers");
    fails(["render", "a.xml", "-D", "spp"], 2, "expected NAME=VALUE");
    assert_eq!(tyndall([] as [&str; 0]).status.code(), Some(2), "no command at all");
}

#[test]
fn the_output_is_checked_before_anything_else() {
    // The scene does not exist either, which would be noticed next.
    let directory = tempfile::tempdir().unwrap();
    let missing = directory.path().join("missing").join("a.exr");
    let scene = directory.path().join("a.xml");
    fails([OsStr::new("render"), scene.as_ref(), OsStr::new("-o"), missing.as_ref()], 74, "there is no directory");
    let preview = directory.path().join("missing").join("a.png");
    fails(
        [OsStr::new("render"), scene.as_ref(), OsStr::new("--preview"), preview.as_ref()],
        74,
        "there is no directory",
    );
    fails([OsStr::new("render"), scene.as_ref(), OsStr::new("-o"), directory.path().as_ref()], 74, "cannot write");
    for name in ["cloud.png", "cloud", "cloud.exr.png", ".exr"] {
        let image = directory.path().join(name);
        let arguments = [OsStr::new("render"), scene.as_ref(), OsStr::new("-o"), image.as_ref()];
        fails(
            arguments,
            2,
            &format!("{name} does not end in .exr: images are OpenEXR files; --preview OUT.png writes a PNG"),
        );
    }
    // In capitals it is the same, so that the scene is what is wrong here.
    let image = directory.path().join("cloud.EXR");
    fails([OsStr::new("render"), scene.as_ref(), OsStr::new("-o"), image.as_ref()], 2, "a.xml");
    assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 0, "nothing was written");
}

#[test]
fn the_scene_is_not_overwritten() {
    let directory = tempfile::tempdir().unwrap();
    let scene = directory.path().join("a.exr");
    std::fs::write(&scene, "<scene/>").unwrap();
    // The default output of a scene with this extension is the scene itself.
    fails([OsStr::new("render"), scene.as_ref()], 2, "would overwrite the scene");
    let image = directory.path().join("b.exr");
    let arguments =
        ["render".as_ref(), scene.as_os_str(), "-o".as_ref(), image.as_ref(), "--preview".as_ref(), image.as_ref()];
    fails(arguments, 2, "are the same file");
    assert_eq!(std::fs::read_to_string(&scene).unwrap(), "<scene/>");
}

#[test]
fn a_scene_that_cannot_be_read_is_exit_code_2() {
    let directory = tempfile::tempdir().unwrap();
    let scene = directory.path().join("missing.xml");
    fails([OsStr::new("render"), scene.as_ref()], 2, "missing.xml");
}

/// An image with noise, `factor` times as bright, from a fixed sequence.
fn noisy(factor: f32, first: u32) -> Image {
    let mut image = Image::new(32, 32);
    for (q, name) in ["R", "G", "B"].into_iter().enumerate() {
        let value = |pixel: u32| {
            // Weyl's sequence with the golden ratio, well spread over [0, 1).
            let weyl = (pixel + first).wrapping_mul(2_654_435_769) >> 8;
            factor * (0.9 + 0.2 * weyl as f32 / 16_777_216.0) * (1.0 + q as f32)
        };
        image.push(name, (0..32 * 32).map(value).collect());
    }
    image
}

fn compare(image: &Path, reference: &Path) -> Output {
    tyndall([OsStr::new("compare"), image.as_ref(), reference.as_ref()])
}

/// The last number of the line that begins with `name`.
fn last_number(table: &str, name: &str) -> f64 {
    let line = table.lines().find(|line| line.starts_with(name)).unwrap_or_else(|| panic!("no {name} in {table}"));
    line.split_whitespace().last().unwrap().parse().unwrap()
}

#[test]
fn an_image_equals_itself() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.exr");
    exr::write(&path, &noisy(1.0, 0)).unwrap();
    let output = compare(&path, &path);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let table = stdout(&output);
    for name in ["MSE", "relMSE", "trimmed relMSE", "R", "G", "B", "mean"] {
        assert_eq!(last_number(&table, name), 0.0, "{name} in {table}");
    }
    assert_eq!(stderr(&output), "");
}

#[test]
fn an_image_2_percent_brighter_is_seen() {
    let directory = tempfile::tempdir().unwrap();
    let path = |name: &str| directory.path().join(name);
    exr::write(&path("reference.exr"), &noisy(1.0, 0)).unwrap();
    exr::write(&path("same.exr"), &noisy(1.0, 10_000)).unwrap();
    exr::write(&path("brighter.exr"), &noisy(1.02, 10_000)).unwrap();
    let same = stdout(&compare(&path("same.exr"), &path("reference.exr")));
    let brighter = stdout(&compare(&path("brighter.exr"), &path("reference.exr")));
    for channel in ["R", "G", "B", "mean"] {
        assert!(last_number(&same, channel).abs() < 3.0, "{same}");
        assert!(last_number(&brighter, channel) > 6.0, "{brighter}");
    }
}

#[test]
fn images_that_cannot_be_compared() {
    let directory = tempfile::tempdir().unwrap();
    let path = |name: &str| directory.path().join(name);
    let arguments = |a: &str, b: &str| ["compare".into(), path(a).into_os_string(), path(b).into_os_string()];
    exr::write(&path("a.exr"), &noisy(1.0, 0)).unwrap();
    fails(arguments("a.exr", "missing.exr"), 74, "missing.exr");
    std::fs::write(path("text.exr"), "this is text").unwrap();
    fails(arguments("text.exr", "a.exr"), 74, "text.exr");

    let mut small = Image::new(1, 1);
    small.push("R", vec![1.0]);
    exr::write(&path("small.exr"), &small).unwrap();
    fails(arguments("a.exr", "small.exr"), 2, "32×32 pixels but the reference 1×1");
    fails(arguments("small.exr", "small.exr"), 2, "the image has no channel G");

    let mut spoilt = noisy(1.0, 0);
    spoilt.channels[2].samples[33] = f32::NAN;
    exr::write(&path("nan.exr"), &spoilt).unwrap();
    fails(arguments("nan.exr", "a.exr"), 1, "the image is NaN at pixel (1, 1), channel B");
}

#[cfg(unix)]
#[test]
fn paths_need_not_be_utf_8() {
    use std::os::unix::ffi::OsStrExt;
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join(OsStr::from_bytes(b"caf\xe9.exr"));
    exr::write(&path, &noisy(1.0, 0)).unwrap();
    let output = compare(&path, &path);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let scene = directory.path().join(OsStr::from_bytes(b"sc\xe8ne.xml"));
    fails([OsStr::new("render"), scene.as_ref()], 2, "ne.xml");
    let missing = directory.path().join(OsStr::from_bytes(b"\xff/a.exr"));
    fails([OsStr::new("render"), scene.as_ref(), OsStr::new("-o"), missing.as_ref()], 74, "there is no directory");
    fails([OsStr::from_bytes(b"r\xffnder")], 2, "");
    fails([OsStr::new("render"), scene.as_ref(), OsStr::new("-D"), OsStr::from_bytes(b"a=\xff")], 2, "UTF-8");
}
