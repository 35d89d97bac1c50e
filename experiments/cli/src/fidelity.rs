//! `spts fidelity`: cost and error of every fidelity level of the contact.

use crate::context::{Bars, Common, note, open_folder};
use crate::error::CliError;
use crate::options::{Side, number, seed, sorted, square, whole};
use clap::Args;
use spts_input::Refusal;
use spts_studies::fidelity::{FidelityStudy, SettingGrid};
use spts_studies::tolerances::ToleranceStudy;
use std::path::PathBuf;

/// Measures the cost and the error of every fidelity level of the contact.
///
/// There are five fidelity levels, from the cheapest to the dearest: foam columns under a press at rest (footprint),
/// foam columns that move (winkler), an elastic layer that is solved for the recorded frames only (layer_after), the
/// same layer solved at every step (layer), and an elastic half-space (half_space). Each runs at several resolutions
/// and time steps, on known shapes (sphere, punch, edge), on objects (T, tape, comb) and on a ball drop. The reference
/// is `layer` at its finest.
///
/// Two kinds of error are reported. One is the relative RMS error of the pressure, on the grid squares and per taxel.
/// The other is what a user sees: the change of support accuracy, IoU and classification at M = 20, after transducer,
/// readout and decoder.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts fidelity
  spts fidelity --scene T --scene drop --out out/look
  spts fidelity --scene my_scene.toml --cells 3,6 --json
  spts fidelity --taxels 1024
  spts fidelity --tolerances 0.05,0.1,0.2

Files in DIR:
  fidelity.csv               one line per scene, fidelity level (column `rung`), resolution and time step
  errors.csv                 the same without the costs
  summary.md                 means over the scenes
  refused.csv                settings beyond a scene's limits, and why
  figures/pareto.png         error against cost; figures/pressure.png the pressures themselves
  scenes/                    meshes of the scenes that only this study has

  tolerances.csv             with --tolerances, beside summary.md alone: one line per scene and tolerance

A scene can limit the error instead of naming a fidelity level: `spts simulate press/T --tolerance 0.05`, or `tolerance
= 0.05` in its file. Then every level is tried on the scene's own contact, and the cheapest that keeps to it is taken.")]
pub(super) struct FidelityCommand {
    /// sphere, punch, edge, T, tape, comb, drop, or FILE.toml; repeat for several [default: all seven]
    #[arg(long, value_name = "SCENE")]
    scene: Vec<String>,
    /// Taxels of the skin of built-in scenes, which is as large as the published one: a square number in [16, 16384].
    /// On other skins than the published one: at the default time steps alone, on at most 384 squares a side
    #[arg(long, value_name = "N", default_value = "100", value_parser = square(4..=128))]
    taxels: Side,
    /// Resolutions: grid squares along one side of a taxel; each [1, 24] [default: 2,3,6,12,24]
    #[arg(long, value_delimiter = ',', value_name = "N,…", value_parser = whole::<u16>(1..=24))]
    cells: Vec<u16>,
    /// A short run of less than a minute: two resolutions, one time step
    #[arg(long)]
    quick: bool,
    /// Instead: measures whether errors that are asked for are kept, on scenes drawn from all objects on foams of 2, 6
    /// and 30 mm, 10⁶ to 10⁸ Pa/m, pitches of 15, 5 and 3 mm, and forces of 1, 20 and 100 N; each [0.03, 1]
    /// [default: none]
    #[arg(long, value_delimiter = ',', value_name = "E,…", value_parser = number, conflicts_with_all = ["scene", "cells", "quick", "taxels"])]
    tolerances: Vec<f64>,
    /// Number of scenes for --tolerances
    #[arg(long, value_name = "N", default_value_t = 60, value_parser = whole::<u16>(1..=5000), requires = "tolerances")]
    scenes: u16,
    /// Folder of the results
    #[arg(long, value_name = "DIR", default_value = "out/fidelity")]
    out: PathBuf,
    /// Root of every random number: of the skin's gains, the readout's noise, and the arm's deviations from press to
    /// press
    #[arg(long, default_value_t = 1, value_name = "SEED", value_parser = seed)]
    seed: u64,
    #[command(flatten)]
    common: Common,
}

impl FidelityCommand {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), CliError> {
        self.common.start()?;
        if !self.tolerances.is_empty() {
            let (tolerances, scenes) = (self.tolerances, usize::from(self.scenes));
            let report = ToleranceStudy { tolerances, scenes, seed: self.seed }.run(&Bars::default())?;
            spts_report::fidelity::write_tolerances(&report, open_folder(&self.out)?)?;
            return self.common.print(&report, || spts_report::fidelity::tolerances_text(&report));
        }
        let side = self.taxels.0;
        let most = SettingGrid::most_cells(side);
        let mut grid = if self.quick { SettingGrid::quick() } else { SettingGrid::of(side) };
        grid.cells_per_taxel.retain(|cells| *cells <= most);
        grid.reference_cells = grid.reference_cells.min(most);
        if !self.cells.is_empty() {
            let cells: Vec<usize> = sorted(self.cells.iter().copied().map(usize::from).collect());
            if let Some(cells) = cells.iter().find(|cells| **cells > most) {
                return Err(
                    Refusal::range("--cells", cells, format!("[1, {most}] with --taxels {}", side * side)).into()
                );
            }
            grid.reference_cells = grid.reference_cells.max(cells[cells.len() - 1]);
            grid.cells_per_taxel = cells;
        }
        let study = FidelityStudy { scenes: self.scene, side, grid, seed: self.seed };
        let out = open_folder(&self.out)?;
        let report = study.run(&out.folder("scenes")?, &Bars::default())?;
        spts_report::fidelity::write(&report, out)?;
        let folder = self.out.join("figures");
        let text = || format!("{}\npictures: {}", spts_report::fidelity::text(&report), folder.display());
        self.common.print(&report, text)?;
        for refusal in report.refusals.iter().take(3) {
            note(&format!("refused: {} on {}: {}", refusal.scene, refusal.level, refusal.reason));
        }
        Ok(())
    }
}
