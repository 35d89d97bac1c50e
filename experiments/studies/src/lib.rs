//! Studies of the twin. Each module computes a report of its own type; none draws, prints or writes files.

pub mod arm;
pub mod bench;
pub mod budget;
pub mod calibrate;
pub mod compare;
pub mod design;
pub mod electronics;
pub mod few_wires;
pub mod fidelity;
pub mod firmware;
pub mod frames;
pub mod per_object;
pub mod sensing;
pub mod tolerances;
pub mod touches;
mod wiring;
