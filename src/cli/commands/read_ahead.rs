//! Reads the next input while the current one is fitted.

use crate::cli::options::input::ReadArguments;
use brdfit::Error;
use brdfit::measurement::Measurement;
use rayon::Scope;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, sync_channel};
use std::time::Instant;

/// A measurement, and how long it took to read, seconds.
pub struct Input {
    pub measurement: Measurement,
    pub seconds: f64,
}

/// Reads and examines `paths` in order, on a thread of `scope`. A measurement is handed over when the receiver is ready for it,
/// and only then does reading the next one begin: at most one measurement waits in memory.
///
/// Reading ends with the paths, or when the receiver is dropped.
pub fn read_ahead<'s>(
    scope: &Scope<'s>,
    arguments: &'s ReadArguments,
    paths: &'s [PathBuf],
) -> Receiver<Result<Input, Error>> {
    // A channel without a buffer: sending waits for the receiver.
    let (sender, receiver) = sync_channel(0);
    scope.spawn(move |_| {
        for path in paths {
            let started = Instant::now();
            let measurement = arguments.read(path).and_then(|mut measurement| {
                arguments.examine(&mut measurement)?;
                Ok(measurement)
            });
            let seconds = started.elapsed().as_secs_f64();
            if sender.send(measurement.map(|measurement| Input { measurement, seconds })).is_err() {
                break;
            }
        }
    });
    receiver
}
