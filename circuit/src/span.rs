//! A parameter that is fixed or differs from session to session.

use rand::RngExt as _;
use serde::Deserialize;
use spts_models::{ConfigError, in_range};

/// Either one value, or `[low, high]`: the value is then drawn uniformly, once a session (or once a taxel or a device,
/// where the effect says so).
///
/// The fitted spans of the shipped profile predict: a new session of the real skin falls inside nine times in ten. Drawn
/// uniformly, a simulated session is never more extreme than that; the one in ten beyond is not drawn.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum Span {
    /// The same in every session.
    Fixed(f64),
    /// Uniform between two values.
    Between([f64; 2]),
}

impl Span {
    fn ends(self) -> [f64; 2] {
        match self {
            Self::Fixed(v) => [v, v],
            Self::Between(ends) => ends,
        }
    }

    /// Checks that both ends lie within `[min, max]` and in order.
    ///
    /// # Errors
    /// [`ConfigError`] that names `field` and `range` otherwise.
    pub fn within(self, field: &str, min: f64, max: f64, range: &'static str) -> Result<Self, ConfigError> {
        let [low, high] = self.ends();
        in_range(field, low, low >= min && low <= max, range)?;
        in_range(field, high, high >= low && high <= max, range)?;
        Ok(self)
    }

    /// One value of the span. Draws one number from `rng` either way.
    pub fn draw(self, rng: &mut impl rand::Rng) -> f64 {
        let [low, high] = self.ends();
        let u: f64 = rng.random();
        low + (high - low) * u
    }
}
