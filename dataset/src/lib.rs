//! Synthetic data sets: labelled touches as rows of Parquet files. The bytes are the same for any number of threads,
//! shards and machines of one type.
//!
//! A [`Spec`] specifies a data set. A [`Maker`] makes its rows; each is a function of the specification and the row's
//! number. A [`Dataset`] is the folder with its files.
//!
//! ```
//! use spts_dataset::{Dataset, Part, Spec};
//!
//! let text = "rows = 40\nrows_per_shard = 20\n[object]\nfrom = \"objects\"\nrows_per_shape = 4\n\
//!             [pose]\nabout = \"placement\"";
//! let spec = Spec::from_toml(text, &toml::Table::new(), ".".as_ref())?;
//! let folder = std::env::temp_dir().join(format!("spts-doc-dataset-{}", std::process::id()));
//! let made = Dataset::begin(&folder, spec)?.make(Part::WHOLE, &())?;
//! assert_eq!((made.rows, made.shards), (40, 2));
//! # std::fs::remove_dir_all(&folder)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod card;
mod choose;
mod columns;
mod compare;
mod error;
mod export;
mod finish;
mod folder;
mod make;
mod part;
mod read;
mod rows;
mod shard;
mod spec;
mod statistics;
mod store;
#[cfg(test)]
mod tests;
mod verify;

pub use choose::spread_rows;
pub use columns::{Column, columns};
pub use compare::{Comparison, Errors};
pub use error::DatasetError;
pub use export::{EXPORTS, ExportOptions, Exported, PrepareExport, WriteExport, Written};
pub use finish::Finished;
pub use folder::{Dataset, Info, Made};
pub use make::{Maker, Row, RowCause, RowError};
pub use part::Part;
pub use read::ColumnValues;
pub use shard::{check_shard, schema, shard_name, shard_rows, write_shard};
pub use spec::{
    Draw, DropConfig, FaultsConfig, Label, NAMED_SPECS, ObjectConfig, ObjectSource, PoseConfig, PoseOrigin,
    PressConfig, RecordConfig, RecordKind, SkinConfig, Spec, SpecConfig, SpecError, SplitBy, SplitConfig,
};
pub use statistics::{ColumnStatistics, Statistics};
pub use store::Kind;
pub use verify::Verified;
