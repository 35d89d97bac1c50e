//! Colours, and one perceptually even map for values.

/// A 24-bit sRGB colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rgb(pub u8, pub u8, pub u8);

/// Paper.
pub(crate) const WHITE: Rgb = Rgb(255, 255, 255);
/// Text.
pub(crate) const INK: Rgb = Rgb(0x20, 0x24, 0x2a);
/// Secondary text, axes.
pub(crate) const MUTED: Rgb = Rgb(0x5a, 0x61, 0x6b);
/// Frames of tiles.
pub(crate) const FRAME: Rgb = Rgb(0x9a, 0xa1, 0xab);
/// Grid lines.
pub(crate) const GRID: Rgb = Rgb(0xe4, 0xe7, 0xeb);
/// Claims of the paper.
pub(crate) const CLAIM: Rgb = Rgb(0x76, 0x76, 0x76);
/// A cell without a value.
pub(crate) const MISSING: Rgb = Rgb(0xbd, 0xbd, 0xbd);
/// Outline around the taxels that are truly touched: far in hue from every colour of [`heat`].
pub(crate) const OUTLINE: Rgb = Rgb(0x2e, 0xe6, 0xd6);

impl Rgb {
    /// `#rrggbb`.
    pub fn hex(self) -> String {
        format!("#{:02x}{:02x}{:02x}", self.0, self.1, self.2)
    }

    /// This colour moved by `share` (0 to 1) towards `other`.
    pub fn mix(self, other: Self, share: f64) -> Self {
        let part = |a: u8, b: u8| channel((f64::from(a) + share * (f64::from(b) - f64::from(a))) / 255.0);
        Self(part(self.0, other.0), part(self.1, other.1), part(self.2, other.2))
    }
}

/// Colour of a value between 0 (almost black) and 1 (pale yellow), through violet, red and orange.
///
/// The path is drawn in Oklch (B. Ottosson, "A perceptual color space for image processing", 2020): lightness rises
/// linearly, so equal steps of value look like equal steps, in colour and in grey. Values outside the range are
/// clipped; a non-finite one is `MISSING`.
pub fn heat(value: f64) -> Rgb {
    if !value.is_finite() {
        return MISSING;
    }
    let t = value.clamp(0.0, 1.0);
    let lightness = 0.15 + 0.82 * t;
    let hue = (285.0 + 185.0 * t).to_radians();
    let mut chroma = 0.03 + 0.165 * (std::f64::consts::PI * t.powf(0.85)).sin().max(0.0) + 0.07 * t;
    loop {
        let rgb = linear_srgb(lightness, chroma * hue.cos(), chroma * hue.sin());
        if chroma < 1e-3 || rgb.iter().all(|c| (0.0..=1.0).contains(c)) {
            let [r, g, b] = rgb.map(|c| channel(gamma(c.clamp(0.0, 1.0))));
            return Rgb(r, g, b);
        }
        chroma *= 0.97;
    }
}

/// Oklab to linear sRGB, with Ottosson's published matrices.
fn linear_srgb(lightness: f64, a: f64, b: f64) -> [f64; 3] {
    let l = (lightness + 0.396_337_777_4 * a + 0.215_803_757_3 * b).powi(3);
    let m = (lightness - 0.105_561_345_8 * a - 0.063_854_172_8 * b).powi(3);
    let s = (lightness - 0.089_484_177_5 * a - 1.291_485_548 * b).powi(3);
    [
        4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s,
        -1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s,
        -0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701 * s,
    ]
}

/// Transfer function of sRGB (IEC 61966-2-1).
fn gamma(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// A share of full scale as a byte.
#[expect(clippy::cast_possible_truncation, reason = "clamped to 0..=255")]
fn channel(share: f64) -> u8 {
    (share * 255.0).round().clamp(0.0, 255.0) as u8
}
