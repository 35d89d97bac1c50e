//! Cells under a running clock.

use spts_firmware::attiny412::ResetCause;
use spts_firmware::{Array, BusEvent, Cell, CellMode, Clock, Image, NEUTRAL_CODE};

use crate::helpers::{CLOCK, MODES, assert_agrees, clocked, expected, said, seeded, spec_state, state};

#[test]
fn all_addresses_and_modes_run_as_specified() {
    for mode in MODES {
        let (mut array, mut cells) = seeded(112, mode);
        assert_eq!(clocked(&mut array, 1000), expected(&mut cells, 1000), "{mode:?}");
        assert_agrees(&mut array, &mut cells);
    }
    let seeds: Vec<u32> = (0..112).map(|k| 0x9e37_79b9_u32.wrapping_mul(k + 1)).collect();
    let (mut array, mut cells) = seeded(112, CellMode::Raster);
    array.start_with_seeds(CellMode::Binary, &seeds).unwrap();
    for (cell, seed) in cells.iter_mut().zip(&seeds) {
        cell.receive(&CellMode::Binary.extended(*seed));
    }
    assert_agrees(&mut array, &mut cells);
}

#[test]
fn sizes_out_of_range_are_refused() {
    for cells in [0, 113] {
        let needed = format!("{cells} cells do not fit on one bus; the range is [1, 112]");
        assert_eq!(said(Array::new(cells, &Image::shipped())), needed);
    }
    let (mut array, _) = seeded(3, CellMode::Raster);
    let needed = "`codes` has 4 entries, which is no multiple of the 3 cells";
    assert_eq!(said(array.clock(CLOCK, &mut [0; 4])), needed);
    assert_eq!(
        said(array.start_with_seeds(CellMode::Binary, &[1, 2])),
        "2 seeds for 3 cells"
    );
    for time_s in [-1e-9, 86_401.0, f64::INFINITY, f64::NAN] {
        assert_eq!(
            said(array.idle(time_s)),
            format!("`time_s` = {time_s} is outside [0, 86400] s")
        );
    }
    let late = Clock {
        sample_delay_s: 14e-6,
        ..CLOCK
    };
    let needed = "`sample_delay_s` = 0.000014 is outside [0, 1/edge_hz) in whole ticks of 50 ns";
    assert_eq!(said(array.clock(late, &mut [0; 3])), needed);
}

/// Edges run on while one cell after another is seeded anew. The others never miss one, and the new sequence of each
/// starts at one of the edges that come during its write.
#[test]
fn cells_can_be_seeded_while_clocked() {
    const CELLS: usize = 20;
    let (mut array, mut cells) = seeded(CELLS, CellMode::Analog);
    array.run_clock(CLOCK).unwrap();
    for (k, seed) in (0..CELLS).zip(200..) {
        // other phases of edge and bus for each cell
        array.idle(1e-3 + 0.7e-6 * k as f64).unwrap();
        let codes = array.codes();
        assert_eq!(codes, expected(&mut cells, codes.len() / CELLS));
        let pair = CellMode::Analog.pair(seed);
        array.write(cells[k].address(), &pair).unwrap();
        let codes = array.codes();
        let rows = codes.len() / CELLS;
        // three bytes, 27 bits and more at 2.5 µs a bit, an edge every 13.9 µs
        assert!(rows >= 4, "only {rows} edges came during a write");
        let seeded_at = |taken: usize| {
            let mut trial = cells.clone();
            let mut all = expected(&mut trial, taken);
            trial[k].receive(&pair);
            all.extend(expected(&mut trial, rows - taken));
            (all == codes).then_some(trial)
        };
        cells = (0..=rows)
            .rev()
            .find_map(seeded_at)
            .expect("a place of the seed that explains the codes");
    }
    array.stop_clock();
    let codes = array.codes();
    assert_eq!(codes, expected(&mut cells, codes.len() / CELLS));
    assert_agrees(&mut array, &mut cells);
}

/// The read-back tells a cell that lost its seed, and the cell does not drive until it has a new one.
#[test]
fn a_brown_out_while_clocked_silences_one_cell() {
    let (mut array, mut cells) = seeded(10, CellMode::Binary);
    assert_eq!(clocked(&mut array, 5), expected(&mut cells, 5));
    array.cell_mut(12).unwrap().reset(ResetCause::BrownOut);
    cells[4] = Cell::new(12).unwrap();
    let codes = clocked(&mut array, 500);
    assert_eq!(codes, expected(&mut cells, 500));
    assert!(codes.iter().skip(4).step_by(10).all(|code| *code == NEUTRAL_CODE));
    assert_eq!(state(&mut array, 12)[0], 0xff);
    assert_agrees(&mut array, &mut cells);
    array.write(12, &CellMode::Binary.pair(12)).unwrap();
    cells[4].receive(&CellMode::Binary.pair(12));
    assert_agrees(&mut array, &mut cells);
}

/// A sleeping cell: wake-up 5, response 3, jump at the vector 2, store 2. No mode is slower than another.
#[test]
fn the_dac_is_written_twelve_ticks_behind_each_edge() {
    for mode in MODES {
        let (array, _) = seeded(1, mode);
        let mut cell = array.cells()[0].clone();
        for k in 0..300 {
            cell.run_until(cell.now() + 278);
            let edge = cell.now();
            assert!(cell.is_asleep());
            cell.set_clock(k % 2 == 0);
            cell.run_until(edge + 100);
            assert_eq!(cell.dac_written_at(), edge + 12, "{mode:?}, edge {k}");
        }
    }
}

/// At a million edges a second two and more come before a cell clears its flag: it takes fewer steps than there were
/// edges, stays behind, and a new seed brings it back.
#[test]
fn edges_too_close_collapse_and_a_seed_repairs() {
    const EDGES: usize = 200;
    let (mut array, mut cells) = seeded(3, CellMode::Analog);
    let rush = Clock {
        edge_hz: 1e6,
        sample_delay_s: 0.0,
    };
    array.clock(rush, &mut vec![0; 3 * EDGES]).unwrap();
    let reached = state(&mut array, 9);
    let steps = (0..EDGES).position(|_| {
        cells[1].edge();
        spec_state(&cells[1])[..5] == reached[..5]
    });
    // some 65 cycles an edge against 20 a period: more than a quarter and less than half of the edges are seen
    let steps = steps.expect("the cell is on its own sequence") + 1;
    assert!((EDGES / 4..EDGES / 2).contains(&steps), "{steps} of {EDGES}");
    array.start(CellMode::Analog).unwrap();
    for cell in &mut cells {
        cell.receive(&CellMode::Analog.pair(cell.address()));
    }
    assert_agrees(&mut array, &mut cells);
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let (mut array, _) = seeded(37, CellMode::Binary);
            let mut codes = clocked(&mut array, 100);
            array.run_clock(CLOCK).unwrap();
            array.write(20, &CellMode::Analog.pair(3)).unwrap();
            codes.extend(array.codes());
            (codes, array.instructions(), state(&mut array, 20))
        })
    };
    let one = run(1);
    for threads in [2, 3, 8] {
        assert!(run(threads) == one, "{threads} threads");
    }
}

/// A clone taken anywhere, also while clocked, goes on like the original.
#[test]
fn snapshots_go_on_identically() {
    let (mut array, _) = seeded(9, CellMode::Analog);
    array.run_clock(CLOCK).unwrap();
    array
        .transact(&[BusEvent::Start, BusEvent::Write(9 << 1), BusEvent::Write(2)])
        .unwrap();
    let mut snapshot = array.clone();
    let go_on = |array: &mut Array| {
        let rest = [BusEvent::Write(80), BusEvent::Stop];
        let replies = array.transact(&rest).unwrap();
        array.idle(3e-3).unwrap();
        (replies, array.codes(), array.instructions(), state(array, 9))
    };
    assert_eq!(go_on(&mut array), go_on(&mut snapshot));
}

/// Blocks of any size are one clock: codes do not depend on how often they are fetched.
#[test]
fn blocks_continue_without_a_gap() {
    let (mut whole, mut cells) = seeded(5, CellMode::Binary);
    let mut blocks = whole.clone();
    let all = clocked(&mut whole, 1000);
    assert_eq!(all, expected(&mut cells, 1000));
    let pieces: Vec<u8> = [1, 2, 0, 97, 900]
        .into_iter()
        .flat_map(|n| clocked(&mut blocks, n))
        .collect();
    assert_eq!(pieces, all);
    assert_eq!(whole.instructions(), blocks.instructions());
}
