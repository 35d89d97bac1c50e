//! Quality of the sensing matrix of a set of seeds, search for better seeds, and their benefit.
//!
//! A set (`set`) defines the rows that cells with these seeds put out. `analysis` analyses windows of them
//! independently of the decoder, `search` looks for better seeds, and `worth` sends the same images (`images`) through
//! every set and compares the decoded ones.

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
