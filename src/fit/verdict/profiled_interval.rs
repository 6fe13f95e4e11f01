//! The interval of a parameter by the profile of the cost.

/// The interval of a parameter by its profile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProfiledInterval {
    /// Row of the parameter table.
    pub row: usize,
    /// Its ends, in the parameter's unit; at an open end the last value that was tried.
    pub ends: [f64; 2],
    /// Why each end is open; `None` if it is not.
    pub open: [Option<OpenEnd>; 2],
}

/// Why an interval is open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum OpenEnd {
    /// The cost does not rise enough up to the bound of the parameter.
    AtBound,
    /// The search was interrupted, or took too long.
    Unfinished,
}

impl OpenEnd {
    /// Name in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::AtBound => "at-bound",
            Self::Unfinished => "unfinished",
        }
    }
}
