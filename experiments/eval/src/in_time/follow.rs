//! Contacts that are followed in time: their samples, scored moments and ground truth, the scores, and images at chosen
//! instants for a moving picture.

use crate::algorithm::DecodeError;
use crate::chunk::Chunk;
use crate::decode::{no_recording, too_many, untrained};
use crate::decoders::{TrainedDecoder, find};
use crate::place::{RecordedBounce, contact_image, find_bounces, touch_of};
use crate::scorer::Scorer;
use crate::session::ScoredSession;
use crate::tally::bootstrap;
use crate::training::TrainingData;
use crate::windows::{Press, Untouched};
use serde::{Deserialize, Serialize};
use spts::Session;
use spts::session::Event;
use spts_circuit::Recording;
use spts_input::Refusal;
use spts_models::Streams;
use spts_recon::localise::{centre_of_mass, distance};
use spts_recon::metrics::{SUPPORT_THRESHOLD, SupportScore, support};
use spts_recon::recover::{Gaussian, Motion, TrackedImage};
use spts_recon::statistics::mean;
use std::ops::Range;
use std::sync::Arc;

/// Time in which the shape of a contact is forgotten, s. Chosen on single presses of the recordings, among 3 to 300 ms:
/// the scores are flat from 10 to 100 ms. A ball is on the skin for 8 to 15 ms.
pub(super) const MEMORY_S: f64 = 0.02;
/// Time over which the strength of a contact is averaged, s; a hundred samples of the published skin.
pub(super) const STRENGTH_MEMORY_S: f64 = 0.0015;
/// Noise that grows with the contact, as a share of the samples' root mean square: that of `nn_lmmse`.
const NOISE: f64 = 0.12;

/// How contacts move, in samples at `rate_hz`, on a wire with this noise without a contact, V.
fn motion(rate_hz: f64, idle_noise_v: f64) -> Motion {
    Motion {
        memory: MEMORY_S * rate_hz,
        strength_memory: STRENGTH_MEMORY_S * rate_hz,
        noise: NOISE,
        idle_noise: idle_noise_v,
    }
}

/// What is scored of one contact, moment by moment.
pub(crate) type Followed = Vec<(Moment, Compared)>;

/// Follows `contact` on a sheet of `cols` columns by windows of `m` samples, with `decoder` for windows alone and
/// `prior`, its own, in time.
///
/// # Errors
/// [`DecodeError`] when a window cannot be followed.
pub(crate) fn follow(
    contact: &FollowedContact,
    decoder: &TrainedDecoder,
    prior: &Arc<Gaussian>,
    m: usize,
    cols: usize,
) -> Result<Followed, DecodeError> {
    let mut image = TrackedImage::new(Arc::clone(prior), motion(contact.rate_hz, contact.idle_noise_v))?;
    let mut scorer = Scorer::new(decoder);
    let mut followed = Followed::new();
    let taxels = prior.mean().len();
    // windows follow each other, one of them from the touch on
    let mut start = contact.touch % m;
    let mut last = start;
    let mut moments = contact.moments.iter().peekable();
    while let Some(moment) = moments.peek() {
        if start + m > moment.end {
            let moment = moments.next().filter(|_| start >= m);
            // the window that ends here, unless one of its samples was lost
            let Some((moment, window)) = moment.and_then(|at| Some((at, contact.press.window(start - m, m)?))) else {
                continue;
            };
            let long = contact.press.window(start.saturating_sub(taxels), taxels.min(start));
            let windows = [Some(window), long.filter(|_| m < taxels)];
            let mut scores = [None; 3];
            for (score, window) in scores.iter_mut().zip(windows) {
                let Some(window) = window else { continue };
                let answers = scorer.answers(std::slice::from_ref(&window))?;
                *score = answers.first().map(|answer| one(&answer.image, moment, cols));
            }
            scores[2] = Some(one(image.image(), moment, cols));
            followed.push((moment.at, Compared { scores }));
            continue;
        }
        if let Some(window) = contact.press.window(start, m) {
            image.observe((start + m - last) as f64, window.phi, window.y)?;
            last = start + m;
        }
        start += m;
    }
    Ok(followed)
}

/// Intersection over union of the support of `image`, and the distance of its centre from the true one, px.
fn one(image: &[f64], moment: &crate::in_time::follow::ScoredMoment, cols: usize) -> (f64, Option<f64>) {
    let mut found = Vec::new();
    support(image, SUPPORT_THRESHOLD, &mut found);
    let error_px = moment.centre.map(|truth| {
        let rows = image.len() / cols.max(1);
        let middle = [rows, cols].map(|n| n.saturating_sub(1) as f64 / 2.0);
        distance(centre_of_mass(image, cols, SUPPORT_THRESHOLD).unwrap_or(middle), truth)
    });
    (SupportScore::new(&found, &moment.support).iou, error_px)
}

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

/// When an image is scored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Moment {
    /// This long after the touch, s.
    After(f64),
    /// While the contact is steady.
    Hold,
}

impl Moment {
    /// Time since the touch, s; `None` for the hold.
    pub(crate) fn since_touch_s(self) -> Option<f64> {
        match self {
            Self::After(time_s) => Some(time_s),
            Self::Hold => None,
        }
    }
}

/// Intersection over union and, for a ball, distance of its place, px: of the last window alone, of a longer window and
/// in time.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Compared {
    pub(super) scores: [Option<(f64, Option<f64>)>; 3],
}

/// 95 % interval.
pub type Interval = Option<[f64; 2]>;

/// Scores at one moment: of the last window alone, of a longer window with as many samples as taxels, and with
/// tracking. Intervals are 95 % confidence intervals, by resampling presses or drops. `None` where nothing was scored.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct InTimeScores {
    /// Mean intersection over union of the last window alone.
    pub iou_alone: Option<f64>,
    /// Its interval.
    pub iou_alone_ci: Interval,
    /// Mean intersection over union of the longer window.
    pub iou_longer: Option<f64>,
    /// Mean intersection over union with tracking.
    pub iou_in_time: Option<f64>,
    /// Its interval.
    pub iou_in_time_ci: Interval,
    /// Mean of the differences between tracking and the last window alone.
    pub iou_gain: Option<f64>,
    /// Its interval.
    pub iou_gain_ci: Interval,
    /// For drops: mean distance of the image's centre from the true one, of the last window alone, taxels.
    pub error_alone_px: Option<f64>,
    /// Mean distance of the longer window, taxels.
    pub error_longer_px: Option<f64>,
    /// Mean distance with tracking, taxels.
    pub error_in_time_px: Option<f64>,
    /// Mean distance with tracking minus that of the last window alone, taxels; negative is better.
    pub error_gain_px: Option<f64>,
    /// Its interval.
    pub error_gain_ci: Interval,
}

/// Sum and count of the six numbers of [`Compared`] and the two differences, of one contact.
type Sums = [[f64; 2]; 8];

fn sums(followed: &Followed, at: Moment) -> Sums {
    let mut sums = [[0.0; 2]; 8];
    for (_, compared) in followed.iter().filter(|(moment, _)| *moment == at) {
        let [alone, longer, in_time] = compared.scores;
        let iou = [alone, longer, in_time].map(|score| score.map(|s| s.0));
        let error = [alone, longer, in_time].map(|score| score.and_then(|s| s.1));
        let less = |[alone, _, in_time]: [Option<f64>; 3]| Some(in_time? - alone?);
        let all = [
            iou[0],
            iou[1],
            iou[2],
            less(iou),
            error[0],
            error[1],
            error[2],
            less(error),
        ];
        for (sum, value) in sums.iter_mut().zip(all) {
            if let Some(value) = value {
                *sum = [sum[0] + value, sum[1] + 1.0];
            }
        }
    }
    sums
}

/// Means over the objects of their means; an object without a value has no say.
fn means(objects: &[Vec<&Sums>]) -> [Option<f64>; 8] {
    std::array::from_fn(|k| {
        let each = objects.iter().filter_map(|contacts| {
            let [sum, count] = contacts.iter().fold([0.0; 2], |[s, n], c| [s + c[k][0], n + c[k][1]]);
            (count > 0.0).then(|| sum / count)
        });
        mean(each)
    })
}

/// Scores at the moment `at` of the contacts of every object, and how many contacts have them.
pub(crate) fn scores(objects: &[Vec<&Followed>], at: Moment) -> (InTimeScores, usize) {
    let objects = objects.iter().map(|contacts| {
        let sums = contacts.iter().map(|followed| sums(followed, at));
        sums.filter(|s| s[2][1] > 0.0).collect()
    });
    let mut objects: Vec<Vec<Sums>> = objects.collect();
    objects.retain(|contacts| !contacts.is_empty());
    let all: Vec<Vec<&Sums>> = objects.iter().map(|contacts| contacts.iter().collect()).collect();
    let m = means(&all);
    let ci = bootstrap(&objects, Streams::new(1), |drawn| {
        let m = means(drawn);
        [m[0], m[2], m[3]]
    });
    let error_ci = bootstrap(&objects, Streams::new(1), |drawn| [means(drawn)[7]]);
    let scores = InTimeScores {
        iou_alone: m[0],
        iou_alone_ci: ci[0],
        iou_longer: m[1],
        iou_in_time: m[2],
        iou_in_time_ci: ci[1],
        iou_gain: m[3],
        iou_gain_ci: ci[2],
        error_alone_px: m[4],
        error_longer_px: m[5],
        error_in_time_px: m[6],
        error_gain_px: m[7],
        error_gain_ci: error_ci[0],
    };
    (scores, objects.iter().map(Vec::len).sum())
}

/// The decoder whose prior is followed: it knows no object.
const IMAGES_DECODER: &str = "nn_lmmse";
/// Time before the first instant from which on samples are taken, s.
const IMAGES_LEAD_S: f64 = 0.003;
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
/// [`Refusal`] when there is no such recording, or it cannot be followed.
pub fn followed_images(
    session: &Session,
    block: usize,
    training: &TrainingData,
    m: usize,
    ends: &[usize],
) -> Result<Vec<FollowedImage>, Refusal> {
    let without = || no_recording(session);
    let recording = session.compressive().ok_or_else(without)?;
    let samples_there = recording.blocks().get(block).ok_or_else(without)?.volts.len();
    let (first, last) = (ends.first().copied().unwrap_or(0), ends.last().copied().unwrap_or(0));
    if m == 0 || last > samples_there {
        return Err(too_many(session, m, 1, [last.min(samples_there), samples_there]));
    }
    let rate_hz = recording.sample_rate_hz();
    let from = first.saturating_sub(samples(IMAGES_LEAD_S, rate_hz).max(m));
    let untouched = idle_skin(session, recording, block);
    let press = untouched.press(recording, block, from..last);
    let noise_v = idle_noise(recording, block, &untouched, first);
    let prior = find(IMAGES_DECODER).map(|spec| (spec.train)(training));
    let prior = prior.transpose().map_err(|e| untrained(IMAGES_DECODER, e))?;
    let Some(prior) = prior.and_then(|trained| trained.prior()) else {
        return Err(without());
    };
    let mut image = TrackedImage::new(prior, motion(rate_hz, noise_v))?;
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
                image.observe(elapsed, samples.phi, samples.y)?;
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
fn idle_skin(session: &Session, recording: &Recording, block: usize) -> Untouched {
    let touch = match session.event {
        Event::Touch => touch_of(recording, block),
        Event::Press | Event::Drop => None,
    };
    let preloaded = touch.filter(|touch| touch.untouched.image.is_some());
    preloaded.map_or_else(|| Untouched::of(recording, block), |touch| touch.untouched)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn followed(ious: &[(f64, f64)]) -> Followed {
        let each = ious.iter().map(|&(alone, in_time)| {
            let scores = [Some((alone, None)), None, Some((in_time, None))];
            (Moment::Hold, Compared { scores })
        });
        each.collect()
    }

    /// Objects count alike, and so do the contacts that an interval draws; moments that nobody has are empty.
    #[test]
    fn objects_count_alike() {
        let (few, many) = (followed(&[(0.2, 0.8)]), followed(&[(0.6, 0.6); 9]));
        let (found, contacts) = scores(&[vec![&few], vec![&many]], Moment::Hold);
        let near = |found: Option<f64>, value: f64| found.is_some_and(|found| (found - value).abs() < 1e-12);
        assert!(near(found.iou_alone, 0.4) && near(found.iou_in_time, 0.7) && near(found.iou_gain, 0.3));
        assert!(
            found
                .iou_gain_ci
                .is_some_and(|ci| ci.iter().all(|v| near(Some(*v), 0.3)))
        );
        assert_eq!((contacts, found.iou_longer, found.error_gain_px), (2, None, None));
        let (nothing, contacts) = scores(&[vec![&few]], Moment::After(0.001));
        assert_eq!((nothing.iou_alone, contacts), (None, 0));
    }
}
