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

mod follow;
mod table;

pub(crate) use follow::{Followed, Moment, drops, follow, press, scores};
pub use follow::{FollowedImage, InTimeScores, Interval, followed_images};
pub use table::{table, write};

use crate::algorithm::ScoreError;
use crate::board::{Entry, TrainedBoard, no_session};
use crate::decoders::{TrainedDecoder, not_in_time};
use crate::training::SHAPES;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use spts_recon::recover::Gaussian;
use std::sync::Arc;

/// Kind of contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ContactKind {
    /// A press, from the touch to the hold.
    Press,
    /// A bouncing ball, from the touch to the end of the contact.
    Drop,
}

impl ContactKind {
    /// Name in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Press => "press",
            Self::Drop => "drop",
        }
    }
}

/// One decoder with windows of one size at one moment: means over the objects.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct InTimeRow {
    /// Algorithm for single windows, whose prior is used for tracking.
    pub decoder: String,
    /// Whether the scored object was excluded from the training data.
    pub left_out: bool,
    /// Training data, named as on the board.
    pub learned_from: String,
    /// Kind of contact.
    pub contact: ContactKind,
    /// Number of samples in a window.
    pub m: usize,
    /// Time from the touch to the end of the window, s; `None` while the contact is steady.
    pub since_touch_s: Option<f64>,
    /// Scores, means over the objects.
    #[serde(flatten)]
    pub scores: InTimeScores,
    /// Number of presses or drops that are scored.
    pub contacts: usize,
}

/// Results of `spts score --in-time` for one decoder on one object.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct InTimeObject {
    /// Object.
    pub object: String,
    /// Its results.
    #[serde(flatten)]
    pub row: InTimeRow,
}

/// Results of `spts score --in-time`: images of contacts that are followed in time, at set times after the touch.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct InTimeBoard {
    /// Means over the objects.
    pub rows: Vec<InTimeRow>,
    /// Single objects, for presses.
    pub objects: Vec<InTimeObject>,
}

/// A contact by every entry and M, in this order.
type Everything = Vec<Followed>;

impl TrainedBoard<'_> {
    /// Tracks every scored press, and every drop of the ball, with every decoder and number of measurements. `done` is
    /// called after every press. Drops are not scored when an object is left out, because the ball is not one of the
    /// objects.
    ///
    /// # Errors
    /// [`ScoreError`] for a decoder without a Gaussian prior, or if a window cannot be processed.
    pub fn in_time(&self, done: &(dyn Fn() + Sync)) -> Result<InTimeBoard, ScoreError> {
        if self.run.sessions.is_empty() && self.source.bounces.is_none() {
            return Err(no_session(self.source));
        }
        for entry in &self.entries {
            if entry.decoders.iter().any(|decoder| decoder.trained.prior().is_none()) {
                return Err(not_in_time(&entry.name).into());
            }
        }
        let presses = self.run.presses();
        let each = presses.par_iter().map(|&(session, block)| {
            let followed = match press(self.run.sessions[session], block) {
                Some(contact) => self.each(session, |decoder, prior, m, cols| {
                    follow(&contact, decoder, prior, m, cols)
                }),
                None => Ok(vec![Followed::new(); self.entries.len() * self.run.measurements.len()]),
            };
            done();
            followed
        });
        let followed = each.collect::<Result<Vec<Everything>, ScoreError>>()?;
        let balls = self.ball().map_or_else(Vec::new, |ball| drops(ball, self.cols()));
        let each = balls
            .par_iter()
            .map(|contact| self.each(0, |decoder, prior, m, cols| follow(contact, decoder, prior, m, cols)));
        let dropped = each.collect::<Result<Vec<Everything>, ScoreError>>()?;
        let mut board = InTimeBoard::default();
        let per_entry = self.run.measurements.len();
        for (e, entry) in self.entries.iter().enumerate() {
            for (i, &m) in self.run.measurements.iter().enumerate() {
                let at = e * per_entry + i;
                let of_session = |session: usize| -> Vec<&Followed> {
                    let own = presses.iter().zip(&followed).filter(|(press, _)| press.0 == session);
                    own.map(|(_, all)| &all[at]).collect()
                };
                let objects: Vec<Vec<&Followed>> = (0..self.run.sessions.len()).map(of_session).collect();
                self.add_presses(entry, m, &objects, &mut board);
                if !entry.left_out || entry.learned_from == SHAPES {
                    let drops = [dropped.iter().map(|all| &all[at]).collect::<Vec<_>>()];
                    board.rows.extend(lines(entry, ContactKind::Drop, m, &drops));
                }
            }
        }
        Ok(board)
    }

    /// What `follow` makes of every entry and M.
    fn each<E: Into<ScoreError>>(
        &self,
        session: usize,
        follow: impl Fn(&TrainedDecoder, &Arc<Gaussian>, usize, usize) -> Result<Followed, E>,
    ) -> Result<Everything, ScoreError> {
        let cols = self.cols();
        let mut all = Vec::with_capacity(self.entries.len() * self.run.measurements.len());
        for entry in &self.entries {
            let decoder = &entry.decoders[session];
            let Some(prior) = decoder.trained.prior() else {
                return Err(not_in_time(&entry.name).into());
            };
            for &m in &self.run.measurements {
                all.push(follow(decoder, &prior, m, cols).map_err(Into::into)?);
            }
        }
        Ok(all)
    }

    fn add_presses(&self, entry: &Entry, m: usize, objects: &[Vec<&Followed>], board: &mut InTimeBoard) {
        board.rows.extend(lines(entry, ContactKind::Press, m, objects));
        for (session, contacts) in self.run.sessions.iter().zip(objects) {
            let own = lines(entry, ContactKind::Press, m, std::slice::from_ref(contacts));
            board.objects.extend(own.into_iter().map(|row| InTimeObject {
                object: session.title().to_owned(),
                row,
            }));
        }
    }
}

/// A line for every moment that the contacts of the objects have.
fn lines(entry: &Entry, contact: ContactKind, m: usize, objects: &[Vec<&Followed>]) -> Vec<InTimeRow> {
    let mut moments: Vec<Moment> = Vec::new();
    for (moment, _) in objects.iter().flatten().copied().flatten() {
        if !moments.contains(moment) {
            moments.push(*moment);
        }
    }
    // the hold comes last
    let time_s = |moment: &Moment| moment.since_touch_s().unwrap_or(f64::INFINITY);
    moments.sort_by(|a, b| time_s(a).total_cmp(&time_s(b)));
    let each = moments.into_iter().map(|moment| {
        let (scores, contacts) = scores(objects, moment);
        InTimeRow {
            decoder: entry.name.clone(),
            left_out: entry.left_out,
            learned_from: entry.learned_from.clone(),
            contact,
            m,
            since_touch_s: moment.since_touch_s(),
            scores,
            contacts,
        }
    });
    each.collect()
}
