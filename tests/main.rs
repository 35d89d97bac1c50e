//! Cross-crate tests.
mod weights;
