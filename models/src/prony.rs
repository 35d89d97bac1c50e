//! First-order relaxations in parallel.

use crate::config::{ConfigError, in_range, within};

/// Most branches a series may have.
const MAX_BRANCHES: usize = 32;
/// Longest time constant, s.
pub(crate) const MAX_TAU_S: f64 = 1e7;
/// Shortest time constant, s.
pub(crate) const MIN_TAU_S: f64 = 1e-6;

/// Prony series: branches sᵢ with time constants τᵢ and shares gᵢ that answer a target x(t) with
///
/// τᵢ dsᵢ/dt = x − sᵢ, and together with Σ gᵢ·sᵢ.
///
/// While x is constant the solution over a step is exact for every dt, sᵢ ← x + (sᵢ − x)·exp(−dt/τᵢ), so that a hold
/// does not depend on how it is cut: n steps differ from one by n roundings of 1e-16. Source: J. D. Ferry,
/// *Viscoelastic Properties of Polymers*, 3rd ed. (1980), ch. 1 (generalised Voigt model).
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Prony {
    shares: Vec<f64>,
    taus_s: Vec<f64>,
}

impl Prony {
    /// Series of `shares`, each in [0, 1], and as many time constants, each in [1e-6, 1e7] s; `table` is the name of
    /// both in messages. A negative share would neither keep the order of loads nor dissipate.
    ///
    /// # Errors
    /// [`ConfigError`] for a value outside its range, too many branches, or lists of different length.
    pub(crate) fn new(table: &str, shares: &[f64], taus_s: &[f64]) -> Result<Self, ConfigError> {
        let name = |field: &str| format!("{table}.{field}");
        let count = shares.len() as f64;
        in_range(&name("shares (length)"), count, shares.len() <= MAX_BRANCHES, "[0, 32]")?;
        let same = shares.len() == taus_s.len();
        in_range(
            &name("tau_s (length)"),
            taus_s.len() as f64,
            same,
            "the length of `shares`",
        )?;
        for share in shares {
            within(&name("shares"), *share, 0.0, 1.0, "[0, 1]")?;
        }
        for tau_s in taus_s {
            let ok = (MIN_TAU_S..=MAX_TAU_S).contains(tau_s);
            in_range(&name("tau_s"), *tau_s, ok, "[1e-6, 1e7]")?;
        }
        Ok(Self {
            shares: shares.to_vec(),
            taus_s: taus_s.to_vec(),
        })
    }

    /// Branches of share 1 with time constants `spacing` decades apart from `start_s` to `end_s`, which are valid.
    pub(crate) fn comb(start_s: f64, end_s: f64, spacing: f64) -> Self {
        let decades = (end_s / start_s).log10();
        let taus_s: Vec<f64> = (0_u32..)
            .map(|j| spacing * f64::from(j))
            .take_while(|d| *d <= decades + 1e-9)
            .map(|d| start_s * 10_f64.powf(d))
            .collect();
        Self {
            shares: vec![1.0; taus_s.len()],
            taus_s,
        }
    }

    /// Number of branches.
    pub(crate) fn len(&self) -> usize {
        self.taus_s.len()
    }

    /// Writes exp(−dt/τᵢ) of every branch.
    pub(crate) fn decays(&self, dt_s: f64, out: &mut [f64]) {
        for (out, tau_s) in out.iter_mut().zip(&self.taus_s) {
            *out = (-dt_s / tau_s).exp();
        }
    }

    /// Moves the branches over a step with these `decays` to `target`, and returns Σ gᵢ·sᵢ at its end.
    #[inline]
    pub(crate) fn relax(&self, target: f64, decays: &[f64], state: &mut [f64]) -> f64 {
        let mut sum = 0.0;
        for ((s, decay), share) in state.iter_mut().zip(decays).zip(&self.shares) {
            *s = target + (*s - target) * decay;
            sum += share * *s;
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use proptest::prelude::*;

    fn hold(series: &Prony, target: f64, dt_s: &[f64]) -> f64 {
        let (mut decays, mut state, mut sum) = (vec![0.0; series.len()], vec![0.0; series.len()], 0.0);
        for dt_s in dt_s {
            series.decays(*dt_s, &mut decays);
            sum = series.relax(target, &decays, &mut state);
        }
        sum
    }

    /// Σ gᵢ (1 − exp(−t/τᵢ)) from rest, the closed form; a few roundings.
    #[test]
    fn a_hold_is_the_prony_series() {
        let (g, tau_s) = ([0.10, 0.10, 0.05], [5e-3, 0.1, 3.0]);
        let series = Prony::new("x", &g, &tau_s).unwrap();
        for t in [1e-9_f64, 1e-3, 0.1, 10.0, 3600.0] {
            let expected: f64 = g.iter().zip(tau_s).map(|(g, tau)| -g * (-t / tau).exp_m1()).sum();
            // 1 − exp(−t/τ) for short t keeps the digits that t/τ leaves above a rounding of 1
            assert_relative_eq!(
                hold(&series, 1.0, &[t]),
                expected,
                epsilon = 1e-15,
                max_relative = 1e-14
            );
        }
    }

    proptest! {
        /// τ ds/dt = φ(P) − s, φ increasing, dissipates: ∮ P ds ≥ 0 over a closed cycle of holds. With P constant over
        /// a step, ∮ P ds = Σ P·Δs exactly. The cycle is run until the state repeats: τ is 1/30 of it at most, so that
        /// exp(−30·3) is left of the beginning.
        #[test]
        fn a_cycle_dissipates(
            tau_s in 1e-3..0.1_f64,
            cycle in prop::collection::vec((0.0..1e5_f64, 0.2..1.0_f64), 15..30),
        ) {
            let series = Prony::new("x", &[1.0], &[tau_s]).unwrap();
            let (mut state, mut decays) = ([0.0], [0.0]);
            let mut work = 0.0;
            for _ in 0..3 {
                work = 0.0;
                for (p, dt_s) in &cycle {
                    let before = state[0];
                    series.decays(*dt_s, &mut decays);
                    series.relax(p / (p + 200.0), &decays, &mut state);
                    work += p * (state[0] - before);
                }
            }
            // a rounding of each term, P·s ≤ 1e5
            prop_assert!(work >= -30.0 * 1e5 * f64::EPSILON, "{work}");
        }
    }
}
