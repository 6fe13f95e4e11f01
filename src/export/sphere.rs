//! A sphere as a mesh of glTF.

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use serde_json::{Map, Value, json};
use std::f32::consts::PI;

/// Numbers of rings and of segments.
const RINGS: u16 = 24;
const SEGMENTS: u16 = 48;

/// Numbers of glTF for the types of components, the targets of buffers.
const FLOAT: u32 = 5126;
const UNSIGNED_SHORT: u32 = 5123;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// A mesh of a unit sphere, with one view and one accessor per attribute and one for the triangles.
pub(super) struct Sphere {
    bytes: Vec<u8>,
    accessors: Vec<Value>,
    views: Vec<Value>,
    names: Vec<&'static str>,
}

impl Sphere {
    /// Makes the mesh, with tangents along its circles of latitude if the material needs them.
    pub(super) fn new(with_tangents: bool) -> Self {
        let mut normals: Vec<[f32; 3]> = Vec::new();
        let mut tangents: Vec<[f32; 4]> = Vec::new();
        for ring in 0..=RINGS {
            for segment in 0..=SEGMENTS {
                let (theta, phi) = (
                    PI * f32::from(ring) / f32::from(RINGS),
                    2.0 * PI * f32::from(segment) / f32::from(SEGMENTS),
                );
                normals.push([theta.sin() * phi.sin(), theta.cos(), theta.sin() * phi.cos()]);
                tangents.push([phi.cos(), 0.0, -phi.sin(), 1.0]);
            }
        }
        let mut triangles: Vec<u16> = Vec::new();
        for ring in 0..RINGS {
            for segment in 0..SEGMENTS {
                let (above, below) = (ring * (SEGMENTS + 1) + segment, (ring + 1) * (SEGMENTS + 1) + segment);
                // At the poles one of the two has no area.
                if ring > 0 {
                    triangles.extend([above, below, above + 1]);
                }
                if ring + 1 < RINGS {
                    triangles.extend([above + 1, below, below + 1]);
                }
            }
        }
        let mut sphere =
            Self { bytes: Vec::new(), accessors: Vec::new(), views: Vec::new(), names: Vec::new() };
        // On the unit sphere positions are normals.
        sphere.attribute("POSITION", &normals);
        sphere.attribute("NORMAL", &normals);
        if with_tangents {
            sphere.attribute("TANGENT", &tangents);
        }
        let bytes: Vec<u8> = triangles.iter().flat_map(|index| index.to_le_bytes()).collect();
        sphere
            .accessor(json!({ "componentType": UNSIGNED_SHORT, "count": triangles.len(), "type": "SCALAR" }));
        sphere.view(&bytes, ELEMENT_ARRAY_BUFFER);
        sphere
    }

    fn attribute<const N: usize>(&mut self, name: &'static str, values: &[[f32; N]]) {
        let ends = |pick: fn(f32, f32) -> f32| -> Vec<f32> {
            let fold = |k: usize| values.iter().filter_map(|v| v.get(k)).copied().reduce(pick).unwrap_or(0.0);
            (0..N).map(fold).collect()
        };
        self.names.push(name);
        self.accessor(json!({
            "componentType": FLOAT, "count": values.len(), "type": format!("VEC{N}"),
            "min": ends(f32::min), "max": ends(f32::max),
        }));
        let bytes: Vec<u8> = values.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
        self.view(&bytes, ARRAY_BUFFER);
    }

    fn accessor(&mut self, mut accessor: Value) {
        if let Some(object) = accessor.as_object_mut() {
            object.insert("bufferView".to_owned(), json!(self.views.len()));
        }
        self.accessors.push(accessor);
    }

    fn view(&mut self, bytes: &[u8], target: u32) {
        let (offset, length) = (self.bytes.len(), bytes.len());
        self.views.push(json!({ "buffer": 0, "byteOffset": offset, "byteLength": length, "target": target }));
        self.bytes.extend(bytes);
    }

    /// The accessors of the attributes, by name.
    pub(super) fn attributes(&self) -> Value {
        Value::Object(
            self.names
                .iter()
                .zip(0..)
                .map(|(name, index): (_, u32)| ((*name).to_owned(), json!(index)))
                .collect::<Map<_, _>>(),
        )
    }

    /// The accessor of the triangles.
    pub(super) fn indices(&self) -> usize {
        self.names.len()
    }

    pub(super) fn accessors(&self) -> &[Value] {
        &self.accessors
    }

    pub(super) fn views(&self) -> &[Value] {
        &self.views
    }

    /// The buffer, with its content inside.
    pub(super) fn buffer(&self) -> Value {
        let content = BASE64_STANDARD.encode(&self.bytes);
        json!({ "byteLength": self.bytes.len(), "uri": format!("data:application/octet-stream;base64,{content}") })
    }
}
