//! What must hold of every reader whatever it is given, for the fuzz targets in fuzz/ and for properties.rs.
//!
//! Each function takes the bytes of one case and panics where a promise is broken: a reader may refuse, in one
//! line that says where, or read something that makes sense; and what it reads it must read again from what is
//! written of it.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)]

use brdfit::Error;
use brdfit::drawdown::{self, Drawdown, Record, Surface};
use brdfit::error::OptionName;
use brdfit::fit::{Options, evaluate};
use brdfit::geometry::{Azimuths, Pair, direction};
use brdfit::measurement::Measurement;
use brdfit::measurement::formats::csv::write as write_csv;
use brdfit::measurement::formats::{
    BinPosition, File, ReadOptions, Subject, directions_of, named, read_file,
};
use brdfit::measurement::reading::Conventions;
use brdfit::model::Expression;
use brdfit::parameters::{ParameterTable, SettingTexts};
use brdfit::report::{Circumstances, OptionRecord, Report, Times, table};
use serde_json::Value;
use std::path::Path;

/// A target: its name, which is that of its corpus, and what it does with a case.
pub type Target = (&'static str, fn(&[u8]));

/// Every target.
#[allow(dead_code)]
pub const TARGETS: &[Target] = &[
    ("csv", csv),
    ("reading", reading),
    ("cornell", cornell),
    ("alta", alta),
    ("tables", tables),
    ("npz", npz),
    ("exr", exr),
    ("merl", merl),
    ("zemax", zemax),
    ("ssdd", ssdd),
    ("rgl", rgl),
    ("measurement", measurement),
    ("directions", directions),
    ("drawdown", drawdown),
    ("drawdown_fit", drawdown_fit),
    ("expression", expression),
    ("settings", settings),
    ("report", report),
    ("report_read", report_read),
];

/// What the file of a case is called.
const NAME: &str = "input";

/// A file with these bytes; an empty one if they begin like compressed data that cannot be unpacked, which is refused.
fn file(bytes: &[u8]) -> File<'_> {
    let of = |bytes| File::new(Path::new(NAME), bytes);
    of(bytes).unwrap_or_else(|error| {
        assert!(bytes.starts_with(&[0x1f, 0x8b]), "{error}");
        check_refusal(&error);
        of(&[]).expect("memory can be read")
    })
}

/// The longest message: an enumeration of the models and what was found.
const LONGEST_MESSAGE: usize = 2000;

/// An error message is one line of reasonable length without control characters.
fn check_message(message: &str) {
    assert!(!message.contains(char::is_control), "control characters in {message:?}");
    assert!((10..LONGEST_MESSAGE).contains(&message.len()), "{} bytes: {message:?}", message.len());
}

/// A refusal names the file, and what was expected and found, or what became of the samples.
fn check_refusal(error: &Error) {
    let message = error.to_string();
    check_message(&message);
    assert!(message.starts_with(NAME), "no file in {message:?}");
    match error {
        Error::Malformed { expected, found, .. } => {
            assert!(!expected.is_empty() && !found.is_empty(), "{message:?}");
        }
        Error::NoSamples { .. } => {}
        _ => panic!("not about the file: {message:?}"),
    }
}

/// A measurement has the shape that its type promises, and finite content: NaN only where a value was not measured, and a value of every
/// sample.
fn check_measurement(m: &Measurement) {
    let samples = m.directions.len();
    assert!(!m.channels.is_empty());
    assert_eq!(m.values.len(), m.channels.len());
    assert!(m.values.iter().all(|row| row.len() == samples && !row.iter().any(|f| f.is_infinite())));
    assert!((0..samples).all(|sample| m.values.iter().any(|row| row[sample].is_finite())));
    if let Some(sigma) = &m.sigma {
        assert_eq!(sigma.len(), m.channels.len());
        for (row, values) in sigma.iter().zip(&m.values) {
            assert_eq!(row.len(), samples);
            assert!(row.iter().zip(values).all(|(s, f)| f.is_nan() || (s.is_finite() && *s >= 0.0)));
        }
    }
    for (index, channel) in m.channels.iter().enumerate() {
        assert!(!channel.name.is_empty() && !channel.name.contains(char::is_control), "{channel:?}");
        assert!(channel.wavelength_nm.is_none_or(|nm| nm.is_finite() && nm > 0.0), "{channel:?}");
        assert!(m.channels[..index].iter().all(|earlier| earlier.name != channel.name), "{channel:?} twice");
    }
    for g in m.directions.iter() {
        check_direction(g.wi);
        check_direction(g.wo);
    }
    assert_eq!(m.source.sha256.len(), 64);
}

/// A direction has length 1 and is above the horizon, to the slack that the readers give.
fn check_direction(w: [f64; 3]) {
    let length = w.iter().map(|x| x * x).sum::<f64>().sqrt();
    assert!((length - 1.0).abs() < 1e-9 && w[2] > -1.1e-5, "{w:?}");
}

fn read(bytes: &[u8], format: Option<&str>) -> Option<Measurement> {
    match read_file(file(bytes), format, &ReadOptions::default()) {
        Ok(m) => {
            check_measurement(&m);
            Some(m)
        }
        Err(error) => {
            check_refusal(&error);
            None
        }
    }
}

/// The bits of numbers, all NaN the same.
fn bits<'m>(rows: impl IntoIterator<Item = &'m Vec<f64>>) -> Vec<Vec<u64>> {
    let of_number = |f: &f64| if f.is_nan() { f64::NAN.to_bits() } else { (f + 0.0).to_bits() };
    rows.into_iter().map(|row| row.iter().map(of_number).collect()).collect()
}

/// What is read can be written as CSV and read again: the same channels, numbers and directions.
fn check_round_trip(m: &Measurement) {
    // A direction in the slack below the horizon may leave it in rounding.
    if m.directions.is_empty() || m.directions.iter().any(|g| g.wi[2].min(g.wo[2]) < -0.9e-5) {
        return;
    }
    let text = write_csv(m, &["a comment".to_owned()]).expect("finite numbers can be written");
    if m.missing().iter().any(|missing| *missing > 0) {
        assert!(text.contains("nan"));
        return check_npz_round_trip(m);
    }
    let again = read_file(file(text.as_bytes()), Some("csv"), &ReadOptions::default())
        .unwrap_or_else(|error| panic!("not read again: {error}\n{text}"));
    assert_eq!(again.channels, m.channels);
    assert_eq!(again.values, m.values);
    assert_eq!(again.sigma, m.sigma);
    let components =
        |m: &Measurement| -> Vec<f64> { m.directions.iter().flat_map(|g| [g.wi, g.wo].concat()).collect() };
    for (a, b) in components(&again).into_iter().zip(components(m)) {
        assert!((a - b).abs() < 1e-9, "{a} {b}\n{text}");
    }
}

/// The project's own CSV.
pub fn csv(bytes: &[u8]) {
    if let Some(m) = read(bytes, Some("csv")) {
        check_round_trip(&m);
    }
}

/// Options that say how a table is read, of which the first byte of a case chooses one set.
const READING: [&[(OptionName, &str)]; 8] = [
    &[],
    &[(OptionName::Columns, "theta_i=1,phi_i=2,theta_o=3,phi_o=4,channels=5;6,sigma=7")],
    &[(OptionName::Columns, "theta_i=a,theta_o=b,wavelength=w,channels=f"), (OptionName::Missing, "-999,0")],
    &[(OptionName::Angles, "elevation"), (OptionName::Azimuth, "from-mirror")],
    &[(OptionName::Angles, "radians,theta_o=cosine"), (OptionName::LightDirection, "as-it-travels")],
    &[(OptionName::Quantity, "f-cos-i-cos-o,percent"), (OptionName::Scale, "0.5")],
    &[
        (OptionName::Quantity, "decibel"),
        (OptionName::Decimal, "comma"),
        (OptionName::Separator, "semicolon"),
    ],
    &[
        (OptionName::LeaveOut, "theta_i=20..40"),
        (OptionName::MeanOfSAndP, "true"),
        (OptionName::Separator, "blanks"),
    ],
];

/// Tables of text, read as one of several sets of options says.
pub fn reading(bytes: &[u8]) {
    let Some((first, table)) = bytes.split_first() else { return };
    let options = READING[usize::from(*first) % READING.len()];
    let conventions = options.iter().fold(Conventions::default(), |conventions, (option, text)| {
        conventions.with(*option, text).expect("options that exist")
    });
    match read_file(file(table), Some("csv"), &ReadOptions::new().with_conventions(conventions)) {
        Ok(m) => {
            check_measurement(&m);
            check_round_trip(&m);
        }
        // Numbers may become infinite, and channels may not be polarised.
        Err(error @ Error::Invalid { .. }) => check_message(&error.to_string()),
        Err(error) => check_refusal(&error),
    }
}

/// Cornell's text tables.
pub fn cornell(bytes: &[u8]) {
    if let Some(m) = read(bytes, Some("cornell")) {
        assert!(m.channels.iter().all(|channel| channel.wavelength_nm.is_some()));
        check_round_trip(&m);
    }
}

/// ALTA's text files.
pub fn alta(bytes: &[u8]) {
    if let Some(m) = read(bytes, Some("alta")) {
        assert!(m.directions.iter().all(|g| g.cos_i() > 0.0 && g.cos_o() > 0.0));
        check_round_trip(&m);
    }
}

/// NIST's and the thermal infrared's tables.
pub fn tables(bytes: &[u8]) {
    for format in ["nist", "mwir"] {
        if let Some(m) = read(bytes, Some(format)) {
            assert!(m.directions.iter().all(|g| g.cos_i() > 0.0 && g.cos_o() > 0.0));
            check_round_trip(&m);
        }
    }
}

/// Named arrays of NumPy: what is read is read again from what is written of it.
pub fn npz(bytes: &[u8]) {
    if let Some(m) = read(bytes, Some("npz")) {
        check_npz_round_trip(&m);
    }
}

fn check_npz_round_trip(m: &Measurement) {
    let subject = Subject {
        channels: &m.channels,
        at: &|_| Vec::new(),
        covered: &brdfit::measurement::formats::everywhere,
        measurement: Some(m),
        isotropic: false,
        about: "a case",
        grid: None,
    };
    let write = named("npz").ok().and_then(|format| format.write).expect("a format that is written");
    let written = write(&subject).expect("finite numbers can be written").bytes;
    let again = read(&written, Some("npz")).expect("what was written");
    // A direction at the horizon may be left out after rounding.
    if again.directions.len() == m.directions.len() {
        assert_eq!(again.channels, m.channels);
        assert_eq!(bits(&again.values), bits(&m.values));
        assert_eq!(bits(again.sigma.iter().flatten()), bits(m.sigma.iter().flatten()));
    }
}

/// Slices as OpenEXR images, in builds that read these.
pub fn exr(bytes: &[u8]) {
    if named("exr").is_err() {
        return;
    }
    if let Some(m) = read(bytes, Some("exr")) {
        assert_eq!(m.channels.len(), 3);
        assert!(m.directions.iter().all(|g| (g.cos_i() - g.cos_o()).abs() < 1e-12));
        check_round_trip(&m);
    }
}

/// MERL tables. No case is as long as one, of 64-bit or of 32-bit floats, so all must be refused: by their length if they begin with the
/// dimensions in either byte order, or else by their beginning. The numbers are tested beside their reader and in formats/merl.rs.
pub fn merl(bytes: &[u8]) {
    // 90, 90, 180, with the least or the most significant byte first.
    let little = [90, 0, 0, 0, 90, 0, 0, 0, 180, 0, 0, 0];
    let mut big = little;
    big.chunks_mut(4).for_each(<[u8]>::reverse);
    let is_table = [little, big].iter().any(|header| bytes.starts_with(header));
    let (place, found) = if is_table {
        (format!("byte {}:", bytes.len()), format!("found {} (truncated)", bytes.len()))
    } else {
        ("byte 0:".to_owned(), "expected the dimensions 90 x 90 x 180".to_owned())
    };
    for merl_bins in [BinPosition::Center, BinPosition::Edge] {
        let error = read_file(file(bytes), Some("merl"), &ReadOptions::new().with_merl_bins(merl_bins));
        let error = error.expect_err("shorter than a table");
        check_refusal(&error);
        let message = error.to_string();
        // What is unpacked has another length, and may begin with anything.
        let is_packed = bytes.starts_with(&[0x1f, 0x8b]);
        assert!(is_packed || message.contains(&place) && message.contains(&found), "{message}");
    }
}

/// Zemax's tables.
pub fn zemax(bytes: &[u8]) {
    if let Some(m) = read(bytes, Some("zemax")) {
        check_round_trip(&m);
        assert!(m.instrument.total_scatter.iter().all(|total| total.share.is_finite()));
        check_above_horizon(&m);
    }
}

/// SSDD, its tables as text and as floats.
pub fn ssdd(bytes: &[u8]) {
    if let Some(m) = read(bytes, Some("ssdd")) {
        check_round_trip(&m);
        check_above_horizon(&m);
    }
}

/// Formats whose tables have places below the horizon leave them out, with no slack.
fn check_above_horizon(m: &Measurement) {
    assert!(m.directions.iter().all(|g| g.wi[2] > 0.0 && g.wo[2] > 0.0));
}

/// RGL tensor files: f is finite everywhere, not only at the samples.
pub fn rgl(bytes: &[u8]) {
    let Some(m) = read(bytes, Some("rgl")) else { return };
    check_round_trip(&m);
    let continuous = m.continuous.as_ref().expect("an evaluation at all directions");
    let mut values = vec![0.0; m.channels.len()];
    for k in 0..24_u32 {
        let [theta_i, theta_o] = [k % 4, k % 3].map(|n| 0.5 * f64::from(n));
        let [phi_i, phi_o] = [k, 5 * k % 24].map(|n| f64::from(n) * 15.0_f64.to_radians() - 3.0);
        let pair = Pair { wi: direction(theta_i, phi_i), wo: direction(theta_o, phi_o) };
        continuous.at(&pair, &mut values);
        assert!(values.iter().all(|f| f.is_finite()), "{values:?} at {pair:?}");
    }
}

/// A measurement in the format that its content shows, which is that of the format by name.
pub fn measurement(bytes: &[u8]) {
    if let Some(m) = read(bytes, None) {
        let again = read(bytes, Some(m.source.format)).expect("the format that was recognised");
        assert_eq!((bits(&again.values), again.channels), (bits(&m.values), m.channels));
    }
}

/// The directions of any file, as for `synth --at`.
pub fn directions(bytes: &[u8]) {
    match directions_of(file(bytes), &ReadOptions::default()) {
        Ok(pairs) => {
            for pair in pairs {
                check_direction(pair.wi.into());
                check_direction(pair.wo.into());
            }
        }
        Err(error) => check_refusal(&error),
    }
}

/// Reads a drawdown and checks it.
fn read_drawdown(bytes: &[u8], thickness: Option<f64>) -> Option<Drawdown> {
    let drawdown = match drawdown::read_file(file(bytes), thickness) {
        Ok(drawdown) => drawdown,
        // A thickness that is given twice is the user's mistake, not the file's.
        Err(error @ Error::Unmet { .. }) if thickness.is_some() => {
            check_message(&error.to_string());
            return None;
        }
        Err(error) => {
            check_refusal(&error);
            return None;
        }
    };
    assert!(!drawdown.series.is_empty() && drawdown.rows > 0);
    for series in &drawdown.series {
        assert!(!series.patches.is_empty());
        for patch in &series.patches {
            assert!(patch.thickness > 0.0, "{patch:?}");
            assert!((0.0..=1.0).contains(&patch.background), "{patch:?}");
            assert!((0.0..=1.0).contains(&patch.reflectance), "{patch:?}");
            assert!(patch.sigma.is_none_or(|s| s > 0.0 && s.is_finite()), "{patch:?}");
        }
    }
    Some(drawdown)
}

/// Reflectances over backings.
pub fn drawdown(bytes: &[u8]) {
    for thickness in [None, Some(0.1)] {
        read_drawdown(bytes, thickness);
    }
}

/// What is made of a few reflectances over backings.
pub fn drawdown_fit(bytes: &[u8]) {
    let Some(drawdown) = read_drawdown(bytes, None) else { return };
    if drawdown.series.len() > 2 || drawdown.rows > 6 {
        return;
    }
    match drawdown::fit(&drawdown, Surface::default()) {
        Ok(fitted) => {
            let record = Record::new(&drawdown, &fitted, Surface::default(), None, None);
            check_json(&serde_json::to_string_pretty(&record).expect("a record can be written"));
            check_lines(&drawdown::text(&record, drawdown.thickness_known));
            record.warnings().iter().for_each(|text| check_message(text));
        }
        Err(error) => check_message(&error.to_string()),
    }
}

/// A text that is shown has no control characters but line ends.
fn check_lines(text: &str) {
    assert!(!text.contains(|c: char| c.is_control() && c != '\n'), "{text:?}");
}

/// What was written is JSON.
fn check_json(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// A sum of models: what is understood is understood again when written out, and means the same.
pub fn expression(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    match Expression::parse(text) {
        Ok(expression) => {
            let canonical = expression.canonical();
            let again = Expression::parse(&canonical).expect("the canonical form");
            assert_eq!(again.canonical(), canonical);
            let names =
                |e: &Expression| -> Vec<String> { e.lobes().iter().map(|l| l.name.clone()).collect() };
            assert_eq!(names(&again), names(&expression));
            let mut distinct = names(&expression);
            distinct.sort_unstable();
            distinct.dedup();
            assert_eq!(distinct.len(), expression.lobes().len());
        }
        Err(error) => check_message(&error.to_string()),
    }
}

/// What options and the values after them, such as `--fix` and `m=0.2`, say of parameters; `None` if one is no option, or
/// lacks its value.
fn setting_texts(words: &[String]) -> Option<SettingTexts> {
    let mut texts = SettingTexts::default();
    for pair in words.chunks(2) {
        let [option, value] = pair else { return None };
        let of_kind = match option.as_str() {
            "--fix" => &mut texts.fix,
            "--init" => &mut texts.init,
            "--bounds" => &mut texts.bounds,
            "--free" => &mut texts.free,
            "--tie" => &mut texts.tie,
            "--per-channel" => &mut texts.per_channel,
            "--shared" => &mut texts.shared,
            _ => return None,
        };
        of_kind.push(value.clone());
    }
    Some(texts)
}

/// Constraints on parameters. The first line is the model, the second the channels; each further line is an option
/// and its value: `--fix m=0.2`.
pub fn settings(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let mut lines = text.split('\n');
    let (model, channels) = (lines.next().unwrap_or_default(), lines.next().unwrap_or_default());
    let Ok(expression) = Expression::parse(model) else { return };
    let channels: Vec<String> = channels.split_whitespace().map(str::to_owned).collect();
    // No reader gives a channel such a name.
    let unreadable = channels.iter().any(|channel| channel.contains(char::is_control));
    if channels.is_empty() || channels.len() > 8 || expression.lobes().len() > 8 || unreadable {
        return;
    }
    let words: Vec<String> = lines.flat_map(|line| line.splitn(2, ' ')).map(str::to_owned).collect();
    let Some(texts) = setting_texts(&words) else { return };
    assert_eq!(texts.as_given().len(), words.len() / 2);
    let built = texts
        .settings()
        .and_then(|settings| ParameterTable::new(&expression, &channels, Azimuths::Several, &settings));
    match built {
        Ok(table) => {
            for row in table.rows() {
                let (low, high) = row.bounds;
                assert!(low <= high && low.is_finite() && high.is_finite(), "{row:?}");
                assert!((low..=high).contains(&row.value), "{row:?}");
            }
        }
        Err(error) => check_message(&error.to_string()),
    }
}

/// A measurement that is evaluated and reported: the report is JSON that says the same as the report in memory.
pub fn report(bytes: &[u8]) {
    let Some(m) = read(bytes, None) else { return };
    if m.directions.len() > 200 || m.channels.len() > 8 {
        return;
    }
    let expression = Expression::parse("lambert").expect("a model");
    let options = Options::default();
    let fit = match evaluate(&m, &expression, &options) {
        Ok(fit) => fit,
        Err(error) => return check_message(&error.to_string()),
    };
    let circumstances = Circumstances {
        metric: options.metric,
        max_theta_deg: options.filters.max_theta_deg,
        options: OptionRecord::default(),
        times: Times::default(),
        fitted: false,
    };
    let report = Report::new(&m, &fit, &circumstances);
    let written = check_json(&serde_json::to_string_pretty(&report).expect("a report can be written"));
    let again: Report = serde_json::from_value(written.clone()).expect("a report can be read");
    assert_eq!(serde_json::to_value(&again).expect("and written again"), written);
    assert_eq!(written["data"]["channels"].as_array().map(Vec::len), Some(m.channels.len()));
    assert_eq!(written["data"]["samples"].as_u64(), u64::try_from(m.total()).ok());
    for (name, channel) in written["data"]["channels"].as_array().into_iter().flatten().zip(&m.channels) {
        assert_eq!(name.as_str(), Some(channel.name.as_str()));
        assert!(written["errors_by_channel"][channel.name.as_str()].is_object(), "{written}");
    }
    check_lines(&table(&report));
    report.warnings.iter().for_each(|warning| check_message(&warning.to_string()));
}

/// `check` of a report: the models that are read have all their parameters, within their bounds.
pub fn report_read(bytes: &[u8]) {
    match brdfit::report::read(bytes, Path::new(NAME)) {
        Ok(models) => {
            assert!(!models.is_empty());
            for model in models {
                for row in model.table.rows() {
                    let (low, high) = row.bounds;
                    assert!(row.given && (low..=high).contains(&row.value), "{row:?}");
                }
            }
        }
        Err(error) => check_refusal(&error),
    }
}
