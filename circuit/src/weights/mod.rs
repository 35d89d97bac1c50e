//! The weights of the skin: the cells' generator, the levels that they put out, and sums of levels times values.

mod kernels;
mod lcg;
mod rows;
mod sequence;
mod text;

pub(crate) use kernels::{LANES, Lines, Sums};
pub(crate) use lcg::{ANALOG_SCALE, finalise};
pub use lcg::{FIRST_ADDRESS, INCREMENT, Jump, MULTIPLIER, Seeding};
pub(crate) use rows::Rows;
pub use rows::{CellCodes, check_codes};
pub(crate) use sequence::{FULL_SCALE, NEUTRAL, code_of, not_in_mode};
pub use sequence::{LevelSource, Mode, Patterns, WeightMode, WeightRows, Weights, seeds_of_first_window};
pub use text::{MAX_PATTERNS_BYTES, MAX_SEEDS_BYTES, parse_patterns, parse_seeds};
