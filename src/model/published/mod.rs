//! Models in the form of published tables of fits, with the constants, units and parametrisations of their authors.

pub(super) mod bagher_sgd;
pub(super) mod cook_torrance_1982;
pub(super) mod low_ashikhmin_shirley;
pub(super) mod low_cook_torrance;
pub(super) mod low_microfacet;
pub(super) mod low_smooth;
pub(super) mod ngan_ashikhmin_shirley;
pub(super) mod ngan_blinn_phong;
pub(super) mod ngan_cook_torrance;
pub(super) mod ngan_lafortune;
pub(super) mod ngan_ward;
pub(super) mod ngan_ward_duer;
mod shared;
