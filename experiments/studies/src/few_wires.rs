//! What one wire, and a few, would show of given touches, with random and with designed rows.

use crate::design::{BandRows, RowSource};
use crate::touches::TouchWire;
use rayon::prelude::*;
use serde::Serialize;
use spts::progress::Progress;
use spts_circuit::{Mode, Profile};
use spts_eval::algorithm::{Algorithm, Answer, Class, Trained};
use spts_eval::decoders::{DecoderSpec, auto, find};
use spts_eval::training::TrainingData;
use spts_eval::{Press, PressRows, unique};
use spts_input::Refusal;
use spts_models::{ConductanceMap, SkinLayout, Streams};
use spts_recon::Matrix;
use spts_recon::matrix_free::SheetPrior;
use spts_recon::metrics::SupportScore;
use spts_recon::statistics::mean;
use std::sync::Arc;

/// One touch: what the frames have of it, and what a scan has.
#[derive(Debug, Clone)]
pub struct Touched {
    /// Name.
    pub name: String,
    /// What was pressed.
    pub object: String,
    /// Conductance of every taxel above that of the untouched skin, S.
    pub conductance: ConductanceMap,
    /// A scan of all taxels, V; without the output of the untouched skin.
    pub scan: Vec<f64>,
}

/// Touches, and the wires that are to read them.
#[derive(Debug, Clone)]
pub struct FewWiresStudy {
    /// The skin.
    pub layout: SkinLayout,
    /// The touches, object by object.
    pub touches: Vec<Touched>,
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
    /// Mean IoU by a decoder that has learned from every other touch of the other objects, over the remaining touches;
    /// `None` for fewer than [`FEWEST_OBJECTS`] objects of two touches.
    pub left_out_iou: Option<f64>,
    /// Share of the remaining touches whose object is recognised by what the others of all objects look like.
    pub classes: Option<f64>,
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
    /// Number of objects.
    pub objects: usize,
    /// Mean IoU of the scan with the touch; `None` without a comparison.
    pub scan_iou: Option<f64>,
    /// As [`FewWires::classes`], of the scan.
    pub scan_classes: Option<f64>,
    /// Mean IoU of a touch with the one before of the same object; `None` without two touches of one.
    pub again_iou: Option<f64>,
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

/// Fewest objects of which every other touch teaches decoders, which are asked for the others.
pub const FEWEST_OBJECTS: usize = 3;

/// Decoders that have learned from every other touch of the objects.
struct Taught {
    /// Number of the object of every touch.
    object: Vec<usize>,
    /// Whether a touch was learned from.
    seen: Vec<bool>,
    /// Of every object an image decoder that has learned from the others.
    others: Vec<Box<dyn Trained>>,
    /// Classes from 0, in order of the objects.
    classes: Box<dyn Trained>,
}

/// Decoder of objects that were left out, and that of classes.
const LEFT_OUT: &str = "nn_lmmse";
const CLASSES: &str = "evidence";

impl Taught {
    /// Learns from `touches` on a sheet of `cols` columns, whose images are `volts_per_siemens` times their
    /// conductances; `None` without [`FEWEST_OBJECTS`] objects of two touches each.
    fn new(
        touches: &[Touched],
        cols: usize,
        volts_per_siemens: f64,
        streams: Streams,
    ) -> Result<Option<Self>, Refusal> {
        let names = unique(touches.iter().map(|touch| touch.object.as_str()));
        let number = |touch: &Touched| names.iter().position(|name| *name == touch.object).unwrap_or_default();
        let object: Vec<usize> = touches.iter().map(number).collect();
        let before = |k: usize| object[..k].iter().filter(|other| **other == object[k]).count();
        let seen: Vec<bool> = (0..touches.len()).map(|k| before(k) % 2 == 0).collect();
        let all_pressed_again = (0..names.len()).all(|own| (0..touches.len()).any(|k| object[k] == own && !seen[k]));
        if names.len() < FEWEST_OBJECTS || !all_pressed_again {
            return Ok(None);
        }
        let (Some(images), Some(classes)) = (find(LEFT_OUT), find(CLASSES)) else { return Ok(None) };
        let data = |is_wanted: &dyn Fn(usize) -> bool| {
            let wanted: Vec<usize> = (0..touches.len()).filter(|&k| seen[k] && is_wanted(object[k])).collect();
            let volts = |&k: &usize| touches[k].conductance.values().iter().map(|g| volts_per_siemens * g).collect();
            let columns: Vec<Vec<f64>> = wanted.iter().map(volts).collect();
            let labels: Vec<usize> = wanted.iter().map(|&k| object[k]).collect();
            let taxels = columns.first().map_or(0, Vec::len);
            TrainingData::of_images(Matrix::from_column_slices(taxels, &columns), &labels, cols, streams)
        };
        let others = (0..names.len()).into_par_iter().map(|own| (images.train)(&data(&|object| object != own)?));
        let others = others.collect::<Result<Vec<_>, Refusal>>()?;
        let classes = (classes.train)(&data(&|_| true)?)?;
        Ok(Some(Self { object, seen, others, classes }))
    }

    /// Mean IoU of objects that were left out, where an image is wanted, and share of right classes, over the touches
    /// that were not learned from. `presses` are the measurements of all touches.
    fn scores(
        &self,
        touches: &[Touched],
        presses: &[Press],
        images: bool,
    ) -> Result<(Option<f64>, Option<f64>), Refusal> {
        let unseen: Vec<usize> = (0..presses.len()).filter(|k| !self.seen[*k]).collect();
        let score = |&k: &usize| -> Result<(f64, f64), Refusal> {
            let (own, touch) = (self.object[k], &touches[k]);
            let class = answer(&mut *self.classes.start(), &presses[k], CLASSES)?.class.and_then(Class::label);
            let iou = if images {
                let image = answer(&mut *self.others[own].start(), &presses[k], LEFT_OUT)?.image;
                SupportScore::of_images(&image, touch.conductance.values()).iou
            } else {
                0.0
            };
            Ok((iou, f64::from(u8::from(class == Some(own)))))
        };
        let scores = unseen.par_iter().map(score).collect::<Result<Vec<_>, Refusal>>()?;
        let mean = |of: fn(&(f64, f64)) -> f64| Some(scores.iter().map(of).sum::<f64>() / scores.len() as f64);
        Ok((mean(|s| s.0).filter(|_| images), mean(|s| s.1)))
    }
}

impl Touched {
    /// IoU of an image with the touch.
    pub fn iou_of(&self, image: &[f64]) -> f64 {
        SupportScore::of_images(image, self.conductance.values()).iou
    }
}

/// What `algorithm`, called `name`, makes of all measurements of `press`.
fn answer(algorithm: &mut dyn Algorithm, press: &Press, name: &str) -> Result<Answer, Refusal> {
    let mut answer = Answer::default();
    for (_, window) in press.windows(0..press.len(), press.len(), press.len()) {
        algorithm.decode(&window, &mut answer).map_err(|e| Refusal::from_error(e).at(name))?;
    }
    Ok(answer)
}

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
        let volts_per_siemens = self.profile.volts_per_siemens();
        let taught = Taught::new(&self.touches, layout.cols(), volts_per_siemens, streams)?;
        progress.stage("decoding", Some(benches.len()));
        let rows = benches.into_iter().map(|(wires, source, m)| {
            let row = self.bench(wires, &source, m, spec, (&*trained, taught.as_ref()));
            progress.step();
            row
        });
        let rows = rows.collect::<Result<Vec<_>, _>>()?;
        progress.end();
        Ok(FewWiresReport {
            decoder: spec.name,
            scan_s: layout.taxels() as f64 / self.profile.sample_rate_hz,
            touches: self.touches.len(),
            objects: unique(self.touches.iter().map(|touch| touch.object.as_str())).len(),
            scan_iou: mean(self.touches.iter().map(|touch| touch.iou_of(&touch.scan))),
            scan_classes: self.scanned_classes(taught.as_ref())?,
            again_iou: mean(
                self.touches
                    .windows(2)
                    .filter(|pair| pair[0].object == pair[1].object)
                    .map(|pair| pair[1].iou_of(pair[0].conductance.values())),
            ),
            left_out,
            rows,
        })
    }

    /// Share of the scans that are recognised.
    fn scanned_classes(&self, taught: Option<&Taught>) -> Result<Option<f64>, Refusal> {
        let Some(taught) = taught else { return Ok(None) };
        let taxels = self.layout.taxels();
        let mut one_each = Matrix::zeros(taxels, taxels);
        (0..taxels).for_each(|taxel| one_each.row_mut(taxel)[taxel] = 1.0);
        let rows = Arc::new(PressRows::of_matrix(&one_each));
        let scans = self.touches.iter().map(|touch| Press::on(Arc::clone(&rows), touch.scan.clone(), 0.0));
        Ok(taught.scores(&self.touches, &scans.collect::<Vec<_>>(), false)?.1)
    }

    fn bench(
        &self,
        wires: usize,
        source: &RowSource,
        m_per_wire: usize,
        spec: &DecoderSpec,
        (trained, taught): (&dyn Trained, Option<&Taught>),
    ) -> Result<FewWires, Refusal> {
        let prior = SheetPrior::smooth([self.layout.rows(), self.layout.cols()], SMOOTH)?;
        let rows = BandRows::new(source, &prior, wires, m_per_wire, self.seed)?;
        let m = m_per_wire * wires;
        let phi = Arc::new(PressRows::new(rows.rows(0..m_per_wire)));
        let measured = self.measured(&rows, m_per_wire)?;
        let presses = measured.volts.into_iter().map(|volts| Press::on(Arc::clone(&phi), volts, 0.0));
        let presses: Vec<Press> = presses.collect();
        let decode = |algorithm: &mut Box<dyn Algorithm + '_>, press: &Press| {
            let mut image = answer(&mut **algorithm, press, spec.name)?.image;
            image.resize(self.layout.taxels(), 0.0);
            Ok(image)
        };
        // one decoder a thread, with its workspace
        let images = presses.par_iter().map_init(|| trained.start(), decode);
        let images = images.collect::<Result<Vec<Vec<f64>>, Refusal>>()?;
        let (left_out_iou, classes) = match taught {
            Some(taught) => taught.scores(&self.touches, &presses, true)?,
            None => (None, None),
        };
        let scores: Vec<f64> = self.touches.iter().zip(&images).map(|(touch, image)| touch.iou_of(image)).collect();
        let worst = (0..scores.len()).min_by(|a, b| scores[*a].total_cmp(&scores[*b]));
        Ok(FewWires {
            wires,
            rows: source.name().to_owned(),
            m_per_wire,
            m,
            time_s: m_per_wire as f64 / self.profile.sample_rate_hz,
            iou: mean(scores.iter().copied()).unwrap_or(0.0),
            left_out_iou,
            classes,
            worst_iou: worst.map_or(0.0, |k| scores[k]),
            worst: worst.map_or_else(String::new, |k| self.touches[k].name.clone()),
            saturated: measured.saturated,
            used: measured.used,
            signal_to_noise: measured.signal_to_noise,
            images,
        })
    }

    /// Samples of all touches: by measurement, then by wire.
    fn measured(&self, rows: &BandRows, m_per_wire: usize) -> Result<Measured, Refusal> {
        let (layout, wires) = (&self.layout, rows.wires());
        let rail_v = self.profile.rail_v(Mode::Compressive)?;
        let converter = self.profile.converter(Mode::Compressive)?;
        let end_v = converter.map(|c| c.volts(0).abs().max(c.volts(c.max_code()).abs()));
        let range = rail_v.into_iter().chain(end_v).reduce(f64::min);
        let (mut saturated, mut largest) = (0, 0.0_f64);
        let mut signal = 0.0;
        let device = Streams::new(self.seed).child("few-wires/wire", 0);
        let mut line = TouchWire::new(&self.profile, &rows.weights, layout, device)?;
        let info = line.info().clone();
        let bare = ConductanceMap::zeros(layout.rows(), layout.cols());
        let idle = line.measure(bare, IDLE_NUMBER, IDLE * wires)?;
        let noise = idle.iter().map(|v| v * v).sum::<f64>() / idle.len() as f64;
        let mut volts = Vec::with_capacity(self.touches.len());
        for (number, touch) in (0..).zip(&self.touches) {
            let samples = line.measure(touch.conductance.clone(), number, wires * m_per_wire)?;
            let idle_v = line.idle_v().iter().cycle();
            let raw: Vec<f64> = samples.iter().zip(idle_v).map(|(v, idle_v)| v + idle_v).collect();
            largest = raw.iter().fold(largest, |largest, v| largest.max(v.abs()));
            saturated += info.saturated(&raw, rail_v);
            signal += samples.iter().map(|v| v * v).sum::<f64>() / (samples.len() * self.touches.len()) as f64;
            volts.push(samples);
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

    /// What an ideal scan has of these conductances.
    fn volts(conductance: &ConductanceMap) -> Vec<f64> {
        let volts_per_siemens = Profile::named("ideal").unwrap().volts_per_siemens();
        conductance.values().iter().map(|g| volts_per_siemens * g).collect()
    }

    fn study(wires: Vec<usize>) -> FewWiresStudy {
        let layout = SkinLayout::default();
        let block = |first: usize| {
            let on = |k: usize| (first..first + 3).contains(&(k / 10)) && (4..7).contains(&(k % 10));
            ConductanceMap::from_values(10, 10, (0..100).map(|k| if on(k) { 1e-4 } else { 0.0 }).collect())
        };
        let touched = |name: &str, conductance: ConductanceMap| {
            let (name, object) = (name.to_owned(), "block".to_owned());
            Touched { name, object, scan: volts(&conductance), conductance }
        };
        FewWiresStudy {
            layout,
            touches: vec![touched("high", block(1)), touched("low", block(6))],
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
        assert!(report.rows.iter().all(|r| r.saturated == 0.0 && r.worst_iou <= r.iou && r.classes.is_none()));
        assert_eq!((report.objects, report.scan_iou, report.again_iou), (1, Some(1.0), Some(0.0)));
        // three objects of two touches each: all are known by then, and each by what the others look like
        let one = study(vec![1]);
        let places = ["high", "low", "both"].into_iter().flat_map(|object| {
            let block = match object {
                "high" => one.touches[0].conductance.clone(),
                "low" => one.touches[1].conductance.clone(),
                _ => {
                    let pairs = one.touches[0].conductance.values().iter().zip(one.touches[1].conductance.values());
                    ConductanceMap::from_values(10, 10, pairs.map(|(a, b)| a + b).collect())
                }
            };
            let touch = Touched {
                object: object.to_owned(),
                scan: volts(&block),
                conductance: block,
                ..one.touches[0].clone()
            };
            [touch.clone(), touch]
        });
        let taught = FewWiresStudy { touches: places.collect(), ..study(vec![1]) }.run(&()).unwrap();
        assert_eq!((taught.objects, taught.again_iou, taught.scan_classes), (3, Some(1.0), Some(1.0)));
        assert!(taught.rows.iter().all(|r| r.classes == Some(1.0)), "{:?}", taught.rows);
        assert!(taught.rows.iter().any(|r| r.left_out_iou > Some(0.9)), "{:?}", taught.rows);
        let refused = study(vec![11]).run(&()).unwrap_err().to_string();
        assert!(refused.contains("`--wires` = 11 is outside [1, 10]"), "{refused}");
    }
}
