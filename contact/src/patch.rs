//! A rectangle of grid squares.

/// Rectangle of squares of the grid on which contact is computed: rows `rows[0]..rows[1]` and columns
/// `cols[0]..cols[1]`.
///
/// ```
/// use spts_contact::Patch;
///
/// let patch = Patch { rows: [1, 3], cols: [2, 5] };
/// assert_eq!((patch.height(), patch.width()), (2, 3));
/// // where its squares are in a grid of 10 columns
/// assert_eq!(patch.lines(10).collect::<Vec<_>>(), [12..15, 22..25]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Patch {
    /// First and one-past-last row.
    pub rows: [usize; 2],
    /// First and one-past-last column.
    pub cols: [usize; 2],
}

impl Patch {
    /// Whether the patch has no grid squares.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.rows[0] >= self.rows[1] || self.cols[0] >= self.cols[1]
    }

    /// Number of columns.
    #[must_use]
    pub fn width(&self) -> usize {
        self.cols[1].saturating_sub(self.cols[0])
    }

    /// Number of rows.
    #[must_use]
    pub fn height(&self) -> usize {
        self.rows[1].saturating_sub(self.rows[0])
    }

    /// The grid squares of each row of the patch, as index ranges of a row-major grid with `grid_cols` columns.
    pub fn lines(&self, grid_cols: usize) -> impl Iterator<Item = std::ops::Range<usize>> + use<> {
        let Self { rows, cols } = *self;
        (rows[0]..rows[1]).map(move |row| row * grid_cols + cols[0]..row * grid_cols + cols[1])
    }

    /// Grows to the smallest rectangle that has `other` too.
    pub(crate) fn include(&mut self, other: Self) {
        if self.is_empty() {
            *self = other;
        } else if !other.is_empty() {
            self.rows = [self.rows[0].min(other.rows[0]), self.rows[1].max(other.rows[1])];
            self.cols = [self.cols[0].min(other.cols[0]), self.cols[1].max(other.cols[1])];
        }
    }
}
