//! Searches for better seeds: first whole sets, then exchanges of single seeds.

use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// A search for a set of seeds, one a taxel, whose rows have a low cost.
pub struct Exchange<'a, E> {
    /// Number of sets that are tried. Half of them are drawn as a whole; the others come from the best of these by
    /// exchanging one seed at a time.
    pub budget: usize,
    /// Computes the set of seeds for a salt.
    pub salted: &'a (dyn Fn(u32) -> Vec<u32> + Sync),
    /// Computes the cost of a set.
    pub cost: &'a (dyn Fn(&[u32]) -> Result<f64, E> + Sync),
}

/// The best set that `search` finds (`start` included), and its cost. Salts come from the first generator, exchanges
/// from the second. The result does not depend on the number of threads.
///
/// # Errors
/// The error of the cost.
pub fn exchange<E: Send>(
    search: &Exchange<'_, E>,
    start: Vec<u32>,
    [salts, exchanges]: [&mut ChaCha8Rng; 2],
) -> Result<(Vec<u32>, f64), E> {
    let cost = search.cost;
    let start = (cost(&start)?, start);
    let salts: Vec<u32> = (0..search.budget / 2).map(|_| salts.random()).collect();
    let salted = salts.par_iter().map(|&salt| {
        let set = (search.salted)(salt);
        Ok((cost(&set)?, set))
    });
    let salted: Vec<(f64, Vec<u32>)> = salted.collect::<Result<_, E>>()?;
    let (mut least, mut seeds) = salted.into_iter().fold(start, |a, b| if b.0 < a.0 { b } else { a });
    for _ in search.budget / 2..search.budget {
        let taxel = exchanges.random_range(0..seeds.len());
        let before = std::mem::replace(&mut seeds[taxel], exchanges.random());
        let next = cost(&seeds)?;
        if next < least {
            least = next;
        } else {
            seeds[taxel] = before;
        }
    }
    Ok((seeds, least))
}
