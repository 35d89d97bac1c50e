//! The report: one page that opens from disk, with figures and tables beside it.

mod html;

pub use html::{Card, Page, Section, Table, html};
