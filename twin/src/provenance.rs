//! Provenance of a result, which every result file carries, and the machine, on which no result depends.

use serde::{Deserialize, Serialize};
use spts_sim::engine::MUJOCO_VERSION;

/// Everything on which a result depends. It is the same on every machine and for any number of threads.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Provenance {
    /// Root of every random number.
    pub seed: u64,
    /// Hash of the scene, see [`Scene::hash`](crate::scene::Scene::hash).
    pub scene_hash: String,
    /// Version of this package.
    pub version: String,
    /// Revision of the sources, with `-dirty` if they were changed afterwards; `unknown` outside a repository.
    pub git_revision: String,
    /// Version of MuJoCo that simulates scenes.
    pub mujoco_version: String,
}

impl Provenance {
    /// Provenance of a result computed from `seed` and the scene with hash `scene_hash`.
    pub fn new(seed: u64, scene_hash: String) -> Self {
        Self {
            seed,
            scene_hash,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            git_revision: env!("SPTS_BUILT_FROM").to_owned(),
            mujoco_version: MUJOCO_VERSION.to_owned(),
        }
    }
}

/// The machine and its threads; written only to files of timings.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Machine {
    /// Model of the processor; `unknown` if it cannot be read.
    pub cpu: String,
    /// Operating system and architecture.
    pub platform: String,
    /// Threads that were used.
    pub threads: usize,
}

impl Machine {
    /// The machine on which the program runs.
    pub fn here() -> Self {
        Self {
            cpu: cpu_model(),
            platform: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
            threads: rayon::current_num_threads(),
        }
    }
}

/// FNV-1a of `bytes` as 16 hexadecimal digits.
///
/// ```
/// use spts::provenance::{combined_hash, hash_text};
///
/// assert_eq!(hash_text(b"seed = 7").len(), 16);
/// let hashes = [hash_text(b"a"), hash_text(b"b")];
/// assert_ne!(combined_hash(&hashes), combined_hash(&[hashes[1].clone(), hashes[0].clone()]));
/// ```
pub fn hash_text(bytes: &[u8]) -> String {
    format!("{:016x}", fnv1a(bytes))
}

/// One hash for several scenes, in order.
pub fn combined_hash(hashes: &[String]) -> String {
    hash_text(hashes.concat().as_bytes())
}

/// 64-bit FNV-1a: stable across releases, unlike the standard library's hasher.
fn fnv1a(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3))
}

fn cpu_model() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = text.lines().find_map(|line| line.strip_prefix("model name"));
    model.map_or_else(|| "unknown".to_owned(), |rest| rest.trim_start_matches([' ', '\t', ':']).to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Test vectors of the FNV specification (draft-eastlake-fnv, appendix C).
    #[test]
    fn the_hash_is_the_published_one() {
        for (text, hash) in
            [("", 0xcbf2_9ce4_8422_2325), ("a", 0xaf63_dc4c_8601_ec8c), ("foobar", 0x8594_4171_f739_67e8)]
        {
            assert_eq!(fnv1a(text.as_bytes()), hash, "{text}");
        }
    }
}
