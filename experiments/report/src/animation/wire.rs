//! The trace of the wire as columns of pixels.

use std::ops::Range;

/// Least and largest voltage under each column of pixels.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Trace {
    /// Least and largest voltage of a column, V; `None` where all its samples were lost.
    pub(super) columns: Vec<Option<[f64; 2]>>,
    /// Least and largest voltage of all, V.
    pub(super) range: [f64; 2],
}

impl Trace {
    /// The samples `shown` of `volts` in `columns` columns. A column reaches to the last sample of the one before, so
    /// that the trace is a line.
    pub(super) fn new(volts: &[f64], shown: Range<usize>, columns: usize) -> Self {
        let volts = &volts[shown.start.min(volts.len())..shown.end.min(volts.len())];
        let (mut before, mut all) = (None, None);
        let place = |column: usize| column * volts.len() / columns.max(1);
        let columns = (0..columns).map(|column| {
            let samples = place(column)..place(column + 1).max(place(column) + 1).min(volts.len());
            let own = volts[samples].iter().copied().filter(|v| v.is_finite());
            let mut range: Option<[f64; 2]> = None;
            let mut last = before;
            for v in before.into_iter().chain(own) {
                range = Some(with(range, v));
                all = Some(with(all, v));
                last = Some(v);
            }
            before = last;
            range
        });
        let columns = columns.collect();
        Self {
            columns,
            range: all.unwrap_or([0.0, 1.0]),
        }
    }
}

fn with(range: Option<[f64; 2]>, v: f64) -> [f64; 2] {
    range.map_or([v, v], |[low, high]| [low.min(v), high.max(v)])
}
