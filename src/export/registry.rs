//! The registry of all targets.

use super::target::Target;
use super::{blender, code, gltf, materialx, mitsuba, mitsuba_plugin, pbrt, radiance, usd};
use crate::error::{Error, NameKind};

/// All targets.
pub const TARGETS: &[Target] = &[
    mitsuba::TARGET,
    mitsuba_plugin::TARGET,
    pbrt::TARGET,
    gltf::TARGET,
    materialx::TARGET,
    usd::TARGET,
    blender::TARGET,
    radiance::TARGET,
    code::TARGET,
];

/// The target with this name.
///
/// # Errors
/// [`Error::UnknownName`] if there is none.
pub fn named(name: &str) -> Result<&'static Target, Error> {
    let names: Vec<&str> = TARGETS.iter().map(|target| target.name).collect();
    let found = TARGETS.iter().find(|target| target.name.eq_ignore_ascii_case(name));
    found.ok_or_else(|| Error::unknown("--to", NameKind::Target, &names, name))
}
