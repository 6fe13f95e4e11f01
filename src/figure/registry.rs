//! The registry of all kinds of figures.

use super::kind::Kind;
use super::kinds::{convergence, fresnel, front, lobe, map, profile, residuals, sphere};

/// All kinds of figures.
pub const KINDS: &[Kind] = &[
    lobe::KIND,
    sphere::KIND,
    map::KIND,
    residuals::KIND,
    profile::KIND,
    fresnel::KIND,
    front::KIND,
    convergence::KIND,
];
