//! `brdfit models`: lists the models, or writes one as code.

use crate::cli::messages::{emit, say};
use crate::cli::options::code::{CodeParameters, not_arguments};
use crate::cli::outcome::Outcome;
use crate::cli::output::json;
use brdfit::Error;
use brdfit::code::{Arguments as CodeArguments, LANGUAGES, Language, named};
use brdfit::error::NameKind;
use brdfit::lines::{Lines, Role as LineRole};
use brdfit::model::{AnyModel, Expression, ModelEntry, ParamSpec, REGISTRY, Role, Sharing};
use brdfit::tradeoff::{BasisCost, basis_cost};
use clap::Args;
use clap::builder::PossibleValuesParser;
use serde::Serialize;
use std::fmt::{self, Write as _};

/// Arguments of `brdfit models`.
#[derive(Args)]
pub struct Arguments {
    /// List this model only; with --code, it may be any expression
    #[arg(value_name = "NAME")]
    name: Option<String>,
    /// Write the model as code in this language, for one channel at its default values
    #[arg(long, value_name = "LANGUAGE", requires = "name", conflicts_with = "json", value_parser = PossibleValuesParser::new(LANGUAGES.iter().map(|l| l.name)))]
    code: Option<String>,
    /// What becomes of the parameters in code [default: free]
    #[arg(long, value_name = "HOW", requires = "code")]
    parameters: Option<CodeParameters>,
    /// Print JSON instead of the table
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct ModelRecord {
    name: &'static str,
    summary: &'static str,
    reference: &'static str,
    /// Whether light and viewer may be exchanged.
    reciprocal: bool,
    /// Time that the default variant takes on this machine, measured now.
    cost_ns: BasisCost,
    options: Vec<OptionRecord>,
    /// Parameters of all variants; a parameter that only some variants have lists their choices.
    parameters: Vec<ParameterRecord>,
}

#[derive(Serialize)]
struct OptionRecord {
    key: &'static str,
    summary: &'static str,
    values: Vec<&'static str>,
    default: &'static str,
}

#[derive(Serialize)]
struct ParameterRecord {
    name: &'static str,
    summary: &'static str,
    unit: &'static str,
    bounds: [f64; 2],
    initial: f64,
    role: &'static str,
    sharing: &'static str,
    fixed_by_default: bool,
    /// Choices with which the parameter exists; null means all.
    only_with: Option<Vec<String>>,
}

/// Runs the subcommand.
pub fn run(arguments: &Arguments) -> Result<Outcome, Error> {
    if let Arguments { name: Some(name), code: Some(language), parameters, .. } = arguments {
        let how = parameters.map_or(CodeArguments::Free, CodeArguments::from);
        emit(&code(name, named("--code", language)?, how)?)?;
        return Ok(Outcome::Good);
    }
    let chosen: Vec<&ModelEntry> = match &arguments.name {
        None => REGISTRY.iter().collect(),
        Some(name) => {
            let names: Vec<&str> = REGISTRY.iter().map(|entry| entry.name).collect();
            let entry = REGISTRY
                .iter()
                .find(|entry| entry.name == name)
                .ok_or_else(|| Error::unknown("model", NameKind::Model, &names, name))?;
            vec![entry]
        }
    };
    let records: Vec<ModelRecord> = chosen.into_iter().map(record).collect();
    if arguments.json {
        emit(&json(&records)?)?;
    } else {
        say(&Lines::of(|text| list(text, &records)))?;
    }
    Ok(Outcome::Good)
}

/// A model as code, for one channel.
fn code(model: &str, language: &Language, how: CodeArguments) -> Result<String, Error> {
    let expression: Expression = model.parse()?;
    let about = [format!("brdfit {}", env!("CARGO_PKG_VERSION"))];
    let written = language.write_for_one_channel(&expression, how, &about)?;
    written.map_err(|reason| not_arguments(&reason))
}

fn record(entry: &ModelEntry) -> ModelRecord {
    let options: Vec<OptionRecord> = entry
        .options
        .iter()
        .map(|o| OptionRecord { key: o.key, summary: o.summary, values: (o.values)(), default: o.default })
        .collect();
    let variants: Vec<(Vec<ParamSpec>, Vec<String>)> = entry
        .variants()
        .into_iter()
        .map(|(model, choices): (AnyModel, _)| {
            let chosen = options.iter().map(|o| format!("{}={}", o.key, choices.get(o.key))).collect();
            (model.parameters(), chosen)
        })
        .collect();
    // Two declarations of one name count as two parameters if they differ: ks is fixed with some choices only.
    let mut parameters: Vec<(ParamSpec, usize, Vec<String>)> = Vec::new();
    for (specs, chosen) in &variants {
        for spec in specs {
            let same = |p: &&mut (ParamSpec, usize, Vec<String>)| {
                p.0.name == spec.name && p.0.fixed == spec.fixed && p.0.role == spec.role
            };
            match parameters.iter_mut().find(same) {
                Some((_, count, common)) => {
                    *count += 1;
                    common.extend(chosen.iter().filter(|c| !common.contains(c)).cloned().collect::<Vec<_>>());
                }
                None => parameters.push((spec.clone(), 1, chosen.clone())),
            }
        }
    }
    let all = variants.len();
    let parameters = parameters
        .into_iter()
        .map(|(spec, count, present)| {
            // Of the choices that the parameter occurs with, keep those of options that do not occur with every value.
            let telling = |choice: &String| {
                options.iter().any(|o| {
                    choice.starts_with(&format!("{}=", o.key))
                        && o.values.iter().any(|v| !present.contains(&format!("{}={v}", o.key)))
                })
            };
            ParameterRecord {
                name: spec.name,
                summary: spec.summary,
                unit: spec.unit.symbol(),
                bounds: [spec.bounds.0, spec.bounds.1],
                initial: spec.initial,
                role: if spec.role == Role::Shape { "shape" } else { "amplitude" },
                sharing: if spec.sharing == Sharing::Shared { "shared" } else { "per channel" },
                fixed_by_default: spec.fixed,
                only_with: (count < all).then(|| present.iter().filter(|c| telling(c)).cloned().collect()),
            }
        })
        .collect();
    ModelRecord {
        name: entry.name,
        summary: entry.summary,
        reference: entry.reference,
        reciprocal: entry.reciprocal,
        cost_ns: basis_cost(entry),
        options,
        parameters,
    }
}

fn list(text: &mut Lines, records: &[ModelRecord]) -> fmt::Result {
    for (index, record) in records.iter().enumerate() {
        if index > 0 {
            writeln!(text)?;
        }
        describe(text, record)?;
    }
    Ok(())
}

fn describe(text: &mut Lines, record: &ModelRecord) -> fmt::Result {
    writeln!(text.as_a(LineRole::Title), "{}: {}", record.name, record.summary)?;
    for OptionRecord { key, summary, values, default } in &record.options {
        writeln!(text, "  {key} = {}  ({summary}; {default} by default)", values.join(" | "))?;
    }
    for p in &record.parameters {
        let unit = if p.unit == "1" { String::new() } else { format!(" {}", p.unit) };
        let fixed =
            if p.fixed_by_default { format!(", fixed at {} unless freed", p.initial) } else { String::new() };
        let only = p.only_with.as_ref().map_or_else(String::new, |c| format!(", with {}", c.join(" or ")));
        let [low, high] = p.bounds.map(range_end);
        writeln!(
            text,
            "  {:<7} {low}..{high}{unit}  {} ({}, {}{fixed}{only})",
            p.name, p.summary, p.role, p.sharing
        )?;
    }
    let BasisCost { value, with_derivatives } = record.cost_ns;
    writeln!(
        text,
        "  {value:.1} ns per evaluation, {with_derivatives:.1} ns with derivatives, in blocks on one thread"
    )?;
    if !record.reciprocal {
        writeln!(text, "  not reciprocal")?;
    }
    writeln!(text, "  {}", record.reference)
}

/// A bound in its shortest readable form.
fn range_end(value: f64) -> String {
    if value != 0.0 && (value.abs() < 1e-3 || value.abs() >= 1e5) {
        format!("{value:e}")
    } else {
        format!("{value}")
    }
}
