//! A language.

use super::program::{Arguments, NotWritten, Program};
use super::spelling::Spelling;
use crate::error::Error;
use crate::model::Expression;
use crate::parameters::ParameterTable;

/// A language that programs are written in.
#[derive(Clone, Copy, Debug)]
pub struct Language {
    /// Name on the command line.
    pub name: &'static str,
    /// What is written, in a few words.
    pub summary: &'static str,
    /// The usual ending of the file's name, without the dot.
    pub extension: &'static str,
    /// How steps are spelled.
    pub(crate) spelling: Spelling,
    /// Writes the whole file.
    pub(crate) write: fn(&Program) -> String,
}

impl Language {
    /// Writes the model of an expression, at the values in the table. The comment says what it is, and before that, in the lines
    /// `about`, where it comes from.
    ///
    /// # Errors
    /// [`NotWritten`] if the parameters cannot be arguments.
    pub fn write(
        &self,
        expression: &Expression,
        table: &ParameterTable,
        arguments: Arguments,
        about: &[String],
    ) -> Result<String, NotWritten> {
        Program::new(expression, table, arguments, &self.spelling, about)
            .map(|program| (self.write)(&program))
    }

    /// Writes a model for one channel, at the values in the expression and default ones. Names of parameters have no channel.
    ///
    /// # Errors
    /// Those of [`ParameterTable::new`], for constraints of the expression.
    pub fn write_for_one_channel(
        &self,
        expression: &Expression,
        arguments: Arguments,
        about: &[String],
    ) -> Result<Result<String, NotWritten>, Error> {
        let table = ParameterTable::of_one_channel(expression)?;
        Ok(self.write(expression, &table, arguments, about))
    }
}
