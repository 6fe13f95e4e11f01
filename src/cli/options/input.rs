//! Options that say how a measurement is read and which samples count.

use brdfit::Error;
use brdfit::error::OptionName;
use brdfit::fit::Metric;
use brdfit::measurement::formats::{BinPosition, REGISTRY, ReadOptions, named, read};
use brdfit::measurement::{Filters, Measurement, Weighting};
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use std::path::Path;

/// How a file is read.
#[derive(Args)]
pub struct ReadArguments {
    #[arg(long, value_name = "NAME", help = format_help())]
    format: Option<String>,
    /// Choose where in its bin each value of a MERL table lies
    #[arg(long, value_enum, default_value_t = Bins::Center, value_name = "WHERE")]
    merl_bins: Bins,
}

#[derive(Clone, Copy, ValueEnum)]
enum Bins {
    /// At the centre of the bin
    Center,
    /// At the lower edge of the bin
    Edge,
}

/// Names joined by commas, and the last one by "or".
fn alternatives(names: &[&str]) -> String {
    match names {
        [] => String::new(),
        [only] => (*only).to_owned(),
        [first @ .., last] => format!("{} or {last}", first.join(", ")),
    }
}

/// The help of an argument that names one measurement, or several.
pub fn measurement_help(what: &str) -> String {
    let summaries: Vec<&str> = REGISTRY.iter().map(|format| format.summary).collect();
    format!("{what}: {}", alternatives(&summaries))
}

/// The help of `--format`.
fn format_help() -> String {
    let names: Vec<&str> = REGISTRY.iter().map(|format| format.name).collect();
    format!("Read the input as {} [default: recognised by its content]", alternatives(&names))
}

impl ReadArguments {
    /// Which directions the cells of a MERL table stand for.
    pub fn merl_bins(&self) -> BinPosition {
        match self.merl_bins {
            Bins::Center => BinPosition::Center,
            Bins::Edge => BinPosition::Edge,
        }
    }

    /// Checks the format's name before any file is read.
    pub fn check(&self) -> Result<(), Error> {
        self.format.as_deref().map_or(Ok(()), |name| named(name).map(drop))
    }

    /// Reads a measurement.
    pub fn read(&self, path: &Path) -> Result<Measurement, Error> {
        read(path, self.format.as_deref(), &ReadOptions::new().with_merl_bins(self.merl_bins()))
    }
}

/// `SCENE` where a command knows a scene, whose image may say how samples count.
pub const WITH_SCENE: bool = true;

/// Which samples count, and what is compared.
#[derive(Args)]
pub struct SampleArguments<const SCENE: bool = false> {
    /// Compare x = f cos(theta_i) itself (l2), ln(1 + x) (log) or the cube root of x (cbrt)
    #[arg(long, value_enum, default_value_t = MetricName::Cbrt)]
    metric: MetricName,
    #[arg(long, value_parser = weights(SCENE), help = weights_help(SCENE))]
    weights: Option<Weights>,
    #[arg(long, value_name = "DEG", help = max_theta_help(SCENE))]
    max_theta: Option<f64>,
    /// Use only N samples, drawn evenly, or all of them
    #[arg(long, value_parser = sample_count, value_name = "N|all")]
    samples: Option<SampleCount>,
    /// Set the seed of every random choice
    #[arg(long, default_value_t = 0, value_name = "N")]
    seed: u64,
}

/// A number of samples, or all.
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
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Weights {
    SolidAngle,
    Uniform,
    Sigma,
    /// Fit the image of the scene
    Scene,
}

/// The help of `--weights`.
fn weights_help(scene: bool) -> &'static str {
    if scene {
        "Weight the samples [default: scene, which fits the image of the scene]"
    } else {
        "Weight the samples [default: solid-angle on MERL grids, uniform elsewhere]"
    }
}

/// The help of `--max-theta`.
fn max_theta_help(scene: bool) -> &'static str {
    if scene {
        "Leave out samples with theta_i or theta_o above this angle, degrees [default: 90]"
    } else {
        "Leave out samples with theta_i or theta_o above this angle, degrees [default: 80]"
    }
}

/// Reads weights by name. Those of a scene are offered where there is one, and understood everywhere: the error then says
/// which command has one.
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
            MetricName::L2 => Metric::L2,
            MetricName::Log => Metric::Log,
            MetricName::Cbrt => Metric::Cbrt,
        }
    }

    /// The seed.
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// The number of samples, if limited.
    pub fn samples(&self) -> Option<usize> {
        self.samples_or(None)
    }

    /// The number of samples, if limited; `otherwise` where nothing was said of it.
    pub fn samples_or(&self, otherwise: Option<usize>) -> Option<usize> {
        self.samples.map_or(otherwise, |samples| samples.0)
    }

    /// The filters of a fit that knows of no scene.
    pub fn filters(&self) -> Result<Filters, Error> {
        if let Some(Weights::Scene) = self.weights {
            let expected = "solid-angle, uniform or sigma, since only `brdfit select` has a scene";
            return Err(Error::invalid(OptionName::Weights, expected, "scene"));
        }
        self.filters_up_to(Filters::default().max_theta_deg)
    }

    /// The filters, without a weighting for a scene's; angles up to `max_theta_deg` where nothing was said of them.
    pub fn filters_up_to(&self, max_theta_deg: f64) -> Result<Filters, Error> {
        let mut filters = Filters::default()
            .with_max_theta_deg(checked_max_theta(self.max_theta.unwrap_or(max_theta_deg))?)
            .with_seed(self.seed);
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

/// An angle that leaves some directions above the horizon.
pub fn checked_max_theta(degrees: f64) -> Result<f64, Error> {
    if degrees > 0.0 && degrees <= 90.0 {
        Ok(degrees)
    } else {
        let expected = "more than 0 and at most 90 degrees";
        Err(Error::invalid(OptionName::MaxTheta, expected, degrees.to_string()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn help_names_every_format() {
        let (measurement, format) = (measurement_help("Measurement"), format_help());
        for known in REGISTRY {
            assert!(measurement.contains(known.summary), "{}: {measurement}", known.name);
            assert!(format.contains(known.name), "{}: {format}", known.name);
        }
    }
}
