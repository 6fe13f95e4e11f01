//! How the parameters of SSDD stand for directions.

use crate::geometry::{Pair, direction};
use crate::measurement::formats::specular::{Around, Frame};
use crate::measurement::formats::tabulated::{Listed, Twins};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};

/// A parameterisation of pairs of directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Parameters {
    Spherical,
    Specular,
    HalfDifference,
    Distorted,
}

/// Degrees by which an angle may be beyond its range: writers convert from radians of few digits.
const SLACK_DEG: f64 = 1e-3;

impl Parameters {
    pub(super) const ALL: [Self; 4] =
        [Self::Spherical, Self::Specular, Self::HalfDifference, Self::Distorted];

    /// Its name in a file.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Spherical => "spherical_coordinate_system",
            Self::Specular => "specular_coordinate_system",
            Self::HalfDifference => "half_difference_coordinate_system",
            Self::Distorted => "distorted_spherical_coordinate_system",
        }
    }

    /// Checks an angle in degrees of the list of this number. The error is the largest angle that it may contain.
    pub(super) fn check(self, list: usize, angle: f64) -> Result<(), f64> {
        let most = match list {
            0 => 90.0,
            2 if self == Self::Specular => 180.0,
            2 => 90.0,
            _ => 360.0,
        };
        if (-SLACK_DEG..=most + SLACK_DEG).contains(&angle) { Ok(()) } else { Err(most) }
    }

    /// Whether the fifth list, of offsets to the mirror direction, belongs to it.
    pub(super) fn has_offsets(self) -> bool {
        matches!(self, Self::Specular | Self::Distorted)
    }

    /// The pair of directions at parameters in degrees, with an offset to the mirror direction.
    pub(super) fn pair(self, [a, b, c, d]: [f64; 4], offset: f64) -> Pair {
        self.pair_of(&First::new([a, b], offset), &Second::new([c, d]))
    }

    fn pair_of(self, first: &First, second: &Second) -> Pair {
        match self {
            Self::Spherical => Pair { wi: first.direction, wo: second.direction },
            Self::Specular => Pair { wi: first.direction, wo: first.frame.view(second.around) },
            Self::HalfDifference => half_difference(first, second.direction),
            Self::Distorted => distorted(first, second.angles),
        }
    }
}

/// The first two parameters, with what follows from them alone.
struct First {
    /// Radians.
    angles: [f64; 2],
    /// The offset to the mirror direction, radians.
    offset: f64,
    /// The direction of the light, or the half vector.
    direction: DVec3,
    /// The axes about the mirror direction.
    frame: Frame,
    /// The axes beside the half vector: one leads away from the normal.
    beside: [DVec3; 2],
}

impl First {
    /// From degrees.
    fn new(angles: [f64; 2], offset: f64) -> Self {
        let [theta, phi] = angles.map(f64::to_radians);
        let offset = offset.to_radians();
        Self {
            angles: [theta, phi],
            offset,
            direction: direction(theta, phi),
            frame: Frame::new(theta + offset, phi),
            beside: [direction(theta + FRAC_PI_2, phi), DVec3::new(-phi.sin(), phi.cos(), 0.0)],
        }
    }
}

/// The last two parameters, with what follows from them alone.
struct Second {
    /// Radians.
    angles: [f64; 2],
    direction: DVec3,
    around: Around,
}

impl Second {
    /// From degrees.
    fn new(angles: [f64; 2]) -> Self {
        let [theta, phi] = angles;
        let around = Around::new(theta, phi);
        Self { angles: angles.map(f64::to_radians), direction: around.direction(), around }
    }
}

/// The pairs of directions of a table, in its order.
pub(super) struct Pairs {
    parameters: Parameters,
    first: Vec<(First, Listed)>,
    second: Vec<(Second, Listed)>,
}

impl Pairs {
    /// From lists of angles in degrees, the last one of offsets that belong to the first list.
    pub(super) fn new(parameters: Parameters, [a, b, c, d, offsets]: &[Vec<f64>; 5]) -> Self {
        let first =
            b.iter().flat_map(|b| a.iter().zip(offsets).map(|(a, offset)| First::new([*a, *b], *offset)));
        let second = d.iter().flat_map(|d| c.iter().map(|c| Second::new([*c, *d])));
        let (first, second): (Vec<_>, Vec<_>) = (first.collect(), second.collect());
        let listed_first = Listed::all(first.iter().map(|first| first.direction));
        let listed_second = Listed::all(second.iter().map(|second| second.direction));
        Self {
            parameters,
            first: first.into_iter().zip(listed_first).collect(),
            second: second.into_iter().zip(listed_second).collect(),
        }
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = (Pair, Twins)> {
        self.second.iter().flat_map(move |(second, listed)| {
            self.first.iter().map(move |(first, listed_first)| {
                let twins = match self.parameters {
                    Parameters::Spherical => listed_first.with(*listed, self.second.len()),
                    Parameters::Specular | Parameters::HalfDifference => {
                        listed_first.turning(*listed, self.second.len())
                    }
                    Parameters::Distorted => Twins::Unknown,
                };
                (self.parameters.pair_of(first, second), twins)
            })
        })
    }
}

/// Rusinkiewicz's half and difference angles.
fn half_difference(half: &First, difference: DVec3) -> Pair {
    let (h, [x, y]) = (half.direction, half.beside);
    let wi = x * difference.x + y * difference.y + h * difference.z;
    Pair { wi, wo: h * (2.0 * wi.dot(h)) - wi }
}

/// Azimuth and polar angle over 90 degrees as polar coordinates of a disk; the disk is drawn so that the mirror direction becomes its
/// centre and the horizon remains its edge.
fn distorted(light: &First, [theta, phi]: [f64; 2]) -> Pair {
    let ([theta_i, phi_i], offset) = (light.angles, light.offset);
    let (radius, centre) = (theta / FRAC_PI_2, (theta_i + offset) / FRAC_PI_2);
    let place = |radius: f64, phi: f64| (radius * phi.cos(), radius * phi.sin());
    let ((x, y), (x0, y0)) = (place(radius, phi), place(centre, phi_i + PI));
    let (x, y) = (x + x0 * (1.0 - radius), y + y0 * (1.0 - radius));
    Pair { wi: light.direction, wo: direction(x.hypot(y) * FRAC_PI_2, y.atan2(x)) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measurement::formats::tabulated::Tabulated;
    use approx::assert_abs_diff_eq;

    fn assert_pair(parameters: Parameters, degrees: [f64; 4], expected: [f64; 4]) {
        let found = parameters.pair(degrees, 0.0);
        let [theta_i, phi_i, theta_o, phi_o] = expected.map(f64::to_radians);
        for (found, expected) in
            [(found.wi, direction(theta_i, phi_i)), (found.wo, direction(theta_o, phi_o))]
        {
            assert_abs_diff_eq!((found - expected).length(), 0.0, epsilon = 1e-12);
        }
    }

    /// Places that need no arithmetic.
    #[test]
    fn directions_by_hand() {
        use Parameters::{Distorted, HalfDifference, Specular, Spherical};
        assert_pair(Spherical, [10.0, 20.0, 30.0, 40.0], [10.0, 20.0, 30.0, 40.0]);
        assert_pair(Specular, [30.0, 20.0, 0.0, 77.0], [30.0, 20.0, 30.0, 200.0]);
        assert_pair(Specular, [30.0, 20.0, 40.0, 180.0], [30.0, 20.0, 70.0, 200.0]);
        // The half vector at the normal: mirror directions. phi_d is then the light's own azimuth.
        assert_pair(HalfDifference, [0.0, 0.0, 35.0, 50.0], [35.0, 50.0, 35.0, 230.0]);
        // In the plane of the half vector and the normal, the light above it at phi_d = 0.
        assert_pair(HalfDifference, [20.0, 70.0, 35.0, 0.0], [55.0, 70.0, 15.0, 250.0]);
        assert_pair(HalfDifference, [20.0, 70.0, 35.0, 180.0], [15.0, 250.0, 55.0, 70.0]);
        // Retro-reflection.
        assert_pair(HalfDifference, [20.0, 70.0, 0.0, 0.0], [20.0, 70.0, 20.0, 70.0]);
        // The centre of the disk, its edge, and half way from the mirror direction to the horizon.
        assert_pair(Distorted, [40.0, 20.0, 0.0, 0.0], [40.0, 20.0, 40.0, 200.0]);
        assert_pair(Distorted, [40.0, 20.0, 90.0, 300.0], [40.0, 20.0, 90.0, 300.0]);
        assert_pair(Distorted, [40.0, 20.0, 45.0, 200.0], [40.0, 20.0, 65.0, 200.0]);
        // Without incidence nothing is distorted.
        assert_pair(Distorted, [0.0, 0.0, 45.0, 200.0], [0.0, 0.0, 45.0, 200.0]);
    }

    /// The directions themselves are the reference, for lists with every kind of repetition: at the normal, after a whole turn, of an angle.
    #[test]
    fn places_repeat_where_their_directions_do() {
        let lists = [
            vec![0.0, 30.0, 30.0, 60.0],
            vec![0.0, 90.0, 180.0, 360.0],
            vec![0.0, 20.0, 20.0, 45.0],
            vec![0.0, 90.0, 180.0, 360.0],
            vec![0.0; 4],
        ];
        for parameters in Parameters::ALL {
            let (mut by_twins, mut by_directions) = (Tabulated::new(1), Tabulated::new(1));
            for ((pair, twins), place) in Pairs::new(parameters, &lists).iter().zip(0_u32..) {
                // Some differ from the first of their directions, and stay.
                let sample = [f64::from(place % 5 / 4)];
                by_twins.take(pair, twins, &sample, |_| false);
                by_directions.take(pair, Twins::Unknown, &sample, |_| false);
            }
            let [found, expected] = [by_twins, by_directions].map(|table| table.measurement(Vec::new()));
            assert!(expected.dropped.get("repeated").is_some_and(|number| *number > 100), "{expected:?}");
            assert_eq!(found.dropped, expected.dropped, "{parameters:?}");
            assert_eq!(found.values, expected.values, "{parameters:?}");
        }
    }
}
