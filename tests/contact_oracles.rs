//! The elastic contact solver against independent programs: values recorded in `oracles/` by `scripts/oracles/`.

use serde_json::Value;
use spts_contact::{ElasticKernel, ElasticSolver};

const SPHERE_RADIUS_M: f64 = 0.0334;
const PUNCH_RADIUS_M: f64 = 0.010;
/// (x, y, radius of curvature, height), m.
const BUMPS_M: [[f64; 4]; 2] = [[-9e-3, 4e-3, 20e-3, 0.0], [8e-3, -3e-3, 12e-3, 0.8e-3]];

fn record(text: &str) -> Value {
    serde_json::from_str(text).unwrap()
}

fn number(value: &Value, field: &str) -> f64 {
    value[field].as_f64().unwrap_or_else(|| panic!("no number {field}"))
}

fn count(value: &Value, field: &str) -> usize {
    usize::try_from(value[field].as_u64().unwrap()).unwrap()
}

/// Height of the shape over the cell centre (x, y), as in `scripts/oracles/shapes.py`.
fn height_m(shape: &str, x: f64, y: f64) -> f64 {
    let r = x.hypot(y);
    match shape {
        "sphere" => SPHERE_RADIUS_M - (SPHERE_RADIUS_M.powi(2) - r * r).sqrt(),
        "punch" if r <= PUNCH_RADIUS_M => 0.0,
        "punch" => f64::INFINITY,
        "two_bumps" => BUMPS_M
            .iter()
            .map(|[a, b, radius, up]| (x - a).hypot(y - b).powi(2) / (2.0 * radius) + up)
            .fold(f64::INFINITY, f64::min),
        other => panic!("no shape {other}"),
    }
}

/// Heights over `finer` × `finer` parts of each cell; the punch keeps the cells' staircase, so that it is the same
/// punch.
fn heights_m(shape: &str, cells: usize, length_m: f64, finer: usize) -> Vec<f64> {
    let float = |i: usize| f64::from(u32::try_from(i).unwrap());
    let parts = if shape == "punch" { 1 } else { finer };
    let part_m = length_m / float(cells * parts);
    let at = |i: usize| (float(i * parts / finer) + 0.5) * part_m - 0.5 * length_m;
    let width = cells * finer;
    let all = (0..width * width).map(|i| height_m(shape, at(i % width), at(i / width)));
    all.collect()
}

/// Our answer to one recorded solution.
struct Answer {
    approach_m: f64,
    force_n: f64,
    peak_pa: f64,
    contact_cells: usize,
    sample_pa: Vec<f64>,
}

/// Solves on the recorded grid with each cell in `finer` × `finer` parts, and averages over the cells.
fn solve(kernel: ElasticKernel, record: &Value, solution: &Value, finer: usize) -> Answer {
    let (cells, length_m) = (count(record, "cells"), number(record, "length_m"));
    let parts = f64::from(u32::try_from(finer).unwrap());
    let cell_m = length_m / number(record, "cells");
    let heights = heights_m(solution["shape"].as_str().unwrap(), cells, length_m, finer);
    let width = cells * finer;
    let mut solver = ElasticSolver::new(kernel, [width, width], cell_m / parts);
    let outcome = solver.press(&heights, number(record, "force_n"), TOLERANCE);
    assert!(outcome.converged);
    let mut pressure = vec![0.0; cells * cells];
    for (i, p) in solver.pressure_pa().iter().enumerate() {
        pressure[i / width / finer * cells + i % width / finer] += p / (parts * parts);
    }
    let stride = count(solution, "stride");
    let picked = (stride / 2..cells).step_by(stride);
    Answer {
        approach_m: outcome.approach_m,
        force_n: pressure.iter().sum::<f64>() * cell_m * cell_m,
        peak_pa: pressure.iter().copied().fold(0.0, f64::max),
        contact_cells: pressure.iter().filter(|p| **p > 0.0).count(),
        sample_pa: picked
            .clone()
            .flat_map(|row| picked.clone().map(move |col| row * cells + col))
            .map(|i| pressure[i])
            .collect(),
    }
}

/// Accuracy asked of our solver; the recorded programs were asked for 1e-12.
const TOLERANCE: f64 = 1e-9;

/// Digits of the record: 7 of a pressure, at most the peak.
const ROUNDING: f64 = 5e-7;

fn sample_pa(solution: &Value) -> Vec<f64> {
    let values = solution["sample_pa"].as_array().unwrap();
    values.iter().map(|v| v.as_f64().unwrap()).collect()
}

fn relative(a: f64, b: f64) -> f64 {
    (a / b - 1.0).abs()
}

fn relative_rms(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let apart: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
    (apart / b.iter().map(|b| b * b).sum::<f64>()).sqrt()
}

/// Tamaas and aspher load cells uniformly and use Love's coefficients between the centres, as we do: one and the same
/// system of equations, so that only the tolerances and the rounding of the record are left.
#[test]
fn half_space_is_that_of_tamaas_and_aspher() {
    let record = record(include_str!("oracles/half_space.json"));
    let kernel =
        ElasticKernel::HalfSpace { modulus_pa: number(&record, "modulus_pa"), poisson: number(&record, "poisson") };
    let solutions = record["solutions"].as_array().unwrap();
    assert_eq!(solutions.len(), 6);
    for solution in solutions {
        let name = format!("{} {}", solution["program"], solution["shape"]);
        let ours = solve(kernel, &record, solution, 1);
        let slack = 100.0 * TOLERANCE;
        for (what, ours, theirs) in [
            ("force", ours.force_n, number(solution, "force_n")),
            ("approach", ours.approach_m, number(solution, "approach_m")),
            ("peak", ours.peak_pa, number(solution, "peak_pa")),
        ] {
            assert!(relative(ours, theirs) <= slack, "{name}: {what} {ours} for {theirs}");
        }
        assert_eq!(ours.contact_cells, count(solution, "contact_cells"), "{name}");
        for (ours_pa, theirs_pa) in ours.sample_pa.iter().zip(sample_pa(solution)) {
            let apart = (ours_pa - theirs_pa).abs() / ours.peak_pa;
            assert!(apart <= slack + ROUNDING, "{name}: {ours_pa} Pa for {theirs_pa} Pa");
        }
    }
}

/// ContactMechanics solves the same layer in Fourier space, its pressure being band-limited instead of constant in a
/// cell: the two meet as the cells shrink. It was recorded on our grid and on one of a quarter of the cell, averaged;
/// we solve on our grid and on one of half the cell. An error of first order, as at the punch's singular rim, or of a
/// higher one is at most the difference of our two answers in the finer of them, and at most a third of theirs in
/// theirs. The images of the periodic program are 16 h away, where the bonded layer's surface has come to rest to e⁻³⁰.
#[test]
fn layer_is_that_of_contact_mechanics() {
    let record = record(include_str!("oracles/layer.json"));
    let solutions = record["solutions"].as_array().unwrap();
    assert_eq!(solutions.len(), 8);
    for pair in solutions.chunks_exact(2) {
        let [coarse, fine] = pair else { unreachable!("chunks of two") };
        assert!(count(coarse, "finer") == 1 && count(fine, "finer") == 4);
        let name = format!("{} ν = {}", coarse["shape"], coarse["poisson"]);
        let kernel = ElasticKernel::Layer {
            modulus_pa: number(&record, "modulus_pa"),
            poisson: number(coarse, "poisson"),
            thickness_m: number(&record, "thickness_m"),
        };
        let [rough, ours] = [1, 2].map(|finer| solve(kernel, &record, coarse, finer));
        assert!(relative(ours.force_n, number(fine, "force_n")) <= 100.0 * TOLERANCE, "{name}");
        let [their_rough_m, their_m] = [coarse, fine].map(|s| number(s, "approach_m"));
        let slack = relative(rough.approach_m, ours.approach_m) + relative(their_rough_m, their_m) / 3.0;
        let apart = relative(ours.approach_m, their_m);
        assert!(apart <= slack, "{name}: approach off by {apart:.2e}, allowed {slack:.2e}");
        let [their_rough_pa, their_pa] = [coarse, fine].map(sample_pa);
        let slack = relative_rms(&rough.sample_pa, &ours.sample_pa) + relative_rms(&their_rough_pa, &their_pa) / 3.0;
        let apart = relative_rms(&ours.sample_pa, &their_pa);
        assert!(apart <= slack, "{name}: pressure off by {apart:.2e}, allowed {slack:.2e}");
    }
}
