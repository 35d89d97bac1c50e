//! The tasks of the suite `touch-1`: what is pressed, on which skins, how many measurements an answer may take, and
//! what is scored of it.

use super::Track;
use crate::touches::{Place, Touch, TouchObjects, TouchScene};
use rand::RngExt as _;
use rand_distr::{Distribution as _, StandardNormal};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};
use spts_dataset::{Maker, Spec};
use spts_input::Refusal;
use spts_models::{ConductanceMap, SkinLayout, Streams};
use std::collections::BTreeMap;
use std::sync::{Arc, LazyLock};

/// Name of the suite. Its tasks never change; others get another name.
pub const SUITE: &str = "touch-1";
/// Pitch of every skin, m: that of the published one.
const PITCH_M: f64 = 15e-3;

/// What is scored of an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Subject {
    /// Intersection over union of the supports, 23 % of the maximum.
    Image,
    /// Whether the object is named; of an answer without a class, the template that is most like the image.
    Class,
    /// Whether the centre of the image is within half a taxel of the true one.
    Place,
}

/// What is done to the skin.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Scene {
    /// Objects that are held.
    Held { objects: TouchObjects, place: Place, families: &'static [&'static str], size_m: [f64; 2], contacts: usize },
    /// A shape that slides over the sheet.
    Sliding,
    /// A shape whose force grows.
    Growing,
    /// A ball that bounces.
    Ball,
}

/// What is wrong with the skin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Trouble {
    Nothing,
    /// Hours have passed since the untouched skin was read, and it is warmer or colder.
    Drift,
    /// Some cells are dead, stuck or late.
    Faults,
}

/// One task.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Task {
    /// Name on the command line and in files.
    pub name: &'static str,
    /// What is pressed.
    pub about: &'static str,
    /// Rows and columns of the skin.
    pub side: usize,
    /// Wires, bands of rows, that are measured at once.
    pub wires: usize,
    /// What is scored.
    pub subject: Subject,
    /// Numbers of measurements for one answer.
    pub measurements: &'static [usize],
    /// Those that entrants which choose what is measured are asked for in addition.
    pub more: &'static [usize],
    scene: Scene,
    trouble: Trouble,
    /// Touches of one skin, with `--quick` and without.
    touches: [usize; 2],
}

const FEW: &[usize] = &[7, 20, 50];
const ALL: &[usize] = &[100, 200, 800];
const BROAD: &[&str] = &["plate", "blob", "foot", "hand", "union", "perforated"];
const THIN: &[&str] = &["rods", "pads", "ring", "polyline"];

const fn shapes(families: &'static [&'static str], size_m: [f64; 2], contacts: usize) -> Scene {
    Scene::Held { objects: TouchObjects::Shapes, place: Place::Anywhere, families, size_m, contacts }
}

const fn objects(place: Place) -> Scene {
    Scene::Held { objects: TouchObjects::Objects, place, families: &[], size_m: [0.02, 0.09], contacts: 1 }
}

/// Shapes where people put what they press.
const MIDDLE: Scene = Scene::Held {
    objects: TouchObjects::Shapes,
    place: Place::Within(0.015),
    families: &[],
    size_m: [0.02, 0.09],
    contacts: 1,
};

const fn task(name: &'static str, about: &'static str, scene: Scene) -> Task {
    let (measurements, more, touches) = (FEW, ALL, [4, 20]);
    let (side, wires, subject, trouble) = (10, 1, Subject::Image, Trouble::Nothing);
    Task { name, about, side, wires, subject, measurements, more, scene, trouble, touches }
}

const fn large(name: &'static str, about: &'static str, contacts: usize) -> Task {
    let scene = shapes(&[], [0.02, 0.09], contacts);
    Task { side: 32, measurements: &[51, 102, 205], more: &[512, 1024], touches: [2, 12], ..task(name, about, scene) }
}

/// Every task.
pub const TASKS: &[Task] = &[
    task("small", "shapes of 15 to 35 mm, anywhere", shapes(&[], [0.015, 0.035], 1)),
    task("thin", "rods, rings, lines and crosses of pads of 40 to 90 mm, anywhere", shapes(THIN, [0.04, 0.09], 1)),
    task("broad", "plates, soles, hands and blobs of 60 to 130 mm, anywhere", shapes(BROAD, [0.06, 0.13], 1)),
    task("middle", "shapes of all kinds, within 15 mm of the middle", MIDDLE),
    Task {
        subject: Subject::Class,
        touches: [17, 34],
        ..task(
            "class_placed",
            "which of seventeen objects, where the published recordings have them",
            objects(Place::Published),
        )
    },
    Task {
        subject: Subject::Class,
        touches: [17, 34],
        ..task("class_anywhere", "which of seventeen objects, anywhere and turned", objects(Place::Anywhere))
    },
    Task { touches: [2, 8], ..task("sliding", "a shape that slides at 50 to 400 mm/s, in time", Scene::Sliding) },
    Task {
        touches: [2, 8],
        ..task("growing", "a shape pressed from 0.5 to 40 N within 0.1 s, in time", Scene::Growing)
    },
    Task {
        subject: Subject::Place,
        touches: [2, 6],
        ..task("ball", "the place of a bouncing tennis ball, in time", Scene::Ball)
    },
    Task {
        trouble: Trouble::Drift,
        ..task(
            "drift",
            "shapes, up to eight hours and 10 K after the untouched skin was read",
            shapes(&[], [0.02, 0.09], 1),
        )
    },
    Task {
        trouble: Trouble::Faults,
        ..task("faults", "shapes on a skin with 5 % dead, 2 % stuck and 5 % late cells", shapes(&[], [0.02, 0.09], 1))
    },
    large("contacts_1", "one shape on 1,024 taxels", 1),
    large("contacts_3", "three shapes at once on 1,024 taxels", 3),
    large("contacts_10", "ten shapes at once on 1,024 taxels", 10),
    Task { wires: 4, ..large("wires_4", "three shapes at once on 1,024 taxels with four wires", 3) },
    Task {
        side: 100,
        measurements: &[100, 200, 500],
        more: &[2000, 10_000],
        touches: [1, 4],
        ..task("size_10000", "one shape on 10,000 taxels", shapes(&[], [0.02, 0.09], 1))
    },
];

/// What the suite was released with: for every task, with `--quick` and without.
static RELEASE: LazyLock<BTreeMap<String, [Released; 2]>> =
    LazyLock::new(|| serde_json::from_str(include_str!("touch-1.json")).unwrap_or_default());

/// What is known of the touches of a task's test split.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Released {
    /// SHA-256 of the touches.
    pub(super) sha256: String,
    /// Score of the mean of the images to learn from.
    pub(super) floor: f64,
    /// Score by all there is to measure.
    pub(super) ceiling: f64,
}

/// Skins of a task, with `--quick` and without.
const SKINS: [usize; 2] = [2, 6];
/// Touches to learn from: of one size of skin.
const TRAINING: [(usize, usize); 2] = [(1024, 204), (usize::MAX, 17)];

/// The task called `name`.
///
/// ```
/// use spts_studies::bench::{Split, task_named};
///
/// let small = task_named("small").expect("in the suite");
/// let skins = small.skins(Split::Public, true)?;
/// assert_eq!((skins.len(), skins[0].trials.len(), small.measurements), (2, 4, &[7, 20, 50][..]));
/// # Ok::<(), spts_input::Refusal>(())
/// ```
pub fn task_named(name: &str) -> Option<&'static Task> {
    TASKS.iter().find(|task| task.name == name)
}

/// Which of the touches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Split {
    /// For development, with their truth.
    Public,
    /// For scores.
    Test,
    /// As `Test`, of another seed than the suite's.
    Fresh(u64),
}

impl Split {
    fn streams(self) -> Streams {
        match self {
            Self::Public => Streams::new(1),
            Self::Test => Streams::new(2),
            Self::Fresh(seed) => Streams::new(3).child("bench/fresh", seed),
        }
    }
}

/// What does not work of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// It is always neutral.
    Dead,
    /// It always puts out the positive level.
    Stuck,
    /// It puts out the level of the row before.
    Late,
}

/// Shares of the cells with each fault.
const FAULTS: [(Fault, f64); 3] = [(Fault::Dead, 0.05), (Fault::Stuck, 0.02), (Fault::Late, 0.05)];
/// Longest time since the untouched skin was read, h, and the difference of the temperature, K.
const DRIFT: (f64, f64) = (8.0, 10.0);
/// Spread of the logarithm of a taxel's gain after that time: as from session to session (`session_log_sd`).
const DRIFT_LOG_SD: f64 = 0.1;
/// Relative change of the resistance of Velostat, 1/K (`resistance_per_k`).
const PER_K: f64 = 0.004;

/// One touch of the skin as it happens, and what is asked of it.
#[derive(Debug, Clone)]
pub struct Trial {
    /// Name of the object, or of the shape's family.
    pub name: Arc<str>,
    /// Conductance above the idle skin at the times below, S; held before and after.
    pub(super) maps: Vec<ConductanceMap>,
    pub(super) times_s: Vec<f64>,
    /// Gains of the idle skin since it was read; empty for none.
    pub(super) idle_gains: Vec<f64>,
    /// The ends of the measurements for an answer, s, and what is then true. Where nothing moves, the time is 0.
    pub(super) moments: Vec<(f64, Touch)>,
}

impl Trial {
    pub(super) fn held(touch: Touch) -> Self {
        let maps = vec![touch.conductance_s.clone()];
        let name = Arc::clone(&touch.name);
        Self { name, maps, times_s: vec![0.0], idle_gains: Vec::new(), moments: vec![(0.0, touch)] }
    }

    /// A course through `touches` at `times_s`; answers are asked for at those of them where `asked`.
    fn course(touches: Vec<Touch>, times_s: Vec<f64>, asked: impl Fn(usize) -> bool) -> Option<Self> {
        let name = Arc::clone(&touches.first()?.name);
        let maps = touches.iter().map(|touch| touch.conductance_s.clone()).collect();
        let moments = times_s.iter().copied().zip(touches).enumerate().filter(|(k, _)| asked(*k));
        Some(Self { name, maps, moments: moments.map(|(_, moment)| moment).collect(), times_s, idle_gains: Vec::new() })
    }

    /// Whether the touch changes while it is measured.
    pub fn moves(&self) -> bool {
        self.maps.len() > 1
    }
}

/// One skin of a task with its touches.
#[derive(Debug, Clone)]
pub struct SkinTrials {
    /// Random numbers of its electronics.
    pub(super) device: Streams,
    /// Cells that do not work.
    pub(super) faults: Arc<[(usize, Fault)]>,
    /// Its touches.
    pub trials: Vec<Trial>,
}

impl Task {
    /// Tasks of `track`: those on several wires are for rows that are given.
    pub fn of(track: Track) -> Vec<&'static Self> {
        TASKS.iter().filter(|task| task.wires == 1 || track == Track::Decoder).collect()
    }

    /// Rows, columns and pitch.
    ///
    /// # Errors
    /// None that a task of the suite has.
    pub fn layout(&self) -> Result<SkinLayout, Refusal> {
        SkinLayout::with_pitch(self.side, self.side, PITCH_M)
    }

    /// Skins and touches of `split`; few with `quick`. The result depends on nothing else.
    ///
    /// # Errors
    /// [`Refusal`] if a touch cannot be pressed.
    pub fn skins(&self, split: Split, quick: bool) -> Result<Vec<SkinTrials>, Refusal> {
        let size = usize::from(!quick);
        let own = split.streams().child(self.name, 0);
        let skins = (0..SKINS[size] as u64).into_par_iter();
        skins.map(|skin| self.skin(own.child("skin", skin), self.touches[size])).collect()
    }

    /// Touches of the public split to learn from, on skins of their own.
    ///
    /// # Errors
    /// As [`Task::skins`].
    pub fn training(&self) -> Result<Vec<Touch>, Refusal> {
        let taxels = self.side * self.side;
        let count = TRAINING.iter().find(|(most, _)| taxels <= *most).map_or(0, |(_, count)| *count);
        let own = Split::Public.streams().child(self.name, 1);
        let skins = (0..4_u64).into_par_iter();
        let touches = skins.map(|skin| {
            let device = own.child("skin", skin);
            match self.scene {
                Scene::Held { .. } => self.held(device, count.div_ceil(4)),
                // what moves has an image at every instant
                Scene::Sliding | Scene::Growing | Scene::Ball => {
                    let trials = self.skin(device, 4)?.trials.into_iter();
                    Ok(trials.flat_map(|trial| trial.moments).map(|(_, touch)| touch).collect())
                }
            }
        });
        Ok(touches.collect::<Result<Vec<_>, Refusal>>()?.into_iter().flatten().collect())
    }

    /// Whether a touch is by one object, after which it is called.
    pub(super) fn one_object(&self) -> bool {
        !matches!(self.scene, Scene::Held { contacts: 2.., .. })
    }

    /// What is known of touches with this digest; other machines may compute others.
    pub(super) fn released(&self, sha256: &str) -> Option<&'static Released> {
        RELEASE.get(self.name)?.iter().find(|released| released.sha256 == sha256)
    }

    fn skin(&self, device: Streams, touches: usize) -> Result<SkinTrials, Refusal> {
        let mut trials = match self.scene {
            Scene::Held { .. } => self.held(device, touches)?.into_iter().map(Trial::held).collect(),
            Scene::Sliding => self.courses(device, touches, Self::slides)?,
            Scene::Growing => self.courses(device, touches, Self::grows)?,
            Scene::Ball => self.balls(device, touches)?,
        };
        if self.trouble == Trouble::Drift {
            for (trial, number) in trials.iter_mut().zip(0..) {
                self.drift(trial, device, number);
            }
        }
        let faults = if self.trouble == Trouble::Faults { self.faults(device) } else { Vec::new() };
        Ok(SkinTrials { device, faults: faults.into(), trials })
    }

    fn held(&self, device: Streams, touches: usize) -> Result<Vec<Touch>, Refusal> {
        let Scene::Held { objects, place, families, size_m, contacts } = self.scene else { return Ok(Vec::new()) };
        let seed = device.rng("touches", 0).random();
        let scene = TouchScene {
            place,
            families,
            contacts,
            size_m: Some(size_m).filter(|_| objects == TouchObjects::Shapes),
            ..TouchScene::new(self.layout()?, objects, touches, seed)
        };
        scene.draw()
    }

    /// The shape that the numbers of `seed` choose, in this pose.
    fn posed(&self, seed: u64, specimen: u64, pose: [f64; 4]) -> Result<Option<Touch>, Refusal> {
        let scene = TouchScene {
            pose: Some(pose),
            specimen: Some(specimen),
            ..TouchScene::new(self.layout()?, TouchObjects::Shapes, 1, seed)
        };
        Ok(scene.draw()?.into_iter().next())
    }

    fn courses(
        &self,
        device: Streams,
        touches: usize,
        poses: fn(&Self, Streams) -> Vec<Pose>,
    ) -> Result<Vec<Trial>, Refusal> {
        let specimen = device.rng("specimen", 0).random();
        let each = (0..touches as u64).into_par_iter().map(|number| {
            let own = device.child("course", number);
            let seed = own.rng("shape", 0).random();
            let (mut times_s, mut course) = (Vec::new(), Vec::new());
            for (time_s, pose) in poses(self, own) {
                course.extend(self.posed(seed, specimen, pose)?);
                times_s.push(time_s);
            }
            times_s.truncate(course.len());
            Ok(Trial::course(course, times_s, |k| k > 0))
        });
        Ok(each.collect::<Result<Vec<_>, Refusal>>()?.into_iter().flatten().collect())
    }

    /// A straight way of 60 mm about a place within 20 mm of the middle.
    fn slides(&self, own: Streams) -> Vec<Pose> {
        let mut rng = own.rng("way", 0);
        let [x, y] = [(); 2].map(|()| rng.random_range(-0.02..0.02));
        let (turn, along): (f64, f64) = (rng.random_range(-180.0..180.0), rng.random_range(0.0..std::f64::consts::TAU));
        let speed_m_per_s = rng.random_range(0.05_f64.ln()..0.4_f64.ln()).exp();
        let force_n = rng.random_range(5_f64.ln()..40_f64.ln()).exp();
        let place = |k: usize| {
            let way_m = 0.06 * (k as f64 / (INSTANTS - 1) as f64 - 0.5);
            let pose = [x + way_m * along.cos(), y + way_m * along.sin(), turn, force_n];
            ((way_m + 0.03) / speed_m_per_s, pose)
        };
        (0..INSTANTS).map(place).collect()
    }

    /// A force that grows in proportion to time at one place.
    fn grows(&self, own: Streams) -> Vec<Pose> {
        let mut rng = own.rng("way", 0);
        let [x, y] = [(); 2].map(|()| rng.random_range(-0.04..0.04));
        let turn = rng.random_range(-180.0..180.0);
        let force = |k: usize| {
            let share = k as f64 / (INSTANTS - 1) as f64;
            (0.1 * share, [x, y, turn, 0.5 + 39.5 * share])
        };
        (0..INSTANTS).map(force).collect()
    }

    /// Bounces of a ball, from before the touch on, a moment every two milliseconds in which it presses.
    fn balls(&self, device: Streams, touches: usize) -> Result<Vec<Trial>, Refusal> {
        let [seed, specimen] = [0, 1].map(|k| device.rng("drops", k).random::<u64>());
        let layout = self.layout()?;
        let spec = format!(
            "rows = {}\nseed = {}\nreadout = \"ideal\"\n[object]\nfrom = \"ball\"\n\
             [pose]\nx_share = {{ uniform = [-0.3, 0.3] }}\ny_share = {{ uniform = [-0.3, 0.3] }}\n\
             [drop]\nheight_m = {{ log_uniform = [0.05, 1.0] }}\n\
             [skin]\nrows = {}\ncols = {}\npitch_m = {PITCH_M:e}\nrows_per_skin = {}\nseed = {}\n\
             [record]\nwhat = \"drop\"\nwindows = {WINDOWS}\ninterval_s = 0.001\nbefore_s = 0.004\n\
             measurements = 1\nraster = false\nlabels = [\"conductance\"]\n",
            touches * WINDOWS,
            seed >> 1,
            self.side,
            self.side,
            touches * WINDOWS,
            specimen % (1 << 53),
        );
        let spec = Spec::from_toml(&spec, &toml::Table::new(), ".".as_ref())?;
        let mut maker = Maker::new(&spec);
        let mut trials = Vec::with_capacity(touches);
        for drop in 0..touches {
            let (mut course, mut times_s, mut sums) = (Vec::new(), Vec::new(), Vec::new());
            for window in 0..WINDOWS {
                let row = maker.row((drop * WINDOWS + window) as u64)?;
                course.push(Touch::new(row.name(), row.conductance().clone(), &layout));
                times_s.push(row.time_s());
                sums.push(row.conductance().sum());
            }
            let largest = sums.iter().copied().fold(0.0, f64::max);
            let pressed = |k: usize| k.is_multiple_of(2) && sums[k] > PRESSED * largest;
            trials.extend(Trial::course(course, times_s, pressed));
        }
        Ok(trials)
    }

    /// Lets hours pass: the taxels have other gains, pressed or not, and all of them another temperature.
    fn drift(&self, trial: &mut Trial, device: Streams, number: u64) {
        let mut rng = device.rng("drift", number);
        let (hours, kelvin) = (rng.random_range(0.0..DRIFT.0), rng.random_range(-DRIFT.1..DRIFT.1));
        // every taxel goes its own way, the farther the longer
        let mut way = device.rng("drift/taxels", 0);
        let sd = DRIFT_LOG_SD * f64::sqrt(hours / DRIFT.0);
        let gain = |_| {
            let normal: f64 = StandardNormal.sample(&mut way);
            (sd * normal).exp() / (1.0 + PER_K * kelvin)
        };
        trial.idle_gains = (0..self.side * self.side).map(gain).collect();
        for map in &mut trial.maps {
            map.values_mut().iter_mut().zip(&trial.idle_gains).for_each(|(g, gain)| *g *= gain);
        }
    }

    /// Cells that do not work, each with one fault.
    fn faults(&self, device: Streams) -> Vec<(usize, Fault)> {
        let mut rng = device.rng("faults", 0);
        let mut sound: Vec<usize> = (0..self.side * self.side).collect();
        let mut faults = Vec::new();
        for (fault, share) in FAULTS {
            #[expect(clippy::cast_possible_truncation, reason = "a share of the taxels")]
            let count = (share * (self.side * self.side) as f64).round() as usize;
            for _ in 0..count {
                let taxel = sound.swap_remove(rng.random_range(0..sound.len()));
                faults.push((taxel, fault));
            }
        }
        faults
    }
}

/// A time, s, and the place, m, rotation, degrees, and force, N, of then.
type Pose = (f64, [f64; 4]);

/// Instants of a course.
const INSTANTS: usize = 25;
/// Windows of a drop, a millisecond apart.
const WINDOWS: usize = 24;
/// A ball presses where the taxels conduct this share of the most that they do.
const PRESSED: f64 = 0.1;

/// SHA-256 of all touches: conductances, times and faults.
pub(super) fn digest(skins: &[SkinTrials]) -> String {
    let mut bytes = Vec::new();
    for skin in skins {
        for (taxel, fault) in skin.faults.iter() {
            bytes.extend((*taxel as u64).to_le_bytes());
            bytes.push(*fault as u8);
        }
        for trial in &skin.trials {
            bytes.extend(trial.name.as_bytes());
            let numbers = trial.maps.iter().flat_map(|map| map.values()).chain(&trial.times_s).chain(&trial.idle_gains);
            numbers.for_each(|v| bytes.extend(v.to_le_bytes()));
        }
    }
    in_digits(&bytes)
}

/// SHA-256 of `bytes` in hexadecimal digits.
pub(super) fn in_digits(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}
