//! The result as a table.

use super::{Selected, Tried};
use crate::lines::{Lines, Role, free, left, right};
use std::fmt::Write as _;

/// The result as a table, ending in a newline.
#[must_use]
pub fn table(found: &Selected) -> String {
    lines(found).to_string()
}

/// The lines of [`table`].
#[must_use]
pub fn lines(found: &Selected) -> Lines {
    Lines::of(|text| write_table(text, found))
}

fn write_table(text: &mut Lines, found: &Selected) -> std::fmt::Result {
    let (data, scene) = (&found.data, &found.scene);
    writeln!(text.as_a(Role::Title), "{} in {}", data.path, scene.path)?;
    writeln!(
        text,
        "{} x {} pixels, {} compared of {} that see the surface; {} pairs of directions; {:.1} % of the light comes \
         along measured ones",
        scene.width,
        scene.height,
        scene.compared_pixels,
        scene.object_pixels,
        scene.pairs,
        100.0 * scene.covered_light
    )?;
    if let Some(left_out) = &data.left_out {
        writeln!(
            text,
            "leaving samples out and interpolating them: median error {:.1} %",
            100.0 * left_out.median
        )?;
    }
    writeln!(
        text,
        "the scene never shows {:.0} % of the cells of theta_h and theta_d, nor {:.0} % of the samples\n",
        100.0 * found.seen.cells_never_seen(),
        100.0 * found.seen.samples_never_seen
    )?;
    let row = |mark, cost: String, precision, numbers: [String; 4], model: String| {
        let named = [left(mark, 1), right(cost, 6), right(precision, 5)];
        named.into_iter().chain(numbers.map(|number| right(number, 9))).chain([free(model)])
    };
    let headings = ["dE00 p95", "finer", "rel. RMSE", "PSNR, dB"].map(str::to_owned);
    text.row(Role::Heading, 0, row("", "cost".to_owned(), "", headings, "model".to_owned()));
    for (index, tried) in found.tried.iter().enumerate() {
        // Both precisions usually give the same numbers; they then share one line.
        let is_twin = |other: &&Tried| other.model == tried.model && other.precision != tried.precision;
        let twin = found.tried.iter().find(is_twin).filter(|other| numbers(other) == numbers(tried));
        if twin.is_some() && tried.precision == "f64" && found.answer != Some(index) {
            continue;
        }
        let precision = if twin.is_some() { "both" } else { tried.precision };
        let mark = if found.answer == Some(index) { "*" } else { "" };
        text.row(Role::Plain, 0, row(mark, tried.cost.to_string(), precision, numbers(tried), name(tried)));
    }
    let tried = |index: Option<usize>| index.map(|index| &found.tried[index]);
    let shown = found.shown();
    let (model, precision, p95) = (name(shown), shown.precision, shown.p95());
    writeln!(text)?;
    match found.answer {
        Some(_) => writeln!(
            text.as_a(Role::Good),
            "the scene needs {model} in {precision}: 95 % of the pixels within {p95:.3} of the measured ones (CIEDE2000; \
             tolerance {})",
            found.tolerance
        )?,
        None => writeln!(
            text.as_a(Role::Bad),
            "no model is within the tolerance of {}; the nearest is {model} in {precision}: 95 % of the pixels within \
             {p95:.3} of the measured ones (CIEDE2000)",
            found.tolerance
        )?,
    }
    for p in &shown.parameters {
        let unit = if p.unit == "1" { String::new() } else { format!(" {}", p.unit) };
        text.row(Role::Plain, 2, [left(&*p.name, 28), left(format!("{}{unit}", p.value), 0)]);
    }
    if let Some(cheaper) = tried(found.next_cheaper) {
        let by = cheaper.p95() - found.tolerance;
        let how = if by > 0.0 { format!("fails by {by:.3}") } else { "has no usable fit".to_owned() };
        writeln!(text, "the next cheaper, {} in {}, {how}", name(cheaper), cheaper.precision)?;
    }
    Ok(())
}

/// The four numbers of a line: CIEDE2000, the same in finer light, relative RMSE and PSNR.
fn numbers(tried: &Tried) -> [String; 4] {
    let differences = &tried.differences;
    let or_dash = |text: Option<String>| text.unwrap_or_else(|| "-".to_owned());
    [
        format!("{:.3}", differences.delta_e_2000.p95),
        or_dash(tried.finer_light.map(|finer| format!("{:.3}", finer.delta_e_2000.p95))),
        or_dash(differences.relative_rmse.map(|rmse| format!("{rmse:.4}"))),
        or_dash(differences.psnr_db.map(|psnr| format!("{psnr:.1}"))),
    ]
}

/// A model by name, with what was freed and whether its fit is usable.
#[must_use]
pub fn name(tried: &Tried) -> String {
    let free: String = tried.free.iter().map(|name| format!(" --free {name}")).collect();
    let unusable = if tried.usable { "" } else { " (not usable)" };
    format!("{}{free}{unusable}", tried.model)
}
