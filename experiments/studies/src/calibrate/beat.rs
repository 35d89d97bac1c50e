//! Beat of a cell's timer with the common clock, found from its late flips.

/// The late updates of one cell come periodically, because the cell's millisecond timer beats with the measurement
/// clock: this is the period that was found.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Beat {
    /// Taxel, from 0.
    pub taxel: usize,
    /// Number of late flips used.
    pub events: usize,
    /// Period, measurements.
    pub period_measurements: f64,
    /// Power of the line at this period divided by the mean over all periods tried.
    pub prominence: f64,
}

/// Periods that are tried, measurements: a cell's 20 MHz may be off by 10 %, the rate between 50 and 80 kHz.
const PERIODS: (f64, f64) = (36.0, 73.0);
/// Step of the period: a press is about 300 periods long, so its line is 0.17 wide.
const STEP: f64 = 0.01;
/// A beat is believed when its line is this many times the mean, or more: flips of a pseudorandom sequence are not
/// quite at random.
const PROMINENCE: f64 = 6.0;
/// Chance that a cell without a beat shows one.
const FALSE_ALARM: f64 = 1e-3;
/// Fewest late flips a press that say anything about a period.
const FEWEST: usize = 4;

/// Beat of the cell of `taxel`, from its events of several presses; each press has a phase of its own.
pub(super) fn beat(taxel: usize, presses: &[Vec<u64>]) -> Option<Beat> {
    let presses: Vec<&Vec<u64>> = presses.iter().filter(|rows| rows.len() >= FEWEST).collect();
    if presses.len() < 2 {
        return None;
    }
    let events = presses.iter().map(|rows| rows.len()).sum();
    let (mut best, mut total, mut tried) = ((0.0, 0.0), 0.0, 0.0);
    let mut period = PERIODS.0;
    while period < PERIODS.1 {
        let power: f64 = presses.iter().map(|rows| line(rows, period)).sum();
        if power > best.1 {
            best = (period, power);
        }
        total += power;
        tried += 1.0;
        period += STEP;
    }
    let prominence = best.1 / (total / tried);
    let least = chance_prominence(presses.len(), FALSE_ALARM / tried).max(PROMINENCE);
    (prominence > least).then_some(Beat {
        taxel,
        events,
        period_measurements: best.0,
        prominence,
    })
}

/// Prominence that one period reaches with the given chance when the rows are random: the power of a press is then
/// exponential and the sum over `presses` of them, of mean `presses`, is beyond x with probability e⁻ˣ·Σ xᵏ/k!, k <
/// `presses` (Erlang).
fn chance_prominence(presses: usize, chance: f64) -> f64 {
    let n = presses as f64;
    let beyond = |x: f64| {
        let (mut term, mut sum, mut k) = (1.0, 0.0, 1.0);
        while k <= n {
            sum += term;
            term *= x / k;
            k += 1.0;
        }
        sum * (-x).exp()
    };
    // the power is beyond n + 60√n with a chance far below any that is asked for; 60 halvings leave no more than
    // rounding
    let (mut low, mut high) = (0.0, n + 60.0 * n.sqrt());
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if beyond(middle) > chance {
            low = middle;
        } else {
            high = middle;
        }
    }
    high / n
}

/// |Σ exp(2πi·row/period)|² / number of rows.
fn line(rows: &[u64], period: f64) -> f64 {
    let (mut re, mut im) = (0.0, 0.0);
    for row in rows {
        let angle = std::f64::consts::TAU * (row - rows[0]) as f64 / period;
        re += angle.cos();
        im += angle.sin();
    }
    (re * re + im * im) / rows.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_beat_is_found_among_stray_events() {
        // collisions at uneven numbers of periods of 52.47 (even ones would fit other periods too), and half as many
        // stray events
        #[expect(clippy::cast_possible_truncation, reason = "small rows")]
        let press = |phase: f64| -> Vec<u64> {
            let mut rows: Vec<u64> = (0..20)
                .map(|k| (phase + 52.47 * f64::from((7 * k * k + 3 * k) % 100)).ceil() as u64)
                .collect();
            rows.extend((0..10).map(|k| 97 + 577 * k * k % 5200));
            rows.sort_unstable();
            rows
        };
        let presses: Vec<Vec<u64>> = (0..8).map(|p| press(10.0 + 37.0 * f64::from(p))).collect();
        let beat = beat(3, &presses).unwrap();
        // 5200 measurements long: the line is 52.47²/5200 = 0.5 wide, its centre known ten times better
        assert!((beat.period_measurements - 52.47).abs() < 0.05, "{beat:?}");
        assert!(super::beat(3, &[vec![1, 2], vec![]]).is_none());
    }

    #[test]
    fn few_presses_must_show_a_clearer_beat() {
        // one press: e⁻ˣ; two: e⁻ˣ(1 + x). 60 halvings of at most 90 leave 1e-14
        assert!((chance_prominence(1, 1e-6) - 1e6_f64.ln()).abs() < 1e-12);
        let x = 2.0 * chance_prominence(2, 1e-7);
        assert!(((1.0 + x) * (-x).exp() / 1e-7 - 1.0).abs() < 1e-10);
    }
}
