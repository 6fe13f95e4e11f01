//! How a file states directions: the unit of each angle, where azimuths begin, and which way the light's direction points.

use crate::error::{Error, OptionName, excerpt};
use crate::geometry::{Directions, Pair, direction};
use std::f64::consts::{FRAC_PI_2, PI};
use std::fmt;

/// One of the angles of a pair of directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Angle {
    /// The polar angle of the direction to the light.
    ThetaI,
    /// The azimuth of the direction to the light.
    PhiI,
    /// The polar angle of the direction to the viewer.
    ThetaO,
    /// The azimuth of the direction to the viewer.
    PhiO,
    /// The azimuth between both directions.
    Phi,
}

impl Angle {
    /// All angles, in the order of their columns.
    pub const ALL: [Self; 5] = [Self::ThetaI, Self::PhiI, Self::ThetaO, Self::PhiO, Self::Phi];

    /// Its name in options and in headers.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::ThetaI => "theta_i",
            Self::PhiI => "phi_i",
            Self::ThetaO => "theta_o",
            Self::PhiO => "phi_o",
            Self::Phi => "phi",
        }
    }

    /// Whether it is measured from the normal.
    #[must_use]
    pub fn is_polar(self) -> bool {
        matches!(self, Self::ThetaI | Self::ThetaO)
    }
}

/// The unit of an angle in a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum AngleUnit {
    /// Degrees.
    #[default]
    Degrees,
    /// Radians.
    Radians,
    /// Gradians, of which 100 are a right angle.
    Gradians,
    /// The cosine of a polar angle.
    Cosine,
    /// Degrees above the surface instead of from its normal.
    Elevation,
}

impl AngleUnit {
    /// All units.
    pub const ALL: [Self; 5] = [Self::Degrees, Self::Radians, Self::Gradians, Self::Cosine, Self::Elevation];

    /// Its name in options.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Degrees => "degrees",
            Self::Radians => "radians",
            Self::Gradians => "gradians",
            Self::Cosine => "cosine",
            Self::Elevation => "elevation",
        }
    }

    /// Whether only a polar angle can be stated in it.
    #[must_use]
    pub fn is_of_polar_angles(self) -> bool {
        matches!(self, Self::Cosine | Self::Elevation)
    }

    /// The angle in radians that a file states as `value`. `None` for a cosine beyond -1..1.
    #[must_use]
    pub fn radians(self, value: f64) -> Option<f64> {
        match self {
            Self::Degrees => Some(value.to_radians()),
            Self::Radians => Some(value),
            Self::Gradians => Some(value * (FRAC_PI_2 / 100.0)),
            Self::Cosine => (value.abs() <= 1.0).then(|| value.acos()),
            Self::Elevation => Some(FRAC_PI_2 - value.to_radians()),
        }
    }

    /// The number with which a file states an angle in radians: the inverse of [`radians`](Self::radians).
    #[must_use]
    pub fn stated(self, radians: f64) -> f64 {
        match self {
            Self::Degrees => radians.to_degrees(),
            Self::Radians => radians,
            Self::Gradians => radians / (FRAC_PI_2 / 100.0),
            Self::Cosine => radians.cos(),
            Self::Elevation => (FRAC_PI_2 - radians).to_degrees(),
        }
    }
}

/// The units of the angles of a file, where they were named.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AngleUnits {
    all: Option<AngleUnit>,
    of: Vec<(Angle, AngleUnit)>,
}

impl AngleUnits {
    /// Parses `radians` for all angles, `cosine` or `elevation` for both polar angles, or a list such as `theta_i=elevation,theta_o=cosine`.
    ///
    /// # Errors
    /// [`Error::Invalid`] for an unknown unit or angle.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let names = AngleUnit::ALL.map(AngleUnit::name).join(", ");
        let wrong =
            |expected: String, found: &str| Error::invalid(OptionName::Angles, expected, excerpt(found));
        let unit = |text: &str| {
            let known = AngleUnit::ALL.into_iter().find(|unit| unit.name() == text);
            known.ok_or_else(|| wrong(format!("one of {names}"), text))
        };
        let mut units = Self::default();
        for part in text.split(',').map(str::trim) {
            let Some((angle, of_angle)) = part.split_once('=') else {
                units.all = Some(unit(part)?);
                continue;
            };
            let known = Angle::ALL.into_iter().find(|known| known.name() == angle.trim());
            let angle = known.ok_or_else(|| {
                let names = Angle::ALL.map(Angle::name).join(", ");
                wrong(format!("UNIT, or ANGLE=UNIT with an angle among {names}"), part)
            })?;
            let of_angle = unit(of_angle.trim())?;
            if !angle.is_polar() && of_angle.is_of_polar_angles() {
                return Err(wrong("degrees, radians or gradians for an azimuth".to_owned(), part));
            }
            units.of.retain(|(known, _)| *known != angle);
            units.of.push((angle, of_angle));
        }
        Ok(units)
    }

    /// The unit that was named for an angle; `None` if there was none.
    #[must_use]
    pub fn of(&self, angle: Angle) -> Option<AngleUnit> {
        let own = self.of.iter().find(|(known, _)| *known == angle);
        let fits = |unit: &AngleUnit| angle.is_polar() || !unit.is_of_polar_angles();
        own.map(|(_, unit)| *unit).or(self.all.filter(fits))
    }
}

/// Where the azimuth of the viewer begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum AzimuthOrigin {
    /// At the azimuth of the light: 0 is the light's side, 180 degrees the side of the mirror direction.
    Light,
    /// At the azimuth of the mirror direction: 180 degrees is the light's side.
    Mirror,
}

impl AzimuthOrigin {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Light, Self::Mirror];

    /// Its name in options.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Light => "from-light",
            Self::Mirror => "from-mirror",
        }
    }

    /// Parses its name; `relative` is another one for `from-light`.
    ///
    /// # Errors
    /// [`Error::Invalid`] for any other text.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let text = if text == "relative" { "from-light" } else { text };
        Self::ALL.into_iter().find(|origin| origin.name() == text).ok_or_else(|| {
            let expected = "from-light (or relative) or from-mirror";
            Error::invalid(OptionName::Azimuth, expected, excerpt(text))
        })
    }

    /// The azimuth at which it lies, radians, for light at azimuth `phi_i`.
    #[must_use]
    pub fn azimuth(self, phi_i: f64) -> f64 {
        match self {
            Self::Light => phi_i,
            Self::Mirror => phi_i + PI,
        }
    }
}

/// Which way a file's direction of light points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum LightDirection {
    /// From the surface to the light.
    #[default]
    Towards,
    /// As the light travels.
    AsItTravels,
}

impl LightDirection {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Towards, Self::AsItTravels];

    /// Its name in options.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Towards => "towards-light",
            Self::AsItTravels => "as-it-travels",
        }
    }

    /// Parses its name.
    ///
    /// # Errors
    /// [`Error::Invalid`] for any other text.
    pub fn parse(text: &str) -> Result<Self, Error> {
        Self::ALL.into_iter().find(|direction| direction.name() == text).ok_or_else(|| {
            let expected = "towards-light or as-it-travels";
            Error::invalid(OptionName::LightDirection, expected, excerpt(text))
        })
    }

    /// The polar angle and azimuth of the direction to the light, radians, from those in a file. One that points into the surface
    /// is turned round as a whole, one that does not by its azimuth.
    #[must_use]
    pub fn to_light(self, theta: f64, phi: f64) -> [f64; 2] {
        match self {
            Self::Towards => [theta, phi],
            Self::AsItTravels if theta.abs() > FRAC_PI_2 => [(PI - theta.abs()).copysign(theta), phi + PI],
            Self::AsItTravels => [theta, phi + PI],
        }
    }
}

/// How a file states directions.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct AngleConventions {
    /// The units of the angles.
    pub units: AngleUnits,
    /// Where the azimuth of the viewer begins. `None` if nobody said so: two azimuths then count from the same axis.
    pub azimuth: Option<AzimuthOrigin>,
    /// Which way the direction of light points.
    pub light: LightDirection,
}

impl AngleConventions {
    /// The pair of directions for polar angles and azimuths in radians. `origin` is where the azimuth of the viewer begins; `None` if both
    /// azimuths count from the same axis.
    #[must_use]
    pub fn pair(&self, angles: [f64; 4], origin: Option<AzimuthOrigin>) -> Pair {
        let [theta_i, phi_i, theta_o, phi_o] = angles;
        let [theta_i, phi_i] = self.light.to_light(theta_i, phi_i);
        let phi_o = origin.map_or(phi_o, |origin| origin.azimuth(phi_i) + phi_o);
        Pair { wi: direction(theta_i, phi_i), wo: direction(theta_o, phi_o) }
    }

    /// Whether directions that a reader made must be changed.
    #[must_use]
    pub fn change_directions(&self) -> bool {
        self.azimuth.is_some() || self.light != LightDirection::Towards
    }

    /// Changes directions that a reader made without regard to these conventions. `None` for cells of a grid, which leave the azimuths
    /// open.
    #[must_use]
    pub fn changed(&self, directions: &Directions) -> Option<Vec<Pair>> {
        let Directions::Scattered(pairs) = directions else { return None };
        let spherical = |v: glam::DVec3| [v.x.hypot(v.y).atan2(v.z), v.y.atan2(v.x)];
        let changed = pairs.iter().map(|pair| {
            let ([theta_i, phi_i], [theta_o, phi_o]) = (spherical(pair.wi), spherical(pair.wo));
            self.pair([theta_i, phi_i, theta_o, phi_o], self.azimuth)
        });
        Some(changed.collect())
    }
}

impl fmt::Display for AngleUnits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let all = self.all.map(|unit| unit.name().to_owned());
        let of = self.of.iter().map(|(angle, unit)| format!("{}={}", angle.name(), unit.name()));
        f.write_str(&all.into_iter().chain(of).collect::<Vec<_>>().join(","))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn a_right_angle_in_every_unit() {
        for (unit, value) in [("degrees", 90.0), ("radians", FRAC_PI_2), ("gradians", 100.0)] {
            let units = AngleUnits::parse(unit).unwrap();
            let angle = units.of(Angle::PhiO).unwrap().radians(value).unwrap();
            assert_abs_diff_eq!(angle, FRAC_PI_2, epsilon = 1e-15);
        }
        let units = AngleUnits::parse("radians, theta_i=cosine,theta_o=elevation").unwrap();
        assert_eq!(units.to_string(), "radians,theta_i=cosine,theta_o=elevation");
        assert_eq!(units.of(Angle::PhiI), Some(AngleUnit::Radians));
        assert_abs_diff_eq!(
            units.of(Angle::ThetaI).unwrap().radians(0.5).unwrap().to_degrees(),
            60.0,
            epsilon = 1e-12
        );
        assert_abs_diff_eq!(
            units.of(Angle::ThetaO).unwrap().radians(30.0).unwrap().to_degrees(),
            60.0,
            epsilon = 1e-12
        );
        assert_eq!(AngleUnit::Cosine.radians(1.1), None);
        let units = AngleUnits::parse("elevation").unwrap();
        assert_eq!((units.of(Angle::ThetaO), units.of(Angle::PhiO)), (Some(AngleUnit::Elevation), None));
        assert!(AngleUnits::parse("phi_i=cosine").is_err());
        assert!(AngleUnits::parse("theta=degrees").is_err() && AngleUnits::parse("turns").is_err());
    }

    /// Light from 30 degrees travels at 150 degrees to the normal, on the other side.
    #[test]
    fn light_as_it_travels_comes_from_the_other_side() {
        let right = AngleConventions::default().pair([30f64, 20.0, 50.0, 70.0].map(f64::to_radians), None);
        let conventions =
            AngleConventions { light: LightDirection::AsItTravels, ..AngleConventions::default() };
        for theta_i in [150.0, 30.0] {
            let pair = conventions.pair([theta_i, 200.0, 50.0, 70.0].map(f64::to_radians), None);
            assert!(pair.wi.distance(right.wi) < 1e-15);
            assert!(pair.wo.distance(right.wo) < 1e-15);
        }
    }

    #[test]
    fn azimuths_count_from_where_they_are_said_to() {
        let conventions = AngleConventions::default();
        let pair = |origin, phi_o: f64| {
            conventions.pair([40f64, 25.0, 40.0, phi_o].map(f64::to_radians), Some(origin))
        };
        let mirror = |pair: Pair| (pair.wo - glam::DVec3::new(-pair.wi.x, -pair.wi.y, pair.wi.z)).length();
        assert!(
            mirror(pair(AzimuthOrigin::Light, 180.0)) < 1e-15
                && mirror(pair(AzimuthOrigin::Mirror, 0.0)) < 1e-15
        );
        assert_eq!(AzimuthOrigin::parse("relative").unwrap(), AzimuthOrigin::Light);
    }
}
