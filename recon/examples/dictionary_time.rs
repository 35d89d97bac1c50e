//! Learns a dictionary from a file of images on one thread and writes it; `scripts/oracles/dictionary_speed.py` times it.
//!
//! ```text
//! dictionary_time IMAGES LEARNER ATOMS SPARSITY ITERATIONS UPDATES SEED OUT
//! ```
//!
//! `IMAGES` holds little-endian 64-bit words: values N of an image, images W; W × N values (`f64`). `OUT` receives the dictionary, N × ATOMS
//! values (`f64`, row-major).

use spts_recon::dictionary::{Ksvd, Learner, RankOne};
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use std::error::Error;
use std::io::Write as _;
use std::time::Instant;

fn read(path: &str) -> Result<Vec<Vec<f64>>, Box<dyn Error>> {
    let bytes = std::fs::read(path)?;
    let words = bytes.as_chunks::<8>().0;
    let (head, body) = words.split_first_chunk::<2>().ok_or("a head of two words is missing")?;
    let [n, w] = head.map(u64::from_le_bytes).map(usize::try_from);
    let (n, w) = (n?, w?);
    if body.len() != n * w || n == 0 {
        return Err(format!("{} words after the head, not {}", body.len(), n * w).into());
    }
    Ok(body.chunks_exact(n).map(|image| image.iter().map(|b| f64::from_le_bytes(*b)).collect()).collect())
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [file, learner, atoms, sparsity, iterations, updates, seed, out] = arguments.as_slice() else {
        return Err("usage: dictionary_time IMAGES LEARNER ATOMS SPARSITY ITERATIONS UPDATES SEED OUT".into());
    };
    let images = read(file)?;
    let ksvd = Ksvd {
        n_components: atoms.parse()?,
        n_nonzero_coefs: sparsity.parse()?,
        n_iter: iterations.parse()?,
        n_updates: updates.parse()?,
        rank_one: if learner == "exact" { RankOne::Exact } else { RankOne::Approximate },
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let mut rng = ChaCha8Rng::seed_from_u64(seed.parse()?);
    let begin = Instant::now();
    let dictionary = pool.install(|| ksvd.learn(&images, &mut rng))?;
    let seconds = begin.elapsed().as_secs_f64();
    let bytes: Vec<u8> = dictionary.view().values().iter().flat_map(|v| v.to_le_bytes()).collect();
    std::fs::write(out, bytes)?;
    writeln!(std::io::stdout(), "{{\"seconds\": {seconds}}}")?;
    Ok(())
}
