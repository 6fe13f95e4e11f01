//! Reads a file: checks its fields, and draws samples.

use super::adaptive::{Adaptive, Symmetry};
use super::tensor::{Content, Field, Header, Kind};
use super::warp::{Table, Warp};
use crate::error::Error;
use crate::geometry::{Directions, Pair};
use crate::measurement::formats::fields::HORIZON_TOLERANCE;
use crate::measurement::formats::{File, ReadOptions};
use crate::measurement::{Channel, Continuous, Instrument, Measurement, Remark};
use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::Arc;

/// The largest number of directions that samples are drawn at: a fit to them takes seconds.
const MOST_SAMPLES: usize = 20_000;
/// The longest description that is kept, in characters.
const LONGEST_DESCRIPTION: usize = 1000;

pub(super) fn read(file: &mut File<'_>, _: &ReadOptions) -> Result<Measurement, Error> {
    let header = Header::read(file)?;
    // What the header says is checked before anything else is read.
    let layout = Layout::of(&header)?;
    let content = header.content(file)?;
    let description = description(&content)?;
    let (adaptive, channels) = layout.adaptive(&content)?;
    let drawn = draw(&adaptive);
    if drawn.pairs.is_empty() {
        return Err(Error::no_samples(file.path, &drawn.dropped));
    }
    Ok(Measurement {
        dropped: drawn.dropped,
        remarks: vec![Remark::Drawn { grid: drawn.grid }],
        instrument: Instrument { description, ..Instrument::default() },
        continuous: Some(Arc::new(adaptive) as Arc<dyn Continuous>),
        ..Measurement::of(channels, Directions::Scattered(drawn.pairs), drawn.values)
    })
}

/// The sizes of a file's tables, which agree with each other.
struct Layout {
    ndf: [usize; 2],
    sigma: [usize; 2],
    vndf: [usize; 2],
    channels: usize,
    side: usize,
    /// Whether the channels are wavelengths.
    spectral: bool,
}

impl Layout {
    /// Checks the types and the sizes of all fields.
    fn of(header: &Header<'_>) -> Result<Self, Error> {
        let (_, [_]) = header.field("description", Kind::U8)?;
        let (_, [phi_i]) = header.field("phi_i", Kind::F32)?;
        let (_, [theta_i]) = header.field("theta_i", Kind::F32)?;
        let (field, ndf) = header.field("ndf", Kind::F32)?;
        at_least_two(header, field, "ndf", ndf)?;
        let (field, sigma) = header.field("sigma", Kind::F32)?;
        at_least_two(header, field, "sigma", sigma)?;
        let (field, [k, j, rows, columns]) = header.field("vndf", Kind::F32)?;
        let incidence = format!("{phi_i} x {theta_i}");
        let begins = |name: &str| {
            format!("field '{name}' to begin with the numbers of phi_i and theta_i, {incidence}")
        };
        if (k, j) != (phi_i, theta_i) {
            return Err(header.wrong(field, &begins("vndf"), &field.shown()));
        }
        at_least_two(header, field, "vndf", [rows, columns])?;
        // As in other readers, wavelengths make a file spectral.
        let spectral = header.find("wavelengths").is_some() || header.find("spectra").is_some();
        let (name, wanted) = if spectral {
            ("spectra", header.field::<1>("wavelengths", Kind::F32)?.1[0])
        } else if header.find("rgb").is_some() {
            ("rgb", 3)
        } else {
            return Err(header.missing("a field 'rgb', or 'spectra' and 'wavelengths'"));
        };
        let (field, [k, j, channels, side, other]) = header.field(name, Kind::F32)?;
        if (k, j) != (phi_i, theta_i) {
            return Err(header.wrong(field, &begins(name), &field.shown()));
        }
        if channels != wanted || side != other {
            let expected = format!("field '{name}' with {wanted} channels of as many rows as columns");
            return Err(header.wrong(field, &expected, &field.shown()));
        }
        at_least_two(header, field, name, [side, other])?;
        let (field, luminance) = header.field::<4>("luminance", Kind::F32)?;
        if luminance != [phi_i, theta_i, side, side] {
            let expected = format!("field 'luminance' with {incidence} x {side} x {side} numbers");
            return Err(header.wrong(field, &expected, &field.shown()));
        }
        let (field, jacobian) = header.field::<1>("jacobian", Kind::U8)?;
        if jacobian != [1] {
            return Err(header.wrong(field, "one number in field 'jacobian'", &field.shown()));
        }
        Ok(Self { ndf, sigma, vndf: [rows, columns], channels, side, spectral })
    }

    /// The parameterisation and the channels.
    fn adaptive(&self, content: &Content<'_>) -> Result<(Adaptive, Vec<Channel>), Error> {
        let header = &content.header;
        let floats = |name: &str| content.floats(header.any(name)?);
        let angles = |name, range| {
            increasing(content, name, range)
                .map(|angles| angles.into_iter().map(f64::from).collect::<Vec<_>>())
        };
        let theta_i = angles("theta_i", (0.0, FRAC_PI_2 + HORIZON_TOLERANCE))?;
        let phi_i = angles("phi_i", (-TAU - HORIZON_TOLERANCE, TAU + HORIZON_TOLERANCE))?;
        let symmetry = symmetry(content, &phi_i)?;
        let table =
            |name: &str, [height, width]: [usize; 2]| floats(name).map(|data| Table { width, height, data });
        let (ndf, sigma) = (table("ndf", self.ndf)?, table("sigma", self.sigma)?);
        positive(content, "sigma", &sigma.data)?;
        not_negative(content, "ndf", &ndf.data)?;
        let [height, width] = self.vndf;
        let vndf = floats("vndf")?;
        not_negative(content, "vndf", &vndf)?;
        let vndf = Warp::new(width, height, vndf).map_err(|index| {
            let place = index.saturating_mul(width * height);
            let found = format!("nothing but zeros in table {}", index + 1);
            header.any("vndf").map_or_else(
                |error| error,
                |field| content.wrong(field, place, "densities of normals in field 'vndf'", &found),
            )
        })?;
        // Only a renderer needs the luminance, to draw directions. A file in which it is not finite is damaged all the same.
        floats("luminance")?;
        let (name, channels) = if self.spectral {
            let nm = increasing(content, "wavelengths", (f64::MIN_POSITIVE, f64::MAX))?;
            // 360.1 nm is meant, not the nearest float to it, which has more digits than a name should have.
            let decimal = |nm: f32| nm.to_string().parse().unwrap_or(f64::from(nm));
            ("spectra", nm.into_iter().map(|nm| Channel::at_wavelength(decimal(nm))).collect())
        } else {
            ("rgb", ["r", "g", "b"].map(Channel::named).to_vec())
        };
        let spectra = floats(name)?;
        let scaled = content.bytes(header.any("jacobian")?) != [0];
        let (channels_number, side) = (self.channels, self.side);
        Ok((
            Adaptive {
                phi_i,
                theta_i,
                symmetry,
                ndf,
                sigma,
                vndf,
                channels: channels_number,
                side,
                spectra,
                scaled,
            },
            channels,
        ))
    }
}

/// Checks that a table has nodes to interpolate between.
fn at_least_two(header: &Header<'_>, field: &Field, name: &str, sizes: [usize; 2]) -> Result<(), Error> {
    if sizes.iter().all(|size| *size >= 2) {
        return Ok(());
    }
    Err(header.wrong(field, &format!("field '{name}' with two or more rows and columns"), &field.shown()))
}

/// The numbers of a field, which must increase and lie in a range.
fn increasing(content: &Content<'_>, name: &str, (least, most): (f64, f64)) -> Result<Vec<f32>, Error> {
    let field = content.header.any(name)?;
    let numbers = content.floats(field)?;
    for (at, number) in numbers.iter().enumerate() {
        let value = f64::from(*number);
        let previous = at.checked_sub(1).and_then(|before| numbers.get(before));
        if value < least || value > most {
            let expected = if most == f64::MAX {
                format!("positive numbers in field '{name}'")
            } else {
                format!("angles from {least:.4} to {most:.4} radians in field '{name}'")
            };
            return Err(content.wrong(field, at, &expected, &number.to_string()));
        }
        if let Some(previous) = previous.filter(|previous| *previous >= number) {
            let expected = format!("increasing numbers in field '{name}'");
            return Err(content.wrong(field, at, &expected, &format!("{number} after {previous}")));
        }
    }
    Ok(numbers)
}

fn not_negative(content: &Content<'_>, name: &str, numbers: &[f32]) -> Result<(), Error> {
    refuse(content, name, numbers, "no negative number", |number| number < 0.0)
}

fn positive(content: &Content<'_>, name: &str, numbers: &[f32]) -> Result<(), Error> {
    refuse(content, name, numbers, "nothing but positive numbers", |number| number <= 0.0)
}

/// Refuses a field that has a number of that kind.
fn refuse(
    content: &Content<'_>,
    name: &str,
    numbers: &[f32],
    expected: &str,
    wrong: impl Fn(f32) -> bool,
) -> Result<(), Error> {
    let found = numbers.iter().enumerate().find(|(_, number)| wrong(**number));
    found.map_or(Ok(()), |(at, number)| {
        let expected = format!("{expected} in field '{name}'");
        Err(content.wrong(content.header.any(name)?, at, &expected, &number.to_string()))
    })
}

/// The symmetry of an anisotropic material: the part of a turn that its azimuths of incidence cover, rounded.
fn symmetry(content: &Content<'_>, phi_i: &[f64]) -> Result<Symmetry, Error> {
    let &[first, _, .., last] = phi_i else { return Ok(Symmetry::None) };
    let middle = 0.5 * (first + last);
    match (TAU / (last - first)).round() {
        1.0 => Ok(Symmetry::None),
        2.0 => Ok(Symmetry::half_turn(middle)),
        4.0 => Ok(Symmetry::mirrors(middle)),
        _ => {
            let expected = "a whole, half or quarter turn of azimuths in field 'phi_i'";
            let found = format!("{:.2} to {:.2} degrees", first.to_degrees(), last.to_degrees());
            Err(content.wrong(content.header.any("phi_i")?, 0, expected, &found))
        }
    }
}

/// The description in one line; `None` if it is blank.
fn description(content: &Content<'_>) -> Result<Option<String>, Error> {
    let bytes = content.bytes(content.header.any("description")?);
    let text = String::from_utf8_lossy(bytes);
    let clean: String =
        text.chars().take(LONGEST_DESCRIPTION).map(|c| if c.is_control() { ' ' } else { c }).collect();
    let clean = clean.split_whitespace().collect::<Vec<_>>().join(" ");
    Ok((!clean.is_empty()).then_some(clean))
}

/// Samples of a BRDF.
struct Drawn {
    pairs: Vec<Pair>,
    values: Vec<Vec<f64>>,
    dropped: BTreeMap<&'static str, usize>,
    grid: String,
}

/// Draws samples at the nodes of the tables, where the file says what was measured and interpolates nothing.
fn draw(adaptive: &Adaptive) -> Drawn {
    let (thetas, side) = (adaptive.theta_i.len(), adaptive.side);
    let phis = azimuths(&adaptive.phi_i);
    let tables = phis * thetas;
    // Every node, or as many as there may be: one in `step` along either side, and one in `skip` tables where there are that many.
    let step =
        (1..side).find(|step| tables * side.div_ceil(*step).pow(2) <= MOST_SAMPLES).unwrap_or(side - 1);
    let skip = (tables * side.div_ceil(step).pow(2)).div_ceil(MOST_SAMPLES);
    let mut drawn = Drawn {
        pairs: Vec::new(),
        values: vec![Vec::new(); adaptive.channels],
        dropped: BTreeMap::new(),
        grid: String::new(),
    };
    let mut below_horizon = 0;
    for table in (0..tables).step_by(skip) {
        let (k, j) = (table / thetas, table % thetas);
        let mut nodes = Vec::new();
        // The first and the last row are the same azimuth, and all nodes of the first column are the normal.
        for row in (0..side - 1).step_by(step) {
            for column in (0..side).step_by(step) {
                if column == 0 && row != 0 {
                    continue;
                }
                let node = adaptive.node(k, j, column, row);
                let lowest = node.pair.wi.z.min(node.pair.wo.z);
                if lowest > HORIZON_TOLERANCE {
                    nodes.push((row * side + column, node.scale / node.pair.wo.z));
                    drawn.pairs.push(node.pair);
                } else {
                    below_horizon += 1;
                }
            }
        }
        for (channel, values) in drawn.values.iter_mut().enumerate() {
            let stored = adaptive.table(k, j, channel);
            values.extend(nodes.iter().filter_map(|(at, scale)| Some(f64::from(*stored.get(*at)?) * scale)));
        }
    }
    if below_horizon > 0 {
        drawn.dropped.insert("below-horizon", below_horizon);
    }
    drawn.grid = grid(phis, thetas, side, step, skip);
    drawn
}

/// The number of different azimuths of incidence: after a whole turn, the last is the first again.
fn azimuths(phi_i: &[f64]) -> usize {
    match phi_i {
        [first, _, .., last] if last - first > TAU - 1e-3 => phi_i.len() - 1,
        _ => phi_i.len(),
    }
}

/// The grid of the samples, in words.
fn grid(phis: usize, thetas: usize, side: usize, step: usize, skip: usize) -> String {
    let incidence = if phis == 1 {
        format!("{thetas} angles of incidence")
    } else {
        format!("{phis} azimuths x {thetas} angles of incidence")
    };
    let nodes = match step {
        1 => format!("the {side} x {side} nodes"),
        _ => format!("one in {step} along either side of the {side} x {side} nodes"),
    };
    let tables = match skip {
        1 => format!("the {incidence}"),
        _ => format!("one in {skip} of the {incidence}"),
    };
    format!("{nodes} that the file has for each of {tables}, denser where its density of normals is higher")
}
