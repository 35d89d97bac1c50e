//! Contacts tracked in time, compared with decoding each window alone: what memory gains while a contact arrives,
//! grows, holds and bounces.
//!
//! A decoder with a Gaussian prior of images ([`crate::algorithm::Trained::prior`]) gets all windows of a press or drop
//! in order, from before the touch on, and keeps their information ([`spts_recon::recover::TrackedImage`]). At set
//! times after the touch its image is scored, together with the decoder's images for the last window alone and for a
//! longer window with as many samples as there are taxels. [`crate::board::TrainedBoard::in_time`] trains the decoders.
//!
//! During the rise of a press the true support is that of the least-squares image of the samples after the window,
//! which no decoder has used; during the hold it is the board's. The ground truth of a drop is the least-squares image
//! of the whole contact, as for places; it includes the decoded samples.

mod event;
mod files;
mod follow;
mod images;
mod rows;
mod tally;
mod text;

pub(crate) use event::{drops, press};
pub use files::{FILES, write};
pub(crate) use follow::{Followed, follow};
pub use images::{FollowedImage, followed_images};
pub use rows::{ContactKind, InTimeBoard, InTimeObject, InTimeRow};
pub use tally::{InTimeScores, Interval};
pub(crate) use tally::{Moment, scores};
pub use text::table;

use spts_recon::recover::Motion;

/// Time in which the shape of a contact is forgotten, s. Chosen on single presses of the recordings, among 3 to 300 ms:
/// the scores are flat from 10 to 100 ms. A ball is on the skin for 8 to 15 ms.
const MEMORY_S: f64 = 0.02;
/// Time over which the strength of a contact is averaged, s; a hundred samples of the published skin.
const STRENGTH_MEMORY_S: f64 = 0.0015;
/// Noise that grows with the contact, as a share of the samples' root mean square: that of `nn_lmmse`.
const NOISE: f64 = 0.12;

/// How contacts move, in samples at `rate_hz`, on a wire with this noise without a contact, V.
pub(crate) fn motion(rate_hz: f64, idle_noise_v: f64) -> Motion {
    Motion {
        memory: MEMORY_S * rate_hz,
        strength_memory: STRENGTH_MEMORY_S * rate_hz,
        noise: NOISE,
        idle_noise: idle_noise_v,
    }
}
