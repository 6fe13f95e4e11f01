//! One file per language.

pub(super) mod c;
pub(super) mod glsl;
pub(super) mod javascript;
pub(super) mod jax;
pub(super) mod osl;
pub(super) mod python_numpy;
mod shader;
pub(super) mod slang;
pub(super) mod text;
pub(super) mod wgsl;
