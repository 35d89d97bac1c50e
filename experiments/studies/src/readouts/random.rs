//! Few rows of pseudorandom signs.

use super::decode::{FewRows, Rows};
use super::readout::{PreparedReadout, ReadoutSkin, WireReadout};
use super::rows::StoredRows;
use spts_circuit::{Seeding, WeightMode, Weights};
use spts_input::Refusal;

/// The published cells' own rows: pseudorandom ±1 from mixed seeds, the first M of them over and over.
#[derive(Debug, Clone, Copy)]
pub(super) struct RandomSigns;

impl WireReadout for RandomSigns {
    fn prepare(&self, skin: &ReadoutSkin) -> Result<Box<dyn PreparedReadout>, Refusal> {
        let taxels = skin.layout.taxels();
        let most = skin.measurements().last().copied().unwrap_or(1);
        let count = u32::try_from(taxels).unwrap_or(u32::MAX);
        let weights = Weights::new(WeightMode::Binary, Seeding::Mixed, count);
        let mut levels = vec![0.0; most * taxels];
        weights.fill_rows(0, &mut levels);
        let levels = levels.iter().map(|level| if *level > 0.0 { 1 } else { -1 }).collect();
        let rows = StoredRows::new(taxels, levels);
        Ok(Box::new(FewRows::new(skin, rows, Rows::Random)?))
    }
}
