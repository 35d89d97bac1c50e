//! Rows of a data set as JSON or as columns, read from its files or made from its specification; and which rows are
//! looked at when not all are.

use crate::columns::{Column, Store, columns, put, schema, stores};
use crate::file::{ColumnValues, Wanted, batches, check_shard, json, refused, shard_rows};
use crate::folder::Dataset;
use crate::make::Maker;
use crate::spec::{Spec, SpecConfig};
use arrow_array::ArrayRef;
use arrow_schema::{ArrowError, Schema};
use rand::RngExt as _;
use serde_json::Value;
use spts::Refusal;
use std::collections::BTreeSet;
use std::ops::Range;

/// Row `row` of a batch with these columns, as a JSON object.
fn object(schema: &Schema, columns: &[ArrayRef], row: usize) -> Value {
    let fields = schema.fields().iter().zip(columns);
    fields.map(|(field, array)| (field.name().clone(), json(array, row))).collect()
}

impl Dataset {
    /// The first `rows` rows; each is an object with one entry a column.
    ///
    /// # Errors
    /// [`Refusal`] if a file is missing or cannot be read.
    pub fn head(&self, rows: u64) -> Result<Vec<Value>, Refusal> {
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
    /// [`Refusal`] if a row is out of range, or a file is missing or cannot be read; or the error of `each`.
    pub fn rows(
        &self,
        wanted: &BTreeSet<u64>,
        columns: &[&str],
        mut each: impl FnMut(Value) -> Result<(), Refusal>,
    ) -> Result<(), Refusal> {
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

    /// The columns `names` of the rows `wanted`, in increasing order of row. Only the files with these rows are read.
    ///
    /// # Errors
    /// [`Refusal`] if a column does not exist, a row is out of range, or a file is missing or cannot be read.
    pub fn columns(
        &self,
        names: &[&str],
        wanted: Range<u64>,
        mut each_file: impl FnMut() -> Result<(), Refusal>,
    ) -> Result<Vec<(Column, ColumnValues)>, Refusal> {
        let spec = self.spec();
        let known = columns(spec);
        let mut found = Vec::with_capacity(names.len());
        for name in names {
            let Some(column) = known.iter().find(|column| column.name == *name) else {
                let valid: Vec<&str> = known.iter().map(|column| column.name.as_str()).collect();
                let problem = format!("has no column {name:?}; valid: {}", valid.join(", "));
                return Err(refused(self.folder(), problem));
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
                    values.extend(array.ok_or_else(|| refused(&path, format!("lacks {:?}", column.name)))?);
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
    /// [`Refusal`] if a row is out of range or cannot be made; or the error of `each`.
    pub fn rows(
        &self,
        wanted: &BTreeSet<u64>,
        columns: &[&str],
        mut each: impl FnMut(Value) -> Result<(), Refusal>,
    ) -> Result<(), Refusal> {
        wanted.last().map_or(Ok(()), |row| self.check_row(*row))?;
        let schema = schema(self);
        let kept = |name: &str| columns.is_empty() || columns.contains(&name);
        let places = (0..schema.fields().len()).filter(|k| kept(schema.field(*k).name()));
        let places: Vec<usize> = places.collect();
        let unkept = |e: ArrowError| Refusal::from_error(e).at(&self.config().name);
        let kept_schema = schema.project(&places).map_err(unkept)?;
        let mut stores = stores(self);
        let mut maker = Maker::new(self);
        for &row in wanted {
            put(&maker.row(row)?, &mut stores);
            let arrays = stores.iter_mut().map(Store::take).collect::<Result<Vec<_>, _>>();
            let arrays = arrays.map_err(unkept)?;
            let kept: Vec<ArrayRef> = places.iter().map(|k| ArrayRef::clone(&arrays[*k])).collect();
            each(object(&kept_schema, &kept, 0))?;
        }
        Ok(())
    }

    /// Refuses a row beyond the last one.
    fn check_row(&self, row: u64) -> Result<(), Refusal> {
        let SpecConfig { name, rows, .. } = self.config();
        if row < *rows {
            return Ok(());
        }
        let problem = format!("has no row {row}; valid: [0, {}]", rows - 1);
        Err(Refusal::new(problem).at(name))
    }
}

/// `rows` rows spread evenly over the ranges `held`, including the first; all rows if there are fewer.
///
/// ```
/// use spts_dataset::spread_rows;
///
/// // the files of two workers of three are there
/// let rows = spread_rows(&[0..100, 200..300], 4);
/// assert_eq!(rows.into_iter().collect::<Vec<_>>(), [0, 50, 200, 250]);
/// ```
pub fn spread_rows(held: &[Range<u64>], rows: u64) -> BTreeSet<u64> {
    let all = count(held);
    let rows = rows.min(all);
    // both are below 2^40 where a spec has them; wider numbers let any ranges be given
    let place = |k: u64| u64::try_from(u128::from(k) * u128::from(all) / u128::from(rows)).unwrap_or(u64::MAX);
    (0..rows).filter_map(|k| row_at(held, place(k))).collect()
}

impl Spec {
    /// `rows` different rows of the ranges `held`, drawn with `seed`; all rows if there are fewer. Draws with different
    /// `label`s are independent.
    pub fn drawn_rows(&self, label: &str, held: &[Range<u64>], rows: u64, seed: u64) -> BTreeSet<u64> {
        let all = count(held);
        if rows >= all {
            return held.iter().cloned().flatten().collect();
        }
        let mut rng = self.streams().rng(label, seed);
        let mut drawn = BTreeSet::new();
        while (drawn.len() as u64) < rows {
            drawn.extend(row_at(held, rng.random_range(0..all)));
        }
        drawn
    }
}

impl Dataset {
    /// The rows of all existing files, one range a file. The files' contents are not checked.
    pub fn made_rows(&self) -> Vec<Range<u64>> {
        let made = (0..self.spec().shards()).filter(|shard| self.shard_file(*shard).symlink_metadata().is_ok());
        made.map(|shard| shard_rows(self.spec(), shard)).collect()
    }
}

fn count(held: &[Range<u64>]) -> u64 {
    held.iter().map(|range| range.end.saturating_sub(range.start)).sum()
}

/// Row number `place` of the rows of `held`, one range after the other.
fn row_at(held: &[Range<u64>], mut place: u64) -> Option<u64> {
    for range in held {
        let length = range.end.saturating_sub(range.start);
        if place < length {
            return Some(range.start + place);
        }
        place -= length;
    }
    None
}
