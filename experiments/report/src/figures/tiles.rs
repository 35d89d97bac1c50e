//! Sheets of tactile images, pictures and bar strips: what is shown, and the one function that writes it.

use super::draw::save;
use super::error::FigureError;
use super::sheet;
use std::path::Path;

/// One cell of a sheet.
#[derive(Debug, Clone, PartialEq)]
pub enum Tile {
    /// A tactile image.
    Heat {
        /// Values, row-major. A negative is shown as 0, a non-finite as grey.
        values: Vec<f64>,
        /// Rows of taxels.
        rows: usize,
        /// Columns of taxels.
        cols: usize,
        /// Value at the bright end of the colours; `None` takes the image's own maximum.
        max: Option<f64>,
        /// Line below the tile.
        caption: String,
        /// True taxels, outlined: row-major, one a value.
        outline: Option<Vec<bool>>,
    },
    /// A picture, fitted into the tile with its aspect kept.
    Picture {
        /// Pixels in a row.
        width: usize,
        /// Pixels in a column.
        height: usize,
        /// Red, green, blue of every pixel, row-major.
        rgb: Vec<u8>,
        /// Line below the tile.
        caption: String,
    },
    /// A bar chart without axes, such as the voltages read so far.
    Bars {
        /// Bar heights; the largest magnitude fills the tile.
        values: Vec<f64>,
        /// The first `highlight` bars are coloured, the others grey.
        highlight: usize,
        /// Line below the tile.
        caption: String,
    },
    /// Words.
    Text(String),
    /// Nothing.
    Empty,
}

/// A row of tiles with its label on the left.
#[derive(Debug, Clone, PartialEq)]
pub struct TileRow {
    /// Label.
    pub label: String,
    /// Tiles, left to right. Rows may be of different lengths.
    pub tiles: Vec<Tile>,
}

/// A figure of rows of tiles. More than nine rows are set as two halves, side by side.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Sheet {
    /// Heading.
    pub title: String,
    /// Headings of the columns; may be empty.
    pub column_titles: Vec<String>,
    /// Rows, top to bottom.
    pub rows: Vec<TileRow>,
    /// Side of a tile in CSS pixels; at least 24 is used.
    pub tile_px: usize,
}

/// Writes a sheet to `dir/name.svg` and `dir/name.png`.
///
/// # Errors
/// [`FigureError`] when a tile's values do not fill its grid, a file cannot be written or no font is found for the
/// PNG.
pub fn save_sheet(sheet: &Sheet, dir: &Path, name: &str) -> Result<(), FigureError> {
    let path = dir.join(format!("{name}.svg"));
    for tile in sheet.rows.iter().flat_map(|row| &row.tiles) {
        let (len, rows, cols, marks) = match tile {
            Tile::Heat {
                values,
                rows,
                cols,
                outline,
                ..
            } => (values.len(), *rows, *cols, outline.as_ref().map(Vec::len)),
            Tile::Picture { width, height, rgb, .. } => (rgb.len(), *height, width * 3, None),
            _ => continue,
        };
        for len in std::iter::once(len).chain(marks) {
            if len != rows * cols {
                return Err(FigureError::Shape { path, len, rows, cols });
            }
        }
    }
    save(&sheet::layout(sheet), dir, name)
}
