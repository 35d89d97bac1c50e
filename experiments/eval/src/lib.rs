//! Scores decoders on sessions of the tactile skin, real or simulated: windows of a session go to an algorithm, and its
//! answers are scored.
//!
//! [`windows`](Press::windows) divides recordings into windows, [`decoders::DECODERS`] is the table of algorithms,
//! [`training`] provides their training data, and [`Scorer`] scores answers. [`board`] compares algorithms, and
//! [`ScoredSkin`] is the published evaluation.

pub mod algorithm;
mod alignment;
pub mod anytime;
pub mod board;
mod chunk;
pub mod decode;
pub mod decoders;
pub mod external;
pub mod in_time;
mod labels;
pub mod place;
pub mod placed;
pub mod protocol;
mod published;
mod scorer;
mod sensing;
mod session;
mod skin_run;
mod source;
mod table;
mod tally;
pub mod training;
mod truth;
mod windows;

pub use alignment::{
    Alignment, SessionSlip, UnalignedContact, contact_slips, find_slips, follow_slips, slips_text, unaligned_text,
};
pub use decoders::RASTER;
pub use labels::Labels;
pub use published::{BaselineRow, ScoreRow, SkinScores, baselines, mean_rows, score_raster, score_sessions};
pub use scorer::{Scorer, decode_us};
pub use sensing::{RowChooser, Sensing};
pub use session::ScoredSession;
pub use skin_run::{SkinRun, SkinRunPresses, TwinSessions, footprint_scene, twin_set};
pub use source::{PublishedSkin, ScoredSkin, Source, check_session};
pub use table::{Cell, Table, TextTable, escape};
pub use tally::{Scores, Tally, unique};
pub use truth::{PressTruth, TruthKind};
pub use windows::{Press, PressRows, Untouched, Window, idle_mean, idle_means, wire_means};
