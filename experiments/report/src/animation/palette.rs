//! The fixed colours of an animation: those of the heat map, and the shades of text and lines on white.

use crate::figures::colour::{FRAME, INK, MISSING, MUTED, Rgb, WHITE, heat};
use std::collections::HashMap;

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
        for (ink, shades) in [
            (INK, 32),
            (MUTED, 20),
            (TRACE, 20),
            (WINDOW, 20),
            (FRAME, 8),
            (AHEAD, 8),
        ] {
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
