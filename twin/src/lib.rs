//! The twin of the single-pixel tactile skin as a library: scenes in, recordings out, and everything that is kept of them.

pub mod chain;
pub mod data;
pub mod output;
pub mod progress;
pub mod provenance;
pub mod scene;
pub mod session;
pub mod simulate;
pub mod twin;

pub use scene::Scene;
pub use session::Session;
