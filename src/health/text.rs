//! The result of a check as a table.

use super::{Albedo, Finding, Kept, MeasurementHealth, ModelHealth, written};
use std::fmt::Write as _;

/// Largest number of parameters or channels that are listed.
const LISTED: usize = 12;

/// The result of checking a model as a table, ending in a newline.
#[must_use]
pub fn model_table(health: &ModelHealth) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = write_model(&mut text, health);
    text
}

/// The result of checking a measurement as a table, ending in a newline.
#[must_use]
pub fn measurement_table(health: &MeasurementHealth) -> String {
    let mut text = String::new();
    let _ = write_measurement(&mut text, health);
    text
}

fn write_model(text: &mut String, health: &ModelHealth) -> std::fmt::Result {
    if let Some(path) = &health.path {
        writeln!(text, "{path}")?;
    }
    writeln!(text, "{}", health.model)?;
    for p in health.parameters.iter().take(LISTED) {
        let unit = if p.unit == "1" { String::new() } else { format!(" {}", p.unit) };
        writeln!(text, "  {:<28} {}{unit}", p.name, p.value)?;
    }
    more(text, health.parameters.len())?;
    for channel in health.channels.iter().take(LISTED) {
        writeln!(text, "\nchannel {}", channel.name)?;
        let r = &channel.reciprocity;
        let at = if r.largest > 0.0 { format!(", at {} deg", written(&r.at_deg)) } else { String::new() };
        writeln!(
            text,
            "  reciprocity  largest relative difference {:.1e} of {} pairs{at}",
            r.largest, r.pairs
        )?;
        let least = &channel.least;
        writeln!(text, "  least f      {:.4e} 1/sr, at {} deg", least.value, written(&least.at_deg))?;
        let every = channel.albedo.iter().filter(|a| a.phi_i_deg == 0.0);
        let angles: Vec<String> = every.clone().map(|a| format!("{:>10}", a.theta_i_deg)).collect();
        let values: Vec<String> = every.map(|a| format!("{:>10}", or_dash(a.value))).collect();
        writeln!(text, "  theta_i, deg {}\n  albedo       {}", angles.join(""), values.join(""))?;
        writeln!(text, "  furnace      {}", albedo(&channel.furnace))?;
        let e = &channel.extremes;
        writeln!(
            text,
            "  extremes     {} values and {} derivatives not finite, of {}",
            e.values, e.derivatives, e.tried
        )?;
        writeln!(
            text,
            "  digits       f64 {}; f32 {}",
            digits(&channel.digits.f64),
            digits(&channel.digits.f32)
        )?;
    }
    more(text, health.channels.len())?;
    let b = &health.at_bounds;
    writeln!(
        text,
        "\nshapes at their bounds: {} values and {} derivatives not finite, of {}",
        b.values, b.derivatives, b.tried
    )?;
    verdict(text, health.sound, &health.findings)
}

fn more(text: &mut String, count: usize) -> std::fmt::Result {
    if count > LISTED { writeln!(text, "  and {} more: see --json", count - LISTED) } else { Ok(()) }
}

fn or_dash(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.6}"))
}

fn albedo(a: &Albedo) -> String {
    let error = a.error.map_or_else(String::new, |error| format!(" +/- {error:.1e}"));
    format!("largest albedo {}{error}, at theta_i = {} deg", or_dash(a.value), a.theta_i_deg)
}

fn digits(kept: &Kept) -> String {
    match (&kept.least, kept.median) {
        (Some(least), Some(median)) => format!("{:.1} at least, {median:.1} median", least.digits),
        _ => "none counted, f is too small".to_owned(),
    }
}

fn verdict(text: &mut String, sound: bool, findings: &[Finding]) -> std::fmt::Result {
    for finding in findings.iter().filter(|finding| finding.breaks) {
        let channel =
            finding.channel.as_ref().map_or_else(String::new, |channel| format!(" (channel {channel})"));
        writeln!(text, "{}: {}{channel}", finding.kind, finding.text)?;
    }
    writeln!(text, "{}", if sound { "sound" } else { "BREAKS PHYSICS" })
}

fn write_measurement(text: &mut String, health: &MeasurementHealth) -> std::fmt::Result {
    writeln!(text, "{} ({}), {} samples", health.path, health.format, health.samples)?;
    match health.reciprocity {
        Some(rms) => writeln!(
            text,
            "reciprocity  {:.2} % rms over {} pairs measured both ways",
            100.0 * rms,
            health.reciprocity_pairs
        )?,
        None if health.format == "merl" => writeln!(text, "reciprocity  assumed by the table")?,
        None => writeln!(text, "reciprocity  no pair of directions was measured both ways")?,
    }
    writeln!(
        text,
        "\n{:<10} {:>12} {:>9} {:>13}  largest albedo",
        "channel", "smallest", "negative", "beyond noise"
    )?;
    for channel in health.channels.iter().take(LISTED) {
        let n = &channel.negative;
        let most = channel.albedo.iter().flatten().max_by(|a, b| a.value.total_cmp(&b.value));
        let most = most.map_or_else(
            || "unknown: the samples have no known solid angles".to_owned(),
            |a| {
                let [low, high] = a.theta_i_deg;
                format!("{:.4} +/- {:.1e}, at theta_i from {low} to {high} deg", a.value, a.error)
            },
        );
        writeln!(
            text,
            "{:<10} {:>12.6} {:>9} {:>13}  {most}",
            channel.name, n.least, n.values, n.beyond_noise
        )?;
    }
    more(text, health.channels.len())?;
    writeln!(text)?;
    verdict(text, health.sound, &health.findings)
}
