//! The `spts` command line: reads recordings, runs the twin, scores both the same way, writes the report.

pub mod board;
pub mod budget;
pub mod calibrate;
pub mod cli;
pub mod compare;
pub mod data;
pub mod electronics;
pub mod explore;
pub mod fidelity;
pub mod figures;
pub mod firmware;
pub mod learn;
pub mod output;
pub mod phase;
pub mod progress;
pub mod provenance;
pub mod real;
pub mod report;
pub mod reproduce;
pub mod score;
pub mod seeds;
pub mod simulate;
pub mod twin;
