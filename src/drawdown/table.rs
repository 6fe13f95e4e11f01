//! Reads CSV tables of reflectances over backings; docs/use/kubelka-munk.md documents them.
//!
//! There are two layouts. If a column begins with `over_`, the table has a row per channel and a column per backing;
//! otherwise it has a row per patch and a column per channel.

use crate::error::{Error, OptionName, Place, excerpt, short};
use crate::measurement::formats::File;
use crate::measurement::formats::csv::records;
use crate::measurement::{Channel, Source};
use csv::StringRecord;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::Path;

/// One reflectance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// Thickness of the film; infinite for paint that hides its backing.
    pub thickness: f64,
    /// Reflectance of the backing, 0..1.
    pub background: f64,
    /// Measured reflectance, 0..1.
    pub reflectance: f64,
    /// Its standard deviation. `None` if the file gives none.
    pub sigma: Option<f64>,
}

/// All reflectances in one channel.
#[derive(Clone, Debug)]
pub struct Series {
    /// The channel.
    pub channel: Channel,
    /// The reflectances; at least one.
    pub patches: Vec<Patch>,
}

/// A measured drawdown.
#[derive(Clone, Debug)]
pub struct Drawdown {
    /// The file that it was read from.
    pub source: Source,
    /// Number of rows of data.
    pub rows: usize,
    /// Whether the file or the caller gives the thickness. If not, the thickness of the film is the unit of length.
    pub thickness_known: bool,
    /// One per channel, in the file's order.
    pub series: Vec<Series>,
}

/// What was expected of a header or field, and what was found.
type Wrong = (String, String);

/// The column of the films' thickness.
const THICKNESS: &str = "thickness";
/// The column of the backing that a row was measured over.
const BACKGROUND: &str = "background";
/// The column of standard deviations.
const SIGMA: &str = "sigma";
/// The prefix of columns of reflectances over a backing.
const OVER: &str = "over_";
/// Columns that name the channel of a row.
const NAMES: [&str; 2] = ["channel", "wavelength"];
/// Backings whose reflectance is known without a column of its own.
const IDEAL: [(&str, f64); 2] = [("black", 0.0), ("white", 1.0)];
/// The name of the channel in a file that names none.
const ONLY_CHANNEL: &str = "reflectance";

/// Reads a drawdown. `thickness` applies to every row of a file without thicknesses.
///
/// # Errors
/// [`Error::Io`], [`Error::Malformed`], [`Error::NoSamples`]; [`Error::Unmet`] for a thickness given twice.
pub fn read(path: &Path, thickness: Option<f64>) -> Result<Drawdown, Error> {
    read_file(File::open(path)?, thickness)
}

/// Reads a drawdown from an open file or from memory, like [`read`].
///
/// # Errors
/// Like [`read`].
pub fn read_file(mut file: File<'_>, thickness: Option<f64>) -> Result<Drawdown, Error> {
    let path = file.path;
    if file.head(1).is_empty() {
        return Err(Error::malformed(path, Place::File, "a table of reflectances", "an empty file"));
    }
    let text = file.text()?;
    let mut records = records(&text);
    let Some((place, header)) = records.next().transpose().map_err(|e| e.in_file(path))? else {
        return Err(Error::malformed(path, Place::File, "a header naming the columns", "only comments"));
    };
    let at = |place| move |(expected, found): Wrong| Error::malformed(path, place, expected, found);
    let columns = Columns::parse(&header).map_err(at(place))?;
    if thickness.is_some() && columns.thickness.is_some() {
        return Err(Error::Unmet {
            path: path.to_owned(),
            option: OptionName::Thickness,
            expected: format!("a file without a column '{THICKNESS}'"),
            found: "one".to_owned(),
        });
    }
    let mut series: Vec<Series> = Vec::new();
    let mut places: HashMap<String, usize> = HashMap::new();
    let mut rows = 0;
    for record in records {
        let (place, fields) = record.map_err(|e| e.in_file(path))?;
        if fields.len() != header.len() {
            let expected = format!("{} fields, as the header has", header.len());
            return Err(Error::malformed(path, place, expected, fields.len().to_string()));
        }
        rows += 1;
        for (channel, patch) in columns.patches(&fields, thickness.unwrap_or(1.0)).map_err(at(place))? {
            match places.get(&channel.name).and_then(|place| series.get_mut(*place)) {
                Some(known) => known.patches.push(patch),
                None => {
                    places.insert(channel.name.clone(), series.len());
                    series.push(Series { channel, patches: vec![patch] });
                }
            }
        }
    }
    if rows == 0 {
        return Err(Error::no_samples(path, &BTreeMap::new()));
    }
    let thickness_known = thickness.is_some() || columns.thickness.is_some();
    let source = Source { path: path.to_owned(), format: "csv", sha256: file.sha256() };
    Ok(Drawdown { source, rows, thickness_known, series })
}

/// The meaning of the columns.
struct Columns {
    thickness: Option<usize>,
    layout: Layout,
}

enum Layout {
    /// One row per patch.
    Patches(Vec<ChannelColumns>),
    /// One row per channel; `name` is the column that names it.
    Channels { name: Option<usize>, sigma: Option<usize>, backings: Vec<BackingColumns> },
}

struct ChannelColumns {
    channel: Channel,
    reflectance: usize,
    background: Option<usize>,
    sigma: Option<usize>,
}

struct BackingColumns {
    /// As in `over_white`.
    column: String,
    reflectance: usize,
    background: Background,
}

enum Background {
    Column(usize),
    Ideal(f64),
}

/// The columns of a header, indexed by name. A header may be as wide as a file is long, so columns are looked up and not
/// searched for.
struct Header<'a> {
    names: &'a StringRecord,
    places: HashMap<&'a str, usize>,
}

impl<'a> Header<'a> {
    fn parse(names: &'a StringRecord) -> Result<Self, Wrong> {
        let mut places = HashMap::new();
        for (index, name) in names.iter().enumerate() {
            if places.insert(name, index).is_some() {
                return Err(("column names that differ".to_owned(), format!("{} twice", excerpt(name))));
            }
            if name.is_empty() {
                return Err(("a name for every column".to_owned(), format!("none for column {}", index + 1)));
            }
            if name.contains(char::is_control) {
                return Err(("column names without control characters".to_owned(), excerpt(name)));
            }
        }
        Ok(Self { names, places })
    }

    fn column(&self, name: &str) -> Option<usize> {
        self.places.get(name).copied()
    }

    /// The column names as one text, for errors.
    fn listed(&self) -> String {
        excerpt(&self.names.iter().collect::<Vec<_>>().join(","))
    }
}

impl Columns {
    fn parse(names: &StringRecord) -> Result<Self, Wrong> {
        let header = Header::parse(names)?;
        let layout = if names.iter().any(|name| name.starts_with(OVER)) {
            Self::row_per_channel(&header)?
        } else {
            Self::row_per_patch(&header)?
        };
        Ok(Self { thickness: header.column(THICKNESS), layout })
    }

    fn row_per_patch(header: &Header<'_>) -> Result<Layout, Wrong> {
        let own = |prefix: &str, name: &str| name.strip_prefix(prefix)?.strip_prefix('_').map(str::to_owned);
        let names = || header.names.iter().enumerate();
        // Columns for the backing or the standard deviation of one channel; if one wavelength has several spellings,
        // the first counts.
        let of_channels = |prefix: &str| {
            let mut columns = HashMap::new();
            for (index, name) in names() {
                if let Some(channel) = own(prefix, name) {
                    columns.entry(Channel::named(&channel).name).or_insert((index, channel));
                }
            }
            columns
        };
        let [backgrounds, sigmas] = [BACKGROUND, SIGMA].map(of_channels);
        let (background, sigma) = (header.column(BACKGROUND), header.column(SIGMA));
        let is_channel = |name: &str| {
            ![THICKNESS, BACKGROUND, SIGMA].contains(&name)
                && own(BACKGROUND, name).is_none()
                && own(SIGMA, name).is_none()
        };
        let mut channels: Vec<ChannelColumns> = Vec::new();
        let mut known = HashSet::new();
        for (index, name) in names().filter(|(_, name)| is_channel(name)) {
            let channel = Channel::named(name);
            if !known.insert(channel.name.clone()) {
                return Err(("channels that differ".to_owned(), format!("{} twice", excerpt(name))));
            }
            channels.push(ChannelColumns {
                background: backgrounds.get(&channel.name).map(|(column, _)| *column).or(background),
                sigma: sigmas.get(&channel.name).map(|(column, _)| *column).or(sigma),
                reflectance: index,
                channel,
            });
        }
        if channels.is_empty() {
            let expected =
                format!("columns '{BACKGROUND}' and one of reflectances per channel, or '{OVER}black'");
            return Err((expected, header.listed()));
        }
        for (prefix, columns) in [(BACKGROUND, &backgrounds), (SIGMA, &sigmas)] {
            let strays = columns.iter().filter(|(name, _)| !known.contains(*name));
            if let Some((_, (_, name))) = strays.min_by_key(|(_, (index, _))| *index) {
                let (channel, column) = (excerpt(name), excerpt(&format!("{prefix}_{name}")));
                return Err((format!("a column {channel} beside {column}"), header.listed()));
            }
        }
        Ok(Layout::Patches(channels))
    }

    fn row_per_channel(header: &Header<'_>) -> Result<Layout, Wrong> {
        let mut backings = Vec::new();
        for (reflectance, column_name) in header.names.iter().enumerate() {
            let Some(name) = column_name.strip_prefix(OVER) else { continue };
            let ideal =
                IDEAL.iter().find(|(ideal, _)| *ideal == name).map(|(_, value)| Background::Ideal(*value));
            let background = header.column(name).map(Background::Column).or(ideal).ok_or_else(|| {
                (
                    format!(
                        "a column {}, the reflectance of the backing of {}",
                        excerpt(name),
                        excerpt(column_name)
                    ),
                    header.listed(),
                )
            })?;
            backings.push(BackingColumns { column: column_name.to_owned(), reflectance, background });
        }
        let is_backing = |name: &str| header.column(&format!("{OVER}{name}")).is_some();
        let understood = |name: &str| {
            [THICKNESS, SIGMA].contains(&name)
                || NAMES.contains(&name)
                || name.starts_with(OVER)
                || is_backing(name)
        };
        if let Some(name) = header.names.iter().find(|name| !understood(name)) {
            let expected = format!(
                "columns {}, {THICKNESS}, {SIGMA}, {OVER}NAME and NAME, the reflectance of that backing",
                NAMES.join(" or ")
            );
            return Err((expected, excerpt(name)));
        }
        let names: Vec<usize> = NAMES.iter().filter_map(|name| header.column(name)).collect();
        if names.len() > 1 {
            return Err((format!("one column of {}", NAMES.join(" and ")), "both".to_owned()));
        }
        Ok(Layout::Channels { name: names.first().copied(), sigma: header.column(SIGMA), backings })
    }

    /// The reflectances in a row, with their channels.
    fn patches(&self, fields: &StringRecord, default: f64) -> Result<Vec<(Channel, Patch)>, Wrong> {
        let thickness = self.thickness.map_or(Ok(default), |column| thickness(field(fields, column)))?;
        let patch = |reflectance: f64, background: f64, sigma: Option<f64>| Patch {
            thickness,
            background,
            reflectance,
            sigma,
        };
        match &self.layout {
            Layout::Patches(channels) => channels
                .iter()
                .map(|c| {
                    let reflectance = share(&c.channel.name, field(fields, c.reflectance))?;
                    let background = match c.background {
                        Some(column) => share(BACKGROUND, field(fields, column))?,
                        // The backing of an opaque film does not matter.
                        None if thickness == f64::INFINITY => 0.0,
                        None => {
                            let expected = format!("a column '{BACKGROUND}' for a film of finite thickness");
                            return Err((expected, "none".to_owned()));
                        }
                    };
                    let sigma = c.sigma.map(|column| deviation(field(fields, column))).transpose()?;
                    Ok((c.channel.clone(), patch(reflectance, background, sigma)))
                })
                .collect(),
            Layout::Channels { name, sigma, backings } => {
                let name = name.map_or(ONLY_CHANNEL, |column| field(fields, column));
                if name.is_empty() || name.contains(char::is_control) {
                    return Err(("the name or wavelength of a channel".to_owned(), excerpt(name)));
                }
                let channel = Channel::named(name);
                let sigma = sigma.map(|column| deviation(field(fields, column))).transpose()?;
                backings
                    .iter()
                    .map(|b| {
                        let background = match b.background {
                            Background::Column(column) => share(BACKGROUND, field(fields, column))?,
                            Background::Ideal(value) => value,
                        };
                        let reflectance = share(&b.column, field(fields, b.reflectance))?;
                        Ok((channel.clone(), patch(reflectance, background, sigma)))
                    })
                    .collect()
            }
        }
    }
}

fn field(fields: &StringRecord, column: usize) -> &str {
    fields.get(column).unwrap_or_default()
}

/// Parses a reflectance.
fn share(what: &str, text: &str) -> Result<f64, Wrong> {
    let what = short(what);
    match text.parse::<f64>() {
        Ok(value) if (0.0..=1.0).contains(&value) => Ok(value),
        Ok(value) if value > 1.0 && value <= 100.0 => {
            Err((format!("a reflectance from 0 to 1 for {what}, not per cent"), excerpt(text)))
        }
        _ => Err((format!("a reflectance from 0 to 1 for {what}"), excerpt(text))),
    }
}

fn deviation(text: &str) -> Result<f64, Wrong> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err((format!("a finite number above 0 for {SIGMA}"), excerpt(text))),
    }
}

fn thickness(text: &str) -> Result<f64, Wrong> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 => Ok(value),
        _ => Err((format!("a {THICKNESS} above 0, or 'inf' for opaque paint"), excerpt(text))),
    }
}
