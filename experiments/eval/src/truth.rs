//! The true image of a press: what a simulation knows, else the least-squares image of the press's own samples, else a
//! raster frame of another press.

use crate::protocol::{Truth, mask};
use crate::session::ScoredSession;
use crate::windows::{Press, Window, compressive_wires};
use serde::{Deserialize, Serialize};
use spts_circuit::Recording;
use spts_recon::MatrixView;
use spts_recon::metrics::SupportScore;
use spts_recon::recover::LeastSquares;
use std::ops::Range;

/// Where a true image comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TruthKind {
    /// The conductances of the press, which a simulation knows.
    Simulated,
    /// Non-negative least squares on the samples of the press's own hold, those of the scored window left out.
    Press,
    /// One frame of a raster scan of another press.
    Raster,
}

impl TruthKind {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Simulated => "simulated",
            Self::Press => "press",
            Self::Raster => "raster",
        }
    }
}

/// Samples of half a hold that an image is fitted to, for every taxel at least. The error of an image of L samples is
/// √(N/(L − N)) of the noise of a sample over √N.
const LEAST_PER_TAXEL: usize = 4;
/// Share of the square of a taxel's column that other columns must not explain.
const DETERMINED: f64 = 0.02;
/// Images are fitted on skins of at most so many taxels: time grows with their square.
pub(crate) const MOST_TAXELS: usize = 600;
/// Samples of a simulated press that an image is fitted to, for every taxel at most. It says what the readout allows,
/// and is not the truth.
const SIMULATED_PER_TAXEL: usize = 60;

/// What is known of the true image of one press, and how well.
#[derive(Debug, Clone)]
pub struct PressTruth {
    /// Where `truth` comes from.
    pub kind: TruthKind,
    /// The image, of all samples of the hold where it is fitted to them.
    pub truth: Truth,
    /// One frame of a raster scan of another press, if there is one.
    pub raster: Option<Truth>,
    /// How good the truth or the readout is, as an intersection over union. Of a fitted image: that of the images of
    /// the first and of the second half of the hold. Of a simulated one: that of the image which is fitted to the hold,
    /// of at most 60 samples a taxel. `None` where none is fitted.
    pub ceiling: Option<f64>,
    /// Intersection over union of the raster frame and the image that is fitted to all samples of the hold.
    pub ceiling_raster: Option<f64>,
    /// Half of the root mean square difference of the images of both halves of the hold, as a share of the largest
    /// value: the error of a taxel of a fitted image.
    pub error: Option<f64>,
    /// The sums of the fit; of a truth that is fitted alone.
    fit: Option<LeastSquares>,
}

impl PressTruth {
    /// The truth of block `block` of the compressive recording of `session`; `None` if nothing is known of it.
    pub fn of(session: &ScoredSession, block: usize) -> Option<Self> {
        let simulated = session.simulated.get(block).cloned().flatten().map(Truth::of);
        let raster = session.raster_truth();
        let enough = |r: &&Recording| session.held && may_be_fitted(r, session.protocol.measurements(r).len());
        let fitted = session.compressive.as_ref().filter(enough).and_then(|recording| {
            let press = Press::new(recording, block, &session.protocol);
            Fitted::of(recording, &press, simulated.is_some())
        });
        let whole = fitted.as_ref().map(|fitted| &fitted.image);
        let against = |truth: &Truth| Some(SupportScore::new(&whole?.support, &truth.support).iou);
        let ceiling_raster = raster.as_ref().and_then(against);
        let error = fitted.as_ref().map(|fitted| fitted.error);
        let (kind, truth, ceiling, fit) = match (simulated, fitted) {
            (Some(truth), fitted) => {
                let ceiling = fitted.map(|f| SupportScore::new(&f.image.support, &truth.support).iou);
                (TruthKind::Simulated, truth, ceiling, None)
            }
            (None, Some(fitted)) => (TruthKind::Press, fitted.image, Some(fitted.agreement), Some(fitted.fit)),
            (None, None) => (TruthKind::Raster, raster.clone()?, None, None),
        };
        Some(Self { kind, truth, raster, ceiling, ceiling_raster, error, fit })
    }

    /// The raster frame of another press of `session` alone; `None` if there is none.
    pub(crate) fn by_raster(session: &ScoredSession) -> Option<Self> {
        let truth = session.raster_truth()?;
        let (ceiling, raster, kind) = (None, None, TruthKind::Raster);
        Some(Self { kind, truth, raster, ceiling, ceiling_raster: None, error: None, fit: None })
    }

    /// The truth for an answer that has seen `windows` of the hold: without their samples, where it is fitted to
    /// samples. `None` if the others do not determine it.
    pub fn without<'a>(&self, windows: impl IntoIterator<Item = Window<'a>>) -> Option<Truth> {
        let Some(fit) = &self.fit else {
            return Some(self.truth.clone());
        };
        let mut fit = fit.clone();
        let mut rows = Vec::new();
        for window in windows {
            let window = window.with_rows(&mut rows);
            fit.remove(window.phi, window.wires, window.y);
        }
        let enough = fit.count() >= (LEAST_PER_TAXEL * self.truth.image.len()) as f64 && fit.determines(DETERMINED);
        enough.then(|| fit.solve().ok().map(Truth::of))?
    }
}

/// Whether `recording` may have a fitted image of a hold of so many samples.
pub(crate) fn may_be_fitted(recording: &Recording, samples: usize) -> bool {
    recording.taxels() <= MOST_TAXELS && samples >= 2 * LEAST_PER_TAXEL * recording.taxels()
}

/// The image that is fitted to all samples of `press`; `None` if they determine none.
pub(crate) fn fitted(recording: &Recording, press: &Press) -> Option<Truth> {
    let fit = sums(recording, press, 0..press.len())?;
    fit.solve().ok().map(Truth::of)
}

/// The sums over the measurements `range` of `press`; `None` if they do not determine an image.
fn sums(recording: &Recording, press: &Press, range: Range<usize>) -> Option<LeastSquares> {
    let mut fit = LeastSquares::new(recording.taxels(), compressive_wires(recording));
    let (rows, wires, y) = press.measured(range);
    fit.add(MatrixView::new(y.len(), recording.taxels(), rows).ok()?, wires, y);
    fit.determines(DETERMINED).then_some(fit)
}

/// An image that is fitted to a hold.
struct Fitted {
    fit: LeastSquares,
    image: Truth,
    /// Intersection over union of the images of both halves.
    agreement: f64,
    error: f64,
}

impl Fitted {
    /// The image of `press`; `None` if its samples do not determine one.
    fn of(recording: &Recording, press: &Press, simulated: bool) -> Option<Self> {
        let taxels = recording.taxels();
        let most = if simulated { SIMULATED_PER_TAXEL * taxels } else { usize::MAX };
        let len = press.len().min(most);
        let first = sums(recording, press, 0..len / 2)?;
        let second = sums(recording, press, len / 2..len)?;
        let [a, b] = [first.solve().ok()?, second.solve().ok()?];
        let mut fit = first;
        fit.merge(&second);
        let image = fit.solve().ok()?;
        let peak = image.iter().copied().fold(0.0, f64::max);
        if peak <= 0.0 {
            return None;
        }
        let squares: f64 = a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum();
        let error = 0.5 * (squares / taxels as f64).sqrt() / peak;
        let agreement = SupportScore::new(&mask(&a), &mask(&b)).iou;
        Some(Self { fit, image: Truth::of(image), agreement, error })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use spts::session::{Event, Recorded, Session};
    use spts_circuit::{Block, RecordingInfo, Seeding, WeightMode, Weights};
    use spts_models::SkinLayout;

    const SAMPLES: u64 = 800;

    /// A hold of an image on 16 taxels, without noise, and of another one in its second half.
    fn session(later: f64) -> ScoredSession {
        let weights = Weights::new(WeightMode::Binary, Seeding::Mixed, 16);
        let info = RecordingInfo::new(SkinLayout::new(4, 4, 5e-3, 3e-3).unwrap(), weights.clone(), 64_300.0);
        let taxel = |k: u32| [0.0, 0.0, 1.0, 0.5][k as usize % 4] * f64::from(u8::from(k > 7));
        let sample = |row: u64| {
            let sum: f64 = (0..16_u32).map(|k| weights.level(k, row) * taxel(k)).sum();
            2.5 + sum + if row >= SAMPLES / 2 { later * weights.level(0, row) } else { 0.0 }
        };
        let block = Block { frame_position: 50, idle_frames: None, volts: (0..SAMPLES).map(sample).collect() };
        let recording = Recording::new(info, vec![block]).unwrap();
        let whole = Session {
            hold_s: Some([0.0, SAMPLES as f64 / 64_300.0]),
            compressive: Some(Recorded::new(recording)),
            ..Session::new("hold", Event::Press)
        };
        ScoredSession::new(whole, 0)
    }

    /// The image is that of the samples, whatever the output of the untouched wire; the recording alone is enough. What
    /// is left of too long a window determines nothing, and is no truth.
    #[test]
    fn a_hold_without_noise_is_known_exactly() {
        let session = session(0.0);
        assert!(session.without_scan() && !session.scorable());
        let known = session.truth(0).unwrap();
        assert_eq!((known.kind, known.ceiling, known.ceiling_raster), (TruthKind::Press, Some(1.0), None));
        assert!(known.error.unwrap() < 1e-9);
        let press = Press::new(session.compressive.as_ref().unwrap(), 0, &session.protocol);
        for (m, there) in [(1, true), (100, true), (700, true), (790, false), (800, false)] {
            let truth = known.without(press.window(0, m));
            assert_eq!(truth.is_some(), there, "{m}");
            for (k, v) in truth.iter().flat_map(|truth| truth.image.iter().enumerate()) {
                let expected = known.truth.image[k];
                assert!((v - expected).abs() < 1e-9 && (*v > 0.1) == (k > 7 && k % 4 > 1), "{m}: {k}: {v} {expected}");
            }
        }
    }

    /// A load that comes in the middle of the hold is in one half alone: five taxels against four.
    #[test]
    fn a_hold_that_changes_has_a_lower_ceiling() {
        let known = session(0.6).truth(0).unwrap();
        assert!((known.ceiling.unwrap() - 0.8).abs() < 1e-12, "{:?}", known.ceiling);
        // the halves differ by .6 on one of 16 taxels
        assert!((known.error.unwrap() - 0.5 * 0.6 / 4.0).abs() < 0.02, "{:?}", known.error);
    }
}
