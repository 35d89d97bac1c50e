//! `spts bench`: the benchmark of few-wire touch.

use crate::context::{Bars, Common, note, open_folder, spinner};
use crate::error::CliError;
use crate::options::seed;
use crate::score::read_board;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, Subcommand, ValueEnum};
use serde::Serialize;
use spts::output::{check_replaceable, write_json, write_npy};
use spts::session::parse_json;
use spts_eval::unique;
use spts_input::Refusal;
use spts_report::bench::{leaderboard_text, ranking_text, text, write_leaderboard};
use spts_report::write_all_or_none;
use spts_studies::bench::{
    Bench, Card, Choice, Development, READOUTS, Ranking, SUITE, Split, TASKS, Task, Track, task_named,
};
use std::path::{Path, PathBuf};

/// Benchmark of touch sensing with few wires: every entrant gets the same tasks, wire and noise, and its scores are
/// written to a file, its card.
///
/// Suite touch-1 has sixteen tasks: images of shapes at any place, classification, several contacts at once, contacts
/// that change in time, drift, faulty cells, several wires, and a skin of 10,000 taxels. Nothing is downloaded: all
/// touches are simulated from seeds of the suite. docs/benchmark.md is the protocol.
#[derive(Debug, Args)]
#[command(
    arg_required_else_help = true,
    after_help = "Examples:
  spts bench list
  spts bench run auto --quick
  spts bench table cards/*.json"
)]
pub(super) struct BenchCommand {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    List(ListCommand),
    Data(DataCommand),
    Run(RunCommand),
    Verify(VerifyCommand),
    Table(TableCommand),
}

impl BenchCommand {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), CliError> {
        match self.action {
            Action::List(command) => command.run(),
            Action::Data(command) => command.run(),
            Action::Run(command) => command.run(),
            Action::Verify(command) => command.run(),
            Action::Table(command) => command.run(),
        }
    }
}

/// Lists the tasks of the suite, and the entrants that `spts bench run` knows by name.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts bench list
  spts bench list --json")]
struct ListCommand {
    #[command(flatten)]
    common: Common,
}

#[derive(Serialize)]
struct Listed {
    suite: &'static str,
    tasks: Vec<ListedTask>,
    entrants: Vec<(&'static str, Vec<String>)>,
}

#[derive(Serialize)]
struct ListedTask {
    name: &'static str,
    about: &'static str,
    taxels: usize,
    measurements: &'static [usize],
    more: &'static [usize],
}

impl ListCommand {
    fn run(self) -> Result<(), CliError> {
        self.common.start()?;
        let tasks = TASKS.iter().map(|task| ListedTask {
            name: task.name,
            about: task.about,
            taxels: task.side * task.side,
            measurements: task.measurements,
            more: task.more,
        });
        let entrants = Track::ALL.map(|track| (track.name(), Choice::names(track)));
        let listed = Listed { suite: SUITE, tasks: tasks.collect(), entrants: entrants.into() };
        let text = || {
            let mut out = format!("suite {SUITE}\n\n");
            for task in &listed.tasks {
                let numbers = |of: &[usize]| of.iter().map(usize::to_string).collect::<Vec<_>>().join(", ");
                out.push_str(&format!(
                    "  {:15} {} ({} taxels; {} measurements, readouts also {})\n",
                    task.name,
                    task.about,
                    task.taxels,
                    numbers(task.measurements),
                    numbers(task.more)
                ));
            }
            for (track, names) in &listed.entrants {
                out.push_str(&format!("\ntrack {track}: {}\n", names.join(", ")));
            }
            out.push_str("\nreadouts:\n");
            for line in READOUTS {
                out.push_str(&format!("  {:19} {}\n", line.name, line.about));
            }
            out
        };
        self.common.print(&listed, text)
    }
}

/// Writes touches of the public split with their samples and their truth, for the development of a decoder.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts bench data thin --out out/thin
  python3 -c 'import numpy; print(numpy.load(\"out/thin/y.npy\").shape)'

Files in DIR:
  phi.npy                    rows of the sensing matrix, M x taxels; fewer measurements are the first of them
  y.npy                      samples, touches x M, \u{b5}S: y = phi x and noise
  images.npy                 true conductances x, touches x taxels, \u{b5}S
  names.json                 object or family of every touch")]
struct DataCommand {
    /// Task
    #[arg(value_name = "TASK", value_parser = known_task())]
    task: &'static Task,
    /// Folder of the arrays
    #[arg(long, value_name = "DIR", default_value = "out/bench_data")]
    out: PathBuf,
    #[command(flatten)]
    common: Common,
}

#[derive(Serialize)]
struct Written {
    task: &'static str,
    touches: usize,
    taxels: usize,
    measurements: usize,
}

impl DataCommand {
    fn run(self) -> Result<(), CliError> {
        self.common.start()?;
        let out = open_folder(&self.out)?;
        let wait = spinner("pressing touches");
        let Development { phi, y, images, names } = Development::of(self.task)?;
        drop(wait);
        write_all_or_none(out, |out| {
            for (name, array) in [("phi.npy", &phi), ("y.npy", &y), ("images.npy", &images)] {
                write_npy(&out.path(name), &[array.nrows(), array.ncols()], array.view().values())?;
            }
            write_json(&out.path("names.json"), &names)
        })?;
        let (touches, taxels, measurements) = (names.len(), phi.ncols(), phi.nrows());
        let written = Written { task: self.task.name, touches, taxels, measurements };
        let text =
            || format!("{touches} touches of {taxels} taxels, {measurements} measurements: {}", self.out.display());
        self.common.print(&written, text)
    }
}

/// What an entrant decides.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum TrackName {
    /// Decodes images or classes; the rows of weights are given
    Decoder,
    /// Also chooses the rows of weights, of ±1
    Rows,
    /// Chooses every measurement itself, and may use the samples so far
    Readout,
}

impl From<TrackName> for Track {
    fn from(name: TrackName) -> Self {
        match name {
            TrackName::Decoder => Self::Decoder,
            TrackName::Rows => Self::Rows,
            TrackName::Readout => Self::Readout,
        }
    }
}

/// Scores an entrant and leaves its card.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts bench run auto --quick
  spts bench run amortised --save cards/amortised.json
  spts bench run binary_search --tasks small,contacts_10
  spts bench run mine.py --quick --save cards/mine.json
  spts bench run 'mine=./my_decoder --fast' --tasks thin")]
struct RunCommand {
    /// An entrant by its name (spts bench list), a Python file with a class, or a program in quotes
    #[arg(value_name = "NAME|FILE.py|PROGRAM")]
    who: String,
    /// What the entrant chooses itself. Needed for a name that is in several tracks, or for a program [default: the
    /// first track that has the name; for a Python class, the track that its methods show; for a program, decoder]
    #[arg(long)]
    track: Option<TrackName>,
    /// Tasks [default: all]
    #[arg(long, value_delimiter = ',', value_name = "TASK,…", value_parser = known_task())]
    tasks: Vec<&'static Task>,
    /// Tasks that it cannot do, for which there are no points [default: none]
    #[arg(long, value_delimiter = ',', value_name = "TASK,…", value_parser = known_task())]
    skip: Vec<&'static Task>,
    /// Score on few touches; takes about a minute
    #[arg(long)]
    quick: bool,
    /// The touches for development, whose truth may be seen, in place of those for scores
    #[arg(long, conflicts_with = "seed")]
    public: bool,
    /// Touches of a seed of your own in place of the suite's [default: none]
    #[arg(long, value_name = "SEED", value_parser = seed)]
    seed: Option<u64>,
    /// File of the card [default: none]
    #[arg(long, value_name = "FILE")]
    save: Option<PathBuf>,
    #[command(flatten)]
    common: Common,
}

fn known_task() -> impl TypedValueParser<Value = &'static Task> {
    PossibleValuesParser::new(TASKS.iter().map(|task| task.name))
        .map(|name: String| task_named(&name).unwrap_or(&TASKS[0]))
}

/// The entrant that `who` names.
fn choice(who: &str, track: Option<Track>) -> Result<Choice, Refusal> {
    let named = Choice::named(who, track);
    let program = who.split_whitespace().nth(1).is_some() || who.contains('=') || Path::new(who).is_file();
    match named {
        Err(_) if who.ends_with(".py") && !who.contains([' ', '=']) && !Path::new(who).is_file() => {
            Err(Refusal::new("no such file").at(who))
        }
        Err(_) if program => Choice::program(who, track),
        other => other,
    }
}

impl RunCommand {
    fn run(self) -> Result<(), CliError> {
        self.common.start()?;
        if let Some(file) = &self.save {
            if let Some(folder) = file.parent().filter(|folder| !folder.as_os_str().is_empty()) {
                std::fs::create_dir_all(folder).map_err(|e| Refusal::from_error(e).at(folder.display()))?;
            }
            check_replaceable(file, |file| read(file).is_ok())?;
        }
        let bench = Bench::new(choice(&self.who, self.track.map(Track::from))?);
        let tasks = if self.tasks.is_empty() { bench.tasks.clone() } else { unique(self.tasks) };
        if let Some(task) = tasks.iter().find(|task| !bench.tasks.contains(task)) {
            let problem = format!("`--tasks`: {} is not for the track {}", task.name, bench.choice.track.name());
            return Err(Refusal::new(problem).into());
        }
        if let Some(task) = self.skip.iter().find(|task| !tasks.contains(task)) {
            let problem = format!("`--skip`: {} is not among the tasks of this run", task.name);
            return Err(Refusal::new(problem).into());
        }
        let split = match (self.public, self.seed) {
            (true, _) => Split::Public,
            (false, Some(seed)) => Split::Fresh(seed),
            (false, None) => Split::Test,
        };
        let card = Bench { tasks, split, quick: self.quick, skipped: self.skip, ..bench }.run(&Bars::default())?;
        if let Some(file) = &self.save {
            write_json(file, &card)?;
        }
        self.common.print(&card, || text(&card))
    }
}

fn read(file: &Path) -> Result<Card, Refusal> {
    let text = spts_input::read_text(file, MOST_BYTES).map_err(|e| Refusal::from_error(e).at(file.display()))?;
    parse_json(file, &text).map_err(|e| Refusal::new(format!("{e}; `spts bench run --save` writes cards")))
}

/// Largest card, bytes.
const MOST_BYTES: u64 = 10_000_000;

/// Runs the entrant of a card again and compares the scores with those in the card. If the card is from an external
/// program, its `command` is run in the current folder: read `command` first if the card is not yours. The exit status
/// is 1 if the scores differ.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts bench verify cards/amortised.json
  spts bench verify cards/mine.json --seed 12345")]
struct VerifyCommand {
    /// The card
    #[arg(value_name = "CARD.json")]
    card: PathBuf,
    /// Touches of this seed, which the entrant cannot have seen: the points have to agree within their intervals
    /// [default: the touches of the card, and the scores have to be equal]
    #[arg(long, value_name = "SEED", value_parser = seed)]
    seed: Option<u64>,
    #[command(flatten)]
    common: Common,
}

#[derive(Serialize)]
struct Verified {
    card: Card,
    again: Card,
}

impl VerifyCommand {
    fn run(self) -> Result<(), CliError> {
        self.common.start()?;
        let card = read(&self.card)?;
        let who = match &card.command {
            Some(command) => {
                note(&format!("runs the card's `command`: {command}"));
                choice(command, Some(card.track)).map_err(|e| e.at("`command`").at(self.card.display()))?
            }
            None => Choice::named(&card.entrant, Some(card.track))?,
        };
        let tasks = card.tasks.iter().map(|task| {
            task_named(&task.task).ok_or_else(|| Refusal::new(format!("{SUITE} has no task {:?}", task.task)))
        });
        let tasks = tasks.collect::<Result<Vec<_>, Refusal>>().map_err(|e| e.at(self.card.display()))?;
        let split = match (self.seed, card.split.as_str()) {
            (Some(seed), _) => Split::Fresh(seed),
            (None, "public") => Split::Public,
            (None, split) => {
                split.strip_prefix("fresh ").and_then(|n| n.parse().ok()).map_or(Split::Test, Split::Fresh)
            }
        };
        let skipped = card.tasks.iter().filter(|task| task.is_skipped()).filter_map(|task| task_named(&task.task));
        let (quick, skipped) = (card.quick, skipped.collect());
        let again = Bench { choice: who, tasks, split, quick, skipped }.run(&Bars::default())?;
        if self.seed.is_none() {
            card.same(&again).map_err(|e| CliError::Differs(e.at(self.card.display()).to_string()))?;
        } else if again.points.high < card.points.low {
            let problem = format!(
                "`points`: the card has {:.1} ({:.1} – {:.1}); on touches that nobody has seen it is {:.1} ({:.1} – {:.1})",
                card.points.mean,
                card.points.low,
                card.points.high,
                again.points.mean,
                again.points.low,
                again.points.high
            );
            return Err(CliError::Differs(Refusal::new(problem).at(self.card.display()).to_string()));
        }
        let how = if self.seed.is_none() { "equal" } else { "within the intervals" };
        let verified = Verified { card, again };
        let text = || {
            let [a, b] = [&verified.card, &verified.again].map(|card| card.points.mean);
            format!("{}: {how}: {a:.1} points on the card, {b:.1} run again", self.card.display())
        };
        self.common.print(&verified, text)
    }
}

/// Makes a leaderboard from cards.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts bench table cards/
  spts bench table cards/amortised.json cards/mine.json --out out/leaderboard
  spts bench table cards/ --real board.json

Files in DIR:
  index.html                 the leaderboard as a page
  tables/leaderboard.csv     a line a card; cards.json the cards
  figures/                   scores over the number of measurements, a file a track, .svg and .png")]
struct TableCommand {
    /// Cards, or folders of them
    #[arg(value_name = "CARDS", required = true)]
    cards: Vec<PathBuf>,
    /// A board that `spts score DIR --left-out --save BOARD` wrote of recordings: whether its decoders rank there as on
    /// the tasks [default: none]
    #[arg(long, value_name = "BOARD.json")]
    real: Option<PathBuf>,
    /// Folder of the results
    #[arg(long, value_name = "DIR", default_value = "out/bench")]
    out: PathBuf,
    #[command(flatten)]
    common: Common,
}

#[derive(Serialize)]
struct Ranked {
    cards: Vec<Card>,
    #[serde(skip_serializing_if = "Option::is_none")]
    ranking: Option<Ranking>,
}

impl TableCommand {
    fn run(self) -> Result<(), CliError> {
        self.common.start()?;
        let mut files = Vec::new();
        for path in &self.cards {
            if path.is_dir() {
                let entries = std::fs::read_dir(path).map_err(|e| Refusal::from_error(e).at(path.display()))?;
                let own = entries.filter_map(|entry| Some(entry.ok()?.path()));
                let mut own: Vec<PathBuf> = own.filter(|file| file.extension().is_some_and(|e| e == "json")).collect();
                own.sort();
                if own.is_empty() {
                    return Err(Refusal::new("no card (*.json)").at(path.display()).into());
                }
                files.extend(own);
            } else {
                files.push(path.clone());
            }
        }
        let checked = |file: &PathBuf| {
            let card = read(file)?;
            card.check().map_err(|e| e.at(file.display())).map(|()| card)
        };
        let files = unique(files);
        let cards = files.iter().map(checked).collect::<Result<Vec<Card>, Refusal>>()?;
        let like = |card: &Card| (card.suite.clone(), card.split.clone(), card.quick);
        if let Some((file, other)) = files.iter().zip(&cards).find(|(_, card)| like(card) != like(&cards[0])) {
            let said = |card: &Card| format!("{} of {}, quick {}", card.split, card.suite, card.quick);
            let problem =
                format!("a card of the split {}; valid: as {}, {}", said(other), files[0].display(), said(&cards[0]));
            return Err(Refusal::new(problem).at(file.display()).into());
        }
        let board = self.real.as_deref().map(read_board).transpose()?;
        let ranking = board.map(|board| Ranking::new(&cards, &board)).transpose()?;
        let out = open_folder(&self.out)?;
        write_leaderboard(&cards, ranking.as_ref(), out)?;
        let ranked = Ranked { cards, ranking };
        let text = || {
            let ranking = ranked.ranking.as_ref().map_or_else(String::new, ranking_text);
            format!("{}{ranking}page: {}", leaderboard_text(&ranked.cards), self.out.join("index.html").display())
        };
        self.common.print(&ranked, text)
    }
}
