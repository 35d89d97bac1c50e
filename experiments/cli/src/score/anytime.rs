//! `spts score --anytime`: decoders that stop as soon as they are sure enough.

use super::super::context::{open_folder, print, print_json, progress, spinner};
use super::super::error::CliError;
use super::super::extras::write_anytime;
use super::super::options::sorted_numbers;
use super::{ScoreCommand, explained};
use spts_eval::anytime::{AnytimeBoard, FILES, StopSettings, table};
use spts_eval::board::BoardSettings;
use spts_eval::{ScoreError, Source};

/// Folder of the results when none is named.
const DEFAULT_OUT: &str = "out/anytime";

impl ScoreCommand {
    /// Runs the command with `--anytime`.
    pub(super) fn stop_early(&self) -> Result<(), CliError> {
        let wanted = self.wanted()?;
        self.common.start()?;
        let path = self.out(DEFAULT_OUT);
        let out = open_folder(path, FILES)?;
        let settings = self.settings()?;
        if let Some(spec) = settings.decoders.iter().find(|spec| !spec.anytime) {
            return Err(CliError::usage(ScoreError::no_confidence(spec.name).to_string()));
        }
        let source = self.source()?;
        let settings = BoardSettings {
            training: self.training(&source)?,
            ..settings
        };
        let board = stops(&settings, &wanted, &source)?;
        if self.common.json {
            print_json(&board)?;
        } else {
            print(&table(&board))?;
        }
        write_anytime(&board, out)?;
        if !self.common.json {
            print(&format!("\ntables and figures: {}", path.display()))?;
        }
        Ok(())
    }

    /// The wanted confidences.
    fn wanted(&self) -> Result<StopSettings, CliError> {
        if let Some(outside) = self.confidence.iter().find(|p| !(**p > 0.5 && **p < 1.0)) {
            return Err(CliError::usage(format!(
                "`--confidence` = {outside} is outside (0.5, 1)"
            )));
        }
        if self.confidence.is_empty() {
            return Ok(StopSettings::default());
        }
        let wanted = sorted_numbers(self.confidence.clone());
        Ok(StopSettings {
            class: wanted.clone(),
            image: wanted,
        })
    }
}

fn stops(settings: &BoardSettings, wanted: &StopSettings, source: &Source) -> Result<AnytimeBoard, CliError> {
    let learning = spinner("learning");
    let ready = settings.learn(source).map_err(|e| explained(&e, source))?;
    drop(learning);
    let bar = progress(ready.steps(), "presses");
    let board = ready.stops(wanted, &|| bar.inc(1));
    bar.finish_and_clear();
    board.map_err(|e| explained(&e, source))
}
