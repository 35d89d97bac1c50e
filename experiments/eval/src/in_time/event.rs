//! Contacts to be tracked: samples, scored moments, and ground truth.

use super::tally::Moment;
use crate::chunk::Chunk;
use crate::place::{RecordedBounce, contact_image, find_bounces, touch_of};
use crate::session::ScoredSession;
use crate::untouched::Untouched;
use crate::windows::Press;
use spts_circuit::Recording;
use spts_recon::localise::centre_of_mass;
use spts_recon::metrics::{SUPPORT_THRESHOLD, support};

/// Times after the touch at which presses are scored, s.
const PRESS_S: [f64; 8] = [0.001, 0.002, 0.004, 0.008, 0.016, 0.032, 0.064, 0.128];
/// The same of drops.
const DROP_S: [f64; 6] = [0.001, 0.002, 0.004, 0.006, 0.008, 0.012];
/// Contacts are followed from so long before the touch on, s: several times the memory of the strength.
const LEAD_S: f64 = 0.01;
/// The noise of the wire is that of the samples in this span before the touch, s.
const IDLE_S: [f64; 2] = [0.06, 0.008];
/// Samples after a window that its true image is fitted to, for every taxel. The error of an image of L samples is
/// √(N/(L − N)) of the noise of a sample over √N.
const TRUTH_PER_TAXEL: usize = 7;

/// A contact that is followed.
pub(crate) struct FollowedContact {
    /// Samples from before the touch on.
    pub(super) press: Press,
    /// Sample of the touch.
    pub(super) touch: usize,
    pub(super) rate_hz: f64,
    pub(super) idle_noise_v: f64,
    pub(super) moments: Vec<ScoredMoment>,
}

/// When an image is scored, and against what.
pub(super) struct ScoredMoment {
    pub(super) at: Moment,
    /// The last window ends with this sample or before it.
    pub(super) end: usize,
    pub(super) support: Vec<bool>,
    /// True position of a ball.
    pub(super) centre: Option<[f64; 2]>,
}

pub(super) fn samples(time_s: f64, rate_hz: f64) -> usize {
    #[expect(clippy::cast_possible_truncation, reason = "casts saturate")]
    let count = (time_s * rate_hz).round().max(0.0) as usize;
    count
}

/// Root mean square of the samples before the one with the number `touch`, V; 0 where there is none.
pub(super) fn idle_noise(recording: &Recording, block: usize, untouched: &Untouched, touch: usize) -> f64 {
    let [from, to] = IDLE_S.map(|time_s| touch.saturating_sub(samples(time_s, recording.sample_rate_hz())));
    let y = untouched.without(recording, block, from..to);
    let finite = || y.iter().filter(|v| v.is_finite());
    (finite().map(|v| v * v).sum::<f64>() / finite().count().max(1) as f64).sqrt()
}

fn mask(image: &[f64]) -> Vec<bool> {
    let mut mask = Vec::new();
    support(image, SUPPORT_THRESHOLD, &mut mask);
    mask
}

/// The press of block `block` of `session`, from before its touch to the end of its hold. `None` without a compressive
/// recording, a true image or a touch before the hold.
pub(crate) fn press(session: &ScoredSession, block: usize) -> Option<FollowedContact> {
    let recording = session.compressive.as_ref()?;
    let truth = session.truth(block)?;
    let touch = touch_of(recording, block)?;
    let (rate_hz, per_frame) = (recording.sample_rate_hz(), recording.measurements_per_frame());
    let protocol = &session.protocol;
    let hold = protocol.first_frame..(protocol.first_frame + protocol.frames).min(recording.frames());
    if touch.start >= hold.start * per_frame {
        return None;
    }
    let first = touch.start.saturating_sub(samples(LEAD_S, rate_hz));
    let untouched = &touch.untouched;
    let rises = PRESS_S.iter().filter_map(|&time_s| {
        let end = touch.start + samples(time_s, rate_hz);
        let len = TRUTH_PER_TAXEL * recording.taxels();
        if end + len > hold.start * per_frame {
            return None;
        }
        let mut image = Chunk::new(recording, block, end, len).fit(0)?.image;
        if let Some(idle) = &untouched.image {
            image.iter_mut().zip(idle).for_each(|(x, idle)| *x -= idle);
        }
        Some(ScoredMoment {
            at: Moment::After(time_s),
            end: end - first,
            support: mask(&image),
            centre: None,
        })
    });
    let mut moments: Vec<ScoredMoment> = rises.collect();
    let held = hold.clone().step_by(protocol.support_stride.max(1)).skip(1);
    moments.extend(held.map(|frame| ScoredMoment {
        at: Moment::Hold,
        end: frame * per_frame - first,
        support: truth.support.clone(),
        centre: None,
    }));
    let end = moments.iter().map(|moment| first + moment.end).max()?;
    Some(FollowedContact {
        press: untouched.press(recording, block, first..end),
        touch: touch.start - first,
        rate_hz,
        idle_noise_v: idle_noise(recording, block, untouched, touch.start),
        moments,
    })
}

/// Drops of a ball on a sheet of `cols` columns, from before the touch to the end of the contact.
pub(crate) fn drops(recording: &Recording, cols: usize) -> Vec<FollowedContact> {
    let bounces = find_bounces(recording);
    bounces
        .iter()
        .filter_map(|bounce| drop(recording, bounce, cols))
        .collect()
}

fn drop(recording: &Recording, bounce: &RecordedBounce, cols: usize) -> Option<FollowedContact> {
    let rate_hz = recording.sample_rate_hz();
    let image = contact_image(recording, bounce)?;
    let centre = centre_of_mass(&image, cols, SUPPORT_THRESHOLD)?;
    let first = bounce.start.saturating_sub(samples(LEAD_S, rate_hz));
    let moments = DROP_S.iter().filter_map(|&time_s| {
        let end = bounce.start + samples(time_s, rate_hz);
        (end <= bounce.end).then(|| ScoredMoment {
            at: Moment::After(time_s),
            end: end - first,
            support: mask(&image),
            centre: Some(centre),
        })
    });
    let untouched = Untouched {
        offset_v: bounce.idle,
        image: None,
    };
    Some(FollowedContact {
        moments: moments.collect(),
        press: untouched.press(recording, bounce.block, first..bounce.end),
        touch: bounce.start - first,
        rate_hz,
        idle_noise_v: idle_noise(recording, bounce.block, &untouched, bounce.start),
    })
}
