//! The piezoresistive sheet.

use crate::check::in_interval;
use crate::gains::{Mounting, Spread, TaxelGains};
use crate::layout::{ConductanceMap, PressureMap, SkinLayout};
use crate::memory::{Conditioning, Creep, CreepConfig, CreepDecays, Hysteresis, HysteresisConfig, Presses};
use crate::snapshot::Snapshot;
use crate::streams::Streams;
use crate::transducer::{Transducer, elapsed_s, loaded_pa};
use rand_distr::{Distribution as _, StandardNormal};
use serde::Deserialize;
use spts_input::Refusal;

/// Parameters of [`Velostat`]: the static law
///
/// G = g₀ + G_ref · (S(P)/P_ref)ⁿ, S(P) = P/(1 + P/Ps), P_ref = 10 kPa,
///
/// its change with temperature, the differences between taxels, and one table of parameters for each memory effect.
///
/// Recordings determine only the product Rf·Vd·G. The defaults belong to Rf·Vd = 4300 V/S: at 20 N, 3 taxels at 30 kPa
/// sum to 3 V and 25 taxels at 3.5 kPa to 11 V, as recorded. The exponent is chosen so that both hold.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct VelostatConfig {
    /// G_ref, conductance at 10 kPa, without saturation, of a median taxel with an electrode of 10 mm × 10 mm, S. Range
    /// (0, 1]; default 1.35e-4. This is within 1 % of the law fitted to the recorded plateaus of five objects (A = 6.7
    /// mV/√Pa at this exponent and Ps, `scripts/fit_objects.py` at the tag `before-halving`), divided by 1.17 for creep
    /// and conditioning up to that time.
    pub reference_s: f64,
    /// n. Range [0.05, 2]; default 0.5.
    pub exponent: f64,
    /// Ps, Pa. Range [1, 1e12]; default 3e5 (literature: 80–300 kPa, estimated).
    pub saturation_pa: f64,
    /// g₀, conductance without load, S. Range [0, 1]; default 0 (recorded idle signal: below 0.005 V a taxel).
    pub unloaded_s: f64,
    /// Standard deviation, from taxel to taxel, of the natural logarithm of a taxel's fixed gain, which is the same in
    /// all sessions of a skin. Range [0, 2]; default 0.30: the gains of two thirds of the taxels lie within a factor of
    /// 1.35 of the median (recorded on flat objects: 0.36–0.39, which includes the objects' own unevenness).
    pub spread_log_sd: f64,
    /// Standard deviation of the natural logarithm of a second gain, which every taxel draws anew in each session,
    /// because the skin is mounted anew. The conductance is multiplied by both gains. Range [0, 2]; default 0.10: in
    /// two thirds of the cases, a factor between 0.90 and 1.11. The ratio of a taxel's gains in two sessions then has
    /// √2 times this standard deviation; recorded with one object in two sessions: 0.12–0.16 for four objects and 0.31
    /// for a fifth (`spts calibrate`, median 0.14).
    pub session_log_sd: f64,
    /// Standard deviation of the slopes, along the rows and along the columns, of a plane that is added in each session
    /// to the logarithm of the taxels' gains, from the middle of the sheet to its edge. Range [0, 2]; default 0.20: see
    /// [`Mounting`]. Recorded in two sessions each of four objects: `spts calibrate --skin`.
    pub session_tilt_log_sd: f64,
    /// Gains of a calibrated skin. They replace `spread_log_sd` and both of `session_…`; every seed then draws a skin
    /// that the calibrated one may be. A scene or the specification of a data set may instead name a file written by
    /// `spts calibrate --skin`. Default: none.
    pub gains: Option<TaxelGains>,
    /// T, temperature of the sheet, °C. Range [-45, 65], the sheet's operating range; default 25, for which the law is
    /// given.
    pub temperature_c: f64,
    /// α, relative change of the resistance with temperature, 1/K. Range [-0.02, 0.02]; default 0.004 (estimate for
    /// carbon black in polyethylene near room temperature: 0.002–0.006; the sign may differ between samples).
    pub resistance_per_k: f64,
    /// Hysteresis: the conductance is larger when the pressure falls than when it rises.
    pub hysteresis: HysteresisConfig,
    /// Creep: the conductance grows while a load is held, and follows a change with a delay.
    pub creep: CreepConfig,
    /// Conditioning: the conductance grows from press to press of a session.
    pub conditioning: Conditioning,
}

impl Default for VelostatConfig {
    fn default() -> Self {
        Self {
            reference_s: 1.35e-4,
            exponent: 0.5,
            saturation_pa: 3e5,
            unloaded_s: 0.0,
            spread_log_sd: 0.30,
            session_log_sd: 0.10,
            session_tilt_log_sd: 0.20,
            gains: None,
            temperature_c: REFERENCE_C,
            resistance_per_k: 0.004,
            hysteresis: HysteresisConfig::default(),
            creep: CreepConfig::default(),
            conditioning: Conditioning::default(),
        }
    }
}

impl VelostatConfig {
    /// What a new mounting of a skin without known gains changes.
    pub fn mounting(&self) -> Mounting {
        Mounting { log_sd: self.session_log_sd, tilt_log_sd: self.session_tilt_log_sd }
    }
}

/// Velostat under interdigitated electrodes. Stages in order: pressure → hysteresis → static law → creep → conditioning
/// → gain of the taxel → temperature.
///
/// Every stage lags: a closed cycle has ∮ P dG ≥ 0. For the hysteresis see [`Hysteresis`]. For creep: a branch τ·ds/dt
/// = φ(P) − s with φ increasing has ∮ F(P) ds ≥ 0 for every increasing F, because s rises only where φ(P) > s. For the
/// factor 1 + Σ gⱼ·sⱼ, gⱼ ≥ 0, on a law G_e(P), choose F′ = G_e; then ∮ P dG = Σ gⱼ·∮ F dsⱼ. The combination of both
/// stages with the lag is only tested.
///
/// ```
/// use spts_models::{SkinLayout, Streams, Transducer, Velostat, VelostatConfig};
///
/// let skin = SkinLayout::default();
/// let mut sheet = Velostat::new(VelostatConfig::default(), &skin, Streams::new(1))?;
/// let before: Vec<f64> = sheet.gains().collect();
/// sheet.start_session(1);
/// let change = |(a, b): (&f64, f64)| (b / a).ln().abs();
/// assert!(before.iter().zip(sheet.gains()).map(change).fold(0.0, f64::max) > 0.05, "gains differ by session");
/// # Ok::<(), spts_input::Refusal>(())
/// ```
#[derive(Debug, Clone)]
pub struct Velostat {
    law: PressureLaw,
    unloaded_s: f64,
    hysteresis: Hysteresis,
    creep: Creep,
    conditioning: Conditioning,
    /// Factor on the conductance at the sheet's temperature.
    warmth: f64,
    mounting: Mounting,
    skin: SkinLayout,
    streams: Streams,
    /// Fixed gain of every taxel.
    fixed: Vec<f64>,
    /// Gain of every taxel in this session.
    gains: Vec<f64>,
    /// 1 + place in `loaded` of every taxel that has been loaded in this session; 0 of the others, without a state.
    places: Vec<u32>,
    loaded: Vec<Loaded>,
    /// State of the play operators of the loaded taxels, in their order.
    plays: Vec<f64>,
    /// State of their creep branches.
    slow: Vec<f64>,
    /// Taxels that conduct, in order, if `known`: after a step of the touched ones.
    conducting: Vec<u32>,
    known: bool,
    /// Scratch: those before the step.
    conducted: Vec<u32>,
    /// Time of the session, s.
    time_s: f64,
    /// Scratch: decay of every branch over the step, and over the time for which a taxel was not touched.
    decays: CreepDecays,
    idle_decays: CreepDecays,
}

#[derive(Debug, Clone)]
struct Loaded {
    taxel: u32,
    presses: Presses,
    /// Time of its state, s. Nothing has touched it since.
    since_s: f64,
}

/// A released taxel that conducts less than this conducts nothing, S: 1e-21 V at the output.
const NEGLIGIBLE_S: f64 = 1e-25;

impl Velostat {
    /// A fresh sheet on `skin` in session 0. The taxels' gains come from `streams`: equal streams give the same sheet.
    ///
    /// # Errors
    /// [`Refusal`] for a parameter outside its range.
    pub fn new(config: VelostatConfig, skin: &SkinLayout, streams: Streams) -> Result<Self, Refusal> {
        let unknown = config.mounting();
        let c = config;
        in_interval("unloaded_s", c.unloaded_s, "[0, 1]")?;
        let hysteresis = Hysteresis::try_from(c.hysteresis)?;
        let creep = Creep::try_from(c.creep)?;
        let taxels = skin.taxels();
        let (fixed, mounting) = match &c.gains {
            Some(gains) => {
                gains.check_skin(skin)?;
                (gains.draw(streams, "velostat/spread", 0), gains.mounting)
            }
            None => {
                let fixed = Spread::new("spread_log_sd", c.spread_log_sd)?;
                in_interval("session_log_sd", c.session_log_sd, "[0, 2]")?;
                in_interval("session_tilt_log_sd", c.session_tilt_log_sd, "[0, 2]")?;
                (fixed.gains(taxels, streams, "velostat/spread", 0), unknown)
            }
        };
        let mut sheet = Self {
            law: PressureLaw::new(c.reference_s, c.exponent, c.saturation_pa)?,
            unloaded_s: c.unloaded_s,
            warmth: conductance_factor(c.temperature_c, c.resistance_per_k)?,
            mounting,
            skin: *skin,
            fixed,
            conditioning: c.conditioning.checked()?,
            gains: Vec::new(),
            places: vec![0; taxels],
            loaded: Vec::new(),
            plays: Vec::new(),
            slow: Vec::new(),
            conducting: Vec::new(),
            known: true,
            conducted: Vec::new(),
            time_s: 0.0,
            decays: creep.decays(),
            idle_decays: creep.decays(),
            hysteresis,
            creep,
            streams,
        };
        sheet.start_session(0);
        Ok(sheet)
    }

    /// Gain of every taxel in this session: the fixed gain (median 1) times that of the session.
    pub fn gains(&self) -> impl Iterator<Item = f64> + '_ {
        self.gains.iter().copied()
    }

    /// Begins a step of `dt_s`; the time at its end, s.
    fn begin(&mut self, dt_s: f64) -> f64 {
        let dt_s = elapsed_s(dt_s);
        self.creep.set_step(dt_s, &mut self.decays);
        self.time_s + dt_s
    }

    /// Conductance of taxel `k` at the end of the step, `end_s`, S.
    fn respond(&mut self, k: usize, pressure_pa: f64, end_s: f64) -> f64 {
        let place = match self.places[k] {
            0 if pressure_pa > 0.0 => self.load(k),
            0 => return self.warmth * self.unloaded_s,
            place => place as usize - 1,
        };
        let idle_s = self.time_s - self.loaded[place].since_s;
        if idle_s > 0.0 {
            self.creep.set_step(idle_s, &mut self.idle_decays);
            self.advance(place, 0.0, true);
        }
        self.loaded[place].since_s = end_s;
        self.advance(place, pressure_pa, false)
    }

    /// Gives taxel `k` a state; its place.
    #[expect(clippy::cast_possible_truncation, reason = "a layout has fewer than 2^32 taxels")]
    fn load(&mut self, k: usize) -> usize {
        let presses = self.conditioning.fresh();
        self.loaded.push(Loaded { taxel: k as u32, presses, since_s: self.time_s });
        self.plays.resize(self.loaded.len() * self.hysteresis.operators(), 0.0);
        self.slow.resize(self.loaded.len() * self.creep.branches(), 0.0);
        self.places[k] = self.loaded.len() as u32;
        self.loaded.len() - 1
    }

    /// Moves the state at `place` over the step, or over the time without a touch before it.
    fn advance(&mut self, place: usize, pressure_pa: f64, idle: bool) -> f64 {
        let decays = if idle { &self.idle_decays } else { &self.decays };
        let (operators, branches) = (self.hysteresis.operators(), self.creep.branches());
        let plays = &mut self.plays[place * operators..(place + 1) * operators];
        let effective_pa = self.hysteresis.respond(pressure_pa, plays);
        let elastic_s = self.law.conductance_s(effective_pa);
        let slow = &mut self.slow[place * branches..(place + 1) * branches];
        let crept_s = self.creep.respond(pressure_pa, elastic_s, decays, slow);
        let taxel = &mut self.loaded[place];
        let gain = self.gains[taxel.taxel as usize] * self.conditioning.respond(pressure_pa, &mut taxel.presses);
        self.warmth * (self.unloaded_s + gain * crept_s)
    }
}

impl Transducer for Velostat {
    fn step(&mut self, pressure: &PressureMap, dt_s: f64, out: &mut ConductanceMap) {
        let end_s = self.begin(dt_s);
        for (k, (out, &p)) in out.values_mut().iter_mut().zip(pressure.values()).enumerate().take(self.places.len()) {
            *out = self.respond(k, loaded_pa(p), end_s);
        }
        self.time_s = end_s;
        self.known = false;
    }

    fn step_touched(&mut self, pressed: &[(u32, f64)], dt_s: f64, out: &mut Vec<(u32, f64)>) -> bool {
        if self.unloaded_s > 0.0 {
            return false;
        }
        let end_s = self.begin(dt_s);
        std::mem::swap(&mut self.conducting, &mut self.conducted);
        self.conducting.clear();
        if !std::mem::replace(&mut self.known, true) {
            self.conducted.clear();
            self.conducted.extend(self.loaded.iter().map(|loaded| loaded.taxel));
            self.conducted.sort_unstable();
        }
        let mut pressed = pressed.iter().map(|(k, pa)| (*k, loaded_pa(*pa))).filter(|(_, pa)| *pa > 0.0).peekable();
        let mut done = 0;
        out.clear();
        loop {
            let before = self.conducted.get(done).copied();
            let Some(k) = pressed.peek().map(|(k, _)| *k).into_iter().chain(before).min() else {
                break;
            };
            let pressure_pa = pressed.next_if(|(other, _)| *other == k).map_or(0.0, |(_, pa)| pa);
            done += usize::from(before == Some(k));
            let mut conductance_s = self.respond(k as usize, pressure_pa, end_s);
            if pressure_pa > 0.0 || conductance_s > NEGLIGIBLE_S {
                self.conducting.push(k);
            } else {
                let (place, branches) = (self.places[k as usize] as usize, self.creep.branches());
                if let Some(place) = place.checked_sub(1) {
                    Creep::settle(&mut self.slow[place * branches..(place + 1) * branches]);
                }
                conductance_s = 0.0;
            }
            out.push((k, conductance_s));
        }
        self.time_s = end_s;
        true
    }

    fn rest(&mut self, dt_s: f64) {
        let end_s = self.begin(dt_s);
        for place in 0..self.loaded.len() {
            self.respond(self.loaded[place].taxel as usize, 0.0, end_s);
        }
        self.time_s = end_s;
    }

    fn exchange(&mut self, state: &mut Snapshot) {
        state.f64s(&mut self.gains);
        state.f64(&mut self.time_s);
        state.flag(&mut self.known);
        let own: Vec<u32> = self.loaded.iter().map(|loaded| loaded.taxel).collect();
        let mut loaded = own.clone();
        for list in [&mut self.conducting, &mut loaded] {
            state.u32s(list);
            list.retain(|k| (*k as usize) < self.places.len());
        }
        if loaded != own {
            self.places.fill(0);
            self.loaded.clear();
            self.plays.clear();
            self.slow.clear();
            for taxel in loaded {
                self.load(taxel as usize);
            }
        }
        for loaded in &mut self.loaded {
            state.f64(&mut loaded.since_s);
            loaded.presses.exchange(state);
        }
        state.f64s(self.plays.iter_mut().chain(&mut self.slow));
    }

    fn boxed(&self) -> Box<dyn Transducer> {
        Box::new(self.clone())
    }

    fn start_session(&mut self, session: u64) {
        let [mut slopes, each] = ["velostat/tilt", "velostat/session"].map(|label| {
            let mut rng = self.streams.rng(label, session);
            move || -> f64 { StandardNormal.sample(&mut rng) }
        });
        let gains = self.mounting.factors(&self.skin, [slopes(), slopes()], each);
        self.gains = self.fixed.iter().zip(gains).map(|(fixed, session)| fixed * session).collect();
        self.places.fill(0);
        self.loaded.clear();
        self.plays.clear();
        self.slow.clear();
        self.conducting.clear();
        self.known = true;
        self.time_s = 0.0;
    }
}

// The static law: conductance as a function of a constant pressure.

/// Pressure at which [`VelostatConfig::reference_s`](crate::VelostatConfig::reference_s) is given, Pa.
pub const REFERENCE_PA: f64 = 10e3;

/// Power law of a saturating pressure:
///
/// G = G_ref · (S(P)/P_ref)ⁿ, S(P) = P/(1 + P/Ps), P_ref = 10 kPa.
///
/// For P ≪ Ps it is the power law A·Pⁿ with A = G_ref/P_refⁿ, as the resistance R = a·P⁻ᵇ of force-sensing resistors is
/// usually written. Saturating the pressure, rather than dividing the power law by (1 + P/Ps), keeps the law monotone
/// for every n < 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PressureLaw {
    reference_s: f64,
    exponent: f64,
    saturation_pa: f64,
}

impl PressureLaw {
    /// Law with G_ref in (0, 1] S, n in [0.05, 2] and Ps in [1, 1e12] Pa.
    ///
    /// # Errors
    /// [`Refusal`] for a value outside its range.
    pub(crate) fn new(reference_s: f64, exponent: f64, saturation_pa: f64) -> Result<Self, Refusal> {
        in_interval("reference_s", reference_s, "(0, 1]")?;
        in_interval("exponent", exponent, "[0.05, 2]")?;
        in_interval("saturation_pa", saturation_pa, "[1, 1e12]")?;
        Ok(Self { reference_s, exponent, saturation_pa })
    }

    /// Conductance under `pressure_pa` ≥ 0, S.
    #[inline]
    pub(crate) fn conductance_s(&self, pressure_pa: f64) -> f64 {
        let p = pressure_pa / (1.0 + pressure_pa / self.saturation_pa);
        self.reference_s * (p / REFERENCE_PA).powf(self.exponent)
    }
}

// Change of the conductance with temperature.

/// Temperature for which the law is given, °C.
pub const REFERENCE_C: f64 = 25.0;

/// Factor of the conductance at `temperature_c`, when the resistance has the temperature coefficient α =
/// `resistance_per_k`:
///
/// G(T)/G(25 °C) = exp(−α·(T − 25 °C)).
///
/// It solves dR/dT = α·R; the linear form R = R₂₅·(1 + α·ΔT) is its first order. Carbon black in polyethylene has a
/// positive coefficient (PTC): the matrix expands and parts the chains of particles. Exactly 1 at 25 °C. A sheet near
/// the melting point of its matrix (> 100 °C, a PTC switch) is not described.
///
/// # Errors
/// [`Refusal`] for a temperature outside [-45, 65] °C, the range of use of the sheet, or a coefficient outside
/// [-0.02, 0.02] 1/K.
pub(crate) fn conductance_factor(temperature_c: f64, resistance_per_k: f64) -> Result<f64, Refusal> {
    in_interval("temperature_c", temperature_c, "[-45, 65]")?;
    in_interval("resistance_per_k", resistance_per_k, "[-0.02, 0.02]")?;
    Ok((-resistance_per_k * (temperature_c - REFERENCE_C)).exp())
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Rf·Vd of the readout profile `as_built`, V/S.
    const VOLTS_PER_SIEMENS: f64 = 4300.0;

    fn volts(sheet: &mut Velostat, skin: &SkinLayout, pressure_pa: f64, dt_s: f64) -> f64 {
        let shape = (skin.rows(), skin.cols());
        let pressure = PressureMap::from_values(shape.0, shape.1, vec![pressure_pa; skin.taxels()]);
        let mut out = ConductanceMap::zeros(shape.0, shape.1);
        sheet.step(&pressure, dt_s, &mut out);
        let mean_s = out.sum() / skin.taxels() as f64;
        mean_s * VOLTS_PER_SIEMENS
    }

    /// Sums recorded at about 20 N: the brain model on 3 taxels 2.95 V, the rectangle on about 25 taxels 11.3 V; at the
    /// peak of a bounce, about 62 N on 4–9 taxels, 6.5 V. One exponent must do for all. 20 %: two published scales of
    /// one press (raster against compressive) differ by more.
    #[test]
    fn recorded_sums_are_matched() {
        let skin = SkinLayout::default();
        let conditioned = || {
            let mut sheet = Velostat::new(VelostatConfig::default(), &skin, Streams::new(1)).unwrap();
            for _press in 1..10 {
                volts(&mut sheet, &skin, 20e3, 1.0);
                sheet.rest(5.0);
            }
            sheet
        };
        for (force_n, taxels, hold_s, recorded_v) in
            [(20.0, 3.0, 1.0, 2.95), (20.0, 25.0, 1.0, 11.3), (62.0, 6.0, 4e-3, 6.5)]
        {
            let pressure_pa = force_n / taxels / skin.cell_area_m2();
            let sum_v = taxels * volts(&mut conditioned(), &skin, pressure_pa, hold_s);
            assert_relative_eq!(sum_v, recorded_v, max_relative = 0.2);
        }
    }

    /// A skin keeps its taxels through all sessions; a session changes them, and only it.
    #[test]
    fn the_spread_is_fixed_and_a_session_adds_to_it() {
        let skin = SkinLayout::new(100, 100, 15e-3, 10e-3).unwrap();
        let sheet = |seed, session_log_sd, session| {
            let config = VelostatConfig { session_log_sd, session_tilt_log_sd: 0.0, ..VelostatConfig::default() };
            let mut sheet = Velostat::new(config, &skin, Streams::new(seed)).unwrap();
            sheet.start_session(session);
            sheet.gains().collect::<Vec<_>>()
        };
        let fixed = sheet(1, 0.0, 0);
        assert_eq!(fixed, sheet(1, 0.0, 3));
        assert_ne!(fixed, sheet(2, 0.0, 0));
        let [a, b] = [3, 4].map(|session| sheet(1, 0.15, session));
        assert!(a == sheet(1, 0.15, 3) && a != b);
        // the fixed spread and two sessions are independent: the variances of the logarithms add, and between two
        // sessions only theirs are left. Standard error of the log-sd of n taxels: σ/√(2n); five of them.
        let log_sd = |pairs: &mut dyn Iterator<Item = f64>| (pairs.map(|g| g.ln().powi(2)).sum::<f64>() / 1e4).sqrt();
        let (total, between) = (0.30_f64.hypot(0.15), 0.15 * 2.0_f64.sqrt());
        assert_relative_eq!(log_sd(&mut a.iter().copied()), total, epsilon = 5.0 * total / (2e4_f64).sqrt());
        let ratios = &mut a.iter().zip(&b).map(|(a, b)| a / b);
        assert_relative_eq!(log_sd(ratios), between, epsilon = 5.0 * between / (2e4_f64).sqrt());
    }

    /// exp(−α·ΔT) on everything that conducts; one rounding each.
    #[test]
    fn a_warm_sheet_conducts_less() {
        let skin = SkinLayout::default();
        let sum_v = |temperature_c| {
            let config = VelostatConfig { temperature_c, unloaded_s: 1e-6, ..VelostatConfig::default() };
            volts(&mut Velostat::new(config, &skin, Streams::new(1)).unwrap(), &skin, 20e3, 1.0)
        };
        assert_relative_eq!(sum_v(45.0) / sum_v(25.0), (-0.004 * 20.0_f64).exp(), max_relative = 1e-14);
    }

    /// Memory persists: the first press is the weakest, and each later one gains a little.
    #[test]
    fn a_session_works_the_sheet_in() {
        let skin = SkinLayout::default();
        let mut sheet = Velostat::new(VelostatConfig::default(), &skin, Streams::new(1)).unwrap();
        let mut peaks = Vec::new();
        for _press in 0..10 {
            peaks.push(volts(&mut sheet, &skin, 20e3, 1.0));
            assert!(volts(&mut sheet, &skin, 0.0, 0.02) < 1e-9, "a released taxel conducts");
            sheet.rest(3.0);
        }
        assert!(peaks.windows(2).all(|w| w[0] < w[1]), "{peaks:?}");
        assert!((0.64..0.96).contains(&(peaks[0] / peaks[9])), "{peaks:?}");
    }

    /// The reference itself, the power law far below saturation (neglected: n·P/Ps = 5e-7) and the plateau far above it
    /// (n·Ps/P).
    #[test]
    fn the_law_has_its_limits() {
        let law = PressureLaw::new(1e-4, 0.5, 1e12).unwrap();
        assert_relative_eq!(law.conductance_s(REFERENCE_PA), 1e-4, max_relative = 1e-8);
        assert_relative_eq!(law.conductance_s(4e4) / law.conductance_s(1e4), 2.0, max_relative = 1e-7);
        let law = PressureLaw::new(1e-4, 0.5, 4e4).unwrap();
        assert_relative_eq!(law.conductance_s(1e9), 2e-4, max_relative = 0.5 * 4e4 / 1e9);
        assert!(law.conductance_s(0.0) <= 0.0);
    }

    /// First order in α·ΔT = 0.04: what is left is half its square.
    #[test]
    fn warmth_raises_the_resistance() {
        assert_relative_eq!(conductance_factor(25.0, 0.02).unwrap(), 1.0, epsilon = 0.0);
        let factor = conductance_factor(35.0, 0.004).unwrap();
        assert_relative_eq!(factor, 1.0 / 1.04, max_relative = 0.5 * 0.04 * 0.04);
        assert!(conductance_factor(35.0, -0.004).unwrap() > 1.0);
        assert!(conductance_factor(f64::NAN, 0.004).is_err());
    }
}
