//! MaterialX: a material of the node standard_surface.
//!
//! Its definition: libraries/bxdf/standard_surface.mtlx of MaterialX 1.39 (<https://materialx.org>).

use super::target::{Holds, Target};
use super::values::{LobeOf, NotHeld, Values, joined, xml_comment};

pub(super) const TARGET: Target = Target {
    name: "materialx",
    summary: "MaterialX: a material of the node standard_surface",
    extension: "mtlx",
    own: "standard-surface",
    holds: Holds::Materials(holds),
    primaries: &[("rec709", "lin_rec709"), ("display-p3", "lin_displayp3"), ("acescg", "acescg")],
    caveat: "exact for the GLSL that MaterialX 1.39 generates; other renderers may evaluate the node in their own way",
};

fn holds(values: &Values) -> Result<String, NotHeld> {
    let lobe = values.only_lobe()?;
    if !lobe.is("standard-surface", &[]) || lobe.strength()? != 1.0 {
        return Err(lobe.not_held());
    }
    let is_metal = lobe.choice("base") == "metal";
    let mut inputs = vec![
        input("float", "base", "1"),
        color(lobe, "base_color"),
        input("float", "metalness", if is_metal { "1" } else { "0" }),
        color(lobe, "specular_color"),
    ];
    let mut names = vec!["specular_roughness", "specular_anisotropy"];
    if is_metal {
        inputs.push(input("float", "specular", "1"));
    } else {
        names.extend(["specular", "specular_IOR", "diffuse_roughness"]);
    }
    if lobe.choice("coating") == "clear" {
        inputs.push(input("color3", "coat_color", "1, 1, 1"));
        names.extend(["coat", "coat_roughness", "coat_IOR"]);
    }
    if lobe.choice("fuzz") == "conty-kulla" && !is_metal {
        inputs.push(color(lobe, "sheen_color"));
        names.extend(["sheen", "sheen_roughness"]);
    }
    for name in names {
        inputs.push(input("float", name, &lobe.one(name)?.to_string()));
    }
    let comment = xml_comment(values.header());
    Ok(format!(
        "<?xml version=\"1.0\"?>\n<materialx version=\"1.39\" colorspace=\"{space}\">\n{comment}  <standard_surface \
         name=\"brdfit_surface\" type=\"surfaceshader\" nodedef=\"ND_standard_surface_surfaceshader\">\n{}  \
         </standard_surface>\n  <surfacematerial name=\"brdfit\" type=\"material\">\n    <input name=\"surfaceshader\" \
         type=\"surfaceshader\" nodename=\"brdfit_surface\"/>\n  </surfacematerial>\n</materialx>\n",
        inputs.concat(),
        space = values.color_space(),
    ))
}

fn color(lobe: LobeOf<'_, '_>, name: &str) -> String {
    input("color3", name, &joined(&lobe.rgb_within(name, 0.0, 1.0), ", "))
}

fn input(kind: &str, name: &str, value: &str) -> String {
    format!("    <input name=\"{name}\" type=\"{kind}\" value=\"{value}\"/>\n")
}
