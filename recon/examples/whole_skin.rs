//! A skin of 480 × 480 taxels on one ideal wire, measured 5 % as often as it has taxels: speed of the products with ±1
//! weights that are never stored, and one recovery of many contacts. Prints a line of JSON.
//!
//! ```text
//! whole_skin [SIDE [CONTACTS [MEASUREMENTS [NOISE [SEED]]]]]
//! ```
//!
//! The scene: `CONTACTS` (40) half-ellipsoids of pressure, radius 1 to 4 taxels, peak 0.5 to 1, anywhere on `SIDE` ×
//! `SIDE` (480) taxels; where two overlap the larger pressure counts. `MEASUREMENTS` (5 % of the taxels) have Gaussian
//! noise of `NOISE` (0.06) of their standard deviation.

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use spts_recon::matrix_free::RegionPursuit;
use spts_recon::metrics::{SUPPORT_THRESHOLD, SupportScore, support};
use spts_recon::operator::{LinearOperator, SignGenerator, SignOperator};
use std::error::Error;
use std::io::Write as _;
use std::time::Instant;

/// Contacts at random places.
fn scene(side: usize, contacts: usize, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let mut image = vec![0.0_f64; side * side];
    for _ in 0..contacts {
        let [row, col] = [0; 2].map(|_| rng.random_range(0.0..side as f64));
        let (radius, peak) = (rng.random_range(1.0..4.0), rng.random_range(0.5..1.0));
        for (k, v) in image.iter_mut().enumerate() {
            let square = ((k / side) as f64 - row).powi(2) + ((k % side) as f64 - col).powi(2);
            *v = v.max(peak * (1.0 - square / (radius * radius)).max(0.0).sqrt());
        }
    }
    image
}

/// A standard normal number: the sum of twelve uniform ones less 6.
fn normal(rng: &mut ChaCha8Rng) -> f64 {
    (0..12).map(|_| rng.random_range(0.0..1.0)).sum::<f64>() - 6.0
}

/// Largest memory of the process so far, MB, where the system tells.
fn peak_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<f64>().ok()? / 1024.0)
}

/// Time that all threads of the process have computed, s, where the system tells: what a shared machine does not
/// falsify.
fn cpu_s() -> Option<f64> {
    let mut nanoseconds = 0.0;
    for task in std::fs::read_dir("/proc/self/task").ok()? {
        let text = std::fs::read_to_string(task.ok()?.path().join("schedstat")).ok()?;
        nanoseconds += text.split_whitespace().next()?.parse::<f64>().ok()?;
    }
    Some(nanoseconds * 1e-9)
}

/// Runs `work`; wall time and time of all threads, s.
fn timed<T>(work: impl FnOnce() -> T) -> (T, f64, Option<f64>) {
    let (time, before) = (Instant::now(), cpu_s());
    let out = work();
    let wall_s = time.elapsed().as_secs_f64();
    (out, wall_s, cpu_s().zip(before).map(|(after, before)| after - before))
}

/// Argument `i`, or what it is when it is not given.
fn number<T: std::str::FromStr>(arguments: &[String], i: usize, default: T) -> Result<T, T::Err> {
    arguments.get(i).map_or(Ok(default), |text| text.parse())
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (side, contacts) = (number(&arguments, 0, 480)?, number(&arguments, 1, 40)?);
    let n: usize = side * side;
    let (m, noise) = (number(&arguments, 2, n / 20)?, number(&arguments, 3, 0.06)?);
    let seed = number(&arguments, 4, 1)?;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let image = scene(side, contacts, &mut rng);
    let seeds = (0..n).map(|_| rng.random()).collect();
    let phi = SignOperator::new(SignGenerator::new(1_664_525, 1_013_904_223, 31)?, seeds, 0, m);

    let mut y = vec![0.0; m];
    let ((), apply_s, apply_cpu_s) = timed(|| phi.apply(&image, &mut y));
    let mut back = vec![0.0; n];
    let ((), adjoint_s, adjoint_cpu_s) = timed(|| phi.apply_adjoint(&y, &mut back));
    let length = image.iter().map(|v| v * v).sum::<f64>().sqrt();
    y.iter_mut().for_each(|v| *v += noise * length * normal(&mut rng));

    let (found, decode_s, decode_cpu_s) = timed(|| RegionPursuit::new(side, side).recover(&phi, &y, None));
    let found = found?;
    let (mut truth, mut mask) = (Vec::new(), Vec::new());
    support(&image, SUPPORT_THRESHOLD, &mut truth);
    support(&found.image, SUPPORT_THRESHOLD, &mut mask);
    let weights = (n * m) as f64;
    let report = serde_json::json!({
        "taxels": n, "measurements": m, "contacts": contacts, "pressed": truth.iter().filter(|v| **v).count(),
        "threads": rayon::current_num_threads(),
        "apply_weights_per_s": weights / apply_s, "adjoint_weights_per_s": weights / adjoint_s,
        "apply_weights_per_cpu_s": apply_cpu_s.map(|s| weights / s), "adjoint_weights_per_cpu_s": adjoint_cpu_s.map(|s| weights / s),
        "iou": SupportScore::new(&mask, &truth).iou, "rounds": found.rounds, "candidates": found.candidates,
        "iterations": found.descent.iterations, "gap": found.descent.gap,
        "residual_over_y": found.residual_norm / y.iter().map(|v| v * v).sum::<f64>().sqrt(),
        "decode_s": decode_s, "decode_cpu_s": decode_cpu_s, "operator_bytes": phi.bytes(), "recovery_bytes": found.bytes, "peak_mb": peak_mb(),
    });
    writeln!(std::io::stdout(), "{report}")?;
    Ok(())
}
