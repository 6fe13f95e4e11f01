//! Writes SSDD.

use super::parameters::Parameters;
use crate::error::{Error, excerpt, listed};
use crate::geometry::Pair;
use crate::measurement::formats::specular::SpecularGrid;
use crate::measurement::formats::writing::{Subject, Written};
use std::fmt::Write as _;

/// The largest table that is written as text, in numbers.
const MOST_TEXT: usize = 200_000;

pub(super) fn write(subject: &Subject<'_>) -> Result<Written, Error> {
    let colours = Colours::of(subject)?;
    let grid = SpecularGrid::of(subject);
    let mut losses = Vec::new();
    if subject.measurement.is_some_and(|measurement| measurement.sigma.is_some()) {
        losses.push("an SSDD file has no standard deviations".to_owned());
    }
    let mut text = format!("VERSION 0.3\nSOFTWARE brdfit-{}\n\nDATA_TYPE brdf\n", env!("CARGO_PKG_VERSION"));
    let _ = writeln!(text, "COLOR_MODEL {}", colours.model);
    let list = |angles: &[f64]| angles.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ");
    if !colours.wavelengths.is_empty() {
        let _ = writeln!(text, "WAVELENGTH_LIST {}", list(&colours.wavelengths));
    }
    let _ = writeln!(text, "PARAM_TYPE {}", Parameters::Specular.name());
    if subject.isotropic {
        let _ = writeln!(text, "REDUCTION_TYPE bilateral_symmetry");
    }
    let _ = writeln!(text, "PARAM0_LIST {}", list(&grid.incidences));
    if !subject.isotropic {
        let _ = writeln!(text, "PARAM1_LIST {}", list(&grid.rotations));
    }
    let _ = writeln!(text, "PARAM2_LIST {}\nPARAM3_LIST {}", list(&grid.radials), list(&grid.azimuths));
    let about = subject.about.replace(char::is_control, " ");
    if !about.trim().is_empty() {
        let _ = writeln!(text, "NAME {}", about.trim());
    }
    let source = if subject.measurement.is_some() { "measured" } else { "generated" };
    let _ = writeln!(text, "SOURCE_TYPE {source}");

    let blocks = blocks(subject, &grid, &colours.order)?;
    let numbers = blocks.iter().map(|block| block.iter().map(Vec::len).sum::<usize>()).sum::<usize>();
    let mut bytes = Vec::new();
    let binary = numbers > MOST_TEXT;
    let _ = writeln!(text, "DATA {}", if binary { "binary" } else { "ascii" });
    let places = grid.azimuths.len() * grid.radials.len();
    // The blocks are by azimuth and angle of incidence of the light, which are the fastest in the file; in a block the radial angle is the
    // fastest.
    for azimuth in 0..grid.azimuths.len() {
        for radial in 0..grid.radials.len() {
            let place = azimuth * grid.radials.len() + radial;
            debug_assert!(place < places);
            for block in &blocks {
                let colour = block.iter().filter_map(|row| row.get(place)).copied();
                if binary {
                    colour.for_each(|value| bytes.extend(single(value).to_le_bytes()));
                } else {
                    let words: Vec<String> = colour.map(|value| format!("{value:.7e}")).collect();
                    let _ = writeln!(text, "{}", words.join(" "));
                }
            }
        }
    }
    let mut file = text.into_bytes();
    file.append(&mut bytes);
    Ok(Written { bytes: file, losses })
}

/// A value as a 32-bit float, the largest one if it is larger.
#[expect(clippy::cast_possible_truncation, reason = "the format has 32-bit floats")]
fn single(value: f64) -> f32 {
    value.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32
}

/// The values by azimuth and angle of incidence of the light, the latter faster; of each, the channels in their order in the file, with a
/// value per place of the grid, 0 below the horizon.
fn blocks(subject: &Subject<'_>, grid: &SpecularGrid, order: &[usize]) -> Result<Vec<Vec<Vec<f64>>>, Error> {
    let mut blocks = Vec::new();
    for rotation in &grid.rotations {
        for incidence in &grid.incidences {
            let places = grid.above_horizon(*rotation, *incidence);
            let pairs: Vec<Pair> = places.iter().flatten().copied().collect();
            let values = (subject.at)(&pairs);
            let mut block = Vec::new();
            for channel in order {
                let row = values.get(*channel).map(Vec::as_slice).unwrap_or_default();
                if row.iter().any(|f| !f.is_finite()) {
                    let found = format!("NaN or infinity at incidence {incidence}");
                    return Err(Error::invalid("values", "finite values", found));
                }
                let mut row = row.iter().copied();
                block.push(places.iter().map(|p| p.and_then(|_| row.next()).unwrap_or_default()).collect());
            }
            blocks.push(block);
        }
    }
    Ok(blocks)
}

/// How the channels are called in a file.
struct Colours {
    model: &'static str,
    /// Wavelengths in nm, ascending; none unless the model is a spectrum.
    wavelengths: Vec<f64>,
    /// The channels in the order of the file.
    order: Vec<usize>,
}

impl Colours {
    fn of(subject: &Subject<'_>) -> Result<Self, Error> {
        let names: Vec<&str> = subject.channels.iter().map(|channel| channel.name.as_str()).collect();
        let order: Vec<usize> = (0..names.len()).collect();
        let plain = |model| Ok(Self { model, wavelengths: Vec::new(), order: order.clone() });
        let wavelengths: Option<Vec<f64>> =
            subject.channels.iter().map(|channel| channel.wavelength_nm).collect();
        if let Some(wavelengths) = wavelengths {
            let mut both: Vec<(f64, usize)> = wavelengths.into_iter().zip(order).collect();
            both.sort_by(|a, b| a.0.total_cmp(&b.0));
            let (wavelengths, order) = both.into_iter().unzip();
            return Ok(Self { model: "spectrum", wavelengths, order });
        }
        match names.as_slice() {
            [_] => plain("monochrome"),
            ["r", "g", "b"] => plain("rgb"),
            ["X", "Y", "Z"] => plain("xyz"),
            names => {
                let expected =
                    "one channel, r, g, b, or X, Y, Z, or wavelengths, which is what an SSDD file holds";
                Err(Error::invalid("channels", expected, excerpt(&listed(names))))
            }
        }
    }
}
