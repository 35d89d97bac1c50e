//! Seeded random streams.

use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;

/// Source of independent generators: a function of (root seed, label, item index) and of nothing else, so that results do
/// not depend on threads or on the order of evaluation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Streams {
    root: u64,
}

impl Streams {
    /// Streams below the root seed `root`.
    #[must_use]
    pub fn new(root: u64) -> Self {
        Self { root }
    }

    /// Root seed.
    #[must_use]
    pub fn root(self) -> u64 {
        self.root
    }

    /// Independent generator for item `index` of purpose `label`.
    #[must_use]
    pub fn rng(self, label: &str, index: u64) -> ChaCha8Rng {
        // FNV-1a: stable across releases, unlike the standard library's hasher
        let key = label.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |h, b| {
            (h ^ u64::from(b)).wrapping_mul(0x0000_0100_0000_01b3)
        });
        let mut seed = [0; 32];
        seed[..8].copy_from_slice(&self.root.to_le_bytes());
        seed[8..16].copy_from_slice(&key.to_le_bytes());
        let mut rng = ChaCha8Rng::from_seed(seed);
        rng.set_stream(index);
        rng
    }
}
