//! `spts validate`: the real skin's scores.

use crate::context::{Common, note, progress, spinner};
use crate::error::CliError;
use crate::options::parse_measurements;
use clap::Args;
use serde::Serialize;
use spts_eval::decoders::short_label;
use spts_eval::place::locator_label;
use spts_eval::{PublishedSkin, SkinScores, Table};
use std::path::PathBuf;

/// Scores recordings of the real skin.
///
/// Needs the published dictionary and library beside the recordings. Any subset of the 17 objects is enough; what is
/// missing is listed.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts validate recordings/
  spts validate recordings/ --measurements 5,10,20,25,50,100 --json > scores.json

Every command that reads recordings takes one of these paths (see docs/session.md):
  session                    a folder with session.json
  folder of sessions         all folders with session.json in it, at most three levels down
  published recordings       presses/NAME/NAME_raster.mat, NAME_random2.mat, NAME_random2_time.mat;
                             bounces/random2_tennis.mat; robot_arm/; dictionary.mat, permuted_dictionary.mat,
                             SRC_lib.mat
  published repository       the root of its clone, or its Data_Analysis/ with Measurements_Collected/,
                             Application_Data/, Dictionary_Learning/ and SRC_Library/
Only the last two have the dictionary and the library that `spts validate` needs. `spts score` scores sessions too.")]
pub(super) struct ValidateCommand {
    /// Published recordings, or the published repository: see below
    recordings: PathBuf,
    /// Numbers of measurements M to score; each [1, 1000]
    #[arg(long, value_delimiter = ',', value_name = "M,…", value_parser = parse_measurements,
          default_value = "2,3,5,7,10,13,15,20,25,30,40,50,75,100")]
    measurements: Vec<usize>,
    #[command(flatten)]
    common: Common,
}

/// What the command reports.
#[derive(Debug, Serialize)]
struct ValidationOutput {
    #[serde(flatten)]
    scores: SkinScores,
    missing: Vec<String>,
}

impl ValidateCommand {
    /// Runs the command.
    pub(super) fn run(&self) -> Result<(), CliError> {
        self.common.start()?;
        let reading = spinner("reading recordings");
        let real = PublishedSkin::open(&self.recordings)?;
        drop(reading);
        let report = score(&real, &self.measurements)?;
        self.common.print(&report, || table(&report))?;
        for missing in &report.missing {
            note(&format!("missing: {missing}"));
        }
        Ok(())
    }
}

fn score(real: &PublishedSkin, measurements: &[usize]) -> Result<ValidationOutput, CliError> {
    let bar = progress(real.skin.steps(), "scoring presses");
    let scores = real.skin.score(measurements, measurements, &[], &|| bar.inc(1));
    bar.finish_and_clear();
    Ok(ValidationOutput { scores: scores?, missing: real.missing.clone() })
}

fn table(report: &ValidationOutput) -> String {
    /// Decoder or baseline, M, and the scores of images and of classes.
    type Line<'a> = (&'a str, Option<usize>, [f64; 4], Option<[f64; 2]>);
    let scores = &report.scores;
    let rows = scores.rows.iter().filter(|r| r.object == "mean").map(|r| {
        let images = [r.support, r.iou, r.f1, r.balanced_accuracy];
        (r.decode, Some(r.m), images, Some([r.class_single, r.class_vote20]))
    });
    let baselines = scores.baselines.iter().filter(|b| b.object == "mean").map(|b| {
        let images = [b.support, b.iou, b.f1, b.balanced_accuracy];
        (b.baseline, None, images, None)
    });
    let lines: Vec<Line<'_>> = rows.chain(baselines).collect();
    let mut table = Table::new("scores", &lines).shown("decode", |line| short_label(line.0)).shown("M", |line| line.1);
    for (k, head) in ["support", "IoU", "F1", "balanced"].into_iter().enumerate() {
        table = table.shown(head, move |line| line.2[k]).digits(3);
    }
    for (k, head) in ["single", "vote of 20"].into_iter().enumerate() {
        table = table.shown(head, move |line| Some(line.3?[k])).digits(3);
    }
    let mut out = "mean over the objects with a compressive session (raster and baselines: all objects)\n".to_owned();
    out.push_str(&table.text());
    if !scores.localisation.is_empty() {
        let places = Table::new("places", &scores.localisation)
            .shown("decode", |l| locator_label(&l.decode))
            .shown("M", |l| l.m)
            .shown("mean", |l| l.mean_px)
            .digits(2)
            .shown("median", |l| l.median_px)
            .digits(2)
            .shown("share under 1", |l| l.share_under_1px)
            .digits(2);
        out.push_str(&format!("\nlocalisation of the bouncing ball, taxels\n{}", places.text()));
    }
    out.trim_end().to_owned()
}

#[cfg(test)]
mod tests {
    use crate::Cli;
    use clap::CommandFactory as _;
    use spts_eval::protocol::MEASUREMENTS;

    /// What is scored without the option is what the report scores.
    #[test]
    fn the_default_numbers_of_measurements_are_those_of_the_protocol() {
        let command = Cli::command();
        let validate = command.find_subcommand("validate").unwrap();
        let option = validate.get_arguments().find(|a| a.get_id() == "measurements").unwrap();
        assert_eq!(option.get_default_values()[0].to_str().unwrap(), MEASUREMENTS.map(|m| m.to_string()).join(","));
    }
}
