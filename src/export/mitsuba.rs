//! Mitsuba 3: a scene fragment with one BSDF, to be included and referred to as `brdfit`.
//!
//! Its documentation and source: <https://mitsuba.readthedocs.io>, `principled`, `roughconductor`, `diffuse` and `blendbsdf` of version
//! 3.9. A sum is a blend of lobes that are divided by their weights, which is exact. Metal of `principled` has no scale, so that its
//! weight in the blend is the strength of the lobe.

use super::target::{Holds, Target, UNSTATED};
use super::values::{LobeOf, NotHeld, Values, joined, xml_comment};

pub(super) const TARGET: Target = Target {
    name: "mitsuba",
    summary: "Mitsuba 3: XML of a BSDF",
    extension: "xml",
    own: "principled",
    holds: Holds::Materials(holds),
    primaries: UNSTATED,
    caveat: "",
};

/// The least alpha of `principled`.
const LEAST_ALPHA: f64 = 0.001;

/// A lobe as Mitsuba has it.
struct Piece<'v, 'a> {
    lobe: LobeOf<'v, 'a>,
    /// The weight that it must have in a blend; `None` for a lobe that can be scaled.
    weight: Option<f64>,
    write: fn(LobeOf<'_, '_>, f64) -> Result<String, NotHeld>,
}

fn holds(values: &Values) -> Result<String, NotHeld> {
    let pieces: Vec<Piece> = values.lobes().into_iter().map(piece).collect::<Result<_, _>>()?;
    let taken: f64 = pieces.iter().filter_map(|piece| piece.weight).sum();
    let scaled = pieces.iter().filter(|piece| piece.weight.is_none()).count();
    let full = (taken - 1.0).abs() < 1e-12;
    if taken > 1.0 + 1e-12 || (full && scaled > 0) {
        return Err(values.not_held());
    }
    // What is left of the weights is shared, or goes to a black lobe.
    let share = (1.0 - taken) / f64::from(u32::try_from(scaled.max(1)).unwrap_or(u32::MAX));
    let mut weighted: Vec<(f64, String)> = Vec::new();
    for piece in &pieces {
        let weight = piece.weight.unwrap_or(share);
        weighted.push((weight, (piece.write)(piece.lobe, 1.0 / weight)?));
    }
    if scaled == 0 && !full {
        weighted.push((share, element("diffuse", &[rgb("reflectance", [0.0; 3])])));
    }
    let bsdf = blended(weighted).ok_or_else(|| values.not_held())?;
    let named = bsdf.replacen('>', " id=\"brdfit\">", 1);
    Ok(format!("{}<scene version=\"3.0.0\">\n{}</scene>\n", xml_comment(values.header()), indented(&named)))
}

/// Lobes in nested blends, each of two.
fn blended(weighted: Vec<(f64, String)>) -> Option<String> {
    let mut pieces = weighted.into_iter().rev();
    let (mut total, mut all) = pieces.next()?;
    for (weight, first) in pieces {
        let blend = total / (total + weight);
        all = element("blendbsdf", &[number("weight", blend), first, all]);
        total += weight;
    }
    Some(all)
}

fn piece<'v, 'a>(lobe: LobeOf<'v, 'a>) -> Result<Piece<'v, 'a>, NotHeld> {
    const GGX: (&str, &[&str]) = ("d", &["ggx", "ggx-anisotropic"]);
    let ggx = lobe.is("cook-torrance", &[GGX, ("g", &["smith-uncorrelated"])]);
    let is_conductor = ["conductor", "none"].contains(&lobe.choice("f"));
    if lobe.is("lambert", &[]) {
        return Ok(Piece { lobe, weight: None, write: diffuse });
    }
    if ggx && is_conductor {
        return Ok(Piece { lobe, weight: None, write: conductor });
    }
    if ggx && lobe.choice("f") == "schlick" {
        return Ok(Piece { lobe, weight: Some(lobe.one("ks")?), write: metal });
    }
    if lobe.is("principled", &[]) {
        return Ok(Piece { lobe, weight: Some(lobe.strength()?), write: principled });
    }
    Err(lobe.not_held())
}

fn diffuse(lobe: LobeOf<'_, '_>, scale: f64) -> Result<String, NotHeld> {
    Ok(element("diffuse", &[rgb("reflectance", lobe.rgb("kd").map(|kd| kd * scale))]))
}

fn conductor(lobe: LobeOf<'_, '_>, scale: f64) -> Result<String, NotHeld> {
    let [mx, my] = lobe.roughness()?;
    let mut inside = vec![
        text("distribution", "ggx"),
        number("alpha_u", mx),
        number("alpha_v", my),
        raw("specular_reflectance", lobe.rgb("ks").map(|ks| ks * scale)),
    ];
    if lobe.choice("f") == "conductor" {
        inside.extend([raw("eta", lobe.rgb("eta")), raw("k", lobe.rgb("k"))]);
    } else {
        inside.push(text("material", "none"));
    }
    Ok(element("roughconductor", &inside))
}

fn metal(lobe: LobeOf<'_, '_>, _: f64) -> Result<String, NotHeld> {
    let [roughness, anisotropic] = lobe.by_aspect(LEAST_ALPHA, 1.0)?;
    Ok(element(
        "principled",
        &[
            rgb("base_color", lobe.rgb_within("f0", 0.0, 1.0)),
            number("metallic", 1.0),
            number("roughness", roughness),
            number("anisotropic", anisotropic),
        ],
    ))
}

fn principled(lobe: LobeOf<'_, '_>, _: f64) -> Result<String, NotHeld> {
    let mut inside = vec![rgb("base_color", lobe.rgb_within("base_color", 0.0, 1.0))];
    for name in [
        "roughness",
        "anisotropic",
        "specular",
        "clearcoat_gloss",
        "metallic",
        "flatness",
        "sheen",
        "clearcoat",
    ] {
        inside.push(number(name, lobe.one(name)?));
    }
    Ok(element("principled", &inside))
}

fn element(kind: &str, inside: &[String]) -> String {
    format!(
        "<bsdf type=\"{kind}\">\n{}</bsdf>\n",
        inside.iter().map(|text| indented(text)).collect::<String>()
    )
}

fn indented(text: &str) -> String {
    text.lines().map(|line| format!("  {line}\n")).collect()
}

fn number(name: &str, value: f64) -> String {
    format!("<float name=\"{name}\" value=\"{value}\"/>\n")
}

fn text(name: &str, value: &str) -> String {
    format!("<string name=\"{name}\" value=\"{value}\"/>\n")
}

/// A colour; one that Mitsuba would refuse as a reflectance is written without its checks.
fn rgb(name: &str, values: [f64; 3]) -> String {
    if values.iter().all(|value| (0.0..=1.0).contains(value)) {
        format!("<rgb name=\"{name}\" value=\"{}\"/>\n", joined(&values, ", "))
    } else {
        raw(name, values)
    }
}

/// Three numbers that are not checked.
fn raw(name: &str, values: [f64; 3]) -> String {
    let values = joined(&values, ", ");
    format!(
        "<texture type=\"rawconstant\" name=\"{name}\"><vector name=\"value\" value=\"{values}\"/></texture>\n"
    )
}
