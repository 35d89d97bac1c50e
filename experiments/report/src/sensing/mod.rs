//! Files and figures of `spts sensing`.

mod design;
mod study;

pub use design::{DESIGN_FILES, write_design};
pub use study::{STUDY_FILES, write_study};
