//! The search for a design.

use super::band::{OUTSIDE, promise};
use super::bench::{Bench, Repetition, RepetitionScore, TOUCHES, draw, mean, pressing};
use super::classes::Classes;
use super::error::DesignError;
use super::objects::DesignObjects;
use super::report::{DecoderDesign, Design, DesignCurve, DesignPoint, DesignReport, Expectation};
use super::rows::{BandRows, RowSource, bands};
use super::wire::{FeedbackLimit, WireDesign};
use crate::electronics::ElectronicsStudy;
use crate::touches::{Touch, band};
use spts::progress::Progress;
use spts_circuit::Profile;
use spts_models::{SkinLayout, Streams};
use spts_recon::matrix_free::SheetPrior;

/// How many wires a designed skin may have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WireChoice {
    /// Exactly this number.
    Exactly(usize),
    /// As few as necessary, and at most this number.
    UpTo(usize),
}

/// What `spts design` is asked for: area, pitch, latency, image quality, wires and objects of a skin.
///
/// ```
/// use spts_studies::design::{DesignObjects, DesignStudy, WireChoice};
///
/// let study = DesignStudy {
///     area_m: [0.16, 0.16],
///     pitch_m: 5e-3,
///     latency_s: 5e-3,
///     iou: 0.8,
///     wires: WireChoice::UpTo(4),
///     objects: DesignObjects::named("small")?,
///     seed: 1,
/// };
/// assert_eq!(study.layout()?.taxels(), 32 * 32);
/// # Ok::<(), spts_studies::design::DesignError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct DesignStudy {
    /// Width and height of the sheet, m.
    pub area_m: [f64; 2],
    /// Distance between neighbouring taxels, m.
    pub pitch_m: f64,
    /// Time from touch to image, s.
    pub latency_s: f64,
    /// Required mean IoU of the images.
    pub iou: f64,
    /// Number of wires.
    pub wires: WireChoice,
    /// The objects for which it is designed.
    pub objects: DesignObjects,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// Most taxels along a side.
const MOST_SIDE: f64 = 256.0;
/// Fewest measurements of a wire that are looked at.
const FEWEST: usize = 6;
/// Most measurements of all wires that a decoder is prepared for, and most numbers that it may hold.
const MOST: (usize, usize) = (1024, 40_000_000);
/// Ratio of the numbers of measurements that are looked at, one after another.
const STEP: f64 = std::f64::consts::SQRT_2;
/// Halvings between the last number that does not do and the first that does.
const HALVINGS: usize = 2;
/// Repetitions that the decoder learns from, that a number of measurements is looked at with, that the promise rests
/// on, and that an alternative is looked at with.
const LEARNED: usize = 8;
const SEARCHED: usize = 8;
/// See [`LEARNED`].
pub(super) const PROMISED: usize = 16;
/// See [`LEARNED`].
pub(super) const COMPARED: usize = 5;
/// Measurements are raised by this factor when the promise falls short of what the search found, so many times.
const RAISE: (f64, usize) = (1.2, 4);
/// Most taxels with classes: their templates are dense.
const MOST_CLASS_TAXELS: usize = 2048;

/// What all designs of one skin share.
pub(super) struct Ground {
    pub(super) layout: SkinLayout,
    pub(super) electronics: ElectronicsStudy,
    pub(super) prior: SheetPrior,
    learned: Vec<Touch>,
}

/// Rows and wires that were looked at, and how far they go.
pub(super) struct Tried {
    pub(super) bench: Bench,
    pub(super) wire: WireDesign,
    pub(super) curve: DesignCurve,
    pub(super) source: RowSource,
    /// Largest number of measurements of a wire within the latency.
    pub(super) most: usize,
    /// Whether this limit comes from the latency, and not from the rows, the taxels or the decoder.
    pub(super) by_latency: bool,
    /// Smallest number of measurements with the required IoU.
    pub(super) reached: Option<usize>,
}

impl Tried {
    /// Measurements of a wire that are chosen.
    pub(super) fn chosen(&self) -> usize {
        self.reached.unwrap_or(self.most)
    }

    /// IoU there.
    pub(super) fn iou(&self) -> f64 {
        let found = self.curve.points.iter().find(|p| p.m_per_wire == self.chosen());
        found.map_or(0.0, |p| p.iou.mean)
    }
}

impl DesignStudy {
    /// Designs the skin. The result depends only on the settings, not on the number of threads.
    ///
    /// # Errors
    /// [`DesignError`] for an input outside its range, or if touches cannot be drawn, measured or decoded.
    pub fn run(&self, progress: &dyn Progress) -> Result<DesignReport, DesignError> {
        let layout = self.layout()?;
        progress.stage("learning", None);
        let ground = self.ground(layout)?;
        progress.stage("searching", None);
        let mut tried = self.search(&ground)?;
        progress.stage("promising", None);
        let best = best(&tried);
        let chosen = tried.swap_remove(best);
        let (chosen, design) = self.promised(&ground, chosen)?;
        progress.stage("comparing", None);
        let report = self.report(&ground, chosen, tried, design)?;
        progress.end();
        Ok(report)
    }

    /// Layout of the skin.
    ///
    /// # Errors
    /// [`DesignError::Range`], [`DesignError::Taxels`] and [`DesignError::Wires`].
    pub fn layout(&self) -> Result<SkinLayout, DesignError> {
        let within = |field, value: f64, least: f64, most: f64, range| {
            if (least..=most).contains(&value) {
                Ok(())
            } else {
                Err(DesignError::Range { field, value, range })
            }
        };
        for side_m in self.area_m {
            within("area", side_m, 1e-3, 10.0, "[0.001, 10] m a side")?;
        }
        within("resolution", self.pitch_m, 1e-4, 1.0, "[0.0001, 1] m")?;
        within("latency", self.latency_s, 1e-6, 10.0, "[1e-6, 10] s")?;
        within("iou", self.iou, 0.01, 0.99, "[0.01, 0.99]")?;
        // whole taxels in the area, to rounding
        let [cols, rows] = self.area_m.map(|side_m| (side_m / self.pitch_m + 1e-6).floor());
        if ![rows, cols].iter().all(|side| (2.0..=MOST_SIDE).contains(side)) {
            return Err(DesignError::Taxels { rows, cols });
        }
        #[expect(clippy::cast_possible_truncation, reason = "at most 256")]
        let (rows, cols) = (rows as usize, cols as usize);
        let (WireChoice::Exactly(wires) | WireChoice::UpTo(wires)) = self.wires;
        if wires == 0 || (wires > rows && matches!(self.wires, WireChoice::Exactly(_))) {
            return Err(DesignError::Wires { wires, rows });
        }
        let electrode_m = SkinLayout::usual_electrode_m(self.pitch_m);
        Ok(SkinLayout::new(rows, cols, self.pitch_m, electrode_m)?)
    }

    /// Learns what images are like.
    pub(super) fn ground(&self, layout: SkinLayout) -> Result<Ground, DesignError> {
        let drawn = draw(&self.objects, &layout, "design/learned", self.seed, LEARNED)?;
        let learned: Vec<Touch> = drawn.into_iter().flat_map(|(touches, _)| touches).collect();
        let images = learned.iter().map(|t| t.conductance_s.values());
        Ok(Ground {
            layout,
            electronics: ElectronicsStudy::as_designed()?,
            prior: SheetPrior::like(images, [layout.rows(), layout.cols()])?,
            learned,
        })
    }

    /// Looks at more and more wires, until some rows reach the IoU.
    fn search(&self, ground: &Ground) -> Result<Vec<Tried>, DesignError> {
        let rows = ground.layout.rows();
        let numbers: Vec<usize> = match self.wires {
            WireChoice::Exactly(wires) => vec![wires],
            WireChoice::UpTo(most) => std::iter::successors(Some(1), |w| Some(2 * w))
                .take_while(|w| *w <= most.min(rows))
                .collect(),
        };
        let mut all = Vec::new();
        for wires in numbers {
            let taxels = rows.div_ceil(wires) * ground.layout.cols();
            let mut reached = false;
            for source in RowSource::candidates(taxels) {
                let tried = self.look(ground, wires, source)?;
                reached |= tried.reached.is_some();
                all.push(tried);
            }
            if reached {
                break;
            }
        }
        Ok(all)
    }

    /// Electronics and decoder of `wires` wires with rows of `source`: nothing measured yet.
    pub(super) fn wired(&self, ground: &Ground, wires: usize, source: &RowSource) -> Result<Wired, DesignError> {
        let layout = &ground.layout;
        let bands = bands(layout.rows(), wires);
        let taxels = bands.first().map_or(0, std::ops::Range::len) * layout.cols();
        let touches: Vec<&Touch> = ground.learned.iter().collect();
        let alike = *source != RowSource::Generator;
        let wire = WireDesign::new(
            &ground.electronics,
            taxels,
            pressing(&touches, &bands, layout.cols()),
            alike,
        )?;
        let profile = Profile::from_toml(&wire.profile(!alike)?)?;
        #[expect(clippy::cast_possible_truncation, reason = "float to integer casts saturate")]
        let in_time = (self.latency_s / wire.period_s * (1.0 + 1e-9)) as usize;
        if in_time < FEWEST {
            return Err(DesignError::Latency {
                latency_s: self.latency_s,
                least_s: FEWEST as f64 * wire.period_s,
                least: FEWEST,
                rate_hz: wire.rate_hz,
            });
        }
        let held = MOST.0.min(MOST.1 / (2 * layout.taxels())) / wires;
        let most = in_time.min(source.most_rows(taxels)).min(taxels).min(held).max(1);
        Ok(Wired {
            wire,
            profile,
            most,
            by_latency: most == in_time,
        })
    }

    /// Raises M until the IoU is reached or there is no more.
    fn look(&self, ground: &Ground, wires: usize, source: RowSource) -> Result<Tried, DesignError> {
        let wired = self.wired(ground, wires, &source)?;
        let rows = BandRows::new(&source, &ground.prior, wires, wired.most, self.seed)?;
        let places = self.objects.places(&ground.layout);
        let mut bench = Bench::new(ground.layout, rows, wired.profile, ground.prior.clone(), places)?;
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
        let mut tried = Tried {
            bench,
            wire: wired.wire,
            curve: DesignCurve {
                wires,
                rows: source.clone(),
                points,
            },
            source,
            most: wired.most,
            by_latency: wired.by_latency,
            reached,
        };
        self.refine(&mut tried, &measured)?;
        Ok(tried)
    }

    /// Halves what is between the last M that does not do and the first that does.
    fn refine(&self, tried: &mut Tried, measured: &[Repetition]) -> Result<(), DesignError> {
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

    /// What the chosen design promises, from touches and specimens that the search has not seen. Where that is short of
    /// the IoU, there are more measurements.
    fn promised(&self, ground: &Ground, mut tried: Tried) -> Result<(Tried, Design), DesignError> {
        let wires = tried.curve.wires;
        let classes = self.classes(ground)?;
        let mut m = tried.chosen();
        for raise in 0.. {
            let rows = match tried.source {
                RowSource::Generator => tried.bench.rows.clone(),
                // the pattern that the cells repeat has as many rows as are measured
                RowSource::Designer(_) => BandRows::new(&tried.source, &ground.prior, wires, m, self.seed)?,
            };
            tried.bench.rows = rows;
            tried.bench.prepare(m)?;
            let label = PROMISES[usize::min(raise, PROMISES.len() - 1)];
            let drawn = draw(&self.objects, &ground.layout, label, self.seed, PROMISED)?;
            let measured = tried.bench.measure(drawn, m)?;
            let scores = tried.bench.score(&measured, m, classes.as_ref())?;
            let expected = self.expectation(ground, &scores)?;
            let short = expected.iou.mean < self.iou && tried.reached.is_some();
            if short && m < tried.most && raise < RAISE.1 {
                #[expect(clippy::cast_possible_truncation, reason = "thousands of measurements")]
                let more = (m as f64 * RAISE.0).ceil() as usize;
                m = more.min(tried.most);
                continue;
            }
            tried.reached = (!short && tried.reached.is_some()).then_some(m);
            let design = self.design(ground, &tried, m, expected);
            return Ok((tried, design));
        }
        unreachable!("the range has no end")
    }

    /// Classes of the seventeen objects, where they can be told apart.
    pub(super) fn classes(&self, ground: &Ground) -> Result<Option<Classes>, DesignError> {
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
            Some(format!(
                "{taxels} taxels: templates are for {MOST_CLASS_TAXELS} at most"
            ))
        } else {
            None
        }
    }

    fn expectation(&self, ground: &Ground, scores: &[RepetitionScore]) -> Result<Expectation, DesignError> {
        let of = |values: Vec<f64>, quantities: usize, range: [f64; 2]| {
            promise(&values, quantities, range).ok_or_else(|| DesignError::NoDesign {
                what: "promise".to_owned(),
                reason: "fewer than two repetitions".to_owned(),
            })
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

    fn design(&self, ground: &Ground, tried: &Tried, m: usize, expected: Expectation) -> Design {
        let layout = &ground.layout;
        let (rows, cols, wires) = (layout.rows(), layout.cols(), tried.curve.wires);
        let decoder = &tried.bench.decoder;
        let prior = &ground.prior;
        Design {
            rows,
            cols,
            taxels: layout.taxels(),
            pitch_m: layout.pitch_m(),
            electrode_m: layout.electrode_m(),
            objects: self.objects.clone(),
            wires,
            sub_arrays: tried.bench.rows.bands.iter().map(|band| band.len() * cols).collect(),
            wire: tried.wire.clone(),
            row_source: tried.source.clone(),
            m_per_wire: m,
            m: m * wires,
            decoder: DecoderDesign {
                name: "SheetDecoder".to_owned(),
                places: tried.bench.places(m),
                covariance_along_rows: (0..cols).map(|d| prior.covariance(0, d)).collect(),
                covariance_along_cols: (0..rows).map(|d| prior.covariance(0, d * cols)).collect(),
                bytes: decoder.bytes(m * wires),
                products: decoder.products(m * wires, tried.bench.places(m)),
            },
            expected,
            seed: self.seed,
        }
    }
}

/// Labels of the promises' touches: every attempt has its own.
const PROMISES: [&str; 5] = [
    "design/promised",
    "design/promised/1",
    "design/promised/2",
    "design/promised/3",
    "design/promised/4",
];

/// Electronics of a number of wires with some rows.
pub(super) struct Wired {
    pub(super) wire: WireDesign,
    pub(super) profile: Profile,
    pub(super) most: usize,
    by_latency: bool,
}

/// IoU and place at `m` measurements.
fn point(bench: &mut Bench, measured: &[Repetition], m: usize) -> Result<Option<DesignPoint>, DesignError> {
    bench.prepare(m)?;
    let scores = bench.score(measured, m, None)?;
    let iou: Vec<f64> = scores.iter().map(|s| s.iou).collect();
    Ok(band(&iou).map(|iou| DesignPoint {
        m_per_wire: m,
        iou,
        place_px: mean(&scores, |s| s.place_px),
    }))
}

/// The one to build: of those that reach the IoU the one with the fewest wires and then the fewest measurements, else
/// the one with the best IoU.
fn best(tried: &[Tried]) -> usize {
    let reaching = (0..tried.len()).filter(|k| tried[*k].reached.is_some());
    let fewest = reaching.min_by_key(|k| (tried[*k].curve.wires, tried[*k].chosen()));
    fewest.unwrap_or_else(|| {
        let better = |a: &usize, b: &usize| tried[*a].iou().total_cmp(&tried[*b].iou()).then(b.cmp(a));
        (0..tried.len()).max_by(better).unwrap_or_default()
    })
}

/// Whether the clock is slower than the published one.
pub(super) fn is_slowed(wire: &WireDesign) -> bool {
    wire.feedback_limit == FeedbackLimit::SlowerClock
}

/// Streams of a check.
pub(super) fn check_streams(seed: u64) -> u64 {
    use rand::RngExt as _;
    Streams::new(seed).rng("design/check", 0).random()
}
