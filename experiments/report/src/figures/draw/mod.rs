//! A figure as a list of shapes, and its two forms: SVG text and PNG pixels.

mod canvas;
mod files;
mod fill;
mod paint;
mod png;
mod svg;
mod text;

pub use canvas::{Anchor, Canvas, LINE_HEIGHT, Point, Shape, TextStyle};
pub use files::{save, save_png};
pub use paint::{PIXELS_PER_UNIT, paint, resample};
pub use png::encode_png;
pub use svg::svg;
pub use text::{escape, text_width, wrap};
