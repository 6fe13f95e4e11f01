//! A language.

use super::program::Program;
use super::spelling::Spelling;
use crate::math::recorded::Function;

/// A language that programs are written in.
#[derive(Clone, Copy, Debug)]
pub struct Language {
    /// Name on the command line.
    pub name: &'static str,
    /// What is written, in a few words.
    pub summary: &'static str,
    /// The usual ending of the file's name, without the dot.
    pub extension: &'static str,
    /// Whether its numbers have single precision.
    pub is_single: bool,
    /// Whether it differentiates programs itself.
    pub differentiates: bool,
    /// Functions that it does not have: they are written before the program, as far as it uses them.
    pub(crate) lacks: &'static [Function],
    /// How steps are spelled.
    pub(crate) spelling: Spelling,
    /// Writes the whole file.
    pub(crate) write: fn(&Program) -> String,
}

impl Language {
    /// Writes a program, whose steps must be those for this language.
    #[must_use]
    pub fn write(&self, program: &Program) -> String {
        (self.write)(program)
    }
}
