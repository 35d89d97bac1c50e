//! The outlines of the shape families.

mod bars;
mod blobs;
mod combs;
mod lines;
mod plates;
mod rings;
mod studs;
mod unions;

pub(super) use bars::{bar, junction};
pub(super) use blobs::{blob, dome};
pub(super) use combs::{comb, gear};
pub(super) use lines::{letter, polyline};
pub(super) use plates::{perforated, plate};
pub(super) use rings::ring;
pub(super) use studs::studs;
pub(super) use unions::union;
