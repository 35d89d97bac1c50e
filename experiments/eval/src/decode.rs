//! Decodes single windows of sessions into image, class and place, and scores them where the ground truth is known.

use crate::algorithm::{Answer, Trained};
use crate::decoders::{DecoderSpec, Needs};
use crate::place::{RecordedTouch, find_bounces, find_touches};
use crate::protocol::{Truth, mask};
use crate::session::ScoredSession;
use crate::table::Table;
use crate::training::{TrainedNetwork, TrainingData};
use crate::windows::{Untouched, Window};
use crate::{Labels, unique};
use npyz::WriterBuilder as _;
use rayon::prelude::*;
use serde::Serialize;
use spts::Session;
use spts::output::{OutputFolder, unwritable};
use spts::session::Event;
use spts_circuit::Recording;
use spts_input::Refusal;
use spts_models::{SkinLayout, Streams};
use spts_recon::Workspace;
use spts_recon::classify::Src;
use spts_recon::localise::centre_of_mass;
use spts_recon::metrics::{SUPPORT_THRESHOLD, SupportScore, pearson};
use std::fs::File;
use std::io;
use std::io::{BufWriter, Write as _};
use std::path::Path;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

/// Settings of `spts decode`: decoders, numbers of measurements and windows.
#[derive(Clone)]
pub struct DecodeRequest {
    /// Decoders of the board.
    pub decoders: Vec<&'static DecoderSpec>,
    /// Numbers of measurements.
    pub measurements: Vec<usize>,
    /// Number of consecutive windows in each block, from the beginning of the hold.
    pub windows: usize,
    /// The network for decoders that use one; `None` for the one shipped with the program.
    pub network: Option<TrainedNetwork>,
    /// Seed of the procedural shapes that train decoders for unseen objects.
    pub seed: u64,
}

/// Decoders trained for a layout, and the classes that they know.
pub struct LearnedDecoders {
    trained: Vec<Box<dyn Trained>>,
    classifier: Option<Src>,
    classes: Option<Labels>,
}

/// What one decoder made of one window of a session, and how good it is where the truth is known.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DecodedWindow {
    /// Name of the session.
    pub session: String,
    /// Number of the block, from 0.
    pub block: usize,
    /// Number of the window within the block, from 0.
    pub window: usize,
    /// Decoder.
    pub decoder: &'static str,
    /// Number of measurements.
    pub m: usize,
    /// First measurement of the window, within the block.
    pub start: usize,
    /// Support accuracy; `None` without ground truth.
    pub support: Option<f64>,
    /// Intersection over union of the supports; `None` without ground truth.
    pub iou: Option<f64>,
    /// Pearson correlation of the image with the true one; `None` without ground truth, or if either is constant.
    pub correlation: Option<f64>,
    /// Class that was found; `None` if the decoder has no classes, or found none.
    pub label: Option<String>,
    /// Class of the session's object.
    pub label_true: String,
    /// Centre of mass of the image as (row, col), taxels; `None` for an empty image.
    pub place: Option<[f64; 2]>,
    /// Tactile image, one value a taxel.
    #[serde(skip)]
    pub image: Vec<f64>,
}

/// All decoded windows of one session, with the true images and what was measured.
#[derive(Debug, Clone)]
pub struct DecodedSession {
    /// Name of the session.
    pub session: String,
    /// Rows and columns of the skin.
    pub shape: [usize; 2],
    /// Whether the object is one of the trained classes.
    pub knows_class: bool,
    /// In order of block, decoder, M, window.
    pub rows: Vec<DecodedWindow>,
    /// True image of every block, of all samples of the hold where it is fitted to them; `None` where it is not known.
    pub truth: Vec<Option<Vec<f64>>>,
    /// Measurements of the windows for each M, in order of M, block, window.
    pub measured: Vec<MeasuredWindow>,
}

/// The samples of one window with their rows of the sensing matrix: what a decoder is given.
#[derive(Debug, Clone)]
pub struct MeasuredWindow {
    /// Number of the block.
    pub block: usize,
    /// Number of the window within the block.
    pub window: usize,
    /// Number of measurements.
    pub m: usize,
    /// Rows of weights, M × taxels; empty for many measurements of a large skin.
    pub phi: Vec<f64>,
    /// Output of the summing amplifier minus that of the untouched skin, V.
    pub y: Vec<f64>,
}

/// Why a session without a compressive recording is not decoded.
pub fn no_recording(session: &Session) -> Refusal {
    Refusal::new(format!("session {:?} has no compressive recording to decode", session.name))
}

/// Why `windows` windows of `m` measurements a block are not decoded, of a block of `session` with `most` measurements
/// from measurement `start` on.
pub(crate) fn too_many(session: &Session, m: usize, windows: usize, [start, most]: [usize; 2]) -> Refusal {
    Refusal::new(format!(
        "`measurements` = {m} in {windows} windows is outside [1, {most}]: a block of session {:?} has {most} \
         measurements from measurement {start} on",
        session.name
    ))
}

/// Why `decoder` cannot be trained.
pub(crate) fn untrained(decoder: &str, error: Refusal) -> Refusal {
    error.at(format_args!("decoder `{decoder}`"))
}

impl DecodeRequest {
    /// Default numbers of measurements for a skin of `taxels` taxels: 7, 20 and 50 % of them, and 1, 2 and 5 % of more
    /// than 2,048.
    pub fn default_measurements(taxels: usize) -> Vec<usize> {
        let percent = if taxels > TrainingData::MOST_TAXELS { [1, 2, 5] } else { [7, 20, 50] };
        let mut shares: Vec<usize> = percent.map(|m| (m * taxels).div_ceil(100)).to_vec();
        shares.dedup();
        shares
    }

    /// Trains the decoders with `training` for a skin of this `layout`. `classes` are the names of its labels; `None`
    /// without classes.
    ///
    /// # Errors
    /// [`Refusal`] if one cannot be trained.
    pub fn learn(
        &self,
        layout: &SkinLayout,
        training: &TrainingData,
        classes: Option<&Labels>,
    ) -> Result<LearnedDecoders, Refusal> {
        let named = training.clone().with_network(self.network.clone());
        let trained = self.decoders.iter().map(|spec| {
            let shapes = match spec.needs {
                Needs::Shapes => TrainingData::for_shapes(layout, Streams::new(self.seed)).map(Some),
                _ => Ok(None),
            };
            let trained = shapes.and_then(|shapes| (spec.train)(shapes.as_ref().unwrap_or(&named)));
            trained.map_err(|e| untrained(spec.name, e))
        });
        // with one class there is nothing to decide
        let several = training.library.labels().windows(2).any(|pair| pair[0] != pair[1]);
        let classes = classes.filter(|_| several);
        Ok(LearnedDecoders {
            trained: trained.collect::<Result<_, _>>()?,
            classifier: classes.map(|_| Src::new(training.library.clone(), Src::PUBLISHED_SPARSITY)),
            classes: classes.cloned(),
        })
    }

    /// Decodes every block of `session` with the decoders `learned` for its layout.
    ///
    /// # Errors
    /// [`Refusal`] if there is no recording, or the windows do not fit.
    pub fn decode(&self, session: &Session, learned: &LearnedDecoders) -> Result<DecodedSession, Refusal> {
        let Some(recording) = session.compressive() else {
            return Err(no_recording(session));
        };
        let scored = ScoredSession::new(session.clone(), 0);
        let begins = begins(session, recording, &scored);
        for &m in &self.measurements {
            for &(start, _) in begins.iter().flatten() {
                let most = recording.blocks()[0].volts.len() - start;
                if m == 0 || m * self.windows > most {
                    return Err(too_many(session, m, self.windows, [start, most]));
                }
            }
        }
        let (layout, taxels) = (recording.layout(), recording.taxels());
        let longest = self.measurements.iter().copied().max().unwrap_or(0) * self.windows;
        let blocks = begins.par_iter().enumerate().map(|(block, begin)| {
            let Some(&(start, ref untouched)) = begin.as_ref() else {
                return Ok((Vec::new(), Vec::new(), None));
            };
            let press = untouched.press(recording, block, start..start + longest);
            let truth = scored.truth(block);
            let hold = scored.protocol.measurements(recording);
            // without the samples of the window, as far as it lies in the hold
            let without = |window: &Window<'_>, at: usize| {
                let inside = if hold.start == start { hold.end.saturating_sub(start + at) } else { 0 };
                truth.as_ref()?.without([window.first(inside)])
            };
            let truths = |m: usize| press.windows(0..m * self.windows, m, m).map(|(at, window)| without(&window, at));
            let truths: Vec<Vec<Option<Truth>>> = self.measurements.iter().map(|&m| truths(m).collect()).collect();
            let all = |m: usize| press.windows(0..m * self.windows, m, m);
            let measured = self.measurements.iter().flat_map(|&m| all(m)).map(|(at, window)| MeasuredWindow {
                block,
                window: at / window.y.len(),
                m: window.y.len(),
                // those of large skins would fill the disk; they follow from the session
                phi: if taxels > TrainingData::MOST_TAXELS { Vec::new() } else { window.phi.values().to_vec() },
                y: window.y.to_vec(),
            });
            let measured: Vec<MeasuredWindow> = measured.collect();
            let mut rows = Vec::new();
            for (spec, trained) in self.decoders.iter().zip(&learned.trained) {
                let mut algorithm = trained.start();
                for (&m, truths) in self.measurements.iter().zip(&truths) {
                    let (starts, windows): (Vec<usize>, Vec<Window<'_>>) = all(m).unzip();
                    let answers = algorithm.decode_all(&windows)?;
                    let answers = starts.iter().zip(truths).zip(answers);
                    rows.extend(answers.map(|((&at, truth), answer)| DecodedWindow {
                        window: at / m,
                        decoder: spec.name,
                        m,
                        start: start + at,
                        ..learned.judged(session, truth.as_ref(), block, answer)
                    }));
                }
            }
            Ok((rows, measured, truth.map(|known| known.truth.image)))
        });
        let blocks = blocks.collect::<Result<Vec<_>, Refusal>>()?;
        let mut decoded = DecodedSession {
            session: session.name.clone(),
            shape: [layout.rows(), layout.cols()],
            knows_class: learned.classes.as_ref().is_some_and(|all| all.number(&session.object).is_some()),
            rows: Vec::new(),
            truth: Vec::new(),
            measured: Vec::new(),
        };
        for (rows, measured, truth) in blocks {
            decoded.rows.extend(rows);
            decoded.measured.extend(measured);
            decoded.truth.push(truth);
        }
        decoded.measured.sort_by_key(|m| (m.m, m.block, m.window));
        Ok(decoded)
    }
}

impl LearnedDecoders {
    /// The answer to a window of block `block`, held against the truth; what names the window is left empty.
    fn judged(&self, session: &Session, truth: Option<&Truth>, block: usize, answer: Answer) -> DecodedWindow {
        let classifier = self.classifier.as_ref();
        let class = classifier.and_then(|classifier| match answer.class {
            Some(class) => class.label(),
            None => classifier.classify(&answer.image, &mut Workspace::default()).ok().flatten(),
        });
        let truth = truth.filter(|truth| truth.image.len() == answer.image.len());
        let score = truth.map(|truth| SupportScore::new(&mask(&answer.image), &truth.support));
        let cols = session.layout().map_or(1, SkinLayout::cols);
        DecodedWindow {
            session: session.name.clone(),
            block,
            window: 0,
            decoder: "",
            m: 0,
            start: 0,
            support: score.map(|s| s.accuracy),
            iou: score.map(|s| s.iou),
            correlation: truth.and_then(|truth| pearson(&answer.image, &truth.image)),
            label: self.classes.as_ref().and_then(|labels| labels.name(class?)).map(str::to_owned),
            label_true: session.object.clone(),
            place: centre_of_mass(&answer.image, cols, SUPPORT_THRESHOLD),
            image: answer.image,
        }
    }
}

/// First measurement of the hold of every block, and the untouched skin before it. It is the first of the contact where
/// something fell on the skin, or touched one that is under preload; `None` in a block of drops without a contact,
/// where others have one.
fn begins(session: &Session, recording: &Recording, scored: &ScoredSession) -> Vec<Option<(usize, Untouched)>> {
    let hold = scored.protocol.measurements(recording).start;
    let (mut contacts, mut touches) = (Vec::new(), Vec::new());
    match session.event {
        Event::Drop => contacts = find_bounces(recording),
        Event::Touch => touches = find_touches(recording),
        Event::Press => {}
    }
    let begin = |block: usize| {
        let preloaded = |touch: &&RecordedTouch| touch.block == block && touch.untouched.image.is_some();
        if let Some(touch) = touches.iter().find(preloaded) {
            return Some((touch.start, touch.untouched.clone()));
        }
        let contact = contacts.iter().find(|contact| contact.block == block);
        if contact.is_none() && !contacts.is_empty() {
            return None;
        }
        let start = contact.map_or(hold, |contact| contact.start);
        Some((start, Untouched::of(recording, block)))
    };
    (0..recording.blocks().len()).map(begin).collect()
}

/// Writes `windows.csv` and one `NAME.npz` for each session into the folder `out`.
///
/// # Errors
/// [`Refusal`] if a file cannot be written.
pub fn write(decoded: &[(&Session, DecodedSession)], out: &mut OutputFolder) -> Result<(), Refusal> {
    Table::new("windows", decoded.iter().flat_map(|(_, session)| &session.rows))
        .file("session", |r| &r.session)
        .file("block", |r| r.block)
        .file("window", |r| r.window)
        .file("decoder", |r| r.decoder)
        .file("m", |r| r.m)
        .file("start", |r| r.start)
        .file("support", |r| r.support)
        .file("iou", |r| r.iou)
        .file("correlation", |r| r.correlation)
        .file("label", |r| r.label.as_deref())
        .file("label_true", |r| &r.label_true)
        .file("row", |r| r.place.map(|[row, _]| row))
        .file("col", |r| r.place.map(|[_, col]| col))
        .write(out)?;
    for (_, session) in decoded {
        write_arrays(&out.path(&format!("{}.npz", session.session)), session)?;
    }
    Ok(())
}

/// Writes the archive `path`. For every M: `phi_mM` (windows × M × taxels; left out where it is not kept as numbers),
/// `y_mM` (windows × M, V), `block_mM` and
/// `window_mM`, and for every decoder `image_DECODER_mM` (windows × rows × cols). `truth` is blocks × rows × cols, NaN
/// where none is known.
///
/// # Errors
/// [`Refusal`] when the file cannot be written.
fn write_arrays(path: &Path, session: &DecodedSession) -> Result<(), Refusal> {
    let [rows, cols] = session.shape;
    let taxels = rows * cols;
    let mut arrays: Vec<(String, Vec<usize>, Vec<f64>)> = Vec::new();
    let mut sizes: Vec<usize> = session.measured.iter().map(|w| w.m).collect();
    sizes.dedup();
    for m in sizes {
        let windows: Vec<_> = session.measured.iter().filter(|w| w.m == m).collect();
        let n = windows.len();
        let column = |of: fn(&MeasuredWindow) -> usize| windows.iter().map(|w| of(w) as f64).collect();
        let values = |of: fn(&MeasuredWindow) -> &[f64]| windows.iter().flat_map(|w| of(w)).copied().collect();
        let phi: Vec<f64> = values(|w| &w.phi);
        if phi.len() == n * m * taxels {
            arrays.push((format!("phi_m{m}"), vec![n, m, taxels], phi));
        }
        arrays.push((format!("y_m{m}"), vec![n, m], values(|w| &w.y)));
        arrays.push((format!("block_m{m}"), vec![n], column(|w| w.block)));
        arrays.push((format!("window_m{m}"), vec![n], column(|w| w.window)));
        let own = || session.rows.iter().filter(|row| row.m == m);
        for decoder in unique(own().map(|row| row.decoder)) {
            let mut of: Vec<_> = own().filter(|row| row.decoder == decoder).collect();
            of.sort_by_key(|row| (row.block, row.window));
            let image = |row: &&DecodedWindow| {
                let mut image = row.image.clone();
                image.resize(taxels, f64::NAN);
                image
            };
            let images = of.iter().flat_map(image).collect();
            arrays.push((format!("image_{decoder}_m{m}"), vec![of.len(), rows, cols], images));
        }
    }
    let unknown = vec![f64::NAN; taxels];
    let truth = session.truth.iter().flat_map(|t| t.as_ref().unwrap_or(&unknown)).copied().collect();
    arrays.push(("truth".to_owned(), vec![session.truth.len(), rows, cols], truth));
    write_npz(path, &arrays).map_err(unwritable(path))
}

/// Writes a NumPy archive of arrays of doubles, each with its name and its shape, without compression.
fn write_npz(path: &Path, arrays: &[(String, Vec<usize>, Vec<f64>)]) -> io::Result<()> {
    let mut zip = ZipWriter::new(BufWriter::new(File::create(path)?));
    let stored = SimpleFileOptions::default().compression_method(CompressionMethod::Stored).large_file(true);
    for (name, shape, values) in arrays {
        zip.start_file(format!("{name}.npy"), stored)?;
        let shape: Vec<u64> = shape.iter().map(|n| *n as u64).collect();
        let mut writer = npyz::WriteOptions::new().default_dtype().shape(&shape).writer(&mut zip).begin_nd()?;
        writer.extend(values.iter().copied())?;
        writer.finish()?;
    }
    zip.finish()?.flush()
}
