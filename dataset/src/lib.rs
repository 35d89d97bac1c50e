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

mod columns;
mod compare;
mod file;
mod finish;
mod folder;
mod make;
mod numbers;
mod rows;
mod spec;
#[cfg(test)]
mod tests;

pub use columns::{Column, Kind, columns};
pub use compare::{Comparison, Errors, Verified};
pub use file::{ColumnValues, shard_rows};
pub use finish::{ColumnStatistics, Finished, Statistics};
pub use folder::{Dataset, Info, Made, Part};
pub use make::{Maker, Row};
pub use numbers::{NumberColumns, numbers_of};
pub use rows::spread_rows;
pub use spec::{
    Draw, DropConfig, FaultsConfig, Label, NAMED_SPECS, ObjectConfig, ObjectSource, PoseConfig, PoseOrigin,
    PressConfig, RecordConfig, RecordKind, SkinConfig, Spec, SpecConfig, SplitBy, SplitConfig,
};
