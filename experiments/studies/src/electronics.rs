//! The summing amplifier with skins of any size, in closed form, and what larger skins need.

use serde::{Deserialize, Serialize};
use spts_circuit::amplifier::{
    Amplifier, Budget, Network, OpAmp, Remedied, Remedy, Setting, Skin, fewest_wires, remedied,
};
use spts_circuit::{Adc, Profile};
use spts_input::Refusal;
use spts_models::parsed;

/// Sizes of a report.
const SWEEP_TAXELS: [u32; 13] =
    [100, 200, 500, 1000, 2000, 5000, 10_000, 20_000, 50_000, 100_000, 200_000, 500_000, 1_000_000];

/// Largest capacitance of a bus, F, as [`Network`] says.
const LARGEST_BUS_F: f64 = 1.0;

/// Settings of `spts circuit`: amplifier, skin, clock and converter, for which noise, settling and range follow from
/// closed forms.
///
/// ```
/// use spts_studies::electronics::ElectronicsStudy;
///
/// let study = ElectronicsStudy::as_designed()?;
/// let small = study.of(100)?;
/// assert!(small[0].budget.limit.is_none(), "100 taxels work on one wire");
/// assert!(study.of(100_000)?[0].budget.limit.is_some());
/// # Ok::<(), spts_input::Refusal>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ElectronicsStudy {
    /// Operational amplifier of every stage.
    pub op_amp: OpAmp,
    /// The passive parts around the first amplifier.
    pub network: Network,
    /// Capacitance that every taxel adds to its bus, F. Range [0, 1e-6], and 1 F for all taxels of a bus.
    pub taxel_f: f64,
    /// Skin.
    pub skin: Skin,
    /// Measurements a second, Hz.
    pub rate_hz: f64,
    /// Part of every period in which the output cannot settle, s: before the drives change, and after the sampling.
    pub busy_s: f64,
    /// Number of taxels, or of amplifiers of the level below, on one amplifier of a tree.
    pub sub_array: u32,
    /// Converter.
    #[serde(skip)]
    pub adc: Adc,
}

impl ElectronicsStudy {
    /// Time available for settling, s.
    ///
    /// # Errors
    /// [`Refusal`] if the rate leaves no time, or is not positive.
    pub fn available_s(&self) -> Result<f64, Refusal> {
        let available_s = 1.0 / self.rate_hz - self.busy_s;
        if self.rate_hz >= 1.0 && available_s > 0.0 {
            return Ok(available_s);
        }
        Err(Refusal::new(format!(
            "`rate-hz` = {} is outside [1, {:.0}): {:.3} µs of every period are spent before the drives change and after the sampling",
            self.rate_hz,
            1.0 / self.busy_s,
            self.busy_s * 1e6
        )))
    }

    /// A skin of `taxels` taxels with every remedy.
    ///
    /// # Errors
    /// [`Refusal`], with the value outside its range.
    pub fn of(&self, taxels: u32) -> Result<Vec<Remedied>, Refusal> {
        let setting = self.setting()?;
        let bus_f = self.bus_f(taxels);
        if !(0.0..=LARGEST_BUS_F).contains(&bus_f) {
            return Err(Refusal::new(format!(
                "`--bus-pf` + {taxels} · `--taxel-pf` = {:.3e} pF is outside [0, {:e}] pF",
                bus_f * 1e12,
                LARGEST_BUS_F * 1e12
            )));
        }
        let ways = Remedy::ALL.into_iter().map(|remedy| {
            // a bus has the capacitance of its own taxels: fewer on a sub-array and on each of several wires
            let on_bus = match remedy {
                Remedy::AsBuilt | Remedy::FeedbackScaled => taxels,
                Remedy::SubArrays => taxels.min(self.sub_array),
                Remedy::Wires => {
                    return fewest_wires(taxels, &setting, &|on_bus| self.amplifier(on_bus));
                }
            };
            remedied(&self.amplifier(on_bus)?, taxels, self.sub_array, remedy, &setting)
        });
        ways.collect()
    }

    /// How a skin is pressed and sampled.
    fn setting(&self) -> Result<Setting, Refusal> {
        Ok(Setting { skin: self.skin, adc: self.adc, available_s: self.available_s()? })
    }

    /// Capacitance of a bus with `taxels` taxels, F.
    fn bus_f(&self, taxels: u32) -> f64 {
        self.network.bus_f + f64::from(taxels) * self.taxel_f
    }

    /// Amplifier of a bus with `taxels` taxels.
    fn amplifier(&self, taxels: u32) -> Result<Amplifier, Refusal> {
        let network = Network { bus_f: self.bus_f(taxels), ..self.network };
        Amplifier::new(self.op_amp, network)
    }

    /// Noise, settling and range of skins of thirteen sizes, from 100 to a million taxels: as built and with every
    /// remedy.
    ///
    /// # Errors
    /// As [`ElectronicsStudy::of`].
    pub fn run(&self) -> Result<ElectronicsReport, Refusal> {
        let sizes = SWEEP_TAXELS.into_iter().map(|taxels| self.of(taxels));
        Ok(ElectronicsReport {
            available_s: self.available_s()?,
            one_wire_taxels: self.largest_on_one_wire()?,
            rows: sizes.collect::<Result<Vec<_>, _>>()?.concat(),
        })
    }
}

/// Results of `spts circuit`: skins of all sizes as built, and with every remedy for large skins.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ElectronicsReport {
    /// Time available for settling, s.
    pub available_s: f64,
    /// Largest number of taxels on one wire, [`ElectronicsStudy::largest_on_one_wire`].
    pub one_wire_taxels: Option<u32>,
    /// Ordered by size, then in the order of [`Remedy::ALL`].
    pub rows: Vec<Remedied>,
}

/// Taxels, or amplifiers of the level below, on one amplifier of a tree: those of the skin as built.
const SUB_ARRAY: u32 = 100;

impl ElectronicsStudy {
    /// The profile `as_designed`, with the default pressed skin.
    ///
    /// # Errors
    /// [`Refusal`] if the profile has no amplifier or no converter.
    pub fn as_designed() -> Result<Self, Refusal> {
        /// The amplifier of the profile.
        #[derive(Deserialize)]
        struct Parts {
            #[serde(default)]
            op_amp: OpAmp,
            feedback_f: f64,
            bus_f: f64,
            temperature_k: f64,
            update_s: f64,
            sample_s: f64,
        }
        let designed = |error: &dyn std::fmt::Display| Refusal::new(format!("profile as_designed: {error}"));
        let profile = Profile::named("as_designed").map_err(|e| designed(&e))?;
        let stage = |stage: &str| {
            let table = profile.compressive.get(stage).and_then(|stage| stage.as_table().cloned());
            table.ok_or_else(|| designed(&format_args!("no table `compressive.{stage}`")))
        };
        let parts: Parts = parsed(stage("amplifier")?).map_err(|e| designed(&e))?;
        Ok(Self {
            op_amp: parts.op_amp,
            network: Network {
                feedback_ohm: profile.feedback_ohm,
                feedback_f: parts.feedback_f,
                bus_f: parts.bus_f,
                temperature_k: parts.temperature_k,
                ..Network::default()
            },
            taxel_f: 0.0,
            skin: Skin { drive_v: profile.drive_v, ..Skin::default() },
            rate_hz: profile.sample_rate_hz,
            busy_s: parts.update_s + 1.0 / profile.sample_rate_hz - parts.sample_s,
            sub_array: SUB_ARRAY,
            adc: parsed(stage("adc")?).map_err(|e| designed(&e))?,
        })
    }
}

/// Ratio of the sizes that are looked at, one after another.
const RATIO: f64 = 1.01;

impl ElectronicsStudy {
    /// The largest number of taxels, pressed as in [`ElectronicsStudy::skin`], with which nothing fails on one wire. It
    /// depends only on the electronics and that pressing. `None` if something fails with any number.
    ///
    /// More taxels are not always worse: with a capacitance on the bus, their conductance damps the ringing. Therefore
    /// all sizes are tried in steps of 1 %, and the interval between the largest that works and the next is bisected. A
    /// range of working sizes that is narrower than a step may be missed.
    ///
    /// ```
    /// use spts_studies::electronics::ElectronicsStudy;
    ///
    /// let designed = ElectronicsStudy::as_designed()?;
    /// let largest = designed.largest_on_one_wire()?.expect("small skins work");
    /// // the amplifier reads that many without a remedy, and not one more
    /// assert!(designed.of(largest)?[0].budget.limit.is_none());
    /// assert!(designed.of(largest + 1)?[0].budget.limit.is_some());
    /// # Ok::<(), spts_input::Refusal>(())
    /// ```
    ///
    /// # Errors
    /// As [`ElectronicsStudy::of`].
    pub fn largest_on_one_wire(&self) -> Result<Option<u32>, Refusal> {
        self.skin.validate()?;
        let setting = self.setting()?;
        // a bus of too large a capacitance is none
        let works = |taxels: u32| {
            let amplifier = self.amplifier(taxels);
            amplifier.is_ok_and(|a| Budget::new(&a, f64::from(taxels), &setting).limit.is_none())
        };
        #[expect(clippy::cast_possible_truncation, reason = "float to integer casts saturate")]
        let next = |taxels: &u32| Some((f64::from(*taxels) * RATIO).ceil() as u32).filter(|next| next > taxels);
        let sizes: Vec<u32> = std::iter::successors(Some(1), next).collect();
        let Some(at) = sizes.iter().rposition(|taxels| works(*taxels)) else {
            return Ok(None);
        };
        let (mut most, mut too_many) = (sizes[at], sizes.get(at + 1).copied().unwrap_or(sizes[at]));
        while too_many > most + 1 {
            let middle = most + (too_many - most) / 2;
            if works(middle) {
                most = middle;
            } else {
                too_many = middle;
            }
        }
        Ok(Some(most))
    }

    /// Describes the result of [`ElectronicsStudy::largest_on_one_wire`].
    pub fn one_wire_text(&self, taxels: Option<u32>) -> String {
        let works = match taxels {
            Some(taxels) => format!("up to {taxels} taxels"),
            None => "with no number of taxels".to_owned(),
        };
        let short = |number: f64| (number * 1e4).round() / 1e4;
        let [pressed, pressed_us, idle_us] =
            [100.0 * self.skin.pressed_share, self.skin.pressed_s * 1e6, self.skin.idle_s * 1e6].map(short);
        format!("one wire works {works}, {pressed} % of them pressed to {pressed_us} µS, the others at {idle_us} µS")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every number of wires one by one, against what the search finds. 2 and 20 nF of the bus itself ring for longer
    /// with fewer taxels, 1 nF a taxel is slower with more of them.
    #[test]
    fn no_smaller_number_of_wires_works() {
        let profile = Profile::named("as_designed").unwrap();
        let adc: Adc = profile.compressive["adc"].clone().try_into().unwrap();
        for (taxel_pf, bus_nf, taxels) in
            [(0.0, 0.0, 3000_u32), (20.0, 0.0, 3000), (20.0, 2.0, 1000), (1000.0, 0.0, 500), (3.0, 20.0, 400)]
        {
            let study = ElectronicsStudy {
                op_amp: OpAmp::default(),
                network: Network { bus_f: bus_nf * 1e-9, ..Network::default() },
                taxel_f: taxel_pf * 1e-12,
                skin: Skin::default(),
                rate_hz: 67e3,
                busy_s: 5e-6,
                sub_array: 100,
                adc,
            };
            let setting = Setting { skin: study.skin, adc: study.adc, available_s: study.available_s().unwrap() };
            let fits = |on_bus: u32| {
                let amplifier = study.amplifier(on_bus).unwrap();
                Budget::new(&amplifier, f64::from(on_bus), &setting).limit.is_none()
            };
            let works = |wires: u32| fits(taxels.div_ceil(wires)) && fits(taxels / wires);
            let expected = (1..taxels).find(|&wires| works(wires)).unwrap_or(taxels);
            let ways = study.of(taxels).unwrap();
            let found = ways.iter().find(|way| way.remedy == Remedy::Wires).unwrap();
            assert_eq!(found.wires, expected, "{taxel_pf} pF, {bus_nf} nF, {taxels} taxels");
        }
    }

    /// By hand: four standard deviations of the sum, 4 · Rf · Vd · √(N · ¼ · G²), reach the 14.9 V of the rails before
    /// anything else does. The idle taxels' part is below a ten-thousandth of it.
    #[test]
    fn the_rails_end_a_wire_as_designed() {
        let study = ElectronicsStudy::as_designed().unwrap();
        let largest = study.largest_on_one_wire().unwrap().unwrap();
        let volts = 4.0 * 1000.0 * 3.3 * 150e-6;
        let by_hand = (14.9_f64 / volts).powi(2) / 0.25;
        assert!((f64::from(largest) - by_hand).abs() <= 1.0, "{largest} {by_hand}");
        assert_eq!(
            study.one_wire_text(Some(largest)),
            format!("one wire works up to {largest} taxels, 25 % of them pressed to 150 µS, the others at 1 µS")
        );
    }

    #[test]
    fn there_may_be_none() {
        let study = ElectronicsStudy {
            skin: Skin { pressed_s: 1e-9, ..Skin::default() },
            ..ElectronicsStudy::as_designed().unwrap()
        };
        // a taxel is far below a step of the converter, whatever the size
        assert_eq!(study.largest_on_one_wire().unwrap(), None);
    }
}
