//! What a warning is.

/// Something that the user should know before relying on the result.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// Short name of the kind.
    pub kind: &'static str,
    /// The parameter that it is about; `None` if it is about the whole fit.
    pub parameter: Option<String>,
    /// What it is and what to do next.
    pub text: String,
}
