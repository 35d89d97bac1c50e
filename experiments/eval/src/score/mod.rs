//! The scoreboard: the same windows, truth, votes and baselines for every recording, real or simulated.

mod board;
mod bounce;
mod decode;
mod protocol;
mod raster;
mod scored;
mod session;
mod timing;

pub use board::{Arm, Board};
pub use bounce::{Bounce, BounceDecode, LocalisationRow, contact_image, find_bounces, localise};
pub use decode::{Decode, Decoder, Projected, Projection, idle_mean, quarter};
pub use protocol::{MEASUREMENTS, PLATEAU, PUBLISHED_HOLD_S, PUBLISHED_TAXELS, Protocol, Truth};
pub use raster::{RASTER, score_raster};
pub use scored::ScoredSession;
pub use session::{BaselineRow, Learned, ScoreRow, baselines, mean_rows, score_compressive};
pub use timing::decode_us_median;
