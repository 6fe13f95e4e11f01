//! The largest share of light that each variant of a model reflects, as found by a search over its bounds (tests/albedos.rs).

use super::Choices;
use std::sync::LazyLock;

/// The largest directional albedo of a variant, up to 89.9 degrees, and where it was found.
///
/// Amplitudes that are albedos or reflectances were at most 1. Larger ones, which a measurement of unknown scale may need, gain energy
/// in any model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LargestAlbedo {
    /// The variant, without its Fresnel part: none reflects more than everything.
    pub variant: &'static str,
    /// The albedo.
    pub albedo: f64,
    /// The angle of incidence, degrees, and the azimuth of anisotropic variants.
    pub theta_i_deg: &'static str,
    /// The parameters.
    pub at: &'static str,
}

/// The variants for which an albedo above 1 was found.
static LARGEST: LazyLock<Vec<LargestAlbedo>> = LazyLock::new(|| {
    let line = |line: &'static str| {
        let mut cells = line.split(';');
        let mut cell = || cells.next();
        let (variant, albedo) = (cell()?, cell()?.parse().ok()?);
        Some(LargestAlbedo { variant, albedo, theta_i_deg: cell()?, at: cell()? })
    };
    include_str!("largest_albedos.csv").lines().skip(1).filter_map(line).collect()
});

/// The largest albedo of a variant; `None` if none above 1 was found.
#[must_use]
pub fn largest_albedo(model: &str, choices: &Choices) -> Option<LargestAlbedo> {
    let choices = choices.without("f").text();
    let variant = if choices.is_empty() { model.to_owned() } else { format!("{model}({choices})") };
    LARGEST.iter().find(|largest| largest.variant == variant).copied()
}

/// The variants of a model for which an albedo above 1 was found.
pub fn largest_albedos(model: &str) -> impl Iterator<Item = LargestAlbedo> + '_ {
    LARGEST.iter().filter(move |largest| largest.variant.split('(').next() == Some(model)).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_of_the_file_is_read() {
        assert_eq!(LARGEST.len(), include_str!("largest_albedos.csv").lines().count() - 1);
        assert!(LARGEST.iter().all(|largest| largest.albedo > 1.0));
    }
}
