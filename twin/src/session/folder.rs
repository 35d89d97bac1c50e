//! A session as a folder: `session.json` and its arrays. Writing and reading loses nothing.

use super::arrays::{Expected, read_codes, read_doubles};
use super::check::{check, is_plain};
use super::codes::missing_mark;
use super::contents::{Contents, RecordedContents, SampleKind, Version};
use super::error::SessionError;
use super::npy_header::room;
use super::writer::{SessionWriter, refused};
use super::{PressFacts, Recorded, Session};
use crate::output::{OutputError, OutputFolder, check_whole};
use serde::de::DeserializeOwned;
use spts_circuit::{Block, Mode, Recording, RecordingInfo};
use spts_models::Grid;
use std::path::Path;

/// Version of the schema of `session.json` that is written, and the only one that is read.
pub const SCHEMA: u64 = 1;
/// The file that makes a folder a session.
pub const SESSION_FILE: &str = "session.json";

/// `format` of every session.
pub(super) const FORMAT: &str = "spts-session";
/// Versions that are read, as a user is told.
const KNOWN: &str = "1";
/// Largest `session.json` that is read, bytes: explicit seeds of a million taxels and poses of 100,000 presses.
pub(super) const MAX_BYTES: u64 = 1 << 26;

impl Session {
    /// Writes the session into the folder `dir`, which is made where it is missing: all of its files, or none.
    ///
    /// # Errors
    /// [`SessionError::Output`] when the session or one of its files could not be read again, or the folder cannot be
    /// filled, as for [`OutputFolder::open`] and [`OutputFolder::commit`].
    pub fn write(&self, dir: &Path) -> Result<(), SessionError> {
        let out = OutputFolder::open(dir, &[SESSION_FILE])?;
        let written = self.write_files(&out.path(""));
        written.map_err(|error| SessionError::Output(out.unstaged(error)))?;
        out.commit()?;
        Ok(())
    }

    /// Writes the session's files into the folder `dir`, which exists, one by one: for a folder that waits to be put in
    /// place.
    ///
    /// # Errors
    /// [`OutputError`] when the session or one of its files could not be read again, or a file cannot be written.
    pub fn write_files(&self, dir: &Path) -> Result<(), OutputError> {
        check(self).map_err(|invalid| refused(dir, invalid))?;
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
    /// [`SessionError`] for a schema that is not known, a file that is missing or damaged, or numbers that contradict
    /// each other.
    pub fn read(dir: &Path) -> Result<Self, SessionError> {
        check_whole(dir, &[])?;
        let path = dir.join(SESSION_FILE);
        let text = read_text(&path)?;
        let version: Version = parse(&path, &text)?;
        let unknown = |field: &str, value: String, range: String| SessionError::Field {
            path: path.clone(),
            field: field.to_owned(),
            value,
            range,
        };
        if version.format != FORMAT {
            return Err(unknown(
                "format",
                format!("{:?}", version.format),
                format!("{{{FORMAT:?}}}"),
            ));
        }
        if version.schema != SCHEMA {
            return Err(SessionError::Schema {
                path,
                found: version.schema,
                known: KNOWN,
            });
        }
        let contents: Contents = parse(&path, &text)?;
        let files: Vec<String> = contents.files().into_iter().map(str::to_owned).collect();
        let read = |contents: Option<RecordedContents>, mode| {
            contents
                .map(|contents| read_recorded(dir, &path, mode, contents))
                .transpose()
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
        check(&session).map_err(|invalid| unknown(&invalid.field, invalid.value, invalid.range))?;
        // what is wrong in a file is said first; whoever has changed the text has taken over the arrays, too
        if check_whole(dir, &[SESSION_FILE]).is_ok() {
            check_whole(dir, &files.iter().map(String::as_str).collect::<Vec<_>>())?;
        }
        Ok(session)
    }
}

fn read_recorded(
    dir: &Path,
    path: &Path,
    mode: &'static str,
    contents: RecordedContents,
) -> Result<Recorded, SessionError> {
    let RecordedContents { info, frames, .. } = &contents;
    let shape = [contents.blocks.len(), *frames, info.measurements_per_frame];
    let expected = Expected {
        shape: &shape,
        dimensions: "blocks × frames × measurements a frame",
    };
    let file = plain(path, &format!("{mode}.samples.file"), &contents.samples.file)?;
    let file = dir.join(file);
    let volts = match contents.samples.kind {
        SampleKind::Volts => read_doubles(&file, Some(expected))?.values,
        SampleKind::Codes => read_volts(path, &file, mode, info, expected)?,
    };
    let missing = volts.iter().filter(|v| v.is_nan()).count();
    if missing != contents.samples.missing {
        return Err(SessionError::Field {
            path: path.to_owned(),
            field: format!("{mode}.samples.missing"),
            value: contents.samples.missing.to_string(),
            range: format!("{{{missing}}}, the missing samples in {}", contents.samples.file),
        });
    }
    let map_shape = [contents.blocks.len(), info.layout.rows(), info.layout.cols()];
    let maps = |field: &str, file: Option<&String>| {
        let Some(file) = file else {
            return Ok::<_, SessionError>(Vec::new());
        };
        let file = dir.join(plain(path, &format!("{mode}.{field}"), file)?);
        let expected = Expected {
            shape: &map_shape,
            dimensions: "blocks × rows × cols",
        };
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
            volts: copied(&volts[k * samples..(k + 1) * samples]).map_err(|source| SessionError::Io {
                path: file.clone(),
                source,
            })?,
        });
        presses.push(PressFacts {
            time_s: block.time_s,
            pose: block.pose,
            force_n: block.force_n,
            pressure: map_of(&pressure, k, taxels, info),
            conductance: map_of(&conductance, k, taxels, info),
        });
    }
    if presses.iter().all(|facts| *facts == PressFacts::default()) {
        presses.clear();
    }
    let recording = Recording::new(contents.info, blocks).map_err(|source| SessionError::Recording {
        path: path.to_owned(),
        mode,
        source,
    })?;
    Ok(Recorded {
        recording,
        conditioning: contents.conditioning,
        presses,
    })
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
) -> Result<Vec<f64>, SessionError> {
    let Some(converter) = &info.converter else {
        return Err(SessionError::Field {
            path: path.to_owned(),
            field: format!("{mode}.samples.kind"),
            value: "\"codes\"".to_owned(),
            range: "{\"volts\"}, because `info.converter` is not given".to_owned(),
        });
    };
    let codes = read_codes(file, Some(expected))?.values;
    let missing = missing_mark(converter);
    let mut volts = room(codes.len()).map_err(|source| SessionError::Io {
        path: file.to_owned(),
        source,
    })?;
    for (index, &code) in codes.iter().enumerate() {
        volts.push(match code {
            _ if code == missing => f64::NAN,
            _ if code <= converter.max_code() => converter.volts(code),
            _ => {
                return Err(SessionError::Code {
                    path: file.to_owned(),
                    index,
                    code,
                    max_code: converter.max_code(),
                    missing,
                });
            }
        });
    }
    Ok(volts)
}

/// Refuses maps of pressure or conductance that cannot be. A block whose map is not known has NaN everywhere.
fn check_truth(file: &Path, values: &[f64], taxels: usize) -> Result<(), SessionError> {
    for (block, map) in values.chunks_exact(taxels.max(1)).enumerate() {
        let sound = |v: &f64| v.is_finite() && *v >= 0.0;
        if map.iter().all(|v| v.is_nan()) {
            continue;
        }
        if let Some(taxel) = map.iter().position(|v| !sound(v)) {
            return Err(SessionError::Truth {
                path: file.to_owned(),
                index: block * taxels + taxel,
                value: map[taxel],
            });
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
fn plain<'a>(path: &Path, field: &str, name: &'a str) -> Result<&'a Path, SessionError> {
    let file = Path::new(name);
    if is_plain(name) {
        return Ok(file);
    }
    Err(SessionError::Field {
        path: path.to_owned(),
        field: field.to_owned(),
        value: format!("{name:?}"),
        range: "the names of files beside session.json".to_owned(),
    })
}

fn read_text(path: &Path) -> Result<String, SessionError> {
    let io = |source| SessionError::Io {
        path: path.to_owned(),
        source,
    };
    spts_input::read_text(path, MAX_BYTES).map_err(|error| io(error.into()))
}

fn parse<T: DeserializeOwned>(path: &Path, text: &str) -> Result<T, SessionError> {
    let mut reader = serde_json::Deserializer::from_str(text);
    let wrong = |reason: String| SessionError::Text {
        path: path.to_owned(),
        reason,
    };
    let parsed = serde_path_to_error::deserialize(&mut reader).map_err(|error| {
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
