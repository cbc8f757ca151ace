//! The arguments and their syntax.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, Parser, Subcommand};
use tyndall::scene::{Crop, Film, Scene};

use super::error::CliError;

/// Largest width and height of a film, in pixels.
const LARGEST_SIDE: u32 = 1 << 16;

/// A headless, progressive, unbiased volumetric path tracer on Vulkan compute.
#[derive(Debug, Parser)]
#[command(name = "tyndall", version, after_help = EXIT_CODES)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

const EXIT_CODES: &str = "\
Exit codes:
  0   done
  1   the render failed, or samples were not finite; or `check --strict` has something to say
  2   the arguments or the scene are wrong
  69  no usable device
  74  a file cannot be read or written
  75  stopped early by SIGINT or SIGTERM; the image is written";

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render a scene to an OpenEXR image
    Render(RenderArgs),
    /// List the devices that can render
    Devices,
    /// Measure how far an image is from a reference
    Compare(CompareArgs),
    /// Tell what is in a scene, and what is doubtful about it
    Check(CheckArgs),
}

/// Arguments of `tyndall render`.
#[derive(Debug, Args)]
#[command(after_help = EXIT_CODES)]
pub struct RenderArgs {
    /// Scene in Mitsuba 3's XML format
    #[arg(value_name = "SCENE.xml")]
    pub scene: PathBuf,
    /// Image to write [default: the scene's path with the extension .exr]
    #[arg(short, long, value_name = "OUT.exr")]
    pub output: Option<PathBuf>,
    /// Samples for each pixel [default: the scene's]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(i32::MAX)))]
    pub spp: Option<u32>,
    /// End regularly after this time, with the samples done by then: 90s, 10m, 1h30m
    #[arg(long, value_name = "TIME", value_parser = parse_duration)]
    pub time_limit: Option<Duration>,
    /// Size of the whole film in pixels; a crop window in the scene is dropped
    #[arg(long, value_name = "WxH", value_parser = parse_resolution)]
    pub resolution: Option<(u32, u32)>,
    /// Render only the columns x0 to x1 - 1 and the rows y0 to y1 - 1 of the film
    #[arg(long, value_name = "x0,x1,y0,y1", value_parser = parse_crop)]
    pub crop: Option<Crop>,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u32,
    /// Set a parameter ($name) of the scene; may be repeated
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = parse_override)]
    pub overrides: Vec<(String, String)>,
    /// `auto`, a part of a device's name or its number as listed by `tyndall devices`, or `reference` (the CPU)
    #[arg(long, value_name = "NAME|INDEX|reference", default_value = "auto")]
    pub device: String,
    /// Russian roulette by the throughput alone, without a pilot run that finds out where paths are worth their time
    #[arg(long)]
    pub no_pilot: bool,
    /// Each pixel has paths of its own: more noise, but independent from pixel to pixel
    #[arg(long)]
    pub no_sharing: bool,
    /// Each pixel has the same number of samples, instead of more where a trial shows noise and fewer elsewhere
    #[arg(long)]
    pub no_allocation: bool,
    /// Also write an 8-bit sRGB PNG to look at
    #[arg(long, value_name = "OUT.png")]
    pub preview: Option<PathBuf>,
    /// Print errors only
    #[arg(short, long)]
    pub quiet: bool,
}

/// Arguments of `tyndall compare`.
#[derive(Debug, Args)]
pub struct CompareArgs {
    /// The image to judge
    #[arg(value_name = "A.exr")]
    pub image: PathBuf,
    /// What it should be
    #[arg(value_name = "REF.exr")]
    pub reference: PathBuf,
}

/// Arguments of `tyndall check`.
#[derive(Debug, Args)]
#[command(after_help = EXIT_CODES)]
pub struct CheckArgs {
    /// Scene in Mitsuba 3's XML format
    #[arg(value_name = "SCENE.xml")]
    pub scene: PathBuf,
    /// Set a parameter ($name) of the scene; may be repeated
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = parse_override)]
    pub overrides: Vec<(String, String)>,
    /// Print JSON, for programs
    #[arg(long)]
    pub json: bool,
    /// End with exit code 1 if there are warnings or doubts
    #[arg(long)]
    pub strict: bool,
}

impl RenderArgs {
    /// The image to write.
    pub fn output(&self) -> PathBuf {
        self.output.clone().unwrap_or_else(|| self.scene.with_extension("exr"))
    }

    /// Changes the film of `scene` as asked, and returns the number of samples.
    pub fn apply(&self, scene: &mut Scene) -> Result<u32, CliError> {
        if let Some((width, height)) = self.resolution {
            let whole = Film::new(width, height);
            let Film { filter, sample_area, pixel_format, .. } = scene.film;
            scene.film = Film { filter, sample_area: sample_area.and(whole.sample_area), pixel_format, ..whole };
        }
        if let Some(crop) = self.crop {
            let film = &mut scene.film;
            // The corners were checked against overflow when they were parsed.
            if crop.x + crop.width > film.width || crop.y + crop.height > film.height {
                let message =
                    format!("the crop window does not lie in the film of {}×{} pixels", film.width, film.height);
                return Err(CliError::Usage(message));
            }
            film.crop = crop;
            // A part of the picture is as it would be in the whole.
            film.sample_area = film.sample_area.and(Film::new(film.width, film.height).sample_area);
        }
        let spp = self.spp.unwrap_or(scene.sample_count);
        if !(1..=i32::MAX as u32).contains(&spp) {
            return Err(CliError::Scene(format!(
                "the scene asks for {spp} samples a pixel; give another number with --spp"
            )));
        }
        Ok(spp)
    }
}

/// `90s`, `1.5m`, `1h30m`, `500ms`: numbers with units.
fn parse_duration(text: &str) -> Result<Duration, String> {
    let expected = || "expected a time such as 90s, 10m or 1h30m".to_owned();
    let mut seconds = 0.0;
    let mut rest = text;
    while !rest.is_empty() {
        let number_end = rest.find(|c: char| !c.is_ascii_digit() && c != '.').ok_or_else(expected)?;
        let (number, tail) = rest.split_at(number_end);
        let unit_end = tail.find(|c: char| !c.is_ascii_alphabetic()).unwrap_or(tail.len());
        let (unit, tail) = tail.split_at(unit_end);
        let factor = match unit {
            "ms" => 1e-3,
            "s" => 1.0,
            "m" => 60.0,
            "h" => 3600.0,
            _ => return Err(expected()),
        };
        seconds += factor * number.parse::<f64>().map_err(|_| expected())?;
        rest = tail;
    }
    match Duration::try_from_secs_f64(seconds) {
        Ok(duration) if duration > Duration::ZERO => Ok(duration),
        Ok(_) => Err("expected a time above 0".to_owned()),
        Err(_) => Err("the time is too long".to_owned()),
    }
}

fn parse_resolution(text: &str) -> Result<(u32, u32), String> {
    let side = |text: &str| text.parse().ok().filter(|side| (1..=LARGEST_SIDE).contains(side));
    let pair = text.split_once('x').and_then(|(width, height)| Some((side(width)?, side(height)?)));
    pair.ok_or_else(|| format!("expected a width and height of 1 to {LARGEST_SIDE} pixels, such as 640x480"))
}

fn parse_crop(text: &str) -> Result<Crop, String> {
    let numbers: Option<Vec<u32>> = text.split(',').map(|number| number.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[x0, x1, y0, y1]) if x0 < x1 && y0 < y1 => Ok(Crop { x: x0, y: y0, width: x1 - x0, height: y1 - y0 }),
        _ => Err("expected four pixel numbers x0,x1,y0,y1 with x0 < x1 and y0 < y1".to_owned()),
    }
}

fn parse_override(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.is_empty() => Ok((name.to_owned(), value.to_owned())),
        _ => Err("expected NAME=VALUE".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;
    use glam::DVec3;
    use tyndall::scene::Camera;

    #[test]
    fn the_definitions_are_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn durations() {
        let cases = [("90s", 90.0), ("10m", 600.0), ("1h", 3600.0), ("1h30m", 5400.0), ("0.5s", 0.5), ("250ms", 0.25)];
        for (text, seconds) in cases {
            assert_eq!(parse_duration(text), Ok(Duration::from_secs_f64(seconds)), "of {text}");
        }
        for text in ["", "10", "s", "-1s", "1d", "0s", "1.2.3s", "1e3s", "9999999999999999999999h", "1 m"] {
            assert!(parse_duration(text).is_err(), "{text:?} is not a time");
        }
    }

    #[test]
    fn resolutions_crops_and_overrides() {
        assert_eq!(parse_resolution("640x480"), Ok((640, 480)));
        for text in ["640", "0x4", "4x0", "-1x4", "640x480x3", "65537x1", "99999999999x1"] {
            assert!(parse_resolution(text).is_err(), "{text:?} is not a size");
        }
        assert_eq!(parse_crop("2,5,1,9"), Ok(Crop { x: 2, y: 1, width: 3, height: 8 }));
        for text in ["", "1,2,3", "1,2,3,4,5", "2,2,0,1", "0,1,4,3", "0,-1,0,1", "a,b,c,d", "0,4294967296,0,1"] {
            assert!(parse_crop(text).is_err(), "{text:?} is not a window");
        }
        assert_eq!(parse_override("a=b=c"), Ok(("a".to_owned(), "b=c".to_owned())));
        assert_eq!(parse_override("a="), Ok(("a".to_owned(), String::new())));
        assert!(parse_override("=b").is_err() && parse_override("a").is_err());
    }

    /// `arguments` applied to a film of 100×50 pixels with a crop window.
    fn apply(arguments: &[&str]) -> Result<(Film, u32), CliError> {
        let mut scene = Scene::new(Camera::look_at(DVec3::Z, DVec3::ZERO, DVec3::Y, 40.0), Film::new(100, 50));
        scene.film.crop = Crop { x: 10, y: 10, width: 20, height: 5 };
        scene.sample_count = 7;
        let command = ["tyndall", "render", "a.xml"].iter().chain(arguments);
        let Command::Render(args) = Cli::try_parse_from(command).unwrap().command else { unreachable!() };
        args.apply(&mut scene).map(|spp| (scene.film, spp))
    }

    #[test]
    fn the_film_is_changed_as_asked() {
        let crop = |x, y, width, height| Crop { x, y, width, height };
        let film = |width, height, crop| Film { crop, ..Film::new(width, height) };
        assert_eq!(apply(&[]).unwrap(), (film(100, 50, crop(10, 10, 20, 5)), 7));
        assert_eq!(apply(&["--spp", "3"]).unwrap().1, 3);
        assert_eq!(apply(&["--resolution", "20x10"]).unwrap().0, Film::new(20, 10));
        assert_eq!(apply(&["--crop", "99,100,0,50"]).unwrap().0, film(100, 50, crop(99, 0, 1, 50)));
        let both = apply(&["--crop", "0,300,0,1", "--resolution", "300x200"]).unwrap().0;
        assert_eq!(both, film(300, 200, crop(0, 0, 300, 1)));
        for outside in ["99,101,0,50", "0,1,0,51", "0,4294967295,0,1"] {
            assert!(matches!(apply(&["--crop", outside]), Err(CliError::Usage(_))), "{outside} lies outside");
        }
    }
}
