//! Examines a measurement: whether its file, read in another way, would agree better with what is known of every surface.
//!
//! | law | what it says | module of `health::laws` |
//! |---|---|---|
//! | lobes | the brightest samples lie where light and viewer mirror each other, or where both coincide | `lobes` |
//! | smoothness | f hardly differs between neighbouring directions | `smoothness` |
//! | poles | about the normal, azimuths make no difference | `poles` |
//! | exchange | f stays the same when light and viewer change places | `exchange` |
//! | energy | no albedo is above 1, and f is never negative | `hemisphere` |
//!
//! No model is fitted. Another reading is named only where the one that was chosen breaks a law clearly and the other keeps it; what two
//! readings explain equally well is said of both. docs/use/doctor.md says what can be told from which files, and what cannot.

mod angles;
mod energy;
mod values;

use crate::health::laws::exchange;
use crate::health::laws::sketch::Sketch;
use crate::measurement::reading::Conventions;
use crate::measurement::{Doubt, Evidence, Measurement};

/// What speaks for reading the file of a measurement, which was read with these conventions, in another way: a doubt for each matter, none for
/// a file in which nothing does. Takes some milliseconds.
#[must_use]
pub fn examine(measurement: &Measurement, conventions: &Conventions) -> Vec<Doubt> {
    // What a file defines everywhere has the layout of its format, and no option reads it otherwise.
    if measurement.continuous.is_some() {
        return Vec::new();
    }
    // The cells of a grid have no directions of their own, but their values may be anything.
    let sketch = Sketch::new(measurement);
    let mut found = Vec::new();
    if let Some(sketch) = &sketch {
        found.extend(values::decibels(sketch, measurement, conventions));
        let angles = angles::other(sketch, measurement, conventions);
        // Directions that were misunderstood are not exchanged.
        if found.is_empty()
            && angles.is_none()
            && let Some(cosine) = exchange::cosine(sketch)
        {
            found.push(values::cosine(cosine, conventions));
        }
        found.extend(angles);
        found.extend(values::too_dark(sketch, conventions));
    }
    if !found.iter().any(|other| matches!(other.evidence, Evidence::Negative { .. })) {
        found.extend(values::too_much(measurement, sketch.as_ref(), conventions));
    }
    found.into_iter().map(Doubt::OtherReading).collect()
}
