//! A table spread over several Parquet files in chunks, as in LeRobot's layout.

use crate::error::DatasetError;
use arrow_array::RecordBatch;
use arrow_schema::SchemaRef;
use parquet::arrow::ArrowWriter;
use parquet::basic::{Compression, ZstdLevel};
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use spts::output::{AtomicFile, OutputFolder};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Files of a chunk, and the size of a file before compression, MB of 2^20 bytes: LeRobot's defaults, which `info.json`
/// repeats.
pub(super) const CHUNK_FILES: u64 = 1000;
pub(super) const FILE_MB: u64 = 100;
/// Most groups of rows of a file, whose descriptions a writer and every reader keep in memory.
const FILE_GROUPS: u64 = 10_000;

/// A table over the files `FOLDER/chunk-000/file-000.parquet` and so on.
pub(super) struct Series<'a> {
    out: &'a OutputFolder,
    folder: &'static str,
    schema: SchemaRef,
    /// Number of the file being written, and its content.
    number: u64,
    bytes: u64,
    groups: u64,
    open: Option<(ArrowWriter<AtomicFile>, PathBuf)>,
}

impl<'a> Series<'a> {
    pub(super) fn new(out: &'a OutputFolder, folder: &'static str, schema: SchemaRef) -> Self {
        Self {
            out,
            folder,
            schema,
            number: 0,
            bytes: 0,
            groups: 0,
            open: None,
        }
    }

    /// Whether so many bytes more belong into the next file.
    pub(super) fn is_full_for(&self, bytes: u64) -> bool {
        let is_large = self.bytes > 0 && self.bytes + bytes > FILE_MB << 20;
        is_large || self.groups >= FILE_GROUPS
    }

    /// Makes room for rows of so many bytes, in the next file if this one [is full](Self::is_full_for): chunk and file
    /// that they belong to.
    pub(super) fn reserve(&mut self, bytes: u64) -> Result<[u64; 2], DatasetError> {
        if self.is_full_for(bytes) {
            self.close()?;
            self.number += 1;
            (self.bytes, self.groups) = (0, 0);
        }
        self.bytes += bytes;
        Ok([self.number / CHUNK_FILES, self.number % CHUNK_FILES])
    }

    /// Writes rows for which there is room as a group of their own.
    pub(super) fn write(&mut self, batch: &RecordBatch) -> Result<(), DatasetError> {
        let (writer, path) = match &mut self.open {
            Some(open) => open,
            None => {
                let [chunk, file] = [self.number / CHUNK_FILES, self.number % CHUNK_FILES];
                let folder = self.out.folder(&format!("{}/chunk-{chunk:03}", self.folder))?;
                let path = folder.join(format!("file-{file:03}.parquet"));
                let out = AtomicFile::create(&path)?;
                let writer = ArrowWriter::try_new(out, Arc::clone(&self.schema), Some(Self::properties(&path)?));
                let writer = writer.map_err(|e| DatasetError::file(&path, e.to_string()))?;
                self.open.insert((writer, path))
            }
        };
        let written = writer.write(batch).and_then(|()| writer.flush());
        written.map_err(|e| DatasetError::file(&*path, e.to_string()))?;
        self.groups += 1;
        Ok(())
    }

    /// How the file `path` is written: compressed, and with nothing that differs from run to run.
    pub(super) fn properties(path: &Path) -> Result<WriterProperties, DatasetError> {
        let level = ZstdLevel::try_new(1).map_err(|e| DatasetError::file(path, e.to_string()))?;
        let properties = WriterProperties::builder()
            .set_created_by(format!("spts {}", crate::shard::version()))
            .set_compression(Compression::ZSTD(level))
            .set_max_row_group_row_count(None)
            .set_dictionary_enabled(false)
            // a writer keeps what it knows of every group until the file ends: no statistics, no index of pages
            .set_statistics_enabled(EnabledStatistics::None)
            .set_offset_index_disabled(true);
        Ok(properties.build())
    }

    /// Ends the file that is being written.
    pub(super) fn close(&mut self) -> Result<(), DatasetError> {
        let Some((writer, path)) = self.open.take() else {
            return Ok(());
        };
        let file = writer
            .into_inner()
            .map_err(|e| DatasetError::file(path, e.to_string()))?;
        Ok(file.finish()?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arrow_array::Int64Array;
    use arrow_schema::{DataType, Field, Schema};

    /// A file is closed before it grows over its size or its number of groups; one group may be larger; chunks have
    /// 1000 files.
    #[test]
    fn files_have_limits() {
        let dir = tempfile::tempdir().unwrap();
        let out = OutputFolder::open(&dir.path().join("out")).unwrap();
        let schema = Arc::new(Schema::new(vec![Field::new("k", DataType::Int64, true)]));
        let mut series = Series::new(&out, "data", Arc::clone(&schema));
        let mut add = |megabytes: u64| {
            let place = series.reserve(megabytes << 20).unwrap();
            let column = Arc::new(Int64Array::from_iter_values([0, 1]));
            series
                .write(&RecordBatch::try_new(Arc::clone(&schema), vec![column]).unwrap())
                .unwrap();
            place
        };
        assert_eq!(
            [60, 40, 1, 99, 500, 1].map(&mut add),
            [[0, 0], [0, 0], [0, 1], [0, 1], [0, 2], [0, 3]]
        );
        for file in 4..1001 {
            assert_eq!(add(100), [file / 1000, file % 1000]);
        }
        for group in 0..=FILE_GROUPS {
            // the file has a group already
            assert_eq!(add(0), [1, u64::from(group >= FILE_GROUPS - 1)], "group {group}");
        }
        series.close().unwrap();
        out.commit().unwrap();
        let folder = dir.path().join("out/data");
        let files = |chunk: &str| std::fs::read_dir(folder.join(chunk)).unwrap().count();
        assert_eq!([files("chunk-000"), files("chunk-001")], [1000, 2]);
    }
}
