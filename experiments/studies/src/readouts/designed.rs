//! Signs designed for the expected images.

use super::decode::{FewRows, Rows, WHOLE_IMAGES};
use super::readout::{PreparedReadout, ReadoutSkin, WireReadout};
use super::rows::StoredRows;
use spts_input::Refusal;
use spts_recon::rows::{DesignRows as _, Expected, RowTask, Separable, Tolerances};

/// Distance over which images of larger skins are alike, taxels.
const SMOOTH_TAXELS: f64 = 1.5;

/// Rows of ±1 in pattern mode: products of two rows along the axes of the skin. Each of the two lowers what is left of
/// the expected images' variance most. They make the best images of `spts sensing study`.
#[derive(Debug, Clone, Copy)]
pub(super) struct DesignedSigns;

impl WireReadout for DesignedSigns {
    fn prepare(&self, skin: &ReadoutSkin) -> Result<Box<dyn PreparedReadout>, Refusal> {
        let taxels = skin.layout.taxels();
        let most = skin.measurements().last().copied().unwrap_or(1);
        let shape = [skin.layout.rows(), skin.layout.cols()];
        let expected = if taxels <= WHOLE_IMAGES {
            Expected::like(&*skin.prior()?, shape, Tolerances::default()).map_err(Refusal::from_error)?
        } else {
            Expected::smooth(shape, SMOOTH_TAXELS).map_err(Refusal::from_error)?
        };
        let designed = Separable
            .design(&RowTask::new(most, &expected))
            .map_err(Refusal::from_error)?;
        let signs = designed
            .view()
            .values()
            .iter()
            .map(|level| if *level > 0.0 { 1 } else { -1 });
        let rows = StoredRows::new(taxels, signs.collect());
        Ok(Box::new(FewRows::new(skin, rows, Rows::Smooth(SMOOTH_TAXELS))?))
    }
}
