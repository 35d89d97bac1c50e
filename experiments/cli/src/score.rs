//! `spts score`: decoders side by side on recordings.

use super::context::{Common, note, print, print_json, progress, spinner};
use super::error::CliError;
use clap::Args;
use serde::Serialize;
use spts::output::{OutputFolder, write_json};
use spts_eval::board::{Plan, Regression, ScoreBoard, regressions, table};
use spts_eval::decoders::{DECODERS, Spec, find};
use spts_eval::external::ExternalCommand;
use spts_eval::training::{CALIBRATED, PUBLISHED, RASTER, Skins, TrainingSource};
use spts_eval::{ScoreError, ScoredSession, Source, TwinSessions};
use spts_models::SkinLayout;
use spts_report::score::write;
use spts_sim::objects::OBJECTS;
use std::path::{Path, PathBuf};

/// Scores decoders side by side on recordings of a skin.
///
/// Every decoder sees the same windows of M consecutive measurements of presses 6-15, and is scored against the same true image: support
/// accuracy, IoU and F1, classes of single windows, of votes of 20 and of evidence added up over 20, the time of a decode on one thread
/// beside the time in which the measurements arrive, and the place of the bouncing ball, as recorded and with the taxels relabelled.
/// Nothing is learned from a compressive measurement: dictionaries, priors and templates come from raster presses that are not scored.
/// The published library, by which images are classified with `published`, has raster frames of scored presses among its own, as the
/// published evaluation has; `--learn-from raster` knows none of them.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts score recordings/
  spts score recordings/ --decoder omp,nn_lasso,evidence --measurements 7,13,20 --left-out
  spts score recordings/ --learn-from raster,simulation --out out/from_simulation
  spts score recordings/ --external 'mine=python3 my_decoder.py' --decoder matched
  spts score recordings/ --save board.json
  spts score --twin --quick
  spts score --twin my_skin.toml --external 'mine=python3 my_decoder.py' --measurements 20,50
  spts score recordings/ --against board.json --tolerance 0.005 || echo regression

An external program (--external) is run by the shell. It reads a header line {\"taxels\", \"rows\", \"cols\", \"left_out\", \"learn\",
\"classes\": {\"1\": \"brain\", ...}} and then one line a window, {\"m\", \"phi\": [\"+-+...\", ...], \"y\", \"volts\"}, and answers each at once
with a line {\"image\": [...]} or {\"label\": N} or both; one that answers labels only has no scores of images. Where weights are not +1 or
-1, phi has an array of numbers in place of each string of signs. With {windows} and {answers} in the command it runs for every press and M instead, on .npz files: phi
(windows x M x taxels), y, volts in; images or labels out. {learn} (header: learn) is an .npz with images and labels to learn from. An image
without a label is classified by the published classifier, as those of the other decoders are. A window has to be answered within 60 s.

Files in DIR:
  board.json                 everything (--save writes the same); board.csv, objects.csv, localisation.csv
  figures/                   reconstruction, classification and localisation over M and over time, .svg and .png

Exit status: 1 when a score fell below --against by more than --tolerance.")]
pub(super) struct Score {
    /// Session, folder of sessions, or recordings of the real skin (see `spts validate --help` for their layout)
    #[arg(required_unless_present_any = ["list", "twin"], conflicts_with = "twin")]
    recordings: Option<PathBuf>,
    /// Score sessions that the twin makes on the spot, with no recordings at hand: of the scenes that are named (press/NAME, or files that
    /// end in .toml, of any layout), or of five objects
    #[arg(long, value_name = "SCENE", num_args = 0..)]
    twin: Option<Vec<String>>,
    /// With --twin: fewer presses
    #[arg(long, requires = "twin")]
    quick: bool,
    /// Decoders, or `all`; see --list [default: the usual ones]
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    decoder: Vec<String>,
    /// List the decoders
    #[arg(long)]
    list: bool,
    /// A program of your own, with a name if you like: NAME=COMMAND; repeat for several
    #[arg(long, value_name = "COMMAND")]
    external: Vec<String>,
    /// Numbers of measurements [default: 5,7,10,13,20,25,50,100]
    #[arg(long, value_name = "M,...", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..=10_000))]
    measurements: Vec<u32>,
    /// Objects that are scored [default: all with a compressive session]
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    object: Vec<String>,
    /// Leave out the bouncing ball
    #[arg(long)]
    no_ball: bool,
    /// Score every decoder also on objects that it has not learned from
    #[arg(long)]
    left_out: bool,
    /// What to learn from: `published` (dictionary and library beside the recordings, the rest from raster presses), `raster`, `simulation`
    /// (presses on 32 simulated skins), `calibrated` (the same with the skin's gains, as unscored presses of the other objects tell them),
    /// or another directory of recordings, as the twin's of `spts reproduce --save-recordings`; with several, every decoder learns from each
    #[arg(long, value_name = "SOURCE,...", value_delimiter = ',', default_value = PUBLISHED)]
    learn_from: Vec<String>,
    /// Leave out the times, so that the output is the same from run to run
    #[arg(long)]
    no_times: bool,
    /// Write the board to FILE
    #[arg(long, value_name = "FILE")]
    save: Option<PathBuf>,
    /// Hold the board against the one in FILE
    #[arg(long, value_name = "FILE")]
    against: Option<PathBuf>,
    /// How much a score may fall below the earlier one, [0, 1]; distances may grow by as many taxels
    #[arg(
        long,
        value_name = "SHARE",
        default_value_t = 0.005,
        requires = "against",
        allow_hyphen_values = true
    )]
    tolerance: f64,
    /// Folder of the tables and figures
    #[arg(long, value_name = "DIR", default_value = "out/score")]
    out: PathBuf,
    /// Root of the random numbers of dictionary learning
    #[arg(long, default_value_t = 1, value_name = "SEED")]
    seed: u64,
    #[command(flatten)]
    common: Common,
}

/// Name of what is learned from simulated skins.
const SIMULATION: &str = "simulation";

/// What the command reports.
#[derive(Debug, Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    board: &'a ScoreBoard,
    #[serde(skip_serializing_if = "Option::is_none")]
    regressions: Option<&'a [Regression]>,
}

impl Score {
    /// Runs the command.
    pub(super) fn run(&self) -> Result<(), CliError> {
        if self.list {
            return print(&list());
        }
        if !(0.0..=1.0).contains(&self.tolerance) {
            return Err(CliError::Usage(format!(
                "`--tolerance` = {}; valid: [0, 1]",
                self.tolerance
            )));
        }
        self.common.start()?;
        OutputFolder::check(&self.out)?;
        let before = self.against.as_deref().map(read_board).transpose()?;
        let plan = self.plan()?;
        let source = self.source()?;
        let plan = Plan {
            training: self.training(source.layout)?,
            ..plan
        };
        let board = score(&plan, &source)?;
        let found = before.map(|before| regressions(&before, &board, self.tolerance));
        // printed first, so that a disk that is full does not cost the run
        if self.common.json {
            print_json(&Report {
                board: &board,
                regressions: found.as_deref(),
            })?;
        } else {
            print(&table(&board))?;
        }
        self.write(&board)?;
        if !self.common.json {
            print(&format!("\ntables and figures: {}", self.out.display()))?;
        }
        verdict(found.as_deref().unwrap_or_default())
    }

    /// The sessions that are scored.
    fn source(&self) -> Result<Source, CliError> {
        let Some(scenes) = &self.twin else {
            return Ok(Source::open(self.recordings.as_deref().unwrap_or(Path::new("")))?);
        };
        let twin = TwinSessions {
            scenes: scenes.clone(),
            seed: self.seed,
            quick: self.quick,
        };
        let bar = progress(twin.steps(), "simulating presses");
        let set = twin.simulate(&|| bar.inc(1));
        bar.finish_and_clear();
        Ok(Source::new(set.map_err(|e| CliError::Study(Box::new(e)))?)?)
    }

    /// What is learned from for a skin of this `layout`.
    fn training(&self, layout: SkinLayout) -> Result<Vec<TrainingSource>, CliError> {
        let mut skins = None;
        let training = self.learn_from.iter();
        training
            .map(|name| training_source(name, layout, self.seed, &mut skins))
            .collect()
    }

    /// What is scored, but for what it learns from.
    fn plan(&self) -> Result<Plan, CliError> {
        let decoders = if self.decoder.is_empty() {
            if self.external.is_empty() {
                Plan::shown()
            } else {
                Vec::new()
            }
        } else {
            named(&self.decoder)?
        };
        let external: Vec<ExternalCommand> = self.external.iter().map(|e| ExternalCommand::parse(e)).collect();
        let names = decoders
            .iter()
            .map(|d| d.name)
            .chain(external.iter().map(|e| e.name.as_str()));
        let names: Vec<&str> = names.collect();
        if let Some((k, name)) = names.iter().enumerate().find(|(k, name)| names[..*k].contains(*name)) {
            let option = if k < decoders.len() { "--decoder" } else { "--external" };
            return Err(CliError::Usage(format!(
                "`{option}`: {name:?} is there twice; give every one a name of its own"
            )));
        }
        let mut measurements: Vec<usize> = self.measurements.iter().map(|m| *m as usize).collect();
        if measurements.is_empty() {
            measurements = Plan::MEASUREMENTS.to_vec();
        }
        measurements.sort_unstable();
        measurements.dedup();
        Ok(Plan {
            decoders,
            external,
            measurements,
            objects: self.object.clone(),
            localisation: if self.no_ball {
                Vec::new()
            } else {
                Plan::LOCALISATION.to_vec()
            },
            left_out: self.left_out,
            training: Vec::new(),
            times: !self.no_times,
            seed: self.seed,
        })
    }

    fn write(&self, board: &ScoreBoard) -> Result<(), CliError> {
        write(board, &self.out)?;
        if let Some(path) = &self.save {
            write_json(path, board)?;
        }
        Ok(())
    }
}

fn score(plan: &Plan, source: &Source) -> Result<ScoreBoard, CliError> {
    let failed = |e: ScoreError| match e {
        ScoreError::NoSession | ScoreError::Object { .. } => CliError::Usage(format!("{}: {e}", source.root.display())),
        _ => CliError::Usage(e.to_string()),
    };
    let learning = spinner("learning");
    let ready = plan.learn(source).map_err(failed)?;
    drop(learning);
    let bar = progress(ready.steps(), "presses");
    let board = ready.score(&|| bar.inc(1));
    bar.finish_and_clear();
    let mut board = board.map_err(failed)?;
    let locating = spinner("bouncing ball");
    board.localisation = ready.localise().map_err(failed)?;
    drop(locating);
    Ok(board)
}

/// Simulated presses of every object on as many skins as the default says, made once for all sources that need them.
/// The skins have the `layout` of the scored one.
fn simulated(layout: SkinLayout, seed: u64) -> Result<Vec<ScoredSession>, CliError> {
    let skins = Skins {
        layout,
        ..Skins::default()
    };
    let bar = progress(skins.skins * OBJECTS.len(), "simulated presses");
    let sessions = skins.press(seed, &|| bar.inc(1));
    bar.finish_and_clear();
    sessions.map_err(|e| CliError::Usage(format!("simulated presses: {e}")))
}

fn training_source(
    name: &str,
    layout: SkinLayout,
    seed: u64,
    skins: &mut Option<Vec<ScoredSession>>,
) -> Result<TrainingSource, CliError> {
    if [SIMULATION, CALIBRATED].contains(&name) && skins.is_none() {
        *skins = Some(simulated(layout, seed)?);
    }
    let skins = skins.clone().unwrap_or_default();
    Ok(match name {
        PUBLISHED => TrainingSource::Published,
        RASTER => TrainingSource::Raster,
        SIMULATION => TrainingSource::Other {
            name: SIMULATION.to_owned(),
            sessions: skins,
            all: true,
            gain_sd: Skins::default().gain_sd(),
        },
        CALIBRATED => TrainingSource::Calibrated(skins),
        dir => {
            let source = Source::open(Path::new(dir))?;
            TrainingSource::Other {
                name: dir.to_owned(),
                sessions: source.sessions,
                all: source.simulated,
                gain_sd: if source.simulated {
                    Skins::default().gain_sd()
                } else {
                    0.0
                },
            }
        }
    })
}

fn verdict(found: &[Regression]) -> Result<(), CliError> {
    if found.is_empty() {
        return Ok(());
    }
    for r in found {
        let now = r.now.map_or_else(|| "gone".to_owned(), |v| format!("{v:.4}"));
        note(&format!("{}: {} was {:.4}, is {now}", r.what, r.score, r.before));
    }
    let gone = found.iter().filter(|r| r.now.is_none()).count();
    let fell = found.len() - gone;
    Err(CliError::Differs(format!("{fell} scores fell, {gone} are gone")))
}

fn named(names: &[String]) -> Result<Vec<&'static Spec>, CliError> {
    if names.iter().any(|n| n == "all") {
        return Ok(DECODERS.iter().collect());
    }
    let one = |name: &String| {
        find(name).ok_or_else(|| {
            let valid: Vec<&str> = DECODERS.iter().map(|spec| spec.name).collect();
            CliError::Usage(format!("`--decoder` = {name:?}; valid: all, {}", valid.join(", ")))
        })
    };
    names.iter().map(one).collect()
}

fn list() -> String {
    let lines = DECODERS.iter().map(|spec| {
        let mark = if spec.shown { "*" } else { " " };
        format!("{mark} {:<14} {}", spec.name, spec.about)
    });
    let lines: Vec<String> = lines.collect();
    format!("{}\n\n* shown when no decoder is named", lines.join("\n"))
}

fn read_board(path: &Path) -> Result<ScoreBoard, CliError> {
    let usage = |e: &dyn std::fmt::Display| {
        CliError::Usage(format!("{}: not a board as --save writes it: {e}", path.display()))
    };
    let text = std::fs::read_to_string(path).map_err(|e| usage(&e))?;
    serde_json::from_str(&text).map_err(|e| usage(&e))
}
