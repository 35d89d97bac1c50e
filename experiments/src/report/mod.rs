//! The report: one page that opens from disk, with figures and tables beside it.

mod html;
#[cfg(test)]
pub(crate) mod samples;
pub mod score;

pub use html::{Card, Page, Section, Table, html};
