//! Mitsuba 3: a BSDF plugin in Python, which holds every model.
//!
//! Its documentation: <https://mitsuba.readthedocs.io>, "Custom plugins" and `MicrofacetDistribution` of version 3.9. Directions are
//! drawn from a mixture of a cosine and, for each lobe with a roughness, Mitsuba's own distribution of visible normals.

use super::target::{Holds, Target, UNSTATED};
use super::values::{About, NotHeld, Values};
use crate::code::{Arguments, Level, Program, Spelling, comment, double, field, python_rows, statements};
use crate::math::recorded::Function;
use crate::model::Expression;
use crate::parameters::ParameterTable;
use std::fmt::Write as _;

pub(super) const TARGET: Target = Target {
    name: "mitsuba-plugin",
    summary: "Mitsuba 3: Python with a BSDF that holds any model",
    extension: "py",
    own: "lambert + cook-torrance",
    holds: Holds::Models(holds),
    primaries: UNSTATED,
    caveat: "",
};

const SPELLING: Spelling = Spelling {
    is_single: true,
    differentiates: false,
    lacks: &[Function::Erfc, Function::Ln1p],
    number: |value| double(value, "dr.inf", "dr.nan"),
    component: field,
    function,
    native: function,
    choice: |[a, b, then, otherwise]| (format!("dr.select({a} < {b}, {then}, {otherwise})"), Level::Whole),
    cell: |place, last| format!("dr.clip(dr.floor({place}), 0.0, {last}.0)"),
    entry: |table, cell, below, column, columns| {
        format!("entry(TABLE_{}, {columns} * {cell} + {})", table + 1, below * columns + column)
    },
    held: str::to_owned,
};

fn function(function: Function) -> &'static str {
    match function {
        Function::Exp => "dr.exp",
        Function::Ln => "dr.log",
        Function::Ln1p => "log1p",
        Function::Sqrt => "dr.sqrt",
        Function::Sin => "dr.sin",
        Function::Erfc => "erfc",
        Function::Atan2 => "dr.atan2",
    }
}

fn holds(expression: &Expression, table: &ParameterTable, about: &About<'_>) -> Result<String, NotHeld> {
    let values = Values::new(expression, table, about)?;
    let program =
        Program::new(expression, table, Arguments::Fixed, &SPELLING, &about.lines).map_err(NotHeld::Code)?;
    let mut text = head(&program);
    let outputs: Vec<&str> = values
        .channels()
        .iter()
        .map(|channel| program.body.outputs.get(*channel).map_or("0.0", String::as_str))
        .collect();
    let _ = write!(text, "    return mi.Color3f(\n        {},\n    )\n", outputs.join(",\n        "));
    let proposals: Vec<String> = values.lobes().into_iter().filter_map(proposal).collect();
    let others = values.lobes().len() > proposals.len() || proposals.is_empty();
    let list: String = proposals.iter().map(|proposal| format!("    {proposal},\n")).collect();
    let _ = write!(
        text,
        "\n\n# Distributions of visible normals that directions are drawn from: the type, alpha along x, alpha along y.\n\
         LOBES = (\n{list})\n\
         # The share of directions that are drawn from a cosine instead.\n\
         DIFFUSE = {}\n{PLUGIN}",
        match (proposals.len(), others) {
            (0, _) => "1.0",
            (_, true) => "0.5",
            (_, false) => "0.1",
        }
    );
    Ok(text)
}

/// What directions of a lobe can be drawn from; `None` for one that has no roughness.
fn proposal(lobe: super::values::LobeOf<'_, '_>) -> Option<String> {
    /// Lobes that are not about the mirror direction.
    const ELSEWHERE: &[&str] = &["lambert", "oren-nayar", "eon", "disney-diffuse", "retro"];
    if ELSEWHERE.contains(&lobe.model()) {
        return None;
    }
    let beckmann = lobe.choice("d").starts_with("beckmann") || lobe.model().starts_with("ward");
    // Channels apart are drawn from what is in their middle.
    let mean = |name: &str| lobe.rgb(name).iter().sum::<f64>() / 3.0;
    let [along, across] = match () {
        () if mean("mx") > 0.0 => [mean("mx"), mean("my")],
        () if mean("m") > 0.0 => [mean("m"); 2],
        () => ["roughness", "specular_roughness"]
            .map(|name| mean(name).powi(2))
            .into_iter()
            .find(|alpha| *alpha > 0.0)
            .map(|alpha| [alpha; 2])?,
    };
    let kind = if beckmann { "Beckmann" } else { "GGX" };
    let [along, across] = [along, across].map(|alpha| alpha.clamp(1e-4, 1.0));
    Some(format!("(mi.MicrofacetType.{kind}, {along:?}, {across:?})"))
}

/// The file up to the statements of the function, without its result.
fn head(program: &Program) -> String {
    let mut text = comment(program, "#");
    text.push_str(
        "#\n# Load this file after mi.set_variant(\"llvm_ad_rgb\") or another variant in RGB, with import or mi-python; then \"type\": \"brdfit\" is a BSDF.\n\
         import drjit as dr\nimport mitsuba as mi\n\n",
    );
    for (index, table) in &program.tables {
        let _ = write!(text, "TABLE_{} = (\n{})\n", index + 1, python_rows(table, &SPELLING));
    }
    if !program.tables.is_empty() {
        text.push_str(
            "IS_ARRAY = dr.is_array_v(mi.Float)\n\n\n\
             def entry(table, index):\n\
             \x20   if not IS_ARRAY:\n        return table[int(index)]\n\
             \x20   return dr.gather(mi.Float, mi.Float(table), mi.UInt32(index))\n",
        );
    }
    let assigned = |name: &str, value: &str| format!("{name} = {value}");
    for (lacking, body) in &program.helpers {
        let statements = statements(body, "    ", assigned);
        let _ = write!(
            text,
            "\n\ndef {}(x):\n{statements}    return {}\n",
            function(*lacking),
            body.outputs.join(", ")
        );
    }
    text.push_str("\n\ndef brdf(wi, wo):\n    \"\"\"f in 1/sr for a direction to the light and one to the viewer.\"\"\"\n");
    text += &statements(&program.body, "    ", assigned);
    text
}

/// The plugin.
const PLUGIN: &str = r#"

class BRDFit(mi.BSDF):
    """The BRDF that brdfit fitted."""

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        if not mi.is_rgb:
            raise RuntimeError(f"brdfit: expected a variant in RGB, found {mi.variant()}")
        flags = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide | mi.BSDFFlags.Anisotropic
        self.m_components = [flags]
        self.m_flags = flags
        self.lobes = [mi.MicrofacetDistribution(kind, along, across, True) for kind, along, across in LOBES]

    def value(self, ctx, wi, wo):
        # Light goes from what the path comes from to what it goes to, or the other way round. The normal is that of the surface as shaded.
        if ctx.mode == mi.TransportMode.Radiance:
            return brdf(wo, wi)
        return brdf(wi, wo)

    def density(self, wi, wo):
        up = (wi.z > 0.0) & (wo.z > 0.0)
        h = dr.normalize(wi + wo)
        density = DIFFUSE * mi.warp.square_to_cosine_hemisphere_pdf(wo)
        for lobe in self.lobes:
            density += (1.0 - DIFFUSE) / len(self.lobes) * lobe.pdf(wi, h) / (4.0 * dr.dot(wo, h))
        return dr.select(up, density, 0.0)

    def sample(self, ctx, si, sample1, sample2, active=True):
        wo = mi.warp.square_to_cosine_hemisphere(sample2)
        for number, lobe in enumerate(self.lobes):
            h, _ = lobe.sample(si.wi, sample2)
            start = DIFFUSE + (1.0 - DIFFUSE) * number / len(self.lobes)
            wo = dr.select(sample1 < start, wo, mi.reflect(si.wi, h))
        bs = mi.BSDFSample3f()
        bs.wo = wo
        bs.pdf = self.density(si.wi, wo)
        bs.eta = 1.0
        bs.sampled_type = mi.UInt32(int(self.m_flags))
        bs.sampled_component = mi.UInt32(0)
        active = active & (bs.pdf > 0.0)
        value = self.value(ctx, si.wi, wo) * (wo.z / dr.select(active, bs.pdf, 1.0))
        return bs, dr.select(active, value, 0.0)

    def eval(self, ctx, si, wo, active=True):
        active = active & (si.wi.z > 0.0) & (wo.z > 0.0)
        return dr.select(active, self.value(ctx, si.wi, wo) * wo.z, 0.0)

    def pdf(self, ctx, si, wo, active=True):
        return dr.select(active, self.density(si.wi, wo), 0.0)

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def to_string(self):
        return "brdfit[]"


mi.register_bsdf("brdfit", lambda props: BRDFit(props))
"#;
