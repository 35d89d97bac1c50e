//! What the sheet remembers: hysteresis of the pressure, creep and lag of the conductance, conditioning from press to
//! press.

use crate::check::{in_interval, in_range, within};
use crate::snapshot::Snapshot;
use serde::Deserialize;
use spts_input::Refusal;

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
/// # Ok::<(), spts_input::Refusal>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
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
        Self { operators: 6, width: 1.8 }
    }
}

impl TryFrom<HysteresisConfig> for Hysteresis {
    type Error = Refusal;
    fn try_from(c: HysteresisConfig) -> Result<Self, Refusal> {
        let n = c.operators as f64;
        in_range("hysteresis.operators", n, c.operators <= MAX_OPERATORS, "[0, 32]")?;
        in_interval("hysteresis.width", c.width, "[1, 10]")?;
        let factors = (1..=c.operators).map(|i| 1.0 + (c.width - 1.0) * i as f64 / n).collect();
        Ok(Self { factors })
    }
}

impl Hysteresis {
    /// Number of state values a taxel.
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

// First-order relaxations in parallel.

/// Most branches a series may have.
const MAX_BRANCHES: usize = 32;

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
    /// [`Refusal`] for a value outside its range, too many branches, or lists of different length.
    pub(crate) fn new(table: &str, shares: &[f64], taus_s: &[f64]) -> Result<Self, Refusal> {
        let name = |field: &str| format!("{table}.{field}");
        let count = shares.len() as f64;
        in_range(&name("shares (length)"), count, shares.len() <= MAX_BRANCHES, "[0, 32]")?;
        let same = shares.len() == taus_s.len();
        in_range(&name("tau_s (length)"), taus_s.len() as f64, same, "the length of `shares`")?;
        for share in shares {
            in_interval(&name("shares"), *share, "[0, 1]")?;
        }
        for tau_s in taus_s {
            in_interval(&name("tau_s"), *tau_s, "[1e-6, 1e7]")?;
        }
        Ok(Self { shares: shares.to_vec(), taus_s: taus_s.to_vec() })
    }

    /// Branches of share 1 with time constants `spacing` decades apart from `start_s` to `end_s`, which are valid.
    pub(crate) fn comb(start_s: f64, end_s: f64, spacing: f64) -> Self {
        let decades = (end_s / start_s).log10();
        let taus_s: Vec<f64> = (0_u32..)
            .map(|j| spacing * f64::from(j))
            .take_while(|d| *d <= decades + 1e-9)
            .map(|d| start_s * 10_f64.powf(d))
            .collect();
        Self { shares: vec![1.0; taus_s.len()], taus_s }
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

// Fast lag of the material.

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
            Self { left: (-dt_s / tau_s).exp(), gone: -(-dt_s / tau_s).exp_m1() }
        } else {
            Self { left: 0.0, gone: 1.0 }
        }
    }

    #[inline]
    fn towards(self, target: f64, from: f64) -> f64 {
        if self.gone < SHORT { from + (target - from) * self.gone } else { target + (from - target) * self.left }
    }
}

impl Lag {
    /// Lag with these time constants, s, in [0, 1] each, and `instant` in [0, 1]. The names in messages are those of
    /// [`CreepConfig`](crate::CreepConfig), which holds them.
    ///
    /// # Errors
    /// [`Refusal`] for a value outside its range.
    pub(crate) fn new(rise_s: f64, fall_s: f64, instant: f64) -> Result<Self, Refusal> {
        in_interval("creep.fast_s", rise_s, "[0, 1]")?;
        in_interval("creep.fast_fall_s", fall_s, "[0, 1]")?;
        in_interval("creep.instant", instant, "[0, 1]")?;
        Ok(Self { rise_s, fall_s, instant })
    }

    /// Decays over a step of `dt_s`, the same for all taxels.
    pub(crate) fn decays(&self, dt_s: f64) -> LagDecays {
        LagDecays { rise: Decay::new(dt_s, self.rise_s), fall: Decay::new(dt_s, self.fall_s) }
    }

    /// Moves one taxel's `delayed` conductance, S, over a step under `elastic_s` and returns the conductance at its
    /// end, S.
    #[inline]
    pub(crate) fn respond(&self, elastic_s: f64, decays: LagDecays, delayed_s: &mut f64) -> f64 {
        let decay = if *delayed_s < elastic_s { decays.rise } else { decays.fall };
        *delayed_s = decay.towards(elastic_s, *delayed_s);
        self.instant * elastic_s + (1.0 - self.instant) * *delayed_s
    }
}

// Slow rise of the conductance under a constant load, and the material's fast lag.

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
/// # Ok::<(), spts_input::Refusal>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
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
    type Error = Refusal;
    fn try_from(c: CreepConfig) -> Result<Self, Refusal> {
        in_interval("creep.per_decade", c.per_decade, "[0, 1]")?;
        in_interval("creep.end_s", c.end_s, "(0, 1e7]")?;
        within("creep.start_s", c.start_s, 1e-6, c.end_s, "[1e-6, end_s]")?;
        in_interval("creep.load_pa", c.load_pa, "(0, 1e9]")?;
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
    pub fn branches(&self) -> usize {
        self.slow.len() + 1
    }

    /// Storage for the decay factors of a step.
    pub fn decays(&self) -> CreepDecays {
        CreepDecays { slow: vec![0.0; self.slow.len()], fast: LagDecays::default() }
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

    /// Ends the fast branch of an unloaded taxel's `state`: it conducts nothing from here on.
    pub(crate) fn settle(state: &mut [f64]) {
        state.last_mut().into_iter().for_each(|delayed_s| *delayed_s = 0.0);
    }
}

// Conditioning: a taxel of Velostat conducts more from press to press of a session.

/// Gain by which the conductance of a taxel is multiplied, as a function of how often the taxel has been pressed in
/// this session. Velostat conducts least at the first press, and then more with the logarithm of the number of presses.
///
/// The gain c of press k, with the slope s = [`per_ln_press`](Self::per_ln_press), is
///
/// c(1) = `first`·b(1), c(k) = b(k) for k > 1, where b(k) = (1 + s·ln k)/(1 + s·ln `reference_press`).
///
/// The gain is 1 at the reference press, so the static law of [`Velostat`](crate::Velostat) holds for a skin that has
/// been pressed that often. A press begins when the pressure on the taxel exceeds `touch_pa`, and ends when it falls
/// below half of `touch_pa`. The gain changes only at the beginning of a press, while the conductance is small.
///
/// ```
/// use spts_models::Conditioning;
///
/// let conditioning = Conditioning::default();
/// let mut taxel = conditioning.fresh();
/// let first = conditioning.respond(10e3, &mut taxel);
/// conditioning.respond(0.0, &mut taxel);
/// let second = conditioning.respond(10e3, &mut taxel);
/// assert!(first < second && second < conditioning.gain(10));
/// ```
///
/// In a scene, its parameters are the table `[transducer_parameters.conditioning]`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Conditioning {
    /// Extra factor of the gain at the first press. Range (0, 1]; default 0.92. With the default slope, the first press
    /// has 0.82 of the gain of the tenth (recorded: 0.64–0.96, median 0.80).
    pub first: f64,
    /// Slope s: growth of the gain for each unit of ln k, k being the number of the press. Range [0, 1]; default 0.055
    /// (recorded: 0.024–0.094).
    pub per_ln_press: f64,
    /// Press at which the gain is 1. Range [1, 1e6]; default 10, the press from which the published ground truth comes.
    pub reference_press: u32,
    /// Pressure that begins a press, Pa. Range (0, 1e9]; default 100.
    pub touch_pa: f64,
}

impl Default for Conditioning {
    fn default() -> Self {
        Self { first: 0.92, per_ln_press: 0.055, reference_press: 10, touch_pa: 100.0 }
    }
}

/// State of one taxel: how often it has been pressed in this session, whether it is pressed now, and its gain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Presses {
    count: u32,
    pressed: bool,
    gain: f64,
}

impl Presses {
    /// Saves or loads it.
    pub(crate) fn exchange(&mut self, state: &mut Snapshot) {
        let mut count = u64::from(self.count);
        state.u64(&mut count);
        self.count = u32::try_from(count).unwrap_or(u32::MAX);
        state.flag(&mut self.pressed);
        state.f64(&mut self.gain);
    }
}

impl Conditioning {
    /// Itself, if every parameter is in its range.
    pub(crate) fn checked(self) -> Result<Self, Refusal> {
        in_interval("conditioning.first", self.first, "(0, 1]")?;
        in_interval("conditioning.per_ln_press", self.per_ln_press, "[0, 1]")?;
        in_interval("conditioning.reference_press", self.reference_press.into(), "[1, 1e6]")?;
        in_interval("conditioning.touch_pa", self.touch_pa, "(0, 1e9]")?;
        Ok(self)
    }

    /// State of a taxel that has not been pressed in this session.
    pub fn fresh(&self) -> Presses {
        Presses { count: 0, pressed: false, gain: self.gain(1) }
    }

    /// Gain at press number `press` of a session, counted from 1.
    pub fn gain(&self, press: u32) -> f64 {
        let b = |press: u32| 1.0 + self.per_ln_press * f64::from(press.max(1)).ln();
        let first = if press <= 1 { self.first } else { 1.0 };
        first * b(press) / b(self.reference_press)
    }

    /// Tells one taxel that its pressure is now `pressure_pa`, Pa, updates its state `presses`, and returns its gain.
    pub fn respond(&self, pressure_pa: f64, presses: &mut Presses) -> f64 {
        if !presses.pressed && pressure_pa > self.touch_pa {
            presses.pressed = true;
            presses.count = presses.count.saturating_add(1);
            presses.gain = self.gain(presses.count);
        } else if presses.pressed && pressure_pa < 0.5 * self.touch_pa {
            presses.pressed = false;
        }
        presses.gain
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
        let area: f64 = trace.windows(2).map(|w| 0.5 * (w[0].0 + w[1].0) * (w[1].1 - w[0].1)).sum();
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

    fn relaxed(series: &Prony, target: f64, dt_s: &[f64]) -> f64 {
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
            assert_relative_eq!(relaxed(&series, 1.0, &[t]), expected, epsilon = 1e-15, max_relative = 1e-14);
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
        fn the_larger_load_gives_more(path in prop::collection::vec((0.0..1.0_f64, 0.0..1.0_f64, 0.0..0.02_f64), 1..40)) {
            let lag = Lag::new(3e-3, 15e-3, 0.5).unwrap();
            let less: Vec<_> = path.iter().map(|(g, _, dt_s)| (*g, *dt_s)).collect();
            let more: Vec<_> = path.iter().map(|(g, by, dt_s)| (g + by, *dt_s)).collect();
            for (less, more) in run(&lag, &less).iter().zip(run(&lag, &more)) {
                prop_assert!(more >= less - 4.0 * f64::EPSILON);
            }
        }
    }

    fn creep(kind: CreepKind) -> Creep {
        let config = CreepConfig { kind, ..CreepConfig::default() };
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

    #[test]
    fn presses_are_counted_and_remembered() {
        let c = Conditioning::default();
        let mut taxel = c.fresh();
        let mut gains = Vec::new();
        for _ in 0..10 {
            // wobble above half the touch pressure is the same press
            for p in [0.0, 5e3, 60.0, 5e3] {
                c.respond(p, &mut taxel);
            }
            gains.push(c.respond(5e3, &mut taxel));
        }
        assert!(gains.windows(2).all(|w| w[0] < w[1]), "{gains:?}");
        assert_relative_eq!(gains[9], 1.0);
        assert_relative_eq!(gains[0], 0.92 / (1.0 + 0.055 * 10_f64.ln()));
    }
}
