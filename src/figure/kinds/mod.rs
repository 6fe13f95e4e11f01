//! The kinds of figures, one file each.

pub(super) mod convergence;
pub(super) mod fresnel;
pub(super) mod front;
pub(super) mod lobe;
pub(super) mod map;
pub(super) mod profile;
pub(super) mod residuals;
pub(super) mod sphere;
