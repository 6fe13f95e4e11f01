//! The red, green and blue that colours are stated in, and the conversion between them.
//!
//! ```text
//! P = (X, Y, Z of red, green and blue, scaled to add up to white)       RGB to XYZ
//! A = B^-1 diag(B w' / B w) B                                           from white w to white w' (Bradford)
//! RGB' = P'^-1 A P RGB
//! ```
//!
//! - Chromaticities: ITU-R BT.709-6 and BT.2020-2; Display P3, SMPTE EG 432-1 with the white of D65; AP0 and AP1, SMPTE ST 2065-1 and
//!   Academy S-2014-004, whose white is that of ACES (near D60); Radiance, the `STDPRIMS` of its `color.h`, whose white is E.
//! - B: Bradford's matrix, as in Lam 1985, "Metamerism and Colour Constancy"; the values are those of ICC.1:2022, annex E.

use crate::error::{Error, NameKind};
use nalgebra::{Matrix3, Vector3};

/// Red, green and blue, and what is white in them.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Primaries {
    /// Name on the command line.
    pub name: &'static str,
    /// Name in texts, with the white.
    pub title: &'static str,
    /// The chromaticities x, y of red, green and blue.
    pub rgb: [[f64; 2]; 3],
    /// The chromaticity x, y of white.
    pub white: [f64; 2],
}

const D65: [f64; 2] = [0.3127, 0.3290];
const ACES_WHITE: [f64; 2] = [0.321_68, 0.337_67];

/// Linear Rec.709, the primaries of sRGB, in which brdfit computes.
pub const REC709: Primaries = Primaries {
    name: "rec709",
    title: "linear Rec.709 (white D65)",
    rgb: [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]],
    white: D65,
};

/// All primaries that colours can be converted to.
pub const PRIMARIES: &[Primaries] = &[
    REC709,
    Primaries {
        name: "rec2020",
        title: "linear Rec.2020 (white D65)",
        rgb: [[0.708, 0.292], [0.170, 0.797], [0.131, 0.046]],
        white: D65,
    },
    Primaries {
        name: "display-p3",
        title: "linear Display P3 (white D65)",
        rgb: [[0.680, 0.320], [0.265, 0.690], [0.150, 0.060]],
        white: D65,
    },
    Primaries {
        name: "acescg",
        title: "ACEScg (AP1, white near D60)",
        rgb: [[0.713, 0.293], [0.165, 0.830], [0.128, 0.044]],
        white: ACES_WHITE,
    },
    Primaries {
        name: "aces2065-1",
        title: "ACES2065-1 (AP0, white near D60)",
        rgb: [[0.7347, 0.2653], [0.0, 1.0], [0.0001, -0.0770]],
        white: ACES_WHITE,
    },
    Primaries {
        name: "radiance",
        title: "Radiance's own primaries (white E)",
        rgb: [[0.640, 0.330], [0.290, 0.600], [0.150, 0.060]],
        white: [1.0 / 3.0, 1.0 / 3.0],
    },
];

impl Primaries {
    /// The primaries called `name`.
    ///
    /// # Errors
    /// [`Error::UnknownName`] if there are none.
    pub fn named(name: &str) -> Result<&'static Self, Error> {
        let names: Vec<&str> = PRIMARIES.iter().map(|primaries| primaries.name).collect();
        let found = PRIMARIES.iter().find(|primaries| primaries.name.eq_ignore_ascii_case(name));
        found.ok_or_else(|| Error::unknown("--primaries", NameKind::Primaries, &names, name))
    }

    /// Whether these are the primaries in which brdfit computes.
    #[must_use]
    pub fn are_rec709(&self) -> bool {
        self.name == REC709.name
    }

    /// The matrix from linear Rec.709 to these primaries, row by row, with Bradford adaptation between the whites. White stays
    /// (1, 1, 1).
    #[must_use]
    pub fn from_rec709(&self) -> [[f64; 3]; 3] {
        let inverse = self.to_xyz().try_inverse().unwrap_or_default();
        let matrix = inverse * adaptation(REC709.white, self.white) * REC709.to_xyz();
        std::array::from_fn(|row| std::array::from_fn(|column| matrix[(row, column)]))
    }

    /// RGB to XYZ: the columns are the primaries, scaled so that they add up to white.
    pub(super) fn to_xyz(self) -> Matrix3<f64> {
        let primaries = Matrix3::from_columns(&self.rgb.map(from_xy));
        // The three primaries are independent, so the system has a solution.
        let amounts = primaries.lu().solve(&from_xy(self.white)).unwrap_or_default();
        primaries * Matrix3::from_diagonal(&amounts)
    }
}

/// X, Y, Z of a chromaticity, with Y = 1.
pub(super) fn from_xy([x, y]: [f64; 2]) -> Vector3<f64> {
    Vector3::new(x / y, 1.0, (1.0 - x - y) / y)
}

/// Bradford's matrix, from XYZ to responses.
const BRADFORD: [[f64; 3]; 3] =
    [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]];

/// The matrix in XYZ that makes what looks white under one white look white under another.
pub(super) fn adaptation(from: [f64; 2], to: [f64; 2]) -> Matrix3<f64> {
    if from == to {
        return Matrix3::identity();
    }
    let bradford = Matrix3::from_fn(|row, column| BRADFORD[row][column]);
    let gains = (bradford * from_xy(to)).component_div(&(bradford * from_xy(from)));
    bradford.try_inverse().unwrap_or_default() * Matrix3::from_diagonal(&gains) * bradford
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    fn matrix(name: &str) -> [[f64; 3]; 3] {
        Primaries::named(name).unwrap().from_rec709()
    }

    /// Matrices that others publish, to their digits.
    #[test]
    fn matrices_are_those_of_others() {
        // ITU-R BT.2087-0, equation for linear signals.
        let rec2020 = [[0.6274, 0.3293, 0.0433], [0.0691, 0.9195, 0.0114], [0.0164, 0.0880, 0.8956]];
        // The ACES project's colour transforms (Rec.709 to AP1 with Bradford), also in the OpenColorIO configuration for ACES.
        let acescg = [
            [0.613_097, 0.339_523, 0.047_379],
            [0.070_194, 0.916_354, 0.013_452],
            [0.020_616, 0.109_570, 0.869_815],
        ];
        // Likewise to AP0.
        let aces = [
            [0.439_633, 0.382_989, 0.177_378],
            [0.089_776, 0.813_439, 0.096_784],
            [0.017_541, 0.111_547, 0.870_912],
        ];
        for (name, wanted, epsilon) in
            [("rec2020", rec2020, 6e-5), ("acescg", acescg, 2e-5), ("aces2065-1", aces, 2e-5)]
        {
            for (found, wanted) in matrix(name).iter().flatten().zip(wanted.iter().flatten()) {
                assert_abs_diff_eq!(found, wanted, epsilon = epsilon);
            }
        }
    }

    #[test]
    fn white_stays_white() {
        for primaries in PRIMARIES {
            for row in primaries.from_rec709() {
                assert_abs_diff_eq!(row.iter().sum::<f64>(), 1.0, epsilon = 1e-12);
            }
        }
        assert!(Primaries::named("acecg").unwrap_err().to_string().contains("acescg"));
    }
}
