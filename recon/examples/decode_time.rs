//! Decodes windows from a file many times on one thread and prints what it found as a line of JSON;
//! `scripts/oracles/decode_speed.py` times it.
//!
//! ```text
//! decode_time FILE MODE REPEATS
//! ```
//!
//! `FILE` holds little-endian 64-bit words: taxels N, atoms K, measurements M, sparsity S, windows W; the dictionary (N
//! × K, `f64`); W × M rows of ⌈N/64⌉ words of signs; W × M measurements (`f64`). `MODE`: `form` forms Φ·D from `f64`
//! tables, `form32` from `f32` tables; `decode` is what is left when the last sample arrives, Φ·D ready; `all` and
//! `all32` do both for every window.

use spts_recon::recover::Omp;
use spts_recon::{Matrix, MatrixView, Problem, Recover as _, SignTables, Solution, TableFloat, Workspace};
use std::error::Error;
use std::hint::black_box;
use std::io::Write as _;

struct Windows {
    m: usize,
    sparsity: usize,
    dictionary: Matrix,
    signs: Vec<u64>,
    y: Vec<f64>,
}

fn read(path: &str) -> Result<Windows, Box<dyn Error>> {
    let bytes = std::fs::read(path)?;
    let words: Vec<u64> = bytes.as_chunks::<8>().0.iter().map(|b| u64::from_le_bytes(*b)).collect();
    let (head, body) = words.split_first_chunk::<5>().ok_or("a head of five words is missing")?;
    let mut sizes = [0; 5];
    for (size, &word) in sizes.iter_mut().zip(head) {
        *size = usize::try_from(word)?;
    }
    let [n, k, m, sparsity, w] = sizes;
    let rows = w * m;
    let signs = rows * n.div_ceil(64);
    if body.len() != n * k + signs + rows {
        return Err(format!("{} words after the head, not {}", body.len(), n * k + signs + rows).into());
    }
    let floats = |words: &[u64]| -> Vec<f64> { words.iter().map(|&w| f64::from_bits(w)).collect() };
    Ok(Windows {
        m,
        sparsity,
        dictionary: Matrix::from_rows(n, k, floats(&body[..n * k]))?,
        signs: body[n * k..n * k + signs].to_vec(),
        y: floats(&body[n * k + signs..]),
    })
}

/// Runs `each` on the signs and measurements of every window and collects the supports.
fn run(
    windows: &Windows,
    mut each: impl FnMut(usize, &[u64], &[f64], &mut Solution) -> Result<(), Box<dyn Error>>,
) -> Result<Vec<Vec<usize>>, Box<dyn Error>> {
    let words = windows.m * windows.dictionary.nrows().div_ceil(64);
    let mut solution = Solution::default();
    let mut supports = Vec::with_capacity(windows.y.len() / windows.m);
    let signs = windows.signs.chunks_exact(words);
    for (index, (signs, y)) in signs.zip(windows.y.chunks_exact(windows.m)).enumerate() {
        each(index, black_box(signs), black_box(y), &mut solution)?;
        supports.push(black_box(&solution).support.clone());
    }
    Ok(supports)
}

/// Φ·D of every window, one after the other.
fn formed(windows: &Windows) -> Vec<f64> {
    let tables = SignTables::<f64>::new(windows.dictionary.view());
    let mut rows = vec![0.0; windows.y.len() * windows.dictionary.ncols()];
    tables.fill_rows(&windows.signs, &mut rows);
    rows
}

fn form_and<T: TableFloat>(windows: &Windows, repeats: usize, decode: bool) -> Result<Vec<Vec<usize>>, Box<dyn Error>> {
    let (m, k) = (windows.m, windows.dictionary.ncols());
    let tables = SignTables::<T>::new(windows.dictionary.view());
    let (mut rows, mut work, mut supports) = (vec![0.0; m * k], Workspace::default(), Vec::new());
    let pursuit = Omp::new(windows.sparsity);
    for _ in 0..repeats {
        supports = run(windows, |_, signs, y, solution| {
            tables.fill_rows(signs, &mut rows);
            if decode {
                let problem = Problem::new(MatrixView::new(m, k, &rows)?, y)?;
                pursuit.recover_into(&problem, &mut work, solution)?;
            } else {
                black_box(&rows);
            }
            Ok(())
        })?;
    }
    Ok(supports)
}

fn decode(windows: &Windows, repeats: usize) -> Result<Vec<Vec<usize>>, Box<dyn Error>> {
    let (m, k) = (windows.m, windows.dictionary.ncols());
    let (rows, pursuit) = (formed(windows), Omp::new(windows.sparsity));
    let (mut work, mut supports) = (Workspace::default(), Vec::new());
    for _ in 0..repeats {
        supports = run(windows, |index, _, y, solution| {
            let a = MatrixView::new(m, k, &rows[index * m * k..(index + 1) * m * k])?;
            Ok(pursuit.recover_into(&Problem::new(a, y)?, &mut work, solution)?)
        })?;
    }
    Ok(supports)
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [file, mode, repeats] = arguments.as_slice() else {
        return Err("usage: decode_time FILE MODE REPEATS".into());
    };
    let (windows, repeats) = (read(file)?, repeats.parse()?);
    let supports = match mode.as_str() {
        "form" => form_and::<f64>(&windows, repeats, false),
        "form32" => form_and::<f32>(&windows, repeats, false),
        "all" => form_and::<f64>(&windows, repeats, true),
        "all32" => form_and::<f32>(&windows, repeats, true),
        "decode" => decode(&windows, repeats),
        other => Err(format!("mode {other}: not form, form32, all, all32 or decode").into()),
    }?;
    writeln!(std::io::stdout(), "{{\"supports\": {supports:?}}}")?;
    Ok(())
}
