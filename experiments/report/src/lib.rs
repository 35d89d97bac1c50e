//! Reports: the tables and figures of every study, and one page that opens from disk.

pub mod animation;
pub mod bench;
pub mod budget;
pub mod calibrate;
pub mod compare;
pub mod dataset;
pub mod decode;
pub mod design;
pub mod electronics;
mod error;
pub mod few_wires;
pub mod fidelity;
pub mod figures;
mod html;
mod labels;
mod origin;
pub mod per_object;
pub mod reproduce;
pub mod score;
pub mod sensing;
pub mod simulation;

pub use error::write_all_or_none;
pub use html::{Card, Page, PageFigure, PageTable, Section, html};
pub use origin::Origin;
