//! What a page says about one material.

use super::fact::{Fact, known};
use super::figures::{Drawn, Figures, NotDrawn};
use super::model::{Caution, Model};
use crate::error::{Error, OptionName, Place, listed};
use crate::figure::{Subject, letter};
use crate::progress::Progress;
use crate::report::{Named as _, Report, are_told_apart, compared};
use std::path::Path;
use std::sync::Arc;

/// A material: a measurement and its fits, the best first.
#[derive(Debug)]
pub(super) struct Material {
    /// Its anchor in the page.
    pub(super) id: String,
    /// The name of its file without the ending, and that of the material in the file if there is one.
    pub(super) name: String,
    /// What there is to know about the measurement.
    pub(super) facts: Vec<Fact>,
    /// What the reader did with the file, in sentences.
    pub(super) remarks: Vec<String>,
    /// The ball as measured, as fitted by the best model, and the difference, as a link that holds them; `None` if it cannot be shown.
    pub(super) strip: Option<String>,
    /// What orders the models.
    pub(super) order: String,
    /// Whether all models were fitted in one metric.
    pub(super) one_metric: bool,
    pub(super) models: Vec<Model>,
    /// Figures of all models together.
    pub(super) figures: Vec<Drawn>,
    pub(super) not_drawn: Vec<NotDrawn>,
}

/// The fits of each measurement, in the order of their first reports.
pub(super) fn groups(subjects: &[Subject]) -> Result<Vec<Vec<Subject>>, Error> {
    let mut groups: Vec<Vec<Subject>> = Vec::new();
    for subject in subjects {
        let (Some(measurement), Some(_)) = (&subject.measurement, &subject.recorded) else {
            let found = "a measurement or a report alone";
            return Err(Error::malformed(&subject.path, Place::File, "a report and its measurement", found));
        };
        let same = |fits: &&mut Vec<Subject>| {
            let first = fits.first().and_then(|first| first.measurement.as_ref());
            first.is_some_and(|first| Arc::ptr_eq(first, measurement))
        };
        match groups.iter_mut().find(same) {
            Some(fits) => fits.push(subject.clone()),
            None => groups.push(vec![subject.clone()]),
        }
    }
    Ok(groups)
}

impl Material {
    /// The material in this place of the page, counted from 1.
    pub(super) fn new(
        number: usize,
        fits: &[Subject],
        typed: fn(OptionName) -> String,
        progress: &Arc<dyn Progress>,
    ) -> Result<Self, Error> {
        let id = format!("material-{number}");
        let (fits, order) = ranked(fits);
        let Figures { of_all, of_each } = Figures::new(&id, &fits, progress)?;
        let (figures, mut not_drawn) = sorted_out(of_all);
        let reports: Vec<&Report> =
            fits.iter().filter_map(|fit| fit.recorded.as_ref()).map(|recorded| &recorded.report).collect();
        let several = reports.len() > 1;
        let mut models = Vec::new();
        for (k, (report, figures)) in reports.iter().zip(of_each).enumerate() {
            let (figures, without) = sorted_out(figures);
            // What no model allows is said once.
            let new = |other: &NotDrawn| {
                !not_drawn.iter().any(|known| known.kind == other.kind && known.why == other.why)
            };
            let without = without.into_iter().filter(new).collect();
            let warnings = report.warnings.iter().map(|warning| Caution::new(warning, typed)).collect();
            models.push(Model {
                figures,
                not_drawn: without,
                warnings,
                alike: alike(&reports, report),
                ..Model::new(&id, several.then_some(k), report)
            });
        }
        if let ([model], []) = (models.as_mut_slice(), not_drawn.as_slice()) {
            not_drawn.append(&mut model.not_drawn);
        }
        let strip_of = |figures: &[Drawn]| figures.iter().find_map(|figure| figure.strip.clone());
        let strip = strip_of(&figures).or_else(|| models.first().and_then(|model| strip_of(&model.figures)));
        let first = reports.first();
        Ok(Self {
            id,
            name: first.map_or_else(String::new, |report| name(report)),
            facts: first.map_or_else(Vec::new, |report| facts(report)),
            remarks: first.map_or_else(Vec::new, |report| report.data.remarks.clone()),
            strip,
            order,
            one_metric: models
                .iter()
                .all(|model| Some(&model.metric) == models.first().map(|first| &first.metric)),
            models,
            figures,
            not_drawn,
        })
    }

    /// The best model.
    pub(super) fn best(&self) -> Option<&Model> {
        self.models.first()
    }
}

/// The figures that were drawn, and those that were not.
fn sorted_out(all: Vec<Result<Drawn, NotDrawn>>) -> (Vec<Drawn>, Vec<NotDrawn>) {
    let (mut drawn, mut without) = (Vec::new(), Vec::new());
    for figure in all {
        match figure {
            Ok(figure) => drawn.push(figure),
            Err(why) => without.push(why),
        }
    }
    (drawn, without)
}

/// The fits of a material from the best to the worst, and what orders them. Errors in different metrics cannot be compared: such fits
/// stay in the order given.
fn ranked(fits: &[Subject]) -> (Vec<Subject>, String) {
    let reports: Vec<&Report> =
        fits.iter().filter_map(|fit| fit.recorded.as_ref()).map(|recorded| &recorded.report).collect();
    let metric = reports.first().map(|report| report.metric.clone()).unwrap_or_default();
    let Some(known) = metric.known().filter(|_| reports.iter().all(|report| report.metric == metric)) else {
        return (fits.to_vec(), "in the order given, since they were fitted in different metrics".to_owned());
    };
    let (criterion, errors) = compared(&reports);
    let mut order: Vec<(f64, &Subject)> = errors.into_iter().zip(fits).collect();
    order.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    let order: Vec<Subject> = order.into_iter().map(|(_, fit)| fit.clone()).collect();
    (order, format!("from the smallest {} error", criterion(known).in_report()))
}

/// The letters of the models that folds do not tell apart from that of `report`; empty unless all have folds.
fn alike(reports: &[&Report], report: &Report) -> String {
    if !reports.iter().all(|report| report.has_folds()) {
        return String::new();
    }
    let others = reports.iter().enumerate().filter(|(_, other)| !std::ptr::eq(**other, report));
    let alike = others.filter(|(_, other)| !are_told_apart(report, other));
    alike.map(|(k, _)| letter(k)).collect::<Vec<_>>().join(", ")
}

/// The name of a material: that of its file without the ending, and its own if the file holds several.
fn name(report: &Report) -> String {
    let path = Path::new(&report.data.path);
    let stem = path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy();
    match &report.options.material {
        Some(material) => format!("{material} ({stem})"),
        None => stem.into_owned(),
    }
}

/// What there is to know about a measurement. Folders are nobody's business.
fn facts(report: &Report) -> Vec<Fact> {
    let data = &report.data;
    let path = Path::new(&data.path);
    let file = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
    let channels = match (data.wavelengths_nm.as_deref(), data.channels.as_slice()) {
        (Some([first, .., last]), names) => format!("{} wavelengths, {first} to {last} nm", names.len()),
        (_, names) => names.join(", "),
    };
    let left_out: Vec<String> = data.dropped.iter().map(|(reason, n)| format!("{n} {reason}")).collect();
    let missing: Vec<String> =
        data.missing.0.iter().map(|(channel, n)| format!("{n} in {channel}")).collect();
    let facts = [
        ("file", format!("{file} ({})", data.format)),
        ("channels", channels),
        ("samples used", format!("{} of {}", data.used, data.samples)),
        ("left out", listed(&left_out)),
        ("values not measured", listed(&missing)),
        ("read with", report.options.reading.join(", ")),
        ("SHA-256", data.sha256.clone()),
    ];
    known(facts)
}
