//! The folder of a design, read again.

use spts_circuit::{MAX_PATTERNS_BYTES, Profile};
use spts_studies::design::{Design, DesignCheck, RowSource};
use std::path::{Path, PathBuf};

/// Largest file of a design, bytes.
const MAX_BYTES: u64 = 1 << 24;

/// Why a folder holds no design.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DesignFolderError {
    /// A file cannot be read.
    #[error("{path}: {source}; a design is made by `spts design`", path = path.display())]
    Unreadable {
        /// File.
        path: PathBuf,
        /// Cause.
        source: spts_input::InputError,
    },
    /// A file does not hold what it should.
    #[error("{path}: {reason}", path = path.display())]
    Content {
        /// File.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
}

/// Reads the folder `path` that `spts design` has written: the design, its readout profile and, if its rows are
/// designed, their pattern. `seed` is the root of the random numbers of the check that is to be run on it.
///
/// # Errors
/// [`DesignFolderError`] with the name of the file that is missing or wrong.
pub fn read_design(path: &Path, seed: u64) -> Result<DesignCheck, DesignFolderError> {
    let read = |name: &str, most: u64| {
        let path = path.join(name);
        spts_input::read_text(&path, most).map_err(|source| DesignFolderError::Unreadable { path, source })
    };
    let content = |name: &str, reason: String| DesignFolderError::Content {
        path: path.join(name),
        reason,
    };
    let text = read("design.json", MAX_BYTES)?;
    let design = design_of(&text).map_err(|e| content("design.json", e.to_string()))?;
    let text = read("profile.toml", MAX_BYTES)?;
    let profile = Profile::from_toml(&text).map_err(|e| content("profile.toml", e.to_string()))?;
    let pattern = match design.row_source {
        RowSource::Generator => None,
        RowSource::Designer(_) => Some(read("rows.txt", MAX_PATTERNS_BYTES)?),
    };
    Ok(DesignCheck {
        design,
        profile,
        pattern,
        seed,
    })
}

/// The fields of the design itself among all that the file says.
fn design_of(text: &str) -> Result<Design, serde_json::Error> {
    const FIELDS: [&str; 15] = [
        "rows",
        "cols",
        "taxels",
        "pitch_m",
        "electrode_m",
        "objects",
        "wires",
        "sub_arrays",
        "wire",
        "row_source",
        "m_per_wire",
        "m",
        "decoder",
        "expected",
        "seed",
    ];
    let mut all: serde_json::Map<String, serde_json::Value> = serde_json::from_str(text)?;
    all.retain(|field, _| FIELDS.contains(&field.as_str()));
    serde_json::from_value(all.into())
}
