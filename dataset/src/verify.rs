//! Makes rows again and compares them with the files.

use crate::columns::{columns, put, stores};
use crate::error::DatasetError;
use crate::folder::Dataset;
use crate::make::Maker;
use crate::read::{Wanted, batches};
use crate::shard::{check_shard, shard_rows};
use rayon::prelude::*;
use serde::Serialize;
use spts::progress::Progress;
use std::collections::BTreeSet;

/// Which rows of a data set were made again, and which of them differ from the files.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Verified {
    /// Number of rows that were made again.
    pub rows: u64,
    /// Number of files to which they belong.
    pub shards: u64,
    /// Rows that differ, each with the first column that differs.
    pub differ: Vec<(u64, String)>,
}

impl Dataset {
    /// Makes `rows` rows, drawn with `seed`, again, and compares them with the files, bit for bit.
    ///
    /// # Errors
    /// [`DatasetError`] if a file is missing, damaged or of another data set, or a row cannot be made.
    pub fn verify(&self, rows: u64, seed: u64, progress: &dyn Progress) -> Result<Verified, DatasetError> {
        let all = 0..self.spec().config().rows;
        let sample = self.spec().drawn_rows("verify", &[all], rows, seed);
        let per_shard = self.spec().rows_per_shard();
        let shards: BTreeSet<u64> = sample.iter().map(|row| row / per_shard).collect();
        progress.stage("rows compared", Some(sample.len()));
        let compared = shards.par_iter().map(|&shard| {
            let wanted: Vec<u64> = sample.range(shard_rows(self.spec(), shard)).copied().collect();
            self.compare(shard, &wanted, progress)
        });
        let differ: Result<Vec<_>, _> = compared.collect();
        progress.end();
        Ok(Verified {
            rows: sample.len() as u64,
            shards: shards.len() as u64,
            differ: differ?.concat(),
        })
    }

    fn compare(&self, shard: u64, wanted: &[u64], progress: &dyn Progress) -> Result<Vec<(u64, String)>, DatasetError> {
        let path = self.shard_file(shard);
        check_shard(self.spec(), shard, &path)?;
        let columns = columns(self.spec());
        let mut stores = stores(self.spec());
        let mut maker = Maker::new(self.spec());
        let (mut first, mut differ) = (shard_rows(self.spec(), shard).start, Vec::new());
        let mut wanted = wanted.iter().copied().peekable();
        batches(&path, Wanted::All, |batch| {
            let end = first + batch.num_rows() as u64;
            while let Some(index) = wanted.next_if(|index| *index < end) {
                put(&maker.row(index)?, &mut stores);
                let place = usize::try_from(index - first).unwrap_or_default();
                let mut other = None;
                for ((column, store), array) in columns.iter().zip(&mut stores).zip(batch.columns()) {
                    let made = store.take().map_err(|e| DatasetError::file(&path, e.to_string()))?;
                    if *made != *array.slice(place, 1) {
                        other.get_or_insert_with(|| column.name.clone());
                    }
                }
                differ.extend(other.map(|column| (index, column)));
                progress.step();
            }
            first = end;
            Ok(wanted.peek().is_some())
        })?;
        Ok(differ)
    }
}
