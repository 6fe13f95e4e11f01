//! Scenes: which pairs of directions the pixels of an image see, and how much light each carries.
//!
//! A scene (docs/use/scene.md) is a surface, a camera and lights. [`Scene::view`] turns it into a list of samples per pixel
//! such that, for any BRDF f,
//!
//! ```text
//! L_c(pixel) = sum over the pixel's samples of weight_c f_c(wi, wo)        c: red, green, blue
//! ```
//!
//! is the radiance that the pixel sees. The weight holds everything that does not depend on f: the radiance of the light,
//! cos(theta_i), and the solid angle that the sample represents. There is one ray per pixel, through its centre, and only
//! direct light.
//!
//! - Lengths are in metres, the world is right-handed, and +z is up.
//! - The local frame is the usual one: z is the shading normal, x the tangent of the surface, y = z x x.
//! - Nothing is random: the same scene gives the same bytes at any number of threads.

mod camera;
mod description;
mod environment;
mod frame;
mod lights;
mod mesh;
mod obj;
mod read;
mod surface;
mod view;

pub use description::{FINER, LARGEST_SIDE, MOST_LIGHT_SAMPLES, MOST_SAMPLES, SCHEMA, Scene};
pub use read::schema;
pub use view::{Seen, View};
