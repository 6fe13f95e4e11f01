//! USD: a sphere with a material of the type UsdPreviewSurface.
//!
//! Its specification: <https://openusd.org/release/spec_usdpreviewsurface.html>, version 2.6.

use super::target::{Holds, Target};
use super::values::{LobeOf, NotHeld, Values, commented, joined};

pub(super) const TARGET: Target = Target {
    name: "usd",
    summary: "USD: a sphere with a UsdPreviewSurface",
    extension: "usda",
    own: "usd-preview-surface",
    holds: Holds::Materials(holds),
    primaries: &[
        ("rec709", "lin_rec709_scene"),
        ("rec2020", "lin_rec2020_scene"),
        ("display-p3", "lin_p3d65_scene"),
        ("acescg", "lin_ap1_scene"),
        ("aces2065-1", "lin_ap0_scene"),
    ],
    caveat: "the specification leaves open how lobes are shadowed and layered; see docs/use/models.md, usd-preview-surface",
};

fn holds(values: &Values) -> Result<String, NotHeld> {
    let lobe = values.only_lobe()?;
    if !lobe.is("usd-preview-surface", &[]) || lobe.strength()? != 1.0 {
        return Err(lobe.not_held());
    }
    let mut inputs = vec![color(lobe, "diffuseColor")];
    if lobe.choice("workflow") == "specular" {
        inputs.push("int inputs:useSpecularWorkflow = 1".to_owned());
        inputs.push(color(lobe, "specularColor"));
    } else {
        inputs.push(number(lobe, "metallic")?);
    }
    for name in ["roughness", "ior", "clearcoat", "clearcoatRoughness"] {
        inputs.push(number(lobe, name)?);
    }
    let inputs: String = inputs.iter().map(|line| format!("                {line}\n")).collect();
    let comment = commented(values.header(), "#");
    Ok(format!(
        r#"#usda 1.0
{comment}(
    defaultPrim = "brdfit"
    metersPerUnit = 1
    upAxis = "Y"
)

def Xform "brdfit" (
    kind = "component"
)
{{
    def Sphere "sphere" (
        prepend apiSchemas = ["MaterialBindingAPI"]
    )
    {{
        float3[] extent = [(-1, -1, -1), (1, 1, 1)]
        double radius = 1
        rel material:binding = </brdfit/Looks/material>
    }}

    def Scope "Looks"
    {{
        def Material "material"
        {{
            token outputs:surface.connect = </brdfit/Looks/material/surface.outputs:surface>

            def Shader "surface"
            {{
                uniform token info:id = "UsdPreviewSurface"
{inputs}                token outputs:surface
            }}
        }}
    }}
}}
"#
    ))
}

fn color(lobe: LobeOf<'_, '_>, name: &str) -> String {
    let value = joined(&lobe.rgb_within(name, 0.0, 1.0), ", ");
    format!("color3f inputs:{name} = ({value}) (colorSpace = \"{}\")", lobe.color_space())
}

fn number(lobe: LobeOf<'_, '_>, name: &str) -> Result<String, NotHeld> {
    Ok(format!("float inputs:{name} = {}", lobe.one(name)?))
}
