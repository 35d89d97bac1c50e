//! A parameter that is fixed, or differs from session to session.

use rand::RngExt as _;
use serde::Deserialize;
use spts_models::{ConfigError, in_range};

/// Either one value, or `[low, high]`, from which a value is drawn uniformly once for each session (or for each taxel
/// or device, if the effect says so).
///
/// The spans of the shipped profile are prediction intervals: a new session of the real skin lies inside nine times in
/// ten. Because values are drawn uniformly inside, simulated sessions leave out the most extreme tenth.
///
/// ```
/// use spts_circuit::Span;
/// use spts_models::Streams;
///
/// #[derive(serde::Deserialize)]
/// struct Noise {
///     sd_v: Span,
/// }
/// let noise: Noise = toml::from_str("sd_v = [0.01, 0.03]")?;
/// let drawn_v = noise.sd_v.draw(&mut Streams::new(1).rng("session", 0));
/// assert!((0.01..0.03).contains(&drawn_v));
/// # Ok::<(), toml::de::Error>(())
/// ```
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

    /// Checks that both ends lie in `[min, max]` and are in order.
    ///
    /// # Errors
    /// [`ConfigError`] with `field` and `range`.
    pub fn within(self, field: &str, min: f64, max: f64, range: &'static str) -> Result<Self, ConfigError> {
        let [low, high] = self.ends();
        in_range(field, low, low >= min && low <= max, range)?;
        in_range(field, high, high >= low && high <= max, range)?;
        Ok(self)
    }

    /// Draws one value. One number of `rng` is used in either case.
    pub fn draw(self, rng: &mut impl rand::Rng) -> f64 {
        let [low, high] = self.ends();
        let u: f64 = rng.random();
        low + (high - low) * u
    }
}
