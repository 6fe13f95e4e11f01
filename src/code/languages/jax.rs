//! Python with JAX, whose gradients are those of brdfit.

use super::python_numpy::{arguments, entry, head};
use super::text::statements;
use crate::code::{Language, Level, Program, Spelling, double};
use crate::math::recorded::Function;
use std::fmt::Write as _;

pub(crate) const LANGUAGE: Language = Language {
    name: "jax",
    summary: "Python with JAX: f(wi, wo, **parameters), which can be differentiated",
    extension: "py",
    spelling: SPELLING,
    write,
};

const SPELLING: Spelling = Spelling {
    is_single: false,
    differentiates: true,
    lacks: &[],
    number: |value| double(value, "jnp.inf", "jnp.nan"),
    component: |vector, component| format!("{vector}[:, {component}]"),
    function,
    native: function,
    choice: |[a, b, then, otherwise]| (format!("jnp.where({a} < {b}, {then}, {otherwise})"), Level::Whole),
    cell: |place, last| format!("jnp.where({place} > 0, jnp.minimum({place}, {last}), 0).astype(int)"),
    entry,
    held: |value| format!("jax.lax.stop_gradient({value})"),
};

fn function(function: Function) -> &'static str {
    match function {
        Function::Exp => "jnp.exp",
        Function::Ln => "jnp.log",
        Function::Ln1p => "jnp.log1p",
        Function::Sqrt => "jnp.sqrt",
        Function::Sin => "jnp.sin",
        Function::Erfc => "jax.scipy.special.erfc",
        Function::Atan2 => "jnp.arctan2",
    }
}

fn write(program: &Program) -> String {
    let mut text = head(program, "import jax\nimport jax.numpy as jnp", "jnp.array", &SPELLING);
    let _ = write!(
        text,
        "\n\ndef f(wi, wo{}):\n\
         \x20   \"\"\"f in 1/sr, of shape (n, {}): a column per channel.\n\n\
         \x20   wi, wo: unit vectors to the light and to the viewer, of shape (n, 3); the normal is (0, 0, 1). They should be in double\n\
         \x20   precision: jax.config.update(\"jax_enable_x64\", True) comes before everything else.\n\
         \x20   \"\"\"\n\
         \x20   wi, wo = jnp.asarray(wi), jnp.asarray(wo)\n",
        arguments(program, true, &SPELLING),
        program.channels.len(),
    );
    text += &statements(&program.body, "    ", |name, value| format!("{name} = {value}"));
    let outputs: String = program.body.outputs.iter().map(|output| format!("        {output},\n")).collect();
    let _ = write!(text, "    channels = (\n{outputs}    )\n    return jnp.stack(channels, axis=-1)\n");
    text
}
