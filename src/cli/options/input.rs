//! Options that say how a measurement is read and which of its samples are used.

use brdfit::Error;
use brdfit::doctor::examine;
use brdfit::error::OptionName;
use brdfit::fit::{Metric, Options};
use brdfit::measurement::formats::{BinPosition, REGISTRY, ReadOptions, named, read};
use brdfit::measurement::reading::{self, Conventions, Quantity};
use brdfit::measurement::{Filters, Measurement, Weighting, checked_max_theta};
use brdfit::report::{OptionRecord, Report};
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use std::path::Path;

/// The heading of these options in the help.
const READING: &str = "Reading the measurement";

/// Options for reading a file.
#[derive(Args, Clone, Default)]
pub struct ReadArguments {
    #[arg(long, value_name = "NAME", help = format_help(), help_heading = READING)]
    format: Option<String>,
    /// Choose where in its bin each value of a MERL table lies [default: center]
    #[arg(long, value_enum, value_name = "WHERE", help_heading = READING)]
    merl_bins: Option<Bins>,
    /// Read this material from a file that holds several [default: the first]
    #[arg(long, value_name = "NAME", help_heading = READING)]
    material: Option<String>,
    /// Say which columns of a table are what, by name or number: theta_i=A,theta_o=B,channels=R;G;B,sigma=S [default: by their names]
    #[arg(long, value_name = "PART=COLUMN,...", help_heading = READING)]
    columns: Option<String>,
    /// Divide the rows of a table at this: comma, semicolon, tab, bar or blanks [default: recognised]
    #[arg(long, value_name = "NAME", help_heading = READING)]
    separator: Option<String>,
    /// Read numbers with a decimal point or comma [default: recognised]
    #[arg(long, value_name = "MARK", help_heading = READING)]
    decimal: Option<String>,
    /// Read angles in this unit: degrees, radians, gradians, cosine or elevation, for all or as in theta_i=elevation,phi_o=radians
    /// [default: what the header says, or degrees]
    #[arg(long, value_name = "UNIT|ANGLE=UNIT,...", help_heading = READING)]
    angles: Option<String>,
    /// Count the viewer's azimuth from the light's azimuth (from-light, or relative) or from that of the mirror direction (from-mirror)
    /// [default: both azimuths from one axis]
    #[arg(long, value_name = "WHERE", help_heading = READING)]
    azimuth: Option<String>,
    /// Take the light's direction as pointing towards-light or as-it-travels [default: towards-light]
    #[arg(long, value_name = "WHICH", help_heading = READING)]
    light_direction: Option<String>,
    #[arg(long, value_name = "WORD,...", help = quantity_help(), help_heading = READING)]
    quantity: Option<String>,
    /// Multiply the values by this factor
    #[arg(long, value_name = "FACTOR", help_heading = READING)]
    scale: Option<String>,
    /// Take these values for marks of what was not measured, such as -999
    #[arg(long, value_name = "VALUE,...", allow_hyphen_values = true, help_heading = READING)]
    missing: Option<String>,
    /// Leave out samples whose directions lie in these ranges, in degrees: theta_i=60..70,phi_o=170..190; repeat the option for more
    #[arg(long, value_name = "ANGLE=FROM..TO,...", help_heading = READING)]
    leave_out: Vec<String>,
    /// Average channels for s- and p-polarised light
    #[arg(long, help_heading = READING)]
    mean_of_s_and_p: bool,
}

/// The help text of `--quantity`.
fn quantity_help() -> String {
    format!(
        "Read values as this quantity, one or more of {} [default: f, in 1/sr]",
        Quantity::names().join(", ")
    )
}

#[derive(Clone, Copy, ValueEnum)]
enum Bins {
    /// At the centre of the bin
    Center,
    /// At the lower edge of the bin
    Edge,
}

/// Joins names with commas, and the last one with "or".
fn alternatives(names: &[&str]) -> String {
    match names {
        [] => String::new(),
        [only] => (*only).to_owned(),
        [first @ .., last] => format!("{} or {last}", first.join(", ")),
    }
}

/// The help text of an argument that names one or several measurements.
pub fn measurement_help(what: &str) -> String {
    let names: Vec<&str> = REGISTRY.iter().map(|format| format.name).collect();
    format!("{what} (formats: {})", names.join(", "))
}

/// The help text of `--format`.
fn format_help() -> String {
    let names: Vec<&str> = REGISTRY.iter().map(|format| format.name).collect();
    format!("Read the input as {} [default: recognised by its content]", alternatives(&names))
}

impl ReadArguments {
    /// Which directions the cells of a MERL table represent.
    fn merl_bins(&self) -> BinPosition {
        match self.merl_bins {
            None | Some(Bins::Center) => BinPosition::Center,
            Some(Bins::Edge) => BinPosition::Edge,
        }
    }

    /// These options, and for those that the user did not give, what `reported` says.
    pub fn or_as_in(&self, reported: Option<&Report>) -> Self {
        let Some(report) = reported else { return self.clone() };
        let bins = report.options.merl_bins.known();
        let bins = bins.map(|bins| if bins == BinPosition::Edge { Bins::Edge } else { Bins::Center });
        let material = self.material.clone().or_else(|| report.options.material.clone());
        let mut arguments = Self { merl_bins: self.merl_bins.or(bins), material, ..self.clone() };
        let own: Vec<OptionName> = self.conventions().into_iter().map(|(option, _)| option).collect();
        for (name, value) in report.options.reading.iter().filter_map(|reading| reading.split_once('=')) {
            let Some(option) = reading::OPTIONS.into_iter().find(|option| option.name() == name) else {
                continue;
            };
            if own.contains(&option) {
                continue;
            }
            match arguments.of_option(option) {
                Some(Given::Once(text)) => *text = Some(value.to_owned()),
                Some(Given::Often(texts)) => texts.push(value.to_owned()),
                Some(Given::Flag(flag)) => *flag = value == "true",
                None => {}
            }
        }
        arguments
    }

    /// The argument of an option that says how the file is to be understood.
    fn of_option(&mut self, option: OptionName) -> Option<Given<'_>> {
        Some(match option {
            OptionName::Columns => Given::Once(&mut self.columns),
            OptionName::Separator => Given::Once(&mut self.separator),
            OptionName::Decimal => Given::Once(&mut self.decimal),
            OptionName::Angles => Given::Once(&mut self.angles),
            OptionName::Azimuth => Given::Once(&mut self.azimuth),
            OptionName::LightDirection => Given::Once(&mut self.light_direction),
            OptionName::Quantity => Given::Once(&mut self.quantity),
            OptionName::Scale => Given::Once(&mut self.scale),
            OptionName::Missing => Given::Once(&mut self.missing),
            OptionName::LeaveOut => Given::Often(&mut self.leave_out),
            OptionName::MeanOfSAndP => Given::Flag(&mut self.mean_of_s_and_p),
            _ => return None,
        })
    }

    /// What the user said about how the file is to be understood, by option.
    fn conventions(&self) -> Vec<(OptionName, String)> {
        let mut given = Vec::new();
        let mut copy = self.clone();
        for option in reading::OPTIONS {
            let texts = match copy.of_option(option) {
                Some(Given::Once(text)) => text.iter().cloned().collect(),
                Some(Given::Often(texts)) => texts.clone(),
                Some(Given::Flag(flag)) => flag.then(|| "true".to_owned()).into_iter().collect(),
                None => Vec::new(),
            };
            given.extend(texts.into_iter().map(|text| (option, text)));
        }
        given
    }

    /// These options, with the file read in this format unless the user named one.
    pub fn or_in_format(&self, name: &str) -> Self {
        let known = REGISTRY.iter().any(|format| format.name == name);
        Self { format: self.format.clone().or_else(|| known.then(|| name.to_owned())), ..self.clone() }
    }

    /// Checks the options before any file is read.
    pub fn check(&self) -> Result<(), Error> {
        self.format.as_deref().map_or(Ok(()), |name| named(name).map(drop))?;
        self.options().map(drop)
    }

    /// Reads a measurement.
    pub fn read(&self, path: &Path) -> Result<Measurement, Error> {
        read(path, self.format.as_deref(), &self.options()?)
    }

    /// Adds what speaks for reading a measurement, which was read with these options, in another way.
    pub fn examine(&self, measurement: &mut Measurement) -> Result<(), Error> {
        let found = examine(measurement, &self.options()?.conventions);
        measurement.doubts.extend(found);
        Ok(())
    }

    /// The options of a reader.
    pub fn options(&self) -> Result<ReadOptions, Error> {
        let mut conventions = Conventions::default();
        for (option, text) in self.conventions() {
            conventions = conventions.with(option, &text)?;
        }
        let options = ReadOptions::new().with_merl_bins(self.merl_bins()).with_conventions(conventions);
        Ok(match &self.material {
            Some(material) => options.with_material(material),
            None => options,
        })
    }

    /// Adds these options to the record of a fit's.
    pub fn recorded_in(&self, options: OptionRecord) -> OptionRecord {
        let reading = |(option, text): (OptionName, String)| format!("{option}={text}");
        OptionRecord {
            merl_bins: self.merl_bins().into(),
            material: self.material.clone(),
            reading: self.conventions().into_iter().map(reading).collect(),
            ..options
        }
    }
}

/// The argument of an option.
enum Given<'a> {
    Once(&'a mut Option<String>),
    Often(&'a mut Vec<String>),
    Flag(&'a mut bool),
}

/// Value of `SCENE` for a command that has a scene, whose image can set the weights of the samples.
pub const WITH_SCENE: bool = true;

/// Options that say which samples are used, how they are weighted, and what is compared.
#[derive(Args, Default)]
pub struct SampleArguments<const SCENE: bool = false> {
    /// Compare x = f cos(theta_i) itself (l2), ln(1 + x) (log), the cube root of x (cbrt), or that without its bias under noise (unbiased-cbrt)
    /// [default: unbiased-cbrt]
    #[arg(long, value_enum)]
    metric: Option<MetricName>,
    #[arg(long, value_parser = weights(SCENE), help = weights_help(SCENE))]
    weights: Option<Weights>,
    #[arg(long, value_name = "DEG", help = max_theta_help(SCENE))]
    max_theta: Option<f64>,
    /// Use only N samples, drawn evenly, or all of them
    #[arg(long, value_parser = sample_count, value_name = "N|all")]
    samples: Option<SampleCount>,
    /// Set the seed of every random choice [default: 0]
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
}

/// The largest number of samples to use. `None` means all.
#[derive(Clone, Copy)]
pub struct SampleCount(Option<usize>);

fn sample_count(text: &str) -> Result<SampleCount, String> {
    match text.parse() {
        _ if text == "all" => Ok(SampleCount(None)),
        Ok(n) if n > 0 => Ok(SampleCount(Some(n))),
        _ => Err("expected a whole number of at least 1, or 'all'".to_owned()),
    }
}

#[derive(Clone, Copy, ValueEnum)]
enum MetricName {
    L2,
    Log,
    Cbrt,
    UnbiasedCbrt,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Weights {
    SolidAngle,
    Uniform,
    Sigma,
    /// Fit the image of the scene
    Scene,
}

/// The help text of `--weights`.
fn weights_help(scene: bool) -> &'static str {
    if scene {
        "Weight the samples [default: scene, which fits the image of the scene]"
    } else {
        "Weight the samples [default: solid-angle on MERL grids, uniform elsewhere]"
    }
}

/// The help text of `--max-theta`.
fn max_theta_help(scene: bool) -> &'static str {
    if scene {
        "Leave out samples with theta_i or theta_o above this angle, degrees [default: 90]"
    } else {
        "Leave out samples with theta_i or theta_o above this angle, degrees [default: 80]"
    }
}

/// Parses weights by name. `scene` is listed only by a command that has a scene, but understood by all, so that the
/// error can name that command.
fn weights(scene: bool) -> impl TypedValueParser<Value = Weights> {
    let shown =
        |weights: &Weights| weights.to_possible_value().map(|v| v.hide(*weights == Weights::Scene && !scene));
    let values = Weights::value_variants().iter().filter_map(shown);
    PossibleValuesParser::new(values).try_map(|name| Weights::from_str(&name, false))
}

impl<const SCENE: bool> SampleArguments<SCENE> {
    /// The metric.
    pub fn metric(&self) -> Metric {
        match self.metric {
            Some(MetricName::L2) => Metric::L2,
            Some(MetricName::Log) => Metric::Log,
            Some(MetricName::Cbrt) => Metric::Cbrt,
            None | Some(MetricName::UnbiasedCbrt) => Metric::UnbiasedCbrt,
        }
    }

    /// The seed.
    pub fn seed(&self) -> u64 {
        self.seed.unwrap_or_default()
    }

    /// The largest number of samples. `None` if the user set no limit.
    pub fn samples(&self) -> Option<usize> {
        self.samples_or(None)
    }

    /// The largest number of samples, or `otherwise` if the option is absent. `None` means no limit.
    pub fn samples_or(&self, otherwise: Option<usize>) -> Option<usize> {
        self.samples.map_or(otherwise, |samples| samples.0)
    }

    /// The filters of a fit without a scene.
    pub fn filters(&self) -> Result<Filters, Error> {
        if let Some(Weights::Scene) = self.weights {
            let expected = "solid-angle, uniform or sigma, since only `brdfit select` has a scene";
            return Err(Error::invalid(OptionName::Weights, expected, "scene"));
        }
        self.filters_up_to(Filters::default().max_theta_deg)
    }

    /// The filters. Their weighting is `None` for the weights of a scene. The default of `--max-theta` is
    /// `max_theta_deg` degrees.
    pub fn filters_up_to(&self, max_theta_deg: f64) -> Result<Filters, Error> {
        let mut filters = Filters::default()
            .with_max_theta_deg(checked_max_theta(self.max_theta.unwrap_or(max_theta_deg))?)
            .with_seed(self.seed());
        filters.weighting = self.weights.and_then(|weights| match weights {
            Weights::SolidAngle => Some(Weighting::SolidAngle),
            Weights::Uniform => Some(Weighting::Uniform),
            Weights::Sigma => Some(Weighting::Sigma),
            Weights::Scene => None,
        });
        filters.samples = self.samples();
        Ok(filters)
    }
}

impl SampleArguments {
    /// The options of an evaluation: these, and for those that the user did not give, what `reported` says.
    pub fn options_or_as_in(&self, reported: Option<&Report>) -> Result<Options, Error> {
        let mut filters = self.filters()?;
        let (mut metric, mut seed) = (self.metric(), self.seed());
        if let Some(report) = reported {
            metric = report.metric.known().filter(|_| self.metric.is_none()).unwrap_or(metric);
            seed = self.seed.unwrap_or(report.options.seed);
            filters.seed = seed;
            if self.max_theta.is_none() {
                filters.max_theta_deg = checked_max_theta(report.filters.max_theta_deg)?;
            }
            filters.weighting = filters.weighting.or_else(|| report.filters.weights.known());
            filters.samples = self.samples_or(report.options.samples);
        }
        Ok(Options::default().with_metric(metric).with_filters(filters).with_seed(seed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn help_names_every_format() {
        let (measurement, format) = (measurement_help("Measurement"), format_help());
        for known in REGISTRY {
            assert!(measurement.contains(known.name), "{}: {measurement}", known.name);
            assert!(format.contains(known.name), "{}: {format}", known.name);
        }
    }
}
