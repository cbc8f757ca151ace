//! Images as files and measures of error, from outside the library.

use std::fs;
use std::io::Write;
use std::path::Path;

use tyndall::image::metrics::{MetricsError, compare};
use tyndall::image::{Attribute, Image, ImageError, Window, check_writable, exr, preview, write_whole};

/// A picture with a number of its own in every sample.
fn numbered(width: usize, height: usize, names: &[&str]) -> Image {
    let mut image = Image::new(width, height);
    for (index, name) in names.iter().enumerate() {
        let value = |pixel: usize| 1e-3 * pixel as f32 + 7.0 * index as f32 + 0.1;
        image.push(*name, (0..width * height).map(value).collect());
    }
    image
}

/// Three equal channels.
fn gray(width: usize, height: usize, value: impl Fn(usize) -> f32) -> Image {
    let mut image = Image::new(width, height);
    for name in ["R", "G", "B"] {
        image.push(name, (0..width * height).map(&value).collect());
    }
    image
}

/// Uniform in [0, 1), from a multiplicative hash of the index (constants of splitmix64, Steele et al. 2014).
fn noise(index: usize) -> f32 {
    let mut z = (index as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
}

#[test]
fn exr_round_trip_keeps_every_bit() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.exr");
    let mut image = numbered(5, 3, &["R", "G", "B", "Variance.B", "Variance.G", "Variance.R", "sampleCount"]);
    image.channels[0].samples[..5].copy_from_slice(&[
        f32::MIN_POSITIVE / 8.0,
        -0.0,
        f32::MAX,
        1.0 + f32::EPSILON,
        -7e-20,
    ]);
    image.channels[3].samples[2] = f32::INFINITY;
    image.metadata.origin = (3, 2);
    image.metadata.display = Window { x: 0, y: 0, width: 16, height: 9 };
    image.metadata.world_to_camera = Some(std::array::from_fn(|i| i as f32));
    image.metadata.world_to_ndc = Some(std::array::from_fn(|i| -(i as f32)));
    let attributes = [
        ("tyndall:device", Attribute::Text("llvmpipe (Größe, 日本)".into())),
        ("tyndall:spp", Attribute::Int(1024)),
        ("tyndall:seconds", Attribute::Float(1.25)),
        ("tyndall:seed", Attribute::Double(f64::from(u32::MAX))),
    ];
    image.metadata.attributes = attributes.map(|(name, value)| (name.to_owned(), value)).into();
    exr::write(&path, &image).unwrap();
    let read = exr::read(&path).unwrap();
    assert_eq!(read, image);
    for (a, b) in read.channels.iter().zip(&image.channels) {
        let bits = |samples: &[f32]| samples.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&a.samples), bits(&b.samples), "channel {}", a.name);
    }
}

#[test]
fn exr_header_is_what_other_programs_expect() {
    use ::exr::prelude::*;
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.exr");
    let mut image = numbered(4, 20, &["R", "G", "B"]);
    image.metadata.origin = (10, 20);
    image.metadata.display = Window { x: 0, y: 0, width: 640, height: 480 };
    exr::write(&path, &image).unwrap();
    let headers = MetaData::read_from_file(&path, true).unwrap().headers;
    assert_eq!(headers.len(), 1);
    let header = &headers[0];
    assert_eq!(header.compression, Compression::ZIP16);
    assert_eq!(header.blocks, ::exr::meta::BlockDescription::ScanLines);
    assert_eq!(header.data_window(), IntegerBounds::new((10, 20), (4usize, 20usize)));
    assert_eq!(header.shared_attributes.display_window, IntegerBounds::new((0, 0), (640usize, 480usize)));
    assert!(header.channels.list.iter().all(|channel| channel.sample_type == SampleType::F32));
}

#[test]
fn channels_are_read_colours_first() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.exr");
    exr::write(&path, &numbered(2, 2, &["sampleCount", "A", "B", "Variance.R", "G", "R"])).unwrap();
    let image = exr::read(&path).unwrap();
    let names: Vec<&str> = image.channels.iter().map(|channel| channel.name.as_str()).collect();
    assert_eq!(names, ["R", "G", "B", "A", "Variance.R", "sampleCount"]);
    assert_eq!(image.channel("Variance.R").unwrap()[0], 21.1);
}

#[test]
fn half_float_layers_are_flattened() {
    use ::exr::prelude::{
        AnyChannel, AnyChannels, Encoding, FlatSamples, Image as File, ImageAttributes, IntegerBounds, Layer,
        LayerAttributes, WritableImage, f16,
    };
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("layers.exr");
    let layer = |name: &str, size: usize, value: f32| {
        let samples = FlatSamples::F16(vec![f16::from_f32(value); size * 2]);
        let channels = AnyChannels::sort([AnyChannel::new("R", samples)].into_iter().collect());
        Layer::new((size, 2), LayerAttributes::named(name), Encoding::FAST_LOSSLESS, channels)
    };
    let write = |sizes: [usize; 2]| {
        let layers = vec![layer("direct", sizes[0], 0.5), layer("indirect", sizes[1], 0.25)];
        let attributes = ImageAttributes::new(IntegerBounds::from_dimensions((3usize, 2usize)));
        File::from_layers(attributes, layers).write().to_file(&path).unwrap();
    };
    write([3, 3]);
    let image = exr::read(&path).unwrap();
    assert_eq!(image.channel("direct.R"), Some([0.5; 6].as_slice()));
    assert_eq!(image.channel("indirect.R"), Some([0.25; 6].as_slice()));
    assert_eq!(image.rgb(), Err("R"));
    write([3, 2]);
    let error = exr::read(&path).unwrap_err();
    assert!(error.to_string().ends_with("its layers cover different pixels"), "{error}");
}

#[test]
fn what_is_not_an_exr_is_an_error() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.exr");
    let missing = exr::read(&path).unwrap_err();
    assert!(matches!(missing, ImageError::Read { .. }) && missing.to_string().contains("a.exr"), "{missing}");

    fs::write(&path, "not an image").unwrap();
    assert!(matches!(exr::read(&path).unwrap_err(), ImageError::Format { .. }));

    // Every truncation of a good file is an error and not a crash.
    exr::write(&path, &numbered(7, 5, &["R", "G", "B"])).unwrap();
    let whole = fs::read(&path).unwrap();
    for length in (0..whole.len()).step_by(11) {
        fs::write(&path, &whole[..length]).unwrap();
        assert!(exr::read(&path).is_err(), "the first {length} of {} bytes", whole.len());
    }
}

#[test]
fn files_appear_whole_or_not_at_all() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("file");
    let names = || fs::read_dir(directory.path()).unwrap().count();
    let failed = write_whole(&path, |file| {
        file.write_all(b"half")?;
        Err(std::io::Error::other("the power went out"))
    });
    assert_eq!(failed.unwrap_err().to_string(), format!("cannot write {}: the power went out", path.display()));
    assert_eq!(names(), 0, "a failed write leaves nothing behind");

    write_whole(&path, |file| file.write_all(b"old")).unwrap();
    assert!(write_whole(&path, |_| Err(std::io::Error::other("again"))).is_err());
    assert_eq!(fs::read(&path).unwrap(), b"old", "a failed write leaves the old file");
    write_whole(&path, |file| file.write_all(b"new")).unwrap();
    assert_eq!((fs::read(&path).unwrap().as_slice(), names()), (b"new".as_slice(), 1));

    check_writable(&path).unwrap();
    assert_eq!((fs::read(&path).unwrap().as_slice(), names()), (b"new".as_slice(), 1), "checking leaves no trace");
    assert!(check_writable(directory.path()).is_err(), "a directory is not a file");
    let nowhere = check_writable(&directory.path().join("missing/file")).unwrap_err();
    assert!(nowhere.to_string().contains("there is no directory"), "{nowhere}");
}

#[cfg(unix)]
#[test]
fn files_have_ordinary_permissions_and_links_stay() {
    use std::os::unix::fs::{MetadataExt, symlink};
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("file");
    write_whole(&path, |file| file.write_all(b"x")).unwrap();
    let ordinary = directory.path().join("ordinary");
    fs::write(&ordinary, "x").unwrap();
    let mode = |path: &Path| fs::metadata(path).unwrap().mode();
    assert_eq!(mode(&path), mode(&ordinary), "{:o}", mode(&path));

    let link = directory.path().join("link");
    symlink(&path, &link).unwrap();
    write_whole(&link, |file| file.write_all(b"through")).unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"through");
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());

    // Renaming over a device would remove it.
    assert!(write_whole(Path::new("/dev/null"), |_| Ok(())).is_err());
    assert!(!fs::metadata("/dev/null").unwrap().is_file());
}

#[test]
fn png_has_the_right_pixels() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.png");
    let mut image = Image::new(2, 1);
    image.push("R", vec![0.0, 1.0]);
    image.push("G", vec![0.214_041_14, 2.0]);
    image.push("B", vec![-1.0, f32::NAN]);
    preview::write_png(&path, &image).unwrap();
    let decoder = png::Decoder::new(std::io::BufReader::new(fs::File::open(&path).unwrap()));
    let mut reader = decoder.read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    assert_eq!((info.width, info.height, info.bit_depth), (2, 1, png::BitDepth::Eight));
    assert!(reader.info().srgb.is_some());
    assert_eq!(pixels, [0, 128, 0, 255, 255, 0]);

    image.channels.pop();
    let error = preview::write_png(&path, &image).unwrap_err();
    assert!(error.to_string().ends_with("the image has no channel B"), "{error}");
}

#[test]
fn metrics_of_a_case_done_by_hand() {
    // Two pixels. Reference: (1, 2, 3) and (0, 0, 6), mean 2, so e² = 0.04. The image adds 1 to G of the first pixel and
    // 2 to R of the second.
    let mut reference = Image::new(2, 1);
    let mut image = Image::new(2, 1);
    for (name, r, x) in [("R", [1.0, 0.0], [1.0, 2.0]), ("G", [2.0, 0.0], [3.0, 0.0]), ("B", [3.0, 6.0], [3.0, 6.0])] {
        reference.push(name, r.to_vec());
        image.push(name, x.to_vec());
    }
    let comparison = compare(&image, &reference).unwrap();
    let close = |got: f64, expected: f64| {
        assert!((got - expected).abs() < 1e-12 * expected.abs().max(1.0), "{got} is not {expected}")
    };
    close(comparison.mse, (1.0 + 4.0) / 6.0);
    close(comparison.rel_mse, 0.5 * (1.0 / 4.04 / 3.0 + 4.0 / 0.04 / 3.0));
    // d of R is (0, 2): mean 1, sample variance 2, so the standard error is 1.
    let [r, g, b] = comparison.channels;
    close(r.difference, 1.0);
    close(r.z, 1.0);
    close(g.z, 1.0);
    assert_eq!((b.difference, b.z), (0.0, 0.0));
    // d of the mean is (1/3, 2/3): mean 1/2, standard error 1/6.
    close(comparison.mean.difference, 0.5);
    close(comparison.mean.z, 3.0);
    close(comparison.mean.reference, 2.0);
    close(comparison.mean.image, 2.5);
}

#[test]
fn trimming_drops_the_worst_hundredth() {
    let reference = gray(20, 10, |_| 1.0);
    // An error of 1/10 everywhere, and a firefly in 2 of 200 pixels.
    let image = gray(20, 10, |pixel| if pixel % 100 == 7 { 1000.0 } else { 1.1 });
    let comparison = compare(&image, &reference).unwrap();
    assert!((comparison.trimmed_rel_mse - 0.01 / 1.01).abs() < 1e-8, "{comparison:?}");
    assert!(comparison.rel_mse > 9000.0);
    // A third firefly is not trimmed.
    let image = gray(20, 10, |pixel| if pixel % 100 == 7 || pixel == 0 { 1000.0 } else { 1.1 });
    assert!(compare(&image, &reference).unwrap().trimmed_rel_mse > 4000.0);
}

#[test]
fn z_knows_noise_that_neighbours_have_in_common() {
    // Blocks of 8 × 8 pixels have one noise: the error of the mean is eight times that of as many independent pixels.
    let side = 128;
    let blocks = |seed: usize| gray(side, side, move |i| noise(seed * 4096 + i / side / 8 * 16 + i % side / 8));
    let single = |seed: usize| gray(side, side, move |i| noise(seed * 65536 + i));
    let flat = gray(side, side, |_| 0.5);
    let spread = |image: &dyn Fn(usize) -> Image| {
        let z = (1..40).map(|seed| compare(&image(seed), &flat).unwrap().mean.z.powi(2));
        (z.sum::<f64>() / 39.0).sqrt()
    };
    // Standard deviation of 39 values: 1 ± 0.11; a little less, since the largest of several errors counts.
    for z in [spread(&blocks), spread(&single)] {
        assert!((0.55..1.35).contains(&z), "{z}");
    }
    let brighter = gray(side, side, |i| noise(4096 + i / side / 8 * 16 + i % side / 8) + 0.2);
    assert!(compare(&brighter, &flat).unwrap().mean.z > 4.0);
}

#[test]
fn z_tells_a_bias_from_noise() {
    // Two images of the same mean with independent noise, and then one of them 2 % brighter.
    let (width, height) = (64, 64);
    let reference = gray(width, height, |pixel| 0.9 + 0.2 * noise(pixel));
    let unbiased = gray(width, height, |pixel| 0.9 + 0.2 * noise(pixel + 1_000_000));
    let brighter = gray(width, height, |pixel| 1.02 * (0.9 + 0.2 * noise(pixel + 1_000_000)));
    let same = compare(&unbiased, &reference).unwrap();
    assert!(same.mean.z.abs() < 3.5, "{same:?}");
    let biased = compare(&brighter, &reference).unwrap();
    assert!(biased.mean.z > 10.0 && biased.channels.iter().all(|channel| channel.z > 10.0), "{biased:?}");
    assert!((biased.mean.difference - 0.02).abs() < 0.004, "{biased:?}");
    // The sign is that of image − reference.
    assert!(compare(&reference, &brighter).unwrap().mean.z < -10.0);
}

#[test]
fn equal_images_do_not_differ() {
    let image = numbered(9, 7, &["R", "G", "B"]);
    let comparison = compare(&image, &image).unwrap();
    assert_eq!((comparison.mse, comparison.rel_mse, comparison.trimmed_rel_mse), (0.0, 0.0, 0.0));
    assert_eq!((comparison.mean.difference, comparison.mean.z), (0.0, 0.0));
    let black = gray(3, 3, |_| 0.0);
    assert_eq!(compare(&black, &black).unwrap().rel_mse, 0.0);
    assert_eq!(compare(&gray(3, 3, |_| 1.0), &black).unwrap().rel_mse, f64::INFINITY);
    // The same difference everywhere has no scatter: it is infinitely significant.
    assert_eq!(compare(&gray(3, 3, |_| 1.5), &gray(3, 3, |_| 1.0)).unwrap().mean.z, f64::INFINITY);
}

#[test]
fn images_that_cannot_be_compared_are_errors() {
    let image = gray(4, 3, |_| 1.0);
    let error = compare(&image, &gray(3, 4, |_| 1.0)).unwrap_err();
    assert_eq!(error, MetricsError::Size { image: (4, 3), reference: (3, 4) });
    assert_eq!(error.to_string(), "the image has 4×3 pixels but the reference 3×4");

    let mut spoilt = image.clone();
    spoilt.channels[1].samples[6] = f32::INFINITY;
    assert_eq!(compare(&image, &spoilt).unwrap_err().to_string(), "the reference is inf at pixel (2, 1), channel G");
    spoilt.channels[1].samples[6] = f32::NAN;
    assert_eq!(compare(&spoilt, &image).unwrap_err().to_string(), "the image is NaN at pixel (2, 1), channel G");

    spoilt.channels.remove(2);
    assert_eq!(compare(&image, &spoilt), Err(MetricsError::MissingChannel { which: "reference", channel: "B" }));
    let empty = gray(0, 0, |_| 1.0);
    assert_eq!(compare(&empty, &empty), Err(MetricsError::Empty));
}

#[test]
fn half_precision_keeps_eleven_digits_of_colors_and_all_of_counts() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("half.exr");
    let mut image = Image::new(2, 1);
    for name in ["R", "Variance.R", "sampleCount"] {
        image.push(name, vec![0.1, 5001.0]);
    }
    image.metadata.half = true;
    exr::write(&path, &image).unwrap();
    let read = exr::read(&path).unwrap();
    // 0.1 in binary with eleven digits is 1638/2^14; 5001 has 13 digits.
    assert_eq!(read.channel("R").unwrap(), [1638.0 / 16384.0, 5000.0]);
    for exact in ["Variance.R", "sampleCount"] {
        assert_eq!(read.channel(exact).unwrap(), [0.1, 5001.0]);
    }
}
