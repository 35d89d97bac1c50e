//! Solves one contact of a rigid shape with an elastic half-space, cold, on one thread, a number of times.
//!
//! ```text
//! elastic_time SHAPE CELLS LENGTH_M FORCE_N MODULUS_PA POISSON TOLERANCE REPEATS [DUMP]
//! ```
//!
//! SHAPE is `sphere` (radius 33.4 mm) or `punch` (radius 10 mm). The file DUMP gets the pressure, Pa, as CELLS × CELLS
//! little-endian 64-bit floats in row-major order.

use spts_contact::{ElasticKernel, ElasticSolver};
use std::error::Error;

/// Height of the shape at the distance `r` from its axis, m.
fn height_m(shape: &str, r: f64) -> f64 {
    match shape {
        "sphere" if r <= 0.0334 => 0.0334 - (0.0334_f64 * 0.0334 - r * r).sqrt(),
        "punch" if r <= 0.01 => 0.0,
        _ => f64::INFINITY,
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [shape, cells, numbers @ .., repeats] = &arguments[..arguments.len().min(8)] else {
        return Err("SHAPE CELLS LENGTH_M FORCE_N MODULUS_PA POISSON TOLERANCE REPEATS are needed".into());
    };
    let (cells, repeats): (usize, usize) = (cells.parse()?, repeats.parse()?);
    let numbers = numbers.iter().map(|text| text.parse()).collect::<Result<Vec<f64>, _>>()?;
    let [length_m, force_n, modulus_pa, poisson, tolerance] = numbers[..] else {
        return Err("five numbers are needed between CELLS and REPEATS".into());
    };
    let (cell_m, middle) = (length_m / cells as f64, 0.5 * (cells as f64 - 1.0));
    let at = |i: usize| (i as f64 - middle) * cell_m;
    let heights = (0..cells * cells).map(|i| height_m(shape, at(i % cells).hypot(at(i / cells))));
    let heights: Vec<f64> = heights.collect();
    let kernel = ElasticKernel::HalfSpace { modulus_pa, poisson };
    let mut solver = ElasticSolver::new(kernel, [cells, cells], cell_m);
    // plans and operators are made by the first solution
    for _ in 0..=repeats {
        solver.press(&heights, force_n, tolerance);
    }
    if let Some(path) = arguments.get(8) {
        let bytes: Vec<u8> = solver.pressure_pa().iter().flat_map(|p| p.to_le_bytes()).collect();
        std::fs::write(path, bytes)?;
    }
    Ok(())
}
