//! Pictures of data sets: rows of one, and the procedural shapes that one can be made of.

mod preview;
mod shapes;
#[cfg(test)]
mod tests;

pub use preview::{MOST_PREVIEW_ROWS, PREVIEW_COLUMNS, Preview, PreviewRow, save_preview};
pub use shapes::{drawn_shapes, save_shapes};
