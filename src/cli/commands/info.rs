//! `brdfit info`: describes the contents of a measurement file.

use crate::cli::messages::{doubted, emit, remark, say};
use crate::cli::options::input::{ReadArguments, measurement_help};
use crate::cli::outcome::Outcome;
use crate::cli::output::json;
use brdfit::Error;
use brdfit::error::{OptionName, excerpt, rounded};
use brdfit::lines::{Lines, Role, left, right};
use brdfit::measurement::formats::named;
use brdfit::measurement::{
    ALBEDO_LIMIT_DEG, Coverage, Doubt, Instrument, Measurement, coverage, dead_channel_doubts, dead_channels,
    merl_digests,
};
use brdfit::report::SuggestionRecord;
use clap::Args;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::{self, Write as _};
use std::path::PathBuf;

/// Arguments of `brdfit info`.
#[derive(Args)]
pub struct Arguments {
    #[arg(value_name = "INPUT", help = measurement_help("Measurement to describe"))]
    input: PathBuf,
    /// Print JSON instead of the table
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    read: ReadArguments,
}

#[derive(Serialize)]
struct InfoRecord {
    schema: &'static str,
    path: String,
    format: &'static str,
    sha256: String,
    /// Name of the material, if the file is byte for byte one of the MERL database.
    genuine_merl: Option<&'static str>,
    channels: Vec<ChannelRecord>,
    wavelengths_nm: Option<Vec<f64>>,
    has_sigma: bool,
    samples: usize,
    usable: usize,
    dropped: BTreeMap<&'static str, usize>,
    theta_i_deg: Option<[f64; 2]>,
    theta_o_deg: Option<[f64; 2]>,
    theta_h_deg: Option<[f64; 2]>,
    incidence_angles: Option<usize>,
    in_plane: bool,
    /// Relative root mean square difference of pairs measured both ways, and their number.
    reciprocity: Option<ReciprocityRecord>,
    /// What the file says about the instrument and the sample.
    instrument: Instrument,
    /// What the reader did that a user should know.
    remarks: Vec<String>,
    /// What is suspicious about the file.
    doubts: Vec<String>,
    /// Other ways to read it, which agree better with physics. They are among the doubts, too.
    readings: Vec<ReadingRecord>,
}

#[derive(Serialize)]
struct ReadingRecord {
    /// What speaks for it.
    text: String,
    /// The options that read the file so, any one of them.
    options: Vec<SuggestionRecord>,
}

#[derive(Serialize)]
struct ReciprocityRecord {
    relative_rms: f64,
    pairs: usize,
}

#[derive(Serialize)]
struct ChannelRecord {
    name: String,
    /// Smallest and largest f, 1/sr.
    range: Option<[f64; 2]>,
    negative: usize,
    /// Number of values that were not measured.
    missing: usize,
    /// Directional albedo averaged over incidence up to 60 degrees; grids only.
    albedo: Option<f64>,
}

/// Runs the subcommand.
pub fn run(arguments: &Arguments) -> Result<Outcome, Error> {
    let mut measurement = arguments.read.read(&arguments.input)?;
    arguments.read.examine(&mut measurement)?;
    if measurement.directions.is_empty() {
        return Err(Error::no_samples(&arguments.input, &measurement.dropped));
    }
    let record = record(&measurement, &coverage(&measurement));
    if arguments.json {
        emit(&json(&record)?)?
    } else {
        say(&lines(&record))?
    }
    record.remarks.iter().for_each(|said| remark(&format!("note: {said}")));
    record.doubts.iter().for_each(|doubt| remark(&format!("warning: {doubt}")));
    Ok(Outcome::Good)
}

fn record(measurement: &Measurement, coverage: &Coverage) -> InfoRecord {
    let range = |(low, high): (f64, f64)| (low <= high).then_some([low, high]);
    let wavelengths: Vec<f64> = measurement.channels.iter().filter_map(|c| c.wavelength_nm).collect();
    let channels = measurement.channels.iter().enumerate().map(|(index, channel)| ChannelRecord {
        name: channel.name.clone(),
        range: coverage.range.get(index).copied().and_then(range),
        negative: coverage.negative.get(index).copied().unwrap_or(0),
        missing: coverage.missing.get(index).copied().unwrap_or(0),
        albedo: coverage
            .albedo
            .as_ref()
            .and_then(|a| a.get(index).copied())
            .filter(|albedo| !albedo.is_nan()),
    });
    let names = measurement.channel_names();
    let dead = dead_channel_doubts(&names, &measurement.values, &dead_channels(&measurement.values));
    InfoRecord {
        schema: "brdfit.info/1",
        path: measurement.source.path.display().to_string(),
        format: measurement.source.format,
        sha256: measurement.source.sha256.clone(),
        genuine_merl: merl_digests::material(&measurement.source.sha256),
        channels: channels.collect(),
        wavelengths_nm: (wavelengths.len() == measurement.channels.len()).then_some(wavelengths),
        has_sigma: measurement.sigma.is_some(),
        samples: measurement.total(),
        usable: measurement.directions.len(),
        dropped: measurement.dropped.clone(),
        theta_i_deg: range(coverage.theta_i_deg),
        theta_o_deg: range(coverage.theta_o_deg),
        theta_h_deg: range(coverage.theta_h_deg),
        incidence_angles: coverage.incidence_angles,
        in_plane: coverage.in_plane,
        reciprocity: coverage
            .reciprocity
            .map(|(relative_rms, pairs)| ReciprocityRecord { relative_rms, pairs }),
        instrument: measurement.instrument.clone(),
        remarks: measurement.remarks.iter().map(ToString::to_string).collect(),
        doubts: measurement.doubts.iter().chain(&dead).map(doubted).collect(),
        readings: measurement.doubts.iter().filter_map(reading).collect(),
    }
}

/// Another way to read the file; `None` for any other doubt.
fn reading(doubt: &Doubt) -> Option<ReadingRecord> {
    let Doubt::OtherReading(other) = doubt else { return None };
    let option = |(option, value): (OptionName, String)| SuggestionRecord { option: option.into(), value };
    Some(ReadingRecord {
        text: other.to_string(),
        options: doubt.suggestions().into_iter().map(option).collect(),
    })
}

/// The lines about the instrument.
fn instrument_text(record: &Instrument) -> String {
    let mut text = String::new();
    if let Some(description) = &record.description {
        text += &format!("description  {}\n", excerpt(description));
    }
    if let Some(receiver_sr) = record.receiver_sr {
        text += &format!("receiver     {receiver_sr:.4e} sr\n");
    }
    if let Some(scale) = record.scale {
        text += &format!("scale        {scale}\n");
    }
    if let [first, .., last] = record.total_scatter.as_slice() {
        text += &format!(
            "TIS          {:.4} at {:.1} deg to {:.4} at {:.1} deg\n",
            first.share, first.theta_i_deg, last.share, last.theta_i_deg
        );
    } else if let [only] = record.total_scatter.as_slice() {
        text += &format!("TIS          {:.4} at {:.1} deg\n", only.share, only.theta_i_deg);
    }
    text
}

/// The line about the wavelengths; empty unless every channel has one.
fn wavelengths_text(r: &InfoRecord) -> String {
    /// With more than these, the first and the last are enough.
    const LISTED: usize = 8;
    match r.wavelengths_nm.as_deref() {
        Some([first, .., last]) if r.channels.len() > LISTED => {
            format!("wavelengths  {} from {first} to {last} nm\n", r.channels.len())
        }
        Some(nm @ [_, ..]) => {
            let nm: Vec<String> = nm.iter().map(f64::to_string).collect();
            format!("wavelengths  {} nm\n", nm.join(", "))
        }
        _ => String::new(),
    }
}

fn lines(r: &InfoRecord) -> Lines {
    Lines::of(|text| {
        describe(text, r)?;
        writeln!(text)?;
        channels(text, r);
        Ok(())
    })
}

fn describe(text: &mut Lines, r: &InfoRecord) -> fmt::Result {
    let summary = named(r.format).map_or_else(|_| String::new(), |format| format!(": {}", format.summary));
    writeln!(text.as_a(Role::Title), "{}", r.path)?;
    writeln!(text, "format       {}{summary}\nSHA-256      {}", r.format, r.sha256)?;
    if let Some(material) = r.genuine_merl {
        writeln!(text, "             genuine MERL {material}")?;
    } else if r.format == "merl" {
        writeln!(text, "             not one of the 100 files of the MERL database")?;
    }
    let dropped: Vec<String> = r.dropped.iter().map(|(why, n)| format!("{n} {why}")).collect();
    let dropped =
        if dropped.is_empty() { String::new() } else { format!("; left out: {}", dropped.join(", ")) };
    writeln!(text, "samples      {} of {}{dropped}", r.usable, r.samples)?;
    let degrees = |range: Option<[f64; 2]>| {
        range.map_or_else(|| "-".to_owned(), |[low, high]| format!("{low:.2}..{high:.2} deg"))
    };
    let different = r.incidence_angles.map_or_else(String::new, |n| format!(", {n} different"));
    writeln!(text, "theta_i      {}{different}", degrees(r.theta_i_deg))?;
    writeln!(text, "theta_o      {}\ntheta_h      {}", degrees(r.theta_o_deg), degrees(r.theta_h_deg))?;
    writeln!(text, "in plane     {}", if r.in_plane { "yes" } else { "no" })?;
    text.write_str(&wavelengths_text(r))?;
    writeln!(text, "sigma        {}", if r.has_sigma { "given" } else { "not given" })?;
    text.write_str(&instrument_text(&r.instrument))?;
    match &r.reciprocity {
        Some(p) => {
            let percent = rounded(100.0 * p.relative_rms, 2);
            writeln!(text, "reciprocity  {percent} % rms over {} swapped pairs", p.pairs)
        }
        None if r.format == "merl" => writeln!(text, "reciprocity  assumed by the table"),
        None => writeln!(text, "reciprocity  no pair of directions was measured both ways"),
    }
}

/// The table of the channels.
fn channels(text: &mut Lines, r: &InfoRecord) {
    let missing = r.channels.iter().any(|c| c.missing > 0);
    let albedo = r.channels.iter().any(|c| c.albedo.is_some());
    let row = |name: &str, [low, high, negative, missing_values, mean]: [String; 5]| {
        let range = [left(name, 10), right(low, 12), right(high, 12), right(negative, 9)];
        let missing_values = missing.then(|| right(missing_values, 9));
        range.into_iter().chain(missing_values).chain(albedo.then(|| right(mean, 16)))
    };
    let mean = format!("albedo to {ALBEDO_LIMIT_DEG} deg");
    let headings = ["smallest", "largest", "negative", "missing", &mean].map(str::to_owned);
    text.row(Role::Heading, 0, row("channel", headings));
    for c in &r.channels {
        let unknown = || ["-", "-"].map(str::to_owned);
        let [low, high] = c.range.map_or_else(unknown, |range| range.map(|f| rounded(f, 6)));
        let mean = c.albedo.map_or_else(String::new, |albedo| rounded(albedo, 4));
        let cells = [low, high, c.negative.to_string(), c.missing.to_string(), mean];
        text.row(Role::Plain, 0, row(&c.name, cells));
    }
}
