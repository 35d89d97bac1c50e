//! Reports: the tables and figures of every study, and one page that opens from disk.

pub mod budget;
pub mod compare;
mod error;
pub mod fidelity;
mod html;
mod origin;
#[cfg(test)]
pub(crate) mod samples;

pub use error::{ReportError, write_all_or_none};
pub use html::{Card, Page, Section, Table, html};
pub use origin::Origin;
