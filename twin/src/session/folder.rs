//! A session as a folder: `session.json` and its arrays. Writing and reading loses nothing. docs/session.md describes
//! the file for users.

use super::npy::{self, Expected, npy_bytes, read_codes, read_doubles, room};
use super::recorded::{
    Event, PressFacts, PressPose, Recorded, Session, check, check_header, check_hold, check_recorded, is_plain,
};
use crate::output::{NpyFile, OutputFolder, check_whole, unwritable, write_bytes};
use crate::provenance::Provenance;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use spts_circuit::{Block, Converter, Mode, Recording, RecordingInfo};
use spts_input::{Refusal, Tables};
use spts_models::Grid;
use std::fmt::Display;
use std::path::{Path, PathBuf};

/// Versions of the schema of `session.json` that are read: of one wire, and of several. The first that can hold a
/// session is written.
const SCHEMAS: [u64; 2] = [1, 2];
/// The file that makes a folder a session.
pub const SESSION_FILE: &str = "session.json";

/// `format` of every session.
const FORMAT: &str = "spts-session";
/// Largest `session.json` that is read, bytes: explicit seeds of a million taxels and poses of 100,000 presses.
const MAX_BYTES: u64 = 1 << 26;

/// The whole file.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Contents {
    format: String,
    schema: u64,
    name: String,
    object: String,
    event: Event,
    hold_s: Option<[f64; 2]>,
    raster: Option<RecordedContents>,
    compressive: Option<RecordedContents>,
    provenance: Option<Provenance>,
}

/// What is read before everything else, so that a later schema is named and not taken for a damaged file.
#[derive(Debug, Deserialize)]
struct Version {
    format: String,
    schema: u64,
}

/// One recording.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RecordedContents {
    info: RecordingInfo,
    frames: usize,
    #[serde(default)]
    conditioning: usize,
    blocks: Vec<BlockContents>,
    samples: Samples,
    /// File of the true pressures, blocks × rows × cols, Pa.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pressure_pa: Option<String>,
    /// File of the true conductances, blocks × rows × cols, S.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    conductance_s: Option<String>,
}

impl RecordedContents {
    fn has_wires(&self) -> bool {
        self.info.weights.wires().is_some()
    }
}

impl Contents {
    fn recorded(&self) -> impl Iterator<Item = &RecordedContents> {
        [&self.raster, &self.compressive].into_iter().flatten()
    }

    /// Names of the files that make the session.
    fn files(&self) -> Vec<&str> {
        let arrays = self.recorded().flat_map(|recorded| {
            let maps = [&recorded.pressure_pa, &recorded.conductance_s].into_iter().flatten();
            maps.chain([&recorded.samples.file]).map(String::as_str)
        });
        arrays.chain([SESSION_FILE]).collect()
    }
}

/// The array of samples, blocks × frames × measurements.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Samples {
    file: String,
    kind: SampleKind,
    /// Number of missing samples.
    missing: usize,
}

/// What the array holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum SampleKind {
    /// Codes of the converter; the largest value of their type marks a missing sample.
    Codes,
    /// Volts; NaN marks a missing sample.
    Volts,
}

/// One block.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct BlockContents {
    frame_position: u64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    idle_frames: Option<usize>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    time_s: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pose: Option<PressPose>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    force_n: Option<f64>,
}

/// Code of a sample, a missing one as `missing`; `None` when it is not the volt of a code, bit for bit.
fn code(volts: f64, converter: &Converter, missing: u32) -> Option<u32> {
    match volts.is_nan() {
        true => Some(missing),
        false => converter.code(volts),
    }
}

/// Mark of a missing sample: larger than every code, in the smallest unsigned type that holds both.
fn missing_mark(converter: &Converter) -> u32 {
    if is_narrow(converter) { u32::from(u16::MAX) } else { u32::MAX }
}

/// Whether codes and the mark of a missing sample have 16 bits.
fn is_narrow(converter: &Converter) -> bool {
    converter.code_bytes() == size_of::<u16>()
}

/// Array that is being written.
enum Array {
    Narrow(NpyFile<u16>),
    Wide(NpyFile<u32>),
    Volts(NpyFile<f64>),
}

/// Samples that are being written.
struct SampleFile {
    dir: PathBuf,
    mode: &'static str,
    shape: [usize; 3],
    converter: Option<Converter>,
    array: Array,
    missing: usize,
    /// Codes of a block.
    codes: Vec<u32>,
}

impl SampleFile {
    /// Begins the samples of `mode`: blocks × frames × measurements.
    fn create(
        dir: &Path,
        mode: &'static str,
        shape: [usize; 3],
        converter: Option<&Converter>,
    ) -> Result<Self, Refusal> {
        let path = dir.join(name(mode, converter.is_some()));
        let array = match converter {
            Some(converter) if is_narrow(converter) => Array::Narrow(NpyFile::create(&path, &shape)?),
            Some(_) => Array::Wide(NpyFile::create(&path, &shape)?),
            None => Array::Volts(NpyFile::create(&path, &shape)?),
        };
        Ok(Self {
            dir: dir.to_owned(),
            mode,
            shape,
            converter: converter.copied(),
            array,
            missing: 0,
            codes: Vec::new(),
        })
    }

    /// Writes the next block.
    fn push(&mut self, block: &Block) -> Result<(), Refusal> {
        if let Some(converter) = self.converter {
            let mark = missing_mark(&converter);
            self.codes.clear();
            let codes = block.volts.iter().map_while(|volts| code(*volts, &converter, mark));
            self.codes.extend(codes);
            if self.codes.len() < block.volts.len() {
                self.become_volts(&converter)?;
            }
        }
        match &mut self.array {
            Array::Narrow(file) => {
                file.push(self.codes.iter().map(|code| u16::try_from(*code).unwrap_or(u16::MAX)))?;
                file.flush()?;
            }
            Array::Wide(file) => {
                file.push(self.codes.iter().copied())?;
                file.flush()?;
            }
            Array::Volts(file) => {
                file.push(block.volts.iter().copied())?;
                file.flush()?;
            }
        }
        self.missing += block.volts.iter().filter(|v| v.is_nan()).count();
        Ok(())
    }

    /// Writes volts in place of the codes so far, and from here on.
    fn become_volts(&mut self, converter: &Converter) -> Result<(), Refusal> {
        self.converter = None;
        let mut volts = NpyFile::create(&self.dir.join(name(self.mode, false)), &self.shape)?;
        let mark = missing_mark(converter);
        let of_code = |code| if code == mark { f64::NAN } else { converter.volts(code) };
        let width = if is_narrow(converter) { size_of::<u16>() } else { size_of::<u32>() };
        let code = |bytes: &[u8]| bytes.iter().rev().fold(0, |code, byte| code << 8 | u32::from(*byte));
        let mut push = |bytes: &[u8]| volts.push(bytes.chunks_exact(width).map(|bytes| of_code(code(bytes))));
        match &mut self.array {
            Array::Narrow(file) => file.read_back(&mut push)?,
            Array::Wide(file) => file.read_back(&mut push)?,
            Array::Volts(_) => {}
        }
        self.array = Array::Volts(volts);
        Ok(())
    }

    /// Gives the array, which has `blocks` blocks, its name, and says what it is.
    fn finish(self, blocks: usize) -> Result<Samples, Refusal> {
        let contents = self.contents();
        match self.array {
            Array::Narrow(file) => file.finish_with(blocks)?,
            Array::Wide(file) => file.finish_with(blocks)?,
            Array::Volts(file) => file.finish_with(blocks)?,
        }
        Ok(contents)
    }

    /// What the array is so far.
    fn contents(&self) -> Samples {
        let coded = self.converter.is_some();
        Samples {
            file: name(self.mode, coded),
            kind: if coded { SampleKind::Codes } else { SampleKind::Volts },
            missing: self.missing,
        }
    }

    /// File of the samples and its size, bytes, when it has all blocks of `recording`.
    fn size(&self, recording: &Recording) -> (PathBuf, u64) {
        let coded = self.converter.filter(|converter| {
            let mut samples = recording.blocks().iter().flat_map(|block| &block.volts);
            samples.all(|volts| code(*volts, converter, missing_mark(converter)).is_some())
        });
        let width = match coded {
            Some(converter) if is_narrow(&converter) => size_of::<u16>(),
            Some(_) => size_of::<u32>(),
            None => size_of::<f64>(),
        };
        let file = self.dir.join(name(self.mode, coded.is_some()));
        (file, npy_bytes(&self.shape, width))
    }
}

fn name(mode: &str, coded: bool) -> String {
    format!("{mode}_{}.npy", if coded { "codes" } else { "volts" })
}

/// Writes a session, block by block, into a folder that is moved into place afterwards.
///
/// ```
/// # use spts::{Block, Mode, Recording, RecordingInfo, Seeding, SkinLayout, WeightMode, Weights};
/// use spts::session::{Event, Recorded, Session, SessionWriter};
///
/// # let layout = SkinLayout::new(1, 8, 5e-3, 3e-3)?;
/// # let info = RecordingInfo::new(layout, Weights::new(WeightMode::Binary, Seeding::Mixed, 8), 64_300.0);
/// # let block = |end| Block { frame_position: end, idle_frames: None, volts: vec![0.25; 80] };
/// # let piece = |end| Recording::new(info.clone(), vec![block(end)]).map(Recorded::new);
/// # let dir = std::env::temp_dir().join(format!("spts-doc-writer-{}", std::process::id()));
/// # std::fs::create_dir_all(&dir)?;
/// let mut writer = SessionWriter::create(&dir, &Session::new("cup", Event::Press))?;
/// for end in [10, 20] {
///     writer.push(Mode::Compressive, &piece(end)?, 2)?;
/// }
/// writer.finish()?;
/// let session = Session::read(&dir)?;
/// assert_eq!(session.compressive().map(|r| r.blocks().len()), Some(2));
/// # std::fs::remove_dir_all(&dir)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct SessionWriter {
    dir: PathBuf,
    contents: Contents,
    raster: Option<RecordingWriter>,
    compressive: Option<RecordingWriter>,
    /// Whether a session that is too large to read again is refused.
    limited: bool,
}

impl SessionWriter {
    /// Starts `session` in the folder `dir`, which must exist. [`SessionWriter::push`] adds its recordings.
    ///
    /// # Errors
    /// [`Refusal`] for a name or a hold that could not be read again.
    pub fn create(dir: &Path, session: &Session) -> Result<Self, Refusal> {
        check_header(session).map_err(|invalid| refused(dir, &invalid))?;
        Ok(Self {
            dir: dir.to_owned(),
            contents: Contents {
                format: FORMAT.to_owned(),
                schema: SCHEMAS[0],
                name: session.name.clone(),
                object: session.object.clone(),
                event: session.event,
                hold_s: session.hold_s,
                raster: None,
                compressive: None,
                provenance: session.provenance.clone(),
            },
            raster: None,
            compressive: None,
            limited: false,
        })
    }

    /// The same writer, which refuses arrays that are too large to be read again.
    #[must_use]
    pub fn limited(self) -> Self {
        Self { limited: true, ..self }
    }

    /// Writes the next blocks of the recording in `mode`, which will have at most `blocks` blocks in all. A recording
    /// that ends earlier has those that were written.
    ///
    /// # Errors
    /// [`Refusal`] if the blocks contradict the earlier ones, or a file cannot be written.
    pub fn push(&mut self, mode: Mode, piece: &Recorded, blocks: usize) -> Result<(), Refusal> {
        check_recorded(mode, piece, blocks)
            .and_then(|()| check_hold(self.contents.hold_s, &piece.recording))
            .map_err(|invalid| refused(&self.dir, &invalid))?;
        let writer = match mode {
            Mode::Raster => &mut self.raster,
            Mode::Compressive => &mut self.compressive,
        };
        let writer = match writer {
            Some(writer) => writer,
            None => writer.insert(RecordingWriter::create(&self.dir, mode, piece, blocks, self.limited)?),
        };
        writer.push(piece)
    }

    /// Completes the session, with all blocks that were written whole. `session.json` is written last: a folder that
    /// holds it is complete.
    ///
    /// # Errors
    /// [`Refusal`] if a file cannot be written.
    pub fn finish(mut self) -> Result<(), Refusal> {
        self.contents.raster = self.raster.map(RecordingWriter::finish).transpose()?;
        self.contents.compressive = self.compressive.map(RecordingWriter::finish).transpose()?;
        let path = self.dir.join(SESSION_FILE);
        if self.contents.recorded().any(RecordedContents::has_wires) {
            self.contents.schema = SCHEMAS[1];
        }
        let text = serde_json::to_string_pretty(&self.contents).map_err(unwritable(&path))?;
        let text = text + "\n";
        if self.limited {
            bounded(&path, "session", text.len() as u64, MAX_BYTES)?;
        }
        write_bytes(&path, text.as_bytes())
    }
}

/// The error of what could not be read again.
fn refused(dir: &Path, invalid: &Refusal) -> Refusal {
    invalid.clone().at("cannot be written").at(dir.join(SESSION_FILE).display())
}

/// Refuses a file that would be too large to be read again.
fn bounded(path: &Path, what: &str, bytes: u64, limit: u64) -> Result<(), Refusal> {
    if bytes <= limit {
        return Ok(());
    }
    let problem = format!(
        "cannot be written: `{what}` = {bytes} bytes is outside [0, {limit}], the sizes that can be read again"
    );
    Err(Refusal::new(problem).at(path.display()))
}

/// One recording that is being written.
struct RecordingWriter {
    samples: SampleFile,
    pressure: MapFile,
    conductance: MapFile,
    contents: RecordedContents,
}

impl RecordingWriter {
    /// Begins a recording like `piece`, of `blocks` blocks.
    fn create(dir: &Path, mode: Mode, piece: &Recorded, blocks: usize, limited: bool) -> Result<Self, Refusal> {
        let recording = &piece.recording;
        let shape = [blocks, recording.frames(), recording.measurements_per_frame()];
        let samples = SampleFile::create(dir, mode.name(), shape, recording.converter())?;
        let layout = recording.layout();
        let maps = [blocks, layout.rows(), layout.cols()];
        let of = |name: &str| MapFile::new(dir, format!("{}_{name}.npy", mode.name()), maps);
        let (pressure, conductance) = (of("pressure_pa"), of("conductance_s"));
        if limited {
            let named = |what: &str| format!("{}.{what}", mode.name());
            let (file, bytes) = samples.size(recording);
            bounded(&file, &named("samples"), bytes, npy::MAX_BYTES)?;
            let bytes = npy_bytes(&maps, size_of::<f64>());
            bounded(&dir.join(&pressure.name), &named("pressure_pa"), bytes, npy::MAX_BYTES)?;
        }
        Ok(Self {
            contents: RecordedContents {
                info: recording.info().clone(),
                frames: recording.frames(),
                conditioning: piece.conditioning,
                blocks: Vec::with_capacity(blocks),
                samples: samples.contents(),
                pressure_pa: None,
                conductance_s: None,
            },
            samples,
            pressure,
            conductance,
        })
    }

    fn push(&mut self, piece: &Recorded) -> Result<(), Refusal> {
        for (k, block) in piece.recording.blocks().iter().enumerate() {
            self.samples.push(block)?;
            let facts = piece.facts(k).cloned().unwrap_or_default();
            self.pressure.push(facts.pressure.as_ref().map(Grid::values))?;
            self.conductance.push(facts.conductance.as_ref().map(Grid::values))?;
            self.contents.blocks.push(contents_of(block, &facts));
        }
        Ok(())
    }

    fn finish(self) -> Result<RecordedContents, Refusal> {
        let blocks = self.contents.blocks.len();
        Ok(RecordedContents {
            samples: self.samples.finish(blocks)?,
            pressure_pa: self.pressure.finish(blocks)?,
            conductance_s: self.conductance.finish(blocks)?,
            conditioning: self.contents.conditioning.min(blocks),
            ..self.contents
        })
    }
}

fn contents_of(block: &Block, facts: &PressFacts) -> BlockContents {
    BlockContents {
        frame_position: block.frame_position,
        idle_frames: block.idle_frames,
        time_s: facts.time_s,
        pose: facts.pose,
        force_n: facts.force_n,
    }
}

/// One map a block, NaN where there is none; no file as long as there is none at all.
struct MapFile {
    dir: PathBuf,
    name: String,
    shape: [usize; 3],
    unknown: usize,
    file: Option<NpyFile<f64>>,
}

impl MapFile {
    fn new(dir: &Path, name: String, shape: [usize; 3]) -> Self {
        Self { dir: dir.to_owned(), name, shape, unknown: 0, file: None }
    }

    fn push(&mut self, map: Option<&[f64]>) -> Result<(), Refusal> {
        let taxels = self.shape[1] * self.shape[2];
        let unknown = |blocks| std::iter::repeat_n(f64::NAN, blocks * taxels);
        match (map, &mut self.file) {
            (None, None) => {
                self.unknown += 1;
                Ok(())
            }
            (None, Some(file)) => file.push(unknown(1)),
            (Some(map), Some(file)) => file.push(map.iter().copied()),
            (Some(map), None) => {
                let file = self.file.insert(NpyFile::create(&self.dir.join(&self.name), &self.shape)?);
                file.push(unknown(self.unknown))?;
                file.push(map.iter().copied())
            }
        }
    }

    /// Gives the file, which has `blocks` blocks, its name, and gives that back.
    fn finish(self, blocks: usize) -> Result<Option<String>, Refusal> {
        self.file.map(|file| file.finish_with(blocks).map(|()| self.name)).transpose()
    }
}

impl Session {
    /// Writes the session into the folder `dir`, which is made where it is missing: all of its files, or none.
    ///
    /// # Errors
    /// [`Refusal`] when the session or one of its files could not be read again, or the folder cannot be
    /// filled, as for [`OutputFolder::open`] and [`OutputFolder::commit`].
    pub fn write(&self, dir: &Path) -> Result<(), Refusal> {
        let out = OutputFolder::open(dir)?;
        let written = self.write_files(&out.path(""));
        written.map_err(|error| out.unstaged(error))?;
        out.commit()?;
        Ok(())
    }

    /// Writes the session's files into the folder `dir`, which exists, one by one: for a folder that waits to be put in
    /// place.
    ///
    /// # Errors
    /// [`Refusal`] when the session or one of its files could not be read again, or a file cannot be written.
    pub fn write_files(&self, dir: &Path) -> Result<(), Refusal> {
        check(self).map_err(|invalid| refused(dir, &invalid))?;
        let mut writer = SessionWriter::create(dir, self)?.limited();
        for (mode, recorded) in [(Mode::Raster, &self.raster), (Mode::Compressive, &self.compressive)] {
            if let Some(recorded) = recorded {
                writer.push(mode, recorded, recorded.recording.blocks().len())?;
            }
        }
        writer.finish()
    }

    /// Reads the session in the folder `dir`.
    ///
    /// # Errors
    /// [`Refusal`] for a schema that is not known, a file that is missing or damaged, or numbers that contradict
    /// each other.
    pub fn read(dir: &Path) -> Result<Self, Refusal> {
        let path = dir.join(SESSION_FILE);
        let text = spts_input::read_text(&path, MAX_BYTES).map_err(Refusal::in_file(&path))?;
        let version: Version = parse_json(&path, &text)?;
        if version.format != FORMAT {
            let found = format!("{:?}", version.format);
            return Err(outside(&path, "format", found, format!("{{{FORMAT:?}}}")));
        }
        if !SCHEMAS.contains(&version.schema) {
            let [one, several] = SCHEMAS;
            let problem = format!("`schema` = {} is not known; this program reads {one} and {several}", version.schema);
            return Err(Refusal::new(problem).at(path.display()));
        }
        let contents: Contents = parse_json(&path, &text)?;
        if version.schema == SCHEMAS[0] && contents.recorded().any(RecordedContents::has_wires) {
            let needed = format!("{{{}}}, which has `wires`", SCHEMAS[1]);
            return Err(outside(&path, "schema", version.schema, needed));
        }
        let files: Vec<String> = contents.files().into_iter().map(str::to_owned).collect();
        let read = |contents: Option<RecordedContents>, mode| {
            contents.map(|contents| read_recorded(dir, &path, mode, contents)).transpose()
        };
        let session = Self {
            raster: read(contents.raster, "raster")?,
            compressive: read(contents.compressive, "compressive")?,
            name: contents.name,
            object: contents.object,
            event: contents.event,
            hold_s: contents.hold_s,
            provenance: contents.provenance,
        };
        check(&session).map_err(|invalid| invalid.at(path.display()))?;
        // what is wrong in a file is said first; whoever has changed the text has taken over the arrays, too
        if check_whole(dir, &[SESSION_FILE]).is_ok() {
            check_whole(dir, &files.iter().map(String::as_str).collect::<Vec<_>>())?;
        }
        Ok(session)
    }
}

fn read_recorded(dir: &Path, path: &Path, mode: &'static str, contents: RecordedContents) -> Result<Recorded, Refusal> {
    let RecordedContents { info, frames, .. } = &contents;
    let shape = [contents.blocks.len(), *frames, info.measurements_per_frame];
    let expected = Expected { shape: &shape, dimensions: "blocks × frames × measurements a frame" };
    let file = plain(path, &format!("{mode}.samples.file"), &contents.samples.file)?;
    let file = dir.join(file);
    let volts = match contents.samples.kind {
        SampleKind::Volts => read_doubles(&file, Some(expected))?.values,
        SampleKind::Codes => read_volts(path, &file, mode, info, expected)?,
    };
    let missing = volts.iter().filter(|v| v.is_nan()).count();
    if missing != contents.samples.missing {
        let range = format!("{{{missing}}}, the missing samples in {}", contents.samples.file);
        let field = format!("{mode}.samples.missing");
        return Err(outside(path, &field, contents.samples.missing, range));
    }
    let map_shape = [contents.blocks.len(), info.layout.rows(), info.layout.cols()];
    let maps = |field: &str, file: Option<&String>| {
        let Some(file) = file else {
            return Ok::<_, Refusal>(Vec::new());
        };
        let file = dir.join(plain(path, &format!("{mode}.{field}"), file)?);
        let expected = Expected { shape: &map_shape, dimensions: "blocks × rows × cols" };
        let values = read_doubles(&file, Some(expected))?.values;
        check_truth(&file, &values, info.layout.taxels())?;
        Ok(values)
    };
    let pressure = maps("pressure_pa", contents.pressure_pa.as_ref())?;
    let conductance = maps("conductance_s", contents.conductance_s.as_ref())?;
    let taxels = info.layout.taxels();
    // the array has this shape, so that the product can be counted unless there is no block
    let samples = frames.saturating_mul(info.measurements_per_frame);
    let (mut blocks, mut presses) = (Vec::new(), Vec::new());
    for (k, block) in contents.blocks.iter().enumerate() {
        blocks.push(Block {
            frame_position: block.frame_position,
            idle_frames: block.idle_frames,
            volts: copied(&volts[k * samples..(k + 1) * samples]).map_err(Refusal::in_file(&file))?,
        });
        presses.push(PressFacts {
            time_s: block.time_s,
            pose: block.pose,
            force_n: block.force_n,
            pressure: map_of(&pressure, k, taxels, info),
            conductance: map_of(&conductance, k, taxels, info),
            course: None,
        });
    }
    if presses.iter().all(|facts| *facts == PressFacts::default()) {
        presses.clear();
    }
    let recording =
        Recording::new(contents.info, blocks).map_err(|error| error.at(format!("{}: `{mode}`", path.display())))?;
    Ok(Recorded { recording, conditioning: contents.conditioning, presses })
}

/// Map of block `block`; `None` where it is not known.
fn map_of<U>(maps: &[f64], block: usize, taxels: usize, info: &RecordingInfo) -> Option<Grid<U>> {
    let values = maps.get(block * taxels..(block + 1) * taxels)?;
    let known = values.iter().any(|v| !v.is_nan());
    known.then(|| Grid::from_values(info.layout.rows(), info.layout.cols(), values.to_vec()))
}

/// Volts of the codes in `file`.
fn read_volts(
    path: &Path,
    file: &Path,
    mode: &str,
    info: &RecordingInfo,
    expected: Expected<'_>,
) -> Result<Vec<f64>, Refusal> {
    let Some(converter) = &info.converter else {
        let range = "{\"volts\"}, because `info.converter` is not given";
        return Err(outside(path, &format!("{mode}.samples.kind"), "\"codes\"", range));
    };
    let codes = read_codes(file, Some(expected))?.values;
    let missing = missing_mark(converter);
    let mut volts = room(codes.len()).map_err(Refusal::in_file(file))?;
    for (index, &code) in codes.iter().enumerate() {
        volts.push(match code {
            _ if code == missing => f64::NAN,
            _ if code <= converter.max_code() => converter.volts(code),
            _ => {
                let codes = format!("the converter has the codes 0 to {}", converter.max_code());
                let problem = format!("entry {index} is {code}; {codes}, and {missing} marks a missing sample");
                return Err(Refusal::new(problem).at(file.display()));
            }
        });
    }
    Ok(volts)
}

/// Refuses maps of pressure or conductance that cannot be. A block whose map is not known has NaN everywhere.
fn check_truth(file: &Path, values: &[f64], taxels: usize) -> Result<(), Refusal> {
    for (block, map) in values.chunks_exact(taxels.max(1)).enumerate() {
        let sound = |v: &f64| v.is_finite() && *v >= 0.0;
        if map.iter().all(|v| v.is_nan()) {
            continue;
        }
        if let Some(taxel) = map.iter().position(|v| !sound(v)) {
            let (index, value) = (block * taxels + taxel, map[taxel]);
            return Err(Refusal::new(format!(
                "{}: entry {index} (in C order, from 0) is {value}, outside [0, ∞); NaN marks a map that is not known and then fills all of it",
                file.display()
            )));
        }
    }
    Ok(())
}

/// A copy of `values`, if there is memory for one.
fn copied(values: &[f64]) -> std::io::Result<Vec<f64>> {
    let mut copy = room(values.len())?;
    copy.extend_from_slice(values);
    Ok(copy)
}

/// `name`, which has to be that of a file beside `session.json`.
fn plain<'a>(path: &Path, field: &str, name: &'a str) -> Result<&'a Path, Refusal> {
    let file = Path::new(name);
    if is_plain(name) {
        return Ok(file);
    }
    let range = "the names of files beside session.json";
    Err(outside(path, field, format!("{name:?}"), range))
}

/// The error of a field of the file at `path`.
fn outside(path: &Path, field: &str, value: impl Display, range: impl Display) -> Refusal {
    Refusal::range(field, value, range).at(path.display())
}

/// The value that the JSON text `text` of the file at `path` describes.
///
/// # Errors
/// [`Refusal`] with file and field.
pub fn parse_json<T: DeserializeOwned>(path: &Path, text: &str) -> Result<T, Refusal> {
    let mut reader = serde_json::Deserializer::from_str(text);
    let wrong = |reason: String| Refusal::new(reason).at(path.display());
    let parsed = serde_path_to_error::deserialize(Tables(&mut reader)).map_err(|error| {
        let field = error.path().to_string();
        match field.as_str() {
            // what is wrong is not in a field
            "." => wrong(error.inner().to_string()),
            _ => wrong(format!("`{field}`: {}", error.inner())),
        }
    })?;
    reader.end().map_err(|error| wrong(error.to_string()))?;
    Ok(parsed)
}
