//! The rows of a text, read on all threads.

use crate::error::{Error, Place};
use crate::geometry::{Directions, Pair};
use crate::measurement::{Channel, Measurement};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Number of bytes of a text that are read at a time.
const PIECE: usize = 1 << 18;

/// Part of a text, from the beginning of a line.
#[derive(Clone, Copy)]
pub(super) struct Part<'t> {
    text: &'t str,
    /// The number of its first line, from 1.
    line: usize,
}

impl<'t> Part<'t> {
    /// A whole text.
    pub(super) fn new(text: &'t str) -> Self {
        Self { text, line: 1 }
    }

    /// Part of a text that begins with this line, from 1.
    pub(super) fn from_line(text: &'t str, line: usize) -> Self {
        Self { text, line }
    }

    /// The text.
    pub(super) fn text(self) -> &'t str {
        self.text
    }

    /// The number of the line that follows it, from 1.
    pub(super) fn next_number(self) -> usize {
        self.split(self.text.len()).1.line
    }

    /// Its lines, with their places.
    pub(super) fn lines(self) -> impl Iterator<Item = (Place, &'t str)> {
        self.text.lines().zip(self.line..).map(|(text, line)| (Place::of_line(line), text))
    }

    /// Takes off the first line.
    pub(super) fn next_line(&mut self) -> Option<(Place, &'t str)> {
        let first = self.lines().next();
        let after = self.text.find('\n').map_or(self.text.len(), |end| end + 1);
        *self = self.split(after).1;
        first
    }

    /// Divides it at a byte, which follows the end of a line.
    fn split(self, at: usize) -> (Self, Self) {
        let (text, after) = self.text.split_at_checked(at).unwrap_or((self.text, ""));
        // Counted in bytes, of which the processor adds many at a time.
        let count = |bytes: &[u8]| bytes.iter().map(|byte| u8::from(*byte == b'\n')).sum::<u8>();
        let lines: usize = text.as_bytes().chunks(255).map(|bytes| usize::from(count(bytes))).sum();
        (Self { text, ..self }, Self { text: after, line: self.line + lines })
    }

    /// Pieces that all threads together can read.
    fn pieces(mut self) -> Vec<Self> {
        let mut pieces = Vec::new();
        while !self.text.is_empty() {
            let rest = self.text.as_bytes().get(PIECE..).unwrap_or_default();
            let end = rest.iter().position(|byte| *byte == b'\n');
            let (piece, after) = self.split(end.map_or(self.text.len(), |end| PIECE + end + 1));
            pieces.push(piece);
            self = after;
        }
        pieces
    }

    /// What `read` makes of pieces of it, in their order.
    ///
    /// # Errors
    /// The error of the first piece that has one, which is the first error in the text.
    pub(super) fn read<T: Send>(
        self,
        read: impl Fn(Self) -> Result<T, Error> + Send + Sync,
    ) -> Result<Vec<T>, Error> {
        let pieces: Vec<Result<T, Error>> = self.pieces().into_par_iter().map(read).collect();
        pieces.into_iter().collect()
    }
}

/// Samples from rows of a text.
#[derive(Default)]
pub(super) struct Rows {
    pub pairs: Vec<Pair>,
    /// f by channel and sample.
    pub values: Vec<Vec<f64>>,
    /// The standard deviation of f by channel and sample, where there is one.
    pub sigma: Vec<Vec<f64>>,
    /// The number of samples left out, by reason.
    pub dropped: BTreeMap<&'static str, usize>,
}

impl Rows {
    /// No samples yet.
    pub(super) fn new(channels: usize) -> Self {
        let empty = || vec![Vec::new(); channels];
        Self { values: empty(), sigma: empty(), ..Self::default() }
    }

    pub(super) fn drop(&mut self, reason: &'static str) {
        *self.dropped.entry(reason).or_default() += 1;
    }

    /// The samples of all parts of a text, for that many channels.
    pub(super) fn joined(channels: usize, parts: Vec<Self>) -> Self {
        let mut parts = parts.into_iter();
        let mut all = parts.next().unwrap_or_else(|| Self::new(channels));
        let rest: Vec<Self> = parts.collect();
        all.pairs.reserve(rest.iter().map(|part| part.pairs.len()).sum());
        rest.into_iter().for_each(|part| all.append(part));
        all
    }

    /// Appends the samples of a further part.
    pub(super) fn append(&mut self, part: Self) {
        self.pairs.extend_from_slice(&part.pairs);
        for (row, of_part) in self.values.iter_mut().zip(&part.values) {
            row.extend_from_slice(of_part);
        }
        for (row, of_part) in self.sigma.iter_mut().zip(&part.sigma) {
            row.extend_from_slice(of_part);
        }
        for (reason, number) in part.dropped {
            *self.dropped.entry(reason).or_default() += number;
        }
    }

    /// The measurement that these samples are, with standard deviations if all values have one.
    pub(super) fn measurement(self, channels: Vec<Channel>) -> Measurement {
        let Self { pairs, values, sigma, dropped } = self;
        let complete = !pairs.is_empty() && sigma.iter().all(|row| row.len() == pairs.len());
        Measurement {
            sigma: complete.then_some(sigma),
            dropped,
            ..Measurement::of(channels, Directions::Scattered(pairs), values)
        }
    }
}
