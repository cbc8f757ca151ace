//! Results as text: CSV with every picture, Markdown with what follows.

use std::fmt::Write;

use super::results::{Clock, Measure, Ratio, Record, Summary, Time, geometric_mean};

/// What a reader has to know beside the figures.
pub struct Conditions {
    /// Tyndall's device and driver.
    pub device: String,
    /// The other renderer with its version, if one took part.
    pub peer: Option<String>,
    /// Pictures for each budget and configuration.
    pub seeds: u32,
    /// The budgets.
    pub budgets: Vec<String>,
    /// What could not take part, each with scene, configuration and cause in one line.
    pub failures: Vec<String>,
}

/// Every picture, one a line. Errors are those against the reference; `ref_…` are the reference's own.
pub fn csv(records: &[Record]) -> String {
    let mut text = "scene,renderer,configuration,seed,spp,pixels,cpu_s,wall_s,start_cpu_s,start_wall_s,cold_start,\
                    relmse,trimmed_relmse,mse,ref_relmse,ref_trimmed_relmse,ref_mse,z\n"
        .to_owned();
    for record in records {
        let Record { scene, renderer, configuration, seed, spp, pixels, time, own_error, .. } = record;
        let optional = |value: Option<f64>| value.map(|value| format!("{value:.6}")).unwrap_or_default();
        let (start_cpu, start_wall) = (record.start_up.map(|time| time.cpu), record.start_up.map(|time| time.wall));
        let trimmed = own_error.trimmed_rel_mse.map(|value| format!("{value:.6e}")).unwrap_or_default();
        let (start_cpu, start_wall) = (optional(start_cpu), optional(start_wall));
        // Names of scenes are names of files, which may hold anything.
        let scene = format!("\"{}\"", scene.replace('"', "\"\""));
        let _ = writeln!(
            text,
            "{scene},{renderer},{configuration},{seed},{spp},{pixels},{:.6},{:.6},{start_cpu},{start_wall},{},{:.6e},\
             {:.6e},{:.6e},{:.6e},{trimmed},{:.6e},{:.3}",
            time.cpu,
            time.wall,
            record.cold,
            record.rel_mse,
            record.trimmed_rel_mse,
            record.mse,
            own_error.rel_mse,
            own_error.mse,
            record.z,
        );
    }
    text
}

/// The tables: Tyndall against the strongest configuration of the other, if there is one, and everything that was measured.
pub fn markdown(summaries: &[Summary], conditions: &Conditions) -> String {
    let mut text = String::new();
    let Conditions { device, peer, seeds, budgets, failures } = conditions;
    let processor = processor();
    let _ = writeln!(text, "Tyndall {} on {device}; {processor}.", env!("CARGO_PKG_VERSION"));
    let against = peer.as_ref().map(|peer| format!(" Against {peer}, in turns.")).unwrap_or_default();
    let _ = writeln!(text, "Budgets: {}; seeds: {seeds}.{against}\n", budgets.join(", "));
    if peer.is_some() {
        ratios(&mut text, summaries);
    }
    levers(&mut text, summaries);
    text.push_str(
        "| scene | configuration | Msamples/CPU s | Msamples/s | first start, s | later, s | relMSE·CPU s \
         | with first start | trimmed·CPU s | MSE·CPU s | mean z |\n|---|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n",
    );
    for summary in summaries {
        let figure = |measure, clock| number(summary.figure(measure, clock));
        let start = |time: Option<Time>| time.map_or("–".to_owned(), |time| format!("{:.1}", time.wall));
        let _ = writeln!(
            text,
            "| {} | {} {} | {:.3} | {:.3} | {} | {} | {} | {} | {} | {} | {:+.1}{} |",
            summary.scene,
            summary.renderer,
            summary.configuration,
            summary.msamples_per_cpu_second,
            summary.msamples_per_second,
            start(summary.cold_start),
            start(summary.warm_start),
            figure(Measure::RelMse, Clock::Cpu),
            figure(Measure::RelMse, Clock::CpuWithColdStart),
            figure(Measure::Trimmed, Clock::Cpu),
            figure(Measure::Mse, Clock::Cpu),
            summary.mean_z,
            if summary.is_credible() { "" } else { " **!**" },
        );
    }
    if summaries.iter().any(|summary| !summary.is_credible()) {
        text.push_str("\n**!** The mean is not that of the reference: biased, or too few samples. Not compared.\n");
    }
    if !failures.is_empty() {
        text.push_str("\nCould not take part:\n\n");
        failures.iter().for_each(|failure| text.extend(["- ", failure, "\n"]));
    }
    text
}

/// A column of ratios: by which measure, on which clock, and which number of the ratio.
type Column = ((Measure, Clock), fn(&Ratio) -> f64);

/// The columns; the first is the one that the configuration is named for.
const COLUMNS: [Column; 5] = [
    ((Measure::RelMse, Clock::Cpu), |ratio| ratio.value),
    ((Measure::RelMse, Clock::Cpu), |ratio| ratio.at_largest),
    ((Measure::Trimmed, Clock::Cpu), |ratio| ratio.value),
    ((Measure::Mse, Clock::Cpu), |ratio| ratio.value),
    ((Measure::RelMse, Clock::Wall), |ratio| ratio.value),
];

/// The table of ratios. Each is against the configuration that is strongest by that very column.
fn ratios(text: &mut String, summaries: &[Summary]) {
    text.push_str(
        "| scene | relMSE·CPU s | its strongest configuration | its relMSE·CPU s | **ratio** | at the largest budget \
         | trimmed | MSE | on the wall | budgets | mean z | its z |\n|---|--:|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n",
    );
    let mut columns: [Vec<f64>; COLUMNS.len()] = Default::default();
    for ours in summaries.iter().filter(|summary| summary.is_ours()) {
        let values = COLUMNS.map(|(what, by)| ours.strongest(summaries, what, by).map(|(_, ratio)| by(&ratio)));
        for (column, value) in columns.iter_mut().zip(values) {
            column.extend(value);
        }
        let (what, by) = COLUMNS[0];
        let Some((peer, ratio)) = ours.strongest(summaries, what, by) else {
            let _ = writeln!(text, "| {} | – | nothing to compare | – | – | – | – | – | – | 0 | – | – |", ours.scene);
            continue;
        };
        let [_, largest, trimmed, mse, wall] = values.map(quotient);
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | **{:.2}** ± {:.2} | {largest} | {trimmed} | {mse} | {wall} | {} | {:+.1} | {:+.1} |",
            ours.scene,
            number(ours.figure(Measure::RelMse, Clock::Cpu)),
            peer.configuration,
            number(peer.figure(Measure::RelMse, Clock::Cpu)),
            ratio.value,
            ratio.value * ratio.spread,
            ratio.budgets,
            ours.mean_z,
            peer.mean_z,
        );
    }
    let [main, largest, trimmed, mse, wall] = columns.map(|column| quotient(geometric_mean(column.into_iter())));
    let _ = writeln!(text, "| geometric mean | | | | **{main}** | {largest} | {trimmed} | {mse} | {wall} | | | |\n");
}

/// The table of what each part of the program is worth: error × time without it over error × time with it.
fn levers(text: &mut String, summaries: &[Summary]) {
    let of_tyndall = || summaries.iter().filter(|summary| summary.renderer == "Tyndall");
    let mut names: Vec<&str> = Vec::new();
    for summary in of_tyndall().filter(|summary| !summary.is_ours()) {
        if !names.contains(&summary.configuration.as_str()) {
            names.push(&summary.configuration);
        }
    }
    if names.is_empty() {
        return;
    }
    let _ = writeln!(text, "relMSE·CPU s without a part of the program, over that with it:\n");
    let _ = writeln!(text, "| scene | {} |\n|---|{}", names.join(" | "), "--:|".repeat(names.len()));
    for ours in summaries.iter().filter(|summary| summary.is_ours()) {
        let gain = |name: &&str| {
            let without =
                of_tyndall().find(|summary| summary.scene == ours.scene && summary.configuration == **name)?;
            let figure = |summary: &Summary| summary.figure(Measure::RelMse, Clock::Cpu);
            Some(figure(without)? / figure(ours)?)
        };
        let gains: Vec<String> = names.iter().map(|name| quotient(gain(name))).collect();
        let _ = writeln!(text, "| {} | {} |", ours.scene, gains.join(" | "));
    }
    text.push('\n');
}

/// Two digits behind the point, or a dash.
fn quotient(value: Option<f64>) -> String {
    value.map_or("–".to_owned(), |value| format!("{value:.2}"))
}

/// Three digits, or a dash.
fn number(value: Option<f64>) -> String {
    match value {
        None => "–".to_owned(),
        Some(value) if value != 0.0 => {
            let digits = (2 - value.abs().log10().floor() as i32).clamp(0, 9) as usize;
            format!("{value:.digits$}")
        }
        Some(_) => "0".to_owned(),
    }
}

/// Name and number of cores, as far as the system tells.
fn processor() -> String {
    let cores = std::thread::available_parallelism().map_or(0, usize::from);
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = text.lines().find(|line| line.starts_with("model name")).and_then(|line| line.split(": ").nth(1));
    format!("{}, {cores} cores", name.unwrap_or(std::env::consts::ARCH))
}
