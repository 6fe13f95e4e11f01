//! True values for synthetic measurements: from the range that each parameter says is typical of it.

use brdfit::model::{ParamSpec, Role, Scale};
use rand::RngExt;
use rand_pcg::Pcg64Mcg;

/// The part of a typical range in which measurements like those of the tests determine a parameter.
struct Narrower {
    /// The expressions meant: those with this word.
    of: &'static str,
    /// Names of parameters.
    names: &'static [&'static str],
    range: (f64, f64),
}

const fn narrower(of: &'static str, names: &'static [&'static str], range: (f64, f64)) -> Narrower {
    Narrower { of, names, range }
}

/// What is known to be out of reach (docs/trust/identifiability.md); the first line that fits counts. A parameter that is not listed
/// is drawn from its typical range.
const NARROWER: &[Narrower] = &[
    // A table of exponents is known where facets are seen: m from 0.02, so that 1500 directions sample the peak, to 0.08, so
    // that the last free knot, at 20 m, is not in the horizon.
    narrower("d=tabulated", &["m"], (0.02, 0.08)),
    // A sharper peak falls between the directions; a wider one looks like the diffuse base.
    narrower("", &["m", "mx", "my"], (0.03, 0.8)),
    narrower("", &["alpha"], (2e-3, 0.3)),
    narrower("", &["roughness", "specular_roughness"], (0.2, 0.9)),
    // Bent towards grazing, mirror-like, and towards the normal. A lobe that is bent and sharp lies beyond the directions
    // that are measured.
    narrower("lafortune", &["n"], (3.0, 60.0)),
    narrower("", &["cz"], (0.5, 1.3)),
    narrower("", &["cy"], (-1.3, -0.5)),
    narrower("", &["n", "nu", "nv"], (3.0, 1000.0)),
    narrower("low-", &["b"], (10.0, 1000.0)),
    narrower("d=abc", &["b"], (20.0, 5000.0)),
    // A tail that hardly declines is another diffuse base, one that is steep is dark.
    narrower("low-", &["c"], (0.5, 3.0)),
    narrower("d=abc", &["c"], (0.8, 3.0)),
    narrower("", &["gamma"], (1.7, 5.0)),
    // Scales have no typical size: weaker lobes drown in the noise, stronger ones are the same times a number.
    narrower("low-", &["a"], (0.5, 50.0)),
    narrower("", &["ks"], (0.2, 2.0)),
    narrower("bagher-sgd", &["f1"], (-0.8, -0.05)),
    // The dip has to be there, and steeper it lies beyond 80 degrees.
    narrower("f=lazanyi", &["a"], (0.3, 3.0)),
    narrower("f=lazanyi", &["alpha_f"], (3.0, 6.0)),
    // In a darker volume two indices, 1.33 and 2.33 for instance, fit almost equally well, and noise chooses between them.
    narrower("dipole", &["albedo_prime"], (0.3, 0.95)),
    // A tint that leaves nothing at 82 degrees makes F negative beside them, and a negative f has no logarithm.
    narrower("f=f82-tint", &["tint"], (0.5, 0.95)),
    // A surface that is tinted black shows nothing of its roughness.
    narrower("openpbr", &["specular_color"], (0.5, 0.95)),
    // A layer that scatters once and is dim, thin or sends its light forward hardly rises above the noise of 1e-3; a thick one
    // does not know its depth. Then albedo, g and tau are not told apart, and one ends at a bound.
    narrower("hanrahan-krueger", &["albedo"], (0.5, 0.95)),
    narrower("hanrahan-krueger", &["g"], (-0.6, 0.0)),
    narrower("hanrahan-krueger", &["tau"], (0.5, 2.0)),
];

/// The range that true values of a parameter come from, in its unit.
pub fn range(expression: &str, spec: &ParamSpec) -> (f64, f64) {
    let fits = |n: &&Narrower| expression.contains(n.of) && n.names.contains(&spec.name);
    if let Some(narrower) = NARROWER.iter().find(fits) {
        return narrower.range;
    }
    let (low, high) = spec.typical;
    if spec.role == Role::Amplitude && spec.scale != Scale::Log {
        // Albedos and reflectances: neither nothing nor everything.
        return (low + 0.02, high.min(1.0) - 0.05);
    }
    // A twentieth away from either end, which may be a bound.
    (between(low, high, spec.scale, 0.05), between(low, high, spec.scale, 0.95))
}

/// The value at a share of the way from `low` to `high`, in the parameter's own scale.
fn between(low: f64, high: f64, scale: Scale, share: f64) -> f64 {
    match scale {
        Scale::Log => low * (high / low).powf(share),
        Scale::Linear | Scale::Square => low + (high - low) * share,
    }
}

/// A value drawn from a range, uniform in the parameter's own scale.
pub fn draw((low, high): (f64, f64), spec: &ParamSpec, rng: &mut Pcg64Mcg) -> f64 {
    between(low, high, spec.scale, rng.random())
}
