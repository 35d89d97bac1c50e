//! The contents of `session.json`. docs/session.md describes them for users.

use super::{Event, PressPose, SESSION_FILE};
use crate::provenance::Provenance;
use serde::{Deserialize, Serialize};
use spts_circuit::RecordingInfo;

/// The whole file.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Contents {
    pub(super) format: String,
    pub(super) schema: u64,
    pub(super) name: String,
    pub(super) object: String,
    pub(super) event: Event,
    pub(super) hold_s: Option<[f64; 2]>,
    pub(super) raster: Option<RecordedContents>,
    pub(super) compressive: Option<RecordedContents>,
    pub(super) provenance: Option<Provenance>,
}

/// What is read before everything else, so that a later schema is named and not taken for a damaged file.
#[derive(Debug, Deserialize)]
pub(super) struct Version {
    pub(super) format: String,
    pub(super) schema: u64,
}

/// One recording.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RecordedContents {
    pub(super) info: RecordingInfo,
    pub(super) frames: usize,
    #[serde(default)]
    pub(super) conditioning: usize,
    pub(super) blocks: Vec<BlockContents>,
    pub(super) samples: Samples,
    /// File of the true pressures, blocks × rows × cols, Pa.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) pressure_pa: Option<String>,
    /// File of the true conductances, blocks × rows × cols, S.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) conductance_s: Option<String>,
}

impl Contents {
    /// Names of the files that make the session.
    pub(super) fn files(&self) -> Vec<&str> {
        let recorded = [&self.raster, &self.compressive].into_iter().flatten();
        let arrays = recorded.flat_map(|recorded| {
            let maps = [&recorded.pressure_pa, &recorded.conductance_s].into_iter().flatten();
            maps.chain([&recorded.samples.file]).map(String::as_str)
        });
        arrays.chain([SESSION_FILE]).collect()
    }
}

/// The array of samples, blocks × frames × measurements.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Samples {
    pub(super) file: String,
    pub(super) kind: SampleKind,
    /// Number of missing samples.
    pub(super) missing: usize,
}

/// What the array holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum SampleKind {
    /// Codes of the converter; the largest value of their type marks a missing sample.
    Codes,
    /// Volts; NaN marks a missing sample.
    Volts,
}

/// One block.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BlockContents {
    pub(super) frame_position: u64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) idle_frames: Option<usize>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) time_s: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) pose: Option<PressPose>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) force_n: Option<f64>,
}
