//! `brdfit convert`: writes a measurement or a fit in another format, or its values at given directions.

use crate::cli::messages::{emit, remark};
use crate::cli::options::input::{ReadArguments, measurement_help};
use crate::cli::options::recorded::report;
use crate::cli::outcome::Outcome;
use crate::cli::output::{Output, spares};
use brdfit::Error;
use brdfit::error::NameKind;
use brdfit::geometry::{Directions, Pair};
use brdfit::image::{Illuminant, PRIMARIES, Primaries, REC709, Route, ToRgb};
use brdfit::measurement::formats::{
    AngleGrid, Format, REGISTRY, Resampling, Subject, Written, csv, everywhere, read_directions, resampling,
};
use brdfit::measurement::interpolant::Answer;
use brdfit::measurement::{Channel, Interpolant, KnownSamples, Measurement};
use brdfit::model::LobeValues;
use brdfit::report::Recorded;
use clap::builder::PossibleValuesParser;
use clap::{Args, ValueEnum};
use std::path::{Path, PathBuf};

/// Arguments of `brdfit convert`.
#[derive(Args)]
pub struct Arguments {
    #[arg(value_name = "INPUT", help = input_help())]
    input: PathBuf,
    /// Write to this file; the ending of its name chooses the format unless --to does ('-': standard output)
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    #[arg(long, value_name = "FORMAT", help = to_help())]
    to: Option<String>,
    /// Write f at the directions of this CSV file or measurement, as CSV
    #[arg(long, value_name = "FILE", conflicts_with_all = ["to", "grid"])]
    at: Option<PathBuf>,
    /// Write at these angles in degrees, as first, step and last: theta_i=0:10:80,theta_o=0:5:85,phi=0:15:180 [default: the samples of a measurement, or angles that suit the format]
    #[arg(long, value_name = "ANGLES")]
    grid: Option<String>,
    /// Turn the channels into linear red, green and blue, as the CIE 1931 observer sees a spectrum
    #[arg(long)]
    rgb: bool,
    /// See spectra under this light [default: d65]
    #[arg(long, value_enum, value_name = "LIGHT", requires = "rgb")]
    illuminant: Option<Light>,
    /// State red, green and blue in these primaries, adapted by Bradford's method [default: rec709]
    #[arg(long, value_name = "NAME", requires = "rgb", value_parser = PossibleValuesParser::new(PRIMARIES.iter().map(|p| p.name)))]
    primaries: Option<String>,
    #[command(flatten)]
    read: ReadArguments,
}

#[derive(Clone, Copy, ValueEnum)]
enum Light {
    /// Daylight, CIE D65
    D65,
    /// Equal power at all wavelengths, CIE E
    E,
}

fn input_help() -> String {
    format!(
        "{}; or a JSON report of brdfit, whose model is written",
        measurement_help("Measurement to write")
    )
}

fn to_help() -> String {
    let names: Vec<&str> = writable().map(|format| format.name).collect();
    format!("Write in this format: {} [default: by the ending of FILE]", names.join(", "))
}

/// The formats that can be written.
fn writable() -> impl Iterator<Item = &'static Format> {
    REGISTRY.iter().filter(|format| format.write.is_some())
}

/// Runs the subcommand.
pub fn run(arguments: &Arguments) -> Result<Outcome, Error> {
    let Arguments { input, output, at, grid, read, .. } = arguments;
    let format = if at.is_some() { None } else { Some(format(arguments)?) };
    let grid = grid.as_deref().map(AngleGrid::parse).transpose()?;
    let primaries = arguments.primaries.as_deref().map_or(Ok(&REC709), Primaries::named)?;
    read.check()?;
    let inputs: Vec<PathBuf> = [Some(input), at.as_ref()].into_iter().flatten().cloned().collect();
    spares(&inputs, "-o", Some(output))?;
    let to_stdout = output.as_os_str() == "-";
    let file = (!to_stdout).then(|| Output::open(output)).transpose()?;
    let source = match report(input)? {
        Some(recorded) => Source::of_report(recorded, arguments, primaries),
        None => Source::of_measurement(read.read(input)?, arguments, primaries)?,
    };
    let mut said: Vec<String> = source.notes.iter().map(|note| format!("note: {note}")).collect();
    let bytes = match (at, format) {
        (Some(at), _) => source.values_at(&read_directions(at, &read.options()?)?, &mut said)?.into_bytes(),
        (None, Some(format)) => source.written(format, grid.as_ref(), output, &mut said)?,
        (None, None) => Vec::new(),
    };
    match file {
        Some(file) => file.commit(&bytes)?,
        None => {
            let text = String::from_utf8(bytes)
                .map_err(|_| Error::invalid("-o", "a file, since the format is binary", "'-'"))?;
            emit(&text)?;
        }
    }
    said.iter().for_each(|line| remark(line));
    Ok(Outcome::Good)
}

/// The format to write.
fn format(arguments: &Arguments) -> Result<&'static Format, Error> {
    let names: Vec<&str> = writable().map(|format| format.name).collect();
    if let Some(name) = &arguments.to {
        let found = writable().find(|format| format.name.eq_ignore_ascii_case(name));
        return found.ok_or_else(|| Error::unknown("--to", NameKind::Format, &names, name));
    }
    let ending = arguments.output.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    let ending =
        ending.unwrap_or_else(|| if arguments.output.as_os_str() == "-" { "csv" } else { "" }.to_owned());
    let mut fitting = writable().filter(|format| format.extensions.contains(&ending.as_str()));
    match (fitting.next(), fitting.next()) {
        (Some(only), None) => Ok(only),
        (Some(one), Some(other)) => {
            let all: Vec<&str> = [one.name, other.name].into_iter().chain(fitting.map(|f| f.name)).collect();
            let expected =
                format!("--to {}, since several formats have files called .{ending}", all.join(" or --to "));
            Err(Error::invalid("-o", expected, arguments.output.display().to_string()))
        }
        (None, _) => {
            let mut endings: Vec<String> =
                writable().flat_map(|f| f.extensions.iter().map(|ending| format!(".{ending}"))).collect();
            endings.sort_unstable();
            endings.dedup();
            let expected = format!("a name that ends in {}, or --to {}", endings.join(", "), names.join("|"));
            Err(Error::invalid("-o", expected, arguments.output.display().to_string()))
        }
    }
}

/// What is written: a measurement or a model, in the channels in which it is written.
struct Source {
    channels: Vec<Channel>,
    kind: Kind,
    isotropic: bool,
    about: String,
    notes: Vec<String>,
}

enum Kind {
    Measured { measurement: Box<Measurement>, known: KnownSamples, interpolant: Box<Interpolant> },
    Fitted { recorded: Box<Recorded>, values: Vec<Vec<LobeValues>>, colours: Option<ToRgb> },
}

impl Source {
    fn of_measurement(
        measurement: Measurement,
        arguments: &Arguments,
        primaries: &Primaries,
    ) -> Result<Self, Error> {
        if measurement.directions.is_empty() {
            return Err(Error::no_samples(&arguments.input, &measurement.dropped));
        }
        let mut notes: Vec<String> = measurement.remarks.iter().map(ToString::to_string).collect();
        let measurement = match colours(&measurement.channels, arguments, primaries, &mut notes) {
            Some(colours) => {
                notes.extend(colours.incomplete_in_words(&measurement));
                colours.measurement(&measurement).into_owned()
            }
            None => measurement,
        };
        if measurement.directions.is_empty() {
            return Err(Error::no_samples(&arguments.input, &measurement.dropped));
        }
        let interpolant = Interpolant::new(&measurement);
        Ok(Self {
            channels: measurement.channels.clone(),
            isotropic: interpolant.symmetry().is_none_or(|symmetry| symmetry.isotropic),
            about: format!("brdfit {}: {}", env!("CARGO_PKG_VERSION"), name(&measurement.source.path)),
            kind: Kind::Measured {
                known: KnownSamples::new(&measurement),
                measurement: Box::new(measurement),
                interpolant: Box::new(interpolant),
            },
            notes,
        })
    }

    fn of_report(recorded: Recorded, arguments: &Arguments, primaries: &Primaries) -> Self {
        let names = recorded.table.channels();
        let channels: Vec<Channel> = names.iter().map(|name| Channel::named(name)).collect();
        let values = (0..names.len()).map(|channel| recorded.table.formula_values(channel)).collect();
        let mut notes = Vec::new();
        let colours = colours(&channels, arguments, primaries, &mut notes);
        let lobes = recorded.expression.lobes().iter();
        let isotropic = lobes.flat_map(|lobe| lobe.parameters()).all(|spec| spec.isotropy.is_none());
        let about = format!(
            "brdfit {}: {}, fitted to {}",
            env!("CARGO_PKG_VERSION"),
            recorded.expression.canonical(),
            name(Path::new(&recorded.report.data.path))
        );
        Self {
            channels: match &colours {
                Some(colours) => colours.channels(),
                None => channels,
            },
            kind: Kind::Fitted { recorded: Box::new(recorded), values, colours },
            isotropic,
            about,
            notes,
        }
    }

    /// f in 1/sr by channel and pair, and whether there are data around each pair.
    fn answer(&self, pairs: &[Pair]) -> Answer {
        match &self.kind {
            Kind::Measured { measurement, known, interpolant } => {
                let mut answer = interpolant.at(pairs);
                // An interpolant may average samples; those at the very directions stay as they are.
                known.put(measurement, pairs, &mut answer.values);
                answer
            }
            Kind::Fitted { recorded, values, colours } => {
                let rows = recorded.expression.values(&Directions::Scattered(pairs.to_vec()), values);
                let values = match colours {
                    Some(colours) => colours.rows(rows, self.channels.len()),
                    None => rows,
                };
                Answer { values, covered: everywhere(pairs) }
            }
        }
    }

    /// A CSV of the values at given directions.
    fn values_at(&self, pairs: &[Pair], said: &mut Vec<String>) -> Result<String, Error> {
        let Answer { values, covered } = self.answer(pairs);
        let outside = covered.iter().filter(|covered| !**covered).count();
        if outside > 0 {
            said.push(format!(
                "warning: {outside} of {} directions lie outside the measured ones: their values are extrapolated",
                pairs.len()
            ));
        }
        let directions = Directions::Scattered(pairs.to_vec());
        let names = self.channels.iter().map(|channel| channel.name.clone());
        if let Kind::Fitted { .. } = self.kind
            && values.iter().flatten().any(|f| f.is_nan())
        {
            return Err(Error::invalid("model", "finite values", "NaN"));
        }
        let sampled = Measurement::new(directions, names.zip(values))?;
        csv::write(&sampled, &[self.about.clone(), "angles in degrees, values in 1/sr".to_owned()])
    }

    /// The file in a format. What it cannot hold and how close it is are added to `said`.
    fn written(
        &self,
        format: &Format,
        grid: Option<&AngleGrid>,
        output: &Path,
        said: &mut Vec<String>,
    ) -> Result<Vec<u8>, Error> {
        let Some(write) = format.write else { return Ok(Vec::new()) };
        let (at, covered) =
            (|pairs: &[Pair]| self.answer(pairs).values, |pairs: &[Pair]| self.answer(pairs).covered);
        let subject = Subject {
            channels: &self.channels,
            at: &at,
            covered: &covered,
            measurement: match &self.kind {
                Kind::Measured { measurement, .. } => Some(measurement),
                Kind::Fitted { .. } => None,
            },
            isotropic: self.isotropic,
            about: &self.about,
            grid,
        };
        let Written { bytes, losses } = write(&subject)?;
        let name = if output.as_os_str() == "-" {
            "standard output".to_owned()
        } else {
            output.display().to_string()
        };
        said.extend(losses.iter().map(|loss| format!("warning: {name}: {loss}")));
        if let Some(Resampling { relative_rms, median, pairs }) = resampling(&bytes, format, &subject)? {
            let what = if subject.measurement.is_some() { "measured" } else { "random" };
            said.push(format!(
                "note: {name}: {}; read back at {pairs} {what} pairs of directions: relative RMS {}, median {}",
                format.name,
                percent(relative_rms),
                percent(median)
            ));
        }
        Ok(bytes)
    }
}

/// A share in per cent, to two digits.
fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    match percent {
        _ if percent < 1e-10 => "0 %".to_owned(),
        _ if percent < 1e-3 => format!("{percent:.1e} %"),
        // Two digits.
        _ if percent < 0.01 => format!("{percent:.4} %"),
        _ if percent < 0.1 => format!("{percent:.3} %"),
        _ if percent < 1.0 => format!("{percent:.2} %"),
        _ if percent < 10.0 => format!("{percent:.1} %"),
        _ => format!("{percent:.0} %"),
    }
}

/// The last part of a path.
fn name(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned())
}

/// The map to red, green and blue, if the user wants them, with a note about how they are found.
fn colours(
    channels: &[Channel],
    arguments: &Arguments,
    primaries: &Primaries,
    notes: &mut Vec<String>,
) -> Option<ToRgb> {
    if !arguments.rgb {
        return None;
    }
    let (illuminant, light) = match arguments.illuminant {
        None | Some(Light::D65) => (Illuminant::D65, "D65"),
        Some(Light::E) => (Illuminant::E, "E"),
    };
    let colours = ToRgb::under(channels, illuminant).in_primaries(primaries);
    let title = primaries.title;
    notes.push(match colours.route {
        Route::Rgb => format!("channels r, g and b were taken as linear Rec.709 and written in {title}"),
        Route::Spectrum => format!("the spectrum was turned into {title} (CIE 1931 observer, light {light})"),
        Route::Grey => "the channels are neither RGB nor spectral: grey, their mean, was written".to_owned(),
        Route::GreyFewWavelengths => {
            "the wavelengths are too few for a colour: grey, their mean, was written".to_owned()
        }
        Route::GreyInvisible => "no wavelength is visible: grey, their mean, was written".to_owned(),
    });
    Some(colours)
}
