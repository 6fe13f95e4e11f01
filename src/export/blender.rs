//! Blender: a script that makes the material `brdfit`, of nodes of Cycles.
//!
//! Its manual: <https://docs.blender.org/manual/en/latest/render/shader_nodes/shader/>. Lobes are added without weights. `GGX` is set
//! everywhere: the default of Blender adds light that facets reflect to one another.

use super::target::{Holds, Target, UNSTATED};
use super::values::{LobeOf, NotHeld, Values, commented, joined};
use std::fmt::Write as _;

pub(super) const TARGET: Target = Target {
    name: "blender",
    summary: "Blender 4.2 and later: a Python script that makes the material",
    extension: "py",
    own: "lambert + cook-torrance(d=ggx, g=smith, f=schlick)",
    holds: Holds::Materials(holds),
    primaries: UNSTATED,
    caveat: "",
};

fn holds(values: &Values) -> Result<String, NotHeld> {
    let mut nodes = String::new();
    for lobe in values.lobes() {
        nodes += &node(lobe)?;
    }
    let comment = commented(values.header(), "#");
    Ok(format!(
        r#"{comment}# Run it in the Scripting workspace, or with `blender --python FILE`.
import bpy

material = bpy.data.materials.get("brdfit") or bpy.data.materials.new("brdfit")
if bpy.app.version < (5, 0, 0):
    material.use_nodes = True
tree = material.node_tree
tree.nodes.clear()
lobes = []


def add(kind, inputs, scale=1.0, distribution=None, fresnel=None):
    """Adds a lobe with these inputs, scaled by at most 1."""
    node = tree.nodes.new(kind)
    if distribution:
        node.distribution = distribution
    if fresnel:
        node.fresnel_type = fresnel
    for name, value in inputs.items():
        node.inputs[name].default_value = value
    if "Tangent" in node.inputs and inputs.get("Anisotropic", inputs.get("Anisotropy", 0)):
        tangent = tree.nodes.new("ShaderNodeTangent")
        tangent.direction_type = "UV_MAP"
        tree.links.new(tangent.outputs["Tangent"], node.inputs["Tangent"])
    socket = node.outputs[0]
    if scale != 1.0:
        mix = tree.nodes.new("ShaderNodeMixShader")
        mix.inputs[0].default_value = scale
        tree.links.new(socket, mix.inputs[2])
        socket = mix.outputs[0]
    lobes.append(socket)


{nodes}
while len(lobes) > 1:
    both = tree.nodes.new("ShaderNodeAddShader")
    tree.links.new(lobes.pop(), both.inputs[0])
    tree.links.new(lobes.pop(), both.inputs[1])
    lobes.append(both.outputs[0])
output = tree.nodes.new("ShaderNodeOutputMaterial")
if lobes:
    tree.links.new(lobes[0], output.inputs["Surface"])
"#
    ))
}

/// The call that adds a lobe.
fn node(lobe: LobeOf<'_, '_>) -> Result<String, NotHeld> {
    if lobe.is("lambert", &[]) {
        return Ok(call("ShaderNodeBsdfDiffuse", &[("Color", color(lobe.rgb("kd")))], ""));
    }
    if lobe.is("blender-principled", &[]) {
        return principled(lobe);
    }
    let ggx = ("d", ["ggx", "ggx-anisotropic"].as_slice());
    if !lobe.is("cook-torrance", &[ggx, ("g", &["smith"])]) {
        return Err(lobe.not_held());
    }
    let [roughness, anisotropic] = lobe.by_aspect(0.0, 1.0)?;
    let is_anisotropic = anisotropic != 0.0;
    let [roughness, anisotropic] = [roughness, anisotropic].map(|value| value.to_string());
    if lobe.choice("f") == "none" {
        // Glossy has the aspect itself: alpha_x = r^2/(1 - a), alpha_y = r^2 (1 - a).
        if is_anisotropic {
            return Err(lobe.not_held());
        }
        let inputs = [("Color", color(lobe.rgb("ks"))), ("Roughness", roughness)];
        return Ok(call("ShaderNodeBsdfAnisotropic", &inputs, "distribution=\"GGX\""));
    }
    let scale = lobe.one("ks")?;
    if !(0.0..=1.0).contains(&scale) {
        return Err(lobe.not_held());
    }
    let more = format!("scale={scale}, distribution=\"GGX\"");
    match lobe.choice("f") {
        fresnel @ ("schlick" | "f82-tint") => {
            let tint = if fresnel == "schlick" { [1.0; 3] } else { lobe.rgb("tint") };
            let inputs = [
                ("Base Color", color(lobe.rgb_within("f0", 0.0, 1.0))),
                ("Metallic", "1.0".to_owned()),
                ("Roughness", roughness),
                ("Anisotropic", anisotropic),
                ("Specular Tint", color(tint)),
            ];
            Ok(call("ShaderNodeBsdfPrincipled", &inputs, &more))
        }
        "conductor" => {
            let of = |name| format!("({})", joined(&lobe.rgb(name), ", "));
            let inputs = [
                ("IOR", of("eta")),
                ("Extinction", of("k")),
                ("Roughness", roughness),
                ("Anisotropy", anisotropic),
            ];
            Ok(call("ShaderNodeBsdfMetallic", &inputs, &(more + ", fresnel=\"PHYSICAL_CONDUCTOR\"")))
        }
        _ => Err(lobe.not_held()),
    }
}

/// The call that adds Blender's own material.
fn principled(lobe: LobeOf<'_, '_>) -> Result<String, NotHeld> {
    let of = |name| lobe.one(name).map(|value| value.to_string());
    let inputs = [
        ("Base Color", color(lobe.rgb_within("base_color", 0.0, 1.0))),
        ("Metallic", of("metallic")?),
        ("Roughness", of("roughness")?),
        ("Anisotropic", of("anisotropic")?),
        ("IOR", of("ior")?),
        ("Diffuse Roughness", of("diffuse_roughness")?),
        ("Specular Tint", color(lobe.rgb("specular_tint"))),
    ];
    let strength = lobe.strength()?;
    if !(0.0..=1.0).contains(&strength) {
        return Err(lobe.not_held());
    }
    Ok(call("ShaderNodeBsdfPrincipled", &inputs, &format!("scale={strength}, distribution=\"GGX\"")))
}

fn color(rgb: [f64; 3]) -> String {
    format!("({}, 1.0)", joined(&rgb, ", "))
}

fn call(kind: &str, inputs: &[(&str, String)], more: &str) -> String {
    let mut text = format!("add(\"{kind}\", {{");
    for (index, (name, value)) in inputs.iter().enumerate() {
        let comma = if index > 0 { ", " } else { "" };
        // Writing to a string cannot fail.
        let _ = write!(text, "{comma}\"{name}\": {value}");
    }
    let comma = if more.is_empty() { "" } else { ", " };
    text + &format!("}}{comma}{more})\n")
}
