//! The registry of all languages.

use super::language::Language;
use super::languages::{c, glsl, javascript, jax, osl, python_numpy, slang, wgsl};
use crate::error::{Error, NameKind};

/// All languages, in the order in which they are listed for users.
pub const LANGUAGES: &[Language] = &[
    python_numpy::LANGUAGE,
    jax::LANGUAGE,
    c::LANGUAGE,
    javascript::LANGUAGE,
    glsl::LANGUAGE,
    wgsl::LANGUAGE,
    osl::LANGUAGE,
    slang::LANGUAGE,
];

/// The language with this name. An error calls the option `option`.
///
/// # Errors
/// [`Error::UnknownName`] if there is none.
pub fn named(option: &str, name: &str) -> Result<&'static Language, Error> {
    let names: Vec<&str> = LANGUAGES.iter().map(|language| language.name).collect();
    let found = LANGUAGES.iter().find(|language| language.name.eq_ignore_ascii_case(name));
    found.ok_or_else(|| Error::unknown(option, NameKind::Language, &names, name))
}
