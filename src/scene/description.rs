//! A scene, read and checked, and how large it may be. `read` makes it, `view` says what it shows.

use super::camera::Camera;
use super::lights::Lamp;
use super::surface::Surface;
use crate::error::{Error, Place};
use std::path::{Path, PathBuf};

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
    pub(super) path: PathBuf,
    pub(super) camera: Camera,
    pub(super) surface: Surface,
    pub(super) lamps: Vec<Lamp>,
    /// The same lights as [`FINER`] times as many points.
    pub(super) finer_lamps: Vec<Lamp>,
}

impl Scene {
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

    /// The error for a scene that cannot be shown.
    pub(super) fn wrong(&self, expected: impl Into<String>, found: impl Into<String>) -> Error {
        Error::malformed(&self.path, Place::File, expected, found)
    }
}
