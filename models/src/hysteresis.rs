//! Rate-independent hysteresis.

use crate::config::{ConfigError, in_range, within};
use serde::Deserialize;

/// Most play operators a model may have.
const MAX_OPERATORS: usize = 32;

/// Prandtl–Ishlinskii superposition of generalised play operators that scale with the pressure.
///
/// Operator i follows y ← max(P, min(kᵢ·P, y)) with kᵢ ≥ 1. While the pressure rises, y equals P; while it falls, y
/// keeps its value until P has fallen by the factor kᵢ. The effective pressure is Σ wᵢ·yᵢ with equal weights wᵢ, and
/// the kᵢ are evenly spaced up to `width`. The loading branch is therefore the static law itself, unloading lies above
/// it, and the loop dissipates energy. At P = 0 the effective pressure is 0, as on the recorded skin, which reads zero
/// between presses. Play operators of a fixed width in pascal (P ± r) would not return to 0.
///
/// Passive: over a closed path that also closes the state, ∮ P dφ(y) ≥ 0 for the effective pressure y = Σ wᵢ·yᵢ and
/// every increasing φ, hence also for the conductance. Proof: y crosses any level downwards at a pressure no higher
/// than at the upward crossing before. Let m be the smallest pressure between the two crossings, and P_d the pressure
/// of the downward crossing. After m, no operator is below its value at m, and y(m) is not below the level. At P_d some
/// operator moves down along kᵢ·P; it is at kᵢ·P_d > kᵢ·m, which is higher than at m, unless P_d = m. So P_d = m, which
/// is not above the pressure of the upward crossing. Source: A. Visintin, *Differential Models of Hysteresis* (1994),
/// §III.2 (generalised play).
///
/// ```
/// use spts_models::{Hysteresis, HysteresisConfig};
///
/// let hysteresis = Hysteresis::try_from(HysteresisConfig::default())?;
/// let mut state = vec![0.0; hysteresis.operators()];
/// let loading_pa = hysteresis.respond(5e3, &mut state);
/// hysteresis.respond(10e3, &mut state);
/// let unloading_pa = hysteresis.respond(5e3, &mut state);
/// assert!(loading_pa == 5e3 && unloading_pa > 6e3);
/// assert!(hysteresis.respond(0.0, &mut state) == 0.0);
/// # Ok::<(), spts_models::ConfigError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, try_from = "HysteresisConfig")]
pub struct Hysteresis {
    factors: Vec<f64>,
}

/// Parameters of [`Hysteresis`].
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct HysteresisConfig {
    /// Number of play operators. Range [0, 32]; default 6. 0 switches hysteresis off.
    pub operators: usize,
    /// Largest kᵢ. Range [1, 10]; default 1.8: with the default law the loop is 12 % of full scale wide at half load
    /// (literature on Velostat: 10–20 %).
    pub width: f64,
}

impl Default for HysteresisConfig {
    fn default() -> Self {
        Self {
            operators: 6,
            width: 1.8,
        }
    }
}

impl TryFrom<HysteresisConfig> for Hysteresis {
    type Error = ConfigError;
    fn try_from(c: HysteresisConfig) -> Result<Self, ConfigError> {
        let n = c.operators as f64;
        in_range("hysteresis.operators", n, c.operators <= MAX_OPERATORS, "[0, 32]")?;
        within("hysteresis.width", c.width, 1.0, 10.0, "[1, 10]")?;
        let factors = (1..=c.operators)
            .map(|i| 1.0 + (c.width - 1.0) * i as f64 / n)
            .collect();
        Ok(Self { factors })
    }
}

impl Hysteresis {
    /// Number of state values a taxel.
    #[must_use]
    pub fn operators(&self) -> usize {
        self.factors.len()
    }

    /// Applies `pressure_pa` to the `state` of one taxel, and returns its effective pressure, Pa.
    pub fn respond(&self, pressure_pa: f64, state: &mut [f64]) -> f64 {
        if self.factors.is_empty() {
            return pressure_pa;
        }
        let mut sum_pa = 0.0;
        for (y, k) in state.iter_mut().zip(&self.factors) {
            *y = pressure_pa.max(y.min(k * pressure_pa));
            sum_pa += *y;
        }
        sum_pa / self.factors.len() as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use proptest::prelude::*;

    fn default() -> Hysteresis {
        Hysteresis::try_from(HysteresisConfig::default()).unwrap()
    }

    fn sweep(h: &Hysteresis, state: &mut [f64], path: impl Iterator<Item = f64>) -> Vec<(f64, f64)> {
        path.map(|p| (p, h.respond(p, state))).collect()
    }

    /// ∮ P dY over a closed cycle is the dissipated work. On unloading operator i holds Pmax down to Pmax/k, then is
    /// k·P: its loop has area ∫ P dP (loading) − ∫ P d(kP) over [0, Pmax/k] = Pmax²/2·(1 − 1/k), each up to the step of
    /// the trapezoid.
    #[test]
    fn a_cycle_dissipates_its_closed_form() {
        let h = default();
        let mut state = vec![0.0; h.operators()];
        let (steps, p_max) = (20_000, 30e3);
        let up = (0..=steps).map(|i| p_max * f64::from(i) / f64::from(steps));
        let path = up.clone().chain(up.collect::<Vec<_>>().into_iter().rev());
        let trace = sweep(&h, &mut state, path);
        let area: f64 = trace
            .windows(2)
            .map(|w| 0.5 * (w[0].0 + w[1].0) * (w[1].1 - w[0].1))
            .sum();
        let mean: f64 = h.factors.iter().map(|k| 1.0 - 1.0 / k).sum::<f64>() / 6.0;
        // one kink a branch, each within one step of the sweep
        assert_relative_eq!(area, 0.5 * p_max * p_max * mean, max_relative = 2.0 / f64::from(steps));
        assert!(area > 0.0);
    }

    proptest! {
        /// Play operators keep order: of two histories, the one with more pressure throughout gives more.
        #[test]
        fn order_is_kept(path in prop::collection::vec((0.0..1e5_f64, 0.0..1e5_f64), 1..40)) {
            let h = default();
            let (mut a, mut b) = (vec![0.0; 6], vec![0.0; 6]);
            for (p, more) in path {
                prop_assert!(h.respond(p, &mut a) <= h.respond(p + more, &mut b));
            }
        }

        /// Minor loops wipe out: after a larger extremum the past does not matter.
        #[test]
        fn a_larger_load_wipes_out_the_past(path in prop::collection::vec(0.0..1e4_f64, 1..40)) {
            let h = default();
            let (mut a, mut b) = (vec![0.0; 6], vec![0.0; 6]);
            for p in path {
                h.respond(p, &mut a);
            }
            h.respond(1e5, &mut a);
            h.respond(1e5, &mut b);
            prop_assert_eq!(a, b);
        }
    }
}
