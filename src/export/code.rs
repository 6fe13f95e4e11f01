//! Source code of the model, in one of several languages.

use super::target::{Holds, Target};
use super::values::{About, NotHeld};
use crate::model::Expression;
use crate::parameters::ParameterTable;

pub(super) const TARGET: Target = Target {
    name: "code",
    summary: "source code of the model, in the language of --language",
    extension: "",
    own: "",
    holds: Holds::Models(holds),
    primaries: &[("rec709", "")],
    caveat: "",
};

fn holds(expression: &Expression, table: &ParameterTable, about: &About<'_>) -> Result<String, NotHeld> {
    let Some((language, arguments)) = about.code else {
        return Err(NotHeld::Lobe("no language".to_owned()));
    };
    language.write(expression, table, arguments, &about.lines).map_err(NotHeld::Code)
}
