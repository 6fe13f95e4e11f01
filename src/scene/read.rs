//! Reads scenes from JSON and checks them.
//!
//! docs/use/scene.md describes the fields, and a test compares docs/use/scene.schema.json with the schema generated from these types.

use super::camera::Camera;
use super::description::{FINER, LARGEST_SIDE, MOST_LIGHT_SAMPLES, SCHEMA, Scene};
use super::frame::Frame;
use super::lights::{self, Lamp};
use super::surface::{Cylinder, Plane, Sphere, Surface};
use super::{environment, obj};
use crate::error::{Error, Place, excerpt};
use glam::DVec3;
use schemars::{JsonSchema, Schema};
use serde::Deserialize;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Largest size of a scene file, bytes.
const MOST_BYTES: u64 = 1 << 20;
/// Largest coordinate, metres.
const LARGEST: f64 = 1e6;
/// Smallest size, metres.
const SMALLEST: f64 = 1e-6;
/// Largest value of a light, in its unit.
const BRIGHTEST: f64 = 1e12;

/// A surface, a camera and lights. Lengths are metres; +z is up.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "brdfit scene", rename = "Scene")]
struct SceneFields {
    /// `brdfit.scene/1`.
    #[expect(dead_code, reason = "read before the others")]
    schema: String,
    /// Purpose of the scene. Not used.
    #[serde(default)]
    #[expect(dead_code, reason = "for the reader")]
    description: String,
    /// The surface to render.
    surface: SurfaceFields,
    /// The camera.
    camera: CameraFields,
    /// The lights; at least one.
    lights: Vec<LightFields>,
}

/// The surface to render. Only its outside is visible.
#[derive(Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Surface")]
enum SurfaceFields {
    /// A sphere. Its tangents run eastward around the pole.
    Sphere(SphereFields),
    /// A rectangle, visible from the side of its normal.
    Plane(PlaneFields),
    /// The curved side of a solid cylinder, whose ends block rays but are not visible. Its tangents run along the axis.
    Cylinder(CylinderFields),
    /// A mesh of triangles.
    Mesh(MeshFields),
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Sphere")]
struct SphereFields {
    /// Centre, m.
    center: [f64; 3],
    /// Radius, m.
    radius: f64,
    /// Direction of the pole that the tangents run around.
    #[serde(default = "up")]
    pole: [f64; 3],
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Plane")]
struct PlaneFields {
    /// Centre, m.
    center: [f64; 3],
    /// Normal on the visible side, of any length.
    normal: [f64; 3],
    /// Direction of the width, of any length; it is made perpendicular to the normal.
    tangent: [f64; 3],
    /// Half of the width, along the tangent, m.
    half_width: f64,
    /// Half of the height, across the tangent, m.
    half_height: f64,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Cylinder")]
struct CylinderFields {
    /// Centre, halfway between the ends, m.
    center: [f64; 3],
    /// Direction of the axis, of any length.
    axis: [f64; 3],
    /// Radius, m.
    radius: f64,
    /// Distance between the ends, m.
    height: f64,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Mesh")]
struct MeshFields {
    /// A Wavefront OBJ file, in metres; its path is relative to the scene's folder.
    obj: String,
}

/// A pinhole camera.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Camera")]
struct CameraFields {
    /// Position, m.
    position: [f64; 3],
    /// Point in the middle of the image, m.
    look_at: [f64; 3],
    /// Direction that points up in the image; +z by default.
    #[serde(default = "up")]
    up: [f64; 3],
    /// Angle between the lower and the upper edge of the image, degrees.
    vertical_fov_deg: f64,
    /// Pixels per row.
    width: u32,
    /// Rows.
    height: u32,
}

/// A light on the surface. Colours are red, green and blue. Lights are not visible themselves and do not block each other.
#[derive(Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Light")]
enum LightFields {
    /// Light from one direction, such as the sun.
    Directional(DirectionalFields),
    /// Light from one point, equal in all directions.
    Point(PointFields),
    /// Light from both sides of a rectangle.
    Area(AreaFields),
    /// Light from all directions, given by an image.
    Environment(EnvironmentFields),
    /// Equal light from all directions.
    Uniform(UniformFields),
    /// Light from an overcast sky: radiance (1 + 2 cos theta)/3 times that of the zenith, and none from below the horizon.
    Overcast(OvercastFields),
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Directional")]
struct DirectionalFields {
    /// Direction towards the light, of any length.
    to_light: [f64; 3],
    /// Irradiance of a surface that faces it, W/m^2.
    irradiance_rgb: [f64; 3],
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Point")]
struct PointFields {
    /// Position, m.
    position: [f64; 3],
    /// Intensity, W/sr.
    intensity_rgb: [f64; 3],
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Area")]
struct AreaFields {
    /// Centre, m.
    center: [f64; 3],
    /// Vector from the centre to the middle of one edge, m.
    half_u: [f64; 3],
    /// Vector from the centre to the middle of the next edge, m; at a right angle to `half_u`.
    half_v: [f64; 3],
    /// Radiance, W/(m^2 sr).
    radiance_rgb: [f64; 3],
    /// Largest number of cells that it is divided into.
    #[serde(default = "area_samples")]
    samples: u32,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Environment")]
struct EnvironmentFields {
    /// An OpenEXR file of radiance, W/(m^2 sr), latitude by longitude, +z at the upper edge; its path is relative to the
    /// scene's folder.
    exr: String,
    /// Factor that its values are multiplied by.
    #[serde(default = "one")]
    scale: f64,
    /// Number of directions that represent it.
    #[serde(default = "sky_samples")]
    samples: u32,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Uniform")]
struct UniformFields {
    /// Radiance, W/(m^2 sr).
    radiance_rgb: [f64; 3],
    /// Number of directions that represent it.
    #[serde(default = "sky_samples")]
    samples: u32,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Overcast")]
struct OvercastFields {
    /// Radiance of the zenith, W/(m^2 sr).
    zenith_radiance_rgb: [f64; 3],
    /// Number of directions that represent it.
    #[serde(default = "sky_samples")]
    samples: u32,
}

const fn up() -> [f64; 3] {
    [0.0, 0.0, 1.0]
}

const fn one() -> f64 {
    1.0
}

const fn area_samples() -> u32 {
    64
}

const fn sky_samples() -> u32 {
    256
}

/// The JSON Schema of a scene.
#[must_use]
pub fn schema() -> Schema {
    schemars::schema_for!(SceneFields)
}

impl Scene {
    /// Reads the scene in a JSON file, and the mesh and environments that it names.
    ///
    /// # Errors
    /// [`Error::Io`] for a file that cannot be read, [`Error::Malformed`] for one that is not a valid scene.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let bytes = bounded(path, MOST_BYTES).map_err(Error::read(path))?;
        let file = Reader { path };
        scene(path, &bytes.ok_or_else(|| file.wrong(format!("at most {MOST_BYTES} bytes"), "more"))?)
    }

    /// A ball between three softboxes (data/scenes/studio-sphere.json), in an image with sides of `side` pixels.
    ///
    /// # Errors
    /// [`Error::Malformed`] for sides that a camera does not have.
    pub fn studio(side: u32) -> Result<Self, Error> {
        let text = include_str!("../../data/scenes/studio-sphere.json");
        let sides = format!("\"width\": {side}, \"height\": {side}");
        let text = text.replacen("\"width\": 64, \"height\": 64", &sides, 1);
        scene(Path::new("studio-sphere"), text.as_bytes())
    }
}

/// Reads the scene whose file at `path` has this content.
fn scene(path: &Path, bytes: &[u8]) -> Result<Scene, Error> {
    let file = Reader { path };
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    /// The schema is read first, so that a file that is not a scene is not rejected because of its fields.
    #[derive(Deserialize)]
    struct Tag {
        schema: String,
    }
    let Tag { schema } = file.parse(bytes)?;
    if schema != SCHEMA {
        return Err(file.wrong(format!("a scene ({SCHEMA})"), format!("schema {}", excerpt(&schema))));
    }
    let fields: SceneFields = file.parse(bytes)?;
    let camera = file.camera(&fields.camera)?;
    if fields.lights.is_empty() {
        return Err(file.wrong("at least one light in lights", "none"));
    }
    let surface = file.surface(&fields.surface)?;
    let (mut lamps, mut finer_lamps) = (Vec::new(), Vec::new());
    let mut samples = 0_u32;
    for (index, light) in fields.lights.iter().enumerate() {
        let light = NamedLight { file: &file, index, light };
        samples = samples.saturating_add(light.samples()?);
        if samples > MOST_LIGHT_SAMPLES {
            let found = format!("{samples} or more up to lights[{index}]");
            return Err(file.wrong(format!("at most {MOST_LIGHT_SAMPLES} samples of all lights"), found));
        }
        let [as_asked, finer] = light.lamps([1, FINER])?;
        lamps.extend(as_asked);
        finer_lamps.extend(finer);
    }
    Ok(Scene { path: path.to_owned(), camera, surface, lamps, finer_lamps })
}

/// Reads the bytes of a file. `None` if there are more than `most`.
fn bounded(path: &Path, most: u64) -> std::io::Result<Option<Vec<u8>>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(most + 1).read_to_end(&mut bytes)?;
    let fits = u64::try_from(bytes.len()).is_ok_and(|len| len <= most);
    Ok(fits.then_some(bytes))
}

/// The file being read, which errors name.
struct Reader<'a> {
    path: &'a Path,
}

impl Reader<'_> {
    fn wrong(&self, expected: impl Into<String>, found: impl Into<String>) -> Error {
        Error::malformed(self.path, Place::File, expected, found)
    }

    fn parse<'a, T: Deserialize<'a>>(&self, bytes: &'a [u8]) -> Result<T, Error> {
        serde_json::from_slice(bytes).map_err(|error| {
            let line = u64::try_from(error.line()).unwrap_or(u64::MAX);
            let text = error.to_string();
            let text = text.rsplit_once(" at line ").map_or(text.as_str(), |(text, _)| text);
            // The user does not know the types of this program.
            let text = match text.rsplit_once(", expected ") {
                Some((found, "f64")) => format!("{}, expected a number", excerpt(found)),
                Some((found, "u32")) => format!("{}, expected a whole number, not below 0", excerpt(found)),
                Some((found, wanted)) if wanted.starts_with("struct ") => {
                    format!("{}, expected an object", excerpt(found))
                }
                Some((found, wanted)) => format!("{}, expected {wanted}", excerpt(found)),
                None => excerpt(text),
            };
            let expected = format!("a scene ({SCHEMA})");
            Error::malformed(self.path, Place::Line(line), expected, format!("a fault: {text}"))
        })
    }

    /// Reads the bytes of a file that the scene names, and returns them with its path.
    fn named(&self, field: &str, name: &str, most: u64) -> Result<(Vec<u8>, std::path::PathBuf), Error> {
        let path = self.path.parent().unwrap_or_else(|| Path::new("")).join(name);
        let bytes = bounded(&path, most).map_err(|error| {
            let found = format!("{} ({})", excerpt(name), crate::error::plain(&error));
            self.wrong(format!("a file that can be read in {field}"), found)
        })?;
        let too_long = || Error::malformed(&path, Place::File, format!("at most {most} bytes"), "more");
        Ok((bytes.ok_or_else(too_long)?, path))
    }

    /// Checks that a number is from `low` to `high`; the message gives these with `unit`.
    fn number(&self, field: &str, value: f64, [low, high]: [f64; 2], unit: &str) -> Result<f64, Error> {
        if (low..=high).contains(&value) {
            return Ok(value);
        }
        let short = |x: f64| match x.abs() {
            size if size == 0.0 || (1e-3..1e4).contains(&size) => x.to_string(),
            _ => format!("{x:e}"),
        };
        let expected = format!("{} to {}{unit} in {field}", short(low), short(high));
        Err(self.wrong(expected, short(value)))
    }

    fn point(&self, field: &str, value: [f64; 3]) -> Result<DVec3, Error> {
        for coordinate in value {
            self.number(field, coordinate, [-LARGEST, LARGEST], " m")?;
        }
        Ok(DVec3::from_array(value))
    }

    fn size(&self, field: &str, value: f64) -> Result<f64, Error> {
        self.number(field, value, [SMALLEST, LARGEST], " m")
    }

    fn direction(&self, field: &str, value: [f64; 3]) -> Result<DVec3, Error> {
        let vector = DVec3::from_array(value);
        // Scaled first, so that squares neither underflow nor overflow.
        let scaled = vector / vector.abs().max_element();
        scaled.try_normalize().filter(|unit| unit.is_finite()).ok_or_else(|| {
            let [x, y, z] = value;
            self.wrong(format!("a vector of nonzero length in {field}"), format!("[{x}, {y}, {z}]"))
        })
    }

    fn light(&self, field: &str, value: [f64; 3]) -> Result<DVec3, Error> {
        for channel in value {
            self.number(field, channel, [0.0, BRIGHTEST], "")?;
        }
        if value == [0.0; 3] {
            return Err(self.wrong(format!("a value above 0 in {field}"), "[0, 0, 0]"));
        }
        Ok(DVec3::from_array(value))
    }

    fn camera(&self, fields: &CameraFields) -> Result<Camera, Error> {
        let position = self.point("camera.position", fields.position)?;
        let towards = self.point("camera.look_at", fields.look_at)? - position;
        let Some(forward) = towards.try_normalize() else {
            return Err(self.wrong("camera.look_at different from camera.position", "the same point"));
        };
        let up = self.direction("camera.up", fields.up)?;
        if forward.cross(up).length() < 1e-6 {
            let expected = "camera.up not parallel to the direction from camera.position to camera.look_at";
            return Err(self.wrong(expected, "parallel vectors"));
        }
        let fov =
            self.number("camera.vertical_fov_deg", fields.vertical_fov_deg, [0.01, 170.0], " degrees")?;
        for (field, value) in [("camera.width", fields.width), ("camera.height", fields.height)] {
            if !(1..=LARGEST_SIDE).contains(&value) {
                return Err(self.wrong(format!("1 to {LARGEST_SIDE} pixels in {field}"), value.to_string()));
            }
        }
        Ok(Camera::new(position, forward, up, fov.to_radians() / 2.0, (fields.width, fields.height)))
    }

    fn surface(&self, fields: &SurfaceFields) -> Result<Surface, Error> {
        Ok(match fields {
            SurfaceFields::Sphere(fields) => Surface::Sphere(Sphere {
                center: self.point("surface.sphere.center", fields.center)?,
                radius: self.size("surface.sphere.radius", fields.radius)?,
                pole: self.direction("surface.sphere.pole", fields.pole)?,
            }),
            SurfaceFields::Plane(fields) => {
                let normal = self.direction("surface.plane.normal", fields.normal)?;
                let tangent = self.direction("surface.plane.tangent", fields.tangent)?;
                if normal.cross(tangent).length() < 1e-6 {
                    let expected = "surface.plane.tangent not parallel to surface.plane.normal";
                    return Err(self.wrong(expected, "parallel vectors"));
                }
                Surface::Plane(Plane {
                    center: self.point("surface.plane.center", fields.center)?,
                    frame: Frame::new(normal, tangent),
                    half_width: self.size("surface.plane.half_width", fields.half_width)?,
                    half_height: self.size("surface.plane.half_height", fields.half_height)?,
                })
            }
            SurfaceFields::Cylinder(fields) => Surface::Cylinder(Cylinder {
                center: self.point("surface.cylinder.center", fields.center)?,
                axis: self.direction("surface.cylinder.axis", fields.axis)?,
                radius: self.size("surface.cylinder.radius", fields.radius)?,
                height: self.size("surface.cylinder.height", fields.height)?,
            }),
            SurfaceFields::Mesh(MeshFields { obj }) => {
                let (bytes, path) = self.named("surface.mesh.obj", obj, obj::MOST_BYTES)?;
                Surface::Mesh(obj::mesh(&bytes, &path, LARGEST)?)
            }
        })
    }
}

/// A light, with its index, which errors name.
struct NamedLight<'a> {
    file: &'a Reader<'a>,
    index: usize,
    light: &'a LightFields,
}

impl NamedLight<'_> {
    fn name(&self, field: &str) -> String {
        let kind = match self.light {
            LightFields::Directional(_) => "directional",
            LightFields::Point(_) => "point",
            LightFields::Area(_) => "area",
            LightFields::Environment(_) => "environment",
            LightFields::Uniform(_) => "uniform",
            LightFields::Overcast(_) => "overcast",
        };
        format!("lights[{}].{kind}.{field}", self.index)
    }

    /// Largest number of points that the light is divided into.
    fn samples(&self) -> Result<u32, Error> {
        let samples = match self.light {
            LightFields::Directional(_) | LightFields::Point(_) => 1,
            LightFields::Area(fields) => fields.samples,
            LightFields::Environment(fields) => fields.samples,
            LightFields::Uniform(fields) => fields.samples,
            LightFields::Overcast(fields) => fields.samples,
        };
        if !(1..=MOST_LIGHT_SAMPLES).contains(&samples) {
            let expected = format!("1 to {MOST_LIGHT_SAMPLES} in {}", self.name("samples"));
            return Err(self.file.wrong(expected, samples.to_string()));
        }
        Ok(samples)
    }

    /// Divides the light into points, twice: the requested number of points is multiplied by each of `times`.
    fn lamps(&self, times: [u32; 2]) -> Result<[Vec<Lamp>; 2], Error> {
        let file = self.file;
        let counts = |samples: u32| times.map(|times| samples.saturating_mul(times));
        let one = |lamp: Lamp| [vec![lamp], vec![lamp]];
        let light = |field: &str, value| file.light(&self.name(field), value);
        let point = |field: &str, value| file.point(&self.name(field), value);
        Ok(match self.light {
            LightFields::Directional(fields) => one(Lamp::Far {
                to_light: file.direction(&self.name("to_light"), fields.to_light)?,
                irradiance: light("irradiance_rgb", fields.irradiance_rgb)?,
            }),
            LightFields::Point(fields) => one(Lamp::Point {
                position: point("position", fields.position)?,
                intensity: light("intensity_rgb", fields.intensity_rgb)?,
            }),
            LightFields::Area(fields) => {
                let center = point("center", fields.center)?;
                let u = point("half_u", fields.half_u)?;
                let v = point("half_v", fields.half_v)?;
                file.size(&format!("the length of {}", self.name("half_u")), u.length())?;
                file.size(&format!("the length of {}", self.name("half_v")), v.length())?;
                let cosine = u.dot(v) / (u.length() * v.length());
                if cosine.abs() > 1e-6 {
                    let expected = format!("a right angle between {} and half_v", self.name("half_u"));
                    return Err(file.wrong(expected, format!("{:.4} deg", cosine.acos().to_degrees())));
                }
                let radiance = light("radiance_rgb", fields.radiance_rgb)?;
                counts(fields.samples).map(|samples| lights::panel(center, u, v, radiance, samples))
            }
            LightFields::Environment(fields) => {
                let scale = file.number(&self.name("scale"), fields.scale, [1e-12, BRIGHTEST], "")?;
                let (bytes, path) = file.named(&self.name("exr"), &fields.exr, environment::MOST_BYTES)?;
                environment::lamps(&bytes, &path, scale, counts(fields.samples))?
            }
            LightFields::Uniform(fields) => {
                let radiance = light("radiance_rgb", fields.radiance_rgb)?;
                counts(fields.samples).map(|samples| lights::uniform(radiance, samples))
            }
            LightFields::Overcast(fields) => {
                let zenith = light("zenith_radiance_rgb", fields.zenith_radiance_rgb)?;
                counts(fields.samples).map(|samples| lights::overcast(zenith, samples))
            }
        })
    }
}
