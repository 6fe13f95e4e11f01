//! Arrays of NumPy in one file (`.npz`): this project's own layout of named arrays, read and written. docs/use/formats.md
//! documents it. The file is a zip archive of `.npy` files, as `numpy.savez` and `numpy.savez_compressed` write it.

mod npy;
mod write;

use self::npy::{Budget, Numbers, Wrong};
use super::csv::ANGLES;
use super::fields::HORIZON_TOLERANCE;
use super::file::File;
use super::format::{Confidence, Format, ReadOptions};
use crate::error::{Error, Place, excerpt, listed, short};
use crate::geometry::{Directions, Pair, direction};
use crate::measurement::{Channel, Instrument, Measurement};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, PI};
use std::io::Cursor;
use zip::ZipArchive;

/// The format's entry in the registry.
pub const FORMAT: Format = Format {
    name: "npz",
    summary: "a NumPy .npz with arrays theta_i, phi_i, theta_o, phi_o and values",
    sniff,
    read,
    directions: None,
    several_materials: false,
    own_options: &[],
    knows_angles: false,
    extensions: &["npz"],
    write: Some(write::write),
};

/// The largest file that is read, bytes.
const MOST_BYTES: u64 = 2 << 30;
/// The most bytes that are read after decompression.
const MOST_DECOMPRESSED: u64 = 4 << 30;
/// How many bytes a byte of the file may become: the method of zip archives cannot do more than 1032.
const MOST_PER_BYTE: u64 = 1100;
/// The most numbers, all arrays together.
const MOST_ELEMENTS: u64 = 1 << 28;
/// The most arrays.
const MOST_ARRAYS: usize = 100_000;

/// The most channels: no instrument resolves more wavelengths.
const MOST_CHANNELS: usize = 100_000;

/// Arrays that are not the values of a channel.
const OTHERS: [&str; 6] = ["values", "f", "sigma", "wavelengths_nm", "channels", "description"];

fn sniff(file: &File<'_>) -> Confidence {
    let head = file.head(512);
    // The name of the first file in an archive follows thirty bytes, its length four bytes before.
    let named = || {
        let length = head.get(26..28).and_then(|b| b.try_into().ok()).map(u16::from_le_bytes)?;
        head.get(30..30 + usize::from(length)).map(|name| name.ends_with(b".npy"))
    };
    let archive = head.starts_with(b"PK\x03\x04");
    if head.starts_with(npy::MAGIC) || (archive && named() == Some(true)) {
        Confidence::Yes
    } else if archive && file.path.extension().is_some_and(|e| e.eq_ignore_ascii_case("npz")) {
        Confidence::Maybe
    } else {
        Confidence::No
    }
}

/// The arrays of a file.
struct Arrays<'f, 'p> {
    file: &'f File<'p>,
    archive: ZipArchive<Cursor<&'f [u8]>>,
    /// Their names, in the order of the file.
    names: Vec<String>,
    budget: Budget,
}

impl<'f, 'p> Arrays<'f, 'p> {
    fn open(file: &'f File<'p>, bytes: &'f [u8]) -> Result<Self, Error> {
        let wrong = |expected: &str, found: String| Error::malformed(file.path, Place::File, expected, found);
        if bytes.starts_with(npy::MAGIC) {
            return Err(wrong("named arrays (.npz)", "a single array (.npy)".to_owned()));
        }
        let length = u64::try_from(bytes.len()).unwrap_or(u64::MAX);
        let budget = Budget {
            bytes: MOST_DECOMPRESSED.min(length.saturating_mul(MOST_PER_BYTE)),
            elements: MOST_ELEMENTS,
        };
        let archive = ZipArchive::new(Cursor::new(bytes))
            .map_err(|error| wrong("a whole zip archive of arrays", short(&error.to_string())))?;
        if archive.len() > MOST_ARRAYS {
            return Err(wrong(&format!("at most {MOST_ARRAYS} arrays"), archive.len().to_string()));
        }
        // A name that is not text names no array of this layout.
        let names = archive.file_names().filter_map(Result::ok);
        let names = names.filter_map(|name| name.strip_suffix(".npy").map(str::to_owned)).collect();
        Ok(Self { file, archive, names, budget })
    }

    fn has(&self, name: &str) -> bool {
        self.names.iter().any(|known| known == name)
    }

    /// The error about an array.
    fn about(&self, name: &str, expected: &str, found: String) -> Error {
        about(self.file, name, expected, found)
    }

    fn with<T>(
        &mut self,
        name: &str,
        read: impl FnOnce(&mut dyn std::io::Read, &mut Budget) -> Result<T, Wrong>,
    ) -> Result<T, Error> {
        let entry = self.archive.by_name(&format!("{name}.npy"));
        let read = match entry {
            Ok(mut entry) => read(&mut entry, &mut self.budget),
            Err(error) => {
                Err(Wrong { expected: "readable data".to_owned(), found: short(&error.to_string()) })
            }
        };
        read.map_err(|Wrong { expected, found }| about(self.file, name, &expected, found))
    }

    fn numbers(&mut self, name: &str) -> Result<Numbers, Error> {
        self.with(name, |mut source, budget| npy::numbers(&mut source, budget))
    }

    fn texts(&mut self, name: &str) -> Result<Vec<String>, Error> {
        self.with(name, |mut source, budget| npy::texts(&mut source, budget))
    }

    /// A list of `length` numbers, or of any number.
    fn list(&mut self, name: &str, length: Option<usize>) -> Result<Vec<f64>, Error> {
        let array = self.numbers(name)?;
        if array.shape.len() == 1 && length.is_none_or(|length| array.data.len() == length) {
            return Ok(array.data);
        }
        let expected = length.map_or_else(|| "shape (n,)".to_owned(), |n| format!("shape ({n},)"));
        Err(self.about(name, &expected, shape_in_words(&array.shape)))
    }

    /// An array of shape (n, channels) or (n,), by channel.
    fn by_channel(&mut self, name: &str, samples: usize) -> Result<Vec<Vec<f64>>, Error> {
        let Numbers { shape, fortran, data } = self.numbers(name)?;
        match *shape.as_slice() {
            [n] if n == samples => Ok(vec![data]),
            [n, 1] if n == samples => Ok(vec![data]),
            [n, channels] if n == samples && channels > MOST_CHANNELS => {
                let expected = format!("at most {MOST_CHANNELS} channels");
                Err(self.about(name, &expected, channels.to_string()))
            }
            [n, channels] if n == samples && channels > 0 && n > 0 => Ok(if fortran {
                data.chunks(n).map(<[f64]>::to_vec).collect()
            } else {
                let mut rows: Vec<Vec<f64>> = (0..channels).map(|_| Vec::with_capacity(n)).collect();
                for sample in data.chunks(channels) {
                    rows.iter_mut().zip(sample).for_each(|(row, value)| row.push(*value));
                }
                rows
            }),
            _ => {
                let expected = format!("shape ({samples}, channels) or ({samples},)");
                Err(self.about(name, &expected, shape_in_words(&shape)))
            }
        }
    }
}

/// The error about an array of a file.
fn about(file: &File<'_>, name: &str, expected: &str, found: String) -> Error {
    Error::malformed(file.path, Place::File, format!("{expected} in array {}", excerpt(name)), found)
}

/// A shape as Python writes it.
fn shape_in_words(shape: &[usize]) -> String {
    let numbers: Vec<String> = shape.iter().map(usize::to_string).collect();
    let text = if let [only] = numbers.as_slice() {
        format!("({only},)")
    } else {
        format!("({})", numbers.join(", "))
    };
    format!("shape {}", short(&text))
}

fn read(file: &mut File<'_>, _: &ReadOptions) -> Result<Measurement, Error> {
    file.with_bytes(MOST_BYTES, read_bytes)
}

fn read_bytes(file: &File<'_>, bytes: &[u8]) -> Result<Measurement, Error> {
    let mut arrays = Arrays::open(file, bytes)?;
    let whole = if arrays.has("values") { "values" } else { "f" };
    let single: Vec<String> = if arrays.has(whole) {
        Vec::new()
    } else {
        let value = |name: &&String| {
            !ANGLES.contains(&name.as_str())
                && !OTHERS.contains(&name.as_str())
                && !name.starts_with("sigma_")
        };
        arrays.names.iter().filter(value).cloned().collect()
    };
    if ANGLES.iter().any(|name| !arrays.has(name)) || (single.is_empty() && !arrays.has(whole)) {
        let expected = "arrays theta_i, phi_i, theta_o, phi_o (degrees) and values (n, channels), f or one for each channel";
        let found = if arrays.names.is_empty() { "no arrays".to_owned() } else { listed(&arrays.names) };
        return Err(Error::malformed(file.path, Place::File, expected, found));
    }
    let mut angles = Vec::new();
    for name in ANGLES {
        let samples = angles.first().map(Vec::len);
        angles.push(arrays.list(name, samples)?);
    }
    let samples = angles.first().map_or(0, Vec::len);
    let mut values = Vec::new();
    if single.is_empty() {
        values = arrays.by_channel(whole, samples)?;
    } else {
        for name in &single {
            values.push(arrays.list(name, Some(samples))?);
        }
    }
    let channels = channels(&mut arrays, &single, values.len())?;
    let sigma = sigma(&mut arrays, &channels, samples)?;
    let description =
        if arrays.has("description") { arrays.texts("description")?.into_iter().next() } else { None };
    let clean = |text: String| text.chars().take(500).map(|c| if c.is_control() { ' ' } else { c }).collect();
    let kept = usable(&arrays, &angles, &values)?;
    let whole = kept.dropped.is_empty();
    let columns = |rows: Vec<Vec<f64>>| -> Vec<Vec<f64>> {
        if whole {
            return rows;
        }
        rows.into_iter()
            .map(|row| row.into_iter().zip(&kept.kept).filter(|(_, kept)| **kept).map(|(v, _)| v).collect())
            .collect()
    };
    let sigma = sigma.map(columns);
    let values = columns(values);
    // The standard deviation of what was not measured says nothing.
    let mut of_values = sigma.iter().flatten().flatten().zip(values.iter().flatten());
    let right = |(sigma, value): (&f64, &f64)| value.is_nan() || (sigma.is_finite() && *sigma >= 0.0);
    if !of_values.all(right) {
        return Err(arrays.about("sigma", "finite standard deviations of 0 or more", "another".to_owned()));
    }
    Ok(Measurement {
        sigma: sigma.filter(|_| !kept.pairs.is_empty()),
        dropped: kept.dropped,
        instrument: Instrument { description: description.map(clean), ..Instrument::default() },
        ..Measurement::of(channels, Directions::Scattered(kept.pairs), values)
    })
}

/// The samples that can be used.
struct Usable {
    /// Whether each can.
    kept: Vec<bool>,
    pairs: Vec<Pair>,
    dropped: BTreeMap<&'static str, usize>,
}

/// Checks the angles and values of each sample.
fn usable(arrays: &Arrays<'_, '_>, angles: &[Vec<f64>], values: &[Vec<f64>]) -> Result<Usable, Error> {
    let mut usable = Usable { kept: Vec::new(), pairs: Vec::new(), dropped: BTreeMap::new() };
    let samples = angles.first().map_or(0, Vec::len);
    // Most arrays have no infinities, which is found out faster than where there are some.
    let infinite = values.iter().any(|row| row.iter().fold(false, |any, value| any | value.is_infinite()));
    let to_check = if infinite { values } else { &[] };
    let mut used = Vec::new();
    for index in 0..samples {
        let mut sample = [0.0; 4];
        for ((angle, list), name) in sample.iter_mut().zip(angles).zip(ANGLES) {
            let degrees = list.get(index).copied().unwrap_or(f64::NAN);
            *angle = degrees.to_radians();
            if !angle.is_finite() || (name.starts_with("theta") && angle.abs() > PI + HORIZON_TOLERANCE) {
                let expected =
                    if name.starts_with("theta") { "degrees from -180 to 180" } else { "finite degrees" };
                return Err(arrays.about(name, expected, format!("{degrees:e} at index {index}")));
            }
        }
        let mut of_sample = to_check.iter().filter_map(|row| row.get(index));
        if of_sample.any(|value| value.is_infinite()) {
            return Err(arrays.about(
                "values",
                "finite numbers, or NaN where nothing was measured",
                format!("infinity at index {index}"),
            ));
        }
        let [theta_i, _, theta_o, _] = sample;
        let reason = if theta_i.abs().max(theta_o.abs()) >= FRAC_PI_2 {
            Some("below-horizon")
        } else {
            used.push(sample);
            None
        };
        usable.kept.push(reason.is_none());
        if let Some(reason) = reason {
            *usable.dropped.entry(reason).or_default() += 1;
        }
    }
    let pair = |[theta_i, phi_i, theta_o, phi_o]: [f64; 4]| Pair {
        wi: direction(theta_i, phi_i),
        wo: direction(theta_o, phi_o),
    };
    usable.pairs = used.into_par_iter().map(pair).collect();
    Ok(usable)
}

/// The channels: named by `channels`, else by their arrays, else by their wavelengths.
fn channels(arrays: &mut Arrays<'_, '_>, single: &[String], number: usize) -> Result<Vec<Channel>, Error> {
    let wavelengths =
        if arrays.has("wavelengths_nm") { Some(arrays.list("wavelengths_nm", Some(number))?) } else { None };
    // NaN stands for none.
    let wrong = |nm: &&f64| nm.is_infinite() || **nm <= 0.0;
    if let Some(nm) = wavelengths.iter().flatten().find(wrong) {
        return Err(arrays.about("wavelengths_nm", "wavelengths above 0, or NaN for none", format!("{nm}")));
    }
    let names = if arrays.has("channels") {
        let names = arrays.texts("channels")?;
        if names.len() != number {
            return Err(arrays.about("channels", &format!("{number} names"), names.len().to_string()));
        }
        Some(names)
    } else if single.is_empty() {
        None
    } else {
        Some(single.to_vec())
    };
    let mut channels: Vec<Channel> = Vec::new();
    let mut seen = std::collections::HashSet::new();
    for index in 0..number {
        let nm = wavelengths.as_ref().and_then(|list| list.get(index)).copied().filter(|nm| !nm.is_nan());
        let channel = match (names.as_ref().and_then(|names| names.get(index)), nm) {
            (Some(name), None) => Channel::named(name.trim()),
            (Some(name), nm) => Channel { name: name.trim().to_owned(), wavelength_nm: nm },
            (None, Some(nm)) => Channel::at_wavelength(nm),
            (None, None) if number == 1 => Channel::named("f"),
            (None, None) => Channel::named(&format!("f{}", index + 1)),
        };
        if channel.name.is_empty()
            || channel.name.contains(char::is_control)
            || !seen.insert(channel.name.clone())
        {
            let expected = "different names of channels, without control characters";
            return Err(arrays.about("channels", expected, excerpt(&channel.name)));
        }
        channels.push(channel);
    }
    Ok(channels)
}

/// The standard deviations, if every channel has them: `sigma_NAME` before `sigma`.
fn sigma(
    arrays: &mut Arrays<'_, '_>,
    channels: &[Channel],
    samples: usize,
) -> Result<Option<Vec<Vec<f64>>>, Error> {
    let common = if arrays.has("sigma") { Some(arrays.by_channel("sigma", samples)?) } else { None };
    if let Some(common) = &common
        && common.len() != 1
        && common.len() != channels.len()
    {
        let expected = format!("as many columns as channels, {}", channels.len());
        return Err(arrays.about("sigma", &expected, common.len().to_string()));
    }
    let mut sigma = Vec::new();
    for (index, channel) in channels.iter().enumerate() {
        let own = format!("sigma_{}", channel.name);
        let row = match &common {
            _ if arrays.has(&own) => Some(arrays.list(&own, Some(samples))?),
            Some(common) if common.len() == 1 => common.first().cloned(),
            Some(common) => common.get(index).cloned(),
            None => None,
        };
        let Some(row) = row else { return Ok(None) };
        sigma.push(row);
    }
    Ok(Some(sigma))
}
