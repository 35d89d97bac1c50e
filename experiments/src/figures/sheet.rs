//! Layout of sheets.
use super::draw::Canvas;
use super::tiles::Sheet;
pub(super) fn layout(sheet: &Sheet) -> Canvas {
    Canvas::new(720.0, 400.0, &sheet.title)
}
