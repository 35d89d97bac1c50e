//! Cells that miss clock edges and lag behind their own sequences.

use crate::batch::Batch;
use crate::effect::parse;
use crate::effect::{Effect, ProfileError, Session};
use crate::faults::skipping_clocks::SkippingClocks;
use crate::span::Span;
use serde::Deserialize;

/// Every cell misses an edge now and then and is from then on one measurement behind, until it is seeded again: after n
/// edges by n·`probability` on average. The fault `skipping_clocks` is one cell that does so often; a cell with a fault
/// that decides its level is left to that fault.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Config {
    /// Probability that a cell misses an edge, drawn once a cell, the same in all sessions. Range [0, 1]; default [0,
    /// 1e-8], a guess: of the published sessions' cells only that one is found to lag.
    #[serde(default = "rarely")]
    probability: Span,
}

fn rarely() -> Span {
    Span::Between([0.0, 1e-8])
}

struct MissedClocks {
    /// Cells that miss edges, in the order of their taxels.
    cells: Vec<SkippingClocks>,
}

pub(super) fn build(table: toml::Table, session: &Session) -> Result<Box<dyn Effect>, ProfileError> {
    let config: Config = parse(table)?;
    let probability = config.probability.within("probability", 0.0, 1.0, "[0, 1]")?;
    let mut rng = session.device.rng("missed-clocks", 0);
    let mut cells = Vec::new();
    for taxel in (0..).take(session.weights.taxels()) {
        let probability = probability.draw(&mut rng);
        if probability > 0.0 {
            cells.push(SkippingClocks::new(session, taxel, probability)?);
        }
    }
    Ok(Box::new(MissedClocks { cells }))
}

impl Effect for MissedClocks {
    fn apply(&mut self, batch: &mut Batch<'_>) {
        let (before, after) = (batch.row(0).saturating_sub(1), batch.row(batch.len()));
        for cell in &mut self.cells {
            let (lag, until) = cell.lag(before);
            let in_step = lag == 0 && until >= after;
            if !in_step && !batch.decided(cell.taxel()) {
                batch.change(cell.taxel(), false, |run| cell.fill(run.first_row, run.levels));
            }
        }
    }
}
