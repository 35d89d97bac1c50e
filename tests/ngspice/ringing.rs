//! Frequency and damping of a ringing, from its wave alone.

/// Frequency, Hz, and damping, 1/s, of `wave` after `from_s` about `settled_v`: from the times and sizes of its
/// extrema, as one reads them off an oscilloscope. Extrema below a thousandth of the first are left to rounding.
pub(crate) fn ringing(wave: &[(f64, f64)], from_s: f64, settled_v: f64) -> (f64, f64) {
    let mut extrema: Vec<(f64, f64)> = Vec::new();
    for w in wave.windows(3).filter(|w| w[0].0 > from_s) {
        let [(a, u), (b, v), (c, x)] = [w[0], w[1], w[2]].map(|(t, v)| (t, v - settled_v));
        if (v - u) * (x - v) <= 0.0 && v.abs() > 0.0 {
            // vertex of the parabola through the three points
            let (left, right) = ((v - u) / (b - a), (x - v) / (c - b));
            let bend = (right - left) / (c - a);
            if bend.abs() > 0.0 {
                let t = 0.5 * (a + b) - 0.5 * left / bend;
                extrema.push((t, u + left * (t - a) + bend * (t - a) * (t - b)));
            }
        }
    }
    let least_v = 1e-3 * extrema[0].1.abs();
    let end = extrema.iter().position(|(_, v)| v.abs() < least_v).unwrap_or(extrema.len());
    let (first, last) = (extrema[0], extrema[end - 1]);
    let half_turns = (end - 1) as f64;
    assert!(half_turns >= 1.0, "fewer than two extrema");
    let long_s = last.0 - first.0;
    (0.5 * half_turns / long_s, (first.1 / last.1).abs().ln() / long_s)
}
