//! The whole study: compares the given set, mixed addresses, searched seeds and random bytes.

use super::analysis::{self, SeedFacts, WindowRow};
use super::error::SeedError;
use super::images;
use super::search::{SeedSearch, search};
use super::set::SeedSet;
use super::worth::{SeedComparison, WorthRow};
use serde::Serialize;
use spts::progress::Progress;
use spts_circuit::{Seeding, WeightMode};
use spts_models::Streams;
use std::path::PathBuf;

/// A set of seeds, and the settings of its analysis.
#[derive(Debug, Clone)]
pub struct SeedStudy {
    /// The set to analyse.
    pub given: SeedSet,
    /// Weights of the cells: binary or analog.
    pub mode: WeightMode,
    /// Numbers of rows M of a window, each at least 1.
    pub rows: Vec<usize>,
    /// Number of windows that are analysed; at least 1.
    pub windows: usize,
    /// Number of sets that the search tries.
    pub budget: usize,
    /// Number of synthetic images.
    pub images: usize,
    /// Noise of a measurement relative to ‖x‖₂.
    pub noise: f64,
    /// Recordings of a skin with the same number of taxels.
    pub recordings: Option<PathBuf>,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// Results of `spts seeds`: how good several sets of seeds are, and what they are worth in IoU.
#[derive(Debug, Clone, Serialize)]
pub struct SeedReport {
    /// Name of the given set.
    pub given: String,
    /// Weights of the cells.
    pub mode: WeightMode,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Recommended set: the mixed addresses, or the searched seeds if they are better on windows not used in the
    /// search, by more than chance.
    pub proposed: String,
    /// Every set, the given one first.
    pub sets: Vec<SeedSet>,
    /// Properties that do not depend on a window, one entry for each set.
    pub facts: Vec<SeedFacts>,
    /// Windows, ordered by set.
    pub windows: Vec<WindowRow>,
    /// Result of the search.
    pub search: SeedSearch,
    /// IoU.
    pub worth: Vec<WorthRow>,
}

impl SeedStudy {
    /// Analyses and compares. The result does not depend on the number of threads.
    ///
    /// # Errors
    /// [`SeedError`] if the recordings are not usable, or are of a skin of another size.
    pub fn run(&self, progress: &dyn Progress) -> Result<SeedReport, SeedError> {
        let streams = Streams::new(self.seed);
        let side = self.given.side();
        let recorded = self.recorded(side, progress)?;
        progress.stage("searching seeds", None);
        let longest = self.rows.iter().copied().max().unwrap_or(1);
        let (found, search) = search(side, self.mode, longest, self.budget, streams.child("search", 0))?;
        progress.end();
        let mut sets = vec![self.given.clone(), SeedSet::of(Seeding::Mixed, side), found];
        sets.extend(SeedSet::bytes(side, streams));
        // a set that was given by another name is not shown twice
        if let Some(own) = (1..sets.len()).find(|&k| sets[k].seeds == sets[0].seeds) {
            sets[0] = sets.remove(own);
        } else if sets[1..].iter().any(|own| own.name == sets[0].name) {
            sets[0].name.push_str("_given");
        }
        let (facts, windows) = self.judge(&sets, streams, progress)?;
        let both = [0.0, self.noise];
        let comparison = SeedComparison {
            sets: &sets,
            mode: self.mode,
            measurements: &self.rows,
            noises: if self.noise > 0.0 { &both } else { &both[..1] },
            streams: streams.child("worth", 0),
        };
        progress.stage("learning a dictionary", None);
        let mut sources = vec![images::synthetic(side, self.images, streams.child("synthetic", 0))?];
        progress.end();
        sources.extend(recorded);
        progress.stage("decoding", Some(sources.iter().map(|s| s.images.len()).sum()));
        let mut worth = Vec::new();
        for source in &sources {
            worth.extend(comparison.run(source, progress)?);
        }
        progress.end();
        let proposed = if search.gained() { "searched" } else { "mixed" };
        Ok(SeedReport {
            given: sets[0].name.clone(),
            mode: self.mode,
            seed: self.seed,
            proposed: proposed.to_owned(),
            sets,
            facts,
            windows,
            search,
            worth,
        })
    }

    /// Facts of every set, and windows of every M and of as many rows as there are taxels.
    fn judge(
        &self,
        sets: &[SeedSet],
        streams: Streams,
        progress: &dyn Progress,
    ) -> Result<(Vec<SeedFacts>, Vec<WindowRow>), SeedError> {
        let mut lengths = self.rows.clone();
        lengths.push(self.given.seeds.len());
        lengths.sort_unstable();
        lengths.dedup();
        let starts = analysis::starts(streams, "windows", self.windows);
        progress.stage("judging windows", Some(sets.len() * (lengths.len() + 1)));
        let (mut facts, mut windows) = (Vec::new(), Vec::new());
        for set in sets {
            facts.push(analysis::facts(set, self.mode)?);
            progress.step();
            for &m in &lengths {
                windows.push(analysis::windows(set, self.mode, m, &starts, streams)?);
                progress.step();
            }
        }
        progress.end();
        Ok((facts, windows))
    }

    /// Images of the recordings, if there are any.
    fn recorded(&self, side: usize, progress: &dyn Progress) -> Result<Option<images::Images>, SeedError> {
        let Some(dir) = &self.recordings else {
            return Ok(None);
        };
        progress.stage("reading recordings", None);
        let found = images::recorded(dir)?;
        progress.end();
        let taxels = found.dictionary.nrows();
        if taxels == side * side {
            return Ok(Some(found));
        }
        Err(SeedError::OtherSize {
            path: dir.clone(),
            taxels,
            seeds: side * side,
        })
    }
}
