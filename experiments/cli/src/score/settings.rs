//! What the options of `spts score` stand for: the sessions, the training data and the settings of the board.

use super::super::context::note;
use super::super::error::CliError;
use super::super::extras::simulated_sessions;
use super::super::options::{decoders_named, network, sorted};
use super::training::{SimulatedSkins, training_source};
use super::{ScoreCommand, in_time};
use spts_eval::algorithm::Contender;
use spts_eval::board::BoardSettings;
use spts_eval::decoders::DECODERS;
use spts_eval::external::ExternalCommand;
use spts_eval::training::{SHAPES, TrainedNetwork, TrainingSource};
use spts_eval::{Source, slips_text};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

impl ScoreCommand {
    /// The sessions that are scored; a note says which of them slip.
    pub(super) fn source(&self) -> Result<Source, CliError> {
        let source = match &self.twin {
            Some(scenes) => simulated_sessions(scenes, self.seed, self.quick)?,
            None => Source::open(self.recordings.as_deref().unwrap_or(Path::new("")))?,
        };
        if let Some(text) = slips_text(&source.slips) {
            note(&format!("note: {text}"));
        }
        Ok(source)
    }

    /// What is learned from to score `scored`.
    pub(super) fn training(&self, scored: &Source) -> Result<Vec<TrainingSource>, CliError> {
        let mut skins = SimulatedSkins::default();
        if self.left_out && self.learn_from.iter().any(|name| name.ends_with(".toml")) {
            note(
                "note: gains in a file may have been fitted to the objects that are left out; `calibrated` leaves them out",
            );
        }
        let training = self.learn_from.iter();
        training
            .map(|name| training_source(name, scored, self.seed, &mut skins))
            .collect()
    }

    /// The same without decoders that nobody named and that have no weights for the skin.
    pub(super) fn fitting(&self, mut settings: BoardSettings, scored: &Source) -> BoardSettings {
        let layout = &scored.layout;
        let fits = TrainedNetwork::shipped().on([layout.rows(), layout.cols()]);
        if let (true, None, Err(error)) = (self.decoder.is_empty(), &self.weights, fits) {
            let before = settings.decoders.len();
            settings.decoders.retain(|spec| spec.name != "amortised");
            if settings.decoders.len() < before {
                note(&format!("note: left out: {error}"));
            }
        }
        settings
    }

    /// What is scored, but for what it learns from.
    pub(super) fn settings(&self) -> Result<BoardSettings, CliError> {
        let decoders = if self.decoder.is_empty() {
            if self.in_time {
                decoders_named(&["nn_lmmse".to_owned()])?
            } else if self.anytime {
                DECODERS.iter().filter(|spec| spec.anytime && spec.shown).collect()
            } else if self.external.is_empty() {
                let shapes = self.learn_from.iter().any(|name| name == SHAPES);
                let unseen = DECODERS.iter().filter(|spec| shapes && spec.needs.shapes());
                BoardSettings::shown().into_iter().chain(unseen).collect()
            } else {
                Vec::new()
            }
        } else {
            decoders_named(&self.decoder)?
        };
        let external = self.external.iter().map(|text| ExternalCommand {
            limit: Duration::from_secs_f64(self.external_timeout),
            ..ExternalCommand::parse(text)
        });
        let external: Vec<Arc<dyn Contender>> = external.map(|e| Arc::new(e) as Arc<dyn Contender>).collect();
        let names = decoders.iter().map(|d| d.name).chain(external.iter().map(|e| e.name()));
        let names: Vec<&str> = names.collect();
        if let Some((k, name)) = names.iter().enumerate().find(|(k, name)| names[..*k].contains(*name)) {
            let option = if k < decoders.len() { "--decoder" } else { "--external" };
            return Err(CliError::usage(format!(
                "`{option}`: {name:?} is there twice; give every one a name of its own"
            )));
        }
        let mut measurements: Vec<usize> = self.measurements.iter().map(|m| *m as usize).collect();
        if measurements.is_empty() {
            measurements = if self.in_time {
                in_time::MEASUREMENTS.to_vec()
            } else {
                BoardSettings::MEASUREMENTS.to_vec()
            };
        }
        Ok(BoardSettings {
            decoders,
            external,
            measurements: sorted(measurements),
            objects: self.object.clone(),
            localisation: if self.no_ball || self.anytime {
                Vec::new()
            } else {
                BoardSettings::LOCALISATION.to_vec()
            },
            left_out: self.left_out,
            sensing: sorted(self.sensing.clone()),
            training: Vec::new(),
            network: self.weights.as_deref().map(network).transpose()?,
            times: !self.no_times,
            seed: self.seed,
        })
    }
}
