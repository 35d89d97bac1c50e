//! The search for rows and wires: more and more measurements, until the images are as good as wanted.

use super::bench::{Bench, Repetition, draw, mean, pressing};
use super::report::{DesignCurve, DesignPoint};
use super::rows::{BandRows, RowSource, bands};
use super::study::{DesignStudy, Ground, WireChoice};
use super::wire::WireDesign;
use crate::touches::{Touch, band};
use spts_circuit::Profile;
use spts_input::Refusal;

/// Fewest measurements of a wire that are looked at.
const FEWEST: usize = 6;
/// Most measurements of all wires that a decoder is prepared for, and most numbers that it may hold.
const MOST: (usize, usize) = (1024, 40_000_000);
/// Ratio of the numbers of measurements that are looked at, one after another.
const STEP: f64 = std::f64::consts::SQRT_2;
/// Halvings between the last number that does not do and the first that does.
const HALVINGS: usize = 2;
/// Repetitions that a number of measurements is looked at with.
const SEARCHED: usize = 8;

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

/// Electronics of a number of wires with some rows.
pub(super) struct Wired {
    pub(super) wire: WireDesign,
    pub(super) profile: Profile,
    pub(super) most: usize,
    by_latency: bool,
}

impl DesignStudy {
    /// Looks at more and more wires, until some rows reach the IoU.
    pub(super) fn search(&self, ground: &Ground) -> Result<Vec<Tried>, Refusal> {
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
    pub(super) fn wired(&self, ground: &Ground, wires: usize, source: &RowSource) -> Result<Wired, Refusal> {
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
        let profile = Profile::from_toml(&wire.profile(!alike)?).map_err(Refusal::from_error)?;
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
    fn look(&self, ground: &Ground, wires: usize, source: RowSource) -> Result<Tried, Refusal> {
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
    fn refine(&self, tried: &mut Tried, measured: &[Repetition]) -> Result<(), Refusal> {
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
fn point(bench: &mut Bench, measured: &[Repetition], m: usize) -> Result<Option<DesignPoint>, Refusal> {
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
pub(super) fn best(tried: &[Tried]) -> usize {
    let reaching = (0..tried.len()).filter(|k| tried[*k].reached.is_some());
    let fewest = reaching.min_by_key(|k| (tried[*k].curve.wires, tried[*k].chosen()));
    fewest.unwrap_or_else(|| {
        let better = |a: &usize, b: &usize| tried[*a].iou().total_cmp(&tried[*b].iou()).then(b.cmp(a));
        (0..tried.len()).max_by(better).unwrap_or_default()
    })
}
