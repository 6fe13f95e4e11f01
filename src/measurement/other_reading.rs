//! Another way to read a file, which physics prefers.

use super::reading::Angle;
use crate::error::{OptionName, rounded};
use std::f64::consts::PI;
use std::fmt;

/// Another way to read a file, which agrees better with what is known of every surface than the way in which it was read. Where several agree
/// equally well, all are named.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct OtherReading {
    /// What speaks for it.
    pub evidence: Evidence,
    /// The options that read the file so, and their values, any one of them.
    pub options: Vec<(OptionName, String)>,
}

impl OtherReading {
    /// Whether it is about angles, not about values.
    #[must_use]
    pub fn is_of_angles(&self) -> bool {
        matches!(self.evidence, Evidence::Angles { .. } | Evidence::LightSide { .. })
    }
}

/// No surface that anyone measures is darker: another reading must not make it so.
const DARKEST: f64 = 0.02;
/// An albedo of another reading may be as large, by errors of calibration.
pub(crate) const BRIGHTEST: f64 = 1.1;
/// A scale that is wrong by more than this is no error of calibration.
pub(crate) const CALIBRATION: f64 = 10.0;

/// The quantities, as options name them, that give an albedo that a surface can have where f in 1/sr gives this one, which is above 1. All of
/// them for infinity.
pub(crate) fn readings_with_albedo(albedo: f64) -> Vec<&'static str> {
    let all = [("reflectance-factor", PI), ("percent", 100.0), ("reflectance-factor,percent", 100.0 * PI)];
    let possible = |factor: f64| albedo.is_infinite() || (DARKEST..BRIGHTEST).contains(&(albedo / factor));
    all.into_iter()
        .filter(|(_, factor)| albedo > BRIGHTEST && possible(*factor))
        .map(|(word, _)| word)
        .collect()
}

/// What speaks for another reading.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Evidence {
    /// Directions make more sense when angles are understood otherwise.
    Angles {
        /// How far from the mirror direction, or from the light, the brightest samples lie as the file was read, and otherwise, degrees. `None`
        /// if no sample is much brighter than the rest.
        apart_deg: Option<[f64; 2]>,
        /// By how much f differs between neighbouring directions, relative to how much it varies, as the file was read, and otherwise.
        rough: [f64; 2],
        /// How many times as much f varies with the azimuth about the normal, where it makes no difference, as towards the horizon, as the file
        /// was read. `None` if it does not, or the directions do not say.
        varies: Option<f64>,
        /// The largest angle to the normal as the file was read, degrees, if it is hardly more than a radian is in degrees.
        within_deg: Option<f64>,
    },
    /// The brightest samples lie about the light instead of its mirror direction.
    LightSide {
        /// How far from the light they lie, degrees.
        light_deg: f64,
        /// How far from the mirror direction they lie, degrees.
        mirror_deg: f64,
    },
    /// Values of exchanged directions differ as a cosine does.
    Exchange {
        /// The angle of that cosine.
        cosine: Angle,
        /// The number of exchanged pairs that were compared.
        pairs: usize,
        /// By how much their values differ, the median ratio less 1, as read and with the cosine divided out.
        differ: [f64; 2],
    },
    /// The surface would reflect more light than it receives.
    Albedo {
        /// The share of light that it would reflect at least.
        at_least: f64,
        /// The smallest and the largest angle of incidence, degrees.
        theta_i_deg: [f64; 2],
    },
    /// Every value measured in one plane is larger than that of a perfect white.
    AboveWhite {
        /// How often as large as that of a perfect white the smallest values are.
        times: f64,
    },
    /// The surface would be darker than any.
    TooDark {
        /// The albedo that it would have if it reflected the median value everywhere.
        albedo: f64,
    },
    /// Values are negative where noise does not explain it.
    Negative {
        /// The share of values below 0.
        share: f64,
    },
}

impl fmt::Display for OtherReading {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let percent = |share: f64| format!("{} %", rounded(100.0 * share, 0));
        match &self.evidence {
            Evidence::Angles { apart_deg, rough, varies, within_deg } => {
                write!(f, "the angles seem to be stated otherwise")?;
                let options: Vec<&str> = self.options.iter().map(|(_, value)| value.as_str()).collect();
                let mut reasons = Vec::new();
                if let Some(within) = within_deg {
                    reasons.push(format!("no direction is more than {within:.2} degrees from the normal"));
                }
                let with = options.join(" or ");
                if let Some([read, otherwise]) = apart_deg.filter(|[read, otherwise]| read - otherwise > 1.0)
                {
                    reasons.push(format!(
                        "the brightest samples lie {read:.0} degrees from where a lobe would be, and {otherwise:.0} with {with}"
                    ));
                }
                if let Some(times) = varies {
                    reasons.push(format!(
                        "about the normal, where azimuths make no difference, f varies with them {} times as much as towards the horizon",
                        rounded(*times, 1)
                    ));
                }
                let [read, otherwise] = *rough;
                if read > 1.3 * otherwise {
                    reasons.push(format!(
                        "neighbouring directions differ by {} of the spread of f, and by {} with {with}",
                        percent(read),
                        percent(otherwise)
                    ));
                }
                if reasons.is_empty() {
                    reasons.push(format!("they are round numbers with {with}"));
                }
                write!(f, ": {}", reasons.join("; "))
            }
            Evidence::LightSide { light_deg, mirror_deg } => write!(
                f,
                "the brightest samples lie {light_deg:.0} degrees from the light and {mirror_deg:.0} degrees from the mirror direction: unless \
                 the material is retro-reflective, its azimuths count from the other side or the light's direction points as it travels"
            ),
            Evidence::Exchange { cosine, pairs, differ: [read, otherwise] } => write!(
                f,
                "the values seem to be f cos({}): when light and viewer change places they differ by {} (median of {pairs} pairs), and by {} \
                 once that cosine is divided out",
                cosine.name(),
                percent(*read),
                percent(*otherwise)
            ),
            Evidence::Albedo { at_least, theta_i_deg: [low, high] } => {
                let theta_i = if high - low < 1.0 {
                    format!("= {low:.0}")
                } else {
                    format!("from {low:.0} to {high:.0}")
                };
                write!(
                    f,
                    "the values seem not to be f in 1/sr: at theta_i {theta_i} degrees the surface would reflect at least {} \
                     times the light that it receives, and no albedo is above 1",
                    rounded(*at_least, 3)
                )?;
                if self.options.iter().any(|(option, _)| *option == OptionName::Scale) {
                    write!(f, "; or their scale is at least {} times too large", rounded(*at_least, 3))?;
                }
                Ok(())
            }
            Evidence::AboveWhite { times } => write!(
                f,
                "the values seem not to be f in 1/sr: even the smallest are {} times the 1/pi of a perfect white, whose albedo is 1",
                rounded(*times, 1)
            ),
            Evidence::TooDark { albedo } => write!(
                f,
                "the values seem not to be f in 1/sr: a surface with their median would reflect {albedo:.1e} of the light, less than the blackest \
                 coatings, and the largest are no peak"
            ),
            Evidence::Negative { share } => write!(
                f,
                "the values seem to be decibels: {} are negative, which f never is, and more than noise explains",
                percent(*share)
            ),
        }
    }
}
