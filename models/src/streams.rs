//! Seeded random streams.

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

/// Source of independent random generators. A generator depends only on (root seed, label, item index), so results do
/// not depend on threads or on the order of evaluation.
///
/// ```
/// use rand::RngExt as _;
/// use spts_models::Streams;
///
/// let streams = Streams::new(7);
/// let draw = |label, index| streams.rng(label, index).random::<u64>();
/// assert_eq!(draw("pose", 3), draw("pose", 3));
/// assert_ne!(draw("pose", 3), draw("pose", 4));
/// assert_ne!(draw("pose", 3), draw("noise", 3));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Streams {
    root: u64,
}

impl Streams {
    /// The streams of the root seed `root`.
    pub fn new(root: u64) -> Self {
        Self { root }
    }

    /// The root seed.
    pub(crate) fn root_mut(&mut self) -> &mut u64 {
        &mut self.root
    }

    /// The streams of item `index` for the purpose `label`, such as one session of many.
    pub fn child(self, label: &str, index: u64) -> Self {
        Self::new(self.rng(label, index).random())
    }

    /// A number in [0, 1) for a pair of items, far cheaper than a generator: SplitMix64 (G. L. Steele, D. Lea, C. H.
    /// Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014), from the root on.
    pub fn uniform(self, items: [u64; 2]) -> f64 {
        let bits = items.into_iter().fold(self.root, |z, item| {
            let z = z.wrapping_add(0x9e37_79b9_7f4a_7c15).wrapping_add(item);
            let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            z ^ (z >> 31)
        });
        (bits >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// The generator of item `index` for the purpose `label`.
    pub fn rng(self, label: &str, index: u64) -> ChaCha8Rng {
        // FNV-1a: stable across releases, unlike the standard library's hasher
        let key = label
            .bytes()
            .fold(0xcbf2_9ce4_8422_2325_u64, |h, b| (h ^ u64::from(b)).wrapping_mul(0x0000_0100_0000_01b3));
        let mut seed = [0; 32];
        seed[..8].copy_from_slice(&self.root.to_le_bytes());
        seed[8..16].copy_from_slice(&key.to_le_bytes());
        let mut rng = ChaCha8Rng::from_seed(seed);
        rng.set_stream(index);
        rng
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean, variance and correlation of neighbours, each within five standard deviations of n independent numbers.
    #[test]
    fn pairs_are_uniform() {
        let streams = Streams::new(5).child("pairs", 0);
        let drawn: Vec<f64> = (0..400).flat_map(|a| (0..250).map(move |b| streams.uniform([a, b]) - 0.5)).collect();
        let n = drawn.len() as f64;
        let mean = |of: &dyn Fn(usize) -> f64| (0..drawn.len()).map(of).sum::<f64>() / n;
        assert!(mean(&|k| drawn[k]).abs() < 5.0 / (12.0 * n).sqrt());
        assert!((mean(&|k| drawn[k] * drawn[k]) - 1.0 / 12.0).abs() < 5.0 / (180.0 * n).sqrt());
        for step in [1, 250] {
            let next = |k: usize| drawn[k] * drawn[(k + step) % drawn.len()];
            assert!(mean(&next).abs() < 5.0 / (144.0 * n).sqrt(), "{step}");
        }
    }

    #[test]
    fn streams_differ_by_root_label_and_index_and_by_nothing_else() {
        let first = |streams: Streams, label, index| streams.rng(label, index).random::<u64>();
        let a = Streams::new(1);
        let all = [
            first(a, "x", 0),
            first(a, "x", 1),
            first(a, "y", 0),
            first(Streams::new(2), "x", 0),
            first(a.child("x", 0), "x", 0),
            first(a.child("x", 1), "x", 0),
        ];
        for (i, v) in all.iter().enumerate() {
            assert!(!all[..i].contains(v), "stream {i} repeats another one");
        }
        assert_eq!(a.child("x", 7), a.child("x", 7));
    }
}
