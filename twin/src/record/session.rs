//! One session of a twin, recorded a few presses at a time.

use super::error::TwinError;
use super::hold::hold_s;
use super::mechanics::PressFrames;
use super::twin::Twin;
use crate::chain::{Acquisition, ReadoutSession, SkinSession, press_facts};
use crate::session::{PressFacts, Recorded};
use spts_circuit::Interpolated;

/// Records presses as they come. Skin and readout remember earlier presses.
pub struct TwinSession<'a> {
    twin: &'a Twin,
    skin: SkinSession,
    readout: Option<ReadoutSession>,
}

impl TwinSession<'_> {
    /// Conductance of the next `presses` and, if they are read out, their blocks.
    ///
    /// # Errors
    /// [`TwinError::Chain`] if the frames are not in order of time, or the readout refuses the conductance.
    pub fn record(&mut self, presses: &[PressFrames]) -> Result<(Vec<Interpolated>, Option<Recorded>), TwinError> {
        let sources = presses.iter().map(|press| self.skin.conductance(&press.frames));
        let mut sources = sources.collect::<Result<Vec<_>, _>>()?;
        let recording = self.readout.as_mut().map(|readout| readout.record(&mut sources));
        let recorded = recording.transpose()?.map(|recording| Recorded {
            presses: self.twin.facts(presses, &sources),
            ..Recorded::new(recording)
        });
        Ok((sources, recorded))
    }
}

impl Twin {
    /// Starts the session of `acquisition`, before its first press, on an unconditioned sheet. If `read_out`, presses
    /// are recorded; otherwise only their conductance is computed.
    ///
    /// # Errors
    /// [`TwinError::Chain`] if a press is too long to record, or the source of the weights cannot provide them.
    pub fn start_session(&self, acquisition: &Acquisition, read_out: bool) -> Result<TwinSession<'_>, TwinError> {
        let chain = self.scene().chain();
        let readout = read_out.then(|| chain.readout_session(self.scene().duration_s(), acquisition));
        Ok(TwinSession {
            twin: self,
            skin: chain.skin_session(acquisition.session),
            readout: readout.transpose()?,
        })
    }

    /// What is known of `presses`, whose conductance is `sources`.
    pub(super) fn facts(&self, presses: &[PressFrames], sources: &[Interpolated]) -> Vec<PressFacts> {
        let hold_s = hold_s(self.scene());
        let pairs = presses.iter().zip(sources);
        let facts = pairs.map(|(press, source)| press_facts(&press.frames, source.maps(), hold_s));
        facts.collect()
    }
}
