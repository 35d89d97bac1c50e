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
