//! The place of a panel, and where its data stand in it.

use super::axis::Axis;
use super::draw::Point;

/// The inner rectangle of a panel and its two axes.
pub(super) struct PanelFrame {
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) width: f64,
    pub(super) height: f64,
    pub(super) x: Axis,
    pub(super) y: Axis,
}

impl PanelFrame {
    /// Where a point of the data stands, inside or outside the rectangle.
    pub(super) fn place(&self, (x, y): Point) -> Option<Point> {
        let (u, v) = (self.x.place(x)?, self.y.place(y)?);
        Some((self.left + u * self.width, self.top + (1.0 - v) * self.height))
    }

    /// Height of a value, if inside.
    pub(super) fn level(&self, y: f64) -> Option<f64> {
        self.y
            .place(y)
            .filter(|v| (0.0..=1.0).contains(v))
            .map(|v| self.top + (1.0 - v) * self.height)
    }

    /// Horizontal place of a value, if inside.
    pub(super) fn column(&self, x: f64) -> Option<f64> {
        self.x
            .place(x)
            .filter(|u| (0.0..=1.0).contains(u))
            .map(|u| self.left + u * self.width)
    }

    /// Whether a place is inside, the border included.
    pub(super) fn holds(&self, (x, y): Point) -> bool {
        // A tenth of a pixel of rounding.
        x >= self.left - 0.1
            && x <= self.left + self.width + 0.1
            && y >= self.top - 0.1
            && y <= self.top + self.height + 0.1
    }
}
