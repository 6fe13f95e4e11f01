//! What a kind of figure is, and what it is made from.

use super::data::{Axes, FigureData, Scale};
use crate::error::{Error, NameKind, Place};
use crate::fit::Options;
use crate::measurement::{Channel, Measurement};
use crate::model::LobeValues;
use crate::progress::{Progress, Quiet};
use crate::report::Recorded;
use crate::scene::Scene;
use std::path::PathBuf;
use std::sync::Arc;

/// A kind of figure.
#[derive(Clone, Copy, Debug)]
pub struct Kind {
    /// Name on the command line.
    pub name: &'static str,
    /// What it shows, in a few words.
    pub summary: &'static str,
    /// What it is made from.
    pub needs: Needs,
    /// What it does with several models.
    pub several: Several,
    /// Whether it can also be a PNG of its panels.
    pub raster: bool,
    /// Computes the figure.
    pub compute: fn(&[Subject], &Wanted) -> Result<FigureData, Error>,
}

/// What a kind of figure is made from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Needs {
    /// A measurement, and a model beside it if there is a report.
    Measurement,
    /// A report and its measurement.
    Both,
    /// A report.
    Report,
}

/// What a kind of figure does with several models.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Several {
    /// Each has panels of its own.
    Rows,
    /// It is made to compare them, and says little about one.
    Needed,
    /// They share panels; of a single one, more is shown.
    Overlaid,
    /// It shows one model only.
    Refused,
}

/// What a figure is about: a measurement, a fit, or both.
#[derive(Clone, Debug)]
pub struct Subject {
    /// The file, for messages.
    pub path: PathBuf,
    /// The model and the report; `None` for a measurement alone.
    pub recorded: Option<Recorded>,
    /// The measurement; `None` where a figure needs none.
    pub measurement: Option<Arc<Measurement>>,
    /// Options of the fit: the metric, and which samples are compared.
    pub options: Options,
}

/// What the user wants of a figure.
#[derive(Clone)]
pub struct Wanted {
    /// The largest number of channels that have a panel of their own, unless `channels` names them.
    pub most_channels: usize,
    /// The channels to show; empty for a choice among them.
    pub channels: Vec<String>,
    /// The axes of a lobe; `None` for right angles.
    pub axes: Option<Axes>,
    /// The scale of f or of the error; `None` for the one that suits the data.
    pub scale: Option<Scale>,
    /// Angles of incidence in degrees; empty for a choice among those measured.
    pub theta_i_deg: Vec<f64>,
    /// What a front shows the error against.
    pub against: Against,
    /// The scene of the spheres; `None` for a ball between three softboxes.
    pub scene: Option<Scene>,
    /// Who is told about the progress of refits.
    pub progress: Arc<dyn Progress>,
}

/// What a front shows the error against.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Against {
    /// The number of parameters to store.
    #[default]
    Parameters,
    /// The operations of an evaluation.
    Cost,
}

impl Default for Wanted {
    fn default() -> Self {
        Self {
            most_channels: 3,
            channels: Vec::new(),
            axes: None,
            scale: None,
            theta_i_deg: Vec::new(),
            against: Against::default(),
            scene: None,
            progress: Arc::new(Quiet),
        }
    }
}

impl Subject {
    /// The measurement, which the kind of figure needs.
    pub(super) fn measured(&self) -> Result<&Measurement, Error> {
        self.measurement.as_deref().ok_or_else(|| self.lacks("a measurement"))
    }

    /// The model and the report, which the kind of figure needs.
    pub(super) fn fitted(&self) -> Result<&Recorded, Error> {
        self.recorded.as_ref().ok_or_else(|| self.lacks("a report of brdfit"))
    }

    fn lacks(&self, expected: &str) -> Error {
        let found = if self.recorded.is_some() { "a report alone" } else { "a measurement alone" };
        Error::malformed(&self.path, Place::File, expected, found)
    }

    /// The channels of the measurement or, without one, of the report.
    pub(super) fn channels(&self) -> Vec<Channel> {
        match (&self.measurement, &self.recorded) {
            (Some(measurement), _) => measurement.channels.clone(),
            (None, Some(recorded)) => {
                recorded.table.channels().iter().map(|name| Channel::named(name)).collect()
            }
            (None, None) => Vec::new(),
        }
    }

    /// The values of the model by channel and lobe, in formula units, in the channels of the measurement.
    pub(super) fn values(&self) -> Result<Vec<Vec<LobeValues>>, Error> {
        let names: Vec<String> = self.channels().into_iter().map(|channel| channel.name).collect();
        self.fitted()?.values_in(&names, &self.path)
    }

    /// The last part of the path of the data, without its ending.
    pub(super) fn stem(&self) -> String {
        let path = match (&self.measurement, &self.recorded) {
            (Some(measurement), _) => measurement.source.path.clone(),
            (None, Some(recorded)) => PathBuf::from(&recorded.report.data.path),
            (None, None) => self.path.clone(),
        };
        path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
    }
}

/// The only subject of a kind that takes one.
pub(super) fn only<'a>(subjects: &'a [Subject], kind: &str) -> Result<&'a Subject, Error> {
    match subjects {
        [only] => Ok(only),
        several => {
            let found = format!("{} reports or measurements", several.len());
            Err(Error::invalid(kind.to_owned(), "one report or measurement", found))
        }
    }
}

/// The first of the subjects of a kind that compares models of one measurement.
pub(super) fn of_one_measurement<'a>(
    subjects: &'a [Subject],
    kind: &'static str,
) -> Result<&'a Subject, Error> {
    let Some(first) = subjects.first() else {
        return Err(Error::invalid(kind, "a report or a measurement", "none"));
    };
    match subjects.iter().find(|other| !same_measurement(first, other)) {
        Some(other) => {
            let found = format!("{} and {}", first.stem(), other.stem());
            Err(Error::invalid(kind, "one measurement, or reports of one", found))
        }
        None => Ok(first),
    }
}

/// A fit, and the values of its model by channel and lobe.
pub(super) type Fitted<'a> = (&'a Recorded, Vec<Vec<LobeValues>>);

/// The fits among some subjects.
pub(super) fn fits(subjects: &[Subject]) -> Result<Vec<Fitted<'_>>, Error> {
    let fitted = subjects.iter().filter_map(|subject| Some((subject.recorded.as_ref()?, subject)));
    fitted.map(|(recorded, subject)| Ok((recorded, subject.values()?))).collect()
}

/// Whether two subjects show the same measurement, read in the same way.
pub(super) fn same_measurement(a: &Subject, b: &Subject) -> bool {
    fn bits(rows: &[Vec<f64>]) -> impl Iterator<Item = u64> {
        rows.iter().flatten().map(|f| f.to_bits())
    }
    match (&a.measurement, &b.measurement) {
        (Some(a), Some(b)) => {
            let same_file = a.source.sha256 == b.source.sha256 && a.channels == b.channels;
            Arc::ptr_eq(a, b) || (same_file && bits(&a.values).eq(bits(&b.values)))
        }
        _ => false,
    }
}

/// The letter of a model among several, counted from 0: A to Z, then A again.
#[must_use]
pub fn letter(k: usize) -> String {
    let letter = u32::try_from(k % 26).ok().and_then(|k| char::from_u32(u32::from('A') + k));
    letter.map(String::from).unwrap_or_default()
}

/// What panels and captions add to a word to say which of several models it is about; empty for a single one.
pub(super) fn which(models: usize, k: usize) -> String {
    if models > 1 { format!(" {}", letter(k)) } else { String::new() }
}

/// Names that tell subjects apart: by their models, or else by their data, or by both, or by their files.
pub(super) fn names(subjects: &[Subject]) -> Vec<String> {
    let model = |s: &Subject| s.recorded.as_ref().map_or("measured".to_owned(), |r| r.expression.canonical());
    let data = |s: &Subject| s.stem();
    let both = |s: &Subject| format!("{}: {}", s.stem(), model(s));
    let file = |s: &Subject| s.path.display().to_string();
    let ways: [&dyn Fn(&Subject) -> String; 4] = [&model, &data, &both, &file];
    let all_differ = |names: &Vec<String>| {
        names.iter().enumerate().all(|(k, name)| !names.iter().take(k).any(|n| n == name))
    };
    let mut tried = ways.iter().map(|way| subjects.iter().map(way).collect::<Vec<String>>());
    let last = || subjects.iter().map(file).collect();
    tried.find(all_differ).unwrap_or_else(last)
}

/// The indices of the channels to show: those that the user names, or at most as many as are wanted: green alone, red, green and blue,
/// the wavelengths nearest to 450, 550 and 650 nm, or channels spread evenly.
pub(super) fn chosen_channels(channels: &[Channel], wanted: &Wanted) -> Result<Vec<usize>, Error> {
    let names: Vec<&str> = channels.iter().map(|channel| channel.name.as_str()).collect();
    if !wanted.channels.is_empty() {
        let place = |name: &String| {
            let found = names.iter().position(|known| known.eq_ignore_ascii_case(name));
            found.ok_or_else(|| Error::unknown("--channel", NameKind::Channel, &names, name))
        };
        return wanted.channels.iter().map(place).collect();
    }
    let most = wanted.most_channels.max(1);
    if channels.len() <= most {
        return Ok((0..channels.len()).collect());
    }
    if let (1, Some(green)) =
        (most, names.iter().position(|name| ["g", "green"].contains(&name.to_ascii_lowercase().as_str())))
    {
        return Ok(vec![green]);
    }
    let wavelengths: Option<Vec<f64>> = channels.iter().map(|channel| channel.wavelength_nm).collect();
    let visible = wavelengths.filter(|all| all.iter().any(|nm| (380.0..=780.0).contains(nm)));
    let mut found: Vec<usize> = match (visible, most) {
        (Some(all), _) => {
            let targets: &[f64] = if most < 3 { &[550.0] } else { &[450.0, 550.0, 650.0] };
            let distance = |nm: &f64, target: f64| (nm - target).abs();
            let nearest = |target: &f64| {
                let numbered = all.iter().enumerate();
                numbered.min_by(|(_, a), (_, b)| distance(a, *target).total_cmp(&distance(b, *target)))
            };
            targets.iter().filter_map(nearest).map(|(index, _)| index).collect()
        }
        (None, 1) => vec![channels.len() / 2],
        (None, most) => (0..most).map(|k| k * (channels.len() - 1) / (most - 1)).collect(),
    };
    found.sort_unstable();
    found.dedup();
    Ok(found)
}

/// A channel as a figure names it: its wavelength, or its name.
pub(super) fn channel_title(channel: &Channel) -> String {
    match channel.wavelength_nm {
        Some(nm) if nm >= 2000.0 => format!("{} \u{b5}m", nm / 1000.0),
        Some(nm) => format!("{nm} nm"),
        None => channel.name.clone(),
    }
}

/// The sentence of a caption that says which channels are shown; empty if all are.
pub(super) fn channels_shown(channels: &[Channel], chosen: &[usize]) -> String {
    if chosen.len() == channels.len() {
        return String::new();
    }
    let titles: Vec<String> = chosen.iter().filter_map(|k| channels.get(*k)).map(channel_title).collect();
    format!(" Shown: {} of {} channels ({}).", chosen.len(), channels.len(), titles.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chosen(names: &[&str], most: usize) -> Vec<usize> {
        let channels: Vec<Channel> = names.iter().map(|name| Channel::named(name)).collect();
        chosen_channels(&channels, &Wanted { most_channels: most, ..Wanted::default() }).unwrap()
    }

    #[test]
    fn a_few_channels_stand_for_many() {
        assert_eq!(chosen(&["r", "g", "b"], 1), [1]);
        assert_eq!(chosen(&["r", "g", "b"], 3), [0, 1, 2]);
        let names: Vec<String> = (0..31).map(|k| (400 + 10 * k).to_string()).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        assert_eq!(chosen(&names, 3), [5, 15, 25]);
        assert_eq!(chosen(&names, 1), [15]);
        assert_eq!(chosen(&["2000", "3000", "4000", "5000", "5700"], 3), [0, 2, 4]);
        assert_eq!(chosen(&["a", "b", "c", "d"], 1), [2]);
        let unknown = Wanted { channels: vec!["x".to_owned()], ..Wanted::default() };
        assert!(chosen_channels(&[Channel::named("r")], &unknown).is_err());
    }
}
