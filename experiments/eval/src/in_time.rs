//! Contacts tracked in time, compared with decoding each window alone: what memory gains while a contact arrives,
//! grows, holds and bounces.
//!
//! A decoder with a Gaussian prior of images ([`crate::algorithm::Trained::prior`]) gets all windows of a press or drop
//! in order, from before the touch on, and keeps their information ([`spts_recon::recover::TrackedImage`]). At set
//! times after the touch its image is scored, together with the decoder's images for the last window alone and for a
//! longer window with as many samples as there are taxels. [`crate::board::TrainedBoard::in_time`] trains the decoders.
//!
//! The true support of a press is that of the least-squares image of the samples after the window, which no decoder has
//! used. Of a simulated press it is that of what the taxels conduct: during the hold, and at every instant where the
//! press was simulated just now (`spts score --twin`). The ground truth of a drop is the least-squares image of the
//! whole contact, as for places; it includes the decoded samples.

use crate::algorithm::DecodeError;
use crate::board::{Entry, TrainedBoard, no_session};
use crate::decode::{no_recording, too_many, untrained};
use crate::decoders::{TrainedDecoder, find, not_in_time, short_label};
use crate::place::{RecordedBounce, beginning_of, contact_image, find_bounces, touch_of};
use crate::protocol::mask;
use crate::scorer::Scorer;
use crate::session::ScoredSession;
use crate::table::{Cell, Table, TextTable, fixed};
use crate::tally::{ScoreColumn, bootstrap, unique};
use crate::training::{SHAPES, TrainingData};
use crate::truth::{MOST_TAXELS, TruthKind, fitted};
use crate::windows::{Press, Untouched};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use spts::Session;
use spts::output::{OutputFolder, write_json};
use spts::session::Event;
use spts_circuit::{Interpolated, Recording};
use spts_input::Refusal;
use spts_recon::localise::{centre_of_mass, distance};
use spts_recon::metrics::{SUPPORT_THRESHOLD, SupportScore};
use spts_recon::recover::{Motion, TrackedImage};
use spts_recon::statistics::mean;
use std::ops::Range;

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

impl TrainedBoard<'_> {
    /// Tracks every scored press, and every drop of the ball, with every decoder and number of measurements. `done` is
    /// called after every press. Drops are not scored when an object is left out, because the ball is not one of the
    /// objects.
    ///
    /// # Errors
    /// [`Refusal`] for a decoder without a Gaussian prior, or if a window cannot be processed.
    pub fn in_time(&self, done: &(dyn Fn() + Sync)) -> Result<InTimeBoard, Refusal> {
        if self.run.sessions.is_empty() && self.source.drops.is_empty() {
            return Err(no_session(self.source));
        }
        let taxels = self.source.layout.taxels();
        if taxels > MOST_TAXELS {
            let problem =
                format!("`taxels` = {taxels}: in time, the truth is fitted on skins of at most {MOST_TAXELS}");
            return Err(Refusal::new(problem));
        }
        for entry in &self.entries {
            if entry.decoders.iter().any(|decoder| decoder.trained.prior().is_none()) {
                return Err(not_in_time(&entry.name));
            }
        }
        let (measurements, cols) = (&self.run.measurements, self.source.layout.cols());
        let all = |contact: &FollowedContact, session: usize| {
            let each = self.run.slots(&self.entries);
            let each = each.map(|(entry, m)| Ok(follow(contact, &entry.decoders[session], m, cols)?));
            each.collect::<Result<Vec<Followed>, Refusal>>()
        };
        let slots = self.entries.len() * measurements.len();
        let pressed = self.run.each_press(slots, done, |session, block| {
            let contact = press(self.run.sessions[session], block);
            contact.map_or_else(|| Ok(Vec::new()), |contact| all(&contact, session))
        })?;
        let recordings = self.source.drops.iter().filter(|_| self.scores_places());
        let balls: Vec<FollowedContact> = recordings.flat_map(|(_, recording)| drops(recording, cols)).collect();
        let dropped = balls.par_iter().map(|contact| all(contact, 0));
        let dropped = dropped.collect::<Result<Vec<_>, Refusal>>()?;
        let mut board = InTimeBoard::default();
        for (at, ((entry, m), objects)) in self.run.slots(&self.entries).zip(&pressed).enumerate() {
            board.rows.extend(lines(entry, ContactKind::Press, m, objects, &self.run.objects()));
            for (session, contacts) in self.run.sessions.iter().zip(objects) {
                let own = lines(entry, ContactKind::Press, m, std::slice::from_ref(contacts), &[0]);
                let object = session.title();
                board.objects.extend(own.into_iter().map(|row| InTimeObject { object: object.to_owned(), row }));
            }
            if !entry.left_out || entry.learned_from == SHAPES {
                let drops: Vec<Followed> = dropped.iter().map(|all| all[at].clone()).collect();
                board.rows.extend(lines(entry, ContactKind::Drop, m, &[drops], &[0]));
            }
        }
        Ok(board)
    }
}

/// A line for every moment that the contacts of the objects have; the hold comes last.
fn lines(
    entry: &Entry,
    contact: ContactKind,
    m: usize,
    sessions: &[Vec<Followed>],
    objects: &[usize],
) -> Vec<InTimeRow> {
    let mut moments: Vec<Moment> = unique(sessions.iter().flatten().flatten().map(|(moment, _)| *moment));
    let time_s = |moment: &Moment| moment.unwrap_or(f64::INFINITY);
    moments.sort_by(|a, b| time_s(a).total_cmp(&time_s(b)));
    let each = moments.into_iter().map(|since_touch_s| {
        let (scores, contacts) = scores(sessions, objects, since_touch_s);
        InTimeRow {
            decoder: entry.name.clone(),
            left_out: entry.left_out,
            learned_from: entry.learned_from.clone(),
            contact,
            m,
            since_touch_s,
            scores,
            contacts,
        }
    });
    each.collect()
}

/// Time in which the shape of a contact is forgotten, s. Chosen on single presses of the recordings, among 3 to 300 ms:
/// the scores are flat from 10 to 100 ms. A ball is on the skin for 8 to 15 ms.
const MEMORY_S: f64 = 0.02;
/// Time over which the strength of a contact is averaged, s; a hundred samples of the published skin.
const STRENGTH_MEMORY_S: f64 = 0.0015;
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

/// Time since the touch, s; `None` for the hold.
type Moment = Option<f64>;

/// Intersection over union, and for a drop the distance of the place in taxels.
type Judged = (f64, Option<f64>);

/// What is scored of one contact, moment by moment: the window alone, a longer one, and in time.
type Followed = Vec<(Moment, [Option<Judged>; 3])>;

/// Follows `contact` on a sheet of `cols` columns by windows of `m` samples, with `decoder` for windows alone and its
/// prior in time.
///
/// # Errors
/// [`DecodeError`] when a window cannot be followed.
fn follow(contact: &FollowedContact, decoder: &TrainedDecoder, m: usize, cols: usize) -> Result<Followed, DecodeError> {
    let prior = decoder.trained.prior().ok_or_else(|| Refusal::new("no Gaussian prior"))?;
    let taxels = prior.mean().len();
    let mut image = TrackedImage::new(prior, motion(contact.rate_hz, contact.idle_noise_v))?;
    let mut scorer = Scorer::new(decoder);
    let mut rows = Vec::new();
    let mut followed = Followed::new();
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
            followed.push((moment.at, scores));
            continue;
        }
        if let Some(window) = contact.press.window(start, m) {
            image.observe((start + m - last) as f64, window.with_rows(&mut rows).phi, window.y)?;
            last = start + m;
        }
        start += m;
    }
    Ok(followed)
}

/// Intersection over union of the support of `image`, and the distance of its centre from the true one, px.
fn one(image: &[f64], moment: &ScoredMoment, cols: usize) -> Judged {
    let error_px = moment.centre.map(|truth| {
        let rows = image.len() / cols.max(1);
        let middle = [rows, cols].map(|n| n.saturating_sub(1) as f64 / 2.0);
        distance(centre_of_mass(image, cols, SUPPORT_THRESHOLD).unwrap_or(middle), truth)
    });
    (SupportScore::new(&mask(image), &moment.support).iou, error_px)
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
struct FollowedContact {
    /// Samples from before the touch on.
    press: Press,
    /// Sample of the touch.
    touch: usize,
    rate_hz: f64,
    idle_noise_v: f64,
    moments: Vec<ScoredMoment>,
}

/// When an image is scored, and against what.
struct ScoredMoment {
    at: Moment,
    /// The last window ends with this sample or before it.
    end: usize,
    support: Vec<bool>,
    /// True position of a ball.
    centre: Option<[f64; 2]>,
}

fn samples(time_s: f64, rate_hz: f64) -> usize {
    #[expect(clippy::cast_possible_truncation, reason = "casts saturate")]
    let count = (time_s * rate_hz).round().max(0.0) as usize;
    count
}

/// Root mean square of the samples before the one with the number `touch`, V; 0 where there is none.
fn idle_noise(recording: &Recording, block: usize, untouched: &Untouched, touch: usize) -> f64 {
    let [from, to] = IDLE_S.map(|time_s| touch.saturating_sub(samples(time_s, recording.sample_rate_hz())));
    let y = untouched.without(recording, block, from..to);
    let finite = || y.iter().filter(|v| v.is_finite());
    (finite().map(|v| v * v).sum::<f64>() / finite().count().max(1) as f64).sqrt()
}

/// The press of block `block` of `session`, from before its touch to the end of its hold. `None` without a compressive
/// recording, a true image or a touch before the hold.
fn press(session: &ScoredSession, block: usize) -> Option<FollowedContact> {
    let recording = session.compressive.as_ref()?;
    let truth = session.truth(block)?;
    let touch = beginning_of(recording, block)?;
    let (rate_hz, per_frame) = (recording.sample_rate_hz(), recording.measurements_per_frame());
    let protocol = &session.protocol;
    let hold = protocol.first_frame..(protocol.first_frame + protocol.frames).min(recording.frames());
    if touch.start >= hold.start * per_frame {
        return None;
    }
    let first = touch.start.saturating_sub(samples(LEAD_S, rate_hz));
    let untouched = &touch.untouched;
    let len = TRUTH_PER_TAXEL * recording.taxels();
    // the support of the samples that follow measurement `end`, up to measurement `last`
    let later = |end: usize, last: usize| {
        let press = (end + len <= last).then(|| untouched.press(recording, block, end..end + len))?;
        Some(fitted(recording, &press)?.support)
    };
    // what the taxels conduct at measurement `end` above the untouched skin
    let course = session.courses.get(block).and_then(Option::as_ref);
    let conducts = |course: &Interpolated, end: usize| {
        let [now, before] = [end, 0].map(|sample| course.at(sample as f64 / rate_hz));
        let above = now.values().iter().zip(before.values()).map(|(now, before)| now - before);
        mask(&above.collect::<Vec<f64>>())
    };
    let rises = PRESS_S.iter().filter_map(|&time_s| {
        let end = touch.start + samples(time_s, rate_hz);
        let support = match course {
            Some(course) => (end < hold.start * per_frame).then(|| conducts(course, end))?,
            None => later(end, hold.start * per_frame)?,
        };
        Some(ScoredMoment { at: Some(time_s), end: end - first, support, centre: None })
    });
    let mut moments: Vec<ScoredMoment> = rises.collect();
    let held = hold.clone().step_by(protocol.support_stride.max(1)).skip(1);
    moments.extend(held.filter_map(|frame| {
        let end = frame * per_frame;
        let support = match truth.kind {
            TruthKind::Press => later(end, hold.end * per_frame)?,
            TruthKind::Simulated | TruthKind::Raster => truth.truth.support.clone(),
        };
        Some(ScoredMoment { at: None, end: end - first, support, centre: None })
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
fn drops(recording: &Recording, cols: usize) -> Vec<FollowedContact> {
    let bounces = find_bounces(recording);
    bounces.iter().filter_map(|bounce| drop(recording, bounce, cols)).collect()
}

fn drop(recording: &Recording, bounce: &RecordedBounce, cols: usize) -> Option<FollowedContact> {
    let rate_hz = recording.sample_rate_hz();
    let image = contact_image(recording, bounce)?;
    let centre = centre_of_mass(&image, cols, SUPPORT_THRESHOLD)?;
    let first = bounce.start.saturating_sub(samples(LEAD_S, rate_hz));
    let moments = DROP_S.iter().filter_map(|&time_s| {
        let end = bounce.start + samples(time_s, rate_hz);
        (end <= bounce.end).then(|| ScoredMoment {
            at: Some(time_s),
            end: end - first,
            support: mask(&image),
            centre: Some(centre),
        })
    });
    let untouched = &bounce.untouched;
    Some(FollowedContact {
        moments: moments.collect(),
        press: untouched.press(recording, bounce.block, first..bounce.end),
        touch: bounce.start - first,
        rate_hz,
        idle_noise_v: idle_noise(recording, bounce.block, untouched, bounce.start),
    })
}

/// 95 % interval.
pub type Interval = Option<[f64; 2]>;

/// Scores at one moment: of the last window alone, of a longer window with as many samples as taxels, and with
/// tracking. Intervals are 95 % confidence intervals, over objects and their presses, or over drops. `None` where
/// nothing was scored.
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

/// Sum and count of three overlaps and their gain, and of three distances and their gain, of one contact.
type Sums = [[f64; 2]; 8];

fn sums(followed: &Followed, at: Moment) -> Sums {
    let mut sums = [[0.0; 2]; 8];
    for (_, scores) in followed.iter().filter(|(moment, _)| *moment == at) {
        let (iou, error) = (scores.map(|s| Some(s?.0)), scores.map(|s| s?.1));
        let gain = |[alone, _, in_time]: [Option<f64>; 3]| Some(in_time? - alone?);
        let all = iou.into_iter().chain([gain(iou)]).chain(error).chain([gain(error)]);
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
fn scores(sessions: &[Vec<Followed>], objects: &[usize], at: Moment) -> (InTimeScores, usize) {
    let each = sessions.iter().zip(objects).map(|(contacts, object)| {
        let sums = contacts.iter().map(|followed| sums(followed, at));
        (sums.filter(|s| s[2][1] > 0.0).collect(), *object)
    });
    let (sessions, objects): (Vec<Vec<Sums>>, Vec<usize>) =
        each.filter(|(contacts, _): &(Vec<Sums>, usize)| !contacts.is_empty()).unzip();
    let all: Vec<Vec<&Sums>> = sessions.iter().map(|contacts| contacts.iter().collect()).collect();
    let m = means(&all);
    let ci = bootstrap(&sessions, &objects, |drawn| {
        let m = means(drawn);
        [m[0], m[2], m[3]]
    });
    let error_ci = bootstrap(&sessions, &objects, |drawn| [means(drawn)[7]]);
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
    (scores, sessions.iter().map(Vec::len).sum())
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
    let mut rows = Vec::new();
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
                image.observe(elapsed, samples.with_rows(&mut rows).phi, samples.y)?;
                (taken, window) = (stop, start..stop);
            }
        }
        images.push(FollowedImage { window: window.clone(), image: image.image().to_vec() });
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

/// Columns of the scores in files.
const SCORES: [ScoreColumn<InTimeScores>; 8] = [
    ("iou_alone", |s| s.iou_alone),
    ("iou_longer", |s| s.iou_longer),
    ("iou_in_time", |s| s.iou_in_time),
    ("iou_gain", |s| s.iou_gain),
    ("error_alone_px", |s| s.error_alone_px),
    ("error_longer_px", |s| s.error_longer_px),
    ("error_in_time_px", |s| s.error_in_time_px),
    ("error_gain_px", |s| s.error_gain_px),
];

/// Writes `in_time.json`, `in_time.csv` and `objects.csv` into the folder `out`.
///
/// # Errors
/// [`Refusal`] if a file cannot be written.
pub fn write(board: &InTimeBoard, out: &mut OutputFolder) -> Result<(), Refusal> {
    write_json(&out.path("in_time.json"), board)?;
    in_files(Table::new("in_time", &board.rows), |row| row).write(out)?;
    let objects = Table::new("objects", &board.objects).file("object", |o| &o.object);
    in_files(objects, |object| &object.row).write(out)
}

fn in_files<'a, R: Copy + 'a>(table: Table<'a, R>, of: impl Fn(R) -> &'a InTimeRow + Copy + 'a) -> Table<'a, R> {
    table
        .file("decoder", move |r| &of(r).decoder)
        .file("left_out", move |r| of(r).left_out)
        .file("learned_from", move |r| &of(r).learned_from)
        .file("contact", move |r| of(r).contact.name())
        .file("m", move |r| of(r).m)
        .file("since_touch_s", move |r| of(r).since_touch_s)
        .files(&SCORES, move |r| &of(r).scores)
        .interval("iou_alone", move |r| of(r).scores.iou_alone_ci)
        .interval("iou_in_time", move |r| of(r).scores.iou_in_time_ci)
        .interval("iou_gain", move |r| of(r).scores.iou_gain_ci)
        .interval("error_gain", move |r| of(r).scores.error_gain_ci)
        .file("contacts", move |r| of(r).contacts)
        .file("memory_s", |_| MEMORY_S)
        .file("strength_memory_s", |_| STRENGTH_MEMORY_S)
}

/// One table for presses and one for drops, with a line for every decoder, number of samples and moment; then objects
/// during the hold and at the first moments of the rise.
pub fn table(board: &InTimeBoard) -> String {
    let mut out = String::new();
    for (kind, title) in [
        (ContactKind::Press, "presses: IoU of windows alone and in time"),
        (ContactKind::Drop, "drops of the ball: IoU, and distance of its place in taxels"),
    ] {
        let rows: Vec<&InTimeRow> = board.rows.iter().filter(|row| row.contact == kind).collect();
        if !rows.is_empty() {
            out.push_str(&format!("\n{title}\n{}", text(&rows, kind)));
        }
    }
    out.push_str(
        "\nalone: the decoder by the last window alone; longer: by as many of the last samples as there are taxels; in \
         time: all windows since before the touch, the older the less\n",
    );
    out.push_str(&objects(board));
    out.trim().to_owned()
}

fn text(rows: &[&InTimeRow], kind: ContactKind) -> String {
    let mut table = Table::new("", rows.iter().copied())
        .shown("decoder", |r: &InTimeRow| short_label(&r.decoder))
        .shown("learned", learned)
        .shown("M", |r| r.m)
        .shown("time", |r| moment(r.since_touch_s))
        .number("alone", 2, |r| r.scores.iou_alone)
        .shown("(95 %)", |r| Cell::span(r.scores.iou_alone_ci, 2))
        .number("longer", 2, |r| r.scores.iou_longer)
        .number("in time", 2, |r| r.scores.iou_in_time)
        .shown("(95 %)", |r| Cell::span(r.scores.iou_in_time_ci, 2))
        .number("gain", 2, |r| r.scores.iou_gain)
        .shown("(95 %)", |r| Cell::span(r.scores.iou_gain_ci, 2));
    if kind == ContactKind::Drop {
        table = table
            .number("alone, px", 2, |r| r.scores.error_alone_px)
            .number("longer, px", 2, |r| r.scores.error_longer_px)
            .number("in time, px", 2, |r| r.scores.error_in_time_px)
            .shown("gain, px (95 %)", |r| Cell::span(r.scores.error_gain_ci, 2));
    }
    table.text()
}

/// Time since the touch, or that the contact is steady.
fn moment(since_touch_s: Option<f64>) -> String {
    since_touch_s.map_or_else(|| "hold".to_owned(), |time_s| format!("{:.0} ms", 1e3 * time_s))
}

fn learned(row: &InTimeRow) -> String {
    let out = if row.left_out { ", out" } else { "" };
    format!("{}{out}", row.learned_from)
}

/// Alone and in time, object by object.
fn objects(board: &InTimeBoard) -> String {
    let names = unique(board.objects.iter().map(|object| object.object.as_str()));
    if names.len() < 2 {
        return String::new();
    }
    let key = |row: &InTimeRow| {
        let way = (row.decoder.clone(), row.learned_from.clone(), row.left_out);
        (way, row.m, row.since_touch_s.map(f64::to_bits))
    };
    let line = |row: &InTimeRow| {
        let cell = |name: &&str| {
            let same = board.objects.iter();
            let same = same.filter(|object| object.object == *name && key(&object.row) == key(row));
            let text = same.map(|object| {
                let s = &object.row.scores;
                let ci = s.iou_in_time_ci;
                let ci = ci.map_or_else(|| "–".to_owned(), |[low, high]| format!("{low:.2}–{high:.2}"));
                format!("{} / {} ({ci})", fixed(s.iou_alone, 2), fixed(s.iou_in_time, 2))
            });
            text.collect::<String>()
        };
        let head = [short_label(&row.decoder).to_owned(), learned(row), row.m.to_string(), moment(row.since_touch_s)];
        head.into_iter().chain(names.iter().map(cell)).collect()
    };
    let presses = board.rows.iter().filter(|row| row.contact == ContactKind::Press);
    let head = ["decoder", "learned", "M", "time"].into_iter().chain(names.iter().copied());
    let table = TextTable::new(head, presses.map(line));
    format!("\nobject by object: alone / in time (95 %)\n{table}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn followed(ious: &[(f64, f64)]) -> Followed {
        let each = ious.iter().map(|&(alone, in_time)| (None, [Some((alone, None)), None, Some((in_time, None))]));
        each.collect()
    }

    /// Objects count alike, and intervals are over objects; moments that nobody has are empty.
    #[test]
    fn objects_count_alike() {
        let (few, many) = (followed(&[(0.2, 0.8)]), followed(&[(0.6, 0.6); 9]));
        let (found, contacts) = scores(&[vec![few.clone()], vec![many]], &[0, 1], None);
        let near = |found: Option<f64>, value: f64| found.is_some_and(|found| (found - value).abs() < 1e-12);
        assert!(near(found.iou_alone, 0.4) && near(found.iou_in_time, 0.7) && near(found.iou_gain, 0.3));
        // of two objects, one draw in four has the first twice, and one the second
        assert!(found.iou_gain_ci.is_some_and(|[low, high]| near(Some(low), 0.0) && near(Some(high), 0.6)));
        assert_eq!((contacts, found.iou_longer, found.error_gain_px), (2, None, None));
        let (nothing, contacts) = scores(&[vec![few]], &[0], Some(0.001));
        assert_eq!((nothing.iou_alone, contacts), (None, 0));
    }
}
