//! Learns a dictionary from a file of images on one thread and writes it; `scripts/oracles/dictionary_speed.py` times
//! it.
//!
//! ```text
//! dictionary_time IMAGES SETTINGS ATOMS SPARSITY SWEEPS SEED OUT
//! ```
//!
//! `IMAGES` holds little-endian 64-bit words: values N of an image, images W; W × N values (`f64`). `SETTINGS` is
//! `ksvd` for the published algorithm or `ksvd_fast` for [`Ksvd::fast`]. `OUT` receives the dictionary, N × ATOMS
//! values (`f64`, row-major).

use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use spts_recon::dictionary::Ksvd;
use std::error::Error;

fn read(path: &str) -> Result<Vec<Vec<f64>>, Box<dyn Error>> {
    let bytes = std::fs::read(path)?;
    let words = bytes.as_chunks::<8>().0;
    let (head, body) = words.split_first_chunk::<2>().ok_or("a head of two words is missing")?;
    let [n, w] = head.map(u64::from_le_bytes).map(usize::try_from);
    let (n, w) = (n?, w?);
    if body.len() != n * w || n == 0 {
        return Err(format!("{} words after the head, not {}", body.len(), n * w).into());
    }
    Ok(body
        .chunks_exact(n)
        .map(|image| image.iter().map(|b| f64::from_le_bytes(*b)).collect())
        .collect())
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [file, settings, atoms, sparsity, sweeps, seed, out] = arguments.as_slice() else {
        return Err("usage: dictionary_time IMAGES SETTINGS ATOMS SPARSITY SWEEPS SEED OUT".into());
    };
    let settings = match settings.as_str() {
        "ksvd" => Ksvd::default(),
        "ksvd_fast" => Ksvd::fast(),
        other => return Err(format!("SETTINGS = {other} is neither ksvd nor ksvd_fast").into()),
    };
    let images = read(file)?;
    let ksvd = Ksvd {
        n_components: atoms.parse()?,
        n_nonzero_coefs: sparsity.parse()?,
        n_iter: sweeps.parse()?,
        ..settings
    };
    let mut rng = ChaCha8Rng::seed_from_u64(seed.parse()?);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let dictionary = pool.install(|| ksvd.learn(&images, &mut rng))?;
    let bytes: Vec<u8> = dictionary
        .view()
        .values()
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    Ok(std::fs::write(out, bytes)?)
}
