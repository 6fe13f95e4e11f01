//! Writes Zemax's tabular BSDF.

use super::keywords::LISTS;
use crate::error::Error;
use crate::geometry::Pair;
use crate::measurement::formats::specular::{LEAST_COSINE, SpecularGrid, pair};
use crate::measurement::formats::writing::{Covered, Subject, Written};
use std::f64::consts::PI;
use std::fmt::Write as _;

pub(super) fn write(subject: &Subject<'_>) -> Result<Written, Error> {
    subject.check_channels()?;
    let grid = SpecularGrid::of(subject);
    let mut losses: Vec<String> = subject.gaps().into_iter().collect();
    let tristimulus = subject.channels.iter().map(|channel| channel.name.as_str()).eq(["X", "Y", "Z"]);
    if !tristimulus && subject.channels.len() > 1 {
        let names: Vec<&str> = subject.channels.iter().map(|channel| channel.name.as_str()).collect();
        losses.push(format!(
            "a Zemax file has one channel, or X, Y and Z: the mean of {} was written",
            crate::error::listed(&names)
        ));
    }
    if subject.channels.iter().any(|channel| channel.wavelength_nm.is_some()) {
        losses.push("a Zemax file has no wavelengths".to_owned());
    }
    if subject.measurement.is_some_and(|measurement| measurement.sigma.is_some()) {
        losses.push("a Zemax file has no standard deviations".to_owned());
    }
    let symmetry = match (subject.isotropic, grid.rotations.len()) {
        (true, _) => "PlaneSymmetrical",
        (false, 1) => "Asymmetrical",
        (false, _) => "Asymmetrical4D",
    };
    let content = if tristimulus { "XYZ" } else { "Monochrome" };
    let about = subject.about.replace(char::is_control, " ");
    let mut text = format!(
        "# {about}\nSource\tMeasured\nSymmetry\t{symmetry}\nSpectralContent\t{content}\nScatterType\tBRDF\n"
    );
    // Some readers take only tabs between angles, and none after the last.
    for (keyword, angles) in
        LISTS.iter().zip([&grid.rotations, &grid.incidences, &grid.azimuths, &grid.radials])
    {
        let listed: Vec<String> = angles.iter().map(ToString::to_string).collect();
        let _ = write!(text, "{keyword}\t{}\n{}\n", angles.len(), listed.join("\t"));
    }
    let blocks = Blocks::of(subject, &grid, !tristimulus)?;
    losses.extend(blocks.covered.loss());
    if blocks.zeros > 0 {
        losses.push(format!(
            "0 means \"not measured\" in a Zemax file: {} values above the horizon are 0",
            blocks.zeros
        ));
    }
    let labels: &[&str] =
        if tristimulus { &["TristimulusX", "TristimulusY", "TristimulusZ"] } else { &["Monochrome"] };
    for (label, blocks) in labels.iter().zip(&blocks.of_channels) {
        let _ = write!(text, "\n{label}\nDataBegin\n");
        for block in blocks {
            let _ = writeln!(text, "TIS\t{:.6e}", block.share);
            for row in block.values.chunks(grid.radials.len().max(1)) {
                let listed: Vec<String> = row.iter().map(|value| format!("{value:.6e}")).collect();
                let _ = writeln!(text, "{}", listed.join("\t"));
            }
        }
        let _ = writeln!(text, "DataEnd");
    }
    Ok(Written { bytes: text.into_bytes(), losses })
}

/// The values of one channel at one azimuth and angle of incidence.
struct Block {
    /// The integral of f cos(theta_o).
    share: f64,
    /// f in 1/sr, 0 below the horizon.
    values: Vec<f64>,
}

/// The blocks of a file.
struct Blocks {
    of_channels: Vec<Vec<Block>>,
    /// The number of values above the horizon that are 0.
    zeros: usize,
    /// How many of the directions have data around them.
    covered: Covered,
}

impl Blocks {
    fn of(subject: &Subject<'_>, grid: &SpecularGrid, mean: bool) -> Result<Self, Error> {
        let channels = if mean { 1 } else { subject.channels.len() };
        let mut blocks = Self {
            of_channels: (0..channels).map(|_| Vec::new()).collect(),
            zeros: 0,
            covered: Covered::default(),
        };
        for rotation in &grid.rotations {
            for incidence in &grid.incidences {
                let places = grid.above_horizon(*rotation, *incidence);
                let pairs: Vec<Pair> = places.iter().flatten().copied().collect();
                blocks.covered.count(subject, &pairs);
                let (around, weights) = hemisphere(*incidence, *rotation, subject.isotropic);
                let [values, everywhere] =
                    [&pairs, &around].map(|pairs| channel_values(subject, pairs, mean));
                for ((blocks_of, row), all) in blocks.of_channels.iter_mut().zip(values).zip(everywhere) {
                    let share = all.iter().zip(&weights).map(|(f, weight)| f * weight).sum::<f64>();
                    if !share.is_finite() || row.iter().any(|f| !f.is_finite()) {
                        let found = format!("NaN or infinity at incidence {incidence}");
                        return Err(Error::invalid("values", "finite values", found));
                    }
                    let mut row = row.into_iter();
                    let filled = places
                        .iter()
                        .map(|place| place.and_then(|_| row.next()).unwrap_or_default())
                        .collect::<Vec<_>>();
                    let above = filled.iter().zip(&places).filter(|(_, place)| place.is_some());
                    blocks.zeros += above.filter(|(f, _)| **f == 0.0).count();
                    blocks_of.push(Block { share, values: filled });
                }
            }
        }
        Ok(blocks)
    }
}

/// The values of the channels that are written, or their mean.
fn channel_values(subject: &Subject<'_>, pairs: &[Pair], mean: bool) -> Vec<Vec<f64>> {
    let values = (subject.at)(pairs);
    if !mean {
        return values;
    }
    let share = 1.0 / crate::math::count(values.len().max(1));
    let mut sum = vec![0.0; pairs.len()];
    for row in &values {
        sum.iter_mut().zip(row).for_each(|(sum, value)| *sum += value * share);
    }
    vec![sum]
}

/// Pairs of directions all over the hemisphere, and the solid angle that each stands for times cos(theta_o): dense at the mirror
/// direction, where lobes are.
fn hemisphere(incidence: f64, rotation: f64, half: bool) -> (Vec<Pair>, Vec<f64>) {
    const RADIALS: u32 = 160;
    const AZIMUTHS: u32 = 24;
    let (turn, sides) = if half { (180.0, 2.0) } else { (360.0, 1.0) };
    let azimuths = if half { AZIMUTHS } else { 2 * AZIMUTHS };
    let step = 1.0 / f64::from(RADIALS);
    let mut pairs = Vec::new();
    let mut weights = Vec::new();
    for k in 0..RADIALS {
        // r = pi u^2 spends half of the directions within 45 degrees, and dr = 2 pi u du.
        let u = (f64::from(k) + 0.5) * step;
        let radial = PI * u * u;
        let ring = radial.sin() * 2.0 * PI * u * step * sides * f64::to_radians(turn) / f64::from(azimuths);
        for j in 0..azimuths {
            let azimuth = (f64::from(j) + 0.5) * turn / f64::from(azimuths);
            let pair = pair([incidence, rotation], 0.0, radial.to_degrees(), azimuth);
            if pair.wi.z > LEAST_COSINE && pair.wo.z > LEAST_COSINE {
                pairs.push(pair);
                weights.push(ring * pair.wo.z);
            }
        }
    }
    (pairs, weights)
}
