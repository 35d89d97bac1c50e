//! Slow rise of the conductance under a constant load, and the delay of the material.

use crate::config::{ConfigError, in_range};
use serde::Deserialize;

/// Creep that is close to logarithmic in time, with one fast branch.
///
/// Slow part: the conductance is multiplied by 1 + c·Δ·Σ sⱼ. Branch j has time constant τⱼ; the τⱼ lie Δ = ½ decade apart
/// from `start_s` to `end_s`, so that a hold gains `per_decade` (c) for every decade of time between them. sⱼ relaxes to the
/// load factor P/(P + `load_pa`): a released taxel forgets over the times in which it crept, and conducts nothing meanwhile.
///
/// Fast part: the share 1 − `instant` of the conductance follows with time constant `fast_s`.
///
/// Both are linear relaxations to a constant target, so a step of any length is exact: s ← target + (s − target)·exp(−dt/τ).
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, try_from = "CreepConfig")]
pub struct Creep {
    taus_s: Vec<f64>,
    gain: f64,
    load_pa: f64,
    fast_s: f64,
    instant: f64,
}

/// Parameters of [`Creep`].
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CreepConfig {
    /// c, relative gain a decade of time. Range [0, 1]; default 0.04 (measured on the plateau of recorded presses).
    pub per_decade: f64,
    /// Shortest time constant, s. Range [1e-6, end_s]; default 0.02.
    pub start_s: f64,
    /// Longest time constant, s. Range [start_s, 1e7]; default 200.
    pub end_s: f64,
    /// Pressure at which half of the creep is reached, Pa. Range (0, 1e9]; default 200 (estimate: any touch counts).
    pub load_pa: f64,
    /// Time constant of the fast branch, s. Range [0, 1]; default 5e-4, so that an impact of 8 ms passes undistorted.
    pub fast_s: f64,
    /// Share of the conductance that follows at once. Range [0, 1]; default 0.85 (recorded impacts are nearly symmetric in
    /// time).
    pub instant: f64,
}

impl Default for CreepConfig {
    fn default() -> Self {
        Self {
            per_decade: 0.04,
            start_s: 0.02,
            end_s: 200.0,
            load_pa: 200.0,
            fast_s: 5e-4,
            instant: 0.85,
        }
    }
}

/// Distance of neighbouring time constants, decades.
const SPACING: f64 = 0.5;

impl TryFrom<CreepConfig> for Creep {
    type Error = ConfigError;
    fn try_from(c: CreepConfig) -> Result<Self, ConfigError> {
        let unit = 0.0..=1.0;
        in_range("creep.per_decade", c.per_decade, unit.contains(&c.per_decade), "[0, 1]")?;
        in_range("creep.end_s", c.end_s, c.end_s > 0.0 && c.end_s <= 1e7, "(0, 1e7]")?;
        in_range(
            "creep.start_s",
            c.start_s,
            (1e-6..=c.end_s).contains(&c.start_s),
            "[1e-6, end_s]",
        )?;
        in_range(
            "creep.load_pa",
            c.load_pa,
            c.load_pa > 0.0 && c.load_pa <= 1e9,
            "(0, 1e9]",
        )?;
        in_range("creep.fast_s", c.fast_s, unit.contains(&c.fast_s), "[0, 1]")?;
        in_range("creep.instant", c.instant, unit.contains(&c.instant), "[0, 1]")?;
        let log_end = (c.end_s / c.start_s).log10();
        let taus_s = (0_u32..)
            .map(|j| SPACING * f64::from(j))
            .take_while(|d| *d <= log_end + 1e-9)
            .map(|d| c.start_s * 10_f64.powf(d))
            .collect();
        Ok(Self {
            taus_s,
            gain: c.per_decade * SPACING,
            load_pa: c.load_pa,
            fast_s: c.fast_s,
            instant: c.instant,
        })
    }
}

impl Creep {
    /// Number of state values a taxel: the slow branches and the fast one.
    #[must_use]
    pub fn branches(&self) -> usize {
        self.taus_s.len() + 1
    }

    /// Writes the decay exp(−dt/τ) of every branch over a step of `dt_s`, the same for all taxels.
    pub fn decays(&self, dt_s: f64, out: &mut [f64]) {
        for (out, tau_s) in out.iter_mut().zip(self.taus_s.iter().chain([&self.fast_s])) {
            // a branch without delay is never in the past
            *out = if *tau_s > 0.0 { (-dt_s / tau_s).exp() } else { 0.0 };
        }
    }

    /// Moves one taxel's `state` over a step with the given `decays` under `pressure_pa` with the elastic conductance
    /// `elastic_s`, and returns the conductance at its end, S.
    pub fn respond(&self, pressure_pa: f64, elastic_s: f64, decays: &[f64], state: &mut [f64]) -> f64 {
        let (Some((fast_s, slow)), Some((fast_decay, slow_decays))) = (state.split_last_mut(), decays.split_last())
        else {
            return elastic_s;
        };
        let target = pressure_pa / (pressure_pa + self.load_pa);
        let mut sum = 0.0;
        for (s, decay) in slow.iter_mut().zip(slow_decays) {
            *s = target + (*s - target) * decay;
            sum += *s;
        }
        *fast_s = elastic_s + (*fast_s - elastic_s) * fast_decay;
        (self.instant * elastic_s + (1.0 - self.instant) * *fast_s) * (1.0 + self.gain * sum)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn hold(creep: &Creep, dt_s: &[f64]) -> f64 {
        let n = creep.branches();
        let (mut decays, mut state, mut out) = (vec![0.0; n], vec![0.0; n], 0.0);
        for dt_s in dt_s {
            creep.decays(*dt_s, &mut decays);
            out = creep.respond(30e3, 1.0, &decays, &mut state);
        }
        out
    }

    #[test]
    fn a_hold_does_not_depend_on_how_it_is_cut() {
        let creep = Creep::try_from(CreepConfig::default()).unwrap();
        let whole = hold(&creep, &[1.7]);
        let cut: Vec<f64> = (0..1000).map(|_| 1.7e-3).collect();
        // a thousand rounded multiplications
        assert_relative_eq!(hold(&creep, &cut), whole, max_relative = 1e-12);
        assert_relative_eq!(hold(&creep, &[1.69, 0.01]), whole, max_relative = 1e-13);
    }

    /// Between its first and last time constants a comb of exponentials half a decade apart is straight in log time to
    /// within 2 % of the slope: away from the ends (one decade) the gain a decade is `per_decade`.
    #[test]
    fn a_hold_gains_four_percent_a_decade() {
        let creep = Creep::try_from(CreepConfig::default()).unwrap();
        for t in [0.3, 1.0, 2.0] {
            let gain = hold(&creep, &[10.0 * t]) - hold(&creep, &[t]);
            assert_relative_eq!(gain, 0.04, max_relative = 0.03);
        }
    }

    #[test]
    fn an_impact_of_8_ms_passes() {
        let creep = Creep::try_from(CreepConfig::default()).unwrap();
        // after a tenth of the impact the fast branch is at 1 − 0.15·exp(−1.6) of the elastic conductance
        assert!(hold(&creep, &[0.8e-3]) > 0.96);
    }
}
