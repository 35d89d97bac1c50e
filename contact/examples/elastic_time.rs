//! Times one contact of a rigid shape with an elastic body, cold, on one thread, and prints it as a line of JSON.
//!
//! ```text
//! elastic_time --model half_space|layer --shape sphere|paraboloid|punch|cone --cells N --length-m L --force-n F
//!              --modulus-pa E --poisson NU [--thickness-m H] [--radius-m R] [--slope S] --tolerance T --repeats R
//!              [--dump FILE]
//! ```
//!
//! The dump holds the pressure, Pa, as N × N little-endian 64-bit floats in row-major order.

use spts_contact::{ElasticKernel, ElasticSolver};
use std::collections::HashMap;
use std::error::Error;
use std::io::Write as _;
use std::time::Instant;

type Options = HashMap<String, String>;

fn number(options: &Options, name: &str, default: Option<f64>) -> Result<f64, Box<dyn Error>> {
    match options.get(name) {
        Some(text) => text
            .parse()
            .map_err(|_| format!("--{name} {text}: not a number").into()),
        None => default.ok_or_else(|| format!("--{name} is missing").into()),
    }
}

/// Height of the shape at the distance `r` from its axis, m.
fn height_m(options: &Options, r: f64) -> Result<f64, Box<dyn Error>> {
    let shape = options.get("shape").map_or("sphere", String::as_str);
    let radius_m = number(options, "radius-m", Some(if shape == "punch" { 0.01 } else { 0.0334 }))?;
    match shape {
        "sphere" if r > radius_m => Ok(f64::INFINITY),
        "sphere" => Ok(radius_m - (radius_m * radius_m - r * r).sqrt()),
        "paraboloid" => Ok(r * r / (2.0 * radius_m)),
        "punch" => Ok(if r <= radius_m { 0.0 } else { f64::INFINITY }),
        "cone" => Ok(r * number(options, "slope", Some(0.2))?),
        other => Err(format!("--shape {other}: not sphere, paraboloid, punch or cone").into()),
    }
}

/// Every option, each with one value.
const KNOWN: [&str; 13] = [
    "model",
    "shape",
    "cells",
    "length-m",
    "force-n",
    "modulus-pa",
    "poisson",
    "thickness-m",
    "radius-m",
    "slope",
    "tolerance",
    "repeats",
    "dump",
];

fn parse(arguments: &[String]) -> Result<Options, Box<dyn Error>> {
    let mut options = Options::new();
    for pair in arguments.chunks(2) {
        let name = pair[0].strip_prefix("--").filter(|name| KNOWN.contains(name));
        let name = name.ok_or_else(|| format!("{}: not one of --{}", pair[0], KNOWN.join(", --")))?;
        let value = pair.get(1).ok_or_else(|| format!("--{name} needs a value"))?;
        if options.insert(name.to_owned(), value.clone()).is_some() {
            return Err(format!("--{name} is given twice").into());
        }
    }
    Ok(options)
}

fn count(options: &Options, name: &str, default: usize) -> Result<usize, Box<dyn Error>> {
    let Some(text) = options.get(name) else {
        return Ok(default);
    };
    match text.parse() {
        Ok(number) if (1..=4096).contains(&number) => Ok(number),
        _ => Err(format!("--{name} {text}: not a whole number in [1, 4096]").into()),
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let options = parse(&arguments)?;
    let modulus_pa = number(&options, "modulus-pa", Some(150e3))?;
    let poisson = number(&options, "poisson", Some(0.2))?;
    let kernel = match options.get("model").map(String::as_str) {
        Some("layer") => ElasticKernel::Layer {
            modulus_pa,
            poisson,
            thickness_m: number(&options, "thickness-m", None)?,
        },
        Some("half_space") | None => ElasticKernel::HalfSpace { modulus_pa, poisson },
        Some(other) => return Err(format!("--model {other}: not half_space or layer").into()),
    };
    let cells = count(&options, "cells", 64)?;
    let repeats = count(&options, "repeats", 5)?;
    let length_m = number(&options, "length-m", Some(0.045))?;
    let force_n = number(&options, "force-n", Some(20.0))?;
    let tolerance = number(&options, "tolerance", Some(1e-7))?;
    let (cell_m, middle) = (length_m / cells as f64, 0.5 * (cells as f64 - 1.0));
    let mut heights = Vec::with_capacity(cells * cells);
    for i in 0..cells * cells {
        let [x, y] = [i % cells, i / cells].map(|k| (k as f64 - middle) * cell_m);
        heights.push(height_m(&options, x.hypot(y))?);
    }
    let start = Instant::now();
    let mut solver = ElasticSolver::new(kernel, [cells, cells], cell_m);
    let build_s = start.elapsed().as_secs_f64();
    // plans and operators are made by the first solution
    let mut outcome = solver.press(&heights, force_n, tolerance);
    let mut times = Vec::with_capacity(repeats);
    for _ in 0..repeats {
        let start = Instant::now();
        outcome = solver.press(&heights, force_n, tolerance);
        times.push(start.elapsed().as_secs_f64());
    }
    times.sort_by(f64::total_cmp);
    let pressure = solver.pressure_pa();
    if let Some(path) = options.get("dump") {
        let bytes: Vec<u8> = pressure.iter().flat_map(|p| p.to_le_bytes()).collect();
        std::fs::write(path, bytes)?;
    }
    let peak_pa = pressure.iter().copied().fold(0.0, f64::max);
    let carried_n = pressure.iter().sum::<f64>() * cell_m * cell_m;
    writeln!(
        std::io::stdout(),
        "{{\"seconds\": {:e}, \"best_seconds\": {:e}, \"build_seconds\": {build_s:e}, \"iterations\": {}, \"convolutions\": {}, \
         \"converged\": {}, \"force_n\": {carried_n}, \"peak_pa\": {peak_pa}, \"approach_m\": {}}}",
        times[times.len() / 2],
        times[0],
        outcome.iterations,
        outcome.convolutions,
        outcome.converged,
        outcome.approach_m,
    )?;
    Ok(())
}
