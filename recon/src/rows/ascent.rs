//! Improves rows sign by sign.

use super::headroom::Headroom;

/// Worth of a row, kept up to date while single levels change.
pub(super) trait Worth {
    /// Takes `row` as it is.
    fn start(&mut self, row: &[f64]);
    /// The worth of the row.
    fn worth(&self) -> f64;
    /// Its worth after level i has changed by `delta`.
    fn after(&mut self, i: usize, delta: f64) -> f64;
    /// Changes level i by `delta`.
    fn change(&mut self, i: usize, delta: f64);
}

/// Least gain of worth, as a share of it, for which a level is changed: rounding makes no progress.
const LEAST_GAIN: f64 = 1e-9;

/// Turns single signs of `row` while its worth grows, at most `sweeps` times through all of them. A row whose sum is too
/// large is brought within `headroom` first, by the turns that cost the least worth for what they take off the sum;
/// `None` when that cannot be done.
pub(super) fn climb(
    worth: &mut dyn Worth,
    mut headroom: Option<&mut Headroom>,
    sweeps: usize,
    row: &mut [f64],
) -> Option<f64> {
    worth.start(row);
    if let Some(headroom) = headroom.as_deref_mut() {
        headroom.start(row);
        settle(worth, headroom, row)?;
    }
    for _ in 0..sweeps {
        let mut changed = false;
        for (i, value) in row.iter_mut().enumerate() {
            let (now, delta) = (worth.worth(), -2.0 * *value);
            if headroom.as_ref().is_some_and(|h| h.after(i, delta) > h.limit()) {
                continue;
            }
            if worth.after(i, delta) > now + LEAST_GAIN * now.abs() {
                worth.change(i, delta);
                if let Some(headroom) = headroom.as_deref_mut() {
                    headroom.change(i, delta);
                }
                *value = -*value;
                changed = true;
            }
        }
        if !changed {
            break;
        }
    }
    Some(worth.worth())
}

/// Brings `row` within `headroom`.
fn settle(worth: &mut dyn Worth, headroom: &mut Headroom, row: &mut [f64]) -> Option<()> {
    while !headroom.kept() {
        let now = worth.worth();
        let (mut least, mut best) = (f64::INFINITY, None);
        for (i, value) in row.iter().enumerate() {
            let delta = -2.0 * value;
            let taken = headroom.square() - headroom.after(i, delta);
            // less is rounding
            if taken <= LEAST_GAIN * headroom.square() {
                continue;
            }
            let cost = (now - worth.after(i, delta)) / taken;
            if cost < least {
                (least, best) = (cost, Some((i, delta)));
            }
        }
        let (i, delta) = best?;
        worth.change(i, delta);
        headroom.change(i, delta);
        row[i] += delta;
    }
    Some(())
}
