//! What the benchmark of error against time makes of its measurements.

#[path = "../benches/time_to_error/output.rs"]
mod output;
#[path = "../benches/time_to_error/page.rs"]
mod page;
#[path = "../benches/time_to_error/results.rs"]
#[allow(dead_code, reason = "the benchmark uses what the tests do not")]
mod results;

use results::{Clock, Measure, OwnError, Record, Summary, Time, summarize};

const OWN: OwnError = OwnError { rel_mse: 1e-4, trimmed_rel_mse: Some(5e-5), mse: 2e-4 };

const RELMSE: (Measure, Clock) = (Measure::RelMse, Clock::Cpu);

/// A renderer whose relMSE is `error` / spp and which takes `seconds` for a sample of each pixel. The reference's own error is
/// in what it measures, as in reality; MSE is twice and trimmed relMSE half of relMSE.
fn records(renderer: &'static str, configuration: &str, error: f64, seconds: f64) -> Vec<Record> {
    let mut records = Vec::new();
    for seed in 1..=2 {
        for (budget, spp) in [4u32, 16, 64].into_iter().enumerate() {
            // The two seeds scatter by ±10 % around the mean.
            let noise = if seed == 1 { 0.9 } else { 1.1 };
            let (error, time) = (noise * error / f64::from(spp), seconds * f64::from(spp));
            records.push(Record {
                scene: "ball".to_owned(),
                renderer,
                configuration: configuration.to_owned(),
                budget,
                seed,
                spp,
                pixels: 1000,
                cold: seed == 1,
                start_up: Some(Time { wall: 3.0, cpu: if seed == 1 { 2.0 } else { 0.5 } }),
                time: Time { wall: 0.5 * time, cpu: time },
                rel_mse: error + OWN.rel_mse,
                trimmed_rel_mse: 0.5 * error + 5e-5,
                mse: 2.0 * error + OWN.mse,
                own_error: OWN,
                z: f64::from(seed) - 1.5,
            });
        }
    }
    records
}

/// Whether two numbers agree to nine digits.
fn close(got: Option<f64>, expected: f64) -> bool {
    got.is_some_and(|got| (got - expected).abs() <= 1e-9 * expected)
}

fn of(all: &[Summary], configuration: &str) -> Summary {
    all.iter().find(|summary| summary.configuration == configuration).expect("it was measured").clone()
}

#[test]
fn error_times_seconds_is_that_of_the_renderer() {
    let all = summarize(&records("Tyndall", "default", 0.4, 0.05));
    let ours = of(&all, "default");
    // (.4 / spp) × (.05 × spp), whatever the budget.
    assert!(close(ours.figure(Measure::RelMse, Clock::Cpu), 0.02), "{ours:?}");
    assert!(close(ours.figure(Measure::Trimmed, Clock::Cpu), 0.01), "{ours:?}");
    assert!(close(ours.figure(Measure::Mse, Clock::Cpu), 0.04), "{ours:?}");
    assert!(close(ours.figure(Measure::RelMse, Clock::Wall), 0.01), "{ours:?}");
    // 84 spp × 2 seeds × 1000 pixels in 84 × 2 × .05 s.
    assert!(close(Some(ours.msamples_per_cpu_second), 0.02), "{ours:?}");
    assert!(close(Some(ours.msamples_per_second), 0.04), "{ours:?}");
    assert_eq!(ours.mean_z, 0.0);
    assert_eq!(ours.cold_start, Some(Time { wall: 3.0, cpu: 2.0 }));
    assert_eq!(ours.warm_start, Some(Time { wall: 3.0, cpu: 0.5 }));
    // With the first start: the cube root of Π .4/spp (.05 spp + 2).
    let expected: f64 = [4.0, 16.0, 64.0].iter().map(|spp: &f64| 0.4 / spp * (0.05 * spp + 2.0)).product();
    assert!(close(ours.figure(Measure::RelMse, Clock::CpuWithColdStart), expected.cbrt()), "{ours:?}");
}

#[test]
fn the_strongest_configuration_is_compared() {
    let mut measured = records("Tyndall", "default", 0.4, 0.05);
    measured.extend(records("Mitsuba", "weak", 0.8, 0.1));
    measured.extend(records("Mitsuba", "strong", 0.3, 0.1));
    measured.extend(records("Mitsuba", "slow", 0.2, 0.5));
    let all = summarize(&measured);
    let ours = of(&all, "default");
    let (peer, ratio) = ours.strongest(&all, RELMSE, |ratio| ratio.value).expect("there are three");
    assert_eq!(peer.configuration, "strong");
    assert!(close(Some(ratio.value), 0.03 / 0.02), "{ratio:?}");
    assert_eq!(ratio.budgets, 3);
    // ±10 % with two seeds: a standard error of 10 % at each of six points, so √6 / 3 of it.
    assert!(close(Some(ratio.spread), 0.1 * 6f64.sqrt() / 3.0), "{ratio:?}");

    // A renderer that is twice as slow, or whose error is twice as large, must be seen.
    for (error, seconds) in [(0.8, 0.05), (0.4, 0.1)] {
        let mut worse = records("Tyndall", "default", error, seconds);
        worse.extend(records("Mitsuba", "strong", 0.3, 0.1));
        let all = summarize(&worse);
        let (_, ratio) = of(&all, "default").strongest(&all, RELMSE, |ratio| ratio.value).expect("there is one");
        assert!(close(Some(ratio.value), 0.03 / 0.04), "{ratio:?}");
    }
}

#[test]
fn a_fixed_cost_counts_least_at_the_largest_budget() {
    let mut measured = records("Tyndall", "default", 0.4, 0.05);
    let mut with_cost = records("Mitsuba", "fixed cost", 0.4, 0.05);
    with_cost.iter_mut().for_each(|record| record.time.cpu += 0.2);
    measured.extend(with_cost);
    measured.extend(records("Mitsuba", "without", 0.6, 0.05));
    let all = summarize(&measured);
    let ours = of(&all, "default");
    // (.05 spp + .2) / (.05 spp): 2, 1.25 and 1.0625.
    let ratio = ours.ratio(&of(&all, "fixed cost"), Measure::RelMse, Clock::Cpu).expect("all budgets count");
    assert!(
        close(Some(ratio.at_largest), 1.0625) && close(Some(ratio.value.powi(3)), 2.0 * 1.25 * 1.0625),
        "{ratio:?}"
    );
    // Against an error of .6 it is the stronger one by either number; against .5, 1.25 times ours, by one of them alone.
    let strongest = |all: &[Summary], by| ours.strongest(all, RELMSE, by).map(|(peer, _)| peer.configuration.clone());
    assert_eq!(strongest(&all, |ratio| ratio.value).as_deref(), Some("fixed cost"));
    let mut measured = records("Mitsuba", "without", 0.5, 0.05);
    let mut with_cost = records("Mitsuba", "fixed cost", 0.4, 0.05);
    with_cost.iter_mut().for_each(|record| record.time.cpu += 0.2);
    measured.extend(with_cost);
    let all = summarize(&measured);
    assert_eq!(strongest(&all, |ratio| ratio.value).as_deref(), Some("without"));
    assert_eq!(strongest(&all, |ratio| ratio.at_largest).as_deref(), Some("fixed cost"));
}

#[test]
fn a_biased_configuration_does_not_win() {
    let mut measured = records("Mitsuba", "honest", 0.3, 0.1);
    let mut biased = records("Mitsuba", "biased", 0.1, 0.1);
    biased.iter_mut().for_each(|record| record.z = -5.0);
    measured.extend(biased);
    let mut others = measured.clone();
    measured.extend(records("Tyndall", "default", 0.4, 0.05));
    let all = summarize(&measured);
    let (peer, _) = of(&all, "default").strongest(&all, RELMSE, |ratio| ratio.value).expect("one is left");
    assert_eq!(peer.configuration, "honest");
    // Nor are we compared if the bias is ours.
    let mut ours = records("Tyndall", "default", 0.4, 0.05);
    ours.iter_mut().for_each(|record| record.z = 4.5);
    others.extend(ours);
    let all = summarize(&others);
    assert!(of(&all, "default").strongest(&all, RELMSE, |ratio| ratio.value).is_none());
}

#[test]
fn errors_below_that_of_the_reference_are_not_figures() {
    // .4 / 64 is 62 times the reference's error; .004 / 64 is less than it, .004 / 16 two and a half times it.
    let all = summarize(&records("Tyndall", "default", 0.004, 0.05));
    let known: Vec<bool> = all[0].points.iter().map(|point| point.errors[0].is_some()).collect();
    assert_eq!(known, [true, true, false]);
    assert!(close(all[0].figure(Measure::RelMse, Clock::Cpu), 0.0002), "{:?}", all[0]);

    // A trimmed error from which nothing can be taken away needs more room, and keeps what is in it.
    let mut measured = records("Tyndall", "default", 0.004, 0.05);
    for record in &mut measured {
        record.own_error.trimmed_rel_mse = None;
    }
    let trimmed: Vec<Option<f64>> = summarize(&measured)[0].points.iter().map(|point| point.errors[1]).collect();
    assert!(close(trimmed[0], 0.0005 + 5e-5) && trimmed[1].is_none() && trimmed[2].is_none(), "{trimmed:?}");

    // Nothing above the reference's noise: no figure and no ratio.
    let mut converged = records("Tyndall", "default", 1e-5, 0.05);
    converged.extend(records("Mitsuba", "strong", 0.3, 0.1));
    let all = summarize(&converged);
    assert_eq!(all[0].figure(Measure::RelMse, Clock::Cpu), None);
    assert!(all[0].strongest(&all, RELMSE, |ratio| ratio.value).is_none());
}

#[test]
fn the_table_shows_what_was_measured() {
    let mut measured = records("Tyndall", "default", 0.4, 0.05);
    measured.extend(records("Mitsuba", "weak", 0.8, 0.1));
    measured.extend(records("Mitsuba", "strong", 0.3, 0.1));
    let conditions = |peer: Option<&str>| output::Conditions {
        device: "a device".to_owned(),
        peer: peer.map(str::to_owned),
        seeds: 2,
        budgets: vec!["4 spp".to_owned()],
        failures: vec!["ball, odd: no".to_owned()],
    };
    let table = output::markdown(&summarize(&measured), &conditions(Some("Mitsuba 3")));
    assert!(
        table.contains("| ball | 0.0200 | strong | 0.0300 | **1.50** ± 0.12 | 1.50 | 1.50 | 1.50 | 1.50 | 3 |"),
        "{table}"
    );
    assert!(table.contains("| geometric mean | | | | **1.50** | 1.50 | 1.50 | 1.50 | 1.50 | | | |"), "{table}");
    assert!(table.contains("| ball | Mitsuba weak | 0.010 | 0.020 | 3.0 | 3.0 | 0.0800 |"), "{table}");
    assert!(table.contains("Could not take part:\n\n- ball, odd: no\n") && !table.contains("**!**"), "{table}");
    // All rows of a table have as many cells as its head.
    let cells: Vec<usize> =
        table.lines().filter(|line| line.starts_with('|')).map(|l| l.matches('|').count()).collect();
    assert_eq!(cells, [13, 13, 13, 13, 12, 12, 12, 12, 12], "{table}");

    let alone = output::markdown(&summarize(&records("Tyndall", "default", 0.4, 0.05)), &conditions(None));
    assert!(table.contains("strongest") && !alone.contains("strongest"), "{alone}");

    let csv = output::csv(&measured);
    let columns: Vec<usize> = csv.lines().map(|line| line.split(',').count()).collect();
    assert_eq!(columns, vec![18; 1 + measured.len()], "{csv}");
}

#[test]
fn a_table_replaces_the_one_before() {
    let page = "Before.\n\n<!-- begin a -->\n\nold\n\n<!-- end a -->\n\nAfter.\n";
    let expected = "Before.\n\n<!-- begin a -->\n\nnew\n\n<!-- end a -->\n\nAfter.\n";
    assert_eq!(page::embed(page, "a", "new\n").as_deref(), Some(expected));
    assert_eq!(page::embed(expected, "a", "new").as_deref(), Some(expected), "the second time as the first");
    assert_eq!(page::embed(page, "b", "new"), None);
    assert_eq!(page::embed("<!-- end a --><!-- begin a -->", "a", "new"), None);
}

#[test]
fn the_page_has_a_place_for_each_table() {
    let page = include_str!("../docs/BENCHMARKS.md");
    for name in ["time_to_error", "kernels"] {
        assert!(page::embed(page, name, "").is_some(), "{name}");
    }
}
