//! Sheets of tactile images, pictures and bar strips: what is shown.

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

impl Tile {
    /// Line below the tile; empty where there is none.
    pub(super) fn caption(&self) -> &str {
        match self {
            Self::Heat { caption, .. } | Self::Picture { caption, .. } | Self::Bars { caption, .. } => caption,
            Self::Text(_) | Self::Empty => "",
        }
    }
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
