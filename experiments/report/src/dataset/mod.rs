//! Pictures of data sets: rows of one, and the procedural shapes that one can be made of.

mod preview;
mod relief;
mod row;
mod shapes;
#[cfg(test)]
mod tests;

pub use preview::{MOST_PREVIEW_ROWS, Preview, save_preview};
pub use row::{PREVIEW_COLUMNS, PreviewRow, PreviewRowError};
pub use shapes::{drawn_shapes, save_shapes};
