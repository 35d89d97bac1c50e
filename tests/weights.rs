//! The weights that the circuit model assumes are the ones that the cells put out.

use spts_circuit::{Seeding, WeightMode, Weights};
use spts_firmware::{Array, CellMode, Clock, Image};

/// Drive level of a DAC code: (code − 127.5)/127.5, except that the raster's mid-scale code counts as 0.
fn level(mode: CellMode, code: u8) -> f64 {
    match (mode, code) {
        (CellMode::Raster, spts_firmware::NEUTRAL_CODE) => 0.0,
        _ => (f64::from(code) - 127.5) / 127.5,
    }
}

#[test]
fn weights_equal_the_cells_output_bit_for_bit() {
    const EDGES: u64 = 10_000;
    for (weight_mode, cell_mode) in [
        (WeightMode::Raster, CellMode::Raster),
        (WeightMode::Analog, CellMode::Analog),
        (WeightMode::Binary, CellMode::Binary),
    ] {
        let mut array = Array::new(100, &Image::shipped()).unwrap();
        array.start(cell_mode).unwrap();
        let weights = Weights::new(weight_mode, Seeding::Address, 100);
        let (mut codes, mut row) = ([0; 100], [0.0; 100]);
        for edge in 0..EDGES {
            array.clock(Clock::default(), &mut codes).unwrap();
            weights.fill_rows(edge, &mut row);
            for (k, (code, w)) in codes.iter().zip(&row).enumerate() {
                let expected = level(cell_mode, *code);
                assert_eq!(w.to_bits(), expected.to_bits(), "{cell_mode:?}, edge {edge}, taxel {k}: {w} ≠ {expected}");
            }
        }
    }
}

/// A cell loaded with another seed byte puts out what the circuit's fault model says.
#[test]
fn a_mis_seeded_cell_is_the_fault_model_s() {
    let mut array = Array::new(100, &Image::shipped()).unwrap();
    array.start(CellMode::Binary).unwrap();
    array.write(64, &[CellMode::Binary.byte(), 2]).unwrap();
    let weights = Weights::new(WeightMode::Binary, Seeding::Address, 100);
    let mut codes = [0; 100];
    for edge in 0..1000 {
        array.clock(Clock::default(), &mut codes).unwrap();
        let expected = weights.mode().level_from_seed(2, edge);
        assert_eq!(level(CellMode::Binary, codes[56]).to_bits(), expected.to_bits(), "edge {edge}");
    }
}
