//! The samples of a recording, as an array written block by block. It holds codes as long as every sample is the
//! voltage of a code, and volts otherwise.

use super::arrays::npy_bytes;
use super::codes::{code, is_narrow, missing_mark};
use super::contents::{SampleKind, Samples};
use crate::output::{NpyFile, OutputError};
use spts_circuit::{Block, Converter, Recording};
use std::path::{Path, PathBuf};

/// Array that is being written.
enum Array {
    Narrow(NpyFile<u16>),
    Wide(NpyFile<u32>),
    Volts(NpyFile<f64>),
}

/// Samples that are being written.
pub(super) struct SampleFile {
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
    pub(super) fn create(
        dir: &Path,
        mode: &'static str,
        shape: [usize; 3],
        converter: Option<&Converter>,
    ) -> Result<Self, OutputError> {
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
    pub(super) fn push(&mut self, block: &Block) -> Result<(), OutputError> {
        self.missing += block.volts.iter().filter(|v| v.is_nan()).count();
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
            Array::Narrow(file) => file.push(self.codes.iter().map(|code| u16::try_from(*code).unwrap_or(u16::MAX))),
            Array::Wide(file) => file.push(self.codes.iter().copied()),
            Array::Volts(file) => file.push(block.volts.iter().copied()),
        }
    }

    /// Writes volts in place of the codes so far, and from here on.
    fn become_volts(&mut self, converter: &Converter) -> Result<(), OutputError> {
        self.converter = None;
        let mut volts = NpyFile::create(&self.dir.join(name(self.mode, false)), &self.shape)?;
        let mark = missing_mark(converter);
        let of_code = |code| if code == mark { f64::NAN } else { converter.volts(code) };
        let width = if is_narrow(converter) {
            size_of::<u16>()
        } else {
            size_of::<u32>()
        };
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

    /// Gives the array its name, and says what it is.
    pub(super) fn finish(self) -> Result<Samples, OutputError> {
        let contents = self.contents();
        match self.array {
            Array::Narrow(file) => file.finish()?,
            Array::Wide(file) => file.finish()?,
            Array::Volts(file) => file.finish()?,
        }
        Ok(contents)
    }

    /// What the array is so far.
    pub(super) fn contents(&self) -> Samples {
        let coded = self.converter.is_some();
        Samples {
            file: name(self.mode, coded),
            kind: if coded { SampleKind::Codes } else { SampleKind::Volts },
            missing: self.missing,
        }
    }

    /// File of the samples and its size, bytes, when it has all blocks of `recording`.
    pub(super) fn size(&self, recording: &Recording) -> (PathBuf, u64) {
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
