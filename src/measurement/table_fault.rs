//! What may be wrong with the layout of a half/difference table.

use std::fmt;

/// An axis along which a table stores its numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum TableAxis {
    /// Red, green and blue.
    Colour,
    /// The angle between normal and half vector.
    ThetaH,
    /// The angle between half vector and light.
    ThetaD,
    /// The azimuth of the light about the half vector.
    PhiD,
}

impl TableAxis {
    /// Name in messages.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Colour => "colour",
            Self::ThetaH => "theta_h",
            Self::ThetaD => "theta_d",
            Self::PhiD => "phi_d",
        }
    }
}

/// A layout that a table seems to have, although its format prescribes another.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum TableFault {
    /// The numbers are in another order.
    Order {
        /// The axes, that which runs slowest first.
        axes: [TableAxis; 4],
        /// Whether theta_h grows linearly with its index.
        linear: bool,
        /// Whether theta_h and theta_d may also be exchanged, which the file does not show.
        maybe_exchanged: bool,
        /// The share of filled cells whose directions would lie below the horizon in the order of the format.
        below_horizon: f64,
    },
    /// theta_h grows linearly with its index instead of with the square of it.
    LinearThetaH,
    /// The factors that turn the stored numbers into f were already applied to them.
    ScaledTwice {
        /// The share of light along the normal that the surface would reflect, at most, of all channels.
        albedo: f64,
    },
}

impl fmt::Display for TableFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Order { axes, linear, maybe_exchanged, below_horizon } => {
                let interleaved = axes.last() == Some(&TableAxis::Colour);
                let planes = if interleaved { ", with the planes of the colours interleaved" } else { "" };
                let linear = if *linear { " and theta_h stored linearly" } else { "" };
                let exchanged =
                    if *maybe_exchanged { " (or with theta_h and theta_d exchanged)" } else { "" };
                let [first, second, third, last] = axes.map(TableAxis::name);
                write!(
                    f,
                    "the axes of the table seem to be in another order than MERL's: {:.0} % of the filled cells lie below the \
                     horizon, but almost none if {first} runs slowest, then {second}, {third} and {last}{exchanged}{planes}{linear}; \
                     values are assigned to wrong directions until you rewrite the table with colour slowest, then theta_h, \
                     theta_d and phi_d",
                    100.0 * below_horizon
                )
            }
            Self::LinearThetaH => write!(
                f,
                "the table seems to store theta_h linearly: its filled cells end at the horizon if theta_h is 90 degrees times \
                 (i + 0.5)/90, not times the square of that, as in MERL's tables; values are assigned to wrong directions until \
                 you resample the table at theta_h = 90 degrees ((i + 0.5)/90)^2"
            ),
            Self::ScaledTwice { albedo } => write!(
                f,
                "at most 1/{:.0} of the light along the normal would be reflected, far less than by black paint, as if the table \
                 were scaled twice: a table must hold f divided by (1, 1.15, 1.66)/1500; if it holds f itself, multiply red by \
                 1500, green by 1500/1.15 and blue by 1500/1.66",
                1.0 / albedo
            ),
        }
    }
}
