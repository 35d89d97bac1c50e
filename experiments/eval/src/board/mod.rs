//! `spts score`: algorithms side by side on the same windows, truth, votes and time.
//!
//! [`Plan::learn`] learns, [`Ready::score`] decodes and scores; [`DECODERS`] is the table of algorithms, [`external`] speaks with programs outside, and
//! [`regressions`] holds a board against an earlier one.

mod algorithm;
mod decoders;
pub mod external;
mod place;
mod plan;
mod regression;
mod rows;
mod run;
mod tally;
mod teach;
mod text;
mod timing;
mod window;

pub use algorithm::{Algorithm, Answer, Class, DecodeError, Trained};
pub use decoders::{DECODERS, Needs, Spec, find};
pub use external::ExternalCommand;
pub use plan::{BoardError, LAYOUT, PUBLISHED, Plan, RASTER, Ready};
pub use regression::{Regression, regressions};
pub use rows::{ObjectRow, PlaceRow, Row, ScoreBoard, Scores};
pub use teach::{CALIBRATED, Teaching};
pub use text::table;
pub use window::{Press, Window};
