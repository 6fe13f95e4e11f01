//! What the targets share: what must hold of every reader is written once, for them and for the tests.

#[path = "../../tests/oracles/mod.rs"]
pub mod oracles;
