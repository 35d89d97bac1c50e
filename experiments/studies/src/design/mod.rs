//! Designs a skin for given requirements. Input: area, resolution, latency and image quality. Output: taxels, wires,
//! electronics, rows and decoder, with a promise that a simulation of other touches can check.
//!
//! [`DesignStudy`] searches. [`DesignCheck`] simulates a [`Design`] with touches, specimens and parts that were not
//! used in the search, and reports whether the promise holds.

mod answer;
mod band;
mod bench;
mod check;
mod classes;
mod objects;
mod promised;
mod report;
mod rows;
mod search;
mod study;
mod text;
mod wire;

pub use band::OUTSIDE;
pub use check::{CheckReport, CheckedQuantity, DesignCheck};
pub use objects::DesignObjects;
pub use report::{
    Alternative, Binding, CostDrivers, DecoderDesign, Design, DesignCurve, DesignPoint, DesignReport, Expectation,
    LatencyParts,
};
pub use rows::RowSource;
pub use study::{DesignStudy, WireChoice};
pub use wire::{FeedbackLimit, WireDesign};
