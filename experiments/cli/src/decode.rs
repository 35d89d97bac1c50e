//! `spts decode`: images, classes and places of sessions.

use crate::Bars;
use crate::context::{Common, note, notes, open_folder, print, print_json};
use crate::error::CliError;
use crate::options::{decoders_named, network, seed, skin_gains, sorted, whole};
use crate::simulated::simulated_presses;
use clap::Args;
use serde::Serialize;
use spts::Session;
use spts::data::SessionSet;
use spts::progress::Progress as _;
use spts::session::Event;
use spts_eval::decode::{DecodeRequest, DecodedSession, DecodedWindow, LearnedDecoders};
use spts_eval::decoders::{AUTO, auto, short_label};
use spts_eval::training::TrainingData;
use spts_eval::{
    Alignment, Labels, SessionSlip, Source, Table, UnalignedContact, check_session, follow_slips, slips_text,
    unaligned_text, unique,
};
use spts_models::{SkinLayout, Streams};
use std::path::{Path, PathBuf};

/// Decodes sessions: the image, class and place of what was pressed, from M samples of the one wire.
///
/// SESSION is a folder with session.json, such as `spts simulate` writes, a folder of such folders, or recordings of
/// the real skin. Each session is decoded with its own rows of weights, and sessions may differ in layout. The decoders
/// are trained on raster presses that are not scored. If there are none, they use a prior for random shapes anywhere on
/// the skin. Images are scored where a true image is known, by the rules of `spts score --help`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts simulate press/T --out out/T && spts decode out/T
  spts decode out/T --decoder nn_lmmse,omp --measurements 7,20,50 --windows 10
  spts decode recordings/ --session trig --json
  spts decode recordings/ --skin my_skin.toml --decoder evidence

Files in DIR:
  decoded.png decoded.svg    what the taxels conduct, the trace of the wire, the image at each M
  windows.csv                one line a window
  SESSION.npz                for every M: phi_mM, y_mM, block_mM, window_mM and image_DECODER_mM; truth; on a skin of
                             more than 2048 taxels without phi_mM

--json prints {\"rows\": [{\"session\", \"block\", \"window\", \"decoder\", \"m\", \"start\", \"support\", \"iou\", \"correlation\",
\"label\", \"label_true\", \"place\"}, ...]}, one entry a window; all numbers count from 0, and scores are null where no truth
is known. Its `slips`, [{\"session\", \"block\", \"from\", \"rows\"}, ...], say where cells had missed clock edges: the samples
from number `from` on belong to rows of weights that are `rows` earlier. Such samples are assigned to their own rows
before they are decoded, and `start` then counts rows of weights.")]
pub(super) struct DecodeCommand {
    /// Session, folder of sessions, or recordings of the real skin
    session: PathBuf,
    /// Only the sessions of these names [default: all in SESSION]
    #[arg(long = "session", value_name = "NAME,...", value_delimiter = ',')]
    only: Vec<String>,
    /// Decoders; `spts score --list` shows their names. `auto` stands for the decoder that needs no knowledge of the
    /// objects: `patches` on more than 2048 taxels, else `amortised`
    #[arg(long, value_name = "NAME,...", value_delimiter = ',', default_value = AUTO)]
    decoder: Vec<String>,
    /// Numbers of samples M that an image is decoded from; each [1, 1000000] [default: 7, 20 and 50 % of the taxels,
    /// and 1, 2 and 5 % of more than 2048]
    #[arg(long, value_name = "M,...", value_delimiter = ',', value_parser = whole::<u32>(1..=1_000_000))]
    measurements: Vec<u32>,
    /// Number of windows of M samples to decode in each block (press or drop), one after the other from the beginning
    /// of the hold; [1, 100000]
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole::<u32>(1..=100_000))]
    windows: u32,
    /// Folder of the results
    #[arg(long, value_name = "DIR", default_value = "out/decode")]
    out: PathBuf,
    /// Root of the random numbers with which decoders learn
    #[arg(long, default_value_t = 1, value_name = "SEED", value_parser = seed)]
    seed: u64,
    /// Trained network of the decoder `amortised`, a file that `python -m spts.amortised` writes [default: the
    /// network that ships]
    #[arg(long, value_name = "FILE")]
    weights: Option<PathBuf>,
    /// Gains of this skin's taxels, a file that `spts calibrate --skin` writes: learn from presses of the known objects
    /// that are simulated with them, and from no recording [default: learn from the raster presses of SESSION]
    #[arg(long, value_name = "FILE.toml")]
    skin: Option<PathBuf>,
    #[command(flatten)]
    common: Common,
}

/// What the command reports.
#[derive(Serialize)]
struct DecodeOutput<'a> {
    rows: Vec<&'a DecodedWindow>,
    slips: &'a [SessionSlip],
}

impl DecodeCommand {
    /// Runs the command.
    pub(super) fn run(&self) -> Result<(), CliError> {
        self.common.start()?;
        let out = open_folder(&self.out)?;
        let network = self.weights.as_deref().map(network).transpose()?;
        let choice = |layout: &SkinLayout| auto([layout.rows(), layout.cols()], network.is_some());
        // a wrong name is told before anything is read
        decoders_named(&self.decoder, Some(choice(&SkinLayout::default())))?;
        let mut set = SessionSet::open(&self.session)?;
        notes(&set.note);
        let Alignment { slips, unaligned } = follow_slips(&mut set);
        let sessions = self.chosen(&set)?;
        for session in &sessions {
            // what `spts score` refuses, with the session's own skin
            if let Some(layout) = session.layout().filter(|_| session.event == Event::Press) {
                check_session(&self.session, session, layout)?;
            }
        }
        let shown = |name: &str| sessions.iter().any(|session| session.name == name);
        let slips: Vec<SessionSlip> = slips.into_iter().filter(|slip| shown(&slip.session)).collect();
        let unaligned: Vec<UnalignedContact> = unaligned.into_iter().filter(|c| shown(&c.session)).collect();
        notes(slips_text(&slips).iter().chain(&unaligned_text(&unaligned)));
        let bars = Bars::default();
        bars.stage("learning", None);
        let training = Training::new(&set, self.skin.as_deref(), self.seed);
        bars.stage("decoding", Some(sessions.len()));
        let mut decoded: Vec<(&Session, DecodedSession)> = Vec::new();
        let mut learned: Vec<(SkinLayout, LearnedDecoders)> = Vec::new();
        for session in sessions {
            let Some(layout) = session.layout() else { continue };
            let taxels = layout.taxels();
            let request = DecodeRequest {
                decoders: decoders_named(&self.decoder, Some(choice(layout)))?,
                measurements: if self.measurements.is_empty() {
                    DecodeRequest::default_measurements(taxels)
                } else {
                    sorted(self.measurements.iter().map(|m| *m as usize).collect())
                },
                windows: self.windows as usize,
                network: network.clone(),
                seed: self.seed,
            };
            let learned = match learned.iter().position(|(of, _)| of == layout) {
                Some(at) => &learned[at].1,
                None => {
                    if self.decoder.iter().any(|name| name == AUTO) {
                        note(&format!("decoder: {}, by `auto` for {} taxels", choice(layout).name, layout.taxels()));
                    }
                    let (data, labels) = training.of(layout)?;
                    learned.push((*layout, request.learn(layout, &data, labels)?));
                    &learned[learned.len() - 1].1
                }
            };
            let found = request.decode(session, learned)?;
            let all = found.truth.len() * request.measurements.len() * request.windows;
            let lost = all - found.measured.len();
            if lost > 0 {
                let name = &session.name;
                note(&format!("note: {name}: {lost} of {all} windows have lost samples and are left out"));
            }
            decoded.push((session, found));
            bars.step();
        }
        bars.end();
        if self.common.json {
            let rows = decoded.iter().flat_map(|(_, session)| &session.rows).collect();
            print_json(&DecodeOutput { rows, slips: &slips })?;
        } else {
            print(&table(&decoded))?;
        }
        spts_report::decode::write(&decoded, out)?;
        if !self.common.json {
            print(&format!("results: {}", self.out.display()))?;
        }
        Ok(())
    }

    /// The sessions to decode: those that are named, or all with a compressive recording.
    fn chosen<'a>(&self, set: &'a SessionSet) -> Result<Vec<&'a Session>, CliError> {
        let names = || set.sessions.iter().filter(|s| s.compressive.is_some()).map(|s| s.name.as_str());
        if let Some(name) = self.only.iter().find(|name| set.named(name).is_none()) {
            let valid: Vec<&str> = names().collect();
            return Err(CliError::usage(format!(
                "{}: `--session` = {name:?}; valid: {}",
                self.session.display(),
                valid.join(", ")
            )));
        }
        let sessions = set.sessions.iter();
        let chosen: Vec<&Session> = if self.only.is_empty() {
            sessions.filter(|s| s.compressive.is_some()).collect()
        } else {
            sessions.filter(|s| self.only.contains(&s.name)).collect()
        };
        if chosen.is_empty() {
            return Err(CliError::usage(format!(
                "{}: no session has a compressive recording to decode; `spts wire` records frames with one",
                self.session.display()
            )));
        }
        Ok(chosen)
    }
}

/// What may be learned, for every layout.
struct Training<'a> {
    source: Option<Source>,
    /// File of the skin's gains, which is learned from then.
    skin: Option<&'a Path>,
    labels: Labels,
    seed: u64,
    streams: Streams,
}

impl<'a> Training<'a> {
    /// From the sessions of `set`, which have been realigned. When one of them cannot be scored, or they are of several
    /// layouts, nothing is learned from any, and a note says why.
    fn new(set: &SessionSet, skin: Option<&'a Path>, seed: u64) -> Self {
        let source = Source::aligned(set.clone(), Alignment::default());
        if let (Err(error), None) = (&source, skin) {
            note(&format!("note: nothing is learned from these recordings: {error}"));
        }
        Self { source: source.ok(), skin, labels: Labels::default(), seed, streams: Streams::new(seed) }
    }

    fn of(&self, layout: &SkinLayout) -> Result<(TrainingData, Option<&Labels>), CliError> {
        if let Some(skin) = self.skin {
            let gains = skin_gains(skin, layout)?;
            let simulated = simulated_presses(*layout, true, self.seed)?;
            let data = TrainingData::of_skin(&simulated, &gains, layout, self.streams)?;
            return Ok((data, Some(&self.labels)));
        }
        match self.source.as_ref().filter(|source| source.layout == *layout) {
            Some(source) => Ok(source.training(self.streams)?),
            None => Ok((TrainingData::for_layout(layout, self.streams)?, None)),
        }
    }
}

/// Means over the windows of every session, decoder and M.
fn table(decoded: &[(&Session, DecodedSession)]) -> String {
    let mut groups: Vec<(bool, Vec<&DecodedWindow>)> = Vec::new();
    for (_, session) in decoded {
        for key in unique(session.rows.iter().map(|row| (row.decoder, row.m))) {
            let rows = session.rows.iter().filter(|row| (row.decoder, row.m) == key);
            groups.push((session.knows_class, rows.collect()));
        }
    }
    let mean = |rows: &[&DecodedWindow], of: fn(&DecodedWindow) -> Option<f64>| {
        let values: Vec<f64> = rows.iter().filter_map(|r| of(r)).collect();
        (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
    };
    let table = Table::new("windows", &groups)
        .shown("session", |(_, rows)| &rows[0].session)
        .shown("decoder", |(_, rows)| short_label(rows[0].decoder))
        .shown("M", |(_, rows)| rows[0].m)
        .shown("windows", |(_, rows)| rows.len())
        .shown("support", |(_, rows)| mean(rows, |r| r.support))
        .digits(3)
        .shown("IoU", |(_, rows)| mean(rows, |r| r.iou))
        .digits(3)
        .shown("correlation", |(_, rows)| mean(rows, |r| r.correlation))
        .digits(3)
        .shown("classified", |(known, rows)| {
            let right = rows.iter().filter(|r| r.label.as_deref() == Some(&*r.label_true)).count();
            (*known && rows.iter().any(|r| r.label.is_some())).then(|| format!("{right} of {}", rows.len()))
        });
    table.text().trim_end().to_owned()
}
