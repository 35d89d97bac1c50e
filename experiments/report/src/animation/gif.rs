//! Pictures as one GIF file that repeats for ever, in fixed colours: those of the heat map, and the shades of text and
//! lines on white.

use super::timeline::DELAY_CS;
use crate::figures::colour::{FRAME, INK, MISSING, MUTED, Rgb, WHITE, heat};
use gif::{DisposalMethod, Encoder, EncodingError, Frame, Repeat};
use std::borrow::Cow;
use std::collections::HashMap;

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
        let delay = if k + 1 == pictures.len() { LAST_DELAY_CS } else { DELAY_CS };
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

/// Steps of the heat map.
const HEAT_STEPS: u8 = 56;
/// The trace of the wire.
pub(super) const TRACE: Rgb = Rgb(0x00, 0x72, 0xb2);
/// What is still to come of it.
pub(super) const AHEAD: Rgb = Rgb(0xc9, 0xce, 0xd5);
/// The current window.
pub(super) const WINDOW: Rgb = Rgb(0xd5, 0x5e, 0x00);
/// Number of the colour that leaves a pixel as it is.
pub(super) const SAME: u8 = 0;

/// Colours by number.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Palette(Vec<Rgb>);

impl Palette {
    pub(super) fn new() -> Self {
        let mut colours = vec![WHITE, WHITE];
        colours.extend((0..HEAT_STEPS).map(|step| heat(f64::from(step) / f64::from(HEAT_STEPS - 1))));
        for (ink, shades) in [(INK, 32), (MUTED, 20), (TRACE, 20), (WINDOW, 20), (FRAME, 8), (AHEAD, 8)] {
            colours.extend((1..=shades).map(|shade| WHITE.mix(ink, f64::from(shade) / f64::from(shades))));
        }
        colours.push(MISSING);
        Self(colours)
    }

    /// Red, green and blue of every colour.
    pub(super) fn bytes(&self) -> Vec<u8> {
        self.0.iter().flat_map(|Rgb(r, g, b)| [*r, *g, *b]).collect()
    }

    /// Number of the nearest colour of every pixel, the first of equally near ones; never [`SAME`].
    pub(super) fn numbers(&self, rgb: &[u8]) -> Vec<u8> {
        let mut known: HashMap<[u8; 3], u8> = HashMap::new();
        let mut last = ([255; 3], 1);
        let pixels = rgb.as_chunks::<3>().0.iter();
        let number = |pixel: &[u8; 3]| {
            if *pixel != last.0 {
                last = (*pixel, *known.entry(*pixel).or_insert_with(|| self.nearest(*pixel)));
            }
            last.1
        };
        pixels.map(number).collect()
    }

    fn nearest(&self, pixel: [u8; 3]) -> u8 {
        let distance = |colour: &Rgb| {
            let parts = [colour.0, colour.1, colour.2].into_iter().zip(pixel);
            parts.map(|(a, b)| u32::from(a.abs_diff(b)).pow(2)).sum::<u32>()
        };
        let numbered = self.0.iter().zip(0_u8..).skip(usize::from(SAME) + 1);
        let nearest = numbered.min_by_key(|(colour, _)| distance(colour));
        nearest.map_or(1, |(_, number)| number)
    }
}

/// A share of full scale, rounded to a step of the heat map, so that its colour is in the palette.
pub(super) fn step_of(share: f64) -> f64 {
    let steps = f64::from(HEAT_STEPS - 1);
    (share.clamp(0.0, 1.0) * steps).round() / steps
}
