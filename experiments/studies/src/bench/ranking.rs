//! Whether decoders rank on the tasks as they do on recordings of a real skin.

use super::card::{Card, Interval, spread};
use super::{SUITE, Track};
use rand::RngExt as _;
use serde::Serialize;
use spts_eval::board::{ObjectRow, ScoreBoard};
use spts_eval::training::SHAPES;
use spts_eval::{Sensing, unique};
use spts_input::Refusal;
use spts_models::Streams;
use spts_recon::statistics::mean;

/// Tasks with the images of unseen objects on a skin of the recordings' size.
const TASKS: [&str; 4] = ["small", "thin", "broad", "middle"];
/// Draws of the bootstrap over the objects.
const RESAMPLES: u64 = 1000;

/// A decoder on the tasks and on recordings.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Ranked {
    /// Name.
    pub entrant: String,
    /// Mean points of the tasks small, thin, broad and middle.
    pub points: f64,
    /// Intersection over union on the recordings, each object left out: mean over objects and numbers of measurements.
    pub iou: f64,
    /// The object with the least, and its mean.
    pub worst: (String, f64),
}

/// Two rankings of decoders, and how far they agree.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Ranking {
    /// The best on the recordings first.
    pub decoders: Vec<Ranked>,
    /// Kendall's τ_b of the two rankings, with its 95 % interval over the objects.
    pub tau: Interval,
}

impl Ranking {
    /// Of the decoders that both `cards` and the board of `spts score DIR --left-out` have. Of a decoder with several
    /// lines, that which learned from shapes counts.
    ///
    /// # Errors
    /// [`Refusal`] for fewer than three decoders, or boards without objects that were left out.
    pub fn new(cards: &[Card], board: &ScoreBoard) -> Result<Self, Refusal> {
        let left_out = |row: &&ObjectRow| row.key.left_out && row.key.sensing == Sensing::Random;
        let rows: Vec<&ObjectRow> = board.objects.iter().filter(left_out).collect();
        let objects = unique(rows.iter().map(|row| row.object.as_str()));
        let mut decoders = Vec::new();
        let mut scores: Vec<Vec<f64>> = Vec::new();
        for card in cards.iter().filter(|card| card.track == Track::Decoder) {
            let own: Vec<&&ObjectRow> = rows.iter().filter(|row| row.key.decoder == card.entrant).collect();
            let shapes = own.iter().any(|row| row.key.learned_from == SHAPES);
            let of = |object: &str| {
                let here = own.iter().filter(|row| row.object == object);
                let here = here.filter(|row| !shapes || row.key.learned_from == SHAPES);
                mean(here.filter_map(|row| row.scores.iou))
            };
            let tasks = card.tasks.iter().filter(|task| TASKS.contains(&task.task.as_str()));
            let points = mean(tasks.map(|task| task.points.mean));
            let each: Option<Vec<f64>> = objects.iter().map(|object| of(object)).collect();
            if let (Some(points), Some(each)) = (points, each) {
                let worst = objects.iter().zip(&each).min_by(|a, b| a.1.total_cmp(b.1));
                let worst = worst.map_or_else(Default::default, |(object, iou)| ((*object).to_owned(), *iou));
                let iou = mean(&each).unwrap_or(0.0);
                decoders.push(Ranked { entrant: card.entrant.clone(), points, iou, worst });
                scores.push(each);
            }
        }
        if decoders.len() < 3 || objects.is_empty() {
            let found = decoders.len();
            let problem = format!(
                "{found} decoders are on the cards of {SUITE} and among the objects that were left out; valid: at least 3"
            );
            return Err(Refusal::new(problem));
        }
        let points: Vec<f64> = decoders.iter().map(|d| d.points).collect();
        let tau = |drawn: &[usize]| {
            let iou = scores.iter().map(|each| drawn.iter().map(|&k| each[k]).sum::<f64>());
            kendall(&points, &iou.collect::<Vec<f64>>())
        };
        let all: Vec<usize> = (0..objects.len()).collect();
        let drawn = (0..RESAMPLES).map(|draw| {
            let mut rng = Streams::new(1).rng("bench/ranking", draw);
            tau(&all.iter().map(|_| rng.random_range(0..all.len())).collect::<Vec<usize>>())
        });
        let tau = spread(tau(&all), drawn.collect());
        decoders.sort_by(|a, b| b.iou.total_cmp(&a.iou));
        Ok(Self { decoders, tau })
    }
}

/// Kendall's τ_b: concordant minus discordant pairs, over √ of the pairs without ties in either.
/// Source: M. Kendall, Biometrika 33 (1945) 239.
fn kendall(a: &[f64], b: &[f64]) -> f64 {
    let (mut sum, mut untied) = (0.0, [0.0; 2]);
    for i in 0..a.len() {
        for j in 0..i {
            let signs = [a[i] - a[j], b[i] - b[j]].map(|d| if d == 0.0 { 0.0 } else { d.signum() });
            sum += signs[0] * signs[1];
            untied.iter_mut().zip(signs).for_each(|(untied, sign)| *untied += sign * sign);
        }
    }
    sum / (untied[0] * untied[1]).sqrt().max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against `scipy.stats.kendalltau` of SciPy 1.17: 0.7857142857142858.
    #[test]
    fn tau_is_scipys() {
        let a = [0.5, 0.1, 0.9, 0.4, 0.4, 0.7];
        let b = [3.0, 1.0, 6.0, 2.0, 4.0, 4.0];
        assert!((kendall(&a, &b) - 11.0 / 14.0).abs() < 1e-12, "{}", kendall(&a, &b));
        assert!((kendall(&a, &a) - 1.0).abs() < 1e-12);
        let reversed: Vec<f64> = a.iter().map(|v| -v).collect();
        assert!((kendall(&a, &reversed) + 1.0).abs() < 1e-12);
        assert!(kendall(&[1.0, 1.0], &[1.0, 2.0]).abs() < 1e-12);
    }
}
