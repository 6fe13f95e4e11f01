//! Writes the report as a table for people to read.

use super::{
    ErrorRecord, GroupingRecord, HeldOutRecord, MisfitRecord, Open, Parameter, ParameterStatus, Report,
    WorstRecord,
};
use crate::error::listed;
use crate::fit::{Method, Metric, OpenEnd, Uncertainty, Worst};
use crate::lines::{Lines, Role, free, left, right};
use crate::measurement::ClusterKind;
use crate::model::Unit;
use std::fmt::Write as _;

/// Correlations above this are listed.
const LISTED_CORRELATION: f64 = 0.9;
/// Largest number of correlations that are listed.
const LISTED: usize = 10;
/// Widths of the columns of parameters.
const NAME: usize = 28;
const VALUE: usize = 32;
const INITIAL: usize = 10;

/// The report as text that ends in a newline.
#[must_use]
pub fn table(report: &Report) -> String {
    lines(report).to_string()
}

/// The lines of [`table`].
#[doc(hidden)]
#[must_use]
pub fn lines(report: &Report) -> Lines {
    Lines::of(|text| write(text, report))
}

fn write(text: &mut Lines, report: &Report) -> std::fmt::Result {
    let data = &report.data;
    let channels = match (data.wavelengths_nm.as_deref(), data.channels.as_slice()) {
        (Some([first, .., last]), names) => format!("{} wavelengths {first}..{last} nm", names.len()),
        (_, names) => format!("channels {}", names.join(", ")),
    };
    writeln!(text.as_a(Role::Title), "{} ({}, {channels})", data.path, data.format)?;
    let dropped: Vec<String> = data.dropped.iter().map(|(reason, n)| format!("{n} {reason}")).collect();
    let dropped =
        if dropped.is_empty() { String::new() } else { format!("; left out: {}", dropped.join(", ")) };
    writeln!(text, "{} of {} samples{dropped}", data.used, data.samples)?;
    let missing: Vec<String> = data.missing.0.iter().map(|(name, n)| format!("{n} in {name}")).collect();
    if !missing.is_empty() {
        writeln!(text, "values not measured: {}", listed(&missing))?;
    }
    for remark in &data.remarks {
        writeln!(text, "{remark}")?;
    }
    writeln!(text.as_a(Role::Title), "{}", report.model)?;
    let unused = if report.filters.sigma_unused { " (standard deviations of the file not used)" } else { "" };
    writeln!(
        text,
        "metric {}, weights {}{unused}, theta up to {} deg",
        report.metric, report.filters.weights, report.filters.max_theta_deg
    )?;
    writeln!(text)?;
    parameters(text, report);
    for derived in &report.derived {
        let name = full_name(&derived.name, derived.channel.as_deref());
        let value = with_error(derived.value, derived.std_error, "");
        text.row(Role::Plain, 0, [left(name, NAME), left(value, VALUE)]);
    }
    correlations(text, report)?;
    profiles(text, report)?;
    errors(text, report)?;
    let t = &report.termination;
    writeln!(
        text.as_a(if t.usable { Role::Good } else { Role::Bad }),
        "{}: {}, {} iterations, {:.3} s",
        if t.usable { "usable" } else { "NOT USABLE" },
        t.reason,
        t.iterations,
        report.time_s.total
    )
}

pub(crate) fn full_name(base: &str, channel: Option<&str>) -> String {
    match channel {
        None => base.to_owned(),
        Some(channel) => format!("{base}{}", crate::parameters::channel_suffix(channel)),
    }
}

/// A value +/- its error (percent), with the value to the second digit of the error.
pub(crate) fn with_error(value: f64, error: Option<f64>, unit: &str) -> String {
    let Some(error) = error.filter(|e| *e > 0.0) else { return format!("{}{unit}", significant(value)) };
    let percent = 100.0 * (error / value).abs();
    let percent = if percent.is_finite() { format!(" ({} %)", digits(percent, 2)) } else { String::new() };
    // Digits of the value beyond the second digit of the error mean nothing, and a double has only fifteen.
    let digits_kept = 2.0 + (value.abs() / error).log10().floor().max(0.0);
    let kept = (1..=15_u8).find(|n| f64::from(*n) >= digits_kept).unwrap_or(15);
    format!("{}{unit} +/- {}{percent}", digits(value, usize::from(kept)), digits(error, 2))
}

/// A number with at most six significant digits, without trailing zeros.
fn significant(value: f64) -> String {
    let text = digits(value, 6);
    if text.contains('.') && !text.contains('e') {
        return text.trim_end_matches('0').trim_end_matches('.').to_owned();
    }
    text
}

/// A number with `kept` significant digits, in plain or scientific notation.
pub(crate) fn digits(value: f64, kept: usize) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let scientific = format!("{:.*e}", kept.saturating_sub(1), value);
    let exponent: i32 = scientific.split_once('e').and_then(|(_, e)| e.parse().ok()).unwrap_or(0);
    if !(-4..6).contains(&exponent) {
        return scientific;
    }
    let before = usize::try_from(exponent + 1).unwrap_or(0);
    let decimals = if exponent < 0 {
        kept + usize::try_from(-exponent - 1).unwrap_or(0)
    } else {
        kept.saturating_sub(before)
    };
    format!("{value:.decimals$}")
}

fn parameters(text: &mut Lines, report: &Report) {
    let heading =
        [left("parameter", NAME), left("value +/- standard error", VALUE), right("initial", INITIAL)];
    text.row(Role::Heading, 0, heading);
    for p in &report.parameters {
        let name = full_name(&format!("{}.{}", p.lobe, p.name), p.channel.as_deref());
        let unit = if p.unit == Unit::One { String::new() } else { format!(" {}", p.unit) };
        let value = with_error(p.value, p.std_error, &unit);
        let is = |statuses: [ParameterStatus; 2]| statuses.iter().any(|status| p.status == *status);
        let fitted = !is([ParameterStatus::Fixed, ParameterStatus::Absent]);
        let initial = if fitted { digits(p.initial, 4) } else { String::new() };
        let at_bound = is([ParameterStatus::AtLower, ParameterStatus::AtUpper]);
        let role = if at_bound { Role::Caution } else { Role::Plain };
        let cells = [left(name, NAME), left(value, VALUE), right(initial, INITIAL), free(remark(p))];
        text.row(role, 0, cells);
    }
}

/// A remark on the status of a parameter.
fn remark(p: &Parameter) -> &str {
    match p.status.known() {
        Some(ParameterStatus::Free) if p.std_error.is_none() => "no error",
        Some(ParameterStatus::Free) => "",
        _ => p.status.name(),
    }
}

fn correlations(text: &mut Lines, report: &Report) -> std::fmt::Result {
    let Some(correlation) = &report.correlation else { return Ok(()) };
    let mut pairs: Vec<(f64, &str, &str)> = Vec::new();
    for (i, (a, row)) in correlation.parameters.iter().zip(&correlation.matrix).enumerate() {
        for (b, c) in correlation.parameters.iter().zip(row).skip(i + 1) {
            pairs.extend(c.filter(|c| c.abs() > LISTED_CORRELATION).map(|c| (c, a.as_str(), b.as_str())));
        }
    }
    pairs.sort_by(|a, b| b.0.abs().total_cmp(&a.0.abs()));
    if !pairs.is_empty() {
        writeln!(text)?;
        writeln!(text.as_a(Role::Heading), "correlations above {LISTED_CORRELATION}:")?;
    }
    for (c, a, b) in pairs.iter().take(LISTED) {
        text.row(Role::Plain, 2, [left(format!("{c:+.4}"), 0), free(*a), free(*b)]);
    }
    if pairs.len() > LISTED {
        writeln!(text, "  and {} more", pairs.len() - LISTED)?;
    }
    Ok(())
}

/// A number to four digits, or a dash if it is unknown.
pub(crate) fn or_dash(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |value| digits(value, 4))
}

/// The errors that a fit can minimise.
fn metrics(e: &ErrorRecord) -> String {
    Metric::ALL.map(|metric| format!("{} {}", metric.name(), or_dash(e.of(metric)))).join(", ")
}

/// A list of angles, with ranges written as `20..25`.
fn angles(degrees: &[[f64; 2]]) -> String {
    let listed: Vec<String> = degrees
        .iter()
        .map(|[low, high]| if low < high { format!("{low}..{high}") } else { format!("{low}") })
        .collect();
    listed.join(", ")
}

/// The errors on samples that were held out, in a line.
fn held_out_in_words(held: &HeldOutRecord, report: &Report) -> String {
    let together = metrics(&held.errors);
    if held.folds.is_empty() {
        return format!(
            "held out: {} samples at theta_i {} deg: {together}",
            held.samples,
            angles(&held.theta_i_deg)
        );
    }
    let what = if held.theta_i_deg.iter().any(|[low, high]| low < high) { "ranges" } else { "angles" };
    let not_converged = held.folds.iter().filter(|fold| !fold.converged).count();
    let stuck = if not_converged > 0 {
        format!("; {not_converged} of the fits reached no minimum")
    } else {
        String::new()
    };
    format!(
        "held out: each of {} {what} of incidence once, in {} folds: {} {} +/- {} (mean and standard deviation of the folds); all \
         together: {together}{stuck}",
        held.theta_i_deg.len(),
        held.folds.len(),
        report.metric,
        or_dash(held.mean),
        or_dash(held.std_dev),
    )
}

/// How far the model is from the data, in a line.
pub(crate) fn misfit_in_words(misfit: &MisfitRecord) -> String {
    let noise = misfit.noise.as_ref().and_then(Open::known);
    let what = match (misfit.ratio, noise) {
        (Some(ratio), Some(source)) => format!("{} times the noise of the data ({source})", digits(ratio, 3)),
        _ => format!("{} % of the data; no noise is visible beside them", digits(100.0 * misfit.relative, 2)),
    };
    let worst = misfit.worst.as_ref().map_or_else(String::new, |worst| {
        let WorstRecord { theta_i_deg, near_mirror } = *worst;
        format!("; largest at {}", Worst { theta_i_deg, near_mirror })
    });
    format!("residuals: {what}{worst}")
}

/// The intervals by profiles of the cost, if there are any.
fn profiles(text: &mut Lines, report: &Report) -> std::fmt::Result {
    if !report.options.uncertainty.as_ref().is_some_and(|source| *source == Uncertainty::Profile) {
        return Ok(());
    }
    writeln!(text, "\n95 % intervals from profiles of the cost:")?;
    for parameter in &report.parameters {
        let Some([low, high]) = parameter.ci95 else { continue };
        let base = format!("{}.{}", parameter.lobe, parameter.name);
        let ends = parameter.ci95_open.iter().zip(["below", "above"]);
        let why = ends.filter_map(|(open, side)| {
            let reason = match open.as_ref()?.known() {
                Some(OpenEnd::AtBound) => "the bound fits as well",
                _ => "not followed to its end",
            };
            Some(format!("; open {side}: {reason}"))
        });
        let range = format!("{} to {}{}", digits(low, 4), digits(high, 4), why.collect::<String>());
        text.row(Role::Plain, 0, [left(full_name(&base, parameter.channel.as_deref()), NAME), free(range)]);
    }
    Ok(())
}

/// The groups of samples that err together, in words.
fn grouping(grouping: Option<&GroupingRecord>) -> String {
    let Some(GroupingRecord { kind, width_deg, groups, .. }) = grouping else { return "groups".to_owned() };
    match (kind.known(), width_deg) {
        (Some(ClusterKind::Incidence), _) => format!("{groups} angles of incidence"),
        (Some(ClusterKind::IncidenceRange), _) => format!("{groups} ranges of the angle of incidence"),
        (Some(ClusterKind::Neighbourhood), Some(width)) => {
            format!("{groups} neighbourhoods of directions, {width} degrees wide")
        }
        (Some(ClusterKind::Direction), _) => format!("{groups} directions"),
        _ => format!("{groups} groups"),
    }
}

fn errors(text: &mut Lines, report: &Report) -> std::fmt::Result {
    let e = &report.errors;
    let (log_ratio, relative) = (or_dash(e.log_ratio), or_dash(e.relative));
    writeln!(text, "\nerrors: {}, log_ratio {log_ratio}, relative {relative}", metrics(e))?;
    if let Some(misfit) = &report.misfit {
        writeln!(text, "{}", misfit_in_words(misfit))?;
    }
    if let Some(held) = &report.selection.held_out {
        writeln!(text, "{}", held_out_in_words(held, report))?;
    }
    let method = report.fit.uncertainty_method.as_ref();
    let method = match (method.and_then(Open::known), &report.fit.resampling) {
        (_, Some(resampling)) => {
            let ranges = resampling.theta_i_deg.iter().any(|[low, high]| low < high);
            let groups = if ranges { "ranges of incidence angle" } else { "incidence angles" };
            let n = resampling.theta_i_deg.len();
            format!("block bootstrap over {n} {groups}, {} replicates", resampling.replicates)
        }
        (Some(Method::Clustered), _) => {
            let refits = report.fit.grouping.as_ref().and_then(|grouping| grouping.refits);
            let raised = refits
                .map_or_else(String::new, |refits| format!(", raised to the scatter of {refits} refits"));
            format!("clustered by {}{raised}", grouping(report.fit.grouping.as_ref()))
        }
        (Some(Method::Sandwich), _) => "sandwich: independent samples, each with its own noise".to_owned(),
        (Some(Method::Absolute), _) => "from the given sigma: independent samples".to_owned(),
        _ => "none".to_owned(),
    };
    write!(
        text,
        "{} values, {} degrees of freedom; standard errors: {method}",
        report.fit.n, report.fit.dof
    )?;
    match report.fit.reduced_chi2 {
        Some(chi2) => writeln!(text, "; reduced chi^2 {}", digits(chi2, 4)),
        None => writeln!(text),
    }
}
