//! Channels that hold the same value everywhere while others vary: a dead detector.

use super::Doubt;
use crate::error::short;

/// Values that differ by less than this, relative to the larger, are the same.
const SAME: f64 = 1e-12;

/// Whether each channel, whose values are in `rows`, is dead: it has the same value at every sample at which it was measured, while
/// another varies. (A perfectly matte material has the same value everywhere in all channels.)
#[must_use]
pub fn dead_channels(rows: &[Vec<f64>]) -> Vec<bool> {
    let constant: Vec<bool> = rows.iter().map(|row| is_constant(row)).collect();
    let all = constant.iter().all(|constant| *constant);
    constant.into_iter().map(|constant| constant && !all).collect()
}

/// Whether there are several values and all are the same.
fn is_constant(row: &[f64]) -> bool {
    let mut measured = measured(row);
    let Some(first) = measured.next() else { return false };
    let same = |value: f64| (value - first).abs() <= SAME * value.abs().max(first.abs());
    measured.next().is_some_and(same) && measured.all(same)
}

/// The values of a channel that were measured.
fn measured(row: &[f64]) -> impl Iterator<Item = f64> {
    row.iter().copied().filter(|value| !value.is_nan())
}

/// The doubts about channels with these names, whose values are in `rows`, that are dead.
pub fn doubts(channels: &[String], rows: &[Vec<f64>], dead: &[bool]) -> Vec<Doubt> {
    let named = channels.iter().zip(rows).zip(dead).filter(|(_, dead)| **dead);
    let doubt = |((channel, row), _): ((&String, &Vec<f64>), &bool)| Doubt::DeadChannel {
        channel: short(channel),
        value: measured(row).next().unwrap_or_default(),
        samples: measured(row).count(),
    };
    named.map(doubt).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_channel_that_stands_still_while_others_move_is_dead() {
        assert_eq!(dead_channels(&[vec![1.0, 2.0], vec![0.5, 0.5], vec![0.0, 0.0]]), [false, true, true]);
        // A matte material is constant in all channels, and a single sample says nothing.
        assert_eq!(dead_channels(&[vec![1.0, 1.0], vec![0.5, 0.5]]), [false, false]);
        assert_eq!(dead_channels(&[vec![1.0], vec![0.5]]), [false, false]);
        // What was not measured is no value.
        let nan = f64::NAN;
        assert_eq!(dead_channels(&[vec![1.0, 2.0, nan], vec![nan, 0.5, 0.5]]), [false, true]);
        assert_eq!(dead_channels(&[vec![1.0, 2.0, nan], vec![nan, 0.5, nan]]), [false, false]);
        let rows = [vec![nan, 0.5, 0.5]];
        let expected = [Doubt::DeadChannel { channel: "r".to_owned(), value: 0.5, samples: 2 }];
        assert_eq!(doubts(&["r".to_owned()], &rows, &[true]), expected);
        assert_eq!(dead_channels(&[vec![0.3, 0.3 + 1e-15], vec![0.5, 0.5 + 1e-9]]), [true, false]);
    }
}
