//! Rows of a data set as JSON, read from its files or made from its specification.

use crate::columns::{Column, columns, put, stores};
use crate::error::DatasetError;
use crate::folder::Dataset;
use crate::make::Maker;
use crate::read::{ColumnValues, Wanted, batches, json};
use crate::shard::{check_shard, schema, shard_rows};
use crate::spec::{Spec, SpecConfig};
use crate::store::Store;
use arrow_array::ArrayRef;
use arrow_schema::{ArrowError, Schema};
use serde_json::Value;
use std::collections::BTreeSet;

/// Row `row` of a batch with these columns, as a JSON object.
fn object(schema: &Schema, columns: &[ArrayRef], row: usize) -> Value {
    let fields = schema.fields().iter().zip(columns);
    fields
        .map(|(field, array)| (field.name().clone(), json(array, row)))
        .collect()
}

impl Dataset {
    /// The first `rows` rows; each is an object with one entry a column.
    ///
    /// # Errors
    /// [`DatasetError`] if a file is missing or cannot be read.
    pub fn head(&self, rows: u64) -> Result<Vec<Value>, DatasetError> {
        let mut found = Vec::new();
        let wanted = (0..rows.min(self.spec().config().rows)).collect();
        self.rows(&wanted, &[], |row| {
            found.push(row);
            Ok(())
        })?;
        Ok(found)
    }

    /// Calls `each` with the rows `wanted` in increasing order. Each row is an object with the columns called
    /// `columns`, or with all columns if none is named. Only the files with these rows are read.
    ///
    /// # Errors
    /// [`DatasetError`] if a row is out of range, or a file is missing or cannot be read; or the error of `each`.
    pub fn rows(
        &self,
        wanted: &BTreeSet<u64>,
        columns: &[&str],
        mut each: impl FnMut(Value) -> Result<(), DatasetError>,
    ) -> Result<(), DatasetError> {
        wanted.last().map_or(Ok(()), |row| self.spec().check_row(*row))?;
        let shards: BTreeSet<u64> = wanted.iter().map(|row| row / self.spec().rows_per_shard()).collect();
        for shard in shards {
            let (path, held) = (self.shard_file(shard), shard_rows(self.spec(), shard));
            check_shard(self.spec(), shard, &path)?;
            let places = wanted.range(held.clone()).map(|row| row - held.start);
            let places = places.filter_map(|place| usize::try_from(place).ok()).collect();
            batches(&path, Wanted::Places(places, columns), |batch| {
                let schema = batch.schema();
                (0..batch.num_rows()).try_for_each(|row| each(object(&schema, batch.columns(), row)))?;
                Ok(true)
            })?;
        }
        Ok(())
    }
}

impl Dataset {
    /// The columns `names` of the rows `wanted`, in increasing order of row. Only the files with these rows are read.
    ///
    /// # Errors
    /// [`DatasetError`] if a column does not exist, a row is out of range, or a file is missing or cannot be read.
    pub fn columns(
        &self,
        names: &[&str],
        wanted: std::ops::Range<u64>,
        mut each_file: impl FnMut() -> Result<(), DatasetError>,
    ) -> Result<Vec<(Column, ColumnValues)>, DatasetError> {
        let spec = self.spec();
        let known = columns(spec);
        let mut found = Vec::with_capacity(names.len());
        for name in names {
            let Some(column) = known.iter().find(|column| column.name == *name) else {
                let valid: Vec<&str> = known.iter().map(|column| column.name.as_str()).collect();
                let problem = format!("has no column {name:?}; valid: {}", valid.join(", "));
                return Err(DatasetError::file(self.folder(), problem));
            };
            found.push((column.clone(), ColumnValues::of(column.kind)));
        }
        if wanted.is_empty() {
            return Ok(found);
        }
        spec.check_row(wanted.end - 1)?;
        let per_shard = spec.rows_per_shard();
        for shard in wanted.start / per_shard..=(wanted.end - 1) / per_shard {
            let (path, held) = (self.shard_file(shard), shard_rows(spec, shard));
            check_shard(spec, shard, &path)?;
            let own = held.start.max(wanted.start)..held.end.min(wanted.end);
            let places = own.filter_map(|row| usize::try_from(row - held.start).ok());
            batches(&path, Wanted::Places(places.collect(), names), |batch| {
                for (column, values) in &mut found {
                    let array = batch.column_by_name(&column.name);
                    values.extend(array.ok_or_else(|| DatasetError::file(&path, format!("lacks {:?}", column.name)))?);
                }
                Ok(true)
            })?;
            each_file()?;
        }
        Ok(found)
    }
}

impl Spec {
    /// Makes the rows `wanted` without writing a file, and calls `each` with them as [`Dataset::rows`] does.
    ///
    /// # Errors
    /// [`DatasetError`] if a row is out of range or cannot be made; or the error of `each`.
    pub fn rows(
        &self,
        wanted: &BTreeSet<u64>,
        columns: &[&str],
        mut each: impl FnMut(Value) -> Result<(), DatasetError>,
    ) -> Result<(), DatasetError> {
        wanted.last().map_or(Ok(()), |row| self.check_row(*row))?;
        let schema = schema(self);
        let kept = |name: &str| columns.is_empty() || columns.contains(&name);
        let places = (0..schema.fields().len()).filter(|k| kept(schema.field(*k).name()));
        let places: Vec<usize> = places.collect();
        let failed = |e: ArrowError| DatasetError::file(&self.config().name, e.to_string());
        let kept_schema = schema.project(&places).map_err(failed)?;
        let mut stores = stores(self);
        let mut maker = Maker::new(self);
        for &row in wanted {
            put(&maker.row(row)?, &mut stores);
            let arrays = stores.iter_mut().map(Store::take).collect::<Result<Vec<_>, _>>();
            let arrays = arrays.map_err(failed)?;
            let kept: Vec<ArrayRef> = places.iter().map(|k| ArrayRef::clone(&arrays[*k])).collect();
            each(object(&kept_schema, &kept, 0))?;
        }
        Ok(())
    }

    /// Refuses a row beyond the last one.
    fn check_row(&self, row: u64) -> Result<(), DatasetError> {
        let SpecConfig { name, rows, .. } = self.config();
        if row < *rows {
            return Ok(());
        }
        let problem = format!("has no row {row}; valid: [0, {}]", rows - 1);
        Err(DatasetError::file(name, problem))
    }
}
