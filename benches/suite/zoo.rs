//! What a fit of every model takes, beside what its evaluation does.

use super::inputs::ONE_LOBE;
use super::timing::as_f64;
use super::{Setup, course, evaluation, inputs, markdown};
use brdfit::geometry::BLOCK;
use brdfit::model::{AnyModel, BasisBlock, Derivatives, Expression, REGISTRY, Role, Sharing};

/// How much more than its evaluation implies a model's fit should take at most.
const LIMIT: f64 = 10.0;

/// Every model and each choice that differs from its default in one option, fitted to a full table in every channel.
pub fn table(setup: &Setup) -> String {
    let measurement = inputs::load(setup.inputs.table());
    let directions = inputs::directions(evaluation::BLOCKS * BLOCK);
    let blocks = evaluation::blocks(&directions);
    let nanoseconds = |model: &AnyModel| {
        let (shapes, _) = evaluation::values(model);
        let mut basis = BasisBlock::default();
        let work = || evaluation::evaluate(model, &blocks, &shapes, Derivatives::All, &mut basis);
        setup.effort.nanoseconds(work) / as_f64(blocks.len() * BLOCK)
    };
    let yardstick = Expression::parse(ONE_LOBE).unwrap();
    let lobe = &yardstick.lobes().last().unwrap().model;
    let (once, least) = (nanoseconds(lobe), course::typical(&measurement, &yardstick).whole());

    let entries = if setup.quick() { &REGISTRY[..3] } else { REGISTRY };
    let mut worst = (0.0, String::new());
    let mut rows = Vec::new();
    for (model, text) in entries.iter().flat_map(evaluation::variants) {
        let text = if has_base(&model) { text } else { format!("lambert + {text}") };
        let course = course::typical(&measurement, &Expression::parse(&text).unwrap());
        // A model whose shapes differ from channel to channel is evaluated for each.
        let apart =
            model.parameters().iter().any(|p| p.role == Role::Shape && p.sharing == Sharing::PerChannel);
        let times = if apart { measurement.channels.len() } else { 1 };
        let evaluation = nanoseconds(&model) * as_f64(times);
        let implied = (evaluation / once).max(1.0);
        let quotient = course.whole() / least / implied;
        if quotient > worst.0 {
            worst = (quotient, text.clone());
        }
        rows.push(vec![
            format!("`{text}`"),
            format!("{evaluation:.1}"),
            format!("{:.2}", course.whole()),
            course.passes.to_string(),
            format!("{:.1}", course.whole() / least),
            format!("{quotient:.1}"),
        ]);
    }
    let head = [
        "model",
        "ns per sample",
        "fit s",
        "passes",
        "fit, to the yardstick",
        "to what its evaluation implies",
    ];
    let (quotient, text) = worst;
    let verdict = if quotient <= LIMIT { "below" } else { "above" };
    format!(
        "{}, `cbrt`. Yardstick: `{ONE_LOBE}`, {once:.1} ns, {least:.2} s. Largest quotient: {quotient:.1} (`{text}`), {verdict} the limit of {LIMIT}.\n\n{}",
        inputs::name(setup.inputs.table()),
        markdown(&head, &rows)
    )
}

/// Whether a model has a diffuse term of its own.
fn has_base(model: &AnyModel) -> bool {
    const STRENGTHS: [&str; 8] =
        ["kd", "rd", "albedo", "albedo_prime", "base", "base_color", "k_over_s", "kx"];
    model.parameters().iter().any(|spec| STRENGTHS.contains(&spec.name))
}
