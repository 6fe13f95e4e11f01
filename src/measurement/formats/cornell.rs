//! Text tables of the Cornell Program of Computer Graphics' gonioreflectometer.
//!
//! `#` comments, the number of wavelengths, the wavelengths in nanometres, then one sample per line: theta_i, phi_i,
//! theta_o, phi_o in radians and f in 1/sr for each wavelength, `nan` where it was not measured. Any white space separates values.

use super::fields::{self, finite, no_value, polar_angle};
use super::file::File;
use super::format::{Confidence, Format, ReadOptions};
use super::rows::{Part, Rows};
use crate::error::{Error, Place, excerpt};
use crate::geometry::{Pair, direction};
use crate::measurement::{Channel, Measurement};
use std::collections::HashSet;

/// The format's entry in the registry.
pub const FORMAT: Format = Format {
    name: "cornell",
    summary: "a Cornell text table",
    sniff,
    read,
    directions: None,
    several_materials: false,
    own_options: &[],
    knows_angles: false,
    extensions: &[],
    write: None,
};

/// Largest number of wavelengths: no instrument resolves more, so a larger number is not a count of wavelengths.
const MOST_WAVELENGTHS: usize = 100_000;

/// The words of a text with their lines, without comments.
fn words(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.lines().enumerate().flat_map(|(index, line)| {
        let content = line.split('#').next().unwrap_or_default();
        content.split_whitespace().map(move |word| (index + 1, word))
    })
}

fn sniff(file: &File<'_>) -> Confidence {
    let head = file.head(4096);
    if head.contains(&0) {
        return Confidence::No;
    }
    let head = String::from_utf8_lossy(head);
    let mut words = words(head.trim_start_matches('\u{feff}'));
    // The first line that is not a comment contains a single integer.
    let (Some((line, first)), second) = (words.next(), words.next()) else { return Confidence::No };
    let alone = second.is_none_or(|(next, _)| next > line);
    if alone && first.parse::<i64>().is_ok() { Confidence::Yes } else { Confidence::No }
}

fn read(file: &mut File<'_>, _: &ReadOptions) -> Result<Measurement, Error> {
    file.with_text(read_text)
}

fn read_text(file: &File<'_>, text: &str) -> Result<Measurement, Error> {
    let mut words = words(text);
    let Some((line, first)) = words.next() else {
        return Err(Error::malformed(file.path, Place::File, "the number of wavelengths", "only comments"));
    };
    let number = first.parse::<usize>().ok().filter(|n| (1..=MOST_WAVELENGTHS).contains(n));
    let Some(number) = number else {
        let expected = format!("the number of wavelengths, 1 to {MOST_WAVELENGTHS}");
        return Err(Error::malformed(file.path, Place::of_line(line), expected, excerpt(first)));
    };
    let mut channels: Vec<Channel> = Vec::new();
    let mut seen = HashSet::new();
    let mut last_line = line;
    for index in 0..number {
        let Some((line, word)) = words.next() else {
            let expected = format!("{number} wavelengths");
            return Err(Error::malformed(file.path, Place::of_line(last_line), expected, format!("{index}")));
        };
        last_line = line;
        let nm = finite(file, Place::of_line(line), "a wavelength", word)?;
        if nm <= 0.0 || !seen.insert(nm.to_bits()) {
            let expected = "a positive wavelength in nm, each once";
            return Err(Error::malformed(file.path, Place::of_line(line), expected, excerpt(word)));
        }
        channels.push(Channel::at_wavelength(nm));
    }
    // The samples begin on a new line.
    if let Some((line, word)) = words.next()
        && line == last_line
    {
        let expected = format!("the end of the line after {number} wavelengths");
        return Err(Error::malformed(file.path, Place::of_line(line), expected, excerpt(word)));
    }

    let mut rows = Part::new(text);
    for _ in 0..last_line {
        rows.next_line();
    }
    let parts = rows.read(|part| read_rows(file, part, &channels))?;
    Ok(Rows::joined(number, parts).measurement(channels))
}

/// The samples of some lines.
fn read_rows(file: &File<'_>, part: Part<'_>, channels: &[Channel]) -> Result<Rows, Error> {
    let number = channels.len();
    let mut rows = Rows::new(number);
    let mut words: Vec<&str> = Vec::new();
    for (place, line) in part.lines() {
        words.clear();
        words.extend(line.split('#').next().unwrap_or_default().split_whitespace());
        if words.is_empty() {
            continue;
        }
        let (Some((&[theta_i, phi_i, theta_o, phi_o], sampled)), true) =
            (words.split_first_chunk::<4>(), words.len() == 4 + number)
        else {
            let expected = format!("4 angles and {number} values");
            return Err(Error::malformed(file.path, place, expected, format!("{} numbers", words.len())));
        };
        let polar = |what, word| polar_angle(file, place, what, finite(file, place, what, word)?);
        rows.pairs.push(Pair {
            wi: direction(polar("theta_i", theta_i)?, finite(file, place, "phi_i", phi_i)?),
            wo: direction(polar("theta_o", theta_o)?, finite(file, place, "phi_o", phi_o)?),
        });
        for ((row, word), channel) in rows.values.iter_mut().zip(sampled).zip(channels) {
            let wrong = || no_value(file, place, &format!("{} nm", channel.name), word);
            row.push(fields::value(word).ok_or_else(wrong)?);
        }
    }
    Ok(rows)
}
