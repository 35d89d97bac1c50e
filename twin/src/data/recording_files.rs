//! Which files belong to one recording, by the published names.

use super::error::DataError;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Files of one recording. A recording that was repeated has files of its own for every repetition.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct RecordingFiles {
    /// What follows the name: nothing for the first recording, `_re`, `_retake`, `_film` for its repetitions.
    pub(super) suffix: String,
    /// Raster scans.
    pub(super) raster: Option<PathBuf>,
    /// Sums.
    pub(super) compressive: Option<PathBuf>,
    /// Positions of the blocks of the sums.
    pub(super) positions: Option<PathBuf>,
}

impl RecordingFiles {
    /// Name and object of a recording of the bouncing ball, whose files are called `random2_tennis_re` and the like.
    pub(super) fn ball(&self) -> (String, String) {
        let words: Vec<&str> = self.suffix.split('_').filter(|word| !word.is_empty()).collect();
        let (ball, rest) = match words.split_first() {
            Some((&ball, rest)) if ball == "tennis" || ball == "ball" => (ball, rest),
            _ => ("ball", words.as_slice()),
        };
        let name = [&[ball, "bounces"], rest].concat().join("_");
        (name, ball.to_owned())
    }
}

/// Recordings in `folder` whose files are called `{prefix}raster…`, `{prefix}random2…` and `{prefix}random2…_time`,
/// repetitions after the first one.
///
/// # Errors
/// [`DataError::Io`] when the folder cannot be read.
pub(super) fn recording_files(folder: &Path, prefix: &str) -> Result<Vec<RecordingFiles>, DataError> {
    let io = |source| DataError::Io {
        path: folder.to_owned(),
        source,
    };
    let mut found: BTreeMap<String, RecordingFiles> = BTreeMap::new();
    for entry in std::fs::read_dir(folder).map_err(io)? {
        let path = entry.map_err(io)?.path();
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let Some(name) = stem
            .strip_prefix(prefix)
            .filter(|_| path.extension().is_some_and(|e| e == "mat"))
        else {
            continue;
        };
        let (suffix, kind) = if let Some(suffix) = name.strip_prefix("raster") {
            (suffix, Kind::Raster)
        } else if let Some(suffix) = name.strip_prefix("random2") {
            match suffix.strip_suffix("_time") {
                Some(suffix) => (suffix, Kind::Positions),
                None => (suffix, Kind::Compressive),
            }
        } else {
            continue;
        };
        // `random2_` is the first recording of a ball without a name, whose scans are called `raster_ball`
        let suffix = if suffix == "_" { "_ball" } else { suffix };
        let suffix = if suffix.is_empty() || suffix.starts_with('_') {
            suffix
        } else {
            continue;
        };
        let files = found.entry(suffix.to_owned()).or_default();
        suffix.clone_into(&mut files.suffix);
        match kind {
            Kind::Raster => files.raster = Some(path),
            Kind::Compressive => files.compressive = Some(path),
            Kind::Positions => files.positions = Some(path),
        }
    }
    let found = found.into_values();
    Ok(found
        .filter(|files| files.raster.is_some() || files.compressive.is_some())
        .collect())
}

enum Kind {
    Raster,
    Compressive,
    Positions,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The names in the published repository.
    #[test]
    fn repetitions_of_the_ball_have_names_of_their_own() {
        let dir = tempfile::tempdir().unwrap();
        for name in [
            "random2_",
            "random2_re",
            "random2_tennis",
            "random2_tennis_re",
            "raster_ball",
            "raster_tennis",
        ] {
            std::fs::write(dir.path().join(format!("{name}.mat")), "").unwrap();
        }
        std::fs::write(dir.path().join("random2_tennis.fig"), "").unwrap();
        let found = recording_files(dir.path(), "").unwrap();
        let names: Vec<(String, String, bool)> = found
            .iter()
            .map(|files| {
                let (name, object) = files.ball();
                (name, object, files.raster.is_some())
            })
            .collect();
        let expected = [
            ("ball_bounces", "ball", true),
            ("ball_bounces_re", "ball", false),
            ("tennis_bounces", "tennis", true),
            ("tennis_bounces_re", "tennis", false),
        ];
        assert_eq!(
            names,
            expected.map(|(name, object, raster)| (name.to_owned(), object.to_owned(), raster))
        );
    }

    #[test]
    fn repetitions_of_a_press_have_files_of_their_own() {
        let dir = tempfile::tempdir().unwrap();
        for name in [
            "T_raster",
            "T_random2",
            "T_random2_time",
            "T_random2_re",
            "T_random2_re_time",
            "T_random1",
            "U_raster",
        ] {
            std::fs::write(dir.path().join(format!("{name}.mat")), "").unwrap();
        }
        let found = recording_files(dir.path(), "T_").unwrap();
        let suffixes: Vec<&str> = found.iter().map(|files| files.suffix.as_str()).collect();
        assert_eq!(suffixes, ["", "_re"]);
        assert!(found[0].raster.is_some() && found[1].raster.is_none());
        assert!(
            found
                .iter()
                .all(|files| files.positions.is_some() && files.compressive.is_some())
        );
    }
}
