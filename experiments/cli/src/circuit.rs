//! `spts circuit`: theory of the summing amplifier for a skin of any size.

use crate::context::{Common, open_folder};
use crate::error::CliError;
use crate::options::{number, whole, within};
use clap::Args;
use serde::Serialize;
use spts_circuit::amplifier::{Network, Remedied, Skin};
use spts_report::electronics::{TABLE_TAXELS, text, write};
use spts_studies::electronics::ElectronicsStudy;
use std::path::PathBuf;

/// Computes noise, bandwidth, settling, saturation and signal of the summing amplifier for a skin of any size, and what
/// larger skins need.
///
/// Closed forms for the profile as_designed (TLV9362 and the published converter), checked against ngspice by the
/// tests. The skin is assumed to be pressed on a quarter of its taxels; a measurement is taken to work when the output
/// settles to half a step of the converter in time, four standard deviations of the sum stay within rails and
/// converter, and a pressed taxel is worth a step. Three remedies stand beside the readout as built: feedback scaled by
/// 100/N, sub-arrays with second-level sums, and as many wires as are needed.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts circuit
  spts circuit --taxels 10000
  spts circuit --taxels 100 --bus-pf 10000 --json
  spts circuit --taxel-pf 20 --pressed 0.1 --out out/soft

Files in DIR (without --taxels):
  circuit.csv                one line a size and readout, 100 … 1 000 000 taxels; volts are at the last amplifier's
                             output
  parameters.json            what they were computed with
  figures/circuit.png        settling, sum, signal to noise, noise by source; circuit.svg the same")]
pub(super) struct CircuitCommand {
    /// Number of taxels; [1, 1000000000]: prints this size only and writes nothing [default: a table over 100 … 1 000
    /// 000]
    #[arg(long, value_name = "N", value_parser = whole::<u32>(1..=1_000_000_000))]
    taxels: Option<u32>,
    /// Share of the taxels that is pressed; [0, 1]
    #[arg(long, value_name = "SHARE", default_value_t = 0.25, value_parser = within(0.0, 1.0, "[0, 1]"))]
    pressed: f64,
    /// Conductance of a pressed taxel, µS; [0, 1e6]
    #[arg(long, value_name = "US", default_value_t = 150.0, value_parser = within(0.0, 1e6, "[0, 1e6] µS"))]
    pressed_us: f64,
    /// Conductance of an idle taxel, µS; [0, 1e6]
    #[arg(long, value_name = "US", default_value_t = 1.0, value_parser = within(0.0, 1e6, "[0, 1e6] µS"))]
    idle_us: f64,
    /// Drive at level 1, V; [1e-3, 1e3] [default: the profile's 3.3]
    #[arg(long, value_name = "V", value_parser = within(1e-3, 1e3, "[1e-3, 1e3] V"))]
    drive_v: Option<f64>,
    /// Feedback resistance, ohm; [1e-9, 1e9] [default: the profile's 1000]
    #[arg(long, value_name = "OHM", value_parser = within(1e-9, 1e9, "[1e-9, 1e9] ohm"))]
    feedback_ohm: Option<f64>,
    /// Capacitance across the feedback, pF; [0, 1e6] [default: the profile's 0]
    #[arg(long, value_name = "PF", value_parser = within(0.0, 1e6, PICOFARADS))]
    feedback_pf: Option<f64>,
    /// Capacitance of each bus without its taxels, pF; [0, 1e6] [default: the profile's 0]
    #[arg(long, visible_alias = "cin-pf", value_name = "PF", value_parser = within(0.0, 1e6, PICOFARADS))]
    bus_pf: Option<f64>,
    /// Capacitance that every taxel adds to its bus, pF; [0, 1e6], and a bus with all of them has 1e12 (1 F) at most
    #[arg(long, value_name = "PF", default_value_t = 0.0, value_parser = within(0.0, 1e6, PICOFARADS))]
    taxel_pf: f64,
    /// Measurements a second, Hz [default: the profile's 67000]
    #[arg(long, value_name = "HZ", value_parser = number)]
    rate_hz: Option<f64>,
    /// Taxels, or amplifiers of the level below, on one amplifier of a tree; [2, 1000000]
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = whole::<u32>(2..=1_000_000))]
    sub_array: u32,
    /// Folder of the results
    #[arg(long, value_name = "DIR", default_value = "out/circuit")]
    out: PathBuf,
    #[command(flatten)]
    common: Common,
}

/// Range of the capacitances.
const PICOFARADS: &str = "[0, 1e6] pF";

/// One size as JSON: the readout as built, and the other ways beside it.
#[derive(Debug, Serialize)]
struct OneSize<'a> {
    available_s: f64,
    one_wire_taxels: Option<u32>,
    #[serde(flatten)]
    as_built: &'a Remedied,
    remedies: &'a [Remedied],
}

impl CircuitCommand {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), CliError> {
        self.common.start()?;
        let study = self.study()?;
        let available_s = study.available_s()?;
        let one_wire_taxels = study.largest_on_one_wire()?;
        let one_wire = study.one_wire_text(one_wire_taxels);
        if let Some(taxels) = self.taxels {
            let ways = study.of(taxels)?;
            let (as_built, remedies) =
                ways.split_first().ok_or_else(|| CliError::usage("no way to read a skin".to_owned()))?;
            let one = OneSize { available_s, one_wire_taxels, as_built, remedies };
            let text = || format!("{}\n{one_wire}", text(&ways, available_s));
            return self.common.print(&one, text);
        }
        let out = open_folder(&self.out)?;
        let report = study.run()?;
        write(&study, &report, out)?;
        let picture = self.out.join("figures/circuit.png");
        self.common.print(&report, || {
            let shown = report.rows.iter().filter(|r| TABLE_TAXELS.contains(&r.taxels));
            let shown: Vec<Remedied> = shown.cloned().collect();
            format!("{}\n{one_wire}\npicture: {}", text(&shown, available_s), picture.display())
        })
    }

    /// The profile as_designed with the options in place of its numbers.
    fn study(&self) -> Result<ElectronicsStudy, CliError> {
        let designed = ElectronicsStudy::as_designed()?;
        let or = |picofarad: Option<f64>, farad: f64| picofarad.map_or(farad, |pf| pf * 1e-12);
        Ok(ElectronicsStudy {
            network: Network {
                feedback_ohm: self.feedback_ohm.unwrap_or(designed.network.feedback_ohm),
                feedback_f: or(self.feedback_pf, designed.network.feedback_f),
                bus_f: or(self.bus_pf, designed.network.bus_f),
                ..designed.network
            },
            taxel_f: self.taxel_pf * 1e-12,
            skin: Skin {
                pressed_share: self.pressed,
                pressed_s: self.pressed_us * 1e-6,
                idle_s: self.idle_us * 1e-6,
                drive_v: self.drive_v.unwrap_or(designed.skin.drive_v),
            },
            rate_hz: self.rate_hz.unwrap_or(designed.rate_hz),
            sub_array: self.sub_array,
            ..designed
        })
    }
}
