//! The parameterisations of ALTA (its `core/params.h` and `params.cpp`), each turned into a pair of directions. Angles are in
//! radians. What a parameterisation leaves open is fixed as ALTA's own conversion fixes it, or as [`Coordinates::assumed`] says.
//!
//! h is the half vector of light l and viewer v, d the viewer's direction in the frame of h; H and B are (l + v)/2 and
//! (l - v)/2 without normalisation (Stark et al. 2005, doi:10.1109/TVCG.2005.26; Neumann and Neumann 1996), r the mirror
//! direction of l, and k the back vector, half way between v and r (Schlick 1994).

use crate::geometry::{Pair, direction};
use glam::{DQuat, DVec3};
use std::f64::consts::{FRAC_PI_2, PI};

/// A parameterisation that can be turned into directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Coordinates {
    RusinThPhTdPd,
    RusinThPhTd,
    RusinThTdPd,
    RusinThTd,
    RusinTh,
    RusinVh,
    CosThTd,
    CosTh,
    SchlickTkPk,
    SchlickVk,
    SchlickTlTkProjDphi,
    CosTk,
    RetroTlTvlProjDphi,
    Stereographic,
    SphericalTlPlTvPv,
    CosTlv,
    CosTlr,
    IsotropicTvTlDphi,
    IsotropicTvProjDphi,
    IsotropicTlTvProjDphi,
    Stark2d,
    Stark3d,
    Neumann2d,
    Neumann3d,
    Cartesian,
}

/// A coordinate that has no meaning.
pub(super) struct Wrong {
    /// Its column, from 0.
    pub column: usize,
    /// What it should be.
    pub expected: &'static str,
}

use Coordinates as C;

/// Names in files, with the names of the coordinates.
const TABLE: &[(&str, Coordinates, &[&str])] = &[
    ("RUSIN_TH_PH_TD_PD", C::RusinThPhTdPd, &["theta_h", "phi_h", "theta_d", "phi_d"]),
    ("RUSIN_TH_PH_TD", C::RusinThPhTd, &["theta_h", "phi_h", "theta_d"]),
    ("RUSIN_TH_TD_PD", C::RusinThTdPd, &["theta_h", "theta_d", "phi_d"]),
    ("RUSIN_TH_TD", C::RusinThTd, &["theta_h", "theta_d"]),
    ("RUSIN_TH", C::RusinTh, &["theta_h"]),
    ("RUSIN_VH", C::RusinVh, &["h_x", "h_y", "h_z"]),
    ("COS_TH_TD", C::CosThTd, &["cos theta_h", "cos theta_d"]),
    ("COS_TH", C::CosTh, &["cos theta_h"]),
    ("SCHLICK_TK_PK", C::SchlickTkPk, &["theta_k", "phi_k"]),
    ("SCHLICK_VK", C::SchlickVk, &["k_x", "k_y", "k_z"]),
    // ALTA writes the name of the one above so.
    ("SCHLICK_VH", C::SchlickVk, &["k_x", "k_y", "k_z"]),
    ("SCHLICK_TL_TK_PROJ_DPHI", C::SchlickTlTkProjDphi, &["theta_l", "theta_k cos(phi)", "theta_k sin(phi)"]),
    ("COS_TK", C::CosTk, &["cos theta_k"]),
    ("RETRO_TL_TVL_PROJ_DPHI", C::RetroTlTvlProjDphi, &["theta_l", "theta_vl cos(phi)", "theta_vl sin(phi)"]),
    (
        "STEREOGRAPHIC",
        C::Stereographic,
        &["v_x/(1 + v_z)", "v_y/(1 + v_z)", "l_x/(1 + l_z)", "l_y/(1 + l_z)"],
    ),
    ("SPHERICAL_TL_PL_TV_PV", C::SphericalTlPlTvPv, &["theta_l", "phi_l", "theta_v", "phi_v"]),
    ("COS_TLV", C::CosTlv, &["cos(l, v)"]),
    ("COS_TLR", C::CosTlr, &["cos(l, r)"]),
    ("ISOTROPIC_TV_TL_DPHI", C::IsotropicTvTlDphi, &["theta_v", "theta_l", "dphi"]),
    ("ISOTROPIC_TV_PROJ_DPHI", C::IsotropicTvProjDphi, &["theta_v cos(dphi)", "theta_v sin(dphi)"]),
    (
        "ISOTROPIC_TL_TV_PROJ_DPHI",
        C::IsotropicTlTvProjDphi,
        &["theta_l", "theta_v cos(dphi)", "theta_v sin(dphi)"],
    ),
    ("STARK_2D", C::Stark2d, &["|H_p|", "|B|"]),
    ("STARK_3D", C::Stark3d, &["|H_p|", "|B|", "phi_B - phi_H"]),
    ("NEUMANN_2D", C::Neumann2d, &["|H_p|", "|B_p|"]),
    ("NEUMANN_3D", C::Neumann3d, &["|H_p|", "|B_p|", "phi_B - phi_H"]),
    ("CARTESIAN", C::Cartesian, &["v_x", "v_y", "v_z", "l_x", "l_y", "l_z"]),
];

/// Names of ALTA that do not determine two directions: the azimuth between light and viewer is open, or ALTA itself does not
/// say how they follow.
pub(super) const OPEN: &[&str] = &["RUSIN_VH_VD", "ISOTROPIC_TV_TL", "ISOTROPIC_TD_PD", "UNKNOWN_INPUT"];

/// How far beyond its range a cosine or a length may be by rounding.
const ROUNDING: f64 = 1e-6;
/// How far from 1 the length of a direction in a file may be: files have six digits.
const LENGTH: f64 = 1e-3;

impl Coordinates {
    /// The parameterisation of that name.
    pub fn named(name: &str) -> Option<Self> {
        TABLE.iter().find(|(known, ..)| *known == name).map(|(_, coordinates, _)| *coordinates)
    }

    /// Every name that can be read.
    pub fn names() -> Vec<&'static str> {
        TABLE.iter().map(|(name, ..)| *name).collect()
    }

    /// The names of its coordinates.
    pub fn columns(self) -> &'static [&'static str] {
        TABLE.iter().find(|(_, coordinates, _)| *coordinates == self).map_or(&[], |(_, _, columns)| columns)
    }

    /// The number of coordinates.
    pub fn number(self) -> usize {
        self.columns().len()
    }

    /// What had to be assumed to get two directions; `None` if nothing (beside isotropy).
    pub fn assumed(self) -> Option<&'static str> {
        match self {
            Self::RusinTh | Self::RusinVh | Self::CosTh => Some(
                "the file gives the half vector alone: light and viewer were taken to coincide with it (theta_d = 0)",
            ),
            Self::RusinThTd => Some("the file gives no phi_d: 90 degrees was taken, as ALTA does"),
            Self::CosThTd | Self::RusinThPhTd => Some("the file gives no phi_d: 0 was taken, as ALTA does"),
            Self::SchlickTkPk | Self::SchlickVk | Self::CosTk => Some(
                "the file gives the back vector alone: light and viewer were taken to be each other's mirror direction (theta_h = 0)",
            ),
            Self::CosTlv | Self::CosTlr | Self::IsotropicTvProjDphi => {
                Some("the file gives no direction of the light: normal incidence was taken, as ALTA does")
            }
            Self::Stark2d | Self::Neumann2d => Some(
                "the file gives no azimuth between half and back vector: 90 degrees was taken, as ALTA does",
            ),
            _ => None,
        }
    }

    /// The directions of the light and the viewer; `None` if no pair of directions has these coordinates.
    pub fn pair(self, x: &[f64]) -> Result<Option<Pair>, Wrong> {
        let at = |column: usize| x.get(column).copied().unwrap_or_default();
        let polar = |column: usize| angle_of(at(column), column);
        let arc = |column: usize| cosine_of(at(column), column).map(f64::acos);
        Ok(Some(match self {
            Self::RusinThPhTdPd => half_difference(polar(0)?, at(1), polar(2)?, at(3)),
            Self::RusinThPhTd => half_difference(polar(0)?, at(1), polar(2)?, 0.0),
            Self::RusinThTdPd => half_difference(polar(0)?, 0.0, polar(1)?, at(2)),
            Self::RusinThTd => half_difference(polar(0)?, 0.0, polar(1)?, FRAC_PI_2),
            Self::RusinTh => half_difference(polar(0)?, 0.0, 0.0, 0.0),
            Self::CosThTd => half_difference(arc(0)?, 0.0, arc(1)?, 0.0),
            Self::CosTh => half_difference(arc(0)?, 0.0, 0.0, 0.0),
            Self::RusinVh => {
                let h = unit(DVec3::new(at(0), at(1), at(2)), 0)?;
                Pair { wi: h, wo: h }
            }
            Self::SchlickTkPk => mirrored(direction(polar(0)?, at(1))),
            Self::SchlickVk => mirrored(unit(DVec3::new(at(0), at(1), at(2)), 0)?),
            Self::CosTk => mirrored(direction(arc(0)?, 0.0)),
            Self::CosTlv | Self::CosTlr => Pair { wi: DVec3::Z, wo: direction(arc(0)?, 0.0) },
            Self::SchlickTlTkProjDphi => {
                let wi = direction(polar(0)?, 0.0);
                let mirror = DVec3::new(-wi.x, -wi.y, wi.z);
                let back = projected(at(1), at(2), 1)?;
                Pair { wi, wo: (2.0 * mirror.dot(back) * back - mirror).normalize_or_zero() }
            }
            Self::RetroTlTvlProjDphi => {
                let theta = polar(0)?;
                let wi = direction(theta, 0.0);
                let (along, across) = (at(1), at(2));
                let between = angle_of(along.hypot(across), 1)?;
                let azimuth = across.atan2(along);
                // From the light towards the normal, and across.
                let towards = DVec3::new(-theta.cos(), 0.0, theta.sin());
                let aside = azimuth.cos() * towards + azimuth.sin() * DVec3::Y;
                Pair { wi, wo: between.cos() * wi + between.sin() * aside }
            }
            Self::Stereographic => Pair { wi: from_plane(at(2), at(3)), wo: from_plane(at(0), at(1)) },
            Self::SphericalTlPlTvPv => {
                Pair { wi: direction(polar(0)?, at(1)), wo: direction(polar(2)?, at(3)) }
            }
            Self::IsotropicTvTlDphi => {
                Pair { wi: direction(polar(1)?, at(2)), wo: direction(polar(0)?, 0.0) }
            }
            Self::IsotropicTvProjDphi => Pair { wi: DVec3::Z, wo: projected(at(0), at(1), 0)? },
            Self::IsotropicTlTvProjDphi => {
                Pair { wi: direction(polar(0)?, 0.0), wo: projected(at(1), at(2), 1)? }
            }
            Self::Stark2d => return Ok(stark(at(0), at(1), FRAC_PI_2)),
            Self::Stark3d => return Ok(stark(at(0), at(1), at(2))),
            Self::Neumann2d => return Ok(neumann(at(0), at(1), FRAC_PI_2)),
            Self::Neumann3d => return Ok(neumann(at(0), at(1), at(2))),
            Self::Cartesian => Pair {
                wi: unit(DVec3::new(at(3), at(4), at(5)), 3)?,
                wo: unit(DVec3::new(at(0), at(1), at(2)), 0)?,
            },
        }))
    }
}

/// An angle that a direction can have; degrees are nearly always beyond it.
fn angle_of(angle: f64, column: usize) -> Result<f64, Wrong> {
    let valid = angle.abs() <= PI + ROUNDING;
    if valid { Ok(angle) } else { Err(Wrong { column, expected: "an angle in radians, at most pi" }) }
}

/// A cosine.
fn cosine_of(cosine: f64, column: usize) -> Result<f64, Wrong> {
    let valid = cosine.abs() <= 1.0 + ROUNDING;
    if valid { Ok(cosine.clamp(-1.0, 1.0)) } else { Err(Wrong { column, expected: "a cosine" }) }
}

/// A direction whose length was rounded when written.
fn unit(v: DVec3, column: usize) -> Result<DVec3, Wrong> {
    let valid = (v.length() - 1.0).abs() <= LENGTH;
    if valid {
        Ok(v.normalize_or_zero())
    } else {
        Err(Wrong { column, expected: "a direction of length 1 from" })
    }
}

/// The direction whose polar angle times the cosine and sine of its azimuth are x and y.
fn projected(x: f64, y: f64, column: usize) -> Result<DVec3, Wrong> {
    Ok(direction(angle_of(x.hypot(y), column)?, y.atan2(x)))
}

/// The direction at (x, y) of the stereographic projection from the nadir.
fn from_plane(x: f64, y: f64) -> DVec3 {
    // Far out all directions are the nadir, and squares would overflow.
    let (x, y) = (x.clamp(-1e9, 1e9), y.clamp(-1e9, 1e9));
    let square = x * x + y * y;
    (DVec3::new(2.0 * x, 2.0 * y, 1.0 - square) / (1.0 + square)).normalize_or_zero()
}

/// Light and viewer from the half vector, and the viewer's direction d in its frame.
fn half_difference(theta_h: f64, phi_h: f64, theta_d: f64, phi_d: f64) -> Pair {
    let turn = DQuat::from_rotation_z(phi_h) * DQuat::from_rotation_y(theta_h);
    let d = direction(theta_d, phi_d);
    Pair { wi: turn * DVec3::new(-d.x, -d.y, d.z), wo: turn * d }
}

/// Light and viewer in each other's mirror direction, the light along the back vector.
fn mirrored(back: DVec3) -> Pair {
    Pair { wi: back, wo: DVec3::new(-back.x, -back.y, back.z) }
}

/// Light and viewer from the length of H in the plane, that of B, and the azimuth between them.
fn stark(half: f64, back: f64, azimuth: f64) -> Option<Pair> {
    let up2 = 1.0 - half * half - back * back;
    if !(-ROUNDING..=1.0).contains(&up2) {
        return None;
    }
    let h = DVec3::new(half, 0.0, up2.max(0.0).sqrt());
    // B is perpendicular to H.
    let (sin, cos) = azimuth.sin_cos();
    let b = DVec3::new(h.z * cos, h.z * sin, -h.x * cos);
    // Where H lies in the plane and B stands on it, the azimuth of B says nothing.
    let b = b.try_normalize().unwrap_or(DVec3::Z) * back;
    Some(Pair { wi: (h + b).normalize_or_zero(), wo: (h - b).normalize_or_zero() })
}

/// Light and viewer from the lengths of H and B in the plane, and the azimuth between them.
fn neumann(half: f64, back: f64, azimuth: f64) -> Option<Pair> {
    let (sin, cos) = azimuth.sin_cos();
    let raised = |x: f64, y: f64| {
        let up2 = 1.0 - x * x - y * y;
        (-ROUNDING..=1.0).contains(&up2).then(|| DVec3::new(x, y, up2.max(0.0).sqrt()).normalize_or_zero())
    };
    let wi = raised(half + back * cos, back * sin)?;
    let wo = raised(half - back * cos, -back * sin)?;
    Some(Pair { wi, wo })
}
