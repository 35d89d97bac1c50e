//! Tracks contacts in time with those decoders of the board that have a Gaussian prior.

use super::run::Entry;
use super::settings::{TrainedBoard, found};
use crate::error::ScoreError;
use crate::in_time::{
    ContactKind, Followed, InTimeBoard, InTimeObject, InTimeRow, Moment, drops, follow, press, scores,
};
use crate::training::SHAPES;
use rayon::prelude::*;
use spts_recon::recover::Gaussian;
use std::sync::Arc;

/// A contact by every entry and M, in this order.
type Everything = Vec<Followed>;

impl TrainedBoard<'_> {
    /// Tracks every scored press, and every drop of the ball, with every decoder and number of measurements. `done` is
    /// called after every press. Drops are not scored when an object is left out, because the ball is not one of the
    /// objects.
    ///
    /// # Errors
    /// [`ScoreError::NotInTime`] for a decoder without a Gaussian prior, [`ScoreError::Decode`] if a window cannot be
    /// processed.
    pub fn in_time(&self, done: &(dyn Fn() + Sync)) -> Result<InTimeBoard, ScoreError> {
        if self.run.sessions.is_empty() && self.source.bounces.is_none() {
            return Err(ScoreError::NoSession {
                found: found(self.source),
            });
        }
        for entry in &self.entries {
            if entry.decoders.iter().any(|decoder| decoder.trained.prior().is_none()) {
                return Err(ScoreError::not_in_time(&entry.name));
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
        follow: impl Fn(&crate::decoders::TrainedDecoder, &Arc<Gaussian>, usize, usize) -> Result<Followed, E>,
    ) -> Result<Everything, ScoreError> {
        let cols = self.cols();
        let mut all = Vec::with_capacity(self.entries.len() * self.run.measurements.len());
        for entry in &self.entries {
            let decoder = &entry.decoders[session];
            let Some(prior) = decoder.trained.prior() else {
                return Err(ScoreError::not_in_time(&entry.name));
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
