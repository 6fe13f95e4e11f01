//! A scene that has been read and checked, and its largest sizes. `read` makes it, `view` computes what it shows.

use super::camera::Camera;
use super::lights::Lamp;
use super::surface::Surface;
use crate::error::{Error, Place};
use std::path::{Path, PathBuf};

/// Name of the schema of a scene.
pub const SCHEMA: &str = "brdfit.scene/1";
/// Largest number of pixels along a side of the image.
pub const LARGEST_SIDE: u32 = 4096;
/// Largest number of points that all lights of a scene together may be divided into.
pub const MOST_LIGHT_SAMPLES: u32 = 1 << 16;
/// Largest number of samples of a view, which is the number of pixels that see the surface times that of points of light.
/// They take 320 MiB.
pub const MOST_SAMPLES: usize = 1 << 22;

/// Factor by which [`Scene::finer_view`] increases the number of points of light.
pub const FINER: u32 = 4;

/// A surface, a camera and lights, read and checked.
#[derive(Clone, Debug)]
pub struct Scene {
    pub(super) path: PathBuf,
    pub(super) camera: Camera,
    pub(super) surface: Surface,
    pub(super) lamps: Vec<Lamp>,
    /// The same lights divided into [`FINER`] times as many points.
    pub(super) finer_lamps: Vec<Lamp>,
}

impl Scene {
    /// The file that it was read from.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Width and height of its image, pixels.
    #[must_use]
    pub fn size(&self) -> (u32, u32) {
        (self.camera.width, self.camera.height)
    }

    /// The error for a scene that cannot be rendered.
    pub(super) fn wrong(&self, expected: impl Into<String>, found: impl Into<String>) -> Error {
        Error::malformed(&self.path, Place::File, expected, found)
    }
}
