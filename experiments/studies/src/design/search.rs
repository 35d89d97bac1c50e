//! The search for rows and wires: more and more measurements, until the images are as good as wanted.

use super::decoder_name;
use super::objects::{Classes, DesignObjects};
use super::wire::{BandRows, RowSource, WireDesign, bands};
use super::{DecoderDesign, Design, DesignCurve, DesignPoint, DesignStudy, Expectation, Ground, WireChoice};
use crate::touches::{Touch, TouchScore, TouchWire, band};
use crate::wiring::sums;
use rand::RngExt as _;
use rayon::prelude::*;
use spts_circuit::{Profile, Wires};
use spts_input::Refusal;
use spts_models::{SkinLayout, Streams};
use spts_recon::matrix_free::{OnSheet, Patches, SheetDecoder, SheetNoise};
use spts_recon::metrics::median;
use spts_recon::operator::SignRows;
use spts_recon::statistics::{self, Band, Sample};

/// Fewest measurements of a wire that are looked at.
const FEWEST: usize = 6;
/// Most measurements of all wires that a decoder is prepared for, and most numbers that it may hold.
const MOST: (usize, usize) = (1024, 40_000_000);
/// On large skins no more measurements are looked at than one for so many taxels.
const MOST_SHARE: usize = 4;
/// Ratio of the numbers of measurements that are looked at, one after another.
const STEP: f64 = std::f64::consts::SQRT_2;
/// Halvings between the last number that does not do and the first that does.
const HALVINGS: usize = 2;
/// Repetitions that a number of measurements is looked at with.
const SEARCHED: usize = 8;

/// Rows and wires that were looked at, and how far they go.
pub(super) struct Tried<'a> {
    pub(super) bench: Bench<'a>,
    pub(super) wired: Wired,
    pub(super) curve: DesignCurve,
    /// Smallest number of measurements with the required IoU.
    pub(super) reached: Option<usize>,
}

/// Electronics of a number of wires with some rows.
pub(super) struct Wired {
    pub(super) wire: WireDesign,
    profile: Profile,
    /// Largest number of measurements of a wire within the latency.
    pub(super) most: usize,
    /// Whether this limit comes from the latency, and not from the rows, the taxels or the decoder.
    pub(super) by_latency: bool,
}

impl Tried<'_> {
    /// Measurements of a wire that are chosen.
    pub(super) fn chosen(&self) -> usize {
        self.reached.unwrap_or(self.wired.most)
    }

    /// IoU there.
    pub(super) fn iou(&self) -> f64 {
        let found = self.curve.points.iter().find(|p| p.m_per_wire == self.chosen());
        found.map_or(0.0, |p| p.iou.mean)
    }
}

impl DesignStudy {
    /// Looks at more and more wires, until some rows reach the IoU.
    pub(super) fn search<'a>(&self, ground: &'a Ground) -> Result<Vec<Tried<'a>>, Refusal> {
        let rows = ground.layout.rows();
        let numbers: Vec<usize> = match self.wires {
            WireChoice::Exactly(wires) => vec![wires],
            WireChoice::UpTo(most) => {
                std::iter::successors(Some(1), |w| Some(2 * w)).take_while(|w| *w <= most.min(rows)).collect()
            }
        };
        let mut all = Vec::new();
        for wires in numbers {
            let taxels = rows.div_ceil(wires) * ground.layout.cols();
            let mut reached = false;
            for source in RowSource::candidates(taxels) {
                let tried = self.look(ground, wires, source)?;
                reached |= tried.reached.is_some();
                all.push(tried);
                // what is not the best of fewer is not the best of more, and its decoder is most of the memory
                let best = best(&all);
                let mut others = all.iter_mut().enumerate().filter(|(k, _)| *k != best);
                others.try_for_each(|(_, other)| other.bench.release())?;
            }
            if reached {
                break;
            }
        }
        Ok(all)
    }

    /// Electronics and decoder of `wires` wires with rows of `source`: nothing measured yet.
    pub(super) fn wired(&self, ground: &Ground, wires: usize, source: &RowSource) -> Result<Wired, Refusal> {
        let layout = &ground.layout;
        let bands = bands(layout.rows(), wires);
        let taxels = bands.first().map_or(0, std::ops::Range::len) * layout.cols();
        // ΣG and ΣG² of the fullest touch on one of the bands
        let mut pressing = (f64::MIN_POSITIVE, f64::MIN_POSITIVE);
        for (touch, band) in ground.learned.iter().flat_map(|touch| bands.iter().map(move |band| (touch, band))) {
            let (sum_s, squares) =
                sums(&touch.conductance_s.values()[band.start * layout.cols()..band.end * layout.cols()]);
            pressing = (pressing.0.max(sum_s), pressing.1.max(squares));
        }
        let alike = *source != RowSource::Generator;
        let wire = WireDesign::new(&ground.electronics, taxels, pressing, alike)?;
        let (profile, _) = wire.profile(!alike)?;
        #[expect(clippy::cast_possible_truncation, reason = "float to integer casts saturate")]
        let in_time = (self.latency_s / wire.period_s * (1.0 + 1e-9)) as usize;
        if in_time < FEWEST {
            return Err(Refusal::new(format!(
                "`latency` = {:.6} s is outside [{:.6}, ∞): {FEWEST} measurements take that long at {:.0} Hz",
                self.latency_s,
                FEWEST as f64 * wire.period_s,
                wire.rate_hz
            )));
        }
        let held = match ground.by_patches() {
            true => layout.taxels() / MOST_SHARE,
            false => MOST.0.min(MOST.1 / (2 * layout.taxels())),
        } / wires;
        let most = in_time.min(source.most_rows(taxels)).min(taxels).min(held).max(1);
        Ok(Wired { wire, profile, most, by_latency: most == in_time })
    }

    /// The design with the first `measurements` rows of every wire.
    pub(super) fn bench<'a>(
        &self,
        ground: &'a Ground,
        wired: &Wired,
        source: &RowSource,
        wires: usize,
        measurements: usize,
    ) -> Result<Bench<'a>, Refusal> {
        let rows = BandRows::new(source, &ground.prior, wires, measurements, self.seed)?;
        let mut bench = Bench::new(ground, rows, wired.profile.clone(), self.objects.places(&ground.layout))?;
        let small = self.objects.size_m[1] <= PATCH_TAXELS * self.pitch_m;
        bench.decoder = BenchDecoder::new(ground, &bench.rows, small)?;
        Ok(bench)
    }

    /// Raises M until the IoU is reached or there is no more.
    fn look<'a>(&self, ground: &'a Ground, wires: usize, source: RowSource) -> Result<Tried<'a>, Refusal> {
        let wired = self.wired(ground, wires, &source)?;
        let mut bench = self.bench(ground, &wired, &source, wires, wired.most)?;
        let drawn = draw(&self.objects, &ground.layout, "design/searched", self.seed, SEARCHED)?;
        let measured = bench.measure(drawn, wired.most)?;
        let mut points: Vec<DesignPoint> = Vec::new();
        let mut least = FEWEST.min(wired.most);
        if wires > 1 && matches!(self.wires, WireChoice::UpTo(_)) {
            // whether so many wires do it at all
            points.extend(point(&mut bench, &measured, wired.most)?);
            if points.iter().all(|p| p.iou.mean < self.iou) {
                least = wired.most;
            } else {
                points.clear();
            }
        }
        let reached = loop {
            if points.iter().all(|p| p.m_per_wire != least) {
                points.extend(point(&mut bench, &measured, least)?);
            }
            if points.last().is_some_and(|p| p.iou.mean >= self.iou) {
                break Some(least);
            }
            if least == wired.most {
                break None;
            }
            #[expect(clippy::cast_possible_truncation, reason = "thousands of measurements")]
            let next = (least as f64 * STEP).round() as usize;
            least = next.max(least + 1).min(wired.most);
        };
        let mut tried = Tried { bench, wired, curve: DesignCurve { wires, rows: source, points }, reached };
        self.refine(&mut tried, &measured)?;
        Ok(tried)
    }

    /// Halves what is between the last M that does not do and the first that does.
    fn refine(&self, tried: &mut Tried<'_>, measured: &[Repetition]) -> Result<(), Refusal> {
        let points = &mut tried.curve.points;
        for _ in 0..HALVINGS {
            let Some(high) = tried.reached else { return Ok(()) };
            let below = points.iter().map(|p| p.m_per_wire).filter(|m| *m < high).max();
            let middle = below.map_or(high, |low| low.midpoint(high));
            if points.iter().any(|p| p.m_per_wire == middle) {
                return Ok(());
            }
            if let Some(found) = point(&mut tried.bench, measured, middle)? {
                if found.iou.mean >= self.iou {
                    tried.reached = Some(middle);
                }
                points.push(found);
                points.sort_by_key(|p| p.m_per_wire);
            }
        }
        Ok(())
    }
}

/// IoU and place at `m` measurements.
fn point(bench: &mut Bench<'_>, measured: &[Repetition], m: usize) -> Result<Option<DesignPoint>, Refusal> {
    bench.prepare(m)?;
    let scores = bench.score(measured, m, None)?;
    let iou: Vec<f64> = scores.iter().map(|s| s.iou).collect();
    Ok(band(&iou).map(|iou| DesignPoint { m_per_wire: m, iou, place_px: mean(&scores, |s| s.place_px) }))
}

/// The one to build: of those that reach the IoU the one with the fewest wires and then the fewest measurements, else
/// the one with the best IoU.
pub(super) fn best(tried: &[Tried<'_>]) -> usize {
    let reaching = (0..tried.len()).filter(|k| tried[*k].reached.is_some());
    let fewest = reaching.min_by_key(|k| (tried[*k].curve.wires, tried[*k].chosen()));
    fewest.unwrap_or_else(|| {
        let better = |a: &usize, b: &usize| tried[*a].iou().total_cmp(&tried[*b].iou()).then(b.cmp(a));
        (0..tried.len()).max_by(better).unwrap_or_default()
    })
}

/// Touches of a repetition of procedural shapes, and of the seventeen objects, each once.
pub(super) const TOUCHES: [usize; 2] = [8, 17];

/// Touches on one specimen of the skin, and their samples.
#[derive(Debug)]
pub(super) struct Repetition {
    pub(super) touches: Vec<Touch>,
    /// Samples of every touch, V: by measurement, then by wire.
    volts: Vec<Vec<f64>>,
}

/// What a repetition found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RepetitionScore {
    /// Mean IoU.
    pub(super) iou: f64,
    /// Median distance of the centres, taxels. A touch without an image counts with the skin's diagonal.
    pub(super) place_px: f64,
    /// Share of correctly classified objects, where objects are classified.
    pub(super) class: Option<f64>,
}

/// Draws the touches of `count` repetitions, each with a seed of its own under `label`.
pub(super) fn draw(
    objects: &DesignObjects,
    layout: &SkinLayout,
    label: &'static str,
    seed: u64,
    count: usize,
) -> Result<Vec<(Vec<Touch>, Streams)>, Refusal> {
    let touches = TOUCHES[usize::from(objects.seventeen)];
    (0..count as u64)
        .into_par_iter()
        .map(|index| {
            let streams = Streams::new(seed).child(label, index);
            let scene = objects.scene(layout, touches, streams.rng("design/touches", 0).random::<u64>() >> 1);
            Ok((scene.draw()?, streams))
        })
        .collect()
}

/// A design with its decoder, which learns rows as they are asked for.
pub(super) struct Bench<'a> {
    ground: &'a Ground,
    pub(super) rows: BandRows,
    profile: Profile,
    decoder: BenchDecoder,
    places: usize,
}

/// Largest extent of an object that patches show, taxels: for such ones the search and the alternatives do without
/// cells; what is promised has them.
const PATCH_TAXELS: f64 = 12.0;

/// What decodes, and what it has of the rows.
enum BenchDecoder {
    Sheet(SheetDecoder),
    /// The signs of the rows, the wire of each, and the taxels of the wires as bits; whether patches alone will do.
    Large {
        small: bool,
        sheet: OnSheet,
        patches: Patches,
        signs: Vec<u64>,
        wires: Vec<u16>,
        masks: Vec<u64>,
    },
}

impl BenchDecoder {
    fn new(ground: &Ground, rows: &BandRows, small: bool) -> Result<Self, Refusal> {
        let [height, width] = [ground.layout.rows(), ground.layout.cols()];
        if !ground.by_patches() {
            let prior = ground.prior.clone();
            return Ok(Self::Sheet(SheetDecoder::new(prior, SheetNoise::default(), rows.wires())?));
        }
        Ok(Self::Large {
            small,
            patches: Patches::new(height, width),
            sheet: OnSheet::new(height, width, OnSheet::CELLS),
            signs: Vec::new(),
            wires: Vec::new(),
            masks: rows.weights.wires().map_or_else(Vec::new, Wires::masks),
        })
    }

    /// The image of the measurements `volts`, on at most `places` taxels where it is solved for taxels.
    fn image(&self, volts: &[f64], places: usize, taxels: usize) -> Result<Vec<f64>, Refusal> {
        match self {
            Self::Sheet(decoder) => decoder.non_negative(volts, places),
            Self::Large { small, sheet, patches, signs, wires, masks } => {
                let rows = SignRows::new(signs, taxels).part(0..volts.len());
                let wires = wires.get(..volts.len()).unwrap_or_default();
                let rows = if wires.is_empty() { rows } else { rows.on_wires(wires, masks) };
                if *small { patches.recover(rows, volts, wires) } else { sheet.recover(rows, volts, wires) }
            }
        }
    }

    /// Bytes and multiplications with `m` measurements of `taxels` taxels.
    fn cost(&self, m: usize, taxels: usize, places: usize) -> (usize, usize) {
        match self {
            Self::Sheet(decoder) => (decoder.bytes(m), decoder.products(m, places)),
            Self::Large { .. } => (m * taxels / 8, PASSES * m * taxels),
        }
    }
}

/// Products with all rows that a recovery by patches takes, about: two of three rounds, and one for the rest.
const PASSES: usize = 8;

/// Taxels that are solved for with M measurements of a wire: this share of M. With as many taxels as measurements,
/// noise is fitted. The share is interpolated: M/2, M and 3M/2 were compared, on 48 touches of each of a few skins.
const PLACES_SHARE: f64 = 0.75;
/// Fewest taxels that are solved for.
const FEWEST_PLACES: usize = 4;

impl<'a> Bench<'a> {
    /// A design with these rows and this readout, whose decoder solves for at most `places` taxels.
    pub(super) fn new(ground: &'a Ground, rows: BandRows, profile: Profile, places: usize) -> Result<Self, Refusal> {
        Ok(Self { decoder: BenchDecoder::new(ground, &rows, false)?, ground, rows, profile, places })
    }

    /// Forgets what the decoder has been prepared for, and frees its memory.
    fn release(&mut self) -> Result<(), Refusal> {
        self.decoder = BenchDecoder::new(self.ground, &self.rows, false)?;
        Ok(())
    }

    /// Taxels that are solved for with `measurements` of every wire.
    fn places(&self, measurements: usize) -> usize {
        #[expect(clippy::cast_possible_truncation, reason = "thousands of measurements")]
        let of_rows = (PLACES_SHARE * measurements as f64).round() as usize;
        self.places.min(of_rows.max(FEWEST_PLACES))
    }

    /// Gets the decoder ready for `measurements` of every wire.
    pub(super) fn prepare(&mut self, measurements: usize) -> Result<(), Refusal> {
        match &mut self.decoder {
            BenchDecoder::Sheet(decoder) => {
                let done = decoder.measurements() / self.rows.wires();
                if measurements > done {
                    let rows = self.rows.rows(done..measurements);
                    let wires: Vec<usize> = (0..rows.len()).map(|row| rows.wire(row)).collect();
                    decoder.extend(&rows.to_vec(), &wires)?;
                }
            }
            BenchDecoder::Large { signs, wires, .. } => {
                let rows = self.rows.rows(0..measurements);
                let words = rows.taxels().div_ceil(64);
                if signs.len() < rows.len() * words {
                    *signs = rows.sign_bits().unwrap_or_default();
                    if self.rows.wires() > 1 {
                        #[expect(clippy::cast_possible_truncation, reason = "a skin has fewer wires")]
                        wires.splice(.., (0..rows.len()).map(|row| rows.wire(row) as u16));
                    }
                }
            }
        }
        Ok(())
    }

    /// Measures what was drawn, `measurements` times on every wire.
    pub(super) fn measure(
        &self,
        drawn: Vec<(Vec<Touch>, Streams)>,
        measurements: usize,
    ) -> Result<Vec<Repetition>, Refusal> {
        let one = |(touches, streams): (Vec<Touch>, Streams)| -> Result<Repetition, Refusal> {
            let device = streams.child("design/wire", 0);
            let mut line = TouchWire::new(&self.profile, &self.rows.weights, &self.ground.layout, device)?;
            let count = measurements * self.rows.wires();
            let each = (0..).zip(&touches);
            let volts = each.map(|(number, touch)| line.measure(touch.conductance_s.clone(), number, count));
            let volts = volts.collect::<Result<_, _>>()?;
            Ok(Repetition { touches, volts })
        };
        drawn.into_par_iter().map(one).collect()
    }

    /// Scores of the first `measurements` of every wire, repetition by repetition.
    pub(super) fn score(
        &self,
        repetitions: &[Repetition],
        measurements: usize,
        classes: Option<&Classes>,
    ) -> Result<Vec<RepetitionScore>, Refusal> {
        let count = measurements * self.rows.wires();
        let places = self.places(measurements);
        let rows = classes.map(|classes| classes.rows(&self.rows.rows(0..measurements).to_vec()));
        let touches: Vec<(usize, &Touch, &[f64])> = repetitions
            .iter()
            .enumerate()
            .flat_map(|(r, rep)| rep.touches.iter().zip(&rep.volts).map(move |(t, v)| (r, t, &v[..count])))
            .collect();
        let one = |(r, touch, volts): (usize, &Touch, &[f64])| -> Result<_, Refusal> {
            let image = self.decoder.image(volts, places, self.ground.layout.taxels())?;
            let right = match (classes, &rows) {
                (Some(classes), Some(rows)) => Some(classes.is_right(rows, volts, &touch.name)?),
                _ => None,
            };
            Ok((r, TouchScore::of(&image, touch, &self.ground.layout), right))
        };
        let scores = touches.into_par_iter().map(one).collect::<Result<Vec<_>, _>>()?;
        let far = (self.ground.layout.rows() as f64).hypot(self.ground.layout.cols() as f64);
        let of = |repetition: usize| {
            let own: Vec<_> = scores.iter().filter(|(r, _, _)| *r == repetition).collect();
            let share = 1.0 / own.len().max(1) as f64;
            let right = own.iter().map(|(_, _, right)| *right).collect::<Option<Vec<bool>>>();
            let places: Vec<f64> = own.iter().map(|(_, s, _)| s.place_px.unwrap_or(far)).collect();
            RepetitionScore {
                iou: own.iter().map(|(_, s, _)| share * s.iou).sum(),
                place_px: median(&places).unwrap_or_default(),
                class: right.map(|right| share * right.iter().filter(|right| **right).count() as f64),
            }
        };
        Ok((0..repetitions.len()).map(of).collect())
    }
}

/// Mean of a quantity over repetitions.
pub(super) fn mean(scores: &[RepetitionScore], of: impl Fn(&RepetitionScore) -> f64) -> f64 {
    statistics::mean(scores.iter().map(of)).unwrap_or_default()
}

/// Repetitions that the promise rests on.
const PROMISED: usize = 16;
/// Measurements are raised by this factor when the promise falls short of what the search found, so many times.
const RAISE: (f64, usize) = (1.2, 4);
/// Most taxels with classes: their templates are dense.
const MOST_CLASS_TAXELS: usize = 2048;
/// Labels of the promises' touches: every attempt has its own.
const PROMISES: [&str; 5] =
    ["design/promised", "design/promised/1", "design/promised/2", "design/promised/3", "design/promised/4"];

impl DesignStudy {
    /// What the chosen design promises, from touches and specimens that the search has not seen. Where that is short of
    /// the IoU, there are more measurements.
    pub(super) fn promised<'a>(
        &self,
        ground: &'a Ground,
        mut tried: Tried<'a>,
    ) -> Result<(Tried<'a>, Design), Refusal> {
        let wires = tried.curve.wires;
        let classes = self.classes(ground)?;
        let mut m = tried.chosen();
        for raise in 0.. {
            let rows = match tried.curve.rows {
                RowSource::Generator => tried.bench.rows.clone(),
                // the pattern that the cells repeat has as many rows as are measured
                RowSource::Designer(_) => BandRows::new(&tried.curve.rows, &ground.prior, wires, m, self.seed)?,
            };
            tried.bench.rows = rows;
            // with the decoder that sessions have
            if tried.curve.rows != RowSource::Generator || ground.by_patches() {
                tried.bench.release()?;
            }
            tried.bench.prepare(m)?;
            let label = PROMISES[usize::min(raise, PROMISES.len() - 1)];
            let drawn = draw(&self.objects, &ground.layout, label, self.seed, PROMISED)?;
            let measured = tried.bench.measure(drawn, m)?;
            let scores = tried.bench.score(&measured, m, classes.as_ref())?;
            let expected = self.expectation(ground, &scores)?;
            let short = expected.iou.mean < self.iou && tried.reached.is_some();
            if short && m < tried.wired.most && raise < RAISE.1 {
                #[expect(clippy::cast_possible_truncation, reason = "thousands of measurements")]
                let more = (m as f64 * RAISE.0).ceil() as usize;
                m = more.min(tried.wired.most);
                continue;
            }
            tried.reached = (!short && tried.reached.is_some()).then_some(m);
            let design = self.design(ground, &tried, m, expected);
            return Ok((tried, design));
        }
        unreachable!("the range has no end")
    }

    /// Classes of the seventeen objects, where they can be told apart.
    pub(super) fn classes(&self, ground: &Ground) -> Result<Option<Classes>, Refusal> {
        if self.no_class(ground).is_some() {
            return Ok(None);
        }
        let touches: Vec<&Touch> = ground.learned.iter().collect();
        Classes::new(&touches, ground.layout.cols()).map(Some)
    }

    /// Why classes cannot be told apart.
    fn no_class(&self, ground: &Ground) -> Option<String> {
        let taxels = ground.layout.taxels();
        if !self.objects.seventeen {
            Some("procedural shapes have no classes".to_owned())
        } else if !self.objects.placed {
            Some("the classifier knows the seventeen objects at their published places only".to_owned())
        } else if taxels > MOST_CLASS_TAXELS {
            Some(format!("{taxels} taxels: templates are for {MOST_CLASS_TAXELS} at most"))
        } else {
            None
        }
    }

    fn expectation(&self, ground: &Ground, scores: &[RepetitionScore]) -> Result<Expectation, Refusal> {
        let of = |values: Vec<f64>, quantities: usize, range: [f64; 2]| {
            promise(&values, quantities, range).ok_or_else(|| Refusal::new("promise: fewer than two repetitions"))
        };
        let class: Option<Vec<f64>> = scores.iter().map(|s| s.class).collect();
        let quantities = if class.is_some() { 3 } else { 2 };
        let place = |scale: f64| scores.iter().map(|s| scale * s.place_px).collect::<Vec<f64>>();
        let open = [0.0, f64::MAX];
        Ok(Expectation {
            iou: of(scores.iter().map(|s| s.iou).collect(), quantities, [0.0, 1.0])?,
            place_px: of(place(1.0), quantities, open)?,
            place_mm: of(place(1e3 * ground.layout.pitch_m()), quantities, open)?,
            class: class.map(|class| of(class, quantities, [0.0, 1.0])).transpose()?,
            no_class: self.no_class(ground),
            repetitions: scores.len(),
            touches: TOUCHES[usize::from(self.objects.seventeen)],
            outside: OUTSIDE,
        })
    }

    fn design(&self, ground: &Ground, tried: &Tried<'_>, m: usize, expected: Expectation) -> Design {
        let layout = &ground.layout;
        let (rows, cols, wires) = (layout.rows(), layout.cols(), tried.curve.wires);
        let places = tried.bench.places(m);
        let (bytes, products) = tried.bench.decoder.cost(m * wires, layout.taxels(), places);
        let prior = &ground.prior;
        Design {
            rows,
            cols,
            taxels: layout.taxels(),
            pitch_m: layout.pitch_m(),
            electrode_m: layout.electrode_m(),
            objects: self.objects.clone(),
            wires,
            sub_arrays: bands(rows, wires).iter().map(|band| band.len() * cols).collect(),
            wire: tried.wired.wire.clone(),
            row_source: tried.curve.rows.clone(),
            m_per_wire: m,
            m: m * wires,
            decoder: DecoderDesign {
                name: decoder_name(layout.taxels(), ground.contacts).to_owned(),
                places,
                covariance_along_rows: (0..cols).map(|d| prior.covariance(0, d)).collect(),
                covariance_along_cols: (0..rows).map(|d| prior.covariance(0, d * cols)).collect(),
                bytes,
                products,
            },
            expected,
            seed: self.seed,
        }
    }
}

/// Probability that the check of a correct design finds one of its quantities outside the band.
pub const OUTSIDE: f64 = 0.01;

/// The promise of a quantity that `repetitions` have found, for a check of as many repetitions, one of `quantities`
/// that are checked together; `range` is where the quantity can lie at all. `None` for fewer than two repetitions.
///
/// Repetitions are independent and alike: each has a specimen of the skin, parts of the device, touches and noise of
/// its own. Their mean of R and the check's mean of R differ with a variance of σ² (1/R + 1/R), so that with the
/// standard deviation s of the R repetitions
///
/// (check − mean) / (s √(2/R)) has Student's t with R − 1 degrees of freedom,
///
/// and mean ± t s √(2/R) holds the check with the probability 1 − α. A repetition is itself a mean of several touches,
/// which is close enough to normal for that. With q quantities, α = 0.01/q for each leaves at most 1 % for all
/// (Bonferroni). The band is for the check, and not a confidence interval of the mean, which would be √2 narrower.
/// Source: G. J. Hahn, W. Q. Meeker, "Statistical Intervals" (1991), §4.8.
pub(super) fn promise(repetitions: &[f64], quantities: usize, range: [f64; 2]) -> Option<Band> {
    let sample = Sample::of(repetitions).filter(|sample| sample.count > 1)?;
    let t = sample.t(OUTSIDE / quantities.max(1) as f64);
    let half = t * (sample.variance * 2.0 / sample.count as f64).sqrt();
    Some(Band::around(sample.mean, half).within(range))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::electronics::ElectronicsStudy;
    use spts_recon::matrix_free::SheetPrior;

    /// An ideal wire with as many measurements as taxels shows touches nearly as they are, on one wire and on two; and
    /// any number of threads finds the same.
    #[test]
    fn ideal_wires_show_touches() {
        let layout = SkinLayout::new(8, 8, 0.015, 0.01).unwrap();
        let objects = DesignObjects::named("large").unwrap();
        for wires in [1, 2] {
            let run = |threads: usize| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| {
                    let drawn = draw(&objects, &layout, "test", 1, 2).unwrap();
                    let images: Vec<Touch> = drawn.iter().flat_map(|(t, _)| t.clone()).collect();
                    let ground = Ground {
                        layout,
                        electronics: ElectronicsStudy::as_designed().unwrap(),
                        prior: SheetPrior::like(images.iter().map(|t| t.conductance_s.values()), [8, 8]).unwrap(),
                        learned: Vec::new(),
                        contacts: 1,
                    };
                    let rows = BandRows::new(&RowSource::Generator, &ground.prior, wires, 64, 1).unwrap();
                    let ideal = Profile::named("ideal").unwrap();
                    let mut bench = Bench::new(&ground, rows, ideal, 64).unwrap();
                    bench.prepare(64 / wires).unwrap();
                    let measured = bench.measure(drawn, 64 / wires).unwrap();
                    bench.score(&measured, 64 / wires, None).unwrap()
                })
            };
            let scores = run(1);
            assert!(mean(&scores, |s| s.iou) > 0.85, "{scores:?}");
            assert!(mean(&scores, |s| s.place_px) < 0.3, "{scores:?}");
            assert_eq!(scores, run(3));
        }
    }

    #[test]
    fn a_band_by_hand() {
        let p = promise(&[1.0, 2.0, 3.0], 1, [-100.0, 9.0]).unwrap();
        // s = 1, √(2/3); t of 99 % with 2 degrees of freedom is 9.925 as tabulated, to half a digit
        assert!((p.mean - 2.0).abs() < 1e-12 && (p.low - (2.0 - 9.925 * (2.0_f64 / 3.0).sqrt())).abs() < 1e-3);
        assert!((p.high - 9.0).abs() < 1e-12 && p.holds(3.0) && !p.holds(9.5) && !p.holds(f64::NAN));
        assert!(promise(&[1.0], 1, [0.0, 1.0]).is_none());
    }

    /// 2,000 designs of twelve repetitions and as many checks, of uniform numbers: 1 % of the checks lie outside, ±
    /// four standard deviations of the count.
    #[test]
    fn one_check_in_a_hundred_lies_outside() {
        let mut rng = Streams::new(1).rng("band", 0);
        let mut run = || -> Vec<f64> { (0..12).map(|_| (0..8).map(|_| rng.random::<f64>()).sum()).collect() };
        let outside = (0..2000).filter(|_| {
            let p = promise(&run(), 1, [-1e9, 1e9]).unwrap();
            !p.holds(run().iter().sum::<f64>() / 12.0)
        });
        let count = outside.count();
        assert!((2..=38).contains(&count), "{count} of 2000");
    }
}
