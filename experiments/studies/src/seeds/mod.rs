//! How good the sensing matrix of a set of seeds is, better seeds, and what they are worth.
//!
//! A set (`set`) gives the rows that cells with these seeds put out. `analysis` judges windows of them whatever decodes
//! them, `search` looks for better seeds, and `worth` sends the same images (`images`) through every set and compares
//! what decoders make of it.

mod analysis;
mod error;
mod images;
mod search;
mod set;
mod study;
mod text;
mod worth;

pub use analysis::{SeedFacts, WindowRow};
pub use error::SeedError;
pub use search::SeedSearch;
pub use set::SeedSet;
pub use study::{SeedReport, SeedStudy};
pub use worth::WorthRow;
