//! The parsers of everything that comes in, for the fuzz targets and the seeded mutations. The cross-crate tests live
//! in `main.rs`.

pub mod parsers;
