//! Fast lag of the material.

use crate::config::{ConfigError, within};

/// First-order rise and fall of a part of the conductance: the share 1 − `instant` follows the elastic conductance G_e
/// as
///
/// dg/dt = (G_e − g)/τ, τ = `rise_s` while g < G_e and `fall_s` while g > G_e,
///
/// and the rest follows at once. Under a constant load g never crosses G_e, so that one exponential is exact for any
/// step. Of two loads, one never below the other, the larger always gives more: the equation is monotone in G_e and has
/// one solution through each point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Lag {
    rise_s: f64,
    fall_s: f64,
    instant: f64,
}

/// What a step does, for both directions.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct LagDecays {
    rise: Decay,
    fall: Decay,
}

/// exp(−dt/τ), and 1 − exp(−dt/τ) without its cancellation.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Decay {
    left: f64,
    gone: f64,
}

/// Below this share of the way, what is gone is added to the old value: what is left, a rounding below 1, has lost too
/// many of its digits (1e-16/1e-3).
const SHORT: f64 = 1e-3;

impl Decay {
    fn new(dt_s: f64, tau_s: f64) -> Self {
        // a branch without delay is never in the past
        if tau_s > 0.0 {
            Self {
                left: (-dt_s / tau_s).exp(),
                gone: -(-dt_s / tau_s).exp_m1(),
            }
        } else {
            Self { left: 0.0, gone: 1.0 }
        }
    }

    #[inline]
    fn towards(self, target: f64, from: f64) -> f64 {
        if self.gone < SHORT {
            from + (target - from) * self.gone
        } else {
            target + (from - target) * self.left
        }
    }
}

impl Lag {
    /// Lag with these time constants, s, in [0, 1] each, and `instant` in [0, 1]. The names in messages are those of
    /// [`CreepConfig`](crate::CreepConfig), which holds them.
    ///
    /// # Errors
    /// [`ConfigError`] for a value outside its range.
    pub(crate) fn new(rise_s: f64, fall_s: f64, instant: f64) -> Result<Self, ConfigError> {
        within("creep.fast_s", rise_s, 0.0, 1.0, "[0, 1]")?;
        within("creep.fast_fall_s", fall_s, 0.0, 1.0, "[0, 1]")?;
        within("creep.instant", instant, 0.0, 1.0, "[0, 1]")?;
        Ok(Self {
            rise_s,
            fall_s,
            instant,
        })
    }

    /// Decays over a step of `dt_s`, the same for all taxels.
    pub(crate) fn decays(&self, dt_s: f64) -> LagDecays {
        LagDecays {
            rise: Decay::new(dt_s, self.rise_s),
            fall: Decay::new(dt_s, self.fall_s),
        }
    }

    /// Moves one taxel's `delayed` conductance, S, over a step under `elastic_s` and returns the conductance at its
    /// end, S.
    #[inline]
    pub(crate) fn respond(&self, elastic_s: f64, decays: LagDecays, delayed_s: &mut f64) -> f64 {
        let decay = if *delayed_s < elastic_s {
            decays.rise
        } else {
            decays.fall
        };
        *delayed_s = decay.towards(elastic_s, *delayed_s);
        self.instant * elastic_s + (1.0 - self.instant) * *delayed_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use proptest::prelude::*;

    fn run(lag: &Lag, holds: &[(f64, f64)]) -> Vec<f64> {
        let mut delayed_s = 0.0;
        let respond = |(g, dt_s): &(f64, f64)| lag.respond(*g, lag.decays(*dt_s), &mut delayed_s);
        holds.iter().map(respond).collect()
    }

    /// t/τ up for a nanosecond, to the digits that a few roundings leave of it.
    #[test]
    fn a_nanosecond_keeps_its_digits() {
        let lag = Lag::new(3e-3, 15e-3, 0.0).unwrap();
        let x = 1e-9 / 3e-3;
        assert_relative_eq!(run(&lag, &[(1.0, 1e-9)])[0], x - 0.5 * x * x, max_relative = 1e-15);
    }

    /// 1 − exp(−t/τ) up, exp(−t/τ) down, each with its own τ; a few roundings.
    #[test]
    fn it_rises_and_falls_as_it_should() {
        let lag = Lag::new(3e-3, 15e-3, 0.0).unwrap();
        let trace = run(&lag, &[(1.0, 2e-3), (0.0, 20e-3)]);
        let up = -(-2.0_f64 / 3.0).exp_m1();
        assert_relative_eq!(trace[0], up, max_relative = 1e-15);
        assert_relative_eq!(trace[1], up * (-20.0_f64 / 15.0).exp(), max_relative = 1e-15);
    }

    proptest! {
        /// The larger of two loads gives more, to the roundings of G ≤ 2.
        #[test]
        fn order_is_kept(path in prop::collection::vec((0.0..1.0_f64, 0.0..1.0_f64, 0.0..0.02_f64), 1..40)) {
            let lag = Lag::new(3e-3, 15e-3, 0.5).unwrap();
            let less: Vec<_> = path.iter().map(|(g, _, dt_s)| (*g, *dt_s)).collect();
            let more: Vec<_> = path.iter().map(|(g, by, dt_s)| (g + by, *dt_s)).collect();
            for (less, more) in run(&lag, &less).iter().zip(run(&lag, &more)) {
                prop_assert!(more >= less - 4.0 * f64::EPSILON);
            }
        }
    }
}
