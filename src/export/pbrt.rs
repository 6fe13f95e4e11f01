//! pbrt-v4: a named material `brdfit`.
//!
//! Its documentation: <https://pbrt.org/fileformat-v4>, `conductor`, `diffuse` and `mix`; a mixture chooses one of its materials at
//! random, which is their weighted sum on average.

use super::target::{Holds, Target};
use super::values::{LobeOf, NotHeld, Values, commented, joined};

pub(super) const TARGET: Target = Target {
    name: "pbrt",
    summary: "pbrt-v4: a named material",
    extension: "pbrt",
    own: "lambert(kd=0..1) + cook-torrance(d=ggx, g=smith, f=conductor, eta=1, ks=0.5)",
    holds: Holds::Materials(holds),
    primaries: &[
        ("rec709", "srgb"),
        ("rec2020", "rec2020"),
        ("display-p3", "dci-p3"),
        ("aces2065-1", "aces2065-1"),
    ],
    caveat: "not run in pbrt; pbrt turns RGB into spectra, so that colours come back only approximately",
};

fn holds(values: &Values) -> Result<String, NotHeld> {
    let lobes = values.lobes();
    let conductors: Vec<&LobeOf> = lobes.iter().filter(|lobe| is_conductor(lobe)).collect();
    let bases: Vec<&LobeOf> = lobes.iter().filter(|lobe| lobe.is("lambert", &[])).collect();
    let material = match (bases.as_slice(), conductors.as_slice()) {
        _ if bases.len() + conductors.len() != lobes.len() => return Err(values.not_held()),
        ([base], []) => diffuse("brdfit", base, 1.0),
        ([], [lobe]) if lobe.one("ks")? == 1.0 => conductor("brdfit", lobe)?,
        (bases, [lobe]) if bases.len() < 2 => {
            let amount = lobe.one("ks")?;
            if !(0.0..1.0).contains(&amount) {
                return Err(values.not_held());
            }
            let base = match bases {
                [base] => diffuse("brdfit.diffuse", base, 1.0 - amount),
                _ => material("brdfit.diffuse", "diffuse", &["\"rgb reflectance\" [ 0 0 0 ]".to_owned()]),
            };
            let mixture = [
                "\"string materials\" [ \"brdfit.diffuse\" \"brdfit.specular\" ]".to_owned(),
                format!("\"float amount\" [ {amount} ]"),
            ];
            base + &conductor("brdfit.specular", lobe)? + &material("brdfit", "mix", &mixture)
        }
        _ => return Err(values.not_held()),
    };
    let material = match values.color_space() {
        "" | "srgb" => material,
        // The block keeps the scene's own color space as it is; named materials outlive it.
        space => format!("AttributeBegin\nColorSpace \"{space}\"\n{material}AttributeEnd\n"),
    };
    Ok(commented(values.header(), "#") + &material)
}

fn is_conductor(lobe: &LobeOf) -> bool {
    lobe.is("cook-torrance", &[("d", &["ggx", "ggx-anisotropic"]), ("g", &["smith"]), ("f", &["conductor"])])
}

fn material(name: &str, kind: &str, parameters: &[String]) -> String {
    let lines: String = parameters.iter().map(|line| format!("    {line}\n")).collect();
    format!("MakeNamedMaterial \"{name}\"\n    \"string type\" [ \"{kind}\" ]\n{lines}")
}

/// A diffuse material whose share of a mixture is `share`.
fn diffuse(name: &str, lobe: &LobeOf, share: f64) -> String {
    let reflectance = lobe.rgb_within("kd", 0.0, share).map(|kd| (kd / share).min(1.0));
    material(name, "diffuse", &[format!("\"rgb reflectance\" [ {} ]", joined(&reflectance, " "))])
}

fn conductor(name: &str, lobe: &LobeOf) -> Result<String, NotHeld> {
    let [mx, my] = lobe.roughness()?;
    let of = |name| joined(&lobe.rgb(name), " ");
    Ok(material(
        name,
        "conductor",
        &[
            "\"bool remaproughness\" [ false ]".to_owned(),
            format!("\"float uroughness\" [ {mx} ]"),
            format!("\"float vroughness\" [ {my} ]"),
            format!("\"rgb eta\" [ {} ]", of("eta")),
            format!("\"rgb k\" [ {} ]", of("k")),
        ],
    ))
}
