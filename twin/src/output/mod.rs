//! Result files. Every writer is atomic: it fills a temporary file in the same folder and renames it, so that a file
//! with the final name is always whole, and an error leaves what was there before as it was.
//!
//! ```
//! use spts::output::{OutputFolder, write_npy};
//! # let dir = std::env::temp_dir().join(format!("spts-doc-output-{}", std::process::id()));
//! let staged = OutputFolder::create(&dir)?.stage()?;
//! write_npy(&staged.path("ramp.npy"), &[2, 2], &[0.0, 1.0, 2.0, 3.0])?;
//! assert!(!dir.join("ramp.npy").exists());
//! staged.commit()?;
//! assert!(dir.join("ramp.npy").exists());
//! # std::fs::remove_dir_all(&dir)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod atomic;
mod error;
mod folder;
mod formats;
#[cfg(test)]
mod tests;

pub use atomic::{write_bytes, write_with};
pub use error::OutputError;
pub use folder::{OutputFolder, Staged};
pub use formats::{write_csv, write_json, write_npy, write_npy_codes, write_npy_with, write_table};
