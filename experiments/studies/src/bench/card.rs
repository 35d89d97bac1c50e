//! What an entrant has got: the card that it leaves, and how two cards compare.

use super::run::SKIPPED;
use super::tasks::Released;
use super::{SUITE, Subject, Task, Track, task_named};
use serde::{Deserialize, Serialize};
use spts_input::Refusal;
use spts_recon::statistics::mean;

/// A mean with its 95 % interval over skins and touches.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// Mean.
    pub mean: f64,
    /// 2.5th percentile.
    pub low: f64,
    /// 97.5th percentile.
    pub high: f64,
}

impl Interval {
    /// Whether it is one, in [0, `most`].
    fn is_within(&self, most: f64) -> bool {
        let Self { mean, low, high } = *self;
        0.0 <= low && low <= mean + ROUNDED && mean <= high + ROUNDED && high <= most + ROUNDED
    }
}

/// The interval of `drawn` about `mean`.
pub(super) fn spread(mean: f64, mut drawn: Vec<f64>) -> Interval {
    drawn.sort_unstable_by(f64::total_cmp);
    let last = drawn.len().saturating_sub(1);
    let at = |k: usize| drawn.get(k).copied().unwrap_or(mean);
    Interval { mean, low: at(last / 40), high: at(last - last / 40) }
}

/// One task with answers of so many measurements.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// Measurements for an answer.
    pub measurements: usize,
    /// Mean score: intersection over union, or the share of right classes or places.
    pub score: Interval,
}

/// An entrant on one task.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TaskCard {
    /// Name.
    pub task: String,
    /// What is scored.
    pub subject: Subject,
    /// SHA-256 of the touches.
    pub data_sha256: String,
    /// Touches that are scored.
    pub touches: usize,
    /// Score of an answer by all there is to measure.
    pub ceiling: f64,
    /// Score of an answer that measures nothing.
    pub floor: f64,
    /// Scores, one for every number of measurements.
    pub entries: Vec<Entry>,
    /// 100 · (score − floor) / (ceiling − floor), in [0, 100], mean over the numbers of measurements.
    pub points: Interval,
    /// The object, or the family of shapes, with the least mean score over all numbers of measurements, and that score.
    #[serde(default)]
    pub worst: Option<(String, f64)>,
    /// Why the entrant has no answer to this task; its points are 0.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub refused: Option<String>,
}

impl TaskCard {
    /// Points of scores, one for every number of measurements.
    pub(super) fn points_of(&self, scores: impl Iterator<Item = f64>) -> f64 {
        let range = (self.ceiling - self.floor).max(f64::MIN_POSITIVE);
        mean(scores.map(|score| 100.0 * ((score - self.floor) / range).clamp(0.0, 1.0))).unwrap_or(0.0)
    }

    /// Whether it was left out by the one who ran the entrant.
    pub fn is_skipped(&self) -> bool {
        self.refused.as_deref() == Some(SKIPPED)
    }
}

/// What an entrant has got on a suite.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Card {
    /// Name of the suite.
    pub suite: String,
    /// Name of the entrant.
    pub entrant: String,
    /// What it decided.
    pub track: Track,
    /// `test`, `public`, or `fresh` with the seed.
    pub split: String,
    /// Whether few touches were scored.
    pub quick: bool,
    /// Whether all tasks were done on all touches of the test split, and these are those of the suite's release.
    pub official: bool,
    /// Mean of the points over the tasks.
    pub points: Interval,
    /// The tasks.
    pub tasks: Vec<TaskCard>,
    /// Version of this program, and the revision of its sources.
    pub version: [String; 2],
    /// The command of a program.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub command: Option<String>,
    /// SHA-256 of the file of a program, if it has one.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub program_sha256: Option<String>,
    /// Median time from samples to answer, µs, one a task; of the machine below, and compared with nothing.
    pub times_us: Vec<f64>,
    /// Processor, platform and number of threads.
    pub machine: [String; 3],
}

/// Points agree within this.
const ROUNDED: f64 = 1e-6;

impl Card {
    /// Whether what it says agrees with itself; only running the entrant again tells more ([`Card::same`]).
    ///
    /// # Errors
    /// [`Refusal`] that names what does not.
    pub fn check(&self) -> Result<(), Refusal> {
        let wrong = |what: String, valid: &str| Err(Refusal::new(format!("{what}; valid: {valid}")));
        if self.suite != SUITE {
            return wrong(format!("`suite` = {:?}", self.suite), SUITE);
        }
        let number = |text: &str| text.strip_prefix("fresh ").is_some_and(|seed| seed.parse::<u64>().is_ok());
        if !(["test", "public"].contains(&&*self.split) || number(&self.split)) {
            return wrong(format!("`split` = {:?}", self.split), "test, public, or fresh and a seed");
        }
        let of_track = Task::of(self.track);
        for (k, task) in self.tasks.iter().enumerate() {
            let (name, at) = (&task.task, format!("`tasks[{k}]`"));
            if !of_track.iter().any(|known| known.name == name) || self.tasks[..k].iter().any(|t| t.task == *name) {
                return wrong(format!("{at}: `task` = {name:?}"), "tasks of the suite and the track, each once");
            }
            if task.entries.is_empty() != task.refused.is_some() {
                return wrong(format!("{at} {name}: `entries`"), "scores, or why it was not done");
            }
            let shares = task.entries.iter().map(|entry| &entry.score).all(|score| score.is_within(1.0));
            let points = task.points_of(task.entries.iter().map(|entry| entry.score.mean));
            if !(shares && task.points.is_within(100.0) && (points - task.points.mean).abs() <= ROUNDED) {
                return wrong(format!("{at} {name}: `points` = {}", task.points.mean), "those of its scores");
            }
        }
        let points = mean(self.tasks.iter().map(|task| task.points.mean)).unwrap_or(f64::NAN);
        if !(self.points.is_within(100.0) && (points - self.points.mean).abs() <= ROUNDED) {
            return wrong(format!("`points` = {}", self.points.mean), "the mean of the tasks'");
        }
        let released = |task: &TaskCard| {
            let known = task_named(&task.task).and_then(|known| known.released(&task.data_sha256));
            let (sha256, floor, ceiling) = (task.data_sha256.clone(), task.floor, task.ceiling);
            known.is_some_and(|known| *known == Released { sha256, floor, ceiling })
        };
        let whole = self.split == "test" && !self.quick && self.tasks.len() == of_track.len();
        if self.official && !(whole && self.tasks.iter().all(released)) {
            return wrong(
                "`official` = true".to_owned(),
                "all tasks on the whole test split, with the release's touches",
            );
        }
        Ok(())
    }

    /// The first difference from `again`, which was made by the same entrant, in what does not depend on the machine.
    ///
    /// # Errors
    /// [`Refusal`] that names it.
    pub fn same(&self, again: &Self) -> Result<(), Refusal> {
        let differs = |what: &str, a: &dyn std::fmt::Display, b: &dyn std::fmt::Display| {
            Err(Refusal::new(format!("`{what}`: the card has {a}; run again it is {b}")))
        };
        let texts = [
            ("suite", &self.suite, &again.suite),
            ("entrant", &self.entrant, &again.entrant),
            ("split", &self.split, &again.split),
        ];
        if let Some((what, a, b)) = texts.into_iter().find(|(_, a, b)| a != b) {
            return differs(what, a, b);
        }
        for (what, a, b) in [("quick", self.quick, again.quick), ("official", self.official, again.official)] {
            if a != b {
                return differs(what, &a, &b);
            }
        }
        if self.program_sha256 != again.program_sha256 {
            let text = |sum: &Option<String>| sum.clone().unwrap_or_else(|| "none".to_owned());
            return differs("program_sha256", &text(&self.program_sha256), &text(&again.program_sha256));
        }
        if self.tasks.len() != again.tasks.len() {
            return differs("tasks", &self.tasks.len(), &again.tasks.len());
        }
        for (a, b) in self.tasks.iter().zip(&again.tasks) {
            let at = |what: &str| format!("{}.{what}", a.task);
            if a.data_sha256 != b.data_sha256 {
                return differs(&at("data_sha256"), &a.data_sha256, &b.data_sha256);
            }
            if a.entries.len() != b.entries.len() {
                return differs(&at("entries"), &a.entries.len(), &b.entries.len());
            }
            for (mine, other) in a.entries.iter().zip(&b.entries) {
                if mine != other {
                    let what = at(&format!("score at {} measurements", mine.measurements));
                    return differs(&what, &mine.score.mean, &other.score.mean);
                }
            }
            if a.points != b.points {
                return differs(&at("points"), &a.points.mean, &b.points.mean);
            }
            let text = |value: &dyn std::fmt::Debug| format!("{value:?}");
            let others: [(&str, &dyn std::fmt::Debug, &dyn std::fmt::Debug); 6] = [
                ("task", &a.task, &b.task),
                ("touches", &a.touches, &b.touches),
                ("floor", &a.floor, &b.floor),
                ("ceiling", &a.ceiling, &b.ceiling),
                ("worst", &a.worst, &b.worst),
                ("refused", &a.refused, &b.refused),
            ];
            if let Some((what, x, y)) = others.into_iter().find(|(_, x, y)| text(x) != text(y)) {
                return differs(&at(what), &text(x), &text(y));
            }
        }
        if self.points != again.points {
            return differs("points", &self.points.mean, &again.points.mean);
        }
        Ok(())
    }
}
