//! Channels for s- and p-polarised light.

use crate::measurement::{Channel, Measurement};
use std::collections::HashMap;

/// Two channels that are the same but for their polarisation.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Polarised {
    pub(super) s: usize,
    pub(super) p: usize,
    /// What is left of their names; empty if they are called `s` and `p` alone.
    name: String,
}

/// The name of a channel without the word that says how the light is polarised, and whether it is `s`.
fn without_polarisation(name: &str) -> Option<(String, bool)> {
    let separators = ['_', ' ', '-', '.'];
    let mut words: Vec<&str> = name.split(separators).filter(|word| !word.is_empty()).collect();
    let is = |word: &str| match word.to_ascii_lowercase().as_str() {
        "s" | "spol" => Some(true),
        "p" | "ppol" => Some(false),
        _ => None,
    };
    let place = words.iter().position(|word| is(word).is_some())?;
    let s = is(words.remove(place))?;
    words.retain(|word| !["pol", "polarised", "polarized", "polarisation", "polarization"].contains(word));
    Some((words.join("_"), s))
}

/// The pairs of polarised channels among all. Empty unless every channel belongs to one.
pub(super) fn polarised(channels: &[Channel]) -> Vec<Polarised> {
    let mut found: Vec<(String, [Option<usize>; 2])> = Vec::new();
    let mut places: HashMap<String, usize> = HashMap::new();
    for (index, channel) in channels.iter().enumerate() {
        let Some((name, s)) = without_polarisation(&channel.name) else { return Vec::new() };
        let place = *places.entry(name.clone()).or_insert(found.len());
        if place == found.len() {
            found.push((name, [None; 2]));
        }
        if let Some((_, pair)) = found.get_mut(place) {
            let [of_s, of_p] = pair;
            *(if s { of_s } else { of_p }) = Some(index);
        }
    }
    let pair = |(name, [s, p]): (String, [Option<usize>; 2])| Some(Polarised { s: s?, p: p?, name });
    let pairs: Option<Vec<Polarised>> = found.into_iter().map(pair).collect();
    pairs.filter(|pairs| 2 * pairs.len() == channels.len()).unwrap_or_default()
}

/// Replaces pairs of polarised channels by their mean, which is f for unpolarised light. False if there are none.
pub(super) fn average(measurement: &mut Measurement) -> bool {
    let pairs = polarised(&measurement.channels);
    if pairs.is_empty() {
        return false;
    }
    let of = |pair: &Polarised, rows: &[Vec<f64>], mean: fn(f64, f64) -> f64| -> Vec<f64> {
        let row = |index: usize| rows.get(index).map(Vec::as_slice).unwrap_or_default();
        row(pair.s).iter().zip(row(pair.p)).map(|(s, p)| mean(*s, *p)).collect()
    };
    let all = |rows: &[Vec<f64>], mean| pairs.iter().map(|pair| of(pair, rows, mean)).collect();
    measurement.values = all(&measurement.values, |s, p| 0.5 * (s + p));
    // Standard deviations of independent readings.
    measurement.sigma = measurement.sigma.as_ref().map(|sigma| all(sigma, |s, p| 0.5 * s.hypot(p)));
    let name = |pair: &Polarised| if pair.name.is_empty() { "f".to_owned() } else { pair.name.clone() };
    measurement.channels = pairs.iter().map(|pair| Channel::named(&name(pair))).collect();
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    fn channels(names: &[&str]) -> Vec<Channel> {
        names.iter().map(|name| Channel::named(name)).collect()
    }

    #[test]
    fn pairs_are_found_by_name() {
        assert_eq!(polarised(&channels(&["s", "p"])), [Polarised { s: 0, p: 1, name: String::new() }]);
        let several = polarised(&channels(&["450_p", "450_s", "550 s-pol", "550 p-pol"]));
        assert_eq!(several.iter().map(|pair| (pair.s, pair.p)).collect::<Vec<_>>(), [(1, 0), (2, 3)]);
        for others in [&["s"][..], &["s", "r"], &["s", "p", "f"], &["r", "g", "b"], &["s", "s_1"]] {
            assert_eq!(polarised(&channels(others)), [], "{others:?}");
        }
    }
}
