//! `spts score`: decoders side by side on recordings.

use crate::Bars;
use crate::context::{Common, note, notes, open_folder, print, progress};
use crate::error::CliError;
use crate::options::{
    decoders_named, network, number, seed, sensing, skin_gains, sorted, sorted_numbers, whole, within,
};
use crate::simulated::{simulated_presses, simulated_sessions};
use clap::Args;
use serde::Serialize;
use spts::output::{OutputFolder, check_replaceable, write_json};
use spts::progress::Progress as _;
use spts::session::parse_json;
use spts_contact::objects::OBJECTS;
use spts_eval::algorithm::Contender;
use spts_eval::anytime::{self, StopSettings};
use spts_eval::board::{
    BoardSettings, Difference, Regression, ScoreBoard, TrainedBoard, differences, regressions, table,
};
use spts_eval::decode::DecodeRequest;
use spts_eval::decoders::{DECODERS, auto, no_confidence, not_in_time};
use spts_eval::external::ExternalCommand;
use spts_eval::training::{
    CALIBRATED, PUBLISHED, PoseKnowledge, PosedObject, RASTER, SHAPES, TrainedNetwork, TrainingData, TrainingSource,
    simulated_gain_sd,
};
use spts_eval::{Alignment, ScoredSession, Sensing, Source, in_time, slips_text, unaligned_text};
use spts_input::Refusal;
use spts_models::SkinLayout;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// Scores decoders side by side on recordings of a skin.
///
/// Every decoder gets the same windows of M consecutive measurements of the scored presses, and is scored against the
/// same true image. For simulated presses, the true image is the conductance of the taxels. For real presses, it is the
/// non-negative least-squares image of the same press, from all samples of the hold except those of the window; this
/// needs eight samples for each taxel, and at most 600 taxels. Otherwise it is one frame of a raster scan of another
/// press, as in the publication. The ceiling, an IoU, says how accurate the true image itself is. If a session has
/// fewer than 15 presses, all are scored. Of a longer session, ten presses are scored; those before them condition the
/// skin.
///
/// The scores are: IoU of the supports (the taxels above 23 % of the maximum), with the 95 % interval over objects,
/// their sessions and presses, and the object with the lowest; cosine and weighted Jaccard index of the images, which
/// have no threshold; IoU by the raster frame; support accuracy and F1; the share of correct classes of single windows,
/// of votes of 20 windows, and of evidence added up over 20 windows; the time of a decode on one thread, beside the
/// time in which the measurements arrive; and the error of the place of the bouncing ball and of touches, such as those
/// of the skin around a robot's arm. The ball's place is scored as recorded, where all drops fall on the middle of the
/// skin, and with the taxels renumbered so that the contact moves over the whole skin. A bent skin has an output even
/// without a touch; the output of the frames before the touch is subtracted.
///
/// Nothing is learned from a compressive measurement: dictionaries, priors and templates come from raster presses that
/// are not scored. There is one exception, which the published evaluation has too: the published library holds raster
/// frames of scored presses. Use `--learn-from raster` to classify without it.
/// With `--learn-from FILE.toml`, the gains in the file may have been fitted to the scored objects as well, and their
/// mounting is estimated from compressive samples of presses 1-5. `--learn-from calibrated` uses neither the scored
/// object nor a compressive sample.
///
/// Where the cells have missed clock edges, the samples lag behind their rows of weights. The command finds such lags
/// by fitting an image at every contact, puts the samples back on their rows, and says so in a note; `slips` of --json
/// has every place: session, block, `from` (the first measurement that lags) and `rows` (by how many).
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts score recordings/
  spts score recordings/ --decoder omp,nn_lasso,evidence --measurements 7,13,20 --left-out
  spts score recordings/ --learn-from raster,simulation --out out/from_simulation
  spts score recordings/ --learn-from shapes --left-out --measurements 7,20,25
  spts score recordings/ --sensing random,chosen --left-out --decoder nn_lmmse --measurements 13,20,25
  spts score recordings/ --anytime --sensing random,chosen --left-out
  spts score recordings/ --in-time --left-out
  spts score --twin --anytime --decoder evidence --confidence 0.9,0.95
  spts score recordings/ --external 'mine=python3 my_decoder.py' --decoder matched
  spts score recordings/ --left-out --external my_class.py
  spts score recordings/ --save board.json
  spts score --twin --quick
  spts score --twin my_skin.toml --external 'mine=python3 my_decoder.py' --measurements 20,50
  spts score recordings/ --against board.json --tolerance 0.005 || echo regression

An external program (--external) is run by the shell. A Python file with a class that has fit(train) and predict(phi, y)
needs no protocol (docs/benchmark.md). Any other program first reads a header line {\"taxels\", \"rows\", \"cols\",
\"left_out\", \"classes\": {\"1\": \"brain\", ...}, \"learn\": {\"images\": [[...], ...], \"labels\": [...]}}; `learn`
is the training data, raster images and their labels. It then reads one line for each window, {\"m\", \"phi\":
[\"+-+...\", ...], \"y\", \"volts\"}: the number of samples, the rows of weights, the samples minus the output of the
untouched skin, and the samples, both in V. If weights are not +1 or -1, phi has an array of numbers in place of each
string of signs. The program answers each window at once with a line {\"image\": [...]} or {\"label\": N} or both. An
image without a label is classified by the published classifier, as the images of the other decoders are. A program that
answers only labels has no scores of images. When its input ends, the program has to end with status 0.

An image has one finite value for each taxel; a label is one of the numbers in `classes`. Nothing else may be written to
standard output. If an answer is invalid or later than --external-timeout, or the exit status is not 0, the program is
stopped and nothing is scored.

Files in DIR:
  board.json                 everything (--save writes the same); board.csv, objects.csv, localisation.csv
  figures/                   reconstruction, classification and localisation over M and over time, .svg and .png
With --anytime:
  anytime.json               everything; anytime.csv, objects.csv
  figures/                   anytime: error of classes and images over the number of samples used; reliability: what
                             was attained over what was stated; .svg and .png
With --in-time:
  in_time.json               everything; in_time.csv, objects.csv
  figures/                   in_time: IoU of presses and place of the ball over the time since the touch, .svg and .png

Exit status: 1 when a score fell below --against by more than --tolerance.")]
pub(super) struct ScoreCommand {
    /// Session, folder of sessions, or recordings of the real skin (see `spts validate --help` for their layout)
    #[arg(required_unless_present_any = ["list", "twin"], conflicts_with = "twin")]
    recordings: Option<PathBuf>,
    /// Score sessions that the twin simulates now, instead of recordings: of the named scenes (press/NAME, or files
    /// that end in .toml, of any layout), or of five objects when none is named. Six presses of each are scored, or as
    /// many as the scene file says with `press.presses`; eight more are scanned, to learn from
    /// [default: score RECORDINGS]
    #[arg(long, value_name = "SCENE", num_args = 0..)]
    twin: Option<Vec<String>>,
    /// With --twin: fewer presses, except of scene files that say `press.presses`
    #[arg(long)]
    quick: bool,
    /// Decoders to score, or `all`; --list shows their names [default: those that --list marks with a star]
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    decoder: Vec<String>,
    /// List the decoders
    #[arg(long)]
    list: bool,
    /// A decoder of your own, a program given as COMMAND or NAME=COMMAND; repeat for several [default: none]
    #[arg(long, value_name = "COMMAND")]
    external: Vec<String>,
    /// Time limit of an external program for each window, s, [0.1, 86400]
    #[arg(
        long,
        value_name = "SECONDS",
        default_value_t = ExternalCommand::DEFAULT_LIMIT.as_secs_f64(),
        requires = "external",
        allow_hyphen_values = true
    )]
    external_timeout: f64,
    /// Score decoding up to a wanted confidence, in place of windows of fixed length: every decoder is given the
    /// samples of a window one by one, until its confidence reaches --confidence or it has the largest of
    /// --measurements. The table shows how many samples it needed and how often it was right, beside the same for
    /// windows of each of --measurements. Only decoders that state a confidence are scored: `evidence` (the probability
    /// of its class), and `nn_lmmse` and `amortised` (the expected IoU of the image)
    #[arg(long, conflicts_with_all = ["external", "save", "against", "no_ball", "no_times"])]
    anytime: bool,
    /// Score images that follow a contact in time, in place of separate windows: the decoder is given all windows of a
    /// press or a drop in order, from before the touch on, and remembers them. Its images are scored at set times after
    /// the touch and during the hold, beside images of the same windows decoded one by one. Only for `nn_lmmse`, which
    /// has a Gaussian prior; --no-ball leaves out the drops
    #[arg(long, conflicts_with_all = ["anytime", "external", "save", "against", "no_times"])]
    in_time: bool,
    /// Wanted confidences, each in (0.5, 1) [default: 0.8,0.9,0.95,0.99 for classes; 0.6,0.7,0.8 for images]
    #[arg(long, value_name = "P,...", value_delimiter = ',', requires = "anytime", value_parser = number)]
    confidence: Vec<f64>,
    /// Numbers of samples M in a window; each [1, 1000000]; with --anytime the largest is the most that a window takes
    /// [default: 5,7,10,13,20,25,50,100, and 1, 2 and 5 % of more than 2048 taxels; with --in-time 5,7,10,20; for
    /// places 5,7,10,15,20,25]
    #[arg(long, value_name = "M,...", value_delimiter = ',', value_parser = whole::<u32>(1..=1_000_000))]
    measurements: Vec<u32>,
    /// Objects that are scored [default: all with a compressive session]
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    object: Vec<String>,
    /// Leave out the bouncing ball and the touches
    #[arg(long)]
    no_ball: bool,
    /// Score every decoder also on objects that it has not learned from
    #[arg(long)]
    left_out: bool,
    /// What to learn from; with several sources, every decoder learns from each. `published`: the dictionary and
    /// library beside the recordings, everything else from raster presses. `raster`: raster presses that are not
    /// scored. `simulation`: simulated presses of the objects, with places known to half a taxel, rotations known to
    /// 15°, and unknown tilts. `simulation_fitted`: presses on 32 simulated skins, with places that were fitted to the
    /// published recordings. `calibrated`: presses at the same places, simulated with the gains of the scored skin; the
    /// gains are estimated from unscored raster presses of the other objects. FILE.toml: the same with the gains in
    /// this file, which `spts calibrate --skin` writes. `shapes`: simulated presses of procedural shapes, with no
    /// object and no recording; the decoders that learn from nothing else, `mixture` and `amortised`, are then shown
    /// too. DIR: other recordings, such as those that `spts reproduce --save-recordings` writes
    #[arg(long, value_name = "SOURCE,...", value_delimiter = ',', default_value = PUBLISHED)]
    learn_from: Vec<String>,
    /// Trained network of the decoder `amortised`, a file that `python -m spts.amortised` writes [default: the
    /// network that ships]
    #[arg(long, value_name = "FILE")]
    weights: Option<PathBuf>,
    /// How the measurements of a window are selected; with both, every decoder is scored with each. `random`:
    /// consecutive measurements, with the rows that the cells put out. `chosen`: M measurements of the hold whose rows
    /// suit what the decoder has learned; neither the object nor a sample influences the choice. Every press gives
    /// three such windows, each from every third measurement. Chosen rows lose the order in time and have no votes
    #[arg(long, value_name = "KIND,...", value_delimiter = ',', default_value = "random", value_parser = sensing())]
    sensing: Vec<Sensing>,
    /// Choose rows that keep the largest expected error of any kind of image small, in place of the mean expected error
    /// of all images; only for `--sensing chosen`. A kind is a family of shapes with `--learn-from shapes`, an object
    /// with any other source, and a width of the blobs for places. Rows for classification are the same with and
    /// without this option: they separate the classes that are hardest to tell apart. The tables call rows for images
    /// `worst_kind`
    #[arg(long)]
    worst_kind: bool,
    /// Leave the times of decoding out, so that the output is the same from run to run
    #[arg(long)]
    no_times: bool,
    /// Also write the score table to FILE, to compare a later one with it by --against [default: none]
    #[arg(long, value_name = "FILE")]
    save: Option<PathBuf>,
    /// Compare the scores with the earlier score table in FILE, which --save wrote [default: none]
    #[arg(long, value_name = "FILE")]
    against: Option<PathBuf>,
    /// How much a score may fall below that of --against, a share in [0, 1]; distances may grow by the same number, in
    /// taxels
    #[arg(
        long,
        value_name = "SHARE",
        default_value_t = 0.005,
        requires = "against",
        value_parser = within(0.0, 1.0, "[0, 1]")
    )]
    tolerance: f64,
    /// Folder of the tables and figures [default: out/score; with --anytime out/anytime, with --in-time out/in_time]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Root of the random numbers of dictionary learning and simulated skins; with --twin also the seed of the scenes
    #[arg(long, default_value_t = 1, value_name = "SEED", value_parser = seed)]
    seed: u64,
    #[command(flatten)]
    common: Common,
}

/// The default numbers of measurements of `--in-time`.
const IN_TIME_MEASUREMENTS: [usize; 4] = [5, 7, 10, 20];

/// What the command reports.
#[derive(Debug, Serialize)]
struct BoardOutput<'a> {
    #[serde(flatten)]
    board: &'a ScoreBoard,
    #[serde(skip_serializing_if = "Option::is_none")]
    regressions: Option<&'a [Regression]>,
    /// What this board and that of `--against` do not have in common.
    #[serde(skip_serializing_if = "Option::is_none")]
    differences: Option<&'a [Difference]>,
}

impl ScoreCommand {
    /// Runs the command.
    pub(super) fn run(&self) -> Result<(), CliError> {
        if self.list {
            return print(&list());
        }
        if self.quick && self.twin.is_none() {
            let reason = "recordings have the presses they have; leave it out, or score the twin with `--twin`";
            return Err(CliError::usage(format!("`--quick`: {reason}")));
        }
        let [least, most] = ExternalCommand::LIMIT_S;
        if !(least..=most).contains(&self.external_timeout) {
            return Err(CliError::usage(format!(
                "`--external-timeout` = {}; valid: [{least}, {most}] s",
                self.external_timeout
            )));
        }
        if self.anytime {
            return self.stop_early();
        }
        if self.in_time {
            return self.follow_in_time();
        }
        if let Some(path) = &self.save {
            check_board(path)?;
        }
        let before = self.against.as_deref().map(read_board).transpose()?;
        let (board, out) = self.scored(&|_| None, |ready, bars| {
            let mut board = ready.score(&|| bars.step())?;
            bars.stage("places", None);
            board.localisation = ready.localise()?;
            Ok(board)
        })?;
        let found = before.as_ref().map(|before| regressions(before, &board, self.tolerance));
        let apart = before.as_ref().map(|before| differences(before, &board));
        let shown = BoardOutput { board: &board, regressions: found.as_deref(), differences: apart.as_deref() };
        self.finish(&shown, table(&board), || {
            spts_report::score::write(&board, out)?;
            self.save.as_deref().map_or(Ok(()), |path| write_json(path, &board))
        })?;
        if let Some(file) = &self.against {
            note_differences(file, apart.as_deref().unwrap_or_default());
        }
        verdict(found.as_deref().unwrap_or_default())
    }

    /// Runs the command with `--anytime`.
    fn stop_early(&self) -> Result<(), CliError> {
        let wanted = self.wanted()?;
        let can = |settings: &BoardSettings| {
            let unable = settings.decoders.iter().find(|spec| !spec.anytime)?;
            Some(no_confidence(unable.name).to_string())
        };
        let (board, out) = self.scored(&can, |ready, bars| ready.stops(&wanted, &|| bars.step()))?;
        self.finish(&board, anytime::table(&board), || spts_report::score::write_anytime(&board, out))
    }

    /// Runs the command with `--in-time`.
    fn follow_in_time(&self) -> Result<(), CliError> {
        let can = |settings: &BoardSettings| {
            if let Some(unable) = settings.decoders.iter().find(|spec| spec.name != "nn_lmmse") {
                return Some(not_in_time(unable.name).to_string());
            }
            let reason = "`--sensing`: chosen rows have no order in time; leave it out with `--in-time`";
            (settings.sensing != [Sensing::Random]).then(|| reason.to_owned())
        };
        let (board, out) = self.scored(&can, |ready, bars| ready.in_time(&|| bars.step()))?;
        self.finish(&board, in_time::table(&board), || spts_report::score::write_in_time(&board, out))
    }

    /// A board by `score`, and the folder for it, unless `refused` has a reason against the settings.
    fn scored<B>(
        &self,
        refused: &dyn Fn(&BoardSettings) -> Option<String>,
        score: impl FnOnce(&TrainedBoard<'_>, &Bars) -> Result<B, Refusal>,
    ) -> Result<(B, OutputFolder), CliError> {
        self.common.start()?;
        let out = open_folder(self.out())?;
        let settings = self.settings()?;
        if let Some(reason) = refused(&settings) {
            return Err(CliError::usage(reason));
        }
        let source = self.source()?;
        let settings = BoardSettings { training: self.training(&source)?, ..self.fitting(settings, &source) };
        let bars = Bars::default();
        bars.stage("learning", None);
        let scored = settings.learn(&source).and_then(|ready| {
            bars.stage("presses", Some(ready.steps()));
            score(&ready, &bars)
        });
        bars.end();
        Ok((scored?, out))
    }

    /// Prints a board before it is written, so that a disk that is full does not cost the run, and says where it is.
    fn finish(
        &self,
        board: &impl Serialize,
        table: String,
        write: impl FnOnce() -> Result<(), Refusal>,
    ) -> Result<(), CliError> {
        self.common.print(board, || table)?;
        write()?;
        if self.common.json {
            return Ok(());
        }
        print(&format!("\ntables and figures: {}", self.out().display()))
    }

    /// The wanted confidences.
    fn wanted(&self) -> Result<StopSettings, CliError> {
        if let Some(outside) = self.confidence.iter().find(|p| !(**p > 0.5 && **p < 1.0)) {
            return Err(CliError::usage(format!("`--confidence` = {outside} is outside (0.5, 1)")));
        }
        if self.confidence.is_empty() {
            return Ok(StopSettings::default());
        }
        let wanted = sorted_numbers(self.confidence.clone());
        Ok(StopSettings { class: wanted.clone(), image: wanted })
    }

    /// The sessions that are scored; a note says which of them slip.
    fn source(&self) -> Result<Source, CliError> {
        let source = match &self.twin {
            Some(scenes) => simulated_sessions(scenes, self.seed, self.quick)?,
            None => Source::open(self.recordings.as_deref().unwrap_or(Path::new("")))?,
        };
        let Alignment { slips, unaligned } = &source.alignment;
        notes(slips_text(slips).iter().chain(&unaligned_text(unaligned)).chain(&source.note));
        Ok(source)
    }

    /// What is learned from to score `scored`.
    fn training(&self, scored: &Source) -> Result<Vec<TrainingSource>, CliError> {
        let mut skins = SimulatedSkins::default();
        if self.left_out && self.learn_from.iter().any(|name| name.ends_with(".toml")) {
            note(
                "note: gains in a file may have been fitted to the objects that are left out; `calibrated` leaves them out",
            );
        }
        let training = self.learn_from.iter();
        training.map(|name| training_source(name, scored, self.seed, &mut skins)).collect()
    }

    /// The same without decoders that nobody named and that have no weights for the skin.
    fn fitting(&self, mut settings: BoardSettings, scored: &Source) -> BoardSettings {
        let layout = &scored.layout;
        let taxels = layout.taxels();
        if taxels > TrainingData::MOST_TAXELS && !scored.learns() && !scored.drops.is_empty() && !self.no_ball {
            note("note: places of the ball are left out: their locators learn from scans, of which there are none");
        }
        let usual = !self.anytime && !self.in_time;
        let unnamed = self.decoder.is_empty() && self.external.is_empty() && self.learn_from == [PUBLISHED];
        if taxels > TrainingData::MOST_TAXELS && !scored.learns() && usual && unnamed {
            let auto = auto([layout.rows(), layout.cols()], self.weights.is_some());
            settings.decoders.retain(|spec| spec.name == "empty");
            settings.decoders.push(auto);
            note(&format!(
                "note: {taxels} taxels and nothing to learn from: {} is scored, beside an empty image",
                auto.name
            ));
        }
        if taxels > TrainingData::MOST_TAXELS && self.measurements.is_empty() && usual {
            settings.measurements = DecodeRequest::default_measurements(taxels);
        }
        let fits = TrainedNetwork::shipped().on([layout.rows(), layout.cols()]);
        if let (true, None, Err(error)) = (self.decoder.is_empty(), &self.weights, fits) {
            let before = settings.decoders.len();
            settings.decoders.retain(|spec| spec.name != "amortised");
            if settings.decoders.len() < before {
                note(&format!("note: left out: {error}"));
            }
        }
        settings
    }

    /// What is scored, but for what it learns from.
    fn settings(&self) -> Result<BoardSettings, CliError> {
        let decoders = if self.decoder.is_empty() {
            if self.in_time {
                decoders_named(&["nn_lmmse".to_owned()], None)?
            } else if self.anytime {
                DECODERS.iter().filter(|spec| spec.anytime && spec.shown).collect()
            } else if self.external.is_empty() {
                let shapes = self.learn_from.iter().any(|name| name == SHAPES);
                let unseen = DECODERS.iter().filter(|spec| shapes && spec.needs.shapes());
                BoardSettings::shown().into_iter().chain(unseen).collect()
            } else {
                Vec::new()
            }
        } else {
            decoders_named(&self.decoder, None)?
        };
        let limit = Duration::from_secs_f64(self.external_timeout);
        let external =
            self.external.iter().map(|text| ExternalCommand { limit, first: limit, ..ExternalCommand::parse(text) });
        let external: Vec<Arc<dyn Contender>> = external.map(|e| Arc::new(e) as Arc<dyn Contender>).collect();
        let names = decoders.iter().map(|d| d.name).chain(external.iter().map(|e| e.name()));
        let names: Vec<&str> = names.collect();
        if let Some((k, name)) = names.iter().enumerate().find(|(k, name)| names[..*k].contains(*name)) {
            let option = if k < decoders.len() { "--decoder" } else { "--external" };
            return Err(CliError::usage(format!(
                "`{option}`: {name:?} is there twice; give every one a name of its own"
            )));
        }
        let mut measurements: Vec<usize> = self.measurements.iter().map(|m| *m as usize).collect();
        if measurements.is_empty() {
            measurements =
                if self.in_time { IN_TIME_MEASUREMENTS.to_vec() } else { BoardSettings::MEASUREMENTS.to_vec() };
        }
        let localisation = match (self.no_ball || self.anytime, self.measurements.is_empty() || self.in_time) {
            (true, _) => Vec::new(),
            (false, true) => BoardSettings::LOCALISATION.to_vec(),
            (false, false) => sorted(measurements.clone()),
        };
        Ok(BoardSettings {
            decoders,
            external,
            measurements: sorted(measurements),
            objects: self.object.clone(),
            localisation,
            left_out: self.left_out,
            sensing: sorted(self.sensing()?),
            training: Vec::new(),
            network: self.weights.as_deref().map(network).transpose()?,
            times: !self.no_times,
            seed: self.seed,
        })
    }

    /// How rows are obtained.
    fn sensing(&self) -> Result<Vec<Sensing>, CliError> {
        if self.worst_kind && !self.sensing.contains(&Sensing::Chosen) {
            let reason = "no rows are chosen; add `--sensing chosen`, or leave it out";
            return Err(CliError::usage(format!("`--worst-kind`: {reason}")));
        }
        let worst = |sensing| if sensing == Sensing::Chosen { Sensing::WorstKind } else { sensing };
        Ok(self.sensing.iter().map(|&sensing| if self.worst_kind { worst(sensing) } else { sensing }).collect())
    }

    /// Folder of the results.
    fn out(&self) -> &Path {
        let default = match (self.anytime, self.in_time) {
            (true, _) => "out/anytime",
            (_, true) => "out/in_time",
            _ => "out/score",
        };
        self.out.as_deref().unwrap_or(Path::new(default))
    }
}

fn list() -> String {
    let lines = DECODERS.iter().map(|spec| {
        let mark = if spec.shown { "*" } else { " " };
        format!("{mark} {:<14} {:<22} {}", spec.name, spec.short, spec.about)
    });
    let lines: Vec<String> = lines.collect();
    format!("{}\n\n* shown when no decoder is named", lines.join("\n"))
}

/// Says what this board and the earlier one, which is in `file`, do not have in common.
fn note_differences(file: &Path, found: &[Difference]) {
    let file = file.display();
    for Difference { what, only_before, only_now } in found {
        let sides = [(format!("only in {file}"), only_before), ("only in this run".to_owned(), only_now)];
        let sides = sides.iter().filter(|(_, names)| !names.is_empty());
        let sides: Vec<String> = sides.map(|(side, names)| format!("{side}: {}", names.join(", "))).collect();
        let means = if *what == "objects" { "; the means are over different objects" } else { "" };
        note(&format!("note: {what} {}{means}", sides.join("; ")));
    }
}

/// Says which scores fell, and which rows of the earlier board this one lacks.
///
/// # Errors
/// [`CliError::Differs`] when there are any.
fn verdict(found: &[Regression]) -> Result<(), CliError> {
    if found.is_empty() {
        return Ok(());
    }
    for r in found {
        if let Some(now) = r.now {
            note(&format!("{}: {} was {:.4}, is {now:.4}", r.what, r.score, r.before));
        }
    }
    let gone: Vec<&Regression> = found.iter().filter(|r| r.now.is_none()).collect();
    for row in gone.chunk_by(|a, b| a.what == b.what) {
        let scores: Vec<&str> = row.iter().map(|r| r.score).collect();
        note(&format!("{}: not scored in this run: {}", row[0].what, scores.join(", ")));
    }
    let fell = found.len() - gone.len();
    Err(CliError::Differs(format!("{fell} scores fell, {} are gone", gone.len())))
}

/// Refuses to save a board where one cannot be written, and in place of a file that is no board.
fn check_board(path: &Path) -> Result<(), CliError> {
    Ok(check_replaceable(path, |path| any_board(path).is_ok())?)
}

/// Largest board that is read, bytes: one of all decoders, sources and objects has less than 1 MB.
const MAX_BOARD_BYTES: u64 = 1 << 25;

/// The board in a file that `--save` wrote, of any version.
fn any_board(path: &Path) -> Result<ScoreBoard, CliError> {
    let text = spts_input::read_text(path, MAX_BOARD_BYTES).map_err(Refusal::in_file(path))?;
    Ok(parse_json(path, &text).map_err(|refusal| refusal.reworded(|said| format!("{said}; `--save` writes boards")))?)
}

/// The board in a file that `--save` wrote, scored as this program scores.
pub(crate) fn read_board(path: &Path) -> Result<ScoreBoard, CliError> {
    let board = any_board(path)?;
    if board.version != ScoreBoard::VERSION {
        let problem = format!(
            "`version` is {}, expected {}: its images were held against another truth; save it anew with `--save`",
            board.version,
            ScoreBoard::VERSION
        );
        return Err(Refusal::new(problem).at(path.display()).into());
    }
    Ok(board)
}

/// Name of what is learned from the objects in all their poses.
const SIMULATION: &str = "simulation";
/// Name of what is learned from simulated skins on which the objects lie as in the published recordings.
const SIMULATION_FITTED: &str = "simulation_fitted";

/// Simulated presses, made once for all sources that need them.
#[derive(Debug, Default)]
struct SimulatedSkins {
    usual: Option<Vec<ScoredSession>>,
    median: Option<Vec<ScoredSession>>,
}

/// The source `name` for decoders that are scored on `scored`; simulated skins are pressed once and kept in `skins`.
///
/// # Errors
/// [`CliError`] when a folder cannot be opened or nothing can be simulated on the skin.
fn training_source(
    name: &str,
    scored: &Source,
    seed: u64,
    skins: &mut SimulatedSkins,
) -> Result<TrainingSource, CliError> {
    let mut presses = |median: bool| -> Result<Vec<ScoredSession>, CliError> {
        let skins = if median { &mut skins.median } else { &mut skins.usual };
        if let Some(sessions) = skins {
            return Ok(sessions.clone());
        }
        let sessions = simulated_presses(scored.layout, median, seed)?;
        Ok(skins.insert(sessions).clone())
    };
    Ok(match name {
        PUBLISHED => TrainingSource::Published,
        RASTER => TrainingSource::Raster,
        SHAPES => TrainingSource::Shapes,
        SIMULATION => {
            TrainingSource::Poses { name: SIMULATION.to_owned(), objects: posed_objects(&scored.layout, seed)? }
        }
        SIMULATION_FITTED => TrainingSource::Other {
            name: SIMULATION_FITTED.to_owned(),
            sessions: presses(false)?,
            all: true,
            gain_sd: simulated_gain_sd(),
        },
        CALIBRATED => {
            TrainingSource::Calibrated { name: CALIBRATED.to_owned(), simulated: presses(true)?, gains: None }
        }
        file if Path::new(file).extension().is_some_and(|e| e == "toml") => TrainingSource::Calibrated {
            name: file.to_owned(),
            gains: Some(skin_gains(Path::new(file), &scored.layout)?),
            simulated: presses(true)?,
        },
        dir => {
            let source = Source::open(Path::new(dir))?;
            // of the scored sessions themselves, the presses that are not scored
            let all = source.simulated && !source.shares_raster(scored);
            TrainingSource::Other {
                name: dir.to_owned(),
                sessions: source.sessions,
                all,
                gain_sd: if all { simulated_gain_sd() } else { 0.0 },
            }
        }
    })
}

/// The objects in all the poses that they may have.
fn posed_objects(layout: &SkinLayout, seed: u64) -> Result<Vec<PosedObject>, CliError> {
    let bar = progress(OBJECTS.len(), "simulated objects");
    let objects = PoseKnowledge::default().press(layout, seed, &|| bar.inc(1));
    bar.finish_and_clear();
    objects.map_err(|e| CliError::usage(format!("simulated objects: {e}")))
}
