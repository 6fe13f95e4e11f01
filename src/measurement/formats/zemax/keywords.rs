//! The keywords of Zemax's header.

/// The keywords of the header that have a word.
pub(super) const WORDS: [&str; 4] = ["Source", "Symmetry", "SpectralContent", "ScatterType"];
/// The keywords of the header that have a list of angles, from the slowest to the fastest.
pub(super) const LISTS: [&str; 4] = ["SampleRotation", "AngleOfIncidence", "ScatterAzimuth", "ScatterRadial"];

/// Whether a word is a keyword. Files spell some in several ways.
pub(super) fn is(word: &str, keyword: &str) -> bool {
    word.eq_ignore_ascii_case(keyword)
}
