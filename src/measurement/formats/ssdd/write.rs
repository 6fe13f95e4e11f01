//! Writes SSDD.

use super::parameters::Parameters;
use crate::error::{Error, excerpt, listed};
use crate::geometry::Pair;
use crate::measurement::Measurement;
use crate::measurement::formats::specular::{LEAST_COSINE, SpecularGrid, close, lists_of, polar, sorted};
use crate::measurement::formats::writing::{AngleGrid, Covered, Subject, Written};
use std::f64::consts::TAU;
use std::fmt::Write as _;

/// The largest table that is written as text, in numbers.
const MOST_TEXT: usize = 200_000;
/// Number of places that are evaluated at a time.
const PIECE: usize = 1 << 16;

pub(super) fn write(subject: &Subject<'_>) -> Result<Written, Error> {
    subject.check_channels()?;
    let colours = Colours::of(subject)?;
    let table = Table::of(subject);
    let mut losses: Vec<String> = subject.gaps().into_iter().collect();
    if subject.measurement.is_some_and(|measurement| measurement.sigma.is_some()) {
        losses.push("an SSDD file has no standard deviations".to_owned());
    }
    let [first, second, third, fourth] = &table.lists;
    let list = |angles: &[f64]| angles.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ");
    let mut text = format!("VERSION 0.3\nSOFTWARE brdfit-{}\n\nDATA_TYPE brdf\n", env!("CARGO_PKG_VERSION"));
    let _ = writeln!(text, "COLOR_MODEL {}", colours.model);
    if !colours.wavelengths.is_empty() {
        let _ = writeln!(text, "WAVELENGTH_LIST {}", list(&colours.wavelengths));
    }
    let _ = writeln!(text, "PARAM_TYPE {}", table.parameters.name());
    if subject.isotropic {
        let _ = writeln!(text, "REDUCTION_TYPE bilateral_symmetry");
    }
    let _ = writeln!(text, "PARAM0_LIST {}", list(first));
    if !subject.isotropic {
        let _ = writeln!(text, "PARAM1_LIST {}", list(second));
    }
    let _ = writeln!(text, "PARAM2_LIST {}\nPARAM3_LIST {}", list(third), list(fourth));
    let about = subject.about.replace(char::is_control, " ");
    if !about.trim().is_empty() {
        let _ = writeln!(text, "NAME {}", about.trim());
    }
    let source = if subject.measurement.is_some() { "measured" } else { "generated" };
    let places = table.places();
    let binary = places.len().saturating_mul(colours.order.len()) > MOST_TEXT;
    let _ = writeln!(text, "SOURCE_TYPE {source}\nDATA {}", if binary { "binary" } else { "ascii" });

    let mut bytes = text.into_bytes();
    let mut covered = Covered::default();
    for places in places.chunks(PIECE) {
        let pairs: Vec<Pair> = places.iter().flatten().copied().collect();
        covered.count(subject, &pairs);
        let values = (subject.at)(&pairs);
        if values.iter().flatten().any(|f| !f.is_finite()) {
            return Err(Error::invalid("values", "finite values", "NaN or infinity"));
        }
        let mut at = 0;
        for place in places {
            // f = 0 below the horizon.
            let value = |channel: &usize| {
                let value = place.and_then(|_| values.get(*channel)).and_then(|row| row.get(at));
                value.copied().unwrap_or_default()
            };
            let colour = colours.order.iter().map(value);
            if binary {
                colour.for_each(|value| bytes.extend(single(value).to_le_bytes()));
            } else {
                let words: Vec<String> = colour.map(|value| format!("{value:.7e}")).collect();
                bytes.extend(words.join(" ").into_bytes());
                bytes.push(b'\n');
            }
            at += usize::from(place.is_some());
        }
    }
    losses.extend(covered.loss());
    Ok(Written { bytes, losses })
}

/// A value as a 32-bit float, the largest one if it is larger.
#[expect(clippy::cast_possible_truncation, reason = "the format has 32-bit floats")]
fn single(value: f64) -> f32 {
    value.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32
}

/// The angles at which a BRDF is written.
struct Table {
    parameters: Parameters,
    /// The four lists, degrees.
    lists: [Vec<f64>; 4],
}

impl Table {
    /// A table about the normal at the angles that the user gave; or else of the samples of a measurement, about the normal or the mirror
    /// direction, whichever has them with fewer places; or else dense at the mirror direction.
    fn of(subject: &Subject<'_>) -> Self {
        if let Some(given) = subject.grid.filter(|g| !(g.theta_o_deg.is_empty() && g.phi_deg.is_empty())) {
            return Self::given(given, subject.isotropic);
        }
        let own = subject.measurement.filter(|_| subject.grid.is_none());
        let spherical = own.and_then(|measurement| Self::spherical(measurement, subject.isotropic));
        let specular = own.and_then(|measurement| SpecularGrid::of_samples(measurement, subject.isotropic));
        match (spherical, specular) {
            (Some(table), specular) if specular.as_ref().is_none_or(|grid| table.size() <= grid.places()) => {
                table
            }
            _ => {
                let SpecularGrid { rotations, incidences, azimuths, radials } = SpecularGrid::of(subject);
                Self { parameters: Parameters::Specular, lists: [incidences, rotations, radials, azimuths] }
            }
        }
    }

    fn size(&self) -> usize {
        self.lists.iter().map(Vec::len).product()
    }

    fn given(given: &AngleGrid, isotropic: bool) -> Self {
        let steps = |step: u32, last: u32| (0..=last / step).map(|k| f64::from(k * step)).collect::<Vec<_>>();
        let or = |list: &[f64], other: Vec<f64>| if list.is_empty() { other } else { list.to_vec() };
        let phi_i = if isotropic { vec![0.0] } else { or(&given.phi_i_deg, steps(30, 330)) };
        let phi = or(&given.phi_deg, steps(10, if isotropic { 180 } else { 350 }));
        let lists = [or(&given.theta_i_deg, steps(5, 85)), phi_i, or(&given.theta_o_deg, steps(5, 85)), phi];
        Self::about_normal(lists, isotropic)
    }

    /// The angles of samples that form a table about the normal; `None` if they do not.
    fn spherical(measurement: &Measurement, isotropic: bool) -> Option<Self> {
        let lists = lists_of(measurement, |wi, wo| {
            let ((theta_i, phi_i), (theta_o, phi_o)) = (polar(wi), polar(wo));
            // Isotropic tables have the light at azimuth 0, and at the normal the viewer may be anywhere.
            let turned = phi_o.map(|phi| if isotropic { phi - phi_i.unwrap_or(phi) } else { phi });
            [Some(theta_i), phi_i.filter(|_| !isotropic), Some(theta_o), turned]
                .map(|angle| angle.map(|a| a.rem_euclid(TAU)))
        })?;
        Some(Self::about_normal(lists, isotropic))
    }

    fn about_normal(lists: [Vec<f64>; 4], isotropic: bool) -> Self {
        let [theta_i, phi_i, theta_o, phi] = lists;
        let turned = |list: Vec<f64>| sorted(list.into_iter().map(|angle| angle.rem_euclid(360.0)).collect());
        let [mut phi_i, mut phi] = [phi_i, phi].map(turned);
        if isotropic {
            phi = sorted(phi.into_iter().map(|angle: f64| angle.min(360.0 - angle)).collect());
        } else {
            close(&mut phi_i, false);
            close(&mut phi, false);
        }
        let lists = [sorted(theta_i), phi_i, sorted(theta_o), phi];
        Self { parameters: Parameters::Spherical, lists }
    }

    /// The pairs of directions in the order of the file, `None` below the horizon.
    fn places(&self) -> Vec<Option<Pair>> {
        let [first, second, third, fourth] = &self.lists;
        let mut places = Vec::new();
        for d in fourth {
            for c in third {
                for b in second {
                    places.extend(first.iter().map(|a| {
                        let pair = self.parameters.pair([*a, *b, *c, *d], 0.0);
                        (pair.wi.z > LEAST_COSINE && pair.wo.z > LEAST_COSINE).then_some(pair)
                    }));
                }
            }
        }
        places
    }
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
