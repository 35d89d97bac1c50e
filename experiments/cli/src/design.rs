//! `spts design`: a skin for what somebody wants of it, and the check of its promise.

use crate::context::{Bars, Common, open_folder};
use crate::error::CliError;
use crate::options::{LENGTHS, length, seed, whole, with_unit, within};
use clap::{Args, Subcommand};
use spts_report::design::{read_design, write};
use spts_studies::design::{DesignObjects, DesignStudy, WireChoice};
use std::path::PathBuf;

/// Designs a skin for a wanted area, resolution, latency and image quality: its taxels, wires, electronics, rows of
/// weights and decoder, and what to expect of them.
///
/// The answer is simulated: touches of other specimens go through the design's own circuit (amplifier and converter of
/// the profile as_designed, with the contact noise, late updates and idle noise of the recordings), and are decoded and
/// scored. `spts design check DIR` checks the promise with touches that the design has not seen. See docs/design.md.
///
/// Where no skin reaches the IoU, the answer is the best there is, under the heading NOT REACHABLE (--json: `reached`),
/// and the exit status is 0 as well.
#[derive(Debug, Args)]
#[command(
    args_conflicts_with_subcommands = true,
    after_help = "Examples:
  spts design --area 0.15x0.15 --resolution 15mm --latency 2ms --iou 0.7 --objects large
  spts design --area 0.3x0.2 --resolution 5mm --latency 5ms --iou 0.8
  spts design --area 0.5x0.5 --resolution 5mm --latency 2ms --iou 0.8 --most-wires 4 --out out/sheet --json
  spts design --area 0.15x0.15 --resolution 15mm --latency 2ms --iou 0.7 --objects random-shapes
  spts design check out/design
  spts design check out/design --seed 7 --json
  spts simulate out/design/scene.toml

Objects:
  small        procedural shapes of 20 to 40 mm
  large        procedural shapes of 40 to 90 mm
  DATASET      the name of a data set's spec (spts dataset specs), a spec file ending in .toml, or a folder that `spts
               dataset make` has written. Its sections [object] and [pose] say what is pressed: shapes or the seventeen
               objects, their sizes, their places and how many at once. No meshes and no balls

Files in DIR:
  design.json           the answer, as --json prints it
  profile.toml          the readout of all wires, with its rows: for --readout, and for `readout = ` in a scene
  scene.toml            one press on the skin, with all of its wires: spts simulate DIR/scene.toml
  rows.txt              the pattern of all taxels, where rows are designed
  curves.csv            IoU and place error for every number of measurements that was tried
  figures/design.png    IoU and place error against time, the target, the latency and the design; design.svg the same"
)]
pub(super) struct DesignCommand {
    #[command(subcommand)]
    check: Option<DesignAction>,
    #[command(flatten)]
    new: NewDesign,
}

#[derive(Debug, Subcommand)]
enum DesignAction {
    Check(CheckCommand),
}

/// A design that is asked for.
#[derive(Debug, Args)]
struct NewDesign {
    /// Width and height of the sheet, as 30cmx20cm or, in metres, 0.3x0.2; each [0.001, 10] m
    #[arg(long, value_name = "WxH", value_parser = area, required = true)]
    area: Option<[f64; 2]>,
    /// Distance of neighbouring taxels, as 5mm, 0.5cm or, in metres, 0.005; [0.0001, 1] m. Each side of the area,
    /// divided by this distance, must give 2 to 256 taxels
    #[arg(long, value_name = "LENGTH", value_parser = length, required = true)]
    resolution: Option<f64>,
    /// Longest time in which all measurements of an image may be taken, as 5ms, 500us or, in seconds, 0.005; [1e-6, 10]
    /// s. The decoder's time does not count; it is estimated and printed separately
    #[arg(long, value_name = "TIME", value_parser = time, required = true)]
    latency: Option<f64>,
    /// Intersection over union that the images have to reach on average; [0.01, 0.99]
    #[arg(long, value_name = "IOU", value_parser = within(0.01, 0.99, "[0.01, 0.99]"), default_value_t = 0.8)]
    iou: f64,
    /// Exact number of wires; [1, 256], at most one a row of taxels [default: as few as suffice, up to --most-wires]
    #[arg(long, value_name = "N", value_parser = whole::<usize>(1..=256), conflicts_with = "most_wires")]
    wires: Option<usize>,
    /// Most wires that the design may have; it takes as few as suffice; [1, 256]
    #[arg(long, value_name = "N", value_parser = whole::<usize>(1..=256), default_value_t = 16)]
    most_wires: usize,
    /// What is pressed: small, large or DATASET, see below
    #[arg(long, value_name = "OBJECTS", default_value = "small")]
    objects: String,
    /// Number of objects that are pressed at once; [1, 10] [default: that of a DATASET, else 1]
    #[arg(long, value_name = "N", value_parser = whole::<usize>(1..=10))]
    contacts: Option<usize>,
    /// Root of every random number
    #[arg(long, default_value_t = 1, value_name = "SEED", value_parser = seed)]
    seed: u64,
    /// Folder of the results
    #[arg(long, value_name = "DIR", default_value = "out/design")]
    out: PathBuf,
    #[command(flatten)]
    common: Common,
}

/// Checks a design: simulates the designed skin with new touches, specimens, parts and noise, and says whether the
/// results are as the design promised.
///
/// The exit status is 0 when every quantity lies in its promised band, 1 when one does not, and 2 after an error.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts design check out/design
  spts design check out/design --seed 7 --json")]
struct CheckCommand {
    /// Folder that `spts design` has written
    #[arg(value_name = "DIR")]
    design: PathBuf,
    /// Root of every random number of the check
    #[arg(long, default_value_t = 2, value_name = "SEED", value_parser = seed)]
    seed: u64,
    #[command(flatten)]
    common: Common,
}

/// Width and height, m.
fn area(text: &str) -> Result<[f64; 2], String> {
    let side = |word: &str| with_unit(word.trim(), &LENGTHS).filter(|m| (1e-3..=10.0).contains(m));
    let found = text.split_once(['x', '×']).and_then(|(width, height)| Some([side(width)?, side(height)?]));
    found.ok_or_else(|| "is not WIDTHxHEIGHT with both in [0.001, 10] m".to_owned())
}

/// A time, s.
fn time(text: &str) -> Result<f64, String> {
    let found = with_unit(text, &[("ms", 1e-3), ("us", 1e-6), ("µs", 1e-6), ("s", 1.0)]);
    let range = found.filter(|s| (1e-6..=10.0).contains(s));
    range.ok_or_else(|| "is not a time in [1us, 10s], as 5ms or 0.005".to_owned())
}

impl DesignCommand {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), CliError> {
        match self.check {
            Some(DesignAction::Check(check)) => check.run(),
            None => self.new.run(),
        }
    }
}

impl NewDesign {
    fn run(self) -> Result<(), CliError> {
        self.common.start()?;
        let (Some(area_m), Some(pitch_m), Some(latency_s)) = (self.area, self.resolution, self.latency) else {
            return Err(CliError::usage("--area, --resolution and --latency are needed".to_owned()));
        };
        let study = DesignStudy {
            area_m,
            pitch_m,
            latency_s,
            iou: self.iou,
            wires: self.wires.map_or(WireChoice::UpTo(self.most_wires), WireChoice::Exactly),
            objects: DesignObjects::named(&self.objects)?.at_once(self.contacts),
            seed: self.seed,
        };
        study.layout()?;
        let out = open_folder(&self.out)?;
        let report = study.run(&Bars::default())?;
        write(&report, out)?;
        let text = || {
            let folder = self.out.display();
            format!(
                "{}\ncheck it:    spts design check {folder}\nsimulate it: spts simulate {folder}/scene.toml\npicture:     {folder}/figures/design.png",
                spts_report::design::text(&report)
            )
        };
        self.common.print(&report, text)
    }
}

impl CheckCommand {
    fn run(self) -> Result<(), CliError> {
        self.common.start()?;
        let check = read_design(&self.design, self.seed)?;
        let report = check.run(&Bars::default())?;
        self.common.print(&report, || spts_report::design::check_text(&report))?;
        if report.agrees {
            return Ok(());
        }
        let wrong = report.quantities.iter().filter(|q| !q.agrees).map(|q| q.quantity);
        Err(CliError::Differs(format!(
            "{}: outside of what was promised: {}",
            self.design.display(),
            wrong.collect::<Vec<_>>().join("; ")
        )))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_times_and_areas() {
        let near = |found: Result<f64, String>, expected: f64| (found.unwrap() - expected).abs() < 1e-12;
        assert!(near(length("5mm"), 5e-3) && near(length("0.005"), 5e-3) && near(length("5e-3m"), 5e-3));
        assert!(near(length("0.5cm"), 5e-3) && near(time("5ms"), 5e-3) && near(time("500us"), 5e-4));
        assert!(near(time("0.005"), 5e-3) && near(time("5e-3s"), 5e-3));
        for wrong in ["", "mm", "nan", "-5mm", "0", "inf", "2m", "5 apples"] {
            assert!(length(wrong).is_err() && time(&wrong.replace("2m", "20s")).is_err(), "{wrong}");
        }
        for right in ["0.3x0.2", "30cmx20cm", "300mm × 0.2m"] {
            assert!(area(right).is_ok_and(|a| (a[0] - 0.3).abs() + (a[1] - 0.2).abs() < 1e-12), "{right}");
        }
        for wrong in ["0.3", "0x0.2", "nanx1", "0.3x", "11x1", "0.3x0.2x0.1"] {
            assert!(area(wrong).is_err(), "{wrong}");
        }
    }
}
