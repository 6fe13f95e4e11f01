//! The comparison as a table and as CSV.

use super::{Entry, Tradeoff};
use crate::error::Error;
use crate::lines::{Cell, Lines, Role, free, left, right};
use std::fmt::Write as _;

/// The comparison as a table, ending in a newline.
#[must_use]
pub fn table(found: &Tradeoff) -> String {
    lines(found).to_string()
}

/// The lines of [`table`].
#[must_use]
pub fn lines(found: &Tradeoff) -> Lines {
    Lines::of(|text| write_table(text, found))
}

fn write_table(text: &mut Lines, found: &Tradeoff) -> std::fmt::Result {
    let metric = found.metric.name();
    let data = &found.data;
    writeln!(text.as_a(Role::Title), "{}: {} samples, {}", data.path, data.used, data.channels.join(" "))?;
    let fitted = found.fit_samples.filter(|samples| *samples < data.used);
    let fitted = fitted.map_or_else(|| "all".to_owned(), |samples| samples.to_string());
    writeln!(text, "each model is fitted to {fitted} of them in {metric}; errors are computed on all\n")?;
    let headings = ["cost", "f64", "f32", "blocks", "stored", metric, "held out", "f32 off", "fit"];
    text.row(Role::Heading, 0, model_row("", headings.map(str::to_owned), "model"));
    let units = ["op", "ns", "ns", "ns", "", "", "", "", "s"];
    text.row(Role::Heading, 0, model_row("", units.map(str::to_owned), ""));
    for entry in &found.models {
        let mark = if entry.on_front { "*" } else { "" };
        let ns = &entry.cost.time_ns;
        let unusable = if entry.usable { "" } else { "  (not usable)" };
        let freed: String = entry.free.iter().map(|name| format!("  --free {name}")).collect();
        let numbers = [
            entry.cost.weighted.to_string(),
            format!("{:.1}", ns.scalar_f64.median),
            format!("{:.1}", ns.scalar_f32.median),
            format!("{:.1}", ns.blocks_f64.median),
            entry.parameters.to_string(),
            number(entry.errors.of(found.metric)),
            number(entry.held_out.as_ref().and_then(|errors| errors.of(found.metric))),
            format!("{:.0e}", entry.single_precision),
            format!("{:.2}", entry.fit_s),
        ];
        text.row(Role::Plain, 0, model_row(mark, numbers, &format!("{}{freed}{unusable}", entry.model)));
    }
    writeln!(text, "\n* no model has both a lower cost and a smaller error")?;
    if !found.approximations.is_empty() {
        let row = |[cost, exact, other, unfitted]: [String; 4], name: &str| {
            [right(cost, 9), right(exact, 13), right(other, 11), right(unfitted, 9), free(name)]
        };
        writeln!(text)?;
        let headings = ["cost", metric, "", "unfitted"].map(str::to_owned);
        text.row(Role::Heading, 0, row(headings, "approximation"));
        for a in &found.approximations {
            let [exact, other] = a.weighted;
            let [error, error_of_other] = a.errors;
            let unfitted =
                a.unfitted.map_or_else(|| "-".to_owned(), |distance| format!("{:.2} %", 100.0 * distance));
            let errors = [error, error_of_other].map(|error| number(Some(error)));
            let [error, error_of_other] = errors;
            let cells = [format!("{exact}>{other}"), error, error_of_other, unfitted];
            text.row(Role::Plain, 0, row(cells, a.name));
        }
    }
    if let Some(model) = &found.samples.model {
        writeln!(text)?;
        let heading = [right("samples", 9), right(metric, 13), right("fit, s", 8), free(model)];
        text.row(Role::Heading, 0, heading);
        for fit in &found.samples.fits {
            let (samples, error) = (fit.samples.to_string(), number(Some(fit.error)));
            let fit_s = format!("{:.2}", fit.fit_s);
            text.row(Role::Plain, 0, [right(samples, 9), right(error, 13), right(fit_s, 8)]);
        }
    }
    Ok(())
}

/// The row of a model.
fn model_row(mark: &str, numbers: [String; 9], model: &str) -> impl Iterator<Item = Cell> {
    const WIDTHS: [usize; 9] = [7, 8, 8, 8, 6, 13, 11, 8, 8];
    let numbers = numbers.into_iter().zip(WIDTHS).map(|(number, width)| right(number, width));
    [left(mark, 1)].into_iter().chain(numbers).chain([free(model)])
}

fn number(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.4e}"))
}

/// The models as CSV, one line each.
///
/// # Errors
/// [`Error::Encoding`], which does not occur in practice.
pub fn csv(found: &Tradeoff) -> Result<Vec<u8>, Error> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let failed = |error: &dyn std::fmt::Display| Error::Encoding { format: "CSV", reason: error.to_string() };
    let header = [
        "model",
        "parameters",
        "cost",
        "sums",
        "products",
        "choices",
        "quotients",
        "roots",
        "transcendental",
        "prepared_once",
        "scalar_f64_ns",
        "scalar_f32_ns",
        "blocks_f64_ns",
        "l2",
        "log",
        "cbrt",
        "unbiased_cbrt",
        "log_ratio",
        "relative",
        "held_out_l2",
        "held_out_log",
        "held_out_cbrt",
        "held_out_unbiased_cbrt",
        "held_out_log_ratio",
        "held_out_relative",
        "single_precision",
        "usable",
        "on_front",
        "fit_s",
    ];
    writer.write_record(header).map_err(|e| failed(&e))?;
    for entry in &found.models {
        writer.write_record(record(entry)).map_err(|e| failed(&e))?;
    }
    writer.into_inner().map_err(|e| failed(&e))
}

fn record(entry: &Entry) -> Vec<String> {
    let (o, ns) = (&entry.cost.operations, &entry.cost.time_ns);
    let errors = |errors: Option<&crate::report::ErrorRecord>| {
        let all =
            errors.map_or([None; 6], |e| [e.l2, e.log, e.cbrt, e.unbiased_cbrt, e.log_ratio, e.relative]);
        all.map(|error| error.map_or_else(String::new, |error| error.to_string()))
    };
    let mut cells = vec![entry.model.clone(), entry.parameters.to_string(), entry.cost.weighted.to_string()];
    let counts = [o.sums, o.products, o.choices, o.quotients, o.roots, o.transcendental];
    cells.extend(counts.map(|count| count.to_string()));
    cells.push(entry.cost.prepared_once.to_string());
    cells.extend([ns.scalar_f64, ns.scalar_f32, ns.blocks_f64].map(|spread| spread.median.to_string()));
    cells.extend(errors(Some(&entry.errors)));
    cells.extend(errors(entry.held_out.as_ref()));
    cells.push(entry.single_precision.to_string());
    cells.extend([entry.usable, entry.on_front].map(|flag| flag.to_string()));
    cells.push(entry.fit_s.to_string());
    cells
}
