//! `spts score --in-time`: contacts that are followed in time.

use super::super::context::{open_folder, print, print_json, progress, spinner};
use super::super::error::CliError;
use super::super::extras::write_in_time;
use super::{ScoreCommand, explained};
use spts_eval::board::BoardSettings;
use spts_eval::in_time::{FILES, InTimeBoard, table};
use spts_eval::{ScoreError, Sensing, Source};

/// Folder of the results when none is named.
const DEFAULT_OUT: &str = "out/in_time";

/// The default numbers of measurements.
pub(super) const MEASUREMENTS: [usize; 4] = [5, 7, 10, 20];

impl ScoreCommand {
    /// Runs the command with `--in-time`.
    pub(super) fn follow_in_time(&self) -> Result<(), CliError> {
        self.common.start()?;
        let path = self.out(DEFAULT_OUT);
        let out = open_folder(path, FILES)?;
        let settings = self.settings()?;
        if let Some(spec) = settings.decoders.iter().find(|spec| spec.name != "nn_lmmse") {
            return Err(CliError::usage(ScoreError::not_in_time(spec.name).to_string()));
        }
        if settings.sensing != [Sensing::Random] {
            let reason = "chosen rows have no order in time; leave it out with `--in-time`";
            return Err(CliError::usage(format!("`--sensing`: {reason}")));
        }
        let source = self.source()?;
        let settings = BoardSettings {
            training: self.training(&source)?,
            ..settings
        };
        let board = followed(&settings, &source)?;
        if self.common.json {
            print_json(&board)?;
        } else {
            print(&table(&board))?;
        }
        write_in_time(&board, out)?;
        if !self.common.json {
            print(&format!("\ntables and figures: {}", path.display()))?;
        }
        Ok(())
    }
}

fn followed(settings: &BoardSettings, source: &Source) -> Result<InTimeBoard, CliError> {
    let learning = spinner("learning");
    let ready = settings.learn(source).map_err(|e| explained(&e, source))?;
    drop(learning);
    let bar = progress(ready.steps(), "presses");
    let board = ready.in_time(&|| bar.inc(1));
    bar.finish_and_clear();
    board.map_err(|e| explained(&e, source))
}
