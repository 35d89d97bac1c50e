//! Influence coefficients of all levels of a solver, shared between solvers. They are most of the set-up cost, and the
//! next solver often has the same parameters: every press of a data set makes its own solver.

use super::coefficients::{Influence, deficit};
use super::kernel::ElasticKernel;
use super::pyramid::coarser;
use super::system::EXTRA_OFFSETS;
use std::cell::RefCell;
use std::sync::Arc;

/// A level is the coarsest when its shorter side has at most this many cells.
pub(crate) const COARSEST: usize = 20;

/// Coefficients of a level and the side of its cells, m; the finest first.
pub(crate) type Tables = Arc<[(Arc<Influence>, f64)]>;

/// Most cells of tables that are kept: a few megabytes.
const MOST_KEPT: usize = 1 << 18;

/// Kernel, rows and columns, side of a cell in m.
type Kind = (ElasticKernel, [usize; 2], f64);

thread_local! {
    static LAST: RefCell<Option<(Kind, Tables)>> = const { RefCell::new(None) };
}

/// Coefficients for up to `shape` cells of side `cell_m`: a function of the arguments alone. Those of a thread's last
/// solver are kept.
pub(crate) fn tables(kernel: ElasticKernel, shape: [usize; 2], cell_m: f64) -> Tables {
    let kind = (kernel, shape, cell_m);
    LAST.with_borrow_mut(|last| match last {
        Some((known, tables)) if *known == kind => Arc::clone(tables),
        _ => {
            let tables = computed(kernel, shape, cell_m);
            let small = shape[0].saturating_mul(shape[1]) <= MOST_KEPT;
            *last = small.then(|| (kind, Arc::clone(&tables)));
            tables
        }
    })
}

fn computed(kernel: ElasticKernel, shape: [usize; 2], cell_m: f64) -> Tables {
    let (mut sizes, mut size, mut side_m) = (vec![(shape, cell_m)], shape, cell_m);
    while size[0].min(size[1]) > COARSEST {
        (size, side_m) = (coarser(size), 2.0 * side_m);
        sizes.push((size, side_m));
    }
    let sizes = sizes
        .into_iter()
        .map(|(size, side_m)| (size.map(|n| n + EXTRA_OFFSETS), side_m));
    // the coarsest offsets reach furthest
    let table = sizes
        .clone()
        .next_back()
        .and_then(|(offsets, side_m)| deficit(&kernel, offsets, side_m));
    let level = |(offsets, side_m)| {
        let influence = Influence::with_deficit(&kernel, table.as_ref(), offsets, side_m);
        (Arc::new(influence), side_m)
    };
    sizes.map(level).collect()
}
