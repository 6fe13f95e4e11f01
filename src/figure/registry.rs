//! The registry of all kinds of figures.

use super::kind::Kind;
use super::kinds::{convergence, fresnel, front, lobe, map, profile, residuals, sphere};

/// All kinds of figures.
pub const KINDS: &[Kind] = &[
    lobe::KIND,
    map::KIND,
    sphere::KIND,
    residuals::KIND,
    profile::KIND,
    fresnel::KIND,
    front::KIND,
    convergence::KIND,
];
