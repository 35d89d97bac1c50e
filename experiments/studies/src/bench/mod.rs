//! The benchmark of few-wire touch: fixed tasks, one wire, one clock, one noise for all who take part.
//!
//! An [`Entrant`] is built for a task and answers with images or classes; [`TASKS`] are the tasks of the suite
//! [`SUITE`], [`READOUTS`] the ways to measure, and [`Bench`] runs an entrant and fills in its [`Card`].
//! docs/benchmark.md describes the protocol.
//!
//! ```no_run
//! use spts_studies::bench::{Bench, Choice, Track};
//!
//! let bench = Bench { quick: true, ..Bench::new(Choice::named("amortised", None)?) };
//! let card = bench.run(&())?;
//! assert_eq!((card.track, card.suite.as_str()), (Track::Decoder, "touch-1"));
//! # Ok::<(), spts_input::Refusal>(())
//! ```

mod adaptive;
mod card;
mod events;
mod program;
mod ranking;
mod rows;
mod run;
mod tasks;
mod wire;

pub use card::{Card, Entry, Interval, TaskCard};
pub use ranking::{Ranked, Ranking};
pub use run::{Bench, Development};
pub use tasks::{Fault, SUITE, SkinTrials, Split, Subject, TASKS, Task, Trial, task_named};
pub use wire::{SkinWire, WireFrame, WireSession};

use crate::touches::Touch;
use adaptive::{Adaptive, BinarySearch};
use events::Events;
use rows::{CodeDivision, FrequencyDivision, Raster, RowsAndDecoder};
use serde::{Deserialize, Serialize};
use spts_circuit::{Seeding, WeightMode, Weights, WireConfig, Wires};
use spts_eval::Labels;
use spts_eval::algorithm::Class;
use spts_eval::decoders::{AUTO, DECODERS, DecoderSpec, Needs, TrainedDecoder, auto, find};
use spts_eval::external::{ExternalCommand, class_of};
use spts_eval::training::TrainingData;
use spts_input::Refusal;
use spts_models::{SkinLayout, Streams};
use spts_recon::Matrix;
use spts_recon::recover::ImagePrior;
use spts_recon::rows::{DESIGNERS, Designer, Expected, RowNeeds, RowTask, Tolerances, designer};
use std::path::Path;
use std::time::Duration;

/// A way to read and decode a skin, built for one task.
pub trait Entrant: Send + Sync {
    /// Largest magnitude of Σ wₖ·gₖ, S, over all its measurements of a skin with the conductances `conductance_s`, idle
    /// taxels included. The feedback resistance is chosen for it.
    fn largest_sum_s(&self, conductance_s: &[f64]) -> f64;

    /// Whether its sums are to be found out on touches to learn from, since they are not known before.
    fn learns_its_sums(&self) -> bool {
        false
    }

    /// Begins with a skin. Touches are read in order.
    fn start(&self) -> Box<dyn Reader + '_>;

    /// Whether skins are to be read one after the other: it is asked by all threads in turn.
    fn in_turn(&self) -> bool {
        false
    }

    /// Called after the last answer.
    ///
    /// # Errors
    /// [`Refusal`] of a program that did not end well.
    fn finish(&self) -> Result<(), Refusal> {
        Ok(())
    }
}

/// An [`Entrant`] at work on one skin.
pub trait Reader {
    /// Answers with [`WireSession::left`] measurements at most.
    ///
    /// # Errors
    /// [`Refusal`] if the wire cannot be measured, or there is no answer.
    fn read(&mut self, wire: &mut WireSession<'_>) -> Result<Reading, Refusal>;
}

/// An answer.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Reading {
    /// One value a taxel, in any unit; empty for none.
    pub image: Vec<f64>,
    /// The class; `None` leaves it to the templates, which see the image.
    pub class: Option<Class>,
    /// Time from the samples to the answer, s.
    pub time_s: f64,
}

impl Reading {
    fn of(image: Vec<f64>) -> Self {
        Self { image, ..Self::default() }
    }
}

/// What an entrant may decide.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Track {
    /// Rows are given: the cells' own, mixed seeds.
    Decoder,
    /// Rows of ±1 are its own, the same for every touch.
    Rows,
    /// What is measured is its own: any levels, and the next by those before.
    Readout,
}

impl Track {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Decoder, Self::Rows, Self::Readout];

    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Decoder => "decoder",
            Self::Rows => "rows",
            Self::Readout => "readout",
        }
    }
}

/// A readout in the table [`READOUTS`].
///
/// ```
/// use spts_studies::bench::READOUTS;
///
/// let events = READOUTS.iter().find(|line| line.name == "events").expect("in the table");
/// assert!(events.cell.contains("a converter for its own taxel"));
/// ```
#[derive(Debug, Clone, Copy)]
pub struct ReadoutLine {
    /// Name on the command line and in files.
    pub name: &'static str,
    /// What it is.
    pub about: &'static str,
    /// Requirements on a cell.
    pub cell: &'static str,
    /// Publication of the method.
    pub source: &'static str,
    build: fn(&SkinLayout, Streams) -> Box<dyn Entrant>,
}

/// Every readout whose measurements are its own.
pub const READOUTS: &[ReadoutLine] = &[
    ReadoutLine {
        name: "raster",
        about: "one taxel after another",
        cell: "level 1 in its own slot, the neutral level in all others: the published cell in raster mode",
        source: "A. Slepyan et al., arXiv 2511.16898 (SPTS)",
        build: |skin, _| Box::new(Raster { taxels: skin.taxels(), cols: skin.cols() }),
    },
    ReadoutLine {
        name: "code_division",
        about: "a Walsh function for every taxel, all at once",
        cell: "a Walsh function, from a counter and its own number: ±1",
        source: "arXiv 2509.10888 (CDMA skin)",
        build: |skin, _| Box::new(CodeDivision { taxels: skin.taxels() }),
    },
    ReadoutLine {
        name: "frequency_division",
        about: "a square wave for every row, then for every column; a taxel is the product of both sums",
        cell: "a Walsh function of its row, then of its column: ±1",
        source: "multiplexing by Walsh functions: H. F. Harmuth, IEEE Spectrum 6 (1969) 82",
        build: |skin, _| Box::new(FrequencyDivision { rows: skin.rows(), cols: skin.cols() }),
    },
    ReadoutLine {
        name: "adaptive",
        about: "taxels on ever finer grids, densely where one is touched",
        cell: "level 1 when it is called, the neutral level otherwise: a call by address before every measurement",
        source: "A. Slepyan et al., arXiv 2410.13847 (ACTS)",
        build: |skin, _| Box::new(Adaptive::new(skin.rows(), skin.cols())),
    },
    ReadoutLine {
        name: "binary_search",
        about: "parts of the sheet, and where one is touched, its halves",
        cell: "level 1 when its part is called, the neutral level otherwise: a call by address before every measurement",
        source: "binary splitting of group tests: F. K. Hwang, J. Am. Stat. Assoc. 67 (1972) 605",
        build: |skin, _| Box::new(BinarySearch::new(skin.rows(), skin.cols())),
    },
    ReadoutLine {
        name: "events",
        about: "signatures that touched taxels send at moments of their own",
        cell: "a converter for its own taxel, an output of its own of −1, +1 or switched off, and a stored signature",
        source: "W. W. Lee et al., Science Robotics 4 (2019) eaax2198 (ACES)",
        build: |skin, streams| Box::new(Events::new(skin.taxels(), streams)),
    },
];

/// Who takes part.
#[derive(Clone)]
pub struct Choice {
    /// Name in files.
    pub name: String,
    /// What it decides.
    pub track: Track,
    kind: Kind,
    /// The program as the user wrote it.
    command: Option<String>,
}

#[derive(Clone)]
enum Kind {
    Auto,
    Decoder(&'static DecoderSpec),
    Rows(&'static Designer),
    Readout(&'static ReadoutLine),
    Program(ExternalCommand),
}

/// Time for one answer of a program.
const DEADLINE: Duration = Duration::from_secs(10);
/// Time to learn, with the first answer.
const LEARNING: Duration = Duration::from_secs(600);

impl Choice {
    /// The entrant called `name` on `track`, or on the first track that has it: a decoder of the board, a designer of
    /// rows with the decoder `auto`, or a readout.
    ///
    /// # Errors
    /// [`Refusal`] with the names that there are.
    pub fn named(name: &str, track: Option<Track>) -> Result<Self, Refusal> {
        let on = |of: Track| track.is_none_or(|track| track == of);
        let found = Track::ALL.into_iter().filter(|of| on(*of)).find_map(|of| Some((of, Self::on(of, name)?)));
        let (track, kind) = found.ok_or_else(|| {
            if let Some(other) = Track::ALL.into_iter().find(|of| Self::on(*of, name).is_some()) {
                return Refusal::new(format!("{name:?} is of the track {}", other.name()));
            }
            let names: Vec<String> = Track::ALL.into_iter().filter(|of| on(*of)).flat_map(Self::names).collect();
            Refusal::new(format!(
                "{name:?} is no file, no program and no entrant by name; valid names: {}",
                names.join(", ")
            ))
        })?;
        Ok(Self { name: name.to_owned(), track, kind, command: None })
    }

    /// A program on `track`, as `--external` of `spts score` takes it; or the class in a Python file, which is on the
    /// track of the methods that it has: `read`, or `rows` beside `predict`, or `predict` alone.
    ///
    /// # Errors
    /// [`Refusal`] for no command, the name of another entrant, and a Python file without the methods of the track.
    pub fn program(text: &str, track: Option<Track>) -> Result<Self, Refusal> {
        let command = ExternalCommand { limit: DEADLINE, first: LEARNING, ..ExternalCommand::parse(text) };
        if command.command.trim().is_empty() {
            return Err(Refusal::new(format!("`{text}` has no command")));
        }
        if Track::ALL.into_iter().any(|of| Self::on(of, &command.name).is_some()) {
            return Err(Refusal::new(format!("`{}` is an entrant by name; valid: another name", command.name)));
        }
        let class = class_of(&command.command);
        let has = |method: &str| class.as_ref().is_some_and(|class| class.contains(&format!("def {method}(")));
        let own = if has("read") {
            Track::Readout
        } else if has("rows") {
            Track::Rows
        } else {
            Track::Decoder
        };
        let (name, track, said) = (command.name.clone(), track.unwrap_or(own), Some(text.to_owned()));
        let needed = match track {
            Track::Decoder => &["predict"][..],
            Track::Rows => &["rows", "predict"],
            Track::Readout => &["read"],
        };
        // a file of Python with no class may be a program of its own, if its first line says who runs it
        let file = Path::new(&command.command);
        let is_python = file.extension().is_some_and(|e| e == "py") && file.is_file();
        let runs = || std::fs::read(file).is_ok_and(|bytes| bytes.starts_with(b"#!"));
        let needs_class = class.is_some() || (is_python && !runs());
        if let Some(method) = needed.iter().find(|method| needs_class && !has(method)) {
            let problem = format!("no class with a method `{method}`, which the track {} needs", track.name());
            return Err(Refusal::new(problem).at(&command.command));
        }
        Ok(Self { name, track, kind: Kind::Program(command), command: said })
    }

    /// Whether it is a program.
    pub(crate) fn is_program(&self) -> bool {
        matches!(self.kind, Kind::Program(_))
    }

    /// The program as the user wrote it; `None` for an entrant by name.
    pub fn command(&self) -> Option<&str> {
        self.command.as_deref()
    }

    /// SHA-256 of the last word of a program's command that is a file.
    pub(crate) fn sha256(&self) -> Option<String> {
        let command = self.command()?;
        let command = command.split_once('=').map_or(command, |(_, command)| command);
        let words = command.split_whitespace().map(|word| Path::new(word.trim_matches('\'')));
        let file = words.rev().find(|path| path.is_file())?;
        std::fs::read(file).ok().map(|bytes| tasks::in_digits(&bytes))
    }

    fn on(track: Track, name: &str) -> Option<Kind> {
        match track {
            Track::Decoder if name == AUTO => Some(Kind::Auto),
            Track::Decoder => find(name).map(Kind::Decoder),
            Track::Rows => designer(name).filter(|line| line.needs != RowNeeds::Classes).map(Kind::Rows),
            Track::Readout => READOUTS.iter().find(|line| line.name == name).map(Kind::Readout),
        }
    }

    /// Names on `track`.
    pub fn names(track: Track) -> Vec<String> {
        match track {
            Track::Decoder => {
                [AUTO].into_iter().chain(DECODERS.iter().map(|spec| spec.name)).map(str::to_owned).collect()
            }
            Track::Rows => {
                let there = DESIGNERS.iter().filter(|line| line.needs != RowNeeds::Classes);
                there.map(|line| line.name.to_owned()).collect()
            }
            Track::Readout => READOUTS.iter().map(|line| line.name.to_owned()).collect(),
        }
    }

    /// The entrant for what is `prepared`.
    ///
    /// # Errors
    /// [`Refusal`] if it cannot do the task.
    pub(crate) fn build(&self, prepared: &Prepared) -> Result<Box<dyn Entrant>, Refusal> {
        let shape = [prepared.layout.rows(), prepared.layout.cols()];
        let decoded = |trained| RowsAndDecoder::given(&prepared.weights()?, &prepared.measurements, trained);
        let random = |trained| Ok(Box::new(decoded(trained)?) as Box<dyn Entrant>);
        match &self.kind {
            Kind::Readout(line) => Ok((line.build)(&prepared.layout, prepared.streams)),
            Kind::Auto => random(prepared.trained(auto(shape, false))?),
            Kind::Decoder(spec) => random(prepared.trained(spec)?),
            Kind::Program(command) => program::start(command, self.track, prepared),
            Kind::Rows(designer) => {
                let expected = prepared.expected()?;
                let rows = prepared.measurements.iter().map(|m| {
                    let designed = (designer.build)().design(&RowTask::new(*m, &expected))?;
                    let signs = designed.view().values().iter().map(|level| if *level > 0.0 { 1.0 } else { -1.0 });
                    Matrix::from_rows(designed.nrows(), designed.ncols(), signs.collect())
                });
                let rows = rows.collect::<Result<Vec<_>, Refusal>>()?;
                Ok(Box::new(RowsAndDecoder::new(rows, prepared.trained(auto(shape, false))?)?))
            }
        }
    }
}

/// Distance over which images of larger skins are alike, taxels.
const SMOOTH_TAXELS: f64 = 1.5;
/// Most taxels of a skin whose images have a prior of their own.
const WHOLE_IMAGES: usize = 400;

/// What an entrant gets for one task before it begins.
pub(crate) struct Prepared {
    /// Rows, columns and pitch.
    pub(crate) layout: SkinLayout,
    /// Wires of the skin.
    pub(crate) wires: usize,
    /// Numbers of measurements for an answer.
    pub(crate) measurements: Vec<usize>,
    /// Touches to learn from, of other skins than those that are scored.
    pub(crate) training: Vec<Touch>,
    /// Numbers of the objects.
    pub(crate) labels: Labels,
    /// Random numbers of the entrant.
    pub(crate) streams: Streams,
}

/// Siemens in the unit of images and samples.
pub(crate) const UNIT_S: f64 = 1e-6;

impl Prepared {
    /// The images to learn from, µS, with their classes.
    fn images(&self) -> Result<TrainingData, Refusal> {
        let scaled = |touch: &Touch| touch.conductance_s.values().iter().map(|g| g / UNIT_S).collect::<Vec<f64>>();
        let columns: Vec<Vec<f64>> = self.training.iter().map(scaled).collect();
        let labels: Vec<usize> =
            self.training.iter().map(|touch| self.labels.number(&touch.name).unwrap_or_default()).collect();
        let images = Matrix::from_column_slices(self.layout.taxels(), &columns);
        TrainingData::of_images(images, &labels, self.layout.cols(), self.streams)
    }

    fn trained(&self, spec: &DecoderSpec) -> Result<TrainedDecoder, Refusal> {
        let data = match spec.needs {
            // nothing is learned there, and a decoder that has to is refused
            _ if self.layout.taxels() > TrainingData::MOST_TAXELS => {
                TrainingData::for_layout(&self.layout, self.streams)?
            }
            Needs::Shapes => TrainingData::for_shapes(&self.layout, self.streams)?,
            _ => self.images()?,
        };
        TrainedDecoder::new(spec, &data)
    }

    /// Moments of the images.
    fn expected(&self) -> Result<Expected, Refusal> {
        let shape = [self.layout.rows(), self.layout.cols()];
        if self.layout.taxels() > WHOLE_IMAGES {
            return Expected::smooth(shape, SMOOTH_TAXELS);
        }
        let prior = self.images()?.prior(ImagePrior::UNSEEN)?;
        Expected::like(&prior, shape, Tolerances::default())
    }

    /// The published cells' own rows: pseudorandom ±1 from mixed seeds, on as many wires as the skin has.
    fn weights(&self) -> Result<Weights, Refusal> {
        let taxels = u32::try_from(self.layout.taxels()).unwrap_or(u32::MAX);
        let bands = WireConfig { bands: Some(self.wires), ..WireConfig::default() };
        let wires = if self.wires > 1 { Wires::new(&[bands], &self.layout)? } else { None };
        Weights::new(WeightMode::Binary, Seeding::Mixed, taxels).wired(wires)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::touches::TouchScore;
    use spts_models::ConductanceMap;
    use std::sync::Arc;

    /// IoU with many measurements of a contact that stands out, at least: two thirds of the taxels are right.
    const LEAST_IOU: f64 = 0.6;
    /// Measurements that are enough for any readout.
    const MANY: usize = 2000;

    /// A plate of 4 × 3 taxels pressed on a skin, or nothing.
    fn plate(layout: &SkinLayout, pressed_s: f64) -> Touch {
        let (rows, cols) = (layout.rows(), layout.cols());
        let inside = |k: usize| (5..9).contains(&(k / cols)) && (2..5).contains(&(k % cols));
        let values = (0..rows * cols).map(|k| if inside(k) { pressed_s } else { 0.0 }).collect();
        Touch::new("plate".into(), ConductanceMap::from_values(rows, cols, values), layout)
    }

    /// Checks a readout on skins that are not square: images have one finite value ≥ 0 for each taxel, no more is
    /// measured than was allowed, a strong contact is shown, and equal wires give equal readings in any order of
    /// touches.
    fn conformance(line: &ReadoutLine, [rows, cols]: [usize; 2]) {
        let name = line.name;
        let layout = SkinLayout::with_pitch(rows, cols, 15e-3).expect("a skin");
        let entrant = (line.build)(&layout, Streams::new(7));
        let (touch, nothing) = (plate(&layout, 150e-6), plate(&layout, 0.0));
        let wire = SkinWire::new(layout, 1, touch.conductance_s.values()).expect(name);
        let idle_s = wire.electronics.skin.idle_s;
        let whole: Vec<f64> = touch.conductance_s.values().iter().map(|g| g + idle_s).collect();
        let largest_sum_s = entrant.largest_sum_s(&whole);
        let all_s: f64 = whole.iter().sum();
        assert!(largest_sum_s > 0.0 && largest_sum_s <= all_s + 1e-12, "{name}: {largest_sum_s} S of {all_s} S");
        let session = || wire.session(largest_sum_s, Streams::new(11), [].into()).expect(name);
        let (touch_trial, empty_trial) = (Trial::held(touch.clone()), Trial::held(nothing));
        let mut reader = entrant.start();
        let mut read = |session: &mut WireSession<'_>, trial: &Trial, number: u64, most: usize| {
            let reading = reader.read(session.hold(trial, number, 0.0, most).expect(name)).expect(name);
            assert_eq!(reading.image.len(), layout.taxels(), "{name}");
            assert!(reading.image.iter().all(|v| v.is_finite() && *v >= 0.0), "{name}: {:?}", reading.image);
            reading.image
        };
        let mut first = session();
        for most in [1, 7, 100] {
            read(&mut first, &touch_trial, most as u64, most);
        }
        let shown = read(&mut first, &touch_trial, 1000, MANY);
        let score = TouchScore::of(&shown, &touch, &layout);
        assert!(score.iou >= LEAST_IOU, "{name}: IoU {}", score.iou);
        assert!(score.place_px.is_some_and(|place| place < 1.0), "{name}: place {:?}", score.place_px);
        let idle = read(&mut first, &empty_trial, 1001, MANY);
        let mut second = session();
        let before = read(&mut second, &empty_trial, 1001, MANY);
        let again = read(&mut second, &touch_trial, 1000, MANY);
        assert!(before == idle && again == shown, "{name}: the order of touches shows");
        assert!(first.hold(&touch_trial, 1002, 0.0, 5).unwrap().scan(6).is_err(), "{name}: more than was allowed");
    }

    #[test]
    fn every_readout_conforms() {
        for line in READOUTS {
            // one that is decoded under a prior of whole images elsewhere, and a larger one
            for skin in [[12, 9], [24, 20]] {
                conformance(line, skin);
            }
        }
    }

    /// Dead cells tell nothing, stuck ones the same in every row, and late ones what the row before would.
    #[test]
    fn faults_are_on_the_wire() {
        let layout = SkinLayout::with_pitch(4, 4, 15e-3).unwrap();
        let mut values = vec![0.0; 16];
        (values[3], values[7], values[11]) = (100e-6, 100e-6, 100e-6);
        let wire = SkinWire::new(layout, 1, &values).unwrap();
        let rows = spts_circuit::Patterns::of_levels(
            2,
            &[(); 32].iter().enumerate().map(|(k, ())| if k < 16 { 1.0 } else { -1.0 }).collect::<Vec<f64>>(),
        )
        .unwrap();
        let signs = |faults: Arc<[(usize, Fault)]>| {
            let mut session = wire.session(300e-6, Streams::new(3), faults).unwrap();
            let touch = Touch::new("three".into(), ConductanceMap::from_values(4, 4, values.clone()), &layout);
            session.hold(&Trial::held(touch), 1, 0.0, 2).unwrap().signs(2, &rows, 2).unwrap().volts
        };
        let sound = signs([].into());
        // +300 µS and −300 µS in units of the wire; each taxel is a third of it
        let third = (sound[0] - sound[1]) / 6.0;
        let near = |found: f64, thirds: f64| (found / third - thirds).abs() < 0.5;
        assert!(near(sound[0], 3.0) && near(sound[1], -3.0), "{sound:?}");
        let found = signs([(3, Fault::Dead), (7, Fault::Stuck), (11, Fault::Late)].into());
        // row 0: dead 0, stuck +1, late neutral; row 1: 0, +1, +1 of row 0
        assert!(near(found[0], 1.0) && near(found[1], 2.0), "{found:?} in thirds of {third}");
    }

    #[test]
    fn names_are_told_apart() {
        assert_eq!(Choice::named("random", None).map(|c| c.track).ok(), Some(Track::Rows));
        assert_eq!(Choice::named("amortised", None).map(|c| c.track).ok(), Some(Track::Decoder));
        assert_eq!(Choice::named("events", None).map(|c| c.track).ok(), Some(Track::Readout));
        let error = |name: &str| Choice::named(name, Some(Track::Rows)).err().unwrap().to_string();
        assert_eq!(error("events"), "\"events\" is of the track readout");
        assert!(error("nobody").contains("valid names: random, cosine_signs"), "{}", error("nobody"));
    }
}
