//! The program from outside while it renders: files, headers, signals, limits. Needs a device.
#![allow(clippy::unwrap_used, reason = "a failed unwrap fails the test")]

use std::ffi::{OsStr, OsString};
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use tyndall::image::{Attribute, Image, exr};

const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/cli/lamp.xml");

fn program() -> Command {
    Command::new(env!("CARGO_BIN_EXE_tyndall"))
}

/// Renders the scene with more arguments into `output`, and expects that to succeed.
#[track_caller]
fn render(output: &Path, arguments: &[&str]) -> (Image, Output) {
    let result = program().args(["render", SCENE, "-o"]).arg(output).args(arguments).output().unwrap();
    assert_eq!(result.status.code(), Some(0), "{}", String::from_utf8_lossy(&result.stderr));
    (exr::read(output).unwrap(), result)
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[track_caller]
fn integer(image: &Image, name: &str) -> i32 {
    match image.metadata.attributes.get(name) {
        Some(Attribute::Int(value)) => *value,
        other => panic!("{name} is {other:?}"),
    }
}

#[track_caller]
fn string<'a>(image: &'a Image, name: &str) -> &'a str {
    match image.metadata.attributes.get(name) {
        Some(Attribute::Text(value)) => value,
        other => panic!("{name} is {other:?}"),
    }
}

fn pixel_bits(image: &Image) -> Vec<u32> {
    image.rgb().unwrap().iter().flat_map(|channel| channel.iter().map(|value| value.to_bits())).collect()
}

#[test]
fn an_image_has_the_promised_channels_and_header() {
    let directory = tempfile::tempdir().unwrap();
    let (image, output) = render(&directory.path().join("a.exr"), &["--spp", "37", "--seed", "4000000000"]);
    assert_eq!((image.width, image.height, image.metadata.origin), (16, 16, (0, 0)));
    let names: Vec<&str> = image.channels.iter().map(|channel| channel.name.as_str()).collect();
    assert_eq!(names, ["R", "G", "B", "Variance.B", "Variance.G", "Variance.R", "sampleCount"]);
    for channel in &image.channels {
        assert!(channel.samples.iter().all(|v| v.is_finite() && *v >= 0.0), "{}", channel.name);
        assert!(channel.samples.iter().any(|v| *v > 0.0), "{} is black", channel.name);
    }
    assert!(image.channel("sampleCount").unwrap().iter().all(|&count| count == 37.0));

    assert_eq!(integer(&image, "tyndall:spp"), 37);
    assert_eq!((integer(&image, "tyndall:sampleBegin"), integer(&image, "tyndall:sampleEnd")), (0, 37));
    assert_eq!(image.metadata.attributes["tyndall:seed"], Attribute::Double(4e9));
    assert_eq!(image.metadata.attributes["tyndall:invalidSamples"], Attribute::Double(0.0));
    assert!(matches!(image.metadata.attributes["tyndall:seconds"], Attribute::Float(seconds) if seconds > 0.0));
    assert_eq!(string(&image, "tyndall:version"), env!("CARGO_PKG_VERSION"));
    assert_eq!(string(&image, "tyndall:outcome"), "finished");
    assert_eq!(string(&image, "tyndall:sceneHash").len(), 16);
    assert!(!string(&image, "tyndall:device").is_empty() && !string(&image, "tyndall:driver").is_empty());
    assert!(image.metadata.world_to_camera.is_some() && image.metadata.world_to_ndc.is_some());

    let messages = text(&output.stderr);
    assert_eq!(text(&output.stdout), "", "standard output is for results");
    assert!(messages.contains("16×16 pixels, 37 spp"), "{messages}");
    for part in ["37 spp in", "Msamples/s", "relative standard error", "no invalid samples"] {
        assert!(messages.lines().last().unwrap().contains(part), "{messages}");
    }
    assert!(!messages.contains('\r') && !messages.contains('\x1b'), "no bar without a terminal: {messages:?}");
}

#[test]
fn the_image_lies_beside_the_scene_by_default() {
    let directory = tempfile::tempdir().unwrap();
    std::fs::copy(SCENE, directory.path().join("scene.xml")).unwrap();
    let output = program().args(["render", "scene.xml", "--quiet"]).current_dir(directory.path()).output().unwrap();
    assert_eq!((output.status.code(), text(&output.stderr).as_str()), (Some(0), ""));
    assert_eq!(text(&output.stdout), "");
    let image = exr::read(&directory.path().join("scene.exr")).unwrap();
    assert_eq!(integer(&image, "tyndall:spp"), 4, "the scene's own sample count");
    assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 2);
}

#[test]
fn a_seed_is_an_image() {
    let directory = tempfile::tempdir().unwrap();
    let image = |name: &str, seed: &str| render(&directory.path().join(name), &["--seed", seed, "--spp", "20"]).0;
    let first = image("a.exr", "7");
    assert_eq!(pixel_bits(&first), pixel_bits(&image("b.exr", "7")));
    assert_ne!(pixel_bits(&first), pixel_bits(&image("c.exr", "8")));
}

#[test]
fn a_crop_is_a_part_of_the_whole() {
    let directory = tempfile::tempdir().unwrap();
    let (whole, _) = render(&directory.path().join("whole.exr"), &["--resolution", "24x18"]);
    let (crop, _) = render(&directory.path().join("crop.exr"), &["--resolution", "24x18", "--crop", "5,9,7,17"]);
    assert_eq!((crop.width, crop.height, crop.metadata.origin), (4, 10, (5, 7)));
    assert_eq!((whole.width, whole.height, whole.metadata.origin), (24, 18, (0, 0)));
    assert_eq!(crop.metadata.display, whole.metadata.display);
    assert_eq!(crop.metadata.world_to_ndc, whole.metadata.world_to_ndc);
    assert_eq!(string(&crop, "tyndall:sceneHash"), string(&whole, "tyndall:sceneHash"));
    for (channel, all) in crop.rgb().unwrap().into_iter().zip(whole.rgb().unwrap()) {
        for (y, row) in channel.chunks(4).enumerate() {
            let start = (7 + y) * 24 + 5;
            assert_eq!(row, &all[start..start + 4], "row {y} of the crop");
        }
    }
}

#[test]
fn parameters_reach_the_scene() {
    let directory = tempfile::tempdir().unwrap();
    let (dim, _) = render(&directory.path().join("dim.exr"), &["-D", "spp=6"]);
    let (bright, _) = render(&directory.path().join("bright.exr"), &["-D", "spp=6", "-Dlamp=16"]);
    assert_eq!(integer(&dim, "tyndall:spp"), 6);
    assert_ne!(string(&dim, "tyndall:sceneHash"), string(&bright, "tyndall:sceneHash"));
    // Twice the radiance on the same paths is twice the image.
    for (dim, bright) in dim.rgb().unwrap().into_iter().zip(bright.rgb().unwrap()) {
        for (d, b) in dim.iter().zip(bright) {
            assert!((b - 2.0 * d).abs() <= 1e-4 * b.abs(), "{b} is not twice {d}");
        }
    }
}

#[test]
fn a_preview_is_a_png_of_the_same_size() {
    let directory = tempfile::tempdir().unwrap();
    let preview = directory.path().join("a.png");
    render(&directory.path().join("a.exr"), &["--preview", preview.to_str().unwrap()]);
    let decoder = png::Decoder::new(BufReader::new(std::fs::File::open(preview).unwrap()));
    let reader = decoder.read_info().unwrap();
    assert_eq!((reader.info().width, reader.info().height), (16, 16));
}

#[cfg(unix)]
#[test]
fn paths_need_not_be_utf_8() {
    use std::os::unix::ffi::OsStrExt;
    let directory = tempfile::tempdir().unwrap();
    let scene = directory.path().join(OsStr::from_bytes(b"sc\xe8ne.xml"));
    std::fs::copy(SCENE, &scene).unwrap();
    let output = program().arg("render").arg(&scene).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    exr::read(&scene.with_extension("exr")).unwrap();
}

#[test]
fn the_time_limit_is_a_regular_end() {
    let directory = tempfile::tempdir().unwrap();
    let start = Instant::now();
    let (image, output) = render(&directory.path().join("a.exr"), &["--spp", "2000000000", "--time-limit", "1s"]);
    assert!(start.elapsed() >= Duration::from_secs(1));
    assert_eq!(string(&image, "tyndall:outcome"), "time limit");
    let spp = integer(&image, "tyndall:spp");
    assert!((16..2_000_000_000).contains(&spp) && spp % 16 == 0, "{spp} spp");
    assert!(text(&output.stderr).contains("(time limit)"), "{}", text(&output.stderr));
}

#[test]
fn what_cannot_be_rendered_is_an_error() {
    let directory = tempfile::tempdir().unwrap();
    let image = directory.path().join("a.exr");
    let fails = |scene: &Path, arguments: &[&str], code: i32, message: &str| {
        let output = program().arg("render").arg(scene).arg("-o").arg(&image).args(arguments).output().unwrap();
        let messages = text(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{messages}");
        assert!(messages.contains("error: ") && messages.contains(message), "{message:?} is not in {messages:?}");
        assert!(!image.exists(), "a failure leaves no image");
    };
    fails(Path::new(SCENE), &["--crop", "0,17,0,16"], 2, "16×16");
    fails(Path::new(SCENE), &["--device", "no such device"], 69, "no such device");
    fails(Path::new(SCENE), &["--device", "12345"], 69, "12345");
    let broken = directory.path().join("broken.xml");
    std::fs::write(&broken, "<scene version='3.0.0'>\n<sensor type='perspective'>\n").unwrap();
    fails(&broken, &[], 2, "broken.xml");
}

/// A render without end that has begun: signals lead to an image from now on.
#[cfg(unix)]
struct Endless {
    child: Child,
    stderr: BufReader<std::process::ChildStderr>,
}

#[cfg(unix)]
impl Endless {
    fn start(output: &Path, resolution: &str) -> Self {
        let arguments: [OsString; 8] = [
            "render".into(),
            SCENE.into(),
            "-o".into(),
            output.into(),
            "--spp".into(),
            "2000000000".into(),
            "--resolution".into(),
            resolution.into(),
        ];
        let mut child = program().args(arguments).stderr(Stdio::piped()).spawn().unwrap();
        let mut stderr = BufReader::new(child.stderr.take().unwrap());
        let mut line = String::new();
        while !line.starts_with("rendering ") {
            line.clear();
            assert!(stderr.read_line(&mut line).unwrap() > 0, "the render did not begin");
        }
        Endless { child, stderr }
    }

    fn signal(&self, name: &str) {
        let kill = Command::new("sh").arg("-c").arg(format!("kill -{name} {}", self.child.id())).status().unwrap();
        assert!(kill.success());
    }

    /// The exit status and everything that was still printed.
    fn wait(mut self) -> (std::process::ExitStatus, String) {
        let mut rest = String::new();
        self.stderr.read_to_string(&mut rest).unwrap();
        (self.child.wait().unwrap(), rest)
    }
}

#[cfg(unix)]
#[test]
fn the_first_signal_ends_with_an_image() {
    let directory = tempfile::tempdir().unwrap();
    for signal in ["INT", "TERM"] {
        let path: PathBuf = directory.path().join(signal).with_extension("exr");
        let render = Endless::start(&path, "16x16");
        render.signal(signal);
        let (status, messages) = render.wait();
        assert_eq!(status.code(), Some(75), "{status}: {messages}");
        assert!(messages.contains("(interrupted)"), "{messages}");
        let image = exr::read(&path).unwrap();
        assert_eq!(string(&image, "tyndall:outcome"), "interrupted");
        let spp = integer(&image, "tyndall:spp");
        assert!((16..2_000_000_000).contains(&spp) && spp % 16 == 0, "{spp} spp");
    }
}

#[cfg(unix)]
#[test]
fn the_second_signal_ends_at_once() {
    use std::os::unix::process::ExitStatusExt;
    let directory = tempfile::tempdir().unwrap();
    // The second signal comes while the running dispatch, of about a second, is being finished. Should that end just
    // between the two signals, then the program ends regularly, so there are a few attempts.
    for _ in 0..5 {
        let path = directory.path().join("a.exr");
        let render = Endless::start(&path, "1024x1024");
        render.signal("INT");
        std::thread::sleep(Duration::from_millis(20));
        render.signal("TERM");
        let (status, messages) = render.wait();
        if status.code() != Some(75) {
            assert_eq!(status.signal(), Some(15), "{status}: {messages}");
            assert!(!path.exists(), "no image after a hard end");
            return;
        }
        std::fs::remove_file(&path).unwrap();
    }
    panic!("the second signal never had its default effect");
}

/// A scene of the repository with `moment` around its integrator, in a directory of its own.
fn with_moments(directory: &Path, file: &str) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let scene = std::fs::read_to_string(root.join(file)).unwrap();
    let (before, rest) = scene.split_once("<integrator").unwrap();
    let (inner, after) = rest.split_once("</integrator>").unwrap();
    let folder = root.join(file).parent().unwrap().to_str().unwrap().to_owned();
    let path = directory.join("moments.xml");
    let wrapped = format!("<integrator type=\"moment\"><integrator name=\"inner\"{inner}</integrator></integrator>");
    std::fs::write(&path, format!("{before}{wrapped}<path value=\"{folder}\"/>{after}")).unwrap();
    path
}

#[track_caller]
fn render_file(scene: &Path, output: &Path, arguments: &[&str]) -> (Image, String) {
    let result = program().arg("render").arg(scene).arg("-o").arg(output).args(arguments).output().unwrap();
    assert_eq!(result.status.code(), Some(0), "{}", text(&result.stderr));
    (exr::read(output).unwrap(), text(&result.stderr))
}

#[test]
fn second_moments_are_those_of_samples() {
    let directory = tempfile::tempdir().unwrap();
    let scene = with_moments(directory.path(), "tests/data/mitsuba/edge.xml");
    let output = directory.path().join("a.exr");
    // A lamp of (1, 2, 3) is seen or not: x² is the lamp times x, and so is its mean.
    for filter in ["box", "gaussian", "tent"] {
        let define = format!("filter={filter}");
        let (image, _) = render_file(&scene, &output, &["--spp", "200", "-D", &define]);
        let mut between = 0;
        for (color, lamp) in [("R", 1.0), ("G", 2.0), ("B", 3.0)] {
            let means = image.channel(color).unwrap();
            let moments = image.channel(&format!("m2_inner.{color}")).unwrap();
            for (mean, moment) in means.iter().zip(moments) {
                assert!((moment - lamp * mean).abs() < 1e-4 * lamp * lamp, "{filter}: {moment} for {mean}");
                // The planted fault: the square of the mean.
                between += usize::from((mean * mean - moment).abs() > 1e-2);
            }
        }
        assert!(between > 10, "{filter}: {between} values tell moments from squares");
    }
    // Samples that count negatively have no moments, which is said.
    let (image, messages) = render_file(&scene, &output, &["--spp", "16", "-D", "filter=mitchell"]);
    assert!(image.channels.iter().all(|channel| !channel.name.starts_with("m2_")));
    assert!(messages.contains("moments.xml:6:") && messages.contains("no second moments are written"), "{messages}");
}

#[test]
fn pixels_with_second_moments_share_no_paths() {
    let directory = tempfile::tempdir().unwrap();
    let scene = with_moments(directory.path(), "scenes/high-scattering.xml");
    let output = directory.path().join("a.exr");
    let small = ["--resolution", "64x64", "--spp", "2"];
    let (image, _) = render_file(&scene, &output, &small);
    let original = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/high-scattering.xml");
    let (alone, _) = render_file(&original, &output, &[&small[..], &["--no-pilot"]].concat());
    assert_eq!(pixel_bits(&image), pixel_bits(&alone));
    let (shared, _) = render_file(&original, &output, &small);
    assert_ne!(pixel_bits(&image), pixel_bits(&shared), "the scene is one that would share them");
}
