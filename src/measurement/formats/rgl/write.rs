//! Writes a BRDF in the adaptive parameterisation.
//!
//! As for a measurement, the density of normals comes from the BRDF itself: light that is sent back to where it came from was reflected by
//! facets that face it, D(m) ~ f(m, m) cos(theta_m) sigma(m), with sigma(m) the projected area of D, found by a few iterations (Dupuy
//! and Jakob 2018, section 3.2). Where nothing comes back, for example between the lobe of a metal and the horizon, a small uniform part
//! keeps the density positive. Whatever the density, the tables hold f exactly at their nodes: it only decides where these lie.

#![allow(
    clippy::indexing_slicing,
    clippy::cast_precision_loss,
    reason = "all sizes are constants of this file, or lengths of lists of angles"
)]

use super::adaptive::{Adaptive, Symmetry, unit_to_azimuth, unit_to_polar};
use super::tensor::{NewField, encode};
use super::warp::{Table, Warp};
use crate::error::Error;
use crate::geometry::{Pair, direction};
use crate::measurement::formats::writing::{Subject, Written};
use crate::measurement::red_green_blue;
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Numbers of nodes of the tables.
struct Sizes {
    /// Of the density of normals: azimuths and polar angles.
    ndf: [usize; 2],
    /// Of its projected area.
    sigma: [usize; 2],
    /// Of the density of visible normals.
    vndf: [usize; 2],
    /// Along either side of the tables of spectra, at most.
    side: usize,
}

/// Those of isotropic BRDFs. The database's files have 2 x 128, 2 x 128, 128 x 128 and 32.
const ISOTROPIC: Sizes = Sizes { ndf: [2, 1024], sigma: [2, 256], vndf: [128, 128], side: 64 };
/// Those of anisotropic BRDFs, which have many more tables.
const ANISOTROPIC: Sizes = Sizes { ndf: [256, 256], sigma: [64, 64], vndf: [64, 64], side: 32 };

/// The largest angle of incidence, degrees: at 90 degrees f has no value.
const LARGEST_DEG: f64 = 89.9;
/// Number of angles of incidence of an isotropic BRDF.
const THETA_I: usize = 40;
/// Number of angles of incidence of an anisotropic BRDF.
const ANISOTROPIC_THETA_I: usize = 18;
/// Number of azimuths of incidence of an anisotropic BRDF, -180 and 180 degrees both counted.
const PHI_I: usize = 25;
/// Number of values in the tables of spectra from which on they get fewer nodes, and the least number of these along either side.
const MANY_VALUES: usize = 8_000_000;
const LEAST_SIDE: usize = 24;
/// The part of the density of normals that is uniform.
const UNIFORM: f64 = 0.1;
/// The number of iterations of the projected area: each reduces the error by the ratio of two eigenvalues, a third or less.
const ITERATIONS: usize = 6;
/// f is evaluated no lower above the horizon than at this cosine.
const LOWEST: f64 = 1e-4;

/// The mean of f over the channels at pairs of directions.
type Mean<'a> = dyn Fn(&[Pair]) -> Vec<f64> + 'a;

/// How f is called in the file.
enum Colours {
    /// Wavelengths in nm, increasing, each the channel with this index.
    Spectral(Vec<(usize, f64)>),
    /// The channels that are red, green and blue.
    Rgb([usize; 3]),
}

pub(super) fn write(subject: &Subject<'_>) -> Result<Written, Error> {
    subject.check_channels()?;
    let mut losses: Vec<String> = subject.gaps().into_iter().collect();
    let colours = colours(subject, &mut losses)?;
    let (phi_i, theta_i) = incidence(subject, &mut losses);
    let sizes = if subject.isotropic { &ISOTROPIC } else { &ANISOTROPIC };
    let mean = |pairs: &[Pair]| -> Vec<f64> {
        let values = (subject.at)(pairs);
        let sum = |at: usize| values.iter().map(|row| row[at]).sum::<f64>();
        (0..pairs.len()).map(|at| sum(at) / values.len().max(1) as f64).collect()
    };
    let (ndf, sigma) = normals(sizes, subject.isotropic, &mean);
    let vndf = followed(sizes, &ndf, &phi_i, &theta_i, &mean);
    let warp = Warp::new(sizes.vndf[1], sizes.vndf[0], vndf.clone()).map_err(|_| Error::Encoding {
        format: "rgl",
        reason: "the BRDF has no density of normals".to_owned(),
    })?;
    let channels = match &colours {
        Colours::Spectral(wavelengths) => wavelengths.len(),
        Colours::Rgb(_) => 3,
    };
    let nodes = MANY_VALUES / (phi_i.len() * theta_i.len() * channels);
    let mut adaptive = Adaptive {
        phi_i,
        theta_i,
        symmetry: Symmetry::None,
        ndf,
        sigma,
        vndf: warp,
        channels,
        side: nodes.isqrt().clamp(LEAST_SIDE, sizes.side),
        spectra: Vec::new(),
        scaled: true,
    };
    let filled = spectra(subject, &colours, &mut adaptive)?;
    what_is_lost(subject, &adaptive, &filled, &mut losses);
    Ok(Written { bytes: bytes(subject, sizes, &colours, &adaptive, &vndf, &filled.luminance), losses })
}

/// How the channels are stored.
fn colours(subject: &Subject<'_>, losses: &mut Vec<String>) -> Result<Colours, Error> {
    let channels = subject.channels;
    let wavelengths: Option<Vec<f64>> = channels.iter().map(|channel| channel.wavelength_nm).collect();
    if let Some(wavelengths) = wavelengths.filter(|wavelengths| !wavelengths.is_empty()) {
        let mut sorted: Vec<(usize, f64)> = wavelengths.into_iter().enumerate().collect();
        sorted.sort_by(|a, b| a.1.total_cmp(&b.1));
        return Ok(Colours::Spectral(sorted));
    }
    let names: Vec<&str> = channels.iter().map(|channel| channel.name.as_str()).collect();
    if let Some(planes) = red_green_blue(&names) {
        if names.len() == 1 {
            losses.push(
                "the format has wavelengths or red, green and blue: the one channel was written as all three"
                    .to_owned(),
            );
        }
        return Ok(Colours::Rgb(planes));
    }
    let reason = format!(
        "the format has channels r, g, b, or wavelengths, and these are {}",
        crate::error::listed(&names)
    );
    Err(Error::Encoding { format: "rgl", reason })
}

/// The azimuths and the polar angles of incidence, radians.
fn incidence(subject: &Subject<'_>, losses: &mut Vec<String>) -> (Vec<f64>, Vec<f64>) {
    let grid = subject.grid;
    let list = |given: Option<&Vec<f64>>, most: f64| -> Vec<f64> {
        let mut angles: Vec<f64> = given.into_iter().flatten().map(|angle| angle.min(most)).collect();
        angles.sort_by(f64::total_cmp);
        angles.dedup();
        angles
    };
    // The tables at the last angle hold up to the horizon, where f has no value.
    let mut theta_i = list(grid.map(|grid| &grid.theta_i_deg), LARGEST_DEG);
    if theta_i.is_empty() {
        theta_i = angles_of_incidence(if subject.isotropic { THETA_I } else { ANISOTROPIC_THETA_I });
    }
    let mut phi_i = list(grid.map(|grid| &grid.phi_i_deg), 360.0);
    // Readers have azimuths from -180 to 180 degrees, and take a file with one or two of them for that of an isotropic material.
    let whole = |angles: &[f64]| matches!(angles, [first, _, .., last] if *first == -180.0 && *last == 180.0);
    if subject.isotropic {
        phi_i = vec![0.0];
    } else if !whole(&phi_i) {
        if !phi_i.is_empty() {
            losses.push(
                "the azimuths of incidence asked for are not a whole turn from -180 to 180 degrees, which the format needs: others were chosen"
                    .to_owned(),
            );
        }
        phi_i = (0..PHI_I).map(|k| -180.0 + 360.0 * k as f64 / (PHI_I - 1) as f64).collect();
    }
    if grid.is_some_and(|grid| !grid.theta_o_deg.is_empty() || !grid.phi_deg.is_empty()) {
        losses.push("viewing angles follow the density of normals: those asked for were not used".to_owned());
    }
    // What a reader finds in the file is what the tables are made for.
    let stored = |degrees: &f64| f64::from(single(degrees.to_radians()));
    (phi_i.iter().map(stored).collect(), theta_i.iter().map(stored).collect())
}

/// Angles of incidence in degrees, closer together towards grazing, where the Fresnel terms and the shadowing change fastest.
fn angles_of_incidence(number: usize) -> Vec<f64> {
    (0..number).map(|j| LARGEST_DEG * (1.0 - (1.0 - unit(j, number)).powi(2))).collect()
}

#[expect(clippy::cast_possible_truncation, reason = "the format stores single precision")]
fn single(number: f64) -> f32 {
    number.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32
}

/// The coordinate of a node.
fn unit(at: usize, nodes: usize) -> f64 {
    at as f64 / (nodes - 1) as f64
}

/// The normal at a point of the unit square, and the solid angle per area there.
fn normal(u: f64, v: f64) -> (DVec3, f64) {
    let theta = unit_to_polar(u);
    (direction(theta, unit_to_azimuth(v)), theta.sin() * PI * u * 2.0 * PI)
}

/// A point of the unit square that stands for a normal.
type Point = (f64, f64);

/// The nodes of a table, row by row.
fn nodes([height, width]: [usize; 2]) -> Vec<Point> {
    (0..height * width).map(|at| (unit(at % width, width), unit(at / width, height))).collect()
}

/// Cells that normals are integrated over.
struct Cells {
    centres: Vec<Point>,
    /// The normal in each, and its solid angle.
    normals: Vec<(DVec3, f64)>,
}

impl Cells {
    /// Number of cells along azimuths and polar angles.
    const SIZES: [usize; 2] = [64, 128];

    fn new() -> Self {
        let [height, width] = Self::SIZES;
        let centre = |at: usize| {
            ((((at % width) as f64) + 0.5) / width as f64, (((at / width) as f64) + 0.5) / height as f64)
        };
        let centres: Vec<Point> = (0..height * width).map(centre).collect();
        let of_cell = |(u, v): &Point| {
            let (m, area) = normal(*u, *v);
            (m, area / (height * width) as f64)
        };
        let normals = centres.iter().map(of_cell).collect();
        Self { centres, normals }
    }

    /// The projected area of normals of that density, seen from a direction.
    fn projected(&self, density: &[f64], from: DVec3) -> f64 {
        self.normals.iter().zip(density).map(|((m, area), d)| d * area * m.dot(from).max(0.0)).sum()
    }
}

/// f cos(theta) where light is sent back to where it came from.
fn sent_back(points: &[Point], mean: &Mean<'_>) -> Vec<f64> {
    // f has no value at the horizon.
    let towards = |(u, v): &Point| {
        let m = normal(u.min(0.999), *v).0;
        Pair { wi: m, wo: m }
    };
    let pairs: Vec<Pair> = points.iter().map(towards).collect();
    let usable = |f: f64| if f.is_finite() { f.max(0.0) } else { 0.0 };
    mean(&pairs).into_iter().zip(&pairs).map(|(f, pair)| usable(f) * pair.wi.z).collect()
}

/// The density of normals and its projected area, from the light that is sent back.
fn normals(sizes: &Sizes, isotropic: bool, mean: &Mean<'_>) -> (Table, Table) {
    // Of an isotropic BRDF, one row is evaluated, and all rows are the same.
    let rows = |[height, width]: [usize; 2]| {
        let mut points = nodes([height, width]);
        points.truncate(if isotropic { width } else { points.len() });
        points
    };
    let spread = |row: Vec<f32>, height: usize| if isotropic { row.repeat(height) } else { row };
    let cells = Cells::new();
    let at_cells = if isotropic {
        let row = sent_back(&cells.centres[..Cells::SIZES[1]], mean);
        row.iter().copied().cycle().take(cells.centres.len()).collect()
    } else {
        sent_back(&cells.centres, mean)
    };
    // D is 0.9 times what is sent back by the projected area, scaled so that seen from above its own projected area is 1, and the uniform part.
    let density = |sent: &[f64], sigma: &Table, points: &[Point]| -> Vec<f64> {
        let by_area: Vec<f64> =
            at_cells.iter().zip(&cells.centres).map(|(sent, (u, v))| sent * sigma.at([*u, *v])).collect();
        let total = cells.projected(&by_area, DVec3::Z);
        let scale = if total > 0.0 && total.is_finite() { (1.0 - UNIFORM) / total } else { 0.0 };
        let value = |(sent, (u, v)): (&f64, &Point)| scale * sent * sigma.at([*u, *v]) + UNIFORM / PI;
        sent.iter().zip(points).map(value).collect()
    };
    let [height, width] = sizes.sigma;
    let seen: Vec<DVec3> = rows(sizes.sigma).into_iter().map(|(u, v)| normal(u, v).0).collect();
    let mut sigma = Table { width: 2, height: 2, data: vec![1.0; 4] };
    for _ in 0..ITERATIONS {
        let density = density(&at_cells, &sigma, &cells.centres);
        let data = seen.par_iter().map(|from| single(cells.projected(&density, *from))).collect();
        sigma = Table { width, height, data: spread(data, height) };
    }
    let [height, width] = sizes.ndf;
    let points = rows(sizes.ndf);
    let data = density(&sent_back(&points, mean), &sigma, &points).into_iter().map(single).collect();
    let mut data = spread(data, height);
    // -180 and 180 degrees are the same azimuth.
    data.copy_within(..width, (height - 1) * width);
    (Table { width, height, data }, sigma)
}

/// The density that the nodes follow, for every direction of incidence, per area of the unit square.
///
/// A third of it is the density of visible normals. A third is that of all normals, without which hardly a node would be left for those
/// that are turned away from grazing light, per polar angle instead of solid angle: where a density vanishes with the sine of the polar
/// angle, the first cell beside the normal is a wide one, across which f changes like a square root. A third is the reflected light itself,
/// which for a glossy paint near grazing comes from the gloss, while most of what is sent back comes from the paint.
fn followed(sizes: &Sizes, ndf: &Table, phi_i: &[f64], theta_i: &[f64], mean: &Mean<'_>) -> Vec<f32> {
    let [height, width] = sizes.vndf;
    let nodes = nodes([height, width]);
    let mut density = Vec::with_capacity(phi_i.len() * theta_i.len() * nodes.len());
    for phi in phi_i {
        for theta in theta_i {
            let wi = direction(*theta, *phi);
            let light = reflected_light([height / 2, width / 2], wi, mean);
            let parts = nodes.iter().map(|(u, v)| {
                // The azimuths of normals of an isotropic BRDF count from that of incidence, 0.
                let (m, area) = normal(*u, *v);
                let d = ndf.at([*u, *v]);
                [d * area * m.dot(wi).max(0.0), d * u * m.z, light.at([*u, *v])]
            });
            let parts: Vec<[f64; 3]> = parts.collect();
            let weight = |part: usize| {
                let sum: f64 = parts.iter().map(|parts| parts[part]).sum();
                if sum > 0.0 { 1.0 / sum } else { 0.0 }
            };
            let weights = [0, 1, 2].map(weight);
            density.extend(
                parts
                    .iter()
                    .map(|parts| single(parts.iter().zip(weights).map(|(part, weight)| part * weight).sum())),
            );
        }
    }
    density
}

/// The light from `wi` that normals reflect, per area of the unit square, up to a factor.
fn reflected_light([height, width]: [usize; 2], wi: DVec3, mean: &Mean<'_>) -> Table {
    let mirrored = |at: usize| {
        let (m, area) = normal(unit(at % width, width), unit(at / width, height));
        let wo = 2.0 * m.dot(wi) * m - wi;
        // Below the horizon there is no light; f is asked for all the same, and does not count.
        let above = DVec3::new(wo.x, wo.y, wo.z.max(LOWEST)).normalize();
        (Pair { wi, wo: above }, m.dot(wi).max(0.0) * wo.z.max(0.0) * area)
    };
    let (pairs, weights): (Vec<Pair>, Vec<f64>) = (0..height * width).map(mirrored).unzip();
    let light: Vec<f64> = mean(&pairs)
        .iter()
        .zip(&weights)
        .map(|(f, weight)| if f.is_finite() { f.max(0.0) * weight } else { 0.0 })
        .collect();
    let largest = light.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    Table { width, height, data: light.iter().map(|light| single(light / largest)).collect() }
}

/// What comes with the tables of spectra.
struct Filled {
    /// The tables of the luminance.
    luminance: Vec<f32>,
    /// Number of nodes above the horizon.
    above: usize,
    /// Number of those that lie outside the measured directions.
    outside: usize,
}

/// Fills the tables of spectra.
fn spectra(subject: &Subject<'_>, colours: &Colours, adaptive: &mut Adaptive) -> Result<Filled, Error> {
    let side = adaptive.side;
    let order: Vec<usize> = match colours {
        Colours::Spectral(wavelengths) => wavelengths.iter().map(|(channel, _)| *channel).collect(),
        Colours::Rgb(channels) => channels.to_vec(),
    };
    let (phis, thetas) = (adaptive.phi_i.len(), adaptive.theta_i.len());
    let tables = phis * thetas;
    let mut stored = Vec::with_capacity(tables * order.len() * side * side);
    let mut filled = Filled { luminance: Vec::with_capacity(tables * side * side), above: 0, outside: 0 };
    for table in 0..tables {
        let (k, j) = (table / thetas, table % thetas);
        let nodes: Vec<(Pair, f64)> = (0..side * side)
            .into_par_iter()
            .map(|at| reflected(adaptive, k, j, at % side, at / side))
            .collect();
        let pairs: Vec<Pair> = nodes.iter().map(|(pair, _)| *pair).collect();
        let above = || nodes.iter().map(|(_, factor)| *factor > 0.0);
        filled.above += above().filter(|above| *above).count();
        filled.outside += (subject.covered)(&pairs)
            .iter()
            .zip(above())
            .filter(|(covered, above)| !**covered && *above)
            .count();
        let values = (subject.at)(&pairs);
        let mut mean = vec![0.0; nodes.len()];
        for channel in &order {
            for (at, (f, (pair, factor))) in values[*channel].iter().zip(&nodes).enumerate() {
                let value = f * factor;
                if !value.is_finite() {
                    let [theta_i, theta_o] =
                        [pair.wi, pair.wo].map(|w| w.z.clamp(-1.0, 1.0).acos().to_degrees());
                    let reason =
                        format!("f is infinite or NaN at theta_i {theta_i:.2}, theta_o {theta_o:.2} degrees");
                    return Err(Error::Encoding { format: "rgl", reason });
                }
                mean[at] += value / order.len() as f64;
                stored.push(single(value));
            }
        }
        // Renderers choose directions by it: it must not be negative, nor zero everywhere.
        let largest = mean.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        filled.luminance.extend(mean.iter().map(|value| single(value.max(1e-3 * largest))));
    }
    adaptive.spectra = stored;
    Ok(filled)
}

/// The directions at which f is evaluated for a node, and what f is multiplied by to be stored.
///
/// A node may stand for a direction below the horizon. f cos(theta_o) passes through zero there, so that such a node gets the negative
/// of what the direction's mirror image above the horizon has: interpolation then gives the right values up to the horizon.
fn reflected(adaptive: &Adaptive, k: usize, j: usize, column: usize, row: usize) -> (Pair, f64) {
    let node = adaptive.node(k, j, column, row);
    let Pair { wi, wo } = node.pair;
    let above = DVec3::new(wo.x, wo.y, wo.z.abs().max(LOWEST)).normalize();
    let scale = if wo.z > 0.0 { node.scale } else { adaptive.scale_at(wi, (wi + above).normalize()) };
    (Pair { wi, wo: above }, wo.z / scale)
}

fn what_is_lost(subject: &Subject<'_>, adaptive: &Adaptive, filled: &Filled, losses: &mut Vec<String>) {
    let (phis, thetas, side) = (adaptive.phi_i.len(), adaptive.theta_i.len(), adaptive.side);
    let incidence = if phis == 1 {
        format!("{thetas} angles of incidence")
    } else {
        format!("{phis} azimuths x {thetas} angles of incidence")
    };
    losses.push(format!(
        "the file has {side} x {side} viewing directions for each of {incidence}, in single precision; readers interpolate between them"
    ));
    if let Some(measurement) = subject.measurement {
        losses.push("between the measured samples the file has interpolated values".to_owned());
        if measurement.sigma.is_some() {
            losses.push("the format has no standard deviations".to_owned());
        }
    }
    let Filled { above, outside, .. } = filled;
    if *outside > 0 {
        losses.push(format!(
            "{outside} of {above} directions lie outside the measured ones: their values are extrapolated"
        ));
    }
}

fn bytes(
    subject: &Subject<'_>,
    sizes: &Sizes,
    colours: &Colours,
    adaptive: &Adaptive,
    vndf: &[f32],
    luminance: &[f32],
) -> Vec<u8> {
    let (phis, thetas, side) = (adaptive.phi_i.len(), adaptive.theta_i.len(), adaptive.side);
    let singles = |numbers: &[f64]| -> Vec<f32> { numbers.iter().map(|number| single(*number)).collect() };
    // A description without a character would be a field of no size.
    let about = if subject.about.trim().is_empty() { "no description" } else { subject.about };
    let (phi_i, theta_i) = (singles(&adaptive.phi_i), singles(&adaptive.theta_i));
    let shape = |inner: &[usize]| [&[phis, thetas], inner].concat();
    let mut fields = vec![
        NewField::integers("version", &[1, 0]),
        NewField::bytes("description", about.as_bytes()),
        NewField::floats("phi_i", &[phis], &phi_i),
        NewField::floats("theta_i", &[thetas], &theta_i),
        NewField::floats("sigma", &sizes.sigma, &adaptive.sigma.data),
        NewField::floats("ndf", &sizes.ndf, &adaptive.ndf.data),
        NewField::floats("vndf", &shape(&sizes.vndf), vndf),
        NewField::floats("luminance", &shape(&[side, side]), luminance),
    ];
    let table = shape(&[adaptive.channels, side, side]);
    match colours {
        Colours::Rgb(_) => fields.push(NewField::floats("rgb", &table, &adaptive.spectra)),
        Colours::Spectral(wavelengths) => {
            let nm: Vec<f32> = wavelengths.iter().map(|(_, nm)| single(*nm)).collect();
            fields.push(NewField::floats("wavelengths", &[nm.len()], &nm));
            fields.push(NewField::floats("spectra", &table, &adaptive.spectra));
        }
    }
    fields.push(NewField::bytes("jacobian", &[1]));
    encode(&fields)
}
