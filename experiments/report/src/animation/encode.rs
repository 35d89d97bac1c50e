//! Pictures as one GIF file that repeats for ever.

use super::palette::{Palette, SAME};
use super::timeline::DELAY_CS;
use gif::{DisposalMethod, Encoder, EncodingError, Frame, Repeat};
use std::borrow::Cow;

/// How long the last picture stays, hundredths of a second.
const LAST_DELAY_CS: u16 = 120;

/// The file. `pictures` hold the number of the colour of every pixel, row by row. Of every picture but the first, only
/// the rectangle that changed is stored, and in it only the pixels that changed.
pub(super) fn gif(
    pictures: &[Vec<u8>],
    (width, height): (u16, u16),
    palette: &Palette,
) -> Result<Vec<u8>, EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, width, height, &palette.bytes())?;
    encoder.set_repeat(Repeat::Infinite)?;
    for (k, picture) in pictures.iter().enumerate() {
        let delay = if k + 1 == pictures.len() {
            LAST_DELAY_CS
        } else {
            DELAY_CS
        };
        let before = k.checked_sub(1).map(|before| pictures[before].as_slice());
        encoder.write_frame(&Frame {
            delay,
            dispose: DisposalMethod::Keep,
            transparent: Some(SAME),
            ..changes(picture, before, (width, height))
        })?;
    }
    drop(encoder);
    Ok(bytes)
}

/// What differs between two pictures; all of `picture` without one before it.
fn changes(picture: &[u8], before: Option<&[u8]>, (width, height): (u16, u16)) -> Frame<'static> {
    let row = usize::from(width.max(1));
    let changed = |x: usize, y: usize| before.is_none_or(|before| before[y * row + x] != picture[y * row + x]);
    let columns = |y: u16| {
        let first = (0..width).find(|x| changed(usize::from(*x), usize::from(y)))?;
        let last = (0..width).rev().find(|x| changed(usize::from(*x), usize::from(y)))?;
        Some((first, last))
    };
    let mut around: Option<[u16; 4]> = None;
    for y in 0..height {
        if let Some((first, last)) = columns(y) {
            around = Some(match around {
                Some([left, top, right, _]) => [left.min(first), top, right.max(last), y],
                None => [first, y, last, y],
            });
        }
    }
    // a picture that is the same takes one pixel
    let [left, top, right, bottom] = around.unwrap_or_default();
    let rows = usize::from(top)..=usize::from(bottom);
    let pixels = rows.flat_map(|y| {
        (usize::from(left)..=usize::from(right)).map(move |x| if changed(x, y) { picture[y * row + x] } else { SAME })
    });
    Frame {
        left,
        top,
        width: right - left + 1,
        height: bottom - top + 1,
        buffer: Cow::Owned(pixels.collect()),
        ..Frame::default()
    }
}
