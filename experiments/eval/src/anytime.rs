//! Decoders that stop as soon as they are confident enough: how many samples they need, and how often they are right.
//!
//! A decoder that states its confidence after every sample ([`crate::algorithm::Confidence`]) gets the samples of a
//! window one by one. For every wanted confidence it stops at the first sample that reaches it, and its answer there is
//! scored as on the board. The same decoder with a fixed number of samples is the comparison.
//! [`crate::board::TrainedBoard::stops`] trains and provides the windows.

use crate::algorithm::{Belief, Class, Confidence, DecodeError, Subject};
use crate::board::{Entry, TrainedBoard};
use crate::decoders::{TrainedDecoder, no_confidence, short_label};
use crate::scorer::{ScoredPress, Scorer};
use crate::sensing::Sensing;
use crate::table::{Cell, Table, TextTable, fixed};
use crate::tally::{ScoreColumn, bootstrap, support_score, unique};
use crate::windows::Window;
use serde::{Deserialize, Serialize};
use spts::output::{OutputFolder, write_json};
use spts_input::Refusal;
use spts_recon::{StopRule, statistics};

/// Confidences at which decoders stop in `spts score --anytime`.
#[derive(Debug, Clone, PartialEq)]
pub struct StopSettings {
    /// Wanted probabilities of the best class, each in (0.5, 1).
    pub class: Vec<f64>,
    /// Wanted expected intersections over union of the image, each in (0.5, 1).
    pub image: Vec<f64>,
}

impl Default for StopSettings {
    fn default() -> Self {
        Self { class: vec![0.8, 0.9, 0.95, 0.99], image: vec![0.6, 0.7, 0.8] }
    }
}

/// One decoder with one stopping rule.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AnytimeKey {
    /// Algorithm.
    pub decoder: String,
    /// The property to which the confidence refers, and of which `attained` is the score.
    pub subject: Subject,
    /// How the rows of a window are obtained.
    pub sensing: Sensing,
    /// Whether the scored object was excluded from the training data.
    pub left_out: bool,
    /// Training data, named as on the board.
    pub learned_from: String,
    /// Confidence at which the decoder stops; `None` for a fixed number of samples.
    pub confidence: Option<f64>,
}

/// Results of `spts score --anytime` for one decoder and confidence: means over the objects.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AnytimeRow {
    /// Decoder and stopping rule.
    #[serde(flatten)]
    pub key: AnytimeKey,
    /// Largest number of samples in a window.
    pub most: usize,
    /// Scores, means over the objects.
    #[serde(flatten)]
    pub scores: StopScores,
    /// 95 % confidence interval of `samples` over objects, their sessions and presses.
    pub samples_ci: Option<[f64; 2]>,
    /// 95 % confidence interval of `attained`, by the same resampling.
    pub attained_ci: Option<[f64; 2]>,
    /// Number of windows of all objects.
    pub windows: usize,
    /// Number of windows that the algorithm could not process to the end. They count as never confident and wrong.
    pub failed: usize,
    /// Largest [`StopScores::calibration_error`] of an object.
    pub worst_calibration_error: Option<f64>,
    /// What was stated and what was attained, over the windows of all objects.
    pub reliability: Vec<Stated>,
}

/// Windows whose stated confidence lies in one tenth of [0, 1], at the end of the window.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Stated {
    /// Mean of the stated confidences.
    pub stated: f64,
    /// Mean of what was attained: share of right classes, or mean intersection over union.
    pub attained: f64,
    /// Number of windows.
    pub windows: usize,
}

impl Stated {
    /// `parts` joined by the tenth of [0, 1] that was stated, in rising order; tenths without windows are left out.
    pub fn tenths(parts: impl IntoIterator<Item = Self>) -> Vec<Self> {
        let mut tenths = [Self::default(); 10];
        for part in parts {
            let tenth = &mut tenths[(1..10).filter(|tenth| part.stated >= f64::from(*tenth) / 10.0).count()];
            tenth.windows += part.windows;
            let share = part.windows as f64 / (tenth.windows as f64).max(1.0);
            tenth.stated += share * (part.stated - tenth.stated);
            tenth.attained += share * (part.attained - tenth.attained);
        }
        tenths.into_iter().filter(|tenth| tenth.windows > 0).collect()
    }
}

/// Results of `spts score --anytime` for one object, decoder and confidence.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AnytimeObject {
    /// Decoder and stopping rule.
    #[serde(flatten)]
    pub key: AnytimeKey,
    /// Object.
    pub object: String,
    /// Scores.
    #[serde(flatten)]
    pub scores: StopScores,
    /// Number of windows of the object.
    pub windows: usize,
}

/// Results of `spts score --anytime`: how many samples decoders need to be sure, and how often they are right then.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct AnytimeBoard {
    /// Means over the objects.
    pub rows: Vec<AnytimeRow>,
    /// Object by object.
    pub objects: Vec<AnytimeObject>,
}

/// An entry with all ways to end its windows.
struct Stopped<'a> {
    entry: &'a Entry,
    subject: Subject,
    ends: Vec<End>,
}

impl TrainedBoard<'_> {
    /// Scores decoders that stop when they are confident as `settings` want. `done` is called after every press.
    ///
    /// # Errors
    /// [`Refusal`]; in particular for a decoder that states no confidence.
    pub fn stops(&self, settings: &StopSettings, done: &(dyn Fn() + Sync)) -> Result<AnytimeBoard, Refusal> {
        let stopped = self.stopped(settings)?;
        let slots = stopped.iter().map(|stopped| stopped.ends.len()).sum();
        let stops = self.run.each_press(slots, done, |session, block| self.press(&stopped, session, block))?;
        let each = stopped.iter().flat_map(|stopped| stopped.ends.iter().map(move |end| (stopped, end)));
        let mut board = AnytimeBoard::default();
        for ((Stopped { entry, subject, .. }, end), presses) in each.zip(stops) {
            let key = AnytimeKey {
                decoder: entry.name.clone(),
                subject: *subject,
                sensing: entry.sensing,
                left_out: entry.left_out,
                learned_from: entry.learned_from.clone(),
                confidence: match end {
                    End::Sure(rule) => Some(rule.confidence()),
                    End::Fixed(_) => None,
                },
            };
            let scores: Vec<StopScores> = presses.iter().map(pool).collect();
            let errors = scores.iter().filter_map(|s| s.calibration_error);
            let windows = |presses: &[PressStops]| presses.iter().map(|press| press.windows.len()).sum::<usize>();
            let [samples_ci, attained_ci] = intervals(&presses, &self.run.objects());
            board.rows.push(AnytimeRow {
                key: key.clone(),
                most: self.run.most(),
                scores: mean(&scores, &pool(presses.iter().flatten())),
                samples_ci,
                attained_ci,
                windows: presses.iter().map(|presses| windows(presses)).sum(),
                failed: presses.iter().flatten().map(|press| press.failed).sum(),
                worst_calibration_error: errors.reduce(f64::max),
                reliability: reliability(presses.iter().flatten().flat_map(|press| &press.windows)),
            });
            let each = self.run.sessions.iter().zip(&presses).zip(scores);
            board.objects.extend(each.map(|((session, presses), scores)| AnytimeObject {
                key: key.clone(),
                object: session.title().to_owned(),
                scores,
                windows: windows(presses),
            }));
        }
        Ok(board)
    }

    /// The entries that are scored, each with all ways to end a window. Classes are scored where they are known.
    fn stopped(&self, settings: &StopSettings) -> Result<Vec<Stopped<'_>>, Refusal> {
        let mut out = Vec::new();
        for entry in &self.entries {
            let confidence = entry.decoders.first().and_then(|decoder| decoder.trained.confidence());
            let Some((subject, _)) = confidence else {
                return Err(no_confidence(&entry.name));
            };
            let wanted = match subject {
                Subject::Class if !entry.knows_classes => continue,
                Subject::Class => &settings.class,
                Subject::Image => &settings.image,
            };
            let rules = wanted.iter().map(|&confidence| Ok(End::Sure(StopRule::new(confidence, self.run.most())?)));
            let mut ends = rules.collect::<Result<Vec<End>, Refusal>>()?;
            ends.extend(self.run.measurements.iter().map(|m| End::Fixed(*m)));
            out.push(Stopped { entry, subject, ends });
        }
        Ok(out)
    }

    fn press(&self, stopped: &[Stopped<'_>], session: usize, block: usize) -> Result<Vec<PressStops>, Refusal> {
        let scored = self.run.sessions[session];
        let Some(press) = ScoredPress::new(scored, block, &self.run.measurements) else {
            return Ok(Vec::new());
        };
        let press = press.with_numbers()?;
        let entries = stopped.iter().map(|stopped| stopped.entry);
        let classes = |entry: &Entry| {
            let same = stopped.iter().find(|stopped| std::ptr::eq(stopped.entry, entry));
            same.is_some_and(|stopped| stopped.subject == Subject::Class)
        };
        let mut each = stopped.iter();
        let stops = self.run.each_entry(entries, session, &press, classes, |entry, press| {
            let ends = each.next().map_or(&[][..], |stopped| &stopped.ends);
            let label = entry.knows_classes.then_some(scored.label);
            Ok(stops(&entry.decoders[session], press, ends, self.run.most(), label)?)
        })?;
        Ok(stops.concat())
    }
}

/// When a window ends: at a confidence, or after a number of samples.
#[derive(Debug, Clone, Copy, PartialEq)]
enum End {
    Sure(StopRule),
    Fixed(usize),
}

impl End {
    /// Whether a window ends after `samples` with this confidence, and whether the end is the wanted one.
    fn after(self, samples: usize, confidence: f64) -> Option<bool> {
        match self {
            Self::Sure(rule) => rule.after(samples, confidence).map(|stopped| stopped.reached),
            Self::Fixed(m) => (samples == m).then_some(true),
        }
    }
}

/// The truth of a window.
#[derive(Clone, Copy)]
enum Right<'a> {
    Class(usize),
    Support(&'a [bool]),
}

/// What a decoder says about a sample that it cannot use, and from then on.
const LOST: Belief = Belief { confidence: 0.0, class: Some(Class::Unknown) };

/// How the windows of a press of up to `most` samples end, for each of `ends`. `label` is the class, where it is known.
fn stops(
    decoder: &TrainedDecoder,
    scored: &ScoredPress<'_>,
    ends: &[End],
    most: usize,
    label: Option<usize>,
) -> Result<Vec<PressStops>, DecodeError> {
    let mut stops = vec![PressStops::default(); ends.len()];
    let Some((subject, mut confidence)) = decoder.trained.confidence() else {
        return Ok(stops);
    };
    let windows: Vec<(Window<'_>, Right<'_>)> = match (subject, label) {
        (Subject::Image, _) => {
            let (windows, truths) = scored.image_windows(most);
            windows.into_iter().zip(truths).map(|(window, truth)| (window, Right::Support(&truth.support))).collect()
        }
        (Subject::Class, Some(label)) => {
            scored.class_runs(most).into_iter().map(|window| (window, Right::Class(label))).collect()
        }
        (Subject::Class, None) => Vec::new(),
    };
    let mut scorer = Scorer::new(decoder);
    for &(ref window, right) in &windows {
        stop(confidence.as_mut(), &mut scorer, window, ends, right, &mut stops)?;
    }
    Ok(stops)
}

/// Follows one window to each of `ends`, and adds how it ended to `stops`.
fn stop(
    confidence: &mut dyn Confidence,
    scorer: &mut Scorer<'_>,
    window: &Window<'_>,
    ends: &[End],
    right: Right<'_>,
    stops: &mut [PressStops],
) -> Result<(), DecodeError> {
    confidence.begin();
    let mut open: Vec<usize> = (0..ends.len()).collect();
    let mut lost = false;
    for (sample, samples) in window.samples().zip(1..) {
        let belief = match confidence.observe(&sample) {
            _ if lost => LOST,
            Ok(belief) => belief,
            Err(error @ DecodeError::External(_)) => return Err(error),
            Err(_) => {
                lost = true;
                stops.iter_mut().for_each(|stops| stops.failed += 1);
                LOST
            }
        };
        let ended = |end: &usize| Some((*end, ends[*end].after(samples, belief.confidence)?));
        let ended: Vec<(usize, bool)> = open.iter().filter_map(ended).collect();
        if ended.is_empty() {
            continue;
        }
        let attained = attained(scorer, &window.first(samples), belief, right)?;
        for &(end, reached) in &ended {
            stops[end].windows.push(WindowStop { samples, reached, stated: belief.confidence, attained });
        }
        open.retain(|end| ended.iter().all(|(done, _)| done != end));
        if open.is_empty() {
            break;
        }
    }
    Ok(())
}

/// How good the answer is: 1 or 0 for a class, the intersection over union for an image.
fn attained(
    scorer: &mut Scorer<'_>,
    window: &Window<'_>,
    belief: Belief,
    right: Right<'_>,
) -> Result<f64, DecodeError> {
    let truth = match right {
        Right::Class(label) => {
            let found = belief.class.and_then(Class::label);
            return Ok(if found == Some(label) { 1.0 } else { 0.0 });
        }
        Right::Support(truth) => truth,
    };
    let answers = scorer.answers(std::slice::from_ref(window))?;
    Ok(support_score(answers.last().map_or(&[], |answer| &answer.image), truth).iou)
}

/// How one window ended.
#[derive(Debug, Clone, Copy, PartialEq)]
struct WindowStop {
    samples: usize,
    /// Whether the wanted confidence was reached.
    reached: bool,
    /// Confidence at the end.
    stated: f64,
    /// For a class 1 if right and 0 if wrong; for an image the intersection over union.
    attained: f64,
}

/// How the windows of one press ended.
#[derive(Debug, Clone, Default, PartialEq)]
struct PressStops {
    windows: Vec<WindowStop>,
    /// Number of windows that the algorithm could not process.
    failed: usize,
}

/// How many samples a decoder took until it stopped, and how good its answers were.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct StopScores {
    /// Mean number of samples. A window that never reached the wanted confidence counts with all of its samples.
    /// `None`, like all scores, without windows.
    pub samples: Option<f64>,
    /// Median number of samples.
    pub samples_median: Option<f64>,
    /// Number of samples that is sufficient for 90 % of the windows.
    pub samples_p90: Option<f64>,
    /// Score over all windows: share of right classes, or mean intersection over union.
    pub attained: Option<f64>,
    /// Score over the windows that reached the wanted confidence; `None` if none did.
    pub attained_reached: Option<f64>,
    /// Mean final confidence of the windows that reached the wanted one. For a calibrated decoder it equals
    /// `attained_reached`.
    pub stated: Option<f64>,
    /// Share of windows that never reached the wanted confidence.
    pub never: Option<f64>,
    /// Expected calibration error of the confidences at the end of the windows: mean over all windows of |attained −
    /// stated|, both as means over the window's tenth ([`Stated`]). Source: C. Guo, G. Pleiss, Y. Sun, K. Weinberger,
    /// *On calibration of modern neural networks*, ICML 2017.
    pub calibration_error: Option<f64>,
}

/// What was stated and what was attained in each tenth of [0, 1] that has windows.
fn reliability<'a>(windows: impl IntoIterator<Item = &'a WindowStop>) -> Vec<Stated> {
    let each = windows.into_iter();
    Stated::tenths(each.map(|w| Stated { stated: w.stated, attained: w.attained, windows: 1 }))
}

/// Scores of several presses together.
fn pool<'a>(presses: impl IntoIterator<Item = &'a PressStops>) -> StopScores {
    let windows: Vec<&WindowStop> = presses.into_iter().flat_map(|press| &press.windows).collect();
    let mut samples: Vec<usize> = windows.iter().map(|w| w.samples).collect();
    samples.sort_unstable();
    let all = |value: fn(&WindowStop) -> f64| statistics::mean(windows.iter().map(|w| value(w)));
    let reached =
        |value: fn(&WindowStop) -> f64| statistics::mean(windows.iter().filter(|w| w.reached).map(|w| value(w)));
    // the least number that `share`/`of` of them do not exceed
    let quantile = |share: usize, of: usize| {
        let rank = (samples.len() * share).div_ceil(of).max(1);
        samples.get(rank - 1).map(|samples| *samples as f64)
    };
    let tenths = reliability(windows.iter().copied());
    let apart = tenths.iter().map(|t| t.windows as f64 * (t.attained - t.stated).abs());
    StopScores {
        calibration_error: (!windows.is_empty()).then(|| apart.sum::<f64>() / windows.len() as f64),
        samples: all(|w| w.samples as f64),
        samples_median: quantile(1, 2),
        samples_p90: quantile(9, 10),
        attained: all(|w| w.attained),
        attained_reached: reached(|w| w.attained),
        stated: reached(|w| w.stated),
        never: all(|w| if w.reached { 0.0 } else { 1.0 }),
    }
}

/// Means over the objects of their scores, `scores`, with quantiles over the windows of all of them, `all`. What an
/// object has no windows for has no mean; of what was reached, the objects count that reached it.
fn mean(scores: &[StopScores], all: &StopScores) -> StopScores {
    let every = |get: fn(&StopScores) -> Option<f64>| {
        let sum: Option<f64> = scores.iter().map(get).sum();
        sum.filter(|_| !scores.is_empty()).map(|sum| sum / scores.len() as f64)
    };
    let those = |get: fn(&StopScores) -> Option<f64>| statistics::mean(scores.iter().filter_map(get));
    StopScores {
        samples: every(|s| s.samples),
        attained: every(|s| s.attained),
        attained_reached: those(|s| s.attained_reached),
        stated: those(|s| s.stated),
        never: every(|s| s.never),
        calibration_error: every(|s| s.calibration_error),
        ..*all
    }
}

/// 95 % intervals of the means over objects of `samples` and `attained`, see [`bootstrap`].
fn intervals(sessions: &[Vec<PressStops>], objects: &[usize]) -> [Option<[f64; 2]>; 2] {
    // over the windows of a press: samples, attained, number
    let sums = |press: &PressStops| -> [f64; 3] {
        press.windows.iter().fold([0.0; 3], |[samples, attained, count], w| {
            [samples + w.samples as f64, attained + w.attained, count + 1.0]
        })
    };
    let sessions: Vec<Vec<[f64; 3]>> = sessions.iter().map(|presses| presses.iter().map(sums).collect()).collect();
    bootstrap(&sessions, objects, |drawn| {
        let mut means = [(!drawn.is_empty()).then_some(0.0); 2];
        for presses in drawn {
            let mut total = [0.0; 3];
            for sums in presses {
                total.iter_mut().zip(*sums).for_each(|(total, v)| *total += v);
            }
            for (mean, sum) in means.iter_mut().zip(total) {
                let own = (total[2] > 0.0).then(|| sum / total[2] / drawn.len() as f64);
                *mean = mean.zip(own).map(|(mean, own)| mean + own);
            }
        }
        means
    })
}

const SCORES: [ScoreColumn<StopScores>; 8] = [
    ("samples", |s| s.samples),
    ("samples_median", |s| s.samples_median),
    ("samples_p90", |s| s.samples_p90),
    ("attained", |s| s.attained),
    ("attained_reached", |s| s.attained_reached),
    ("stated", |s| s.stated),
    ("never", |s| s.never),
    ("calibration_error", |s| s.calibration_error),
];

/// Writes `anytime.json`, `anytime.csv` and `objects.csv` into the folder `out`.
///
/// # Errors
/// [`Refusal`] if a file cannot be written.
pub fn write(board: &AnytimeBoard, out: &mut OutputFolder) -> Result<(), Refusal> {
    write_json(&out.path("anytime.json"), board)?;
    keyed(Table::new("anytime", &board.rows), |r| &r.key)
        .files(&SCORES, |r| &r.scores)
        .interval("samples", |r| r.samples_ci)
        .interval("attained", |r| r.attained_ci)
        .file("most", |r| r.most)
        .file("windows", |r| r.windows)
        .file("failed", |r| r.failed)
        .file("worst_calibration_error", |r| r.worst_calibration_error)
        .write(out)?;
    keyed(Table::new("objects", &board.objects), |r| &r.key)
        .file("object", |r| &r.object)
        .files(&SCORES, |r| &r.scores)
        .file("windows", |r| r.windows)
        .write(out)
}

fn keyed<'a, R: Copy + 'a>(table: Table<'a, R>, of: impl Fn(R) -> &'a AnytimeKey + Copy + 'a) -> Table<'a, R> {
    table
        .file("decoder", move |r| &of(r).decoder)
        .file("subject", move |r| Cell::name_of(of(r).subject))
        .file("sensing", move |r| of(r).sensing.name())
        .file("left_out", move |r| of(r).left_out)
        .file("learned_from", move |r| &of(r).learned_from)
        .file("confidence", move |r| of(r).confidence)
}

/// The board as tables: classes, then images of known and of left-out objects, then single objects.
pub fn table(board: &AnytimeBoard) -> String {
    let mut out = String::new();
    for (subject, left_out, attained, title) in [
        (Subject::Class, false, "right", "class: stop when the most probable class has the wanted probability"),
        (Subject::Image, false, "IoU", "image, objects that were learned from: stop at the wanted expected IoU"),
        (Subject::Image, true, "IoU", "image, the object was not learned from: stop at the wanted expected IoU"),
    ] {
        let here = |r: &&AnytimeRow| r.key.subject == subject && r.key.left_out == left_out;
        let rows: Vec<&AnytimeRow> = board.rows.iter().filter(here).collect();
        if !rows.is_empty() {
            out.push_str(&format!("\n{title}\n{}", text(rows, attained)));
        }
    }
    out.push_str("\nwanted: confidence at which a window ends, fixed: all windows take as many samples; stated: mean confidence of the windows that reached it; never: share that did not, which count with all of their samples; error: expected calibration error, mean over the objects, and of the worst object\n");
    if board.rows.iter().any(|r| r.key.sensing != Sensing::Random) {
        out.push_str("chosen rows: picked from those of a press for what was learned, before a sample is seen; their order in time is lost\n");
    }
    out.push_str(&objects(board));
    out.trim().to_owned()
}

fn text(rows: Vec<&AnytimeRow>, attained: &str) -> String {
    let failed = rows.iter().any(|r| r.failed > 0);
    let fixed = |r: &AnytimeRow, value: Option<f64>| value.filter(|_| r.key.confidence.is_none());
    let sure = |r: &AnytimeRow, value: Option<f64>| value.filter(|_| r.key.confidence.is_some());
    let mut table = Table::new("", rows)
        .shown("decoder", |r: &AnytimeRow| short_label(&r.key.decoder))
        .shown("learned", |r| &r.key.learned_from)
        .shown("rows", |r| r.key.sensing.name())
        .shown("wanted", |r| wanted(&r.key))
        .number("samples", 2, |r| r.scores.samples)
        .shown("(95 %)", |r| Cell::span(r.samples_ci, 1))
        .number("median", 0, |r| r.scores.samples_median)
        .number("90 %", 0, |r| r.scores.samples_p90)
        .number(attained, 3, |r| r.scores.attained)
        .shown("(95 %)", |r| Cell::span(r.attained_ci, 3))
        .number("stated", 3, |r| r.scores.stated)
        .number("never", 3, move |r| sure(r, r.scores.never))
        .number("error", 3, move |r| fixed(r, r.scores.calibration_error))
        .number("worst", 3, move |r| fixed(r, r.worst_calibration_error));
    if failed {
        table = table.shown("", |r| match r.failed {
            0 => String::new(),
            failed => format!("({failed} windows failed)"),
        });
    }
    table.text()
}

fn wanted(key: &AnytimeKey) -> String {
    key.confidence.map_or_else(|| "fixed".to_owned(), |c| format!("{c}"))
}

/// Samples and scores, object by object, of the windows that end at a confidence.
fn objects(board: &AnytimeBoard) -> String {
    let names = unique(board.objects.iter().map(|row| row.object.as_str()));
    let rows: Vec<&AnytimeRow> = board.rows.iter().filter(|r| r.key.confidence.is_some()).collect();
    if names.len() < 2 || rows.is_empty() {
        return String::new();
    }
    let line = |AnytimeRow { key, .. }: &AnytimeRow| {
        let learned = if key.left_out { "left out" } else { &key.learned_from };
        // whatever the two are confident of
        let same = |o: &&AnytimeObject| AnytimeKey { subject: key.subject, ..o.key.clone() } == *key;
        let cells = board.objects.iter().filter(same);
        let cells = cells.map(|o| format!("{}/{}", fixed(o.scores.samples, 1), fixed(o.scores.attained, 3)));
        let head = [short_label(&key.decoder), learned, key.sensing.name()].map(str::to_owned);
        head.into_iter().chain([wanted(key)]).chain(cells).collect()
    };
    let head = ["decoder", "learned", "rows", "wanted"].into_iter().chain(names);
    let table = TextTable::new(head, rows.into_iter().map(line));
    format!("\nobject by object: samples / attained\n{table}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::algorithm::{Algorithm, Answer, Trained};
    use crate::training::TrainingData;
    use crate::windows::{Press, PressRows};
    use spts_models::Streams;
    use spts_recon::Matrix;
    use std::sync::Arc;

    /// States the samples as its confidence, and the number of samples since the start of the window as its class. It
    /// cannot use a sample below zero.
    #[derive(Debug, Clone, Default)]
    struct Told(usize);

    impl Trained for Told {
        fn start(&self) -> Box<dyn Algorithm + '_> {
            Box::new(self.clone())
        }
        fn confidence(&self) -> Option<(Subject, Box<dyn Confidence + '_>)> {
            Some((Subject::Class, Box::new(self.clone())))
        }
    }

    impl Algorithm for Told {
        fn decode(&mut self, _: &Window<'_>, _: &mut Answer) -> Result<(), DecodeError> {
            Ok(())
        }
    }

    impl Confidence for Told {
        fn begin(&mut self) {
            self.0 = 0;
        }
        fn observe(&mut self, sample: &Window<'_>) -> Result<Belief, DecodeError> {
            assert_eq!((sample.y.len(), sample.phi.nrows()), (1, 1));
            self.0 += 1;
            if sample.y[0] < 0.0 {
                return Err(Refusal::new("lost").into());
            }
            Ok(Belief { confidence: sample.y[0], class: Some(Class::Known(self.0)) })
        }
    }

    /// The same window twice.
    fn stopped(y: &[f64], label: usize) -> Vec<PressStops> {
        let images = Matrix::from_column_slices(2, &[[1.0, 0.0]]);
        let data = TrainingData::of_images(images, &[1], 2, Streams::new(1)).unwrap();
        let decoder = TrainedDecoder::of(Arc::new(Told::default()), &data);
        let (mut told, mut scorer) = (Told::default(), Scorer::new(&decoder));
        let rows = PressRows::of_matrix(&Matrix::from_rows(y.len(), 2, vec![1.0; 2 * y.len()]).unwrap());
        let press = Press::on(Arc::new(rows), y.to_vec(), 0.0);
        let rule = |confidence| End::Sure(StopRule::new(confidence, y.len()).unwrap());
        let ends = [rule(0.8), rule(0.9), End::Fixed(3)];
        let mut stops = vec![PressStops::default(); ends.len()];
        for _ in 0..2 {
            let window = press.window(0, y.len()).unwrap();
            stop(&mut told, &mut scorer, &window, &ends, Right::Class(label), &mut stops).unwrap();
        }
        stops
    }

    #[test]
    fn a_window_ends_at_the_first_sample_that_is_sure_and_never_when_it_is_lost() {
        let stops = stopped(&[0.6, 0.85, 0.1, 0.7], 2);
        let seen = |stops: &PressStops| stops.windows.iter().map(|w| (w.samples, w.reached)).collect::<Vec<_>>();
        assert_eq!(seen(&stops[0]), [(2, true); 2]);
        assert_eq!(seen(&stops[1]), [(4, false); 2]);
        assert_eq!(seen(&stops[2]), [(3, true); 2]);
        let attained: Vec<f64> = stops.iter().map(|s| s.windows[0].attained).collect();
        assert!(attained[0] > 0.5 && attained[1] < 0.5 && attained[2] < 0.5, "{attained:?}");

        let stops = stopped(&[0.6, -1.0, 0.99, 0.99], 3);
        for stops in &stops {
            assert_eq!(stops.failed, 2);
            assert!(stops.windows.iter().all(|w| w.attained < 0.5 && w.stated < 0.5));
        }
        assert_eq!(seen(&stops[0]), [(4, false); 2]);
    }

    fn press(windows: &[(usize, bool, f64)]) -> PressStops {
        let window =
            |&(samples, reached, attained): &(usize, bool, f64)| WindowStop { samples, reached, stated: 0.9, attained };
        PressStops { windows: windows.iter().map(window).collect(), failed: 0 }
    }

    #[test]
    fn scores_of_windows_and_objects_by_hand() {
        let near = |found: Option<f64>, expected: f64| found.is_some_and(|found| (found - expected).abs() < 1e-12);
        let mut windows: Vec<(usize, bool, f64)> = (1..=9).map(|k| (k, true, 1.0)).collect();
        windows.push((100, false, 0.0));
        let scores = pool([&press(&windows)]);
        assert!(near(scores.samples, 14.5) && near(scores.samples_median, 5.0) && near(scores.samples_p90, 9.0));
        assert!(near(scores.attained, 0.9) && near(scores.attained_reached, 1.0) && near(scores.never, 0.1));
        assert!(near(scores.stated, 0.9) && near(scores.calibration_error, 0.0));
        // a tenth that promises too much, and one that promises too little
        let [low, high] = [(0.25, 0.0), (0.75, 1.0)].map(|(stated, attained)| WindowStop {
            samples: 1,
            reached: true,
            stated,
            attained,
        });
        let both = PressStops { windows: vec![low, high, high, high], failed: 0 };
        assert!(near(pool([&both]).calibration_error, 0.25));
        let tenths = reliability(&both.windows);
        assert_eq!(tenths.iter().map(|t| t.windows).collect::<Vec<_>>(), [1, 3]);
        assert!(near(Some(tenths[1].stated), 0.75) && near(Some(tenths[1].attained), 1.0));
        assert_eq!(pool([&PressStops::default()]), StopScores::default());

        // objects count alike, however many windows they have
        let (few, many) = (press(&[(10, true, 1.0)]), press(&[(2, true, 0.5); 7]));
        let all = pool([&few, &many]);
        let mean = mean(&[pool([&few]), pool([&many])], &all);
        assert!(near(mean.samples, 6.0) && near(mean.attained, 0.75) && near(mean.samples_median, 2.0));
        let [samples, attained] = intervals(&[vec![few], vec![many]], &[0, 1]);
        // of two objects, one draw in four has the first twice, and one the second
        assert_eq!((samples, attained), (Some([2.0, 10.0]), Some([0.5, 1.0])));
        assert_eq!(intervals(&[], &[]), [None, None]);
        assert_eq!(super::mean(&[], &all).samples, None);
    }
}
