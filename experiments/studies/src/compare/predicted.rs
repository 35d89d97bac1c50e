//! Prediction of sessions with a profile fitted to others.

use super::replay::ReplayError;
use super::statistics::{COMPARED_NAMES, value_of};
use super::study::Images;
use super::{compared_presses, twin_of, unfit};
use crate::calibrate::{FittedReadout, SessionEstimates, SessionPair, fitted_profile, predicted};
use rayon::prelude::*;
use serde::Serialize;
use spts_circuit::Profile;
use spts_models::Streams;

/// Which profile predicts a session: one fitted to the other sessions, or a given one.
#[derive(Debug, Clone)]
pub enum Predictor {
    /// A profile fitted to all presses of the other sessions.
    Others,
    /// The given profile.
    Profile(Box<Profile>),
}

/// Settings of `spts compare --profile`: sessions are predicted by a profile that was not fitted to them.
#[derive(Debug, Clone)]
pub struct Prediction {
    /// The profile.
    pub predictor: Predictor,
    /// Number of twins of every session, each with other values from the spans of the profile; [2, 1000].
    pub draws: u64,
}

/// One statistic of one session, compared with the band of its twins.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PredictedStatistic {
    /// Session.
    pub session: String,
    /// Name.
    pub name: &'static str,
    /// Value in the recordings of the skin.
    pub real: f64,
    /// Mean of the twins.
    pub twin: f64,
    /// Lower end of the span in which a further twin lies with a probability of 90 %.
    pub low: f64,
    /// Its upper end.
    pub high: f64,
    /// Whether the real value lies in the span.
    pub inside: bool,
}

/// Numbers of every session, each beside the band of its twins; `done` is called after every twin.
///
/// # Errors
/// [`ReplayError`] when a session cannot be fitted, or with one session and no profile.
pub(super) fn predicted_statistics(
    pairs: &[SessionPair],
    asked: &Prediction,
    images: &Images,
    streams: Streams,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<PredictedStatistic>, ReplayError> {
    let whole = |pair: &SessionPair| {
        let blocks: Vec<usize> = (0..pair.compressive.blocks().len()).collect();
        SessionEstimates::of(pair, &pair.compressive, &blocks).ok_or_else(|| unfit(pair))
    };
    let sessions: Vec<SessionEstimates> = pairs.par_iter().map(whole).collect::<Result<_, _>>()?;
    let mut rows = Vec::new();
    for (k, pair) in pairs.iter().enumerate() {
        let taxels = u32::try_from(pair.compressive.taxels()).unwrap_or(u32::MAX);
        let profile = match &asked.predictor {
            Predictor::Profile(profile) => profile.as_ref().clone(),
            Predictor::Others => {
                let others: Vec<SessionEstimates> = sessions
                    .iter()
                    .enumerate()
                    .filter(|(other, _)| *other != k)
                    .map(|(_, s)| s.clone())
                    .collect();
                if others.is_empty() {
                    return Err(ReplayError::NoOthers {
                        session: pair.session.clone(),
                    });
                }
                fitted_profile(&FittedReadout::of(&others), taxels)?.0
            }
        };
        let blocks = compared_presses(pair)?;
        let real = SessionEstimates::of(pair, &pair.compressive, &blocks).ok_or_else(|| unfit(pair))?;
        let twin = |draw: u64| -> Result<SessionEstimates, ReplayError> {
            let recording = twin_of(pair, images, (&sessions[k], &profile), streams, draw)?;
            done();
            SessionEstimates::of(pair, &recording, &blocks).ok_or_else(|| unfit(pair))
        };
        let twins: Vec<SessionEstimates> = (0..asked.draws).into_par_iter().map(twin).collect::<Result<_, _>>()?;
        for name in COMPARED_NAMES {
            let Some(value) = value_of(&real, name) else { continue };
            let drawn: Vec<f64> = twins.iter().filter_map(|twin| value_of(twin, name)).collect();
            let Some((low, high)) = predicted(&drawn).filter(|_| drawn.len() > 1) else {
                continue;
            };
            rows.push(PredictedStatistic {
                session: pair.session.clone(),
                name,
                real: value,
                twin: drawn.iter().sum::<f64>() / drawn.len() as f64,
                low,
                high,
                inside: (low..=high).contains(&value),
            });
        }
    }
    Ok(rows)
}
