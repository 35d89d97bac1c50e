//! Images of one block at chosen instants, followed in time: what a moving picture of a contact shows.

use super::event::{idle_noise, samples};
use super::motion;
use crate::algorithm::DecodeError;
use crate::decode::DecodeSessionError;
use crate::decoders::find;
use crate::place::touch_of;
use crate::training::TrainingData;
use crate::untouched::Untouched;
use spts::Session;
use spts::session::Event;
use spts_circuit::Recording;
use spts_recon::recover::TrackedImage;
use std::ops::Range;

/// The decoder whose prior is followed: it knows no object.
const DECODER: &str = "nn_lmmse";
/// Time before the first instant from which on samples are taken, s.
const LEAD_S: f64 = 0.003;
/// Windows between two instants that are taken at most: the last ones.
const WINDOWS: usize = 12;
/// Bound of the work: samples times the square of the number of taxels. About three seconds of one core.
const WORK: f64 = 3e9;

/// The image of a contact that is followed in time, and the window of samples that was taken last for it.
#[derive(Debug, Clone, PartialEq)]
pub struct FollowedImage {
    /// Measurements of the block that were taken last.
    pub window: Range<usize>,
    /// Tactile image, one value a taxel, V. It may have negative values.
    pub image: Vec<f64>,
}

/// Follows block `block` of the compressive recording of `session` by windows of `m` measurements, and gives the image
/// at each of `ends`: ascending numbers of measurements, of which those before are known. Of the later ones only the
/// scatter is used, and in a drop, which has no idle frames, the median as the output of the untouched skin.
/// `training` says what images on a skin of this layout are like.
///
/// Windows with a lost sample are passed over. A skin of many taxels keeps its image for several `ends`, so that the
/// work is bounded.
///
/// # Errors
/// [`DecodeSessionError`] when there is no such recording, or it cannot be followed.
pub fn followed_images(
    session: &Session,
    block: usize,
    training: &TrainingData,
    m: usize,
    ends: &[usize],
) -> Result<Vec<FollowedImage>, DecodeSessionError> {
    let without = || DecodeSessionError::NoRecording {
        session: session.name.clone(),
    };
    let recording = session.compressive().ok_or_else(without)?;
    let samples_there = recording.blocks().get(block).ok_or_else(without)?.volts.len();
    let (first, last) = (ends.first().copied().unwrap_or(0), ends.last().copied().unwrap_or(0));
    if m == 0 || last > samples_there {
        return Err(DecodeSessionError::TooMany {
            session: session.name.clone(),
            m,
            windows: 1,
            start: last.min(samples_there),
            most: samples_there,
        });
    }
    let rate_hz = recording.sample_rate_hz();
    let from = first.saturating_sub(samples(LEAD_S, rate_hz).max(m));
    let untouched = untouched(session, recording, block);
    let press = untouched.press(recording, block, from..last);
    let noise_v = idle_noise(recording, block, &untouched, first);
    let failed = |error| DecodeSessionError::Decode(DecodeError::Refused(error));
    let prior = find(DECODER).map(|spec| (spec.train)(training));
    let prior = prior.transpose().map_err(|source| DecodeSessionError::Training {
        decoder: DECODER,
        source,
    })?;
    let Some(prior) = prior.and_then(|trained| trained.prior()) else {
        return Err(without());
    };
    let mut image = TrackedImage::new(prior, motion(rate_hz, noise_v)).map_err(failed)?;
    let (every, most) = pace(ends.len(), m, recording.taxels());
    let (mut taken, mut window) = (from, first..first);
    let mut images = Vec::with_capacity(ends.len());
    for (k, &end) in ends.iter().enumerate() {
        if k % every == 0 {
            // the last windows that end here
            let count = (end.saturating_sub(taken) / m).min(most);
            for stop in (0..count).rev().map(|back| end - back * m) {
                let start = stop - m;
                let Some(samples) = press.window(start - from, m) else {
                    continue;
                };
                let elapsed = (stop - taken) as f64;
                image.observe(elapsed, samples.phi, samples.y).map_err(failed)?;
                (taken, window) = (stop, start..stop);
            }
        }
        images.push(FollowedImage {
            window: window.clone(),
            image: image.image().to_vec(),
        });
    }
    Ok(images)
}

/// One in how many of `images` is decoded anew, and from how many windows of `m` samples at most.
fn pace(images: usize, m: usize, taxels: usize) -> (usize, usize) {
    let windows = WORK / (images as f64 * m as f64 * (taxels as f64).powi(2)).max(1.0);
    #[expect(clippy::cast_possible_truncation, reason = "casts saturate")]
    let pace = ((1.0 / windows).ceil().max(1.0) as usize, windows.max(1.0) as usize);
    (pace.0, pace.1.min(WINDOWS))
}

/// What the wire shows without a touch.
fn untouched(session: &Session, recording: &Recording, block: usize) -> Untouched {
    let touch = match session.event {
        Event::Touch => touch_of(recording, block),
        Event::Press | Event::Drop => None,
    };
    let preloaded = touch.filter(|touch| touch.untouched.image.is_some());
    preloaded.map_or_else(|| Untouched::of(recording, block), |touch| touch.untouched)
}
