//! Scores decoders on sessions of the tactile skin, real or simulated: windows of a session go to an algorithm, and its
//! answers are scored.
//!
//! [`windows`](Press::windows) divides recordings into windows, [`decoders::DECODERS`] is the table of algorithms,
//! [`training`] provides their training data, and [`Scorer`] scores answers. [`board`] compares algorithms, and
//! [`ScoredSkin`] is the published evaluation.

pub mod algorithm;
mod alignment;
pub mod anytime;
mod baselines;
pub mod board;
mod chunk;
mod control;
pub mod decode;
pub mod decoders;
mod error;
pub mod external;
pub mod in_time;
mod labels;
pub mod npz;
pub mod place;
pub mod protocol;
mod scorer;
mod sensing;
mod session;
mod skin;
mod source;
mod table;
mod tally;
mod timing;
pub mod training;
#[cfg(feature = "mujoco")]
mod twin_sessions;
mod unique;
mod untouched;
mod validation;
mod windows;

pub use alignment::{SessionSlip, find_slips, follow_slips, slips_text};
pub use baselines::{BaselineRow, baselines};
pub use control::{RASTER, score_raster};
pub use error::ScoreError;
pub use labels::Labels;
pub use scorer::Scorer;
pub use sensing::{RowChooser, Sensing};
pub use session::ScoredSession;
pub use skin::{ScoredSkin, SkinScores};
pub use source::{PublishedSkin, Source, check_session};
pub use table::{Cell, Table, TextTable, escape};
pub use tally::{Scores, Tally};
pub use timing::decode_us;
#[cfg(feature = "mujoco")]
pub use twin_sessions::{TwinSessions, TwinSessionsError};
pub use unique::unique;
pub use untouched::Untouched;
pub use validation::{ScoreRow, mean_rows, score_session};
pub use windows::{Press, PressRows, Window, idle_mean};
