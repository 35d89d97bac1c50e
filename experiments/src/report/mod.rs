//! Reports: the tables and figures of every study, and one page that opens from disk.

pub mod electronics;
mod error;
pub mod explore;
mod html;
#[cfg(test)]
pub(crate) mod samples;

pub use error::{ReportError, write_all_or_none};
pub use html::{Card, Page, Section, Table, html};
