//! Models: the interface of a model, and the registry of all of them.
//!
//! For fixed shape parameters every reflectance model here is a sum of basis functions of the geometry,
//!
//! ```text
//! f_c(wi, wo) = sum_k a_k(amplitudes_c) B_k(wi, wo; shapes)          [1/sr]
//! ```
//!
//! and a [`Model`] is exactly these two functions, each written once for any [`Scalar`]. Everything that a fit needs
//! follows: derivatives with respect to shapes by evaluating the basis on dual numbers, derivatives with respect to
//! amplitudes by evaluating the (tiny) coefficients on dual numbers once per pass, and one basis shared by all channels.
//! The basis is a product of one or more [`Part`]s. This keeps models with exchangeable parts fast, and lets channels share
//! the parts that they have in common.
//!
//! To add a model: copy the file of the most similar one, and add one line to the list in `registry.rs`.

mod choices;
mod energy;
mod erased_part;
mod evaluation;
mod expression;
mod parameter;
mod part;
mod part_block;
#[doc(hidden)]
pub mod parts;
mod point_evaluation;
mod product;
mod published;
mod registry;
mod strength;
mod values;
mod zoo;

#[doc(hidden)]
pub use choices::Choices;
pub use choices::ModelOption;
pub use energy::{LargestAlbedo, largest_albedo, largest_albedos};
#[doc(hidden)]
pub use evaluation::BasisBlock;
pub use expression::{Expression, Lobe, LobeValues};
pub use parameter::{Isotropy, ParamSpec, Role, Scale, Sharing, Sharper, Unit};
#[doc(hidden)]
pub use part::{Derivatives, Kernel, Part, PreparedBy, Visitor};
pub(crate) use part::{Reshape, Reshaped};
#[doc(hidden)]
pub use registry::LobeCoefficients;
pub use registry::{AnyModel, ModelEntry, REGISTRY};
pub use strength::{STRENGTH, Strength};
#[doc(hidden)]
pub use values::Values;

use crate::math::Scalar;

/// One reflectance lobe, in the form that the module documentation gives.
#[doc(hidden)]
pub trait Model: Sized {
    /// One coefficient per basis function.
    type Coefficients<T: Scalar>: AsRef<[T]>;

    /// Name in expressions and reports.
    const NAME: &'static str;
    /// What the model describes, in one line.
    const SUMMARY: &'static str;
    /// Where the formula comes from.
    const REFERENCE: &'static str;
    /// The variants that an expression may choose from.
    const OPTIONS: &'static [ModelOption] = &[];
    /// Whether f is the same when light and viewer are exchanged.
    const RECIPROCAL: bool = true;

    /// Makes the variant that `choices` describe.
    fn build(choices: &Choices) -> Self;

    /// The parameters, with shapes and amplitudes in any order.
    fn parameters(&self) -> Vec<ParamSpec>;

    /// Passes to `visitor` the parts whose products are the basis functions, in 1/sr. Shapes are numbered in declared order.
    fn visit(&self, visitor: &mut impl Visitor);

    /// The coefficients of the basis functions. Amplitudes are in declared order.
    fn coefficients<T: Scalar>(&self, amplitudes: Values<'_, T>) -> Self::Coefficients<T>;

    /// Pairs of parameters whose product is better determined than either of them.
    fn products(&self) -> &'static [(&'static str, &'static str)] {
        &[]
    }

    /// How the lobe can be absent from a sum. A test checks this by evaluation.
    fn strength(&self) -> Strength {
        Strength::Amplitudes
    }
}
