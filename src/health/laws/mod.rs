//! What is known of every surface, asked of a measurement without fitting a model.

pub(crate) mod exchange;
pub(crate) mod hemisphere;
pub(crate) mod lobes;
pub(crate) mod neighbours;
pub(crate) mod poles;
pub(crate) mod sketch;
pub(crate) mod smoothness;
