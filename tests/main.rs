//! Cross-crate tests.
mod bad_input;
mod command;
mod determinism;
mod recordings;
mod reproduce;
mod weights;
