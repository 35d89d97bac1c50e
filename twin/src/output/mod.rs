//! Result files and folders. A file is written beside its name and then renamed, so that a file with its final name is
//! complete, and an error leaves an earlier file unchanged. An [`OutputFolder`] does the same for all results of a run.
//!
//! ```
//! use spts::output::{OutputFolder, write_npy};
//! # let dir = std::env::temp_dir().join(format!("spts-doc-output-{}", std::process::id()));
//! let out = OutputFolder::open(&dir)?;
//! write_npy(&out.path("ramp.npy"), &[2, 2], &[0.0, 1.0, 2.0, 3.0])?;
//! assert!(!dir.exists());
//! out.commit()?;
//! assert!(dir.join("ramp.npy").exists());
//! # std::fs::remove_dir_all(&dir)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod disk;
mod files;
mod folder;
mod manifest;

pub use disk::{DiskOperation, no_folder, not_ours, unwritable, watching_disk};
pub use files::{
    AtomicFile, CsvFile, NpyFile, NpyValue, check_replaceable, check_writable, is_temporary, json_text, remove_left,
    write_bytes, write_json, write_new, write_npy, write_table,
};
pub use folder::OutputFolder;
pub use manifest::{MANIFEST_FILE, Manifest, check_whole};
