//! Contacts on skins of any size, by rows as bits.

use crate::algorithm::{Algorithm, Answer, DecodeError, Trained};
use crate::training::TrainingData;
use crate::windows::Window;
use spts_input::Refusal;
use spts_recon::matrix_free;

/// Nothing is learned.
#[derive(Debug, Clone)]
struct OnSheet {
    sheet: matrix_free::OnSheet,
}

pub(super) fn patches(data: &TrainingData) -> Result<Box<dyn Trained>, Refusal> {
    Ok(Box::new(OnSheet {
        sheet: matrix_free::OnSheet::new(data.shape[0], data.shape[1], matrix_free::OnSheet::CELLS),
    }))
}

impl Trained for OnSheet {
    fn start(&self) -> Box<dyn Algorithm + '_> {
        Box::new(self.clone())
    }
}

impl Algorithm for OnSheet {
    fn decode(&mut self, window: &Window<'_>, answer: &mut Answer) -> Result<(), DecodeError> {
        answer.class = None;
        answer.image = match window.bits {
            Some(bits) => self.sheet.recover(bits, window.y, window.wires)?,
            None => self.sheet.recover(window.phi, window.y, window.wires)?,
        };
        Ok(())
    }

    fn takes_bits(&self) -> bool {
        true
    }
}
