//! The whole comparison: recordings in, tables and curves out.

use super::{
    Compared, Curves, Statistic, compare_all, curves, curves_steps, statistics::not_modelled, statistics::statistics,
};
use crate::calibrate::Pair;
use crate::cli::{CliError, progress};
use crate::real::Real;
use spts_models::Streams;
use std::path::Path;

/// What `spts compare` finds.
#[derive(Debug, Clone)]
pub struct Comparison {
    /// Sessions.
    pub compared: Vec<Compared>,
    /// Numbers that must agree.
    pub statistics: Vec<Statistic>,
    /// Numbers that the readout does not model.
    pub not_modelled: Vec<Statistic>,
    /// Score curves, if they were asked for.
    pub curves: Option<Curves>,
}

impl Comparison {
    /// Calibrates and replays the sessions `pairs`, read from `recordings`, and scores them when `real` says with what. Shows its
    /// progress.
    ///
    /// # Errors
    /// [`CliError`] when a session cannot be compared.
    pub(crate) fn run(
        recordings: &Path,
        pairs: &[Pair],
        real: Option<&Real>,
        streams: Streams,
    ) -> Result<Self, CliError> {
        let bar = progress(pairs.len(), "replaying sessions");
        let compared = compare_all(pairs, streams, &|| bar.inc(1))
            .map_err(|e| CliError::Usage(format!("{}: {e}", recordings.display())))?;
        bar.finish_and_clear();
        let curves = real.map(|real| {
            let bar = progress(curves_steps(&compared, real), "scoring presses");
            let scored = curves(&compared, real, &|| bar.inc(1));
            bar.finish_and_clear();
            scored
        });
        Ok(Self {
            statistics: statistics(&compared),
            not_modelled: not_modelled(&compared),
            compared,
            curves,
        })
    }

    /// Both kinds of numbers.
    #[must_use]
    pub fn all_statistics(&self) -> Vec<Statistic> {
        [self.statistics.as_slice(), &self.not_modelled].concat()
    }
}
