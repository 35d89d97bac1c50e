//! Result files. Every writer is atomic: it fills a temporary file in the same folder and then renames it. A file with
//! the final name is therefore always complete, and an error leaves an earlier file unchanged. An [`OutputFolder`] does
//! the same for all results of a run.
//!
//! ```
//! use spts::output::{OutputFolder, write_npy};
//! # let dir = std::env::temp_dir().join(format!("spts-doc-output-{}", std::process::id()));
//! let out = OutputFolder::open(&dir, &["ramp.npy"])?;
//! write_npy(&out.path("ramp.npy"), &[2, 2], &[0.0, 1.0, 2.0, 3.0])?;
//! assert!(!dir.join("ramp.npy").exists());
//! out.commit()?;
//! assert!(dir.join("ramp.npy").exists());
//! # std::fs::remove_dir_all(&dir)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod atomic;
mod commit;
mod disk;
mod error;
mod folder;
mod formats;
mod lock;
mod manifest;
mod placing;
#[cfg(test)]
mod tests;

pub use atomic::{AtomicFile, check_writable, is_temporary, remove_left, write_bytes, write_with};
pub use disk::{DiskOperation, DiskWatcher, NewFile, watching_disk};
pub use error::OutputError;
pub use folder::{OutputFolder, check_whole};
pub use formats::{CsvFile, NpyFile, NpyValue, write_csv, write_json, write_npy, write_table};
pub use manifest::{MANIFEST_FILE, Manifest};
