//! Runs an entrant on the tasks, and scores its answers.

use super::card::{Card, Entry, Interval, TaskCard, spread};
use super::rows::{CodeDivision, RowsAndDecoder};
use super::tasks::{Released, SUITE, SkinTrials, Split, Subject, Task, Trial, digest};
use super::wire::SkinWire;
use super::{Choice, Entrant, Prepared, Reader, Reading, Track, UNIT_S};
use crate::touches::{Touch, TouchScore};
use rand::RngExt as _;
use rayon::prelude::*;
use spts::progress::Progress;
use spts::provenance::{Machine, Provenance};
use spts_circuit::WeightRows;
use spts_eval::Labels;
use spts_eval::algorithm::Class;
use spts_eval::decoders::DECODERS;
use spts_input::Refusal;
use spts_models::{SkinLayout, Streams};
use spts_recon::Matrix;
use spts_recon::localise::centre_of_mass;
use spts_recon::metrics::{SUPPORT_THRESHOLD, median};
use spts_recon::statistics::mean;
use std::collections::BTreeMap;

/// A run of the benchmark.
#[derive(Clone)]
pub struct Bench {
    /// Who takes part.
    pub choice: Choice,
    /// Tasks.
    pub tasks: Vec<&'static Task>,
    /// Which touches are scored.
    pub split: Split,
    /// Whether few touches are scored.
    pub quick: bool,
    /// Those of the tasks that are left out: no points.
    pub skipped: Vec<&'static Task>,
}

/// Why a task that is left out has no points.
pub(super) const SKIPPED: &str = "left out by --skip";

/// Touches of the public split with their samples, for the development of decoders.
pub struct Development {
    /// Rows of ±1 (0 of another wire's taxels), M × taxels: M the most measurements of the task. Fewer are the first of
    /// them.
    pub phi: Matrix,
    /// Samples, µS, touches × M.
    pub y: Matrix,
    /// True conductances, µS, touches × taxels.
    pub images: Matrix,
    /// Name of the object or family of every touch.
    pub names: Vec<String>,
}

impl Development {
    /// What is there of `task`. A touch that moves is there at each of its moments.
    ///
    /// # Errors
    /// [`Refusal`] if a touch cannot be pressed.
    pub fn of(task: &Task) -> Result<Self, Refusal> {
        let layout = task.layout()?;
        let most = task.measurements.iter().copied().max().unwrap_or(1);
        let training = task.training()?;
        let wire = SkinWire::of(task, &training)?;
        let (labels, streams, measurements) = (Labels::default(), Streams::new(1), vec![most]);
        let prepared = Prepared { layout, wires: task.wires, measurements, training, labels, streams };
        let weights = prepared.weights()?;
        let phi = Matrix::from_rows(most, layout.taxels(), WeightRows::new(&weights, 0, most).to_vec())?;
        let given = RowsAndDecoder::given(&weights, &prepared.measurements, prepared.trained(&DECODERS[0])?)?;
        let largest_sum_s = wire.largest_sum_s(&given, &prepared.training);
        let (mut y, mut images, mut names) = (Vec::new(), Vec::new(), Vec::new());
        for skin in task.skins(Split::Public, false)? {
            let mut session = wire.session(largest_sum_s, skin.device, skin.faults.clone())?;
            for (trial, number) in skin.trials.iter().zip(0..) {
                for (time_s, truth) in &trial.moments {
                    let start_s = time_s - most as f64 * wire.period_s / wire.wires as f64;
                    y.extend(session.hold(trial, number, start_s, most)?.given(most, &weights, most)?.volts);
                    images.extend(truth.conductance_s.values().iter().map(|g| g / UNIT_S));
                    names.push(trial.name.to_string());
                }
            }
        }
        let touches = names.len();
        let (y, images) = (Matrix::from_rows(touches, most, y)?, Matrix::from_rows(touches, layout.taxels(), images)?);
        Ok(Self { phi, y, images, names })
    }
}

/// A place is right within this distance, taxels.
const NEAR_PX: f64 = 0.5;
/// Draws of the bootstrap.
const RESAMPLES: usize = 400;

/// Scores of one task: a value for every skin, touch and number of measurements.
struct Scored {
    card: TaskCard,
    values: Vec<Vec<Vec<f64>>>,
    times_s: Vec<f64>,
}

impl Bench {
    /// All tasks, the test split.
    pub fn new(choice: Choice) -> Self {
        Self { tasks: Task::of(choice.track), choice, split: Split::Test, quick: false, skipped: Vec::new() }
    }

    /// Scores the entrant. All values but the times are the same for any number of threads.
    ///
    /// # Errors
    /// [`Refusal`] if a touch cannot be pressed, or a program fails. A task that the entrant refuses has no points.
    pub fn run(&self, progress: &dyn Progress) -> Result<Card, Refusal> {
        progress.stage("scoring", Some(self.tasks.len()));
        let mut scored = Vec::with_capacity(self.tasks.len());
        for task in &self.tasks {
            scored.push(self.task(task).map_err(|e| e.at(task.name))?);
            progress.step();
        }
        progress.end();
        let known =
            self.tasks.iter().zip(&scored).all(|(task, scored)| task.released(&scored.card.data_sha256).is_some());
        let all = Task::of(self.choice.track).iter().all(|task| self.tasks.contains(task));
        let machine = Machine::here();
        let Provenance { version, git_revision, .. } = Provenance::new(0, String::new());
        let split = match self.split {
            Split::Public => "public".to_owned(),
            Split::Test => "test".to_owned(),
            Split::Fresh(seed) => format!("fresh {seed}"),
        };
        Ok(Card {
            suite: SUITE.to_owned(),
            entrant: self.choice.name.clone(),
            track: self.choice.track,
            split,
            quick: self.quick,
            official: self.split == Split::Test && !self.quick && all && known,
            points: total(&scored),
            times_us: scored.iter().map(|task| 1e6 * median(&task.times_s).unwrap_or(0.0)).collect(),
            tasks: scored.into_iter().map(|task| task.card).collect(),
            version: [version, git_revision],
            command: self.choice.command().map(str::to_owned),
            program_sha256: self.choice.sha256(),
            machine: [machine.cpu, machine.platform, machine.threads.to_string()],
        })
    }

    fn task(&self, task: &Task) -> Result<Scored, Refusal> {
        let layout = task.layout()?;
        let skins = task.skins(self.split, self.quick)?;
        let left_out = self.skipped.contains(&task);
        let training = task.training()?;
        let mut measurements = task.measurements.to_vec();
        if self.choice.track == Track::Readout {
            measurements.extend(task.more);
        }
        let labels = Labels::of(training.iter().map(|touch| &*touch.name));
        let templates = Templates::new(&training, &layout);
        let wire = SkinWire::of(task, &training)?;
        let judge = Judge { task, layout, labels: &labels, templates: &templates };
        let data_sha256 = digest(&skins);
        let released = match task.released(&data_sha256) {
            Some(released) => released.clone(),
            None => judge.range(data_sha256, &wire, &training, &skins)?,
        };
        let streams = Streams::new(1).child("bench/entrant", 0);
        let prepared = Prepared { layout, wires: task.wires, measurements, training, labels: labels.clone(), streams };
        let mut card = TaskCard {
            task: task.name.to_owned(),
            subject: task.subject,
            data_sha256: released.sha256,
            touches: skins.iter().map(|skin| skin.trials.len()).sum(),
            ceiling: released.ceiling,
            floor: released.floor,
            entries: Vec::new(),
            points: Interval { mean: 0.0, low: 0.0, high: 0.0 },
            worst: None,
            refused: None,
        };
        let built = if left_out { Err(Refusal::new(SKIPPED)) } else { self.choice.build(&prepared) };
        let entrant = match built {
            Ok(entrant) => entrant,
            Err(refusal) if self.choice.is_program() && !left_out => return Err(refusal),
            Err(refusal) => {
                card.refused = Some(refusal.to_string());
                return Ok(Scored { card, values: Vec::new(), times_s: Vec::new() });
            }
        };
        let answers = judge.all(&*entrant, &wire, &prepared, &skins)?;
        entrant.finish()?;
        let (values, times_s): (Vec<_>, Vec<_>) = answers.into_iter().unzip();
        let times_s = times_s.into_iter().flatten().collect();
        card.entries = entries(&prepared.measurements, &values);
        card.points = interval(&values, |drawn| points(&card, drawn));
        card.worst = worst(&skins, &values).filter(|_| task.one_object());
        Ok(Scored { card, values, times_s })
    }
}

/// Scores answers to one task.
struct Judge<'a> {
    task: &'a Task,
    layout: SkinLayout,
    labels: &'a Labels,
    templates: &'a Templates,
}

/// A value for every touch and number of measurements of a skin, and the times of the answers.
type Answers = (Vec<Vec<f64>>, Vec<f64>);

impl Judge<'_> {
    /// The entrant on every skin.
    fn all(
        &self,
        entrant: &dyn Entrant,
        wire: &SkinWire,
        prepared: &Prepared,
        skins: &[SkinTrials],
    ) -> Result<Vec<Answers>, Refusal> {
        let mut largest_sum_s = wire.largest_sum_s(entrant, &prepared.training);
        if entrant.learns_its_sums() {
            largest_sum_s = learned_sum_s(entrant, wire, prepared)?;
        }
        let one =
            |skin: &SkinTrials| self.skin(&mut *entrant.start(), wire, largest_sum_s, skin, &prepared.measurements);
        if entrant.in_turn() {
            return skins.iter().map(one).collect();
        }
        skins.par_iter().with_max_len(1).map(one).collect()
    }

    fn skin(
        &self,
        reader: &mut dyn Reader,
        wire: &SkinWire,
        largest_sum_s: f64,
        skin: &SkinTrials,
        measurements: &[usize],
    ) -> Result<Answers, Refusal> {
        let mut session = wire.session(largest_sum_s, skin.device, skin.faults.clone())?;
        let (mut values, mut times_s) = (Vec::with_capacity(skin.trials.len()), Vec::new());
        for (trial, number) in skin.trials.iter().zip(0..) {
            let mut scores = Vec::with_capacity(measurements.len());
            for &m in measurements {
                let mut sum = 0.0;
                for (time_s, truth) in &trial.moments {
                    let start_s = time_s - m as f64 * wire.period_s / wire.wires as f64;
                    let reading = reader.read(session.hold(trial, number, start_s, m)?)?;
                    times_s.push(reading.time_s);
                    sum += self.score(&reading, truth);
                }
                scores.push(sum / trial.moments.len().max(1) as f64);
            }
            values.push(scores);
        }
        Ok((values, times_s))
    }

    fn score(&self, reading: &Reading, truth: &Touch) -> f64 {
        let taxels = self.layout.taxels();
        let empty = vec![0.0; taxels];
        let sound = reading.image.len() == taxels && reading.image.iter().all(|v| v.is_finite());
        let image = if sound { &reading.image } else { &empty };
        let right = match self.task.subject {
            Subject::Image => return TouchScore::of(image, truth, &self.layout).iou,
            Subject::Place => {
                TouchScore::of(image, truth, &self.layout).place_px.is_some_and(|place_px| place_px <= NEAR_PX)
            }
            Subject::Class => match reading.class {
                Some(Class::Unknown) => false,
                Some(Class::Known(label)) => self.labels.name(label) == Some(&*truth.name),
                None => self.templates.name(image) == Some(&*truth.name),
            },
        };
        f64::from(u8::from(right))
    }

    /// Floor and ceiling of touches with this digest.
    fn range(
        &self,
        sha256: String,
        wire: &SkinWire,
        training: &[Touch],
        skins: &[SkinTrials],
    ) -> Result<Released, Refusal> {
        Ok(Released { sha256, floor: self.floor(training, skins), ceiling: self.ceiling(wire, training, skins)? })
    }

    /// Score of the mean of the images to learn from, or of no image.
    fn floor(&self, training: &[Touch], skins: &[SkinTrials]) -> f64 {
        let mut image = vec![0.0; self.layout.taxels()];
        for touch in training {
            image.iter_mut().zip(touch.conductance_s.values()).for_each(|(sum, g)| *sum += g);
        }
        let reading = Reading::of(image);
        let trials = skins.iter().flat_map(|skin| &skin.trials);
        let each =
            trials.map(|trial| mean(trial.moments.iter().map(|(_, truth)| self.score(&reading, truth))).unwrap_or(0.0));
        mean(each).unwrap_or(0.0)
    }

    /// Score of code division with a whole set of chips while what is true of a moment is held: all that the wire can
    /// tell of the taxels.
    fn ceiling(&self, wire: &SkinWire, training: &[Touch], skins: &[SkinTrials]) -> Result<f64, Refusal> {
        let taxels = self.layout.taxels();
        let entrant = CodeDivision { taxels };
        let largest_sum_s = wire.largest_sum_s(&entrant, training);
        let each = skins.par_iter().map(|skin| {
            let held =
                |trial: &Trial| trial.moments.iter().map(|(_, truth)| Trial::held(truth.clone())).collect::<Vec<_>>();
            // the cells work, and the skin is as it was read
            let count = if taxels > LARGE { 1 } else { skin.trials.len() };
            let (faults, trials) = ([].into(), skin.trials.iter().take(count).flat_map(held).collect());
            let skin = SkinTrials { device: skin.device, faults, trials };
            let (values, _) =
                self.skin(&mut *entrant.start(), wire, largest_sum_s, &skin, &[taxels.next_power_of_two()])?;
            Ok(values.into_iter().flatten().collect::<Vec<f64>>())
        });
        Ok(mean(each.collect::<Result<Vec<_>, Refusal>>()?.concat()).unwrap_or(0.0))
    }
}

/// Of skins of more taxels the ceiling is that of one touch a skin.
const LARGE: usize = 2048;

/// Touches on which the sums of an entrant are found out.
const TRIED: usize = 16;

/// Largest sum that the entrant asks for, S, on touches to learn from: with a feedback for all taxels at once.
fn learned_sum_s(entrant: &dyn Entrant, wire: &SkinWire, prepared: &Prepared) -> Result<f64, Refusal> {
    let all = |touch: &Touch| touch.conductance_s.sum();
    let largest = prepared.training.iter().map(all).fold(0.0, f64::max);
    let mut session = wire.session(largest, prepared.streams, [].into())?;
    let mut reader = entrant.start();
    for (touch, number) in prepared.training.iter().take(TRIED).zip(0..) {
        for &m in &prepared.measurements {
            reader.read(session.hold(&Trial::held(touch.clone()), number, 0.0, m)?)?;
        }
    }
    Ok(session.largest_sum_s())
}

/// Mean of the values of `entry` over all touches.
fn score(values: &[Vec<&Vec<f64>>], entry: usize) -> f64 {
    mean(values.iter().flatten().map(|touch| touch[entry])).unwrap_or(0.0)
}

fn entries(measurements: &[usize], values: &[Vec<Vec<f64>>]) -> Vec<Entry> {
    let each = measurements.iter().enumerate();
    each.map(|(k, &measurements)| Entry { measurements, score: interval(values, |drawn| score(drawn, k)) }).collect()
}

/// The object with the least mean of its `values`, and that mean; `None` if there is one object alone.
fn worst(skins: &[SkinTrials], values: &[Vec<Vec<f64>>]) -> Option<(String, f64)> {
    let mut objects: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    let trials = skins.iter().flat_map(|skin| &skin.trials);
    for (trial, scores) in trials.zip(values.iter().flatten()) {
        objects.entry(&trial.name).or_default().extend(scores);
    }
    let several = objects.len() > 1;
    let means =
        objects.into_iter().filter(|_| several).filter_map(|(name, scores)| Some((name.to_owned(), mean(scores)?)));
    means.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Points of the task of `card` with these values.
fn points(card: &TaskCard, values: &[Vec<&Vec<f64>>]) -> f64 {
    let entries = values.iter().flatten().map(|touch| touch.len()).next().unwrap_or(0);
    card.points_of((0..entries).map(|k| score(values, k)))
}

/// Draws skins, and of each its touches, with replacement.
fn resampled(values: &[Vec<Vec<f64>>], streams: Streams, draw: u64) -> Vec<Vec<&Vec<f64>>> {
    let mut rng = streams.rng("bench/bootstrap", draw);
    let skins = (0..values.len()).map(|_| {
        let skin = &values[rng.random_range(0..values.len())];
        (0..skin.len()).map(|_| &skin[rng.random_range(0..skin.len())]).collect()
    });
    skins.collect()
}

fn interval(values: &[Vec<Vec<f64>>], of: impl Fn(&[Vec<&Vec<f64>>]) -> f64) -> Interval {
    let whole: Vec<Vec<&Vec<f64>>> = values.iter().map(|skin| skin.iter().collect()).collect();
    let drawn = (0..RESAMPLES as u64).map(|draw| of(&resampled(values, Streams::new(1), draw)));
    spread(of(&whole), drawn.collect())
}

/// Mean points over the tasks; skins and touches of all of them are drawn anew.
fn total(tasks: &[Scored]) -> Interval {
    let all = |of: &dyn Fn(&Scored) -> f64| mean(tasks.iter().map(of)).unwrap_or(0.0);
    let drawn = (0..RESAMPLES as u64).map(|draw| {
        all(&|task: &Scored| {
            points(&task.card, &resampled(&task.values, Streams::new(1).child(&task.card.task, 0), draw))
        })
    });
    spread(all(&|task| task.card.points.mean), drawn.collect())
}

/// Images of known objects, each about its centre: an image is classified by the most similar one. The same for all
/// entrants that name no class.
struct Templates {
    rows: usize,
    cols: usize,
    /// Name, values of length 1, and centre in whole taxels.
    known: Vec<(String, Vec<f64>, [i64; 2])>,
}

impl Templates {
    fn new(touches: &[Touch], layout: &SkinLayout) -> Self {
        let mut templates = Self { rows: layout.rows(), cols: layout.cols(), known: Vec::new() };
        for touch in touches {
            let values = touch.conductance_s.values();
            let length = values.iter().map(|v| v * v).sum::<f64>().sqrt();
            if let Some(centre) = templates.centre(values).filter(|_| length > 0.0) {
                templates.known.push((touch.name.to_string(), values.iter().map(|v| v / length).collect(), centre));
            }
        }
        templates
    }

    fn centre(&self, image: &[f64]) -> Option<[i64; 2]> {
        #[expect(clippy::cast_possible_truncation, reason = "within the sheet")]
        let whole = |px: f64| px.round() as i64;
        Some(centre_of_mass(image, self.cols, SUPPORT_THRESHOLD)?.map(whole))
    }

    /// The object with the image that correlates most with `image`, moved until their centres agree to a taxel. `None`
    /// for an empty image.
    fn name(&self, image: &[f64]) -> Option<&str> {
        let centre = self.centre(image)?;
        let best = self.known.iter().map(|(name, known, at)| {
            let shifts = (-1..=1).flat_map(|r| (-1..=1).map(move |c| [r, c]));
            let each = shifts.map(|[r, c]| self.product(image, known, [centre[0] - at[0] + r, centre[1] - at[1] + c]));
            (each.fold(0.0, f64::max), name)
        });
        best.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, name)| name.as_str())
    }

    /// Σ of `image` times `known` moved by so many rows and columns.
    fn product(&self, image: &[f64], known: &[f64], [rows, cols]: [i64; 2]) -> f64 {
        let at = |r: i64, c: i64| {
            let (r, c) = (usize::try_from(r).ok()?, usize::try_from(c).ok()?);
            (r < self.rows && c < self.cols).then_some(r * self.cols + c)
        };
        let mut sum = 0.0;
        for (k, v) in image.iter().enumerate().filter(|(_, v)| **v != 0.0) {
            let (r, c) = ((k / self.cols) as i64 - rows, (k % self.cols) as i64 - cols);
            sum += at(r, c).map_or(0.0, |k| v * known[k]);
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::TASKS;

    /// Touches, floor and ceiling of a task, with `--quick` or without. The ceiling on a skin with more than `most`
    /// taxels is that of the release.
    fn made(task: &Task, quick: bool, most: usize) -> Result<Released, Refusal> {
        let (layout, training) = (task.layout()?, task.training()?);
        let (labels, templates) = (Labels::of(training.iter().map(|t| &*t.name)), Templates::new(&training, &layout));
        let judge = Judge { task, layout, labels: &labels, templates: &templates };
        let skins = task.skins(Split::Test, quick)?;
        if let Some(released) = task.released(&digest(&skins)).filter(|_| layout.taxels() > most) {
            return Ok(Released { floor: judge.floor(&training, &skins), ..released.clone() });
        }
        judge.range(digest(&skins), &SkinWire::of(task, &training)?, &training, &skins)
    }

    /// The touches of a release stay what they are, and so do the scores that points are counted from; the touches of
    /// other splits are others. `parts` are touches with `--quick` or without, and the largest skin, in taxels, of
    /// which the ceiling is made.
    fn check_released(parts: &[(bool, usize)]) {
        let (mut all, mut known) = (BTreeMap::new(), true);
        for task in TASKS {
            let other = digest(&task.skins(Split::Public, true).unwrap());
            let tests: Vec<Released> = parts.iter().map(|&(quick, most)| made(task, quick, most).unwrap()).collect();
            assert_ne!(tests[0].sha256, other, "{}", task.name);
            known &= tests.iter().all(|test| task.released(&test.sha256) == Some(test));
            all.insert(task.name, tests);
        }
        assert!(known, "of these touches they are now\n{}", serde_json::to_string_pretty(&all).unwrap());
    }

    #[test]
    fn quick_touches_floors_and_ceilings_are_those_of_the_release() {
        check_released(&[(true, LARGE)]);
    }

    #[test]
    #[ignore = "all touches, floors and ceilings: two minutes"]
    fn all_touches_floors_and_ceilings_are_those_of_the_release() {
        check_released(&[(true, usize::MAX), (false, LARGE)]);
    }
}
