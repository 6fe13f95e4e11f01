//! Several reports at a glance: the ranking of the models of each input, a summary of all inputs, and a table with a row per
//! parameter for other programs.

use super::record::{ErrorRecord, Failure, Parameter, Rank, Report, Reports};
use crate::error::{Error, rounded};
use crate::lines::{Lines, Role, free, left, right};
use serde::Serialize;
use std::fmt::Write as _;

/// One parameter of one fit, a row of the table that `brdfit fit --summary` writes. docs/use/report.md describes the columns.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct SummaryRow<'a> {
    /// The path of the measurement, as given.
    pub file: &'a str,
    /// The model as an expression with every choice spelled out.
    pub model: &'a str,
    /// The model's place among those fitted to the same file, from 1.
    pub rank: usize,
    /// The metric that was minimised.
    pub metric: &'a str,
    /// The error in that metric on the samples fitted; `None` if it is not a number.
    pub error: Option<f64>,
    /// Whether the fit can be used.
    pub usable: bool,
    /// Lobe and symbol: `cook-torrance.m`.
    pub parameter: String,
    /// The parameter's channel; `None` if the channels share it.
    pub channel: Option<&'a str>,
    /// The unit of value, standard error and interval; "1" is dimensionless.
    pub unit: &'a str,
    /// The value.
    pub value: f64,
    /// Its standard error; `None` if it is unknown.
    pub std_error: Option<f64>,
    /// Lower end of its 95 % confidence interval; `None` if it is unknown.
    pub ci95_low: Option<f64>,
    /// Upper end of its 95 % confidence interval; `None` if it is unknown.
    pub ci95_high: Option<f64>,
    /// Whether the parameter was fitted, and where it ended.
    pub status: &'a str,
}

/// The names of the columns, in the order of the fields of [`SummaryRow`].
const COLUMNS: [&str; 14] = [
    "file",
    "model",
    "rank",
    "metric",
    "error",
    "usable",
    "parameter",
    "channel",
    "unit",
    "value",
    "std_error",
    "ci95_low",
    "ci95_high",
    "status",
];

/// A report with its place in the ranking of its input, from 1.
struct Ranked<'a> {
    place: usize,
    rank: &'a Rank,
    report: &'a Report,
}

impl Reports {
    /// A row for each parameter of each report: input by input, the models of each from best to worst.
    #[must_use]
    pub fn rows(&self) -> Vec<SummaryRow<'_>> {
        let mut rows = Vec::new();
        for Ranked { place, report, .. } in self.by_input().into_iter().flatten() {
            rows.extend(report.parameters.iter().map(|parameter| row(report, place, parameter)));
        }
        rows
    }

    /// The [`rows`](Reports::rows) as CSV with a header. What is unknown is an empty field.
    ///
    /// # Errors
    /// [`Error::Encoding`], which does not occur in practice.
    pub fn csv(&self) -> Result<Vec<u8>, Error> {
        let failed =
            |error: &dyn std::fmt::Display| Error::Encoding { format: "CSV", reason: error.to_string() };
        // The header is there even if there is no row.
        let mut writer = csv::WriterBuilder::new().has_headers(false).from_writer(Vec::new());
        writer.write_record(COLUMNS).map_err(|e| failed(&e))?;
        for row in self.rows() {
            writer.serialize(row).map_err(|e| failed(&e))?;
        }
        writer.into_inner().map_err(|e| failed(&e))
    }

    /// The models of each input from best to worst.
    #[doc(hidden)]
    #[must_use]
    pub fn ranking_lines(&self) -> Lines {
        Lines::of(|text| {
            writeln!(text.as_a(Role::Heading), "ranking by {}:", self.criterion())?;
            let inputs = self.by_input();
            for ranked in &inputs {
                if let Some(Ranked { report, .. }) = ranked.first().filter(|_| inputs.len() > 1) {
                    writeln!(text.as_a(Role::Title), "{}", report.data.path)?;
                }
                // Places are numbered where they are referred to.
                let numbered = ranked.iter().any(|ranked| ranked.rank.not_told_apart.is_some());
                for Ranked { place, rank, report } in ranked {
                    let unusable = if report.termination.usable { "" } else { "  NOT USABLE" };
                    let alike = listed_places(&alike(ranked, rank));
                    let alike =
                        if alike.is_empty() { alike } else { format!("  (not told apart from {alike})") };
                    let model = format!("{}{unusable}{alike}", report.model);
                    let place =
                        numbered.then(|| left(format!("{place}."), ranked.len().to_string().len() + 1));
                    let cells = place.into_iter().chain([right(six_decimals(rank.value), 8), free(model)]);
                    text.row(verdict(report).0, 2, cells);
                }
            }
            Ok(())
        })
    }

    /// A row for each input, with its best model, and the inputs that failed.
    #[doc(hidden)]
    #[must_use]
    pub fn summary_lines(&self) -> Lines {
        let inputs = self.by_input();
        let is_ranked = inputs.iter().any(|ranked| ranked.len() > 1);
        let best: Vec<&Ranked<'_>> = inputs.iter().filter_map(|ranked| ranked.first()).collect();
        let criterion = self.criterion();
        let longest = best.iter().map(|ranked| ranked.report.data.path.chars().count()).max().unwrap_or(0);
        let row = |input: &str, numbers: [String; 3], verdict: &str, model: &str| {
            let [error, over_noise, warnings] = numbers;
            [
                left(input, longest.max("input".len())),
                right(error, criterion.len()),
                right(over_noise, "over noise".len()),
                right(warnings, "warnings".len()),
                free(format!("{verdict:<10}")),
                free(model),
            ]
        };
        Lines::of(|text| {
            writeln!(text.as_a(Role::Heading), "summary:")?;
            if !best.is_empty() {
                let headings = [criterion, "over noise", "warnings"].map(str::to_owned);
                let model = if is_ranked { "best model" } else { "model" };
                text.row(Role::Heading, 2, row("input", headings, "verdict", model));
            }
            for (Ranked { rank, report, .. }, ranked) in
                best.iter().zip(inputs.iter().filter(|i| !i.is_empty()))
            {
                let others = alike(ranked, rank).len();
                let others = match others {
                    0 => String::new(),
                    1 => "  (not told apart from the next)".to_owned(),
                    others => format!("  (not told apart from {others} others)"),
                };
                let over_noise = report.misfit.as_ref().and_then(|misfit| misfit.ratio);
                let over_noise = over_noise.map_or_else(|| "-".to_owned(), |ratio| format!("{ratio:.3}"));
                let numbers = [six_decimals(rank.value), over_noise, report.warnings.len().to_string()];
                let (role, verdict) = verdict(report);
                let model = format!("{}{others}", report.model);
                text.row(role, 2, row(&report.data.path, numbers, verdict, &model));
            }
            for Failure { path, error } in &self.failed {
                // Errors about a file's content begin with its name.
                let name = if error.starts_with(path.as_str()) { String::new() } else { format!("{path}: ") };
                writeln!(text.as_a(Role::Bad), "  failed: {name}{error}")?;
            }
            Ok(())
        })
    }

    /// The reports in the order of the ranking, those of one input together.
    fn by_input(&self) -> Vec<Vec<Ranked<'_>>> {
        let mut inputs: Vec<Vec<Ranked<'_>>> = Vec::new();
        for rank in &self.ranking {
            let Some(report) = self.reports.get(rank.index) else { continue };
            let same = |ranked: &&mut Vec<Ranked<'_>>| {
                ranked.first().is_some_and(|first| first.report.data.path == report.data.path)
            };
            match inputs.last_mut().filter(same) {
                Some(ranked) => ranked.push(Ranked { place: ranked.len() + 1, rank, report }),
                None => inputs.push(vec![Ranked { place: 1, rank, report }]),
            }
        }
        inputs
    }

    /// What the ranking compares.
    fn criterion(&self) -> &str {
        self.ranking.first().map_or("error", |rank| rank.criterion.name())
    }
}

/// The row of a parameter of a report that has this place among those of its input.
fn row<'a>(report: &'a Report, rank: usize, parameter: &'a Parameter) -> SummaryRow<'a> {
    let of = |errors: &ErrorRecord| report.metric.known().and_then(|metric| errors.of(metric));
    SummaryRow {
        file: &report.data.path,
        model: &report.model,
        rank,
        metric: report.metric.name(),
        error: of(&report.errors),
        usable: report.termination.usable,
        parameter: format!("{}.{}", parameter.lobe, parameter.name),
        channel: parameter.channel.as_deref(),
        unit: parameter.unit.name(),
        value: parameter.value,
        std_error: parameter.std_error,
        ci95_low: parameter.ci95.map(|[low, _]| low),
        ci95_high: parameter.ci95.map(|[_, high]| high),
        status: parameter.status.name(),
    }
}

/// The places of the models of an input that are not told apart from that of `rank`.
fn alike(ranked: &[Ranked<'_>], rank: &Rank) -> Vec<usize> {
    let listed = rank.not_told_apart.iter().flatten();
    listed.filter_map(|index| Some(ranked.iter().find(|r| r.rank.index == *index)?.place)).collect()
}

/// Places as people write them: `2, 3 and 5`.
fn listed_places(places: &[usize]) -> String {
    match places {
        [] => String::new(),
        [only] => only.to_string(),
        [first @ .., last] => {
            let first: Vec<String> = first.iter().map(usize::to_string).collect();
            format!("{} and {last}", first.join(", "))
        }
    }
}

/// The verdict on a fit, and the role of a line about it.
fn verdict(report: &Report) -> (Role, &'static str) {
    if report.termination.usable { (Role::Plain, "usable") } else { (Role::Bad, "NOT USABLE") }
}

/// An error to six decimals, or a dash if it is unknown.
fn six_decimals(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |value| rounded(value, 6))
}
