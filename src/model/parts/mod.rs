//! The parts of a microfacet model: how facets are distributed, which of them are hidden, what they
//! reflect.
//!
//! To add a part: copy the file of the one most like it, and add one line to the list in its folder's
//! `mod.rs`.

pub(crate) mod directional_albedo;
pub mod distribution;
pub mod fresnel;
pub mod paint_layers;
pub mod shadowing;

/// Makes the closed set of parts of one kind, and their names, from one line each.
macro_rules! parts {
    ($(#[$doc:meta])* $kind:ident: $($name:literal => $part:ident),* $(,)?) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        #[expect(missing_docs, reason = "each variant is documented at its part")]
        pub enum $kind { $($part),* }

        impl $kind {
            /// The parts' names in expressions.
            #[must_use]
            pub fn names() -> Vec<&'static str> {
                vec![$($name),*]
            }

            /// The part of that name; the first of the list for a name that is not in it.
            #[must_use]
            pub fn named(name: &str) -> Self {
                [$(($name, Self::$part)),*]
                    .into_iter()
                    .find(|(n, _)| *n == name)
                    .map_or([$(Self::$part),*][0], |(_, part)| part)
            }
        }
    };
}
pub(crate) use parts;
