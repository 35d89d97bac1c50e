//! A figure as a list of shapes, and its two forms: SVG text and PNG pixels.

mod canvas;
mod files;
mod fill;
mod paint;
mod svg;
mod text;

pub use canvas::{Anchor, Canvas, Item, LINE_HEIGHT, Point, TextStyle};
pub use files::{encode_png, save, save_png};
pub use paint::{PIXELS_PER_UNIT, paint, resample};
pub use svg::svg;
pub use text::{escape, text_width, wrap};
