//! The plot: a panel for each scene, time against error, both axes logarithmic.

use plotters::coord::Shift;
use plotters::prelude::*;

use super::error::BenchError;
use super::results::{Clock, Measure, Summary};

/// Panels in a row.
const COLUMNS: usize = 3;
/// Width and height of a panel, in pixels.
const PANEL: (u32, u32) = (400, 320);
/// Tyndall, the other's strongest configuration, and the rest of them.
const COLOURS: [RGBColor; 3] = [RGBColor(0, 90, 181), RGBColor(220, 50, 32), RGBColor(190, 190, 190)];

/// The plot as SVG.
pub fn svg(summaries: &[Summary]) -> Result<String, BenchError> {
    let mut scenes: Vec<&str> = Vec::new();
    for summary in summaries {
        if scenes.last() != Some(&summary.scene.as_str()) {
            scenes.push(&summary.scene);
        }
    }
    let columns = scenes.len().clamp(1, COLUMNS);
    let rows = scenes.len().div_ceil(columns).max(1);
    let mut text = String::new();
    {
        let size = (PANEL.0 * columns as u32, PANEL.1 * rows as u32);
        let root = SVGBackend::with_string(&mut text, size).into_drawing_area();
        root.fill(&WHITE).map_err(failed)?;
        for (scene, area) in scenes.iter().zip(root.split_evenly((rows, columns))) {
            let of_scene: Vec<&Summary> = summaries.iter().filter(|summary| summary.scene == **scene).collect();
            panel(scene, &of_scene, summaries, &area)?;
        }
        root.present().map_err(failed)?;
    }
    Ok(text)
}

/// One curve: points (CPU seconds, relMSE).
struct Curve {
    points: Vec<(f64, f64)>,
    colour: RGBColor,
    label: Option<String>,
}

fn panel(
    scene: &str,
    of_scene: &[&Summary],
    all: &[Summary],
    area: &DrawingArea<SVGBackend, Shift>,
) -> Result<(), BenchError> {
    let ours = of_scene.iter().find(|summary| summary.is_ours());
    let strongest = ours
        .and_then(|ours| ours.strongest(all, (Measure::RelMse, Clock::Cpu), |ratio| ratio.value))
        .map(|(peer, _)| peer);
    let is_strongest = |summary: &Summary| strongest.is_some_and(|peer| std::ptr::eq(peer, summary));
    let mut curves: Vec<Curve> = of_scene
        .iter()
        .filter(|summary| summary.is_ours() || summary.renderer != "Tyndall")
        .map(|summary| curve(summary, is_strongest(summary)))
        .collect();
    // Labelled curves last, above the others.
    curves.sort_by_key(|curve| curve.label.is_some());

    let all_points = || curves.iter().flat_map(|curve| curve.points.iter().copied());
    if all_points().next().is_none() {
        // The reference is noisier than everything that was measured.
        return area
            .titled(&format!("{scene}: no error above that of the reference"), ("sans-serif", 14))
            .map(drop)
            .map_err(failed);
    }
    let range = |value: fn((f64, f64)) -> f64| {
        let (low, high) = all_points().map(value).fold((f64::INFINITY, 0.0_f64), |(a, b), x| (a.min(x), b.max(x)));
        (low, high)
    };
    let (shortest, longest) = range(|point| point.0);
    let (smallest, largest) = range(|point| point.1);
    let mut chart = ChartBuilder::on(area)
        .caption(scene, ("sans-serif", 19))
        .margin(8)
        .x_label_area_size(40)
        .y_label_area_size(62)
        // Below the curves there is room for the legend.
        .build_cartesian_2d((0.7 * shortest..1.4 * longest).log_scale(), (0.1 * smallest..1.4 * largest).log_scale())
        .map_err(failed)?;
    chart
        .configure_mesh()
        .x_desc("CPU seconds")
        .y_desc("relMSE")
        .x_labels(6)
        .y_labels(8)
        .x_label_formatter(&|value| axis_label(*value))
        .y_label_formatter(&|value| axis_label(*value))
        .light_line_style(TRANSPARENT)
        .label_style(("sans-serif", 14))
        .draw()
        .map_err(failed)?;
    for Curve { points, colour, label } in curves {
        let style = colour.stroke_width(if label.is_some() { 2 } else { 1 });
        let series = chart.draw_series(LineSeries::new(points.iter().copied(), style).point_size(2)).map_err(failed)?;
        if let Some(label) = label {
            series.label(label).legend(move |(x, y)| PathElement::new([(x, y), (x + 14, y)], style));
        }
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::LowerLeft)
        .background_style(WHITE.mix(0.8))
        .label_font(("sans-serif", 13))
        .draw()
        .map_err(failed)
}

fn curve(summary: &Summary, strongest: bool) -> Curve {
    let ours = summary.is_ours();
    let points =
        summary.points.iter().filter_map(|point| Some((point.time.cpu, point.errors[Measure::RelMse as usize]?)));
    let (colour, label) = match (ours, strongest) {
        (true, _) => (COLOURS[0], Some("Tyndall".to_owned())),
        (false, true) => (COLOURS[1], Some(format!("{}: {}", summary.renderer, summary.configuration))),
        (false, false) => (COLOURS[2], None),
    };
    Curve { points: points.collect(), colour, label }
}

/// "0.05", "20" or, where that would be long, "5e-4".
fn axis_label(value: f64) -> String {
    let one_digit = format!("{value:.0e}");
    if (1e-2..1e4).contains(&value) {
        one_digit.parse::<f64>().map_or(one_digit, |rounded| rounded.to_string())
    } else {
        one_digit
    }
}

fn failed(error: impl std::fmt::Display) -> BenchError {
    BenchError::Plot(error.to_string())
}
