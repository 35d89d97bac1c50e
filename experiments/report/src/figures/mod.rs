//! Figures: charts, bars and sheets of tactile images, each written as SVG (to look at) and PNG (to share).
//!
//! A figure is drawn once, on a [`canvas::Canvas`], in CSS pixels. That is the SVG file, and the PNG file is painted
//! from its text, with `PIXELS_PER_UNIT` pixels to the CSS pixel: the two never disagree. Results become
//! charts through [`Plot`]. Files are written to a temporary name and renamed: a reader never sees half a figure.

pub mod axis;
mod bars;
pub mod canvas;
mod chart;
pub mod colour;
mod legend;
mod looks;
mod panel;
mod sheet;

pub use bars::{
    Bar, BarChart, BarGroup, BarRow, Interval, IntervalChart, IntervalLine, IntervalPanel, save_bars, save_intervals,
};
pub use canvas::{encode_png, is_own_picture};
pub use chart::{Chart, Claim, Curve, Plot, Series, StatedRange};
pub use looks::{Stroke, Style, decoder_variant};
pub use panel::save_charts;
pub(crate) use sheet::draw_heat;
pub use sheet::{Sheet, Tile, TileRow, pressure_png, save_sheet};

#[cfg(test)]
pub(crate) mod tests;
