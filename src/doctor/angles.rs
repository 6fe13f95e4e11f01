//! What else the angles of a file could be.

use crate::error::OptionName;
use crate::geometry::Pair;
use crate::health::laws::lobes::{Apart, Bright, weakens};
use crate::health::laws::poles::variation;
use crate::health::laws::sketch::Sketch;
use crate::math::count;
use crate::measurement::reading::{
    Angle, AngleConventions, AngleUnit, AzimuthOrigin, Conventions, LightDirection,
};
use crate::measurement::{Evidence, Measurement, OtherReading, Stated};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Another reading must be better by this much: the logarithm of a ratio of roughnesses, and distances of lobes in [`LOBE_DEG`].
const BETTER: f64 = 0.5;
/// In no respect may it be worse by more than this.
const WORSE: f64 = 0.3;
/// Readings that differ by less than this are equally good.
const EQUAL: f64 = 0.1;
/// By so many degrees a lobe must move to count as much as values that are e times as smooth.
const LOBE_DEG: f64 = 15.0;
/// Values that are smoother than this may be smoother still by chance.
const SMOOTH: f64 = 0.03;
/// What the variation about the normal counts.
const POLE: f64 = 0.5;
/// Brightest samples within this of the mirror direction or the light, degrees, are a lobe about it.
const ABOUT_DEG: f64 = 20.0;
/// What it counts that no direction is farther from the normal than a right angle in radians would be in degrees, or that no azimuth is larger
/// than a full turn would be.
const NARROW: f64 = 0.6;
/// A right angle in radians, taken for degrees, radians.
const NARROWEST: f64 = 0.0275;
/// Directions that are at such different angles to the normal, radians, are those of a measurement.
const WIDE: f64 = 0.2;
/// How far angles may exceed a right angle by rounding, radians.
const ROUNDING: f64 = 2e-3;

/// The angles of the samples as the file states them.
struct Numbers {
    /// How they were understood.
    read: Reading,
    /// By sample, radians in the units that were assumed: theta_i, phi_i, theta_o, phi_o.
    rows: Vec<[f64; 4]>,
    /// The different numbers of each angle, in its unit.
    different: [Vec<f64>; 4],
}

/// The places of the angles in a row of [`Numbers`].
const ANGLES: [Angle; 4] = [Angle::ThetaI, Angle::PhiI, Angle::ThetaO, Angle::PhiO];

/// How the angles of a file are understood.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Reading {
    /// The unit of each angle.
    units: [AngleUnit; 4],
    origin: Option<AzimuthOrigin>,
    light: LightDirection,
}

/// How good a reading is.
#[derive(Clone, Copy, Debug)]
struct Score {
    /// See [`Sketch::roughness`].
    rough: f64,
    /// How far the brightest samples lie from where a lobe would be, degrees; `None` if there is none.
    apart_deg: Option<f64>,
    /// See [`variation`].
    poles: [Option<f64>; 2],
    /// The share of different polar angles that are round numbers, and of azimuths.
    round: [f64; 2],
}

/// What speaks for other angles than those that were read; `None` if nothing does.
pub(super) fn other(
    sketch: &Sketch,
    measurement: &Measurement,
    conventions: &Conventions,
) -> Option<OtherReading> {
    let stated = measurement.stated.as_ref();
    if stated.is_none() && conventions.angles.change_directions() {
        return None;
    }
    let declared = Reading {
        units: ANGLES.map(|angle| stated.map_or(AngleUnit::Degrees, |stated| unit(stated, angle))),
        origin: stated.and_then(|stated| stated.origin),
        light: stated.map_or(LightDirection::Towards, |stated| stated.light),
    };
    let least = stated.map_or([-PI; 2], |stated| stated.least_azimuths);
    let numbers = Numbers::of(sketch, declared, least);
    let bright = Bright::of(sketch);
    let by_units = stated
        .and_then(|stated| units(&AsRead::new(sketch, &numbers, bright.as_ref())?, stated, conventions));
    by_units.or_else(|| side(sketch, &numbers, &bright?))
}

/// The unit in which an angle was read. The azimuth between light and viewer stands for that of the viewer.
fn unit(stated: &Stated, angle: Angle) -> AngleUnit {
    let of = |angle: Angle| stated.units.iter().find(|(known, _)| *known == angle).map(|(_, unit)| *unit);
    let between = if angle == Angle::PhiO { of(Angle::Phi) } else { None };
    of(angle).or(between).unwrap_or_default()
}

impl Numbers {
    /// The angles that a file states, from the directions that were made of them.
    fn of(sketch: &Sketch, read: Reading, least: [f64; 2]) -> Self {
        let from = |azimuth: f64, least: f64| {
            let least = if least.is_finite() { least } else { -PI };
            let turns = ((least - 1e-9 - azimuth) / TAU).ceil();
            azimuth + TAU * turns
        };
        let number = |Pair { wi, wo }: &Pair| {
            let polar = |w: &glam::DVec3| w.x.hypot(w.y).atan2(w.z);
            let phi_i = wi.y.atan2(wi.x);
            let base = read.origin.map_or(0.0, |origin| origin.azimuth(phi_i));
            let travels = if read.light == LightDirection::AsItTravels { PI } else { 0.0 };
            let [least_i, least_o] = least;
            [polar(wi), from(phi_i - travels, least_i), polar(wo), from(wo.y.atan2(wo.x) - base, least_o)]
        };
        let rows: Vec<[f64; 4]> = sketch.pairs.iter().map(number).collect();
        let [theta_i, phi_i, theta_o, phi_o] = read.units;
        let of = |angle: fn(&[f64; 4]) -> f64, unit: AngleUnit| {
            let mut numbers: Vec<f64> = rows.iter().map(|row| unit.stated(angle(row))).collect();
            numbers.sort_unstable_by(f64::total_cmp);
            numbers.dedup_by(|a, b| (*a - *b).abs() < 1e-6);
            numbers
        };
        let different = [
            of(|[theta_i, ..]| *theta_i, theta_i),
            of(|[_, phi_i, ..]| *phi_i, phi_i),
            of(|[_, _, theta_o, _]| *theta_o, theta_o),
            of(|[.., phi_o]| *phi_o, phi_o),
        ];
        Self { read, rows, different }
    }

    /// The directions, if the angles are understood as `reading` says; `None` if one lies below the horizon.
    fn pairs(&self, reading: Reading) -> Option<Vec<Pair>> {
        let conventions = AngleConventions { light: reading.light, ..Default::default() };
        let pair = |row: &[f64; 4]| {
            let mut angles = *row;
            for ((angle, from), to) in angles.iter_mut().zip(self.read.units).zip(reading.units) {
                if from != to {
                    *angle = to.radians(from.stated(*angle))?;
                }
            }
            let [theta_i, _, theta_o, _] = angles;
            let within = |theta: f64| (-ROUNDING..FRAC_PI_2 + ROUNDING).contains(&theta);
            (within(theta_i) && within(theta_o)).then(|| conventions.pair(angles, reading.origin))
        };
        self.rows.iter().map(pair).collect()
    }

    /// Whether an angle is not 0 everywhere.
    fn has(&self, angle: usize) -> bool {
        self.rows.iter().filter_map(|row| row.get(angle)).any(|number| number.abs() > 1e-9)
    }

    /// The shares of different polar angles and of different azimuths that are round in degrees if they have the units of a reading.
    fn round(&self, reading: Reading) -> [f64; 2] {
        /// Goniometers are set to multiples of this, degrees.
        const STEP_DEG: f64 = 2.5;
        /// By how much rounding to a few digits may change an angle, degrees.
        const DIGITS_DEG: f64 = 0.03;
        let is_round = |degrees: &f64| {
            let steps = degrees / STEP_DEG;
            (steps - steps.round()).abs() * STEP_DEG < DIGITS_DEG
        };
        let [theta_i, phi_i, theta_o, phi_o] = &self.different;
        let [of_theta_i, of_phi_i, of_theta_o, of_phi_o] = reading.units;
        [[(theta_i, of_theta_i), (theta_o, of_theta_o)], [(phi_i, of_phi_i), (phi_o, of_phi_o)]].map(
            |angles| {
                let degrees = angles.iter().flat_map(|(numbers, unit)| {
                    numbers.iter().filter_map(|number| unit.radians(*number)).map(f64::to_degrees)
                });
                let degrees: Vec<f64> = degrees.filter(|degrees| degrees.abs() > DIGITS_DEG).collect();
                let round = degrees.iter().filter(|degrees| is_round(degrees)).count();
                if degrees.len() > 2 { count(round) / count(degrees.len()) } else { 0.0 }
            },
        )
    }
}

impl Score {
    fn of(sketch: &Sketch, pairs: &[Pair], bright: Option<&Bright>, round: [f64; 2]) -> Option<Self> {
        let apart_deg = bright.and_then(|bright| bright.apart(pairs)).map(Apart::least);
        Some(Self { rough: sketch.roughness(pairs)?, apart_deg, poles: variation(sketch, pairs), round })
    }

    /// By how much it is better than another, in each respect.
    fn gains(&self, over: &Self) -> [f64; 4] {
        let lobe = self.apart_deg.zip(over.apart_deg).map_or(0.0, |(own, other)| {
            // Where no lobe would be, being nearer is no gain.
            let most = if own < ABOUT_DEG { f64::INFINITY } else { 0.0 };
            ((other - own) / LOBE_DEG).min(most)
        });
        let [polar, azimuth] = self.round;
        let [other_polar, other_azimuth] = over.round;
        // Numbers that are round by chance in another unit say nothing against it.
        let round = (polar - other_polar).max(0.0) + (azimuth - other_azimuth).max(0.0);
        let poles = self
            .poles
            .iter()
            .zip(over.poles)
            .filter_map(|(own, other)| Some(POLE * (other?.max(0.0) - (*own)?.max(0.0))));
        [((over.rough + SMOOTH) / (self.rough + SMOOTH)).ln(), lobe, poles.sum(), round]
    }
}

/// The smallest and the largest angle to the normal, radians.
fn polar(pairs: &[Pair]) -> (f64, f64) {
    let each = pairs.iter().flat_map(|pair| [pair.wi.z, pair.wo.z]).map(|z| z.clamp(-1.0, 1.0).acos());
    each.fold((FRAC_PI_2, 0.0), |(low, high), theta| (theta.min(low), theta.max(high)))
}

/// What readings are weighed against: the angles as they were read.
struct AsRead<'a> {
    sketch: &'a Sketch,
    numbers: &'a Numbers,
    bright: Option<&'a Bright>,
    score: Score,
    /// The smallest and the largest angle to the normal, radians.
    polar: (f64, f64),
    /// Whether no direction is farther from the normal than a right angle in radians would be in degrees.
    narrow: bool,
    /// Whether no azimuth is larger than a full turn in radians would be in degrees.
    turns_little: bool,
}

impl<'a> AsRead<'a> {
    /// `None` if all values are alike.
    fn new(sketch: &'a Sketch, numbers: &'a Numbers, bright: Option<&'a Bright>) -> Option<Self> {
        let polar = polar(&sketch.pairs);
        let azimuths = numbers.rows.iter().flat_map(|[_, phi_i, _, phi_o]| [phi_i.abs(), phi_o.abs()]);
        let farthest = azimuths.fold(0.0, f64::max);
        let (_, steepest) = polar;
        Some(Self {
            score: Score::of(sketch, &sketch.pairs, bright, numbers.round(numbers.read))?,
            sketch,
            numbers,
            bright,
            polar,
            narrow: steepest > 0.0 && steepest < NARROWEST,
            turns_little: farthest > 0.0 && farthest < (TAU + ROUNDING).to_radians(),
        })
    }

    /// By how much another reading is better, and how good it is; `None` if it is not better.
    fn weigh(&self, other: Reading) -> Option<(f64, Score)> {
        let pairs = self.numbers.pairs(other)?;
        let (low, high) = polar(&pairs);
        let (flattest, steepest) = self.polar;
        // No reading is better for putting all directions into one place.
        if high - low < WIDE.min(0.5 * (steepest - flattest)) {
            return None;
        }
        // Where all angles are narrow, one alone cannot be in another unit.
        let [theta_i, _, theta_o, phi_o] = other.units;
        if self.narrow && theta_i != theta_o && self.numbers.has(0) && self.numbers.has(2) {
            return None;
        }
        let score = Score::of(self.sketch, &pairs, self.bright, self.numbers.round(other))?;
        let mut gains = score.gains(&self.score);
        let widens = self.narrow && high - low > WIDE;
        // Directions within a degree of each other are near any lobe.
        if let ([_, lobe, ..], true, Some(apart_deg)) = (&mut gains, widens, score.apart_deg) {
            *lobe = (ABOUT_DEG - apart_deg) / LOBE_DEG;
        }
        let turns = self.turns_little && phi_o == AngleUnit::Radians;
        let suspects: f64 = [widens, turns].map(|is| if is { NARROW } else { 0.0 }).iter().sum();
        let total = suspects + gains.iter().sum::<f64>();
        // They are smooth, too.
        let worse = !widens && gains.iter().any(|gain| *gain < -WORSE);
        (total > BETTER && !worse).then_some((total, score))
    }
}

/// Other units of the angles.
fn units(as_read: &AsRead<'_>, stated: &Stated, conventions: &Conventions) -> Option<OtherReading> {
    let readings = readings(as_read.numbers, stated).into_iter();
    let found: Vec<(f64, Reading, Score)> = readings
        .filter_map(|reading| as_read.weigh(reading).map(|(total, score)| (total, reading, score)))
        .collect();
    let best = found.iter().map(|(total, ..)| *total).fold(f64::NEG_INFINITY, f64::max);
    let equal: Vec<&(f64, Reading, Score)> =
        found.iter().filter(|(total, ..)| *total > best - EQUAL).collect();
    let (_, _, otherwise) = equal.first()?;
    let option =
        |(_, reading, _): &&(f64, Reading, Score)| option(as_read.numbers, *reading, stated, conventions);
    let (_, steepest) = as_read.polar;
    let evidence = Evidence::Angles {
        apart_deg: as_read
            .score
            .apart_deg
            .zip(otherwise.apart_deg)
            .map(|(read, otherwise)| [read, otherwise]),
        rough: [as_read.score.rough, otherwise.rough],
        varies: varies(&as_read.score, otherwise),
        within_deg: as_read.narrow.then(|| steepest.to_degrees()),
    };
    Some(OtherReading { evidence, options: equal.iter().filter_map(option).collect() })
}

/// How many times as much f varies about the normal as towards the horizon, as read; `None` where it does not or would otherwise, too.
fn varies(as_read: &Score, otherwise: &Score) -> Option<f64> {
    let both = as_read
        .poles
        .iter()
        .zip(otherwise.poles)
        .filter_map(|(read, otherwise)| Some(((*read)?, otherwise?)));
    let mended = both.filter(|(read, otherwise)| *read > 0.0 && otherwise < read);
    mended.map(|(read, _)| read.exp()).max_by(f64::total_cmp)
}

/// The readings to try: another unit for both polar angles, for one of them, for azimuths, or for all angles, and another origin of the viewer's
/// azimuth where the light's varies.
fn readings(numbers: &Numbers, stated: &Stated) -> Vec<Reading> {
    let declared = numbers.read;
    let [theta_i, phi_i, theta_o, phi_o] = declared.units;
    let mut readings = Vec::new();
    let mut add = |units: [AngleUnit; 4]| readings.push(Reading { units, ..declared });
    let has_azimuths = numbers.has(1) || numbers.has(3);
    // Numbers within a degree or so are no elevations: all would lie at the horizon.
    let within =
        |angle: usize| numbers.rows.iter().filter_map(|row| row.get(angle)).all(|number| *number < NARROWEST);
    let flat = within(0) || within(2);
    for other in AngleUnit::ALL.into_iter().filter(|unit| !(flat && *unit == AngleUnit::Elevation)) {
        let polar = other != theta_i || other != theta_o;
        let azimuth = !other.is_of_polar_angles() && (other != phi_i || other != phi_o) && has_azimuths;
        if polar && azimuth {
            add([other; 4]);
        }
        if polar {
            add([other, phi_i, other, phi_o]);
            if theta_i != other && numbers.has(0) {
                add([other, phi_i, theta_o, phi_o]);
            }
            if theta_o != other && numbers.has(2) {
                add([theta_i, phi_i, other, phi_o]);
            }
        }
        if azimuth {
            add([theta_i, other, theta_o, other]);
        }
    }
    let of_viewer = stated.units.iter().any(|(angle, _)| *angle == Angle::PhiO);
    let of_light = stated.units.iter().any(|(angle, _)| *angle == Angle::PhiI) && numbers.has(1);
    if of_viewer && of_light {
        let origins = [None, Some(AzimuthOrigin::Light), Some(AzimuthOrigin::Mirror)];
        readings.extend(
            origins
                .into_iter()
                .filter(|o| *o != declared.origin)
                .map(|origin| Reading { origin, ..declared }),
        );
        let turned = match declared.light {
            LightDirection::Towards => LightDirection::AsItTravels,
            LightDirection::AsItTravels => LightDirection::Towards,
        };
        if declared.origin.is_none() {
            readings.push(Reading { light: turned, ..declared });
        }
    }
    readings
}

/// The option that makes brdfit read a file so; `None` if there is none.
fn option(
    numbers: &Numbers,
    reading: Reading,
    stated: &Stated,
    conventions: &Conventions,
) -> Option<(OptionName, String)> {
    let declared = numbers.read;
    if reading.light != declared.light {
        return Some((OptionName::LightDirection, reading.light.name().to_owned()));
    }
    if reading.origin != declared.origin {
        return Some((OptionName::Azimuth, reading.origin?.name().to_owned()));
    }
    let name = |index: usize, angle: Angle| {
        let between = index == 3 && stated.units.iter().any(|(known, _)| *known == Angle::Phi);
        if between { Angle::Phi.name() } else { angle.name() }
    };
    let has_column = |index: usize| index.is_multiple_of(2) || numbers.has(index);
    let all: Vec<(usize, Angle, AngleUnit, AngleUnit)> = ANGLES
        .into_iter()
        .enumerate()
        .zip(declared.units.into_iter().zip(reading.units))
        .map(|((index, angle), (from, to))| (index, angle, from, to))
        .filter(|(index, ..)| has_column(*index))
        .collect();
    // What was said before would be forgotten.
    let said = conventions.given().iter().any(|(option, _)| *option == OptionName::Angles);
    let changed: Vec<&(usize, Angle, AngleUnit, AngleUnit)> =
        all.iter().filter(|(_, _, from, to)| said || from != to).collect();
    let (_, _, _, unit) = changed.first()?;
    let alike = changed.iter().all(|(_, _, _, to)| to == unit);
    let covers = |index: usize| changed.iter().any(|(known, ..)| *known == index);
    let whole = alike
        && all
            .iter()
            .all(|(index, angle, ..)| covers(*index) || (unit.is_of_polar_angles() && !angle.is_polar()));
    let text = if whole {
        unit.name().to_owned()
    } else {
        let each =
            changed.iter().map(|(index, angle, _, to)| format!("{}={}", name(*index, *angle), to.name()));
        each.collect::<Vec<_>>().join(",")
    };
    Some((OptionName::Angles, text))
}

/// Azimuths that count from the other side: the brightest samples lie about the light.
fn side(sketch: &Sketch, numbers: &Numbers, bright: &Bright) -> Option<OtherReading> {
    let declared = numbers.read;
    let apart = bright.apart(&sketch.pairs)?;
    if apart.light_deg > ABOUT_DEG || apart.mirror_deg < apart.light_deg + ABOUT_DEG || weakens(sketch) {
        return None;
    }
    let mut options = Vec::new();
    for origin in AzimuthOrigin::ALL {
        let reading = Reading { origin: Some(origin), ..declared };
        let mends = numbers.pairs(reading).and_then(|pairs| bright.apart(&pairs));
        if mends.is_some_and(|mended| mended.mirror_deg < ABOUT_DEG) {
            options.push((OptionName::Azimuth, origin.name().to_owned()));
        }
    }
    if declared.light == LightDirection::Towards && declared.origin.is_none() {
        options.push((OptionName::LightDirection, LightDirection::AsItTravels.name().to_owned()));
    }
    let evidence = Evidence::LightSide { light_deg: apart.light_deg, mirror_deg: apart.mirror_deg };
    (!options.is_empty()).then_some(OtherReading { evidence, options })
}
