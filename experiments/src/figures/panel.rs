//! Layout of charts.
use super::chart::Chart;
use super::draw::Canvas;
pub(super) fn figure(_charts: &[Chart]) -> Canvas {
    Canvas::new(720.0, 400.0, "")
}
