//! What else the values of a file could be.

use super::energy;
use crate::error::OptionName;
use crate::health::laws::exchange::Cosine;
use crate::health::laws::sketch::Sketch;
use crate::math::{count, median};
use crate::measurement::reading::{Conventions, Quantity};
use crate::measurement::{BRIGHTEST, CALIBRATION, Evidence, Measurement, OtherReading, readings_with_albedo};
use std::f64::consts::PI;

/// An albedo above this is not an error of rounding.
const ABOVE_ONE: f64 = 1.02;
/// With a larger share of values below 0, they are not f.
const NEGATIVE: f64 = 0.05;
/// Noise about a mean that is not negative leaves no more than half of the values below 0.
const MOSTLY: f64 = 0.7;
/// Values whose neighbours agree better than this are not noise.
const NO_NOISE: f64 = 0.6;
/// In a plane, smallest values that are so many times as large as those of a perfect white are not f.
const ABOVE_WHITE: f64 = 2.0;

/// Values that are f times a cosine.
pub(super) fn cosine(cosine: Cosine, conventions: &Conventions) -> OtherReading {
    let evidence = Evidence::Exchange { cosine: cosine.of, pairs: cosine.pairs, differ: cosine.differ };
    OtherReading { evidence, options: options(&conventions.quantity, &[cosine.quantity()]) }
}

/// Values that are too large to be f.
pub(super) fn too_much(
    measurement: &Measurement,
    sketch: Option<&Sketch>,
    conventions: &Conventions,
) -> Option<OtherReading> {
    let quantity = &conventions.quantity;
    albedo(measurement, quantity).or_else(|| above_white(sketch?, quantity))
}

/// Values that are too small to be f.
pub(super) fn too_dark(sketch: &Sketch, conventions: &Conventions) -> Option<OtherReading> {
    /// The blackest coatings reflect about this share.
    const BLACKEST: f64 = 5e-4;
    /// A perfect mirror is dark beside its peak, whose values are far above this.
    const NO_PEAK: f64 = 0.02;
    /// Square degrees per steradian.
    const SQUARE_DEGREES: f64 = (180.0 / PI) * (180.0 / PI);
    let largest = sketch.values.iter().copied().fold(0.0, f64::max);
    let albedo = PI * median(sketch.values.clone())?;
    let per_steradian = albedo * SQUARE_DEGREES;
    let words: &[&str] =
        if (0.005..BRIGHTEST).contains(&per_steradian) { &["per-square-degree"] } else { &[] };
    let dark = albedo > 0.0 && albedo < BLACKEST && PI * largest < NO_PEAK;
    let evidence = Evidence::TooDark { albedo };
    dark.then(|| OtherReading { evidence, options: options(&conventions.quantity, words) })
}

/// Options that read the values as one of these words say, in addition to what was said of them.
fn options(quantity: &Quantity, words: &[&str]) -> Vec<(OptionName, String)> {
    let with = |word: &&str| if quantity.is_f() { (*word).to_owned() } else { format!("{quantity},{word}") };
    let known = words.iter().map(with).filter_map(|text| Quantity::parse(&text).ok());
    known.map(|quantity| (OptionName::Quantity, quantity.to_string())).collect()
}

/// An albedo above 1.
fn albedo(measurement: &Measurement, quantity: &Quantity) -> Option<OtherReading> {
    let most = energy::most(measurement).filter(|most| most.at_least > ABOVE_ONE)?;
    let evidence = Evidence::Albedo { at_least: most.at_least, theta_i_deg: most.theta_i_deg };
    let mut options = options(quantity, &readings_with_albedo(most.at_least));
    if most.at_least < CALIBRATION {
        options.push((OptionName::Scale, String::new()));
    }
    Some(OtherReading { evidence, options })
}

/// Values in one plane that are all larger than those of a perfect white. Out of the plane they would have to be far smaller for the surface
/// not to reflect more light than it receives.
fn above_white(sketch: &Sketch, quantity: &Quantity) -> Option<OtherReading> {
    /// The share of the smallest values that may be errors.
    const ERRORS: f64 = 0.05;
    /// A plane that spans less than this angle between light and viewer may be within a lobe, as a cosine: 60 degrees.
    const SPANNED: f64 = 0.5;
    /// Values that vary more than this have a lobe, which may well lie in the plane.
    const VARIES: f64 = 3.0;
    let spans = sketch.pairs.iter().any(|pair| pair.wi.z < SPANNED || pair.wo.z < SPANNED);
    let mut values = sketch.values.clone();
    values.sort_unstable_by(f64::total_cmp);
    let at = |share: f64| {
        values.iter().enumerate().find(|(index, _)| count(*index) >= share * count(values.len()))
    };
    let ((_, low), (_, high)) = (at(ERRORS)?, at(1.0 - ERRORS)?);
    let times = PI * low;
    let evidence = Evidence::AboveWhite { times };
    (spans && times > ABOVE_WHITE && *high < VARIES * low)
        .then(|| OtherReading { evidence, options: options(quantity, &readings_with_albedo(times)) })
}

/// Decibels: values below 0 whose neighbours agree.
pub(super) fn decibels(
    sketch: &Sketch,
    measurement: &Measurement,
    conventions: &Conventions,
) -> Option<OtherReading> {
    let quantity = &conventions.quantity;
    let below = sketch.values.iter().filter(|value| **value < 0.0).count();
    let share = count(below) / count(sketch.values.len());
    let by_noise = share < MOSTLY && sketch.roughness(&sketch.pairs)? > NO_NOISE;
    if share < NEGATIVE || quantity.is_decibel() || by_noise {
        return None;
    }
    let words: Vec<&str> = ["decibel", "reflectance-factor,decibel"]
        .into_iter()
        .filter(|word| {
            let Ok(as_decibels) = Quantity::parse(word) else { return false };
            let mut read = measurement.clone();
            for value in read.values.iter_mut().flatten() {
                *value = as_decibels.f(*value, 1.0, 1.0).0;
            }
            energy::most(&read).is_none_or(|most| most.at_least < ABOVE_ONE)
        })
        .collect();
    Some(OtherReading { evidence: Evidence::Negative { share }, options: options(quantity, &words) })
}
