//! Place on the sheet: in taxels, in metres from the sheet's middle, or relative to the sheet.

use super::MechanicsError;
use spts_models::{ConfigError, SkinLayout, in_range};

/// A place as a scene writes it; at most one of the three ways is used.
#[derive(Debug)]
pub(super) struct Place<'a> {
    /// `press` or `drop`.
    pub(super) section: &'static str,
    /// Row and column, taxels.
    pub(super) row: &'a mut Option<f64>,
    pub(super) col: &'a mut Option<f64>,
    /// (x, y) relative to the middle of the sheet, m: x towards large columns, y towards small rows.
    pub(super) position_m: &'a mut Option<[f64; 2]>,
    /// The same relative to the sheet's width and height.
    pub(super) position_share: &'a mut Option<[f64; 2]>,
}

/// How far beside the centres of the outer taxels something may be placed, m, and never less than [`REACH_TAXELS`].
const REACH_M: f64 = 75e-3;
/// The same in taxels.
const REACH_TAXELS: f64 = 5.0;

impl Place<'_> {
    /// Turns whatever was written into a row and a column; where nothing was, these are `usual`.
    ///
    /// # Errors
    /// [`MechanicsError`] for two ways at once, and for a place out of reach of the sheet.
    pub(super) fn resolve(mut self, skin: &SkinLayout, usual: [f64; 2]) -> Result<(), MechanicsError> {
        let in_taxels = self.row.is_some() || self.col.is_some();
        let found = [in_taxels, self.position_m.is_some(), self.position_share.is_some()];
        let found = found.into_iter().filter(|given| *given).count();
        if found > 1 {
            return Err(MechanicsError::Places {
                section: self.section,
                found,
            });
        }
        if let Some(share) = self.position_share.take() {
            for (axis, s) in ["x", "y"].into_iter().zip(share) {
                let field = format!("{}.position_share ({axis})", self.section);
                in_range(&field, s, (-1.0..=1.0).contains(&s), "[-1, 1]")?;
            }
            let [width_m, height_m] = skin.extent_m();
            self.set(skin, [share[0] * width_m, share[1] * height_m]);
        } else if let Some(position_m) = self.position_m.take() {
            let [width_m, height_m] = skin.extent_m();
            for ((axis, p), extent_m) in ["x", "y"].into_iter().zip(position_m).zip([width_m, height_m]) {
                let most_m = 0.5 * (extent_m - skin.pitch_m()) + reach(skin) * skin.pitch_m();
                // as far as a row or a column may be, and its rounding; NaN is not within
                let within = p.abs() <= most_m * (1.0 + 1e-12);
                if !within {
                    return Err(MechanicsError::Position {
                        section: self.section,
                        axis,
                        value_m: p,
                        most_m,
                    });
                }
            }
            self.set(skin, position_m);
        }
        let (row, col) = (*self.row, *self.col);
        self.row.get_or_insert(usual[0]);
        self.col.get_or_insert(usual[1]);
        // a usual place far beside a small sheet ends in an error that says that nothing is touched
        check(&format!("{}.", self.section), [row, col], skin)?;
        Ok(())
    }

    fn set(&mut self, skin: &SkinLayout, [x, y]: [f64; 2]) {
        let [last_row, last_col] = last(skin);
        *self.row = Some(0.5 * last_row - y / skin.pitch_m());
        *self.col = Some(0.5 * last_col + x / skin.pitch_m());
    }
}

/// Indices of the last row and column.
fn last(skin: &SkinLayout) -> [f64; 2] {
    [skin.rows() as f64 - 1.0, skin.cols() as f64 - 1.0]
}

fn reach(skin: &SkinLayout) -> f64 {
    // a rounding of the quotient must not cost the whole number
    (REACH_M / skin.pitch_m() * (1.0 + 1e-12)).max(REACH_TAXELS)
}

/// Whether a row and a column are within reach of `skin`; `before` goes before their names in the error.
pub(super) fn check(before: &str, place: [Option<f64>; 2], skin: &SkinLayout) -> Result<(), ConfigError> {
    let names = [
        ("row", "[-5, rows + 4], or 75 mm beside the outer rows"),
        ("col", "[-5, cols + 4], or 75 mm beside the outer columns"),
    ];
    let reach = reach(skin);
    for (((name, range), at), last) in names.into_iter().zip(place).zip(last(skin)) {
        let Some(at) = at else { continue };
        in_range(
            &format!("{before}{name}"),
            at,
            (-reach..=last + reach).contains(&at),
            range,
        )?;
    }
    Ok(())
}

/// Row and column of the place on `skin` that is as far from the middle, in metres, as `place` is on the published
/// skin.
pub(super) fn of_published([row, col]: [f64; 2], skin: &SkinLayout) -> [f64; 2] {
    let published = SkinLayout::default();
    let same = (skin.rows(), skin.cols()) == (published.rows(), published.cols());
    if same && skin.pitch_m().to_bits() == published.pitch_m().to_bits() {
        // to the bit
        return [row, col];
    }
    let scale = published.pitch_m() / skin.pitch_m();
    let ([last_row, last_col], [row_0, col_0]) = (last(skin), last(&published));
    [
        0.5 * last_row + (row - 0.5 * row_0) * scale,
        0.5 * last_col + (col - 0.5 * col_0) * scale,
    ]
}
