//! The `spts` command line: reads recordings, runs the twin, scores both the same way, writes the report.

pub mod budget;
pub mod calibrate;
pub mod cli;
pub mod compare;
pub mod electronics;
pub mod explore;
pub mod fidelity;
pub mod figures;
pub mod firmware;
pub mod phase;
pub mod report;
pub mod reproduce;
pub mod seeds;
pub mod simulate;

pub use spts::{chain as twin, data, output, progress, provenance};
pub use spts_eval::{board, learn, real, score};
