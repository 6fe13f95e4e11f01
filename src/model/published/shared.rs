//! Code shared by the models of published tables.

use crate::model::{ParamSpec, Scale, Sharing, Sharper, Unit};

/// The reference of the `ngan-...` models.
pub(crate) const NGAN: &str = "Ngan, Durand and Matusik 2005, Experimental Analysis of BRDF Models, \
    doi:10.2312/EGWR/EGSR05/117-126";
/// The reference of the `low-...` models.
pub(crate) const LOW: &str = "Low et al. 2012, BRDF Models for Accurate and Efficient Rendering of Glossy Surfaces, \
    doi:10.1145/2077341.2077350";

/// The parameters kd and ks, in the unit of the table.
pub(crate) fn base_and_scale(unit: Unit) -> Vec<ParamSpec> {
    vec![
        ParamSpec::amplitude("kd", "albedo of the base", 2.0, 0.2).unit(unit),
        ParamSpec::amplitude("ks", "scale of the lobe", 1000.0, 0.2).unit(unit),
    ]
}

/// The parameter f0, one value for all channels.
pub(crate) fn shared_f0() -> ParamSpec {
    let f0 = ParamSpec::amplitude("f0", "reflectance at normal incidence", 1.0, 0.05);
    ParamSpec { sharing: Sharing::Shared, ..f0 }
}

/// The parameters kd, a, b and c of the two ABC models.
pub(crate) fn base_and_abc() -> Vec<ParamSpec> {
    vec![
        ParamSpec::albedo("kd", "albedo of the base", 0.2),
        ParamSpec::amplitude("a", "strength of the lobe", 1e5, 1.0),
        ParamSpec::shape("b", "inverse width of the peak", (1e-2, 1e9), (5.0, 1e6), 200.0, Scale::Log)
            .sharper_when(Sharper::Larger),
        ParamSpec::shape("c", "decline of the tail", (0.01, 20.0), (0.3, 4.0), 1.0, Scale::Log),
    ]
}
