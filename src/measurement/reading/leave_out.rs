//! Rules that leave out samples by their directions.

use crate::error::{Error, OptionName, excerpt};
use crate::geometry::{Geometry, spherical_degrees};
use std::fmt;

/// An angle that a rule can speak of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Subject {
    ThetaI,
    PhiI,
    ThetaO,
    PhiO,
    Phi,
    ThetaH,
    ThetaD,
}

impl Subject {
    const ALL: [Self; 7] =
        [Self::ThetaI, Self::PhiI, Self::ThetaO, Self::PhiO, Self::Phi, Self::ThetaH, Self::ThetaD];

    fn name(self) -> &'static str {
        match self {
            Self::ThetaI => "theta_i",
            Self::PhiI => "phi_i",
            Self::ThetaO => "theta_o",
            Self::PhiO => "phi_o",
            Self::Phi => "phi",
            Self::ThetaH => "theta_h",
            Self::ThetaD => "theta_d",
        }
    }

    fn is_azimuth(self) -> bool {
        matches!(self, Self::PhiI | Self::PhiO | Self::Phi)
    }

    /// Its value for a pair of directions, degrees.
    fn value(self, g: &Geometry<f64>) -> f64 {
        let (theta_i, phi_i) = spherical_degrees(g.wi.into());
        let (theta_o, phi_o) = spherical_degrees(g.wo.into());
        match self {
            Self::ThetaI => theta_i,
            Self::PhiI => phi_i,
            Self::ThetaO => theta_o,
            Self::PhiO => phi_o,
            Self::Phi => phi_o - phi_i,
            Self::ThetaH => spherical_degrees(g.h.into()).0,
            Self::ThetaD => {
                let (wi, h) = (glam::DVec3::from_array(g.wi), glam::DVec3::from_array(g.h));
                wi.cross(h).length().atan2(wi.dot(h)).to_degrees()
            }
        }
    }
}

/// A range of an angle, degrees, with both ends.
#[derive(Clone, Debug, PartialEq)]
struct Condition {
    subject: Subject,
    from: f64,
    to: f64,
}

/// Slack for angles that went through a vector, degrees.
const TOLERANCE_DEG: f64 = 1e-6;

impl Condition {
    fn holds(&self, g: &Geometry<f64>) -> bool {
        let value = self.subject.value(g);
        let inside = |value: f64| value >= self.from - TOLERANCE_DEG && value <= self.to + TOLERANCE_DEG;
        if self.subject.is_azimuth() {
            return (-2..=2).any(|turns| inside(value + 360.0 * f64::from(turns)));
        }
        inside(value)
    }
}

/// A rule: samples that meet all of its conditions are left out.
#[derive(Clone, Debug, PartialEq)]
pub struct Rule {
    conditions: Vec<Condition>,
}

impl Rule {
    /// Parses conditions such as `theta_i=60..70,phi_o=170..190`. A range may be open at one side, and a single number stands for itself.
    ///
    /// # Errors
    /// [`Error::Invalid`] for an unknown angle or a range that is none.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let wrong =
            |expected: String, found: &str| Error::invalid(OptionName::LeaveOut, expected, excerpt(found));
        let condition = |part: &str| {
            let names = Subject::ALL.map(Subject::name).join(", ");
            let angle = || format!("ANGLE=FROM..TO with an angle among {names}");
            let (name, range) = part.split_once('=').ok_or_else(|| wrong(angle(), part))?;
            let known = Subject::ALL.into_iter().find(|subject| subject.name() == name.trim());
            let subject = known.ok_or_else(|| wrong(angle(), part))?;
            let number = |text: &str, open: f64| match text.trim() {
                "" => Some(open),
                text => text.parse().ok().filter(|number: &f64| number.is_finite()),
            };
            let (from, to) = match range.split_once("..") {
                Some((from, to)) => (number(from, f64::NEG_INFINITY), number(to, f64::INFINITY)),
                None => (number(range, f64::NAN), number(range, f64::NAN)),
            };
            match (from, to) {
                (Some(from), Some(to)) if from <= to && (from.is_finite() || to.is_finite()) => {
                    Ok(Condition { subject, from, to })
                }
                _ => Err(wrong("a range of degrees such as 60..70, 60.. or ..70".to_owned(), part)),
            }
        };
        Ok(Self { conditions: text.split(',').map(condition).collect::<Result<_, _>>()? })
    }

    /// Whether a sample at these directions is left out.
    #[must_use]
    pub fn holds(&self, g: &Geometry<f64>) -> bool {
        self.conditions.iter().all(|condition| condition.holds(g))
    }
}

impl fmt::Display for Rule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let end = |value: f64| if value.is_finite() { value.to_string() } else { String::new() };
        let condition = |c: &Condition| format!("{}={}..{}", c.subject.name(), end(c.from), end(c.to));
        f.write_str(&self.conditions.iter().map(condition).collect::<Vec<_>>().join(","))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Directions;

    #[test]
    fn a_rule_holds_where_all_conditions_do() {
        let directions = Directions::from_degrees([
            [60.0, 0.0, 50.0, 180.0],
            [70.0, 10.0, 50.0, -175.0],
            [75.0, 0.0, 50.0, 180.0],
            [65.0, 0.0, 50.0, 90.0],
        ])
        .unwrap();
        let held = |text: &str| -> Vec<bool> {
            let rule = Rule::parse(text).unwrap();
            assert_eq!(Rule::parse(&rule.to_string()).unwrap(), rule);
            directions.iter().map(|g| rule.holds(&g)).collect()
        };
        assert_eq!(held("theta_i=60..70"), [true, true, false, true]);
        assert_eq!(held("theta_i=60..70,phi_o=170..190"), [true, true, false, false]);
        assert_eq!(held("phi=90"), [false, false, false, true]);
        assert_eq!(held("theta_i=..60"), [true, false, false, false]);
        // Half of 50 and 60 on both sides of the normal.
        assert_eq!(held("theta_h=0..6,theta_d=54..56"), [true, false, false, false]);
        for wrong in ["", "theta_i", "theta=1..2", "theta_i=2..1", "theta_i=..", "theta_i=a..b", "phi_o=nan"]
        {
            assert!(Rule::parse(wrong).is_err(), "{wrong}");
        }
    }
}
