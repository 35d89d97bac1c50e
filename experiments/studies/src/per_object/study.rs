//! Records and scores every simulated skin like the real one.

use super::band::{ObjectBand, ObjectScore, SCORES, ScoreDistance, ScoreOf, bands, distances};
use super::images::ReadoutImages;
use super::skin::{presses, twin, with_images, with_skin_gains};
use super::text;
use crate::calibrate::{SessionEstimates, read};
use rayon::prelude::*;
use serde::Serialize;
use spts::data::DataError;
use spts::progress::Progress;
use spts::record::TwinError;
use spts_contact::objects::OBJECTS;
use spts_eval::board::{BoardSettings, ObjectRow, find};
use spts_eval::training::{SkinGainsError, TrainingPresses, TrainingSource, templates};
use spts_eval::{ScoreError, Sensing, Source};
use spts_input::Refusal;
use spts_recon::classify::LibraryError;
use std::path::Path;

/// Numbers of measurements.
pub const MEASUREMENTS: [usize; 3] = [7, 20, 50];
/// Decoders: the published pursuit with matched weights, and the two best decoders.
pub const DECODERS: [&str; 3] = ["matched", "nn_lmmse", "evidence"];

/// Why twin and skin cannot be compared.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PerObjectError {
    /// The recordings cannot be used.
    #[error(transparent)]
    Data(#[from] DataError),
    /// The recordings contain no compressive session of an object that the twin knows.
    #[error("the recordings hold no compressive session of an object that the twin has; it has {known}")]
    NoObject {
        /// Objects that the twin knows.
        known: String,
    },
    /// The simulation failed.
    #[error(transparent)]
    Twin(#[from] TwinError),
    /// The sessions cannot be scored.
    #[error(transparent)]
    Score(#[from] ScoreError),
    /// The readout refuses its profile, or could not record.
    #[error("readout: {0}")]
    Readout(#[from] Refusal),
    /// An image is not a valid conductance.
    #[error("conductance: {0}")]
    Source(#[source] Refusal),
    /// The gains of the skin are not known.
    #[error("gains of the skin: {0}")]
    Gains(#[from] SkinGainsError),
    /// There are no raster images.
    #[error("raster images: {0}")]
    ReadoutImages(#[from] LibraryError),
}

/// Settings of `spts compare --skins`: every recorded object is pressed on many simulated skins, and scored like the
/// real one.
#[derive(Debug, Clone, Copy)]
pub struct PerObjectStudy<'a> {
    /// Folder of the recordings.
    pub recordings: &'a Path,
    /// Number of simulated skins.
    pub skins: u64,
    /// Seed of the first skin; the others have the following seeds.
    pub seed: u64,
    /// Whether the twin also reads out the skin's own images ([`ReadoutImages`]).
    pub causes: bool,
}

/// Results of `spts compare --skins`: each object's score on the real skin beside the band of the simulated skins.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PerObjectReport {
    /// Number of simulated skins.
    pub skins: u64,
    /// Distances, one for each score.
    pub distances: Vec<ScoreDistance>,
    /// Bands, one for each object and score.
    pub objects: Vec<ObjectBand>,
}

impl PerObjectStudy<'_> {
    /// Simulates, records and scores. The result depends only on the recordings and the seed.
    ///
    /// # Errors
    /// [`PerObjectError`].
    pub fn run(&self, progress: &dyn Progress) -> Result<PerObjectReport, PerObjectError> {
        progress.stage("scoring the real skin", None);
        let real = Source::open(self.recordings)?;
        let with_sums = real.sessions.iter().filter(|s| s.scorable());
        let known = |name: &str| OBJECTS.iter().any(|object| object.name == name);
        let objects: Vec<String> = with_sums.map(|s| s.object.clone()).filter(|name| known(name)).collect();
        if objects.is_empty() {
            let known: Vec<&str> = OBJECTS.iter().map(|o| o.name).collect();
            return Err(PerObjectError::NoObject {
                known: known.join(", "),
            });
        }
        let of_real = scores(&real, &objects, self.seed)?;
        progress.end();
        let of = |images: ReadoutImages, skin: &(dyn Fn(u64) -> Result<Source, PerObjectError> + Sync)| {
            let seeds = self.seed..self.seed.saturating_add(self.skins);
            let skins = seeds.into_par_iter().map(|seed| scores(&skin(seed)?, &objects, seed));
            let skins = skins.collect::<Result<Vec<_>, PerObjectError>>()?;
            Ok::<_, PerObjectError>(bands(images, &of_real, &skins))
        };
        let skins = usize::try_from(self.skins).unwrap_or(usize::MAX);
        let done = || progress.step();
        progress.stage("pressing simulated skins", Some(skins * presses(objects.len())));
        let mut all = of(ReadoutImages::Twin, &|seed| {
            Ok(Source::new(twin(seed, &objects, true, &done)?)?)
        })?;
        progress.end();
        if self.causes {
            progress.stage("with the skin's gains", Some(skins * presses(objects.len())));
            all.extend(of(ReadoutImages::TwinWithSkinGains, &|seed| {
                with_skin_gains(&twin(seed, &objects, false, &done)?, &real, seed)
            })?);
            progress.end();
            for (images, volts) in [
                (ReadoutImages::SkinRaster, raster_images(&real, &objects)?),
                (
                    ReadoutImages::SkinCompressive,
                    compressive_images(self.recordings, &objects)?,
                ),
            ] {
                progress.stage(images.label(), Some(skins * real.sessions.len()));
                all.extend(of(images, &|seed| with_images(&real, &volts, seed, &done))?);
                progress.end();
            }
        }
        Ok(PerObjectReport {
            skins: self.skins,
            distances: distances(&all),
            objects: all,
        })
    }
}

impl PerObjectReport {
    /// The distance of the twin in the score `score` of `decoder` at `m`.
    #[must_use]
    pub fn distance(&self, decoder: &str, m: usize, score: &str) -> Option<&ScoreDistance> {
        let same = |d: &&ScoreDistance| d.decoder == decoder && d.m == m && d.score == score;
        self.distances
            .iter()
            .filter(|d| d.images == ReadoutImages::Twin)
            .find(same)
    }

    /// The results as text tables.
    #[must_use]
    pub fn text(&self) -> String {
        text::tables(self)
    }
}

/// Scores of `objects` in `source`. The published pursuit learns its dictionary from raster presses that are not scored
/// unless one is published; the others learn from such presses.
fn scores(source: &Source, objects: &[String], seed: u64) -> Result<Vec<ObjectScore>, PerObjectError> {
    let settings = BoardSettings {
        network: None,
        decoders: DECODERS.iter().filter_map(|name| find(name)).collect(),
        external: Vec::new(),
        measurements: MEASUREMENTS.to_vec(),
        objects: objects.to_vec(),
        localisation: Vec::new(),
        left_out: false,
        training: vec![TrainingSource::Published],
        sensing: vec![Sensing::Random],
        times: false,
        seed,
    };
    let board = settings.learn(source)?.score(&|| ())?;
    let of_row = |row: &ObjectRow| {
        let value = |(score, get): &ScoreOf| {
            Some(ObjectScore {
                decoder: row.decoder.clone(),
                m: row.m,
                score,
                object: row.object.clone(),
                value: get(&row.scores)?,
            })
        };
        SCORES.iter().filter_map(value).collect::<Vec<_>>()
    };
    Ok(board.objects.iter().flat_map(of_row).collect())
}

/// Mean raster images of `objects`, V, from presses that are not scored.
fn raster_images(real: &Source, objects: &[String]) -> Result<Vec<(String, Vec<f64>)>, PerObjectError> {
    let sessions = real.sessions.iter().filter(|s| objects.contains(&s.object));
    let image = |session| -> Result<Option<(String, Vec<f64>)>, PerObjectError> {
        let session: &spts_eval::ScoredSession = session;
        let Some(training) = TrainingPresses::unscored(session).filter(|t| !t.is_empty()) else {
            return Ok(None);
        };
        Ok(Some((
            session.object.clone(),
            templates(&[training])?.images().column(0),
        )))
    };
    sessions.filter_map(|s| image(s).transpose()).collect()
}

/// Images of `objects` in their compressive sessions, V: by least squares, median over the presses.
fn compressive_images(recordings: &Path, objects: &[String]) -> Result<Vec<(String, Vec<f64>)>, PerObjectError> {
    let pairs = read(recordings)?;
    let pairs = pairs.iter().filter(|pair| objects.contains(&pair.session));
    let image = |pair: &crate::calibrate::SessionPair| {
        let blocks: Vec<usize> = (0..pair.compressive.blocks().len()).collect();
        let found = SessionEstimates::of(pair, &pair.compressive, &blocks)?;
        let mut image = found.image_v;
        for cell in &found.overdriven {
            image[cell.taxel as usize] *= cell.over_binary;
        }
        Some((pair.session.clone(), image))
    };
    Ok(pairs.filter_map(image).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The number of threads does not show, and neighbouring seeds are other skins.
    #[test]
    fn a_simulated_skin_is_a_function_of_its_seed() {
        let objects = vec!["rec".to_owned()];
        let of = |seed: u64, threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let run = || {
                let source = Source::new(twin(seed, &objects, true, &|| ()).unwrap()).unwrap();
                scores(&source, &objects, seed).unwrap()
            };
            pool.install(run)
        };
        let (one, two, other) = (of(1, 1), of(1, 2), of(2, 2));
        assert_eq!(one, two);
        assert_ne!(one, other);
        // every decoder, M and score of the one object; `nn_lmmse` says no classes
        let with_classes = DECODERS.len() - 1;
        assert!(
            one.len() >= (DECODERS.len() + with_classes) * MEASUREMENTS.len(),
            "{}",
            one.len()
        );
    }
}
