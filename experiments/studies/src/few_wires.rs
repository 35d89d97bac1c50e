//! What one wire, and a few, would show of given touches, with random and with designed rows.

use crate::design::{BandRows, RowSource};
use crate::touches::TouchWire;
use rayon::prelude::*;
use serde::Serialize;
use spts::progress::Progress;
use spts_circuit::{Mode, Profile};
use spts_eval::algorithm::{Algorithm, Answer, Trained};
use spts_eval::decoders::{DecoderSpec, auto};
use spts_eval::training::TrainingData;
use spts_eval::{Press, PressRows};
use spts_input::Refusal;
use spts_models::{ConductanceMap, SkinLayout, Streams};
use spts_recon::Matrix;
use spts_recon::matrix_free::SheetPrior;
use spts_recon::metrics::SupportScore;
use std::sync::Arc;

/// Touches, and the wires that are to read them.
#[derive(Debug, Clone)]
pub struct FewWiresStudy {
    /// The skin.
    pub layout: SkinLayout,
    /// Name and conductances of every touch, S, above those of the untouched skin.
    pub touches: Vec<(String, ConductanceMap)>,
    /// Readout profile of every wire.
    pub profile: Profile,
    /// Numbers of wires; each reads a band of whole rows of the skin.
    pub wires: Vec<usize>,
    /// Numbers of measurements that every wire takes for an image.
    pub measurements: Vec<usize>,
    /// Root of every random number.
    pub seed: u64,
}

/// One number of wires and of measurements with rows of one kind.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FewWires {
    /// Wires.
    pub wires: usize,
    /// Kind of the rows: random or a designer's.
    pub rows: String,
    /// Measurements of every wire.
    pub m_per_wire: usize,
    /// Measurements of all wires.
    pub m: usize,
    /// Time of the measurements, s.
    pub time_s: f64,
    /// Mean IoU of image and touch over the touches.
    pub iou: f64,
    /// IoU of the worst touch.
    pub worst_iou: f64,
    /// Name of the worst touch.
    pub worst: String,
    /// Share of samples at an end of the amplifier's or the converter's range.
    pub saturated: f64,
    /// Largest sample of a touch as a share of that range; `None` for a readout without one.
    pub used: Option<f64>,
    /// Root mean square of the samples of a touch by the standard deviation of those of the untouched skin.
    pub signal_to_noise: Option<f64>,
    /// The decoded images, touch by touch, V.
    #[serde(skip)]
    pub images: Vec<Vec<f64>>,
}

/// Results of a study.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct FewWiresReport {
    /// Decoder of all images.
    pub decoder: &'static str,
    /// Time of a scan of all taxels by one wire, s.
    pub scan_s: f64,
    /// Number of touches.
    pub touches: usize,
    /// What was asked for and cannot be: more measurements than taxels, or than rows of a pattern. As "wires ×
    /// measurements rows".
    pub left_out: Vec<String>,
    /// By wires, then rows, then measurements.
    pub rows: Vec<FewWires>,
}

/// Measurements of the untouched skin that noise is estimated from.
const IDLE: usize = 200;
/// Number of the first of them; touches have numbers far below.
const IDLE_NUMBER: u64 = 1 << 30;
/// Length over which the images that rows are designed for are smooth, taxels.
const SMOOTH: f64 = 1.0;

/// Samples of a bench: touch by touch, and what they say of the electronics.
struct Measured {
    volts: Vec<Vec<f64>>,
    saturated: f64,
    used: Option<f64>,
    signal_to_noise: Option<f64>,
}

impl FewWiresStudy {
    /// Measures and decodes all touches. The result depends only on the study, not on the number of threads.
    ///
    /// # Errors
    /// [`Refusal`] for a skin too large for the decoders, more wires than rows of taxels, or what the readout refuses.
    pub fn run(&self, progress: &dyn Progress) -> Result<FewWiresReport, Refusal> {
        let layout = &self.layout;
        for &wires in &self.wires {
            if !(1..=layout.rows()).contains(&wires) {
                let range = format!("[1, {}], as every wire reads whole rows of taxels", layout.rows());
                return Err(Refusal::range("--wires", wires, range));
            }
        }
        progress.stage("learning", None);
        let spec = auto([layout.rows(), layout.cols()], false);
        let streams = Streams::new(self.seed);
        let data = if spec.needs.shapes() {
            TrainingData::for_shapes(layout, streams)?
        } else {
            TrainingData::for_layout(layout, streams)?
        };
        let trained = (spec.train)(&data)?;
        let (mut benches, mut left_out) = (Vec::new(), Vec::new());
        for &wires in &self.wires {
            let taxels = layout.rows().div_ceil(wires) * layout.cols();
            for source in RowSource::candidates(taxels) {
                let most = source.most_rows(taxels);
                for &m in &self.measurements {
                    if m <= most && m.saturating_mul(wires) <= layout.taxels() {
                        benches.push((wires, source.clone(), m));
                    } else {
                        left_out.push(format!("{wires} × {m} {}", source.name()));
                    }
                }
            }
        }
        if benches.is_empty() {
            let range = format!("[1, {}] on one wire, and in all at most as many", layout.taxels());
            return Err(Refusal::range("--measurements", format!("{:?}", self.measurements), range));
        }
        progress.stage("decoding", Some(benches.len()));
        let rows = benches.into_iter().map(|(wires, source, m)| {
            let row = self.bench(wires, &source, m, spec, &*trained);
            progress.step();
            row
        });
        let rows = rows.collect::<Result<Vec<_>, _>>()?;
        progress.end();
        Ok(FewWiresReport {
            decoder: spec.name,
            scan_s: layout.taxels() as f64 / self.profile.sample_rate_hz,
            touches: self.touches.len(),
            left_out,
            rows,
        })
    }

    fn bench(
        &self,
        wires: usize,
        source: &RowSource,
        m_per_wire: usize,
        spec: &DecoderSpec,
        trained: &dyn Trained,
    ) -> Result<FewWires, Refusal> {
        let prior = SheetPrior::smooth([self.layout.rows(), self.layout.cols()], SMOOTH)?;
        let rows = BandRows::new(source, &prior, wires, m_per_wire, self.seed)?;
        let (phi, _) = rows.rows(0..m_per_wire);
        let m = m_per_wire * wires;
        let phi = Arc::new(PressRows::of_matrix(&Matrix::from_rows(m, self.layout.taxels(), phi)?));
        let measured = self.measured(&rows, m_per_wire)?;
        let decode = |algorithm: &mut Box<dyn Algorithm + '_>, volts| {
            let press = Press::on(Arc::clone(&phi), volts, 0.0);
            let mut answer = Answer::default();
            if let Some(window) = press.window(0, m) {
                let decoded = algorithm.decode(&window, &mut answer);
                decoded.map_err(|e| Refusal::from_error(e).at(spec.name))?;
            }
            answer.image.resize(self.layout.taxels(), 0.0);
            Ok(answer.image)
        };
        // one decoder a thread, with its workspace
        let images = measured.volts.into_par_iter().map_init(|| trained.start(), decode);
        let images = images.collect::<Result<Vec<Vec<f64>>, Refusal>>()?;
        let scores: Vec<f64> = self
            .touches
            .iter()
            .zip(&images)
            .map(|((_, touch), image)| SupportScore::of_images(image, touch.values()).iou)
            .collect();
        let worst = (0..scores.len()).min_by(|a, b| scores[*a].total_cmp(&scores[*b]));
        Ok(FewWires {
            wires,
            rows: source.name().to_owned(),
            m_per_wire,
            m,
            time_s: m_per_wire as f64 / self.profile.sample_rate_hz,
            iou: scores.iter().sum::<f64>() / scores.len().max(1) as f64,
            worst_iou: worst.map_or(0.0, |k| scores[k]),
            worst: worst.map_or_else(String::new, |k| self.touches[k].0.clone()),
            saturated: measured.saturated,
            used: measured.used,
            signal_to_noise: measured.signal_to_noise,
            images,
        })
    }

    /// Samples of all touches: by measurement, then by wire.
    fn measured(&self, rows: &BandRows, m_per_wire: usize) -> Result<Measured, Refusal> {
        let (layout, wires) = (&self.layout, rows.bands.len());
        let cols = layout.cols();
        let mut volts = vec![vec![0.0; wires * m_per_wire]; self.touches.len()];
        let rail_v = self.profile.rail_v(Mode::Compressive)?;
        let converter = self.profile.converter(Mode::Compressive)?;
        let end_v = converter.map(|c| c.volts(0).abs().max(c.volts(c.max_code()).abs()));
        let range = rail_v.into_iter().chain(end_v).reduce(f64::min);
        let (mut saturated, mut largest) = (0, 0.0_f64);
        let (mut noise, mut signal) = (0.0, 0.0);
        for (wire, (band, weights)) in rows.bands.iter().zip(&rows.weights).enumerate() {
            let part = SkinLayout::new(band.len(), cols, layout.pitch_m(), layout.electrode_m())?;
            let device = Streams::new(self.seed).child("few-wires/wire", wire as u64);
            let mut line = TouchWire::new(&self.profile, weights, &part, device)?;
            let info = line.info().clone();
            let bare = ConductanceMap::zeros(band.len(), cols);
            let idle = line.measure(bare, IDLE_NUMBER, IDLE)?;
            noise += idle.iter().map(|v| v * v).sum::<f64>() / (IDLE * wires) as f64;
            for ((number, (_, touch)), volts) in (0..).zip(&self.touches).zip(&mut volts) {
                let own = touch.values()[band.start * cols..band.end * cols].to_vec();
                let samples = line.measure(ConductanceMap::from_values(band.len(), cols, own), number, m_per_wire)?;
                let raw: Vec<f64> = samples.iter().map(|v| v + line.idle_v()).collect();
                largest = raw.iter().fold(largest, |largest, v| largest.max(v.abs()));
                saturated += info.saturated(&raw, rail_v);
                for (k, v) in samples.into_iter().enumerate() {
                    signal += v * v / (volts.len() * self.touches.len()) as f64;
                    volts[k * wires + wire] = v;
                }
            }
        }
        let samples = volts.iter().map(Vec::len).sum::<usize>().max(1);
        Ok(Measured {
            saturated: saturated as f64 / samples as f64,
            used: range.map(|range| largest / range),
            signal_to_noise: (noise > 0.0).then(|| (signal / noise).sqrt()),
            volts,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn study(wires: Vec<usize>) -> FewWiresStudy {
        let layout = SkinLayout::default();
        let block = |first: usize| {
            let on = |k: usize| (first..first + 3).contains(&(k / 10)) && (4..7).contains(&(k % 10));
            ConductanceMap::from_values(10, 10, (0..100).map(|k| if on(k) { 1e-4 } else { 0.0 }).collect())
        };
        FewWiresStudy {
            layout,
            touches: vec![("high".to_owned(), block(1)), ("low".to_owned(), block(6))],
            profile: Profile::named("ideal").unwrap(),
            wires,
            measurements: vec![25, 50, 99],
            seed: 1,
        }
    }

    /// With as many measurements as taxels nearly everything is seen. What a wire cannot take, such as 99 rows of a
    /// pattern of 64, is left out.
    #[test]
    fn touches_are_seen() {
        let report = study(vec![1, 2]).run(&()).unwrap();
        let of = |wires, rows: &str| {
            let own = report.rows.iter().filter(|r| r.wires == wires && r.rows == rows);
            own.map(|r| (r.m_per_wire, r.m, r.iou)).collect::<Vec<_>>()
        };
        let (one, two) = (of(1, "random"), of(2, "random"));
        assert_eq!(one.iter().map(|r| r.0).collect::<Vec<_>>(), [25, 50, 99]);
        assert_eq!(two.iter().map(|r| (r.0, r.1)).collect::<Vec<_>>(), [(25, 50), (50, 100)]);
        assert_eq!(of(1, "cosine_signs").iter().map(|r| r.0).collect::<Vec<_>>(), [25, 50]);
        assert!(one[2].2 > 0.95 && two[1].2 > 0.95, "{one:?} {two:?}");
        assert!(report.rows.iter().all(|r| r.saturated == 0.0 && r.worst_iou <= r.iou));
        assert_eq!(report, study(vec![1, 2]).run(&()).unwrap());
        let refused = study(vec![11]).run(&()).unwrap_err().to_string();
        assert!(refused.contains("`--wires` = 11 is outside [1, 10]"), "{refused}");
    }
}
