//! What a scene shows of a surface: which pairs of directions its pixels see, and how much light each carries.
//!
//! A scene (docs/scene.md) is a surface, a camera and lights. [`Scene::view`] turns it into a list of samples per pixel such
//! that, whatever the BRDF f,
//!
//! ```text
//! L_c(pixel) = sum over the pixel's samples of weight_c f_c(wi, wo)        c: red, green, blue
//! ```
//!
//! is the radiance that the pixel sees. The weight is all that does not depend on f: radiance of the light, cos(theta_i), and the
//! solid angle that the sample stands for. There is one ray per pixel, through its centre, and direct light alone.
//!
//! - Lengths are metres, the world is right-handed, +z is up.
//! - Local frame, as everywhere: z is the shading normal, x the tangent of the surface, y = z x x.
//! - Nothing is drawn at random: the same scene gives the same bytes, at any number of threads.

mod camera;
mod environment;
mod frame;
mod lights;
mod mesh;
mod obj;
mod read;
mod surface;
mod view;

pub use read::schema;
pub use view::{Seen, View};

use crate::error::{Error, Place};
use camera::Camera;
use lights::Lamp;
use std::path::{Path, PathBuf};
use surface::Surface;

/// Name of the schema of a scene.
pub const SCHEMA: &str = "brdfit.scene/1";
/// The most pixels along a side of the image.
pub const LARGEST_SIDE: u32 = 4096;
/// The most points that all lights of a scene may be divided into.
pub const MOST_LIGHT_SAMPLES: u32 = 1 << 16;
/// The most samples of a view: pixels that see the surface times points of light. 320 MiB of them.
pub const MOST_SAMPLES: usize = 1 << 22;

/// How many times as many points of light [`Scene::finer_view`] has.
pub const FINER: u32 = 4;

/// A surface, a camera and lights, read and checked.
#[derive(Clone, Debug)]
pub struct Scene {
    path: PathBuf,
    camera: Camera,
    surface: Surface,
    lamps: Vec<Lamp>,
    /// The same lights as [`FINER`] times as many points.
    finer_lamps: Vec<Lamp>,
}

impl Scene {
    /// The scene in a JSON file, with the mesh and the environments that it names.
    ///
    /// # Errors
    /// [`Error::Io`] for a file that cannot be read, [`Error::Malformed`] for one that is no scene.
    pub fn read(path: &Path) -> Result<Self, Error> {
        read::scene(path)
    }

    /// The file that it came from.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Pixels along the width and the height of its image.
    #[must_use]
    pub fn size(&self) -> (u32, u32) {
        (self.camera.width, self.camera.height)
    }

    /// What its pixels see.
    ///
    /// # Errors
    /// [`Error::Malformed`] if no pixel sees the surface, if no light reaches what they see, or if that takes more than
    /// [`MOST_SAMPLES`] samples.
    pub fn view(&self) -> Result<View, Error> {
        view::of(self, &self.lamps, usize::MAX)
    }

    /// What some of its pixels, at most `pixels` and evenly from their order, see of lights that are [`FINER`] times as many points: what
    /// tells whether there are enough of them. Fewer pixels if that took more than a quarter of [`MOST_SAMPLES`].
    ///
    /// # Errors
    /// As for [`Self::view`].
    pub fn finer_view(&self, pixels: usize) -> Result<View, Error> {
        let most = MOST_SAMPLES / 4 / self.finer_lamps.len().max(1);
        view::of(self, &self.finer_lamps, pixels.min(most.max(1)))
    }

    fn wrong(&self, expected: impl Into<String>, found: impl Into<String>) -> Error {
        Error::malformed(&self.path, Place::File, expected, found)
    }
}
