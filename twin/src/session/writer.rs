//! Writes a session's folder block by block, so that a session may be larger than the memory.

use super::arrays::{self, npy_bytes};
use super::check::{Invalid, check_header, check_recorded};
use super::contents::{BlockContents, Contents, RecordedContents};
use super::folder::{FORMAT, MAX_BYTES, SCHEMA, SESSION_FILE};
use super::samples::SampleFile;
use super::{PressFacts, Recorded, Session};
use crate::output::{NpyFile, OutputError, write_bytes};
use spts_circuit::{Block, Mode};
use spts_models::Grid;
use std::path::{Path, PathBuf};

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
    /// [`OutputError::Field`] for a name or a hold that could not be read again.
    pub fn create(dir: &Path, session: &Session) -> Result<Self, OutputError> {
        check_header(session).map_err(|invalid| refused(dir, invalid))?;
        Ok(Self {
            dir: dir.to_owned(),
            contents: Contents {
                format: FORMAT.to_owned(),
                schema: SCHEMA,
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
    pub(super) fn limited(self) -> Self {
        Self { limited: true, ..self }
    }

    /// Writes the next blocks of the recording in `mode`, which will have `blocks` blocks in all.
    ///
    /// # Errors
    /// [`OutputError`] if the blocks contradict the earlier ones, or a file cannot be written.
    pub fn push(&mut self, mode: Mode, piece: &Recorded, blocks: usize) -> Result<(), OutputError> {
        check_recorded(mode, piece, blocks).map_err(|invalid| refused(&self.dir, invalid))?;
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

    /// Completes the session. `session.json` is written last: a folder that holds it is complete.
    ///
    /// # Errors
    /// [`OutputError`] if a recording has another number of blocks than announced, or a file cannot be written.
    pub fn finish(mut self) -> Result<(), OutputError> {
        self.contents.raster = self.raster.map(RecordingWriter::finish).transpose()?;
        self.contents.compressive = self.compressive.map(RecordingWriter::finish).transpose()?;
        let path = self.dir.join(SESSION_FILE);
        let text = serde_json::to_string_pretty(&self.contents).map_err(|error| OutputError::Write {
            path: path.clone(),
            source: error.into(),
        })?;
        let text = text + "\n";
        if self.limited {
            bounded(&path, "session", text.len() as u64, MAX_BYTES)?;
        }
        write_bytes(&path, text.as_bytes())
    }
}

/// The error of a field that could not be read again.
pub(super) fn refused(dir: &Path, invalid: Invalid) -> OutputError {
    OutputError::Field {
        path: dir.join(SESSION_FILE),
        field: invalid.field,
        value: invalid.value,
        range: invalid.range,
    }
}

/// Refuses a file that would be too large to be read again.
fn bounded(path: &Path, what: &str, bytes: u64, limit: u64) -> Result<(), OutputError> {
    if bytes <= limit {
        return Ok(());
    }
    Err(OutputError::TooLarge {
        path: path.to_owned(),
        what: what.to_owned(),
        bytes,
        limit,
    })
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
    fn create(dir: &Path, mode: Mode, piece: &Recorded, blocks: usize, limited: bool) -> Result<Self, OutputError> {
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
            bounded(&file, &named("samples"), bytes, arrays::MAX_BYTES)?;
            let bytes = npy_bytes(&maps, size_of::<f64>());
            bounded(
                &dir.join(&pressure.name),
                &named("pressure_pa"),
                bytes,
                arrays::MAX_BYTES,
            )?;
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

    fn push(&mut self, piece: &Recorded) -> Result<(), OutputError> {
        for (k, block) in piece.recording.blocks().iter().enumerate() {
            self.samples.push(block)?;
            let facts = piece.facts(k).cloned().unwrap_or_default();
            self.pressure.push(facts.pressure.as_ref().map(Grid::values))?;
            self.conductance.push(facts.conductance.as_ref().map(Grid::values))?;
            self.contents.blocks.push(contents_of(block, &facts));
        }
        Ok(())
    }

    fn finish(self) -> Result<RecordedContents, OutputError> {
        Ok(RecordedContents {
            samples: self.samples.finish()?,
            pressure_pa: self.pressure.finish()?,
            conductance_s: self.conductance.finish()?,
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
        Self {
            dir: dir.to_owned(),
            name,
            shape,
            unknown: 0,
            file: None,
        }
    }

    fn push(&mut self, map: Option<&[f64]>) -> Result<(), OutputError> {
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
                let file = self
                    .file
                    .insert(NpyFile::create(&self.dir.join(&self.name), &self.shape)?);
                file.push(unknown(self.unknown))?;
                file.push(map.iter().copied())
            }
        }
    }

    /// Gives the file its name, and gives that back.
    fn finish(self) -> Result<Option<String>, OutputError> {
        self.file.map(|file| file.finish().map(|()| self.name)).transpose()
    }
}
