//! The amplifier's closed forms for skins of all sizes, with every remedy.

use super::error::ElectronicsError;
use serde::Serialize;
use spts_circuit::Adc;
use spts_circuit::amplifier::{Amplifier, Network, OpAmp, Remedied, Remedy, Setting, Skin, fewest_wires, remedied};

/// Sizes of a report.
const SWEEP_TAXELS: [u32; 13] = [
    100, 200, 500, 1000, 2000, 5000, 10_000, 20_000, 50_000, 100_000, 200_000, 500_000, 1_000_000,
];

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
/// # Ok::<(), spts_studies::electronics::ElectronicsError>(())
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
    /// [`ElectronicsError::Rate`] if the rate leaves no time, or is not positive.
    pub fn available_s(&self) -> Result<f64, ElectronicsError> {
        let available_s = 1.0 / self.rate_hz - self.busy_s;
        if self.rate_hz >= 1.0 && available_s > 0.0 {
            return Ok(available_s);
        }
        Err(ElectronicsError::Rate {
            rate_hz: self.rate_hz,
            busy_s: self.busy_s,
        })
    }

    /// A skin of `taxels` taxels with every remedy.
    ///
    /// # Errors
    /// [`ElectronicsError`], with the value outside its range.
    pub fn of(&self, taxels: u32) -> Result<Vec<Remedied>, ElectronicsError> {
        let setting = Setting {
            skin: self.skin,
            adc: self.adc,
            available_s: self.available_s()?,
        };
        let bus_f = self.bus_f(taxels);
        if !(0.0..=LARGEST_BUS_F).contains(&bus_f) {
            return Err(ElectronicsError::BusCapacitance {
                taxels,
                bus_f,
                largest_f: LARGEST_BUS_F,
            });
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
        let ways = ways.collect::<Result<_, spts_models::ConfigError>>();
        Ok(ways?)
    }

    /// Capacitance of a bus with `taxels` taxels, F.
    fn bus_f(&self, taxels: u32) -> f64 {
        self.network.bus_f + f64::from(taxels) * self.taxel_f
    }

    /// Amplifier of a bus with `taxels` taxels.
    pub(super) fn amplifier(&self, taxels: u32) -> Result<Amplifier, spts_models::ConfigError> {
        let network = Network {
            bus_f: self.bus_f(taxels),
            ..self.network
        };
        Amplifier::new(self.op_amp, network)
    }

    /// Noise, settling and range of skins of thirteen sizes, from 100 to a million taxels: as built and with every
    /// remedy.
    ///
    /// # Errors
    /// As [`ElectronicsStudy::of`].
    pub fn run(&self) -> Result<ElectronicsReport, ElectronicsError> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use spts_circuit::Profile;
    use spts_circuit::amplifier::Budget;

    /// Every number of wires one by one, against what the search finds. 2 and 20 nF of the bus itself ring for longer
    /// with fewer taxels, 1 nF a taxel is slower with more of them.
    #[test]
    fn no_smaller_number_of_wires_works() {
        let profile = Profile::named("as_designed").unwrap();
        let adc: Adc = profile.compressive["adc"].clone().try_into().unwrap();
        for (taxel_pf, bus_nf, taxels) in [
            (0.0, 0.0, 3000_u32),
            (20.0, 0.0, 3000),
            (20.0, 2.0, 1000),
            (1000.0, 0.0, 500),
            (3.0, 20.0, 400),
        ] {
            let study = ElectronicsStudy {
                op_amp: OpAmp::default(),
                network: Network {
                    bus_f: bus_nf * 1e-9,
                    ..Network::default()
                },
                taxel_f: taxel_pf * 1e-12,
                skin: Skin::default(),
                rate_hz: 67e3,
                busy_s: 5e-6,
                sub_array: 100,
                adc,
            };
            let setting = Setting {
                skin: study.skin,
                adc: study.adc,
                available_s: study.available_s().unwrap(),
            };
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
}
