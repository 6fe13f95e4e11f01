//! Reads the next input while the present one is fitted.

use crate::cli::options::input::ReadArguments;
use brdfit::Error;
use brdfit::measurement::Measurement;
use rayon::Scope;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, sync_channel};
use std::time::Instant;

/// A measurement, and the seconds that reading it took.
pub struct Input {
    pub measurement: Measurement,
    pub seconds: f64,
}

/// Reads `paths` in their order, in `scope`. Each is handed over when it is asked for, and only then is the
/// next one begun: besides what is in use, one measurement is in memory.
///
/// Reading ends with the paths, or when the receiver is dropped.
pub fn read_ahead<'s>(
    scope: &Scope<'s>,
    arguments: &'s ReadArguments,
    paths: &'s [PathBuf],
) -> Receiver<Result<Input, Error>> {
    // A channel without room: sending waits for the receiver.
    let (sender, receiver) = sync_channel(0);
    scope.spawn(move |_| {
        for path in paths {
            let started = Instant::now();
            let measurement = arguments.read(path);
            let seconds = started.elapsed().as_secs_f64();
            if sender.send(measurement.map(|measurement| Input { measurement, seconds })).is_err() {
                break;
            }
        }
    });
    receiver
}
