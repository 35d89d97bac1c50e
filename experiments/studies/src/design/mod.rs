//! A skin for what somebody wants of it: area, resolution, latency and image in; taxels, wires, electronics, rows and
//! decoder out, with a promise that a simulation of other touches can check.
//!
//! [`DesignStudy`] searches. [`DesignCheck`] simulates a [`Design`] with touches, specimens and parts that the search
//! has not seen, and says whether what was promised is found.

mod answer;
mod band;
mod bench;
mod check;
mod classes;
mod error;
mod objects;
mod report;
mod rows;
mod study;
mod text;
mod wire;

pub use band::{OUTSIDE, Promise};
pub use check::{CheckReport, CheckedQuantity, DesignCheck};
pub use error::DesignError;
pub use objects::DesignObjects;
pub use report::{
    Alternative, Binding, CostDrivers, DecoderDesign, Design, DesignCurve, DesignPoint, DesignReport, Expectation,
    LatencyParts,
};
pub use rows::RowSource;
pub use study::{DesignStudy, WireChoice};
pub use wire::{FeedbackLimit, WireDesign};
