//! glTF 2.0: a sphere with one material.
//!
//! Its specification: <https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html>, appendix B, and the extensions KHR_materials_ior,
//! KHR_materials_specular, KHR_materials_anisotropy, KHR_materials_clearcoat and KHR_materials_sheen. The report of the fit is among the extras of the
//! material, from which `brdfit fit --init` reads it.

use super::sphere::Sphere;
use super::target::{Holds, Target};
use super::values::{LobeOf, NotHeld, Values};
use serde_json::{Map, Value, json};

pub(super) const TARGET: Target = Target {
    name: "gltf",
    summary: "glTF 2.0: a sphere with a material",
    extension: "gltf",
    own: "gltf",
    holds: Holds::Materials(holds),
    primaries: &[("rec709", "")],
    caveat: "the formula is that of appendix B of the specification, from which viewers may depart",
};

/// A material: its metallic-roughness part and its extensions.
#[derive(Default)]
struct Material {
    base_color: [f64; 3],
    metallic: f64,
    roughness: f64,
    extensions: Map<String, Value>,
    anisotropic: bool,
}

fn holds(values: &Values) -> Result<String, NotHeld> {
    let lobe = values.only_lobe()?;
    let is_metal = lobe.is("cook-torrance", &[("d", &["ggx"]), ("g", &["smith"]), ("f", &["schlick"])]);
    let material = if lobe.is("gltf", &[]) && lobe.strength()? == 1.0 {
        of_own(lobe)?
    } else if is_metal && lobe.one("ks")? == 1.0 {
        let [m, _] = lobe.roughness()?;
        let base_color = lobe.rgb_within("f0", 0.0, 1.0);
        Material { base_color, metallic: 1.0, roughness: m.sqrt(), ..Material::default() }
    } else if lobe.is("lambert", &[]) {
        // A dielectric whose surface reflects nothing.
        let mut matte =
            Material { base_color: lobe.rgb_within("kd", 0.0, 1.0), roughness: 1.0, ..Material::default() };
        matte.extend("KHR_materials_specular", json!({ "specularFactor": 0.0 }));
        matte
    } else {
        return Err(lobe.not_held());
    };
    let document = material.document(values);
    Ok(serde_json::to_string_pretty(&document).map_err(|_| values.not_held())? + "\n")
}

/// The material of the model `gltf`.
fn of_own(lobe: LobeOf<'_, '_>) -> Result<Material, NotHeld> {
    let mut material = Material {
        base_color: lobe.rgb_within("base_color", 0.0, 1.0),
        metallic: lobe.one("metallic")?,
        roughness: lobe.one("roughness")?,
        ..Material::default()
    };
    let ior = lobe.one("ior")?;
    if ior != 1.5 {
        material.extend("KHR_materials_ior", json!({ "ior": ior }));
    }
    let (specular, tint) = (lobe.one("specular")?, lobe.rgb("specular_color"));
    if specular != 1.0 || tint != [1.0; 3] {
        let specular = json!({ "specularFactor": specular, "specularColorFactor": tint });
        material.extend("KHR_materials_specular", specular);
    }
    let strength = lobe.one("anisotropy_strength")?;
    if strength != 0.0 {
        material.anisotropic = true;
        material.extend("KHR_materials_anisotropy", json!({ "anisotropyStrength": strength }));
    }
    if lobe.choice("coating") == "clearcoat" {
        let (coat, roughness) = (lobe.one("clearcoat")?, lobe.one("clearcoat_roughness")?);
        let coat = json!({ "clearcoatFactor": coat, "clearcoatRoughnessFactor": roughness });
        material.extend("KHR_materials_clearcoat", coat);
    }
    if lobe.choice("fuzz") == "charlie" {
        let (strength, roughness) = (lobe.one("sheen")?, lobe.one("sheen_roughness")?);
        let color = lobe.rgb("sheen_color");
        // The brightest channel of the product dims what is below.
        if strength > 0.0 && color.iter().all(|channel| *channel < 1.0) {
            return Err(NotHeld::Lobe("a sheen_color whose brightest channel is not 1".to_owned()));
        }
        let color = color.map(|channel| strength * channel);
        let sheen = json!({ "sheenColorFactor": color, "sheenRoughnessFactor": roughness });
        material.extend("KHR_materials_sheen", sheen);
    }
    Ok(material)
}

impl Material {
    fn extend(&mut self, extension: &str, values: Value) {
        self.extensions.insert(extension.to_owned(), values);
    }

    fn document(self, values: &Values) -> Value {
        let [r, g, b] = self.base_color;
        let used: Vec<&String> = self.extensions.keys().collect();
        let mut material = json!({
            "name": "brdfit",
            "pbrMetallicRoughness": {
                "baseColorFactor": [r, g, b, 1.0],
                "metallicFactor": self.metallic,
                "roughnessFactor": self.roughness,
            },
            "extras": { "brdfit": { "about": values.header(), "report": values.report() } },
        });
        if let Some(object) = material.as_object_mut().filter(|_| !used.is_empty()) {
            object.insert("extensions".to_owned(), Value::Object(self.extensions.clone()));
        }
        let sphere = Sphere::new(self.anisotropic);
        let mut document = json!({
            "asset": { "version": "2.0", "generator": concat!("brdfit ", env!("CARGO_PKG_VERSION")) },
            "scene": 0,
            "scenes": [{ "nodes": [0] }],
            "nodes": [{ "mesh": 0, "name": "sphere" }],
            "meshes": [{ "primitives": [{ "attributes": sphere.attributes(), "indices": sphere.indices(), "material": 0 }] }],
            "materials": [material],
            "accessors": sphere.accessors(),
            "bufferViews": sphere.views(),
            "buffers": [sphere.buffer()],
        });
        if let Some(object) = document.as_object_mut().filter(|_| !used.is_empty()) {
            object.insert("extensionsUsed".to_owned(), json!(used));
        }
        document
    }
}
