//! Analog levels in place of signs.

use super::greedy::Greedy;

/// Levels of an 8-bit converter.
const CODES: u16 = 256;

impl Greedy {
    /// Rows with the 256 levels of an 8-bit converter, (2 c − 255) / 255 for the codes c.
    #[must_use]
    pub fn analog() -> Self {
        let last = f64::from(CODES - 1);
        Self {
            levels: (0..CODES).map(|code| (2.0 * f64::from(code) - last) / last).collect(),
            // a start costs as much as all levels
            starts: 8,
            sweeps: 2,
        }
    }
}
