//! Facts with names, as a page lists them.

/// A fact with its name.
#[derive(Debug)]
pub(super) struct Fact {
    pub(super) name: &'static str,
    pub(super) value: String,
}

/// The facts that have a value, in their order.
pub(super) fn known(facts: impl IntoIterator<Item = (&'static str, String)>) -> Vec<Fact> {
    let known = facts.into_iter().filter(|(_, value)| !value.is_empty());
    known.map(|(name, value)| Fact { name, value }).collect()
}
