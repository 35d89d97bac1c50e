//! Slow rise of the conductance under a constant load, and the material's fast lag.

use crate::config::{ConfigError, in_range, within};
use crate::lag::{Lag, LagDecays};
use crate::prony::{MAX_TAU_S, MIN_TAU_S, Prony};
use serde::Deserialize;

/// Creep, close to logarithmic in time or a Prony series, followed by a fast lag.
///
/// The conductance is multiplied by 1 + Σ gⱼ·sⱼ. Branch j relaxes with its time constant τⱼ to the load factor P/(P +
/// `load_pa`). A released taxel therefore forgets its creep over the same times; it conducts nothing meanwhile.
///
/// - `log`: the τⱼ lie Δ = ½ decade apart from `start_s` to `end_s`, and gⱼ = c·Δ, so that the conductance under a
///   constant load rises by `per_decade` (c) for every decade of time in this range.
/// - `prony`: gⱼ and τⱼ are given.
///
/// Fast part: the share 1 − `instant` of the conductance follows with time constant `fast_s`, or `fast_fall_s` when it
/// falls.
///
/// All parts are linear relaxations to a target that is constant during a step, so a step of any length is exact.
///
/// ```
/// use spts_models::{Creep, CreepConfig};
///
/// let creep = Creep::try_from(CreepConfig::default())?;
/// let (mut state, mut decays) = (vec![0.0; creep.branches()], creep.decays());
/// let mut after = |dt_s: f64| {
///     creep.set_step(dt_s, &mut decays);
///     creep.respond(10e3, 1e-4, &decays, &mut state) // 10 kPa, elastic conductance 0.1 mS
/// };
/// let (one_s, ten_s) = (after(1.0), after(9.0));
/// assert!(((ten_s - one_s) / 1e-4 - 0.04).abs() < 0.005, "4 % for every decade of time");
/// # Ok::<(), spts_models::ConfigError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, try_from = "CreepConfig")]
pub struct Creep {
    slow: Prony,
    /// Scale of the series' sum.
    gain: f64,
    load_pa: f64,
    lag: Lag,
}

/// Kind of the series in the slow part of [`Creep`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CreepKind {
    /// Logarithmic in time, from `per_decade`, `start_s` and `end_s`.
    #[default]
    Log,
    /// Prony series of `shares` and `tau_s`.
    Prony,
}

/// Parameters of [`Creep`]. All are checked, also those that the chosen kind does not use.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CreepConfig {
    /// Series of the slow part: `log` (default) or `prony`.
    pub kind: CreepKind,
    /// c, relative gain a decade of time. Range [0, 1]; default 0.04 (measured on the plateau of recorded presses).
    /// Used by `log` only.
    pub per_decade: f64,
    /// Shortest time constant, s. Range [1e-6, end_s]; default 0.02. Used by `log` only.
    pub start_s: f64,
    /// Longest time constant, s. Range [start_s, 1e7]; default 200. Used by `log` only.
    pub end_s: f64,
    /// gⱼ, relative gains after a long time. At most 32, range [0, 1]; default 0.04 three times, which with the default
    /// `tau_s` also gives 0.04 a decade, but over 2.5 decades only. Used by `prony`
    /// only.
    pub shares: Vec<f64>,
    /// τⱼ, s, as many as `shares`. Range [1e-6, 1e7]; default 0.02, 0.2 and 2. Used by `prony` only.
    pub tau_s: Vec<f64>,
    /// Pressure at which half of the creep is reached, Pa. Range (0, 1e9]; default 200 (estimate: any touch counts).
    pub load_pa: f64,
    /// Time constant of the fast branch, s. Range [0, 1]; default 5e-4, which leaves an impact of 8 ms undistorted.
    pub fast_s: f64,
    /// Time constant of the fast branch while the conductance falls, s. Range [0, 1]; default `fast_s`. Conductive
    /// polymers recover more slowly than they respond (estimates for the whole response: 3 ms and 15 ms).
    pub fast_fall_s: Option<f64>,
    /// Share of the conductance that follows without lag. Range [0, 1]; default 0.85 (recorded impacts are nearly
    /// symmetric in time).
    pub instant: f64,
}

impl Default for CreepConfig {
    fn default() -> Self {
        Self {
            kind: CreepKind::Log,
            per_decade: 0.04,
            start_s: 0.02,
            end_s: 200.0,
            shares: vec![0.04; 3],
            tau_s: vec![0.02, 0.2, 2.0],
            load_pa: 200.0,
            fast_s: 5e-4,
            fast_fall_s: None,
            instant: 0.85,
        }
    }
}

/// Distance of neighbouring time constants of the logarithmic creep, decades.
const SPACING: f64 = 0.5;

impl TryFrom<CreepConfig> for Creep {
    type Error = ConfigError;
    fn try_from(c: CreepConfig) -> Result<Self, ConfigError> {
        within("creep.per_decade", c.per_decade, 0.0, 1.0, "[0, 1]")?;
        let ok = c.end_s > 0.0 && c.end_s <= MAX_TAU_S;
        in_range("creep.end_s", c.end_s, ok, "(0, 1e7]")?;
        within("creep.start_s", c.start_s, MIN_TAU_S, c.end_s, "[1e-6, end_s]")?;
        let ok = c.load_pa > 0.0 && c.load_pa <= 1e9;
        in_range("creep.load_pa", c.load_pa, ok, "(0, 1e9]")?;
        let listed = Prony::new("creep", &c.shares, &c.tau_s)?;
        let (slow, gain) = match c.kind {
            CreepKind::Log => (Prony::comb(c.start_s, c.end_s, SPACING), c.per_decade * SPACING),
            CreepKind::Prony => (listed, 1.0),
        };
        Ok(Self {
            slow,
            gain,
            load_pa: c.load_pa,
            lag: Lag::new(c.fast_s, c.fast_fall_s.unwrap_or(c.fast_s), c.instant)?,
        })
    }
}

/// Decay factors of the branches of [`Creep`] over a step of one length; the same for all taxels.
#[derive(Debug, Clone, PartialEq)]
pub struct CreepDecays {
    slow: Vec<f64>,
    fast: LagDecays,
}

impl Creep {
    /// Number of state values a taxel: the slow branches and the fast one.
    #[must_use]
    pub fn branches(&self) -> usize {
        self.slow.len() + 1
    }

    /// Storage for the decay factors of a step.
    #[must_use]
    pub fn decays(&self) -> CreepDecays {
        CreepDecays {
            slow: vec![0.0; self.slow.len()],
            fast: LagDecays::default(),
        }
    }

    /// Computes the decay factor of every branch for a step of `dt_s` seconds.
    pub fn set_step(&self, dt_s: f64, decays: &mut CreepDecays) {
        self.slow.decays(dt_s, &mut decays.slow);
        decays.fast = self.lag.decays(dt_s);
    }

    /// Advances the `state` of one taxel, of [`Creep::branches`] values, by a step with the given `decays`. The taxel
    /// is under the pressure `pressure_pa`, Pa, and would conduct `elastic_s`, S, without creep. Returns its
    /// conductance at the end of the step, S.
    pub fn respond(&self, pressure_pa: f64, elastic_s: f64, decays: &CreepDecays, state: &mut [f64]) -> f64 {
        let Some((delayed_s, slow)) = state.split_last_mut() else {
            return elastic_s;
        };
        let target = pressure_pa / (pressure_pa + self.load_pa);
        let sum = self.slow.relax(target, &decays.slow, slow);
        self.lag.respond(elastic_s, decays.fast, delayed_s) * (1.0 + self.gain * sum)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn creep(kind: CreepKind) -> Creep {
        let config = CreepConfig {
            kind,
            ..CreepConfig::default()
        };
        Creep::try_from(config).unwrap()
    }

    fn hold(creep: &Creep, dt_s: &[f64]) -> f64 {
        let (mut decays, mut state, mut out) = (creep.decays(), vec![0.0; creep.branches()], 0.0);
        for dt_s in dt_s {
            creep.set_step(*dt_s, &mut decays);
            out = creep.respond(30e3, 1.0, &decays, &mut state);
        }
        out
    }

    #[test]
    fn a_hold_does_not_depend_on_how_it_is_cut() {
        for kind in [CreepKind::Log, CreepKind::Prony] {
            let creep = creep(kind);
            let whole = hold(&creep, &[1.7]);
            let cut: Vec<f64> = (0..1000).map(|_| 1.7e-3).collect();
            // a thousand rounded multiplications
            assert_relative_eq!(hold(&creep, &cut), whole, max_relative = 1e-12);
            assert_relative_eq!(hold(&creep, &[1.69, 0.01]), whole, max_relative = 1e-13);
        }
    }

    /// A comb of exponentials h = ln 10·Δ apart is straight in log time, far from its ends, to within
    /// 2·|Γ(1 + 2πi/h)| = 2·√(πy/sinh πy), y = 2π/h, of the slope: 0.2 % for Δ = ½ decade, 11 % for a whole one, of
    /// which a decade's gain averages most. One decade from the ends e⁻¹⁰ and 1/10 of a branch are missing.
    #[test]
    fn a_hold_gains_four_percent_a_decade() {
        for (kind, tolerance) in [(CreepKind::Log, 0.03), (CreepKind::Prony, 0.15)] {
            let creep = creep(kind);
            for t in [0.05, 0.07, 0.1] {
                let gain = hold(&creep, &[10.0 * t]) - hold(&creep, &[t]);
                assert_relative_eq!(gain, 0.04, max_relative = tolerance);
            }
        }
        let creep = creep(CreepKind::Log);
        for t in [0.3, 1.0, 2.0] {
            let gain = hold(&creep, &[10.0 * t]) - hold(&creep, &[t]);
            assert_relative_eq!(gain, 0.04, max_relative = 0.03);
        }
    }

    #[test]
    fn an_impact_of_8_ms_passes() {
        // after a tenth of the impact the fast branch is at 1 − 0.15·exp(−1.6) of the elastic conductance
        assert!(hold(&creep(CreepKind::Log), &[0.8e-3]) > 0.96);
    }
}
