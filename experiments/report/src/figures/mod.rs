//! Figures: line charts and sheets of tactile images, each written as SVG (to look at) and PNG (to share).
//!
//! A figure is laid out once, in CSS pixels, as a list of shapes ([`draw`]); the list is then written as vectors
//! and painted as pixels, so that the two files never disagree. The PNG has [`draw::PIXELS_PER_UNIT`] pixels to
//! the CSS pixel. Files are written to a temporary name and renamed: a reader never sees half a figure.

pub mod axis;
mod bars;
pub mod chart;
mod claims;
mod coincide;
pub mod colour;
pub mod draw;
mod error;
mod frame;
mod heat_map;
mod intervals;
mod legend;
mod looks;
mod marker;
mod panel;
mod plot;
mod pressure;
mod shade;
mod sheet;
pub mod tiles;

pub use bars::{Bar, BarChart, BarGroup, BarRow, save_bars};
pub use chart::{Chart, Claim, Series, StatedRange, Style};
pub use draw::encode_png;
pub use error::FigureError;
pub(crate) use heat_map::draw_heat;
pub use intervals::{Interval, IntervalChart, IntervalLine, IntervalPanel, save_intervals};
pub use looks::{Stroke, decoder_variant};
pub use panel::save_charts;
pub use plot::{Curve, Plot};
pub use pressure::pressure_png;
pub use sheet::save_sheet;
pub use tiles::{Sheet, Tile, TileRow};

#[cfg(test)]
mod samples;
#[cfg(test)]
pub(crate) mod tests;
