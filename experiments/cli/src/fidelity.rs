//! `spts fidelity`: cost and error of every rung of the contact ladder.

use super::context::{Common, note, print, print_json};
use super::error::CliError;
use super::progress::Bars;
use clap::Args;
use spts::output::OutputFolder;
use spts_studies::fidelity::{FidelityStudy, SettingGrid};
use std::path::PathBuf;

/// Measures what every rung of the contact ladder costs and how wrong it is.
///
/// Runs every rung (footprint, winkler, layer_after, layer, half_space) at several resolutions and time steps on scenes with
/// known shapes (sphere, punch, edge), objects (T, tape, comb) and a ball drop, and compares each with the reference: layer,
/// coupled, at the finest. Errors: fine pressure and taxel pressure (relative RMS), and what reaches the user: support
/// accuracy, IoU and classification of single windows at M = 20, less the reference's, after transducer, readout and decoder.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts fidelity
  spts fidelity --scene T --scene drop --out out/look
  spts fidelity --scene my_scene.toml --cells 3,6 --json

Files in DIR:
  fidelity.csv               one line a scene, rung, resolution and time step; errors.csv the same without the costs
  summary.md                 means over the scenes
  refused.csv                settings beyond a scene's limits, and why
  figures/pareto.png         error against cost; figures/pressure.png the pressures themselves
  scenes/                    meshes that only this study has

A scene asks for an error instead of a rung with `tolerance = 0.02`: it takes the cheapest rung that the shipped table says
meets it on every scene of its kind.")]
pub(super) struct Fidelity {
    /// sphere, punch, edge, T, tape, comb, drop, or FILE.toml; repeat for several [default: all seven]
    #[arg(long, value_name = "SCENE")]
    scene: Vec<String>,
    /// Fine cells along one side of a taxel; each [1, 24] [default: 2,3,6,12,24]
    #[arg(long, value_delimiter = ',', value_name = "N,…", value_parser = clap::value_parser!(u16).range(1..=24))]
    cells: Vec<u16>,
    /// A look in less than a minute: two resolutions, one time step
    #[arg(long)]
    quick: bool,
    /// Folder of the results
    #[arg(long, value_name = "DIR", default_value = "out/fidelity")]
    out: PathBuf,
    /// Root of every random number: the skin, its noise and the arm's scatter follow from it
    #[arg(long, default_value_t = 1, value_name = "SEED")]
    seed: u64,
    #[command(flatten)]
    common: Common,
}

impl Fidelity {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), CliError> {
        self.common.start()?;
        let mut grid = if self.quick {
            SettingGrid::quick()
        } else {
            SettingGrid::full()
        };
        if !self.cells.is_empty() {
            let mut cells: Vec<usize> = self.cells.iter().copied().map(usize::from).collect();
            cells.sort_unstable();
            cells.dedup();
            grid.reference_cells = grid.reference_cells.max(cells[cells.len() - 1]);
            grid.cells_per_taxel = cells;
        }
        let study = FidelityStudy {
            scenes: self.scene,
            grid,
            seed: self.seed,
        };
        let staged = OutputFolder::create(&self.out)?.stage()?;
        let report = study.run(&staged.folder("scenes")?, &Bars::default())?;
        spts_report::fidelity::write(&report, &staged).map_err(|error| CliError::from(error).unstaged(&staged))?;
        staged.commit()?;
        if self.common.json {
            print_json(&report)?;
        } else {
            print(&report.text())?;
            print(&format!("pictures: {}", self.out.join("figures").display()))?;
        }
        for refusal in report.refusals.iter().take(3) {
            note(&format!(
                "refused: {} on {}: {}",
                refusal.scene, refusal.rung, refusal.reason
            ));
        }
        Ok(())
    }
}
