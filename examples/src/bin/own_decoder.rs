//! A decoder of your own on the board beside those that ship, on the same windows and against the same truth. With an
//! argument, a program in any other language is scored as well.
//!
//! `cargo run --release --bin own_decoder -- ['NAME=COMMAND']`, such as `'ridge=python3 python/decoder.py'`

use examples::Result;
use spts::Refusal;
use spts_eval::algorithm::{Algorithm, Answer, Contender, DecodeError, Trained};
use spts_eval::board::{BoardSettings, find, table};
use spts_eval::external::ExternalCommand;
use spts_eval::training::{TrainingData, TrainingSource};
use spts_eval::{Sensing, Source, TwinSessions, Window};
use std::sync::Arc;

/// Projected gradient descent: steps towards Φ x = y, negative values set to zero after each. It learns nothing.
struct Descent {
    steps: usize,
}

impl Contender for Descent {
    fn name(&self) -> &str {
        "descent"
    }

    /// `data` holds the raster images that may be learned from.
    fn learn(
        &self,
        _data: &TrainingData,
        _labels: &spts_eval::Labels,
        _left_out: Option<&str>,
    ) -> std::result::Result<Arc<dyn Trained>, Refusal> {
        Ok(Arc::new(Self { steps: self.steps }))
    }
}

impl Trained for Descent {
    fn start(&self) -> Box<dyn Algorithm + '_> {
        Box::new(AtWork(self))
    }
}

struct AtWork<'a>(&'a Descent);

impl Algorithm for AtWork<'_> {
    fn decode(&mut self, window: &Window<'_>, answer: &mut Answer) -> std::result::Result<(), DecodeError> {
        let taxels = window.phi.ncols();
        let rows = || window.phi.values().chunks_exact(taxels);
        // weights are ±1: the largest eigenvalue of Φᵀ Φ is at most its trace, and for random signs near (√M + √N)²
        let largest = ((window.y.len() as f64).sqrt() + (taxels as f64).sqrt()).powi(2);
        answer.image = vec![0.0; taxels];
        for _ in 0..self.0.steps {
            let residuals = rows().zip(window.y).map(|(row, y)| {
                let seen: f64 = row.iter().zip(&answer.image).map(|(w, x)| w * x).sum();
                y - seen
            });
            let residuals: Vec<f64> = residuals.collect();
            for (row, residual) in rows().zip(residuals) {
                for (x, w) in answer.image.iter_mut().zip(row) {
                    *x += w * residual / largest;
                }
            }
            answer.image.iter_mut().for_each(|x| *x = x.max(0.0));
        }
        Ok(())
    }
}

fn main() -> Result<()> {
    let mut external: Vec<Arc<dyn Contender>> = vec![Arc::new(Descent { steps: 100 })];
    external.extend(std::env::args().nth(1).map(|text| Arc::new(ExternalCommand::parse(&text)) as Arc<dyn Contender>));

    // presses of the twin; `Source::open` takes recordings of a skin in their place
    let scenes = ["press/T", "press/rec", "press/tape"].map(str::to_owned).to_vec();
    let twin = TwinSessions { scenes, seed: 1, quick: true };
    let source = Source::new(twin.simulate(&|| ())?)?;
    let settings = BoardSettings {
        decoders: ["nn_lasso", "nn_lmmse"].into_iter().filter_map(find).collect(),
        external,
        measurements: vec![10, 20, 50],
        objects: Vec::new(),
        localisation: Vec::new(),
        left_out: false,
        training: vec![TrainingSource::Raster],
        sensing: vec![Sensing::Random],
        network: None,
        times: false,
        seed: 1,
    };
    println!("{}", table(&settings.learn(&source)?.score(&|| ())?));
    Ok(())
}
