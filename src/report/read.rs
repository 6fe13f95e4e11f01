//! Reads reports back: the model and its parameters.

#![warn(clippy::indexing_slicing, reason = "bytes from outside are never indexed unchecked")]

use super::open::ParameterStatus;
use super::record::{Report, Reports, SCHEMA, SCHEMA_SEVERAL};
use crate::error::{Error, NameKind, Place, excerpt, short};
use crate::geometry::Azimuths;
use crate::model::{Expression, LobeValues, STRENGTH, Sharing};
use crate::parameters::{
    ParameterRow, ParameterTable, Selector, Setting, Settings, Status, applies, channel_suffix,
};
use serde::Deserialize;
use std::path::Path;

/// A model read from a report.
#[derive(Clone, Debug)]
pub struct Recorded {
    /// The model.
    pub expression: Expression,
    /// Its parameters, at the values in the report.
    pub table: ParameterTable,
    /// The report itself.
    pub report: Report,
    /// Which parameters have a value of their own per channel, or one for all, unlike their default.
    sharing: Settings,
}

/// What is kept of a row of the parameter table.
struct Kept {
    bounds: bool,
    value: bool,
}

impl Recorded {
    /// The model of a report that was not read from a file.
    ///
    /// # Errors
    /// [`Error::Malformed`] if the report does not match its model.
    pub fn of(report: Report) -> Result<Self, Error> {
        recorded(report, Path::new("report"))
    }

    /// The values of the model by channel and lobe, in formula units, for `channels` in their order. An error calls the report `path`.
    ///
    /// # Errors
    /// [`Error::Malformed`] if the report lacks one of the channels.
    pub fn values_in(&self, channels: &[String], path: &Path) -> Result<Vec<Vec<LobeValues>>, Error> {
        let known = self.table.channels();
        let place = |name: &String| {
            known.iter().position(|other| other == name).ok_or_else(|| {
                let expected = format!("a report with the channel {name} of the measurement");
                Error::malformed(path, Place::File, expected, known.join(", "))
            })
        };
        channels.iter().map(|name| Ok(self.table.formula_values(place(name)?))).collect()
    }

    /// The same model with other values and bounds of some parameters, by settings of the kinds `Set` and `Bounds`.
    ///
    /// # Errors
    /// Those of [`ParameterTable::new`], such as [`Error::Invalid`] for a value outside its bounds.
    pub fn with(self, settings: &Settings) -> Result<Self, Error> {
        let (mut bounded, mut set) = (Vec::new(), Vec::new());
        for (selector, setting) in settings {
            let changed = if matches!(setting, Setting::Bounds(..)) { &mut bounded } else { &mut set };
            changed.extend(self.table.rows_named(selector)?.into_iter().map(|(row, _)| row));
        }
        let own =
            self.constraints(|row| Kept { bounds: !bounded.contains(&row), value: !set.contains(&row) })?;
        let all = [own, settings.clone()].concat();
        let table = ParameterTable::new(&self.expression, self.table.channels(), Azimuths::Several, &all)?;
        Ok(Self { table, ..self })
    }

    /// The constraints that give the model these values for a measurement with these channels.
    ///
    /// # Errors
    /// [`Error::UnknownName`] for a channel that the report does not have.
    pub fn settings(&self, channels: &[String]) -> Result<Settings, Error> {
        let known = self.table.channels();
        if let Some(other) = channels.iter().find(|channel| !known.contains(channel)) {
            return Err(Error::unknown("the channels of the measurement", NameKind::Channel, known, other));
        }
        let plain = ParameterTable::new(&self.expression, known, Azimuths::Several, &self.sharing)?;
        self.constraints(|index| {
            let row = self.table.rows().get(index);
            let own = row.and_then(|row| self.table.channel_name(row));
            let here = own.is_none_or(|own| channels.iter().any(|channel| channel == own));
            let default = plain.rows().get(index).map(|row| row.bounds);
            Kept { bounds: here && row.map(|row| row.bounds) != default, value: here }
        })
    }

    /// The constraints that give the model what is kept of its bounds and values, by row.
    fn constraints(&self, kept: impl Fn(usize) -> Kept) -> Result<Settings, Error> {
        let mut settings = self.sharing.clone();
        for (index, row) in self.table.rows().iter().enumerate() {
            let selector = Selector::parse(&self.table.name(index))?;
            let Kept { bounds, value } = kept(index);
            if bounds {
                settings.push((selector.clone(), Setting::Bounds(row.bounds.0, row.bounds.1)));
            }
            if value {
                settings.push((selector, Setting::Set(row.value)));
            }
        }
        Ok(settings)
    }

    /// Starts for a fit of `expression` under `settings`: the fitted values of all parameters that both have and that the fit
    /// moves, unless `settings` say something about their values. A value beyond the bounds of the fit starts at the bound.
    ///
    /// # Errors
    /// Those of [`ParameterTable::new`].
    pub fn starts(&self, expression: &Expression, settings: &Settings) -> Result<Settings, Error> {
        let mut channels = self.table.channels().to_vec();
        for name in settings.iter().filter_map(|(selector, _)| selector.channel_if_any()) {
            if !channels.contains(&name) {
                channels.push(name);
            }
        }
        // Constraints on parameters that the fit does not have are its own to refuse.
        let own: Settings = settings.iter().filter(|setting| applies(expression, setting)).cloned().collect();
        let target = ParameterTable::new(expression, &channels, Azimuths::Several, &own)?;
        let is_absent = |lobe: &str| {
            let mut parameters = self.report.parameters.iter();
            parameters.any(|p| p.lobe == lobe && p.status == ParameterStatus::Absent)
        };
        let mut starts = Settings::new();
        for (index, row) in self.table.rows().iter().enumerate() {
            // The parameters of an absent lobe mean nothing, and what was fixed was not found by a fit.
            if row.status != Status::Free || is_absent(self.table.lobe_name(row)) {
                continue;
            }
            let selector = Selector::parse(&self.table.name(index))?;
            let Ok(rows) = target.rows_named(&selector) else { continue };
            let moved = |row: &ParameterRow| row.status == Status::Free && !row.given;
            if let Some((low, high)) = rows.first().map(|(_, row)| row.bounds)
                && rows.iter().all(|(_, row)| moved(row))
            {
                starts.push((selector, Setting::Init(row.value.clamp(low, high))));
            }
        }
        Ok(starts)
    }
}

/// The fields that say which form a file has.
#[derive(Deserialize)]
struct Form {
    schema: Option<String>,
    /// The materials of a glTF file.
    #[serde(default)]
    materials: Vec<Material>,
}

/// A material of a glTF file, which holds a report if `brdfit export` wrote it.
#[derive(Deserialize)]
struct Material {
    #[serde(default)]
    extras: Extras,
}

/// What a file of `brdfit export` holds besides the material.
#[derive(Default, Deserialize)]
#[serde(default)]
struct Extras {
    brdfit: Exported,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Exported {
    report: Option<Report>,
}

/// Whether a file's first bytes are those of a report rather than a measurement: no measurement format begins with a
/// brace.
#[must_use]
pub fn is_report(head: &[u8]) -> bool {
    let head = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head);
    head.iter().find(|byte| !byte.is_ascii_whitespace()) == Some(&b'{')
}

/// Reads the models from the content `bytes` of a file with one report or several, the best of the ranking first.
/// Errors call the file `path`.
///
/// # Errors
/// [`Error::Malformed`] if the content is not a report, or if a report does not match its model.
pub fn read(bytes: &[u8], path: &Path) -> Result<Vec<Recorded>, Error> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let expected = format!("a report ({SCHEMA} or {SCHEMA_SEVERAL})");
    let Form { schema, materials } = parse(bytes, path, &expected)?;
    let found = match schema.as_deref() {
        None => {
            let reports = materials.into_iter().filter_map(|material| material.extras.brdfit.report);
            let found: Vec<Report> = reports.collect();
            if found.is_empty() {
                let nothing = "a fault: missing field `schema`, and no material that brdfit export wrote";
                return Err(Error::malformed(path, Place::Line(1), expected, nothing));
            }
            found
        }
        Some(SCHEMA) => vec![parse::<Report>(bytes, path, &expected)?],
        Some(SCHEMA_SEVERAL) => {
            let Reports { mut reports, ranking, .. } = parse(bytes, path, &expected)?;
            if let Some(best) = ranking.first().map(|rank| rank.index).filter(|best| *best < reports.len()) {
                reports.swap(0, best);
            }
            reports
        }
        Some(other) => {
            let found = format!("schema {}", excerpt(other));
            return Err(Error::malformed(path, Place::File, expected, found));
        }
    };
    if found.is_empty() {
        return Err(Error::malformed(path, Place::File, "at least one report", "none"));
    }
    found.into_iter().map(|report| recorded(report, path)).collect()
}

fn parse<'a, T: Deserialize<'a>>(bytes: &'a [u8], path: &Path, expected: &str) -> Result<T, Error> {
    serde_json::from_slice(bytes).map_err(|error| {
        let line = u64::try_from(error.line()).unwrap_or(u64::MAX);
        let text = error.to_string();
        let text = text.rsplit_once(" at line ").map_or(text.as_str(), |(text, _)| text);
        // Names of types mean nothing to someone who reads the message.
        let text = match text.rsplit_once(", expected ") {
            Some((found, "f64")) => format!("{}, expected a number", short(found)),
            Some((found, wanted)) if wanted.starts_with("struct ") => {
                format!("{}, expected an object", short(found))
            }
            Some((found, wanted)) => format!("{}, expected {}", short(found), short(wanted)),
            None => short(text),
        };
        Error::malformed(path, Place::Line(line), expected, format!("a fault: {text}"))
    })
}

/// Builds the model, and checks that each of its parameters has a value within its bounds.
fn recorded(report: Report, path: &Path) -> Result<Recorded, Error> {
    let wrong = |expected: String, found: String| Error::malformed(path, Place::File, expected, found);
    let in_file = |error: Error| wrong("a model with its parameters".to_owned(), error.to_string());
    let channels = report.data.channels.clone();
    if channels.is_empty() {
        return Err(wrong("at least one name in data.channels".to_owned(), "none".to_owned()));
    }
    if let Some(name) = channels.iter().find(|name| name.contains(char::is_control)) {
        return Err(wrong("names without control characters in data.channels".to_owned(), excerpt(name)));
    }
    let expression = Expression::parse(&report.model).map_err(in_file)?;
    let mut sharing: Settings = Vec::new();
    let mut values: Settings = Vec::new();
    for p in &report.parameters {
        let own = |text: String| Selector::parse(&text).map_err(in_file);
        let shared = own(format!("{}.{}", p.lobe, p.name))?;
        // Whether the fit shared the parameter is visible from whether it names a channel.
        let lobe = expression.lobes().iter().find(|lobe| lobe.name == p.lobe);
        let specs = lobe.map(|lobe| lobe.parameters()).unwrap_or_default();
        let Some(spec) = specs.iter().find(|spec| spec.name == p.name) else {
            let found = format!("parameter {}", excerpt(&format!("{}.{}", p.lobe, p.name)));
            return Err(wrong(format!("parameters of {}", short(&report.model)), found));
        };
        let setting = match (&p.channel, spec.sharing) {
            (Some(_), Sharing::Shared) => Some(Setting::PerChannel),
            (None, Sharing::PerChannel) => Some(Setting::Shared),
            _ => None,
        };
        sharing.extend(setting.map(|setting| (shared.clone(), setting)));
        let selector = match &p.channel {
            None => shared,
            Some(channel) => own(format!("{}.{}[{channel}]", p.lobe, p.name))?,
        };
        let [low, high] = p.bounds;
        values.push((selector.clone(), Setting::Bounds(low, high)));
        values.push((selector, Setting::Set(p.value)));
    }
    let settings = [sharing.clone(), values].concat();
    let table = ParameterTable::new(&expression, &channels, Azimuths::Several, &settings).map_err(in_file)?;
    // Reports from before lobes of a sum had a strength do not hold it; it was 1.
    let missing = |row: &ParameterRow| !row.given && row.spec.name != STRENGTH;
    if let Some((index, row)) = table.rows().iter().enumerate().find(|(_, row)| missing(row)) {
        let channel = row.channel.and_then(|channel| channels.get(channel));
        let suffix = channel.map_or_else(String::new, |channel| channel_suffix(channel));
        let name = table.name(index);
        let name = if name.ends_with(&suffix) { name } else { name + &suffix };
        return Err(wrong(
            format!("a value of every parameter of {}", short(&report.model)),
            format!("none of {}", short(&name)),
        ));
    }
    Ok(Recorded { expression, table, report, sharing })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::LobeValues;
    use serde_json::{Value, json};

    fn report() -> Value {
        let parameter = |lobe: &str, name: &str, channel: Value, value: f64, bounds: [f64; 2]| json!({"lobe": lobe, "name": name, "channel": channel, "value": value, "bounds": bounds, "unit": "1"});
        json!({
            "schema": "brdfit.report/1",
            "model": "lambert + phong",
            "data": {"path": "a.csv", "channels": ["r", "700"]},
            "parameters": [
                parameter("lambert", "kd", json!("r"), 0.5, [0.0, 2.0]),
                parameter("lambert", "kd", json!("700"), 0.25, [0.0, 2.0]),
                parameter("phong", "ks", Value::Null, 0.125, [0.0, 1000.0]),
                parameter("phong", "n", Value::Null, 20.0, [0.01, 1e6]),
            ],
        })
    }

    fn read_value(value: &Value) -> Result<Vec<Recorded>, Error> {
        read(value.to_string().as_bytes(), Path::new("x.json"))
    }

    #[test]
    fn values_and_sharing_come_back() {
        let recorded = read_value(&report()).unwrap().remove(0);
        assert_eq!(recorded.expression.canonical(), "lambert + phong");
        let values_in = |channel| recorded.table.formula_values(channel);
        let values =
            |shapes: &[f64], amplitude| LobeValues { shapes: shapes.to_vec(), amplitudes: vec![amplitude] };
        assert_eq!(values_in(0), [values(&[], 0.5), values(&[20.0], 0.125)]);
        assert_eq!(values_in(1), [values(&[], 0.25), values(&[20.0], 0.125)]);
    }

    #[test]
    fn the_best_of_several_comes_first() {
        let mut second = report();
        second["parameters"][0]["value"] = json!(0.75);
        let several = json!({
            "schema": "brdfit.reports/1", "reports": [report(), second],
            "ranking": [{"index": 1, "criterion": "cbrt", "value": 0.1}, {"index": 0, "criterion": "cbrt", "value": 0.2}],
            "failed": [],
        });
        let found = read_value(&several).unwrap();
        assert_eq!(found.len(), 2);
        assert_eq!(found[0].table.formula_values(0)[0].amplitudes, [0.75]);
    }

    #[test]
    fn mistakes_are_named_in_one_line() {
        type Change = fn(&mut Value);
        let cases: [(Change, &str); 14] = [
            (|r| r["schema"] = json!("brdfit.report/9"), "found schema 'brdfit.report/9'"),
            (|r| r["model"] = json!("lambrt"), "found 'lambrt'"),
            (|r| r["model"] = json!("lambert"), "found parameter 'phong.ks'"),
            (|r| r["model"] = Value::Null, "expected a string"),
            (
                |r| r["parameters"][0]["value"] = json!(2.5),
                "lambert.kd.r: expected a value within its bounds 0..2, found 2.5",
            ),
            (
                |r| r["parameters"][0]["value"] = Value::Null,
                "found a fault: invalid type: null, expected a number",
            ),
            (|r| r["data"] = json!("x".repeat(5000)), "xxx..., expected an object"),
            (|r| r["parameters"][1]["channel"] = json!("b"), "'b'"),
            (
                |r| {
                    r["parameters"].as_array_mut().unwrap().pop();
                },
                "found none of phong.n",
            ),
            (|r| r["data"]["channels"] = json!([]), "data.channels"),
            (|r| r["data"]["channels"] = json!(["r", "\u{7f}f"]), "found ' f'"),
            (|r| r["data"]["channels"] = json!(vec!["n".repeat(90); 3000]), "the nearest of 3000 are nnn"),
            (|r| r["parameters"][1]["lobe"] = json!("pho\u{1b}[1mng"), "found 'pho [1mng.kd'"),
            (|r| r["parameters"][3]["bounds"] = json!([-1.0, 5.0]), "expected a lower bound above 0"),
        ];
        for (change, words) in cases {
            let mut value = report();
            change(&mut value);
            let message = read_value(&value).unwrap_err().to_string();
            assert!(message.starts_with("x.json") && message.contains(words), "{words}: {message}");
            assert!(!message.contains('\n') && message.len() < 2000, "{message}");
        }
        for text in ["{", "{}", "{\"schema\": 1}", "[]", "{\"schema\": \"brdfit.report/1\"}", "\u{0}"] {
            let message = read(text.as_bytes(), Path::new("x.json")).unwrap_err().to_string();
            assert!(message.starts_with("x.json:1: expected a report"), "{message}");
        }
    }
}
