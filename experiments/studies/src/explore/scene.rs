//! Contacts at random places of a large skin, and their places in an image.

use rand::RngExt as _;
use spts_models::Streams;
use spts_recon::metrics::{SUPPORT_THRESHOLD, support};

/// Taxels to one contact: 40 contacts on 480 × 480 taxels.
const TAXELS_PER_CONTACT: usize = 5760;
/// Contacts of a small skin.
const FEWEST_CONTACTS: usize = 2;
/// Radius of a contact, taxels; at most a quarter of the skin's side.
const RADIUS_TAXELS: std::ops::Range<f64> = 1.0..4.0;
/// Conductance in the middle of a contact over that of a pressed taxel.
const PEAK: std::ops::Range<f64> = 0.5..1.0;

/// A pressed skin.
#[derive(Debug, Clone)]
pub(crate) struct ExploreScene {
    /// Conductance minus that of the idle skin, S, row-major, `side` × `side`.
    pub(crate) image_s: Vec<f64>,
    /// Contacts.
    pub(crate) contacts: usize,
}

/// Half-ellipsoids of conductance, G = peak·√(1 − d²/R²), with radius, peak and place uniform at random; where two
/// overlap the larger conductance counts. `pressed_s` is the largest peak there can be, S.
pub(super) fn scene(side: usize, pressed_s: f64, streams: Streams, index: u64) -> ExploreScene {
    let mut rng = streams.rng("explore/scene", index);
    let mut image_s = vec![0.0_f64; side * side];
    let contacts = (side * side / TAXELS_PER_CONTACT).max(FEWEST_CONTACTS);
    let most = RADIUS_TAXELS.end.min(0.25 * side as f64).max(1.5);
    for _ in 0..contacts {
        let middle: [f64; 2] = std::array::from_fn(|_| rng.random_range(0.0..=(side - 1) as f64));
        let radius = rng.random_range(RADIUS_TAXELS.start..most);
        let peak_s = pressed_s * rng.random_range(PEAK);
        for (k, v) in image_s.iter_mut().enumerate() {
            let square = ((k / side) as f64 - middle[0]).powi(2) + ((k % side) as f64 - middle[1]).powi(2);
            *v = v.max(peak_s * (1.0 - square / (radius * radius)).max(0.0).sqrt());
        }
    }
    ExploreScene { image_s, contacts }
}

/// Centres of mass, (row, column), of the connected patches of an image above the threshold of the support; neighbours
/// touch at a side or a corner.
pub(super) fn patches(image: &[f64], side: usize) -> Vec<(f64, f64)> {
    let mut open = Vec::new();
    support(image, SUPPORT_THRESHOLD, &mut open);
    let (mut centres, mut stack) = (Vec::new(), Vec::new());
    for first in 0..image.len() {
        if !open[first] {
            continue;
        }
        open[first] = false;
        stack.push(first);
        let (mut sum, mut row, mut col) = (0.0, 0.0, 0.0);
        while let Some(k) = stack.pop() {
            let (r, c) = (k / side, k % side);
            sum += image[k];
            row += image[k] * r as f64;
            col += image[k] * c as f64;
            for r in r.saturating_sub(1)..=(r + 1).min(side - 1) {
                for c in c.saturating_sub(1)..=(c + 1).min(side - 1) {
                    if std::mem::take(&mut open[r * side + c]) {
                        stack.push(r * side + c);
                    }
                }
            }
        }
        centres.push((row / sum, col / sum));
    }
    centres
}

/// Share of the patches of `truth` with one of `found` less than a taxel away; 1 without patches.
pub(super) fn located(found: &[f64], truth: &[f64], side: usize) -> f64 {
    let (found, truth) = (patches(found, side), patches(truth, side));
    let near = |t: &&(f64, f64)| found.iter().any(|f| (f.0 - t.0).hypot(f.1 - t.1) < 1.0);
    if truth.is_empty() {
        return 1.0;
    }
    truth.iter().filter(near).count() as f64 / truth.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patches_are_counted_by_hand() {
        let mut image = vec![0.0; 25];
        for (k, v) in [(0, 1.0), (6, 1.0), (19, 3.0), (24, 1.0), (12, 0.1)] {
            image[k] = v;
        }
        let found = patches(&image, 5);
        // (0, 0) and (1, 1) touch at a corner; (3, 4) weighs three times as much as (4, 4); 0.1 is below .23 · 3
        assert_eq!(found.len(), 2);
        assert!((found[0].0 - 0.5).abs() + (found[0].1 - 0.5).abs() < 1e-15);
        assert!((found[1].0 - 3.25).abs() + (found[1].1 - 4.0).abs() < 1e-15);
        assert!((located(&image, &image, 5) - 1.0).abs() < 1e-15);
        assert!(located(&[0.0; 25], &image, 5).abs() < 1e-15);
    }

    #[test]
    fn scenes_follow_from_their_seed() {
        let (a, b) = (scene(96, 1e-4, Streams::new(3), 0), scene(96, 1e-4, Streams::new(3), 1));
        assert_eq!(a.contacts, 2);
        assert!(a.image_s == scene(96, 1e-4, Streams::new(3), 0).image_s && a.image_s != b.image_s);
        assert!(a.image_s.iter().all(|v| (0.0..=1e-4).contains(v)));
    }
}
