//! Ranges of a data set's shapes.

use serde::{Deserialize, Serialize};
use spts_models::{ConfigError, in_range, within};

/// Ranges from which size, relief and edge of a shape are drawn uniformly. Each is `[lowest, highest]`; two equal
/// numbers fix the value. A missing range takes its value in [`ShapeRanges::default`].
///
/// ```
/// use spts_contact::shapes::ShapeRanges;
///
/// let ranges: ShapeRanges = toml::from_str("size_m = [0.04, 0.06]")?;
/// assert!(ranges.check().is_ok());
/// let wrong = ShapeRanges { size_m: [0.06, 0.04], ..ranges };
/// assert!(wrong.check().unwrap_err().to_string().contains("size_m"));
/// # Ok::<(), toml::de::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ShapeRanges {
    /// Largest horizontal extent along body x or y, m; within [5e-3, 0.3].
    pub size_m: [f64; 2],
    /// Difference between the highest and the lowest point of bow and waves on the underside, m; within [0, 5e-3].
    pub relief_m: [f64; 2],
    /// Radius of the outline's corners and of the lower edge, m; within [0, 20e-3]. It is smaller on narrow shapes.
    pub edge_m: [f64; 2],
}

impl Default for ShapeRanges {
    /// Objects of the size of a hand's grip: from just over a taxel's pitch to well within the skin. The published
    /// objects are bowed by up to 0.6 mm.
    fn default() -> Self {
        Self {
            size_m: [20e-3, 90e-3],
            relief_m: [0.0, 0.6e-3],
            edge_m: [0.0, 3e-3],
        }
    }
}

impl ShapeRanges {
    /// Checks that every limit is in its range, and that no lower limit is above the upper one.
    ///
    /// # Errors
    /// [`ConfigError`] for the first field outside its range.
    pub fn check(&self) -> Result<(), ConfigError> {
        let fields = [
            ("size_m", self.size_m, [5e-3, 0.3], "[5e-3, 0.3] m"),
            ("relief_m", self.relief_m, [0.0, 5e-3], "[0, 5e-3] m"),
            ("edge_m", self.edge_m, [0.0, 20e-3], "[0, 20e-3] m"),
        ];
        for (field, [low, high], [least, most], text) in fields {
            within(&format!("{field}[0]"), low, least, most, text)?;
            within(&format!("{field}[1]"), high, least, most, text)?;
            let name = format!("{field}[0]");
            in_range(&name, low, low <= high, "the range that ends at the second number")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bad_range_is_told_with_field_value_and_range() {
        let told = |toml: &str| {
            let ranges: ShapeRanges = toml::from_str(toml).unwrap();
            ranges.check().unwrap_err().to_string()
        };
        assert_eq!(
            told("size_m = [1e-3, 0.1]"),
            "`size_m[0]` = 0.001 is outside [5e-3, 0.3] m"
        );
        assert_eq!(
            told("relief_m = [0.0, nan]"),
            "`relief_m[1]` = NaN is outside [0, 5e-3] m"
        );
        assert_eq!(
            told("edge_m = [2e-3, 1e-3]"),
            "`edge_m[0]` = 0.002 is outside the range that ends at the second number"
        );
        assert!(toml::from_str::<ShapeRanges>("height_m = [0.0, 1.0]").is_err());
        assert!(ShapeRanges::default().check().is_ok());
    }
}
