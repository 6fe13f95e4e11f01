//! The report of `brdfit kubelka-munk`; docs/use/kubelka-munk.md describes it field by field.

use super::{Drawdown, Fitted, Quantity, Surface};
use crate::lines::{Lines, Role, left, right};
use serde::Serialize;
use std::fmt::Write as _;

/// Name of the schema.
pub const SCHEMA: &str = "brdfit.kubelka-munk/1";

/// The report.
#[derive(Clone, Debug, Serialize)]
pub struct Record {
    schema: &'static str,
    version: &'static str,
    data: Data,
    options: Options,
    channels: Vec<ChannelRecord>,
    /// Whether every channel's result can be relied on.
    pub usable: bool,
    warnings: Vec<Warning>,
}

#[derive(Clone, Debug, Serialize)]
struct Data {
    path: String,
    format: &'static str,
    sha256: String,
    channels: Vec<String>,
    wavelengths_nm: Option<Vec<f64>>,
    rows: usize,
    reflectances: usize,
}

#[derive(Clone, Debug, Serialize)]
struct Options {
    /// Thickness of every row, as given by the user; null if the file has thicknesses or if none is known.
    thickness: Option<f64>,
    /// Refractive index that k1 and k2 were computed from.
    eta: Option<f64>,
    k1: f64,
    k2: f64,
}

#[derive(Clone, Debug, Serialize)]
struct ChannelRecord {
    channel: String,
    k: Option<QuantityRecord>,
    s: Option<QuantityRecord>,
    k_over_s: Option<QuantityRecord>,
    r_inf: Option<QuantityRecord>,
    n: usize,
    dof: usize,
    rms: f64,
    reduced_chi2: Option<f64>,
    method: &'static str,
    reason: &'static str,
    usable: bool,
}

#[derive(Clone, Copy, Debug, Serialize)]
struct QuantityRecord {
    value: f64,
    std_error: Option<f64>,
}

#[derive(Clone, Debug, Serialize)]
struct Warning {
    kind: &'static str,
    channel: String,
    text: String,
}

impl Record {
    /// The report on a fit. `thickness` and `eta` are what the user gave.
    #[must_use]
    pub fn new(
        drawdown: &Drawdown,
        fitted: &[Fitted],
        surface: Surface,
        thickness: Option<f64>,
        eta: Option<f64>,
    ) -> Self {
        let name = |index: usize| {
            drawdown.series.get(index).map_or_else(String::new, |series| series.channel.name.clone())
        };
        let quantity = |q: Option<Quantity>| {
            q.filter(|q| q.value.is_finite()).map(|q| QuantityRecord {
                value: q.value,
                std_error: q.std_error.filter(|error| error.is_finite()),
            })
        };
        let channels = fitted.iter().map(|f| ChannelRecord {
            channel: name(f.series),
            k: quantity(f.k),
            s: quantity(f.s),
            k_over_s: quantity(f.k_over_s),
            r_inf: quantity(f.r_inf),
            n: f.n,
            dof: f.dof,
            rms: f.rms,
            reduced_chi2: f.reduced_chi2,
            method: f.method,
            reason: f.reason,
            usable: f.usable,
        });
        let warnings = fitted.iter().flat_map(|f| {
            let of_channel = name(f.series);
            f.remarks.iter().map(move |remark| Warning {
                kind: remark.kind(),
                channel: of_channel.clone(),
                text: remark.to_string(),
            })
        });
        let wavelengths: Vec<f64> = drawdown.series.iter().filter_map(|s| s.channel.wavelength_nm).collect();
        Self {
            schema: SCHEMA,
            version: env!("CARGO_PKG_VERSION"),
            data: Data {
                path: drawdown.source.path.display().to_string(),
                format: drawdown.source.format,
                sha256: drawdown.source.sha256.clone(),
                channels: drawdown.series.iter().map(|s| s.channel.name.clone()).collect(),
                wavelengths_nm: (wavelengths.len() == drawdown.series.len()).then_some(wavelengths),
                rows: drawdown.rows,
                reflectances: drawdown.series.iter().map(|s| s.patches.len()).sum(),
            },
            options: Options {
                thickness: thickness.filter(|x| x.is_finite()),
                eta,
                k1: surface.k1,
                k2: surface.k2,
            },
            channels: channels.collect(),
            usable: fitted.iter().all(|f| f.usable),
            warnings: warnings.collect(),
        }
    }

    /// The warnings, one line each. A warning that several channels share is given once.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        let mut said: Vec<(&str, Vec<&str>)> = Vec::new();
        for warning in &self.warnings {
            match said.iter_mut().find(|(text, _)| *text == warning.text) {
                Some((_, channels)) => channels.push(&warning.channel),
                None => said.push((&warning.text, vec![&warning.channel])),
            }
        }
        let all = self.channels.len();
        let line = |(text, channels): (&str, Vec<&str>)| {
            if channels.len() == all && all > 1 {
                format!("every channel: {text}")
            } else {
                format!("{}: {text}", channels.join(", "))
            }
        };
        said.into_iter().map(line).collect()
    }
}

/// The report as a table.
#[must_use]
pub fn text(record: &Record, thickness_known: bool) -> String {
    lines(record, thickness_known).to_string()
}

/// The lines of [`text`].
#[must_use]
pub fn lines(record: &Record, thickness_known: bool) -> Lines {
    Lines::of(|text| write(text, record, thickness_known))
}

fn write(text: &mut Lines, record: &Record, thickness_known: bool) -> std::fmt::Result {
    let data = &record.data;
    writeln!(text.as_a(Role::Title), "{} ({}, {} channels)", data.path, data.format, data.channels.len())?;
    let surface = match (record.options.k1, record.options.k2) {
        (k1, k2) if k1 > 0.0 || k2 > 0.0 => format!("surface k1 = {k1:.4}, k2 = {k2:.4}"),
        _ => "no surface reflection".to_owned(),
    };
    writeln!(text, "{} reflectances in {} rows; {surface}", data.reflectances, data.rows)?;
    let unit = if thickness_known {
        "K and S per unit of thickness"
    } else {
        "unknown thickness X: the columns K and S hold KX and SX"
    };
    writeln!(text, "{unit}\n")?;
    let row = |channel: &str, quantities: [String; 3], r_inf: String, rms: String| {
        let quantities = quantities.map(|quantity| left(quantity.trim_end(), 26));
        [left(channel, 11)].into_iter().chain(quantities).chain([right(r_inf, 9), right(rms, 9)])
    };
    let headings = ["K", "S", "K/S"].map(|name| format!("{name:^27}"));
    text.row(Role::Heading, 0, row("channel", headings, "R_inf".to_owned(), "rms".to_owned()));
    for c in &record.channels {
        let r_inf = c.r_inf.map_or_else(|| "-".to_owned(), |q| format!("{:.4}", q.value));
        text.row(
            Role::Plain,
            0,
            row(&c.channel, [c.k, c.s, c.k_over_s].map(number), r_inf, format!("{:.1e}", c.rms)),
        );
    }
    Ok(())
}

/// A value with its standard error as text.
fn number(quantity: Option<QuantityRecord>) -> String {
    let Some(QuantityRecord { value, std_error }) = quantity else { return format!("{:>12}{:15}", "-", "") };
    let digits = |x: f64| {
        if x == 0.0 || (1e-3..1e4).contains(&x) { format!("{x:.5}") } else { format!("{x:.4e}") }
    };
    let error = std_error.map_or_else(String::new, |error| format!(" +/- {error:.1e}"));
    format!("{:>12}{error:15}", digits(value))
}
