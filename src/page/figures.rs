//! The figures of a page.

use crate::error::Error;
use crate::figure::{
    Against, Axes, Body, Drawing, FigureData, KINDS, Kind, Panel, Run, Several, Subject, Text, Wanted, Width,
    runs,
};
use crate::progress::Progress;
use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use rayon::prelude::*;
use std::sync::Arc;

/// A figure of a page.
#[derive(Debug)]
pub(super) struct Drawn {
    /// Name of its kind.
    pub(super) kind: &'static str,
    /// Its drawings as SVG.
    pub(super) drawings: Vec<String>,
    caption: Text,
    /// Its first row of pictures as a link that holds them; `None` unless it is made of pictures.
    pub(super) strip: Option<String>,
}

impl Drawn {
    /// The caption in runs of one style.
    pub(super) fn caption(&self) -> Vec<Run> {
        runs(&self.caption)
    }
}

/// A figure that the data do not allow.
#[derive(Debug)]
pub(super) struct NotDrawn {
    pub(super) kind: &'static str,
    pub(super) why: String,
}

/// A figure to be made.
struct Plan {
    kind: &'static Kind,
    wanted: Wanted,
}

/// The kinds of figures of several models together, and the variants of each.
fn of_several(progress: &Arc<dyn Progress>) -> Vec<Plan> {
    plans(progress, |several| several != Several::Refused, 1)
}

/// The kinds of figures of a single model: all that say something about one, or if the others stand `beside` it, only those that show
/// more than the figures of all.
fn of_one(progress: &Arc<dyn Progress>, beside: bool) -> Vec<Plan> {
    let left_out = |several| several == Several::Needed || (beside && several == Several::Rows);
    plans(progress, |several| !left_out(several), 3)
}

fn plans(
    progress: &Arc<dyn Progress>,
    is_wanted: impl Fn(Several) -> bool,
    most_channels: usize,
) -> Vec<Plan> {
    let mut kinds: Vec<&'static Kind> = KINDS.iter().filter(|kind| is_wanted(kind.several)).collect();
    kinds.sort_by_key(|kind| kind.several);
    let all = kinds.into_iter().flat_map(|kind| {
        let plain = Wanted { most_channels, progress: Arc::clone(progress), ..Wanted::default() };
        // A front has two horizontal axes.
        let by_cost =
            (kind.several == Several::Needed).then(|| Wanted { against: Against::Cost, ..plain.clone() });
        [Some(plain), by_cost].into_iter().flatten().map(move |wanted| Plan { kind, wanted })
    });
    all.collect()
}

/// The figures of one material: those of all models together, which a single model does without, and those of each model.
pub(super) struct Figures {
    pub(super) of_all: Vec<Result<Drawn, NotDrawn>>,
    pub(super) of_each: Vec<Vec<Result<Drawn, NotDrawn>>>,
}

impl Figures {
    /// Makes all figures, whose ids begin with `place`.
    ///
    /// # Errors
    /// Those of a figure that cannot be written.
    pub(super) fn new(place: &str, fits: &[Subject], progress: &Arc<dyn Progress>) -> Result<Self, Error> {
        let together = if fits.len() > 1 { of_several(progress) } else { Vec::new() };
        let mut jobs: Vec<(String, &[Subject], Plan)> = Vec::new();
        let (of_all, mut of_each) = (together.len(), Vec::new());
        jobs.extend(together.into_iter().map(|plan| (place.to_owned(), fits, plan)));
        for (k, fit) in fits.iter().enumerate() {
            let own = of_one(progress, fits.len() > 1);
            of_each.push(own.len());
            jobs.extend(
                own.into_iter().map(|plan| (format!("{place} {k}"), std::slice::from_ref(fit), plan)),
            );
        }
        let drawn = jobs.into_par_iter().enumerate().map(|(number, (place, subjects, plan))| {
            progress.stage(plan.kind.name);
            one(&format!("{place} {number}"), subjects, &plan)
        });
        let drawn: Vec<Vec<Result<Drawn, NotDrawn>>> = drawn.collect::<Result<_, Error>>()?;
        let mut drawn = drawn.into_iter();
        let mut next = |n: usize| drawn.by_ref().take(n).flatten().collect();
        Ok(Self { of_all: next(of_all), of_each: of_each.into_iter().map(next).collect() })
    }
}

/// Makes a figure of a kind, and what else follows from it.
fn one(place: &str, subjects: &[Subject], plan: &Plan) -> Result<Vec<Result<Drawn, NotDrawn>>, Error> {
    let figure = match (plan.kind.compute)(subjects, &plan.wanted) {
        Ok(figure) => figure,
        Err(Error::Encoding { format, reason }) => return Err(Error::Encoding { format, reason }),
        Err(error) => {
            return Ok(vec![Err(NotDrawn {
                kind: plan.kind.name,
                why: error.to_string().trim_end_matches('.').to_owned(),
            })]);
        }
    };
    let mut all = vec![Ok(drawn(place, &figure)?)];
    // Lobes are seen both ways.
    if let ([_], Some(polar)) = (subjects, polar(&figure)) {
        all.push(Ok(drawn(&format!("{place} polar"), &polar)?));
    }
    Ok(all)
}

/// The first panel of a figure of lobes as a polar diagram; `None` for other figures.
fn polar(figure: &FigureData) -> Option<FigureData> {
    let mut panel = figure.panels.first().filter(|_| figure.kind == "lobe")?.clone();
    let Body::Curves(curves) = &mut panel.body else { return None };
    curves.axes = Axes::Polar;
    Some(with_panels(figure, vec![panel]))
}

/// The same figure with other panels.
fn with_panels(figure: &FigureData, panels: Vec<Panel>) -> FigureData {
    let FigureData { kind, caption, side_by_side, .. } = figure;
    FigureData { kind, panels, caption: caption.clone(), side_by_side: *side_by_side }
}

/// Draws a figure. Panels that would stand one below the other are drawn one by one, so that a wide page sets them side by side.
fn drawn(place: &str, figure: &FigureData) -> Result<Drawn, Error> {
    let [columns, _] = figure.side_by_side;
    let parts: Vec<FigureData> = if columns == 1 {
        let panels = figure.panels.iter().enumerate();
        panels.map(|(k, panel)| with_panels(figure, vec![with_legend(panel, k == 0)])).collect()
    } else {
        vec![figure.clone()]
    };
    let draw = |(k, part): (usize, &FigureData)| {
        part.svg(Drawing { width: Width::One, caption: false, place: &format!("{place} {k}") })
    };
    let drawings = parts.iter().enumerate().map(draw).collect::<Result<_, Error>>()?;
    let pictures = figure.panels.iter().all(|panel| matches!(panel.body, Body::Picture(_)));
    let first_row = || with_panels(figure, figure.panels.iter().take(columns.max(1)).cloned().collect());
    let strip = pictures.then(|| first_row().png()).transpose()?.map(|png| data_link(&png));
    Ok(Drawn { kind: figure.kind, drawings, caption: figure.caption.clone(), strip })
}

/// A panel with its part of the legend, or without it.
fn with_legend(panel: &Panel, shown: bool) -> Panel {
    let mut panel = panel.clone();
    if let Body::Curves(curves) = &mut panel.body {
        curves.series.iter_mut().for_each(|series| series.in_legend &= shown);
    }
    panel
}

/// A PNG as a link that holds it.
fn data_link(png: &[u8]) -> String {
    format!("data:image/png;base64,{}", BASE64_STANDARD.encode(png))
}
