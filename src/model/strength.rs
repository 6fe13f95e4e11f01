//! How strong a lobe of a sum is, and how it can be absent.

use super::parameter::ParamSpec;

/// How a lobe can be absent from a sum: what must be 0 for its f to be 0 everywhere.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Strength {
    /// All amplitudes that are free by default.
    Amplitudes,
    /// A shape, such as the albedo of a body that the basis depends on.
    Shape(&'static str),
    /// An amplitude that multiplies the whole lobe, and that is 1 in the physical model.
    Scale(&'static str),
    /// The model has no such parameter. In a sum its lobe gets one, [`STRENGTH`].
    Missing,
}

/// Name of the parameter that a lobe of a sum gets if its model cannot be absent.
pub const STRENGTH: &str = "strength";

/// The declaration of that parameter.
pub(super) fn added() -> ParamSpec {
    ParamSpec::amplitude(STRENGTH, "scale of the model: 0 absent, 1 as it stands", 1000.0, 1.0).fixed()
}
