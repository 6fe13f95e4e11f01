//! The parts of a microfacet model: the distribution of facets, their shadowing, and their reflectance.
//!
//! To add a part: copy the file of the most similar one, and add one line to the list in its folder's `registry.rs`.

pub(crate) mod charlie;
pub(crate) mod directional_albedo;
pub mod distribution;
pub mod fresnel;
pub mod paint_layers;
pub mod shadowing;

/// Makes the enum of all parts of one kind, and their names, from one line each.
macro_rules! parts {
    ($(#[$doc:meta])* $kind:ident: $($name:literal => $part:ident),* $(,)?) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        #[expect(missing_docs, reason = "each part has its own documentation")]
        pub enum $kind { $($part),* }

        impl $kind {
            /// Names of the parts in expressions.
            #[must_use]
            pub fn names() -> Vec<&'static str> {
                vec![$($name),*]
            }

            /// The part with this name, or the first of the list if there is none.
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
