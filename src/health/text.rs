//! The result of a check as a table.

use super::{Albedo, Finding, Kept, Law, MeasurementHealth, ModelHealth, Verdict, written};
use crate::error::rounded;
use crate::lines::{Lines, Role, free, left, right};
use std::fmt::Write as _;

/// Largest number of parameters or channels that are listed.
const LISTED: usize = 12;

/// The result of checking a model as a table, ending in a newline.
#[must_use]
pub fn model_table(health: &ModelHealth) -> String {
    model_lines(health).to_string()
}

/// The lines of [`model_table`].
#[must_use]
pub fn model_lines(health: &ModelHealth) -> Lines {
    Lines::of(|text| write_model(text, health))
}

/// The result of checking a measurement as a table, ending in a newline.
#[must_use]
pub fn measurement_table(health: &MeasurementHealth) -> String {
    measurement_lines(health).to_string()
}

/// The lines of [`measurement_table`].
#[must_use]
pub fn measurement_lines(health: &MeasurementHealth) -> Lines {
    Lines::of(|text| write_measurement(text, health))
}

fn write_model(text: &mut Lines, health: &ModelHealth) -> std::fmt::Result {
    if let Some(path) = &health.path {
        writeln!(text.as_a(Role::Title), "{path}")?;
    }
    writeln!(text.as_a(Role::Title), "{}", health.model)?;
    for p in health.parameters.iter().take(LISTED) {
        let unit = if p.unit == "1" { String::new() } else { format!(" {}", p.unit) };
        text.row(Role::Plain, 2, [left(&*p.name, 28), left(format!("{}{unit}", p.value), 0)]);
    }
    more(text, health.parameters.len())?;
    for channel in health.channels.iter().take(LISTED) {
        writeln!(text)?;
        writeln!(text.as_a(Role::Heading), "channel {}", channel.name)?;
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
        let angles = every.clone().map(|a| right(a.theta_i_deg.to_string(), 9));
        text.row(Role::Plain, 2, [left("theta_i, deg", 13)].into_iter().chain(angles));
        let values = every.map(|a| right(or_dash(a.value), 9));
        text.row(Role::Plain, 2, [left("albedo", 13)].into_iter().chain(values));
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

fn more(text: &mut Lines, count: usize) -> std::fmt::Result {
    if count > LISTED { writeln!(text, "  and {} more: see --json", count - LISTED) } else { Ok(()) }
}

fn or_dash(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |value| rounded(value, 6))
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

fn verdict(text: &mut Lines, sound: bool, findings: &[Finding]) -> std::fmt::Result {
    for finding in findings.iter().filter(|finding| finding.breaks) {
        let channel =
            finding.channel.as_ref().map_or_else(String::new, |channel| format!(" (channel {channel})"));
        writeln!(text.as_a(Role::Bad), "{}: {}{channel}", finding.kind, finding.text)?;
    }
    let (role, word) = if sound { (Role::Good, "sound") } else { (Role::Bad, "BREAKS PHYSICS") };
    writeln!(text.as_a(role), "{word}")
}

fn write_measurement(text: &mut Lines, health: &MeasurementHealth) -> std::fmt::Result {
    let (path, format, samples) = (&health.path, &health.format, health.samples);
    writeln!(text.as_a(Role::Title), "{path} ({format}), {samples} samples")?;
    for Law { law, verdict, because } in &health.laws {
        let (role, word) = match verdict {
            Verdict::Holds => (Role::Good, "holds: "),
            Verdict::Broken => (Role::Bad, "BROKEN: "),
            Verdict::NotJudged => (Role::Caution, "not judged, because "),
        };
        writeln!(text.as_a(role), "{law:<12} {word}{because}")?;
    }
    let row = |channel: &str, [smallest, negative, beyond]: [String; 3], albedo: String| {
        [left(channel, 10), right(smallest, 12), right(negative, 9), right(beyond, 13), free(albedo)]
    };
    writeln!(text)?;
    let headings = ["smallest", "negative", "beyond noise"].map(str::to_owned);
    text.row(Role::Heading, 0, row("channel", headings, "largest albedo".to_owned()));
    for channel in health.channels.iter().take(LISTED) {
        let n = &channel.negative;
        let most = channel.albedo.iter().flatten().max_by(|a, b| a.value.total_cmp(&b.value));
        let most = most.map_or_else(
            || "unknown".to_owned(),
            |a| {
                let gaps = if a.unmeasured >= 5e-4 {
                    format!(", {:.1} % of it not measured", 100.0 * a.unmeasured)
                } else {
                    String::new()
                };
                format!("{} +/- {:.1e}, at theta_i {}{gaps}", rounded(a.value, 4), a.error, a.incidence())
            },
        );
        let numbers = [rounded(n.least, 6), n.values.to_string(), n.beyond_noise.to_string()];
        text.row(Role::Plain, 0, row(&channel.name, numbers, most));
    }
    more(text, health.channels.len())?;
    writeln!(text)?;
    match health.sound {
        Some(sound) => verdict(text, sound, &health.findings),
        None => {
            let not_judged = health.laws.iter().filter(|law| law.verdict == Verdict::NotJudged);
            let names: Vec<&str> = not_judged.map(|law| law.law).collect();
            writeln!(text.as_a(Role::Caution), "no law broken; {} not judged", names.join(" and "))
        }
    }
}
