//! Reconstruction while measuring: an image after every measurement, until it is good enough.

mod progressive;
mod recursive;

pub use progressive::Progressive;
pub use recursive::RecursiveLmmse;
