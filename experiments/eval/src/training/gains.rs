//! Gains of a skin's taxels, estimated from its raster images and simulated images of the same contacts.

use crate::session::ScoredSession;
use nalgebra::{Cholesky, DMatrix, DVector};
use rand_distr::{Distribution, StandardNormal};
use serde::Serialize;
use spts_circuit::Block;
use spts_input::Refusal;
use spts_models::{Mounting, SkinLayout, Streams, TaxelGains, VelostatConfig};
use spts_recon::classify::Library;
use spts_recon::metrics::pearson;

/// Where the fit of [`SkinGains::contact_log_sd`] begins (`scripts/fit_objects.py` at the tag `before-halving` fits its
/// gains with the same).
const CONTACT_LOG_SD: f64 = 0.35;
/// A taxel takes part where the simulated image is above this share of its maximum: below it, a small shift of an edge
/// makes any ratio. Shares from .1 to .35 lead to the same classes within .01.
const TOUCHED: f64 = 0.1;
/// No contact is believed to tell more than this factor about one taxel.
const LARGEST_FACTOR: f64 = 4.0;

/// Gains of a skin estimated from raster presses: the posterior of a linear mixed model.
///
/// On the taxels touched in a simulated contact, log(v/m) = a + l + c + e. v is the image of the skin and m that of the
/// simulation at gain 1. a is the unknown amplitude of the session. l ~ N(0, σ²) is the logarithm of the taxel's gain,
/// the same in all sessions. c ~ N(0, σ_c²) is the error of this object's simulated contact. e is the change by this
/// mounting of the skin, a plane included ([`Mounting`]). σ and σ_c are fitted to the ratios; the mounting is given.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SkinGains {
    /// The posterior.
    #[serde(flatten)]
    pub gains: TaxelGains,
    /// σ: standard deviation of the logarithm of the gains over the skin.
    pub spread_log_sd: f64,
    /// σ_c: standard deviation of the logarithm of a contact's error on a taxel.
    pub contact_log_sd: f64,
    /// Number of sessions with information about each taxel.
    pub sessions: Vec<usize>,
    /// Number of objects pressed in them.
    pub fitted_objects: usize,
}

impl SkinGains {
    /// Estimates the gains from `skin`, one image for each session, and `simulated`, one image of the contact at gain 1
    /// for each label. Labels that are not in both are ignored. `layout` is that of the skin.
    ///
    /// # Errors
    /// [`Refusal`] if no label is in both, or an image has not one value for each taxel.
    pub fn estimate(
        skin: &Library,
        simulated: &Library,
        layout: &SkinLayout,
        mounting: Mounting,
    ) -> Result<Self, Refusal> {
        let taxels = layout.taxels();
        let found = [skin, simulated].map(|library| library.images().nrows());
        if found != [taxels; 2] {
            let [skin, simulated] = found;
            return Err(Refusal::new(format!(
                "images of the skin have {skin} taxels, simulated ones {simulated}, and the skin {taxels}"
            )));
        }
        let (mut ratios, mut count, mut sessions) = (Vec::new(), vec![0; taxels], 0);
        for (k, &object) in skin.labels().iter().enumerate() {
            let Some(l) = simulated.labels().iter().position(|s| *s == object) else {
                continue;
            };
            let logs = logs(&skin.images().column(k), &simulated.images().column(l));
            for &(taxel, log) in &logs {
                count[taxel] += 1;
                ratios.push(Ratio { session: sessions, object, taxel, place: layout.share_of_half(taxel), log });
            }
            sessions += usize::from(!logs.is_empty());
        }
        if sessions == 0 {
            return Err(Refusal::new("no object has both an image of the skin and a simulated one"));
        }
        let mut fitted: Vec<usize> = ratios.iter().map(|r| r.object).collect();
        fitted.sort_unstable();
        fitted.dedup();
        let model = MixedModel::new(ratios, taxels, sessions);
        let effects =
            model.fitted(Effects { gain: VelostatConfig::default().spread_log_sd, contact: CONTACT_LOG_SD, mounting });
        let solution = model.solve(effects);
        Ok(Self {
            gains: TaxelGains { shape: None, log_mean: solution.mean, log_sd: solution.sd, mounting },
            spread_log_sd: effects.gain,
            contact_log_sd: effects.contact,
            sessions: count,
            fitted_objects: fitted.len(),
        })
    }
}

/// How well estimated gains predict an image that they were not estimated from: the image of a contact on the real
/// skin, beside the simulation of the same contact.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct GainCheck {
    /// Number of taxels touched in the simulated contact.
    pub taxels: usize,
    /// Correlation of the skin's image with the simulated one, all gains 1.
    pub correlation: f64,
    /// Correlation of the skin's image with the simulated one times the estimated gains.
    pub correlation_with_gains: f64,
    /// Share of the touched taxels whose ratio of skin to simulation lies in the 90 % interval that the uncertainties
    /// of gain, contact and mounting predict; 0.9 is expected.
    pub inside: f64,
}

/// Half width of a two-sided 90 % interval of a normal distribution, standard deviations.
pub const BAND_SD: f64 = 1.644_853_626_951_472_7;

impl SkinGains {
    /// Compares `skin`, an image from the real skin, with `simulated`, the same contact on a skin of gain 1; both have
    /// one value for each taxel of `layout`. `None` if fewer than two taxels are touched.
    pub fn check(&self, skin: &[f64], simulated: &[f64], layout: &SkinLayout) -> Option<GainCheck> {
        let with_gains = simulated.iter().zip(&self.gains.log_mean).map(|(v, log)| v * log.exp());
        let with_gains: Vec<f64> = with_gains.collect();
        let logs = logs(skin, simulated);
        // what is left of a ratio without the gain, and its variance
        let left = logs.iter().map(|&(i, log)| {
            let mounting = self.gains.mounting.taxel_log_sd(layout.share_of_half(i));
            let sd = self.gains.log_sd[i].hypot(self.contact_log_sd).hypot(mounting);
            (log - self.gains.log_mean[i], sd * sd)
        });
        let left: Vec<(f64, f64)> = left.collect();
        if left.len() < 2 {
            return None;
        }
        let weight: f64 = left.iter().map(|(_, variance)| 1.0 / variance).sum();
        let amplitude = left.iter().map(|(log, variance)| log / variance).sum::<f64>() / weight;
        let inside = |(log, variance): &&(f64, f64)| {
            // the amplitude is their own mean, which takes its share of the variance
            (log - amplitude).abs() <= BAND_SD * (variance - 1.0 / weight).max(0.0).sqrt()
        };
        Some(GainCheck {
            taxels: left.len(),
            correlation: pearson(skin, simulated)?,
            correlation_with_gains: pearson(skin, &with_gains)?,
            inside: left.iter().filter(inside).count() as f64 / left.len() as f64,
        })
    }
}

/// The raster `sessions` as skins with these `gains` would record them. Every press is on another possible skin,
/// mounted anew. Compressive recordings are dropped. Presses come in pairs with opposite deviations from the mean, so
/// that their mean image is close to that of the mean gains. The result depends only on `streams`.
///
/// # Errors
/// [`Refusal`] if a gain makes a sample infinite.
pub fn on_skins_with(
    gains: &TaxelGains,
    sessions: &[ScoredSession],
    streams: Streams,
) -> Result<Vec<ScoredSession>, Refusal> {
    let with_gains = |session: &ScoredSession| {
        let Some(raster) = &session.raster else {
            return Ok(session.clone());
        };
        let blocks = raster.blocks().iter().enumerate().map(|(k, block)| {
            let mut rng = streams.rng("gains/skin", (k / 2) as u64);
            let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
            let mut normals = move || sign * Distribution::<f64>::sample(&StandardNormal, &mut rng);
            let fixed: Vec<f64> = gains.at(std::iter::repeat_with(&mut normals)).collect();
            let slopes = [normals(), normals()];
            let mounted = gains.mounting.factors(raster.layout(), slopes, normals);
            let of_taxels: Vec<f64> = fixed.iter().zip(mounted).map(|(fixed, mounted)| fixed * mounted).collect();
            Block {
                frame_position: block.frame_position,
                idle_frames: block.idle_frames,
                volts: block.volts.iter().zip(of_taxels.iter().cycle()).map(|(v, g)| v * g).collect(),
            }
        });
        Ok(ScoredSession { raster: Some(raster.with_blocks(blocks.collect())?), compressive: None, ..session.clone() })
    };
    sessions.iter().map(with_gains).collect()
}

/// Logarithm of the ratio of the images on the taxels that the simulated one touches, both scaled to the same sum
/// there.
fn logs(skin: &[f64], simulated: &[f64]) -> Vec<(usize, f64)> {
    let threshold = TOUCHED * simulated.iter().copied().fold(0.0, f64::max);
    let touched: Vec<usize> = (0..skin.len()).filter(|&i| simulated[i] > threshold).collect();
    let sum = |image: &[f64]| touched.iter().map(|&i| image[i].max(0.0)).sum::<f64>();
    let scale = sum(skin) / sum(simulated);
    let log = |&i: &usize| {
        let ratio = skin[i].max(0.0) / (scale * simulated[i]);
        (i, ratio.clamp(1.0 / LARGEST_FACTOR, LARGEST_FACTOR).ln())
    };
    if scale > 0.0 && scale.is_finite() { touched.iter().map(log).collect() } else { Vec::new() }
}

/// γ of every taxel of a `skin` with these `gains` in one session: the relative standard deviation √(exp(σ²) − 1) of
/// its log-normal gain.
pub fn gain_sds(gains: &TaxelGains, skin: &SkinLayout) -> Vec<f64> {
    gains.session_log_sd(skin).map(relative_sd).collect()
}

/// γ of an unknown skin: the relative standard deviation of its taxels' log-normal gains in one session, √(exp(σ² +
/// σₛ²) − 1), with the transducer's σ = `spread_log_sd` and σₛ of its [`Mounting`].
pub fn simulated_gain_sd() -> f64 {
    let sheet = VelostatConfig::default();
    relative_sd(sheet.spread_log_sd.hypot(sheet.mounting().mean_log_sd()))
}

/// Relative standard deviation √(exp(σ²) − 1) of a log-normal value whose logarithm has the standard deviation σ =
/// `log_sd`.
fn relative_sd(log_sd: f64) -> f64 {
    (log_sd * log_sd).exp_m1().sqrt()
}

/// Logarithm of a session's image over the simulated one on one taxel.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Ratio {
    /// Number of the session, from 0.
    session: usize,
    /// Number of the pressed object.
    object: usize,
    /// Taxel, and its place along the rows and the columns ([`SkinLayout::share_of_half`]).
    taxel: usize,
    place: [f64; 2],
    /// log(v/m).
    log: f64,
}

/// Standard deviations of the three random effects.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Effects {
    /// σ of the taxels' gains.
    gain: f64,
    /// σ_c of the error of a simulated contact on a taxel.
    contact: f64,
    /// What mounting the skin changes: σₘ and τ.
    mounting: Mounting,
}

/// What the ratios say under given effects.
#[derive(Debug, Clone, PartialEq)]
struct Solution {
    /// Mean of every taxel's log gain.
    mean: Vec<f64>,
    /// Its standard deviation.
    sd: Vec<f64>,
    /// Restricted log-likelihood of the effects, up to a constant.
    log_likelihood: f64,
}

/// Ratios of sessions and taxels, r = a_s + p_s·u_i + q_s·v_i + l_i + c_oi + m_si with a_s of a flat density, p_s, q_s
/// ~ N(0, τ²), l_i ~ N(0, σ²), c_oi ~ N(0, σ_c²) shared by all sessions of an object, m_si ~ N(0, σₘ²), all
/// independent.
///
/// Source: S. R. Searle, G. Casella and C. E. McCulloch, *Variance Components* (1992), chapters 6 and 7 (restricted
/// likelihood, prediction of random effects). Given the effects, the ratios of an object on a taxel have the covariance
/// σ_c² 11ᵀ + σₘ² I, whose inverse is (I − ρ 11ᵀ)/σₘ² with ρ = σ_c²/(σₘ² + n σ_c²). Every such group tells about one
/// taxel, so that the taxels' part of the normal equations is diagonal and is eliminated: O(taxels × sessions²).
struct MixedModel {
    /// Ratios sorted by taxel and object.
    ratios: Vec<Ratio>,
    taxels: usize,
    sessions: usize,
}

/// Smallest standard deviation of an effect, which keeps the inverse finite, and of the slopes, which stand apart.
const SMALLEST: [f64; 2] = [1e-3, 1e-6];

impl MixedModel {
    /// The model of `ratios` on `taxels` taxels; every session from 0 to `sessions` has one at least.
    fn new(mut ratios: Vec<Ratio>, taxels: usize, sessions: usize) -> Self {
        ratios.sort_by_key(|r| (r.taxel, r.object, r.session));
        Self { ratios, taxels, sessions }
    }

    /// Posterior of the gains, and the likelihood of the effects.
    fn solve(&self, effects: Effects) -> Solution {
        // a level and two slopes of every session
        let s = 3 * self.sessions;
        let Mounting { log_sd, tilt_log_sd } = effects.mounting;
        let [prior, contact, mounting] = [effects.gain, effects.contact, log_sd].map(|sd| sd.max(SMALLEST[0]).powi(2));
        let tilt = tilt_log_sd.max(SMALLEST[1]).powi(2);
        let (mut h, mut b) = (DMatrix::zeros(s, s), DVector::zeros(s));
        // of every taxel: its own precision and right side, and its coupling with the sessions
        let mut own = vec![(1.0 / prior, 0.0); self.taxels];
        let mut coupling = vec![DVector::zeros(s); self.taxels];
        let (mut squares, mut log_determinant) = (0.0, 2.0 * self.sessions as f64 * tilt.ln());
        for slope in (0..s).filter(|k| k % 3 > 0) {
            h[(slope, slope)] = 1.0 / tilt;
        }
        let of_session = |r: &Ratio| {
            let [u, v] = r.place;
            [(3 * r.session, 1.0), (3 * r.session + 1, u), (3 * r.session + 2, v)]
        };
        for group in self.ratios.chunk_by(|a, b| (a.taxel, a.object) == (b.taxel, b.object)) {
            let n = group.len() as f64;
            let whole = mounting + n * contact;
            let rho = contact / whole;
            log_determinant += (n - 1.0) * mounting.ln() + whole.ln();
            let sum: f64 = group.iter().map(|r| r.log).sum();
            let taxel = group[0].taxel;
            // 1ᵀ W 1 = n/whole, W 1 = 1/whole
            own[taxel].0 += n / whole;
            own[taxel].1 += sum / whole;
            for r in group {
                let weighted = (r.log - rho * sum) / mounting;
                squares += r.log * weighted;
                for (k, x) in of_session(r) {
                    b[k] += x * weighted;
                    coupling[taxel][k] += x / whole;
                    of_session(r).iter().for_each(|(l, y)| h[(k, *l)] += x * y / mounting);
                    for (l, y) in group.iter().flat_map(of_session) {
                        h[(k, l)] -= x * y * rho / mounting;
                    }
                }
            }
        }
        for ((precision, right), coupling) in own.iter().zip(&coupling) {
            log_determinant += precision.ln() + prior.ln();
            squares -= right * right / precision;
            h.ger(-1.0 / precision, coupling, coupling, 1.0);
            b.axpy(-right / precision, coupling, 1.0);
        }
        let Some(factor) = Cholesky::new(h) else {
            // a session whose amplitude is not seen: it has no ratio
            return Solution {
                mean: vec![0.0; self.taxels],
                sd: vec![prior.sqrt(); self.taxels],
                log_likelihood: f64::NEG_INFINITY,
            };
        };
        let amplitudes = factor.solve(&b);
        squares -= amplitudes.dot(&b);
        log_determinant += factor.ln_determinant();
        let gains = own.iter().zip(&coupling).map(|((precision, right), coupling)| {
            let mean = (right - coupling.dot(&amplitudes)) / precision;
            let variance = 1.0 / precision + factor.solve(coupling).dot(coupling) / precision.powi(2);
            (mean, variance.sqrt())
        });
        let (mean, sd) = gains.unzip();
        Solution { mean, sd, log_likelihood: -0.5 * (log_determinant + squares) }
    }

    /// The spread of the gains and the error of a contact that make the restricted likelihood times a weak prior
    /// largest: log-normal about `start`, with a standard deviation of [`PRIOR_LOG_SD`]. The mounting is as given.
    fn fitted(&self, start: Effects) -> Effects {
        let score = |effects: Effects| {
            let away = |value: f64, about: f64| ((value / about).ln() / PRIOR_LOG_SD).powi(2);
            self.solve(effects).log_likelihood
                - 0.5 * (away(effects.gain, start.gain) + away(effects.contact, start.contact))
        };
        let mut best = start;
        for _ in 0..SWEEPS {
            best.gain = largest(|gain| score(Effects { gain, ..best }));
            best.contact = largest(|contact| score(Effects { contact, ..best }));
        }
        best
    }
}

/// Standard deviation of the logarithm of a standard deviation that is not known yet: a factor of 1.65.
const PRIOR_LOG_SD: f64 = 0.5;
/// Standard deviations that are looked at.
const RANGE: [f64; 2] = [0.02, 1.5];
/// Rounds over both of them: the second changes the third place, the fourth none that is kept.
const SWEEPS: usize = 4;
/// Golden sections of the logarithm's range: to 1e-4 of the value.
const SECTIONS: usize = 24;

/// The value in [`RANGE`] at which `score`, with one maximum there, is largest: golden section of the logarithm.
fn largest(score: impl Fn(f64) -> f64) -> f64 {
    let share = (5.0_f64.sqrt() - 1.0) / 2.0;
    let [mut low, mut high] = RANGE.map(f64::ln);
    let mut inner = [high - share * (high - low), low + share * (high - low)];
    let mut scores = inner.map(|x| score(x.exp()));
    for _ in 0..SECTIONS {
        if scores[0] > scores[1] {
            high = inner[1];
            inner = [high - share * (high - low), inner[0]];
            scores = [score(inner[0].exp()), scores[0]];
        } else {
            low = inner[0];
            inner = [inner[1], low + share * (high - low)];
            scores = [scores[1], score(inner[1].exp())];
        }
    }
    f64::midpoint(low, high).exp()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng as _;
    use rand_chacha::ChaCha8Rng;
    use spts::Session;
    use spts::session::{Event, Recorded};
    use spts_circuit::{Block, Recording, RecordingInfo, Seeding, WeightMode, Weights};
    use spts_models::SkinLayout;
    use spts_recon::Matrix;

    const MOUNTED: Mounting = Mounting { log_sd: 0.1, tilt_log_sd: 0.0 };

    fn three() -> SkinLayout {
        SkinLayout::new(1, 3, 15e-3, 10e-3).unwrap()
    }

    fn library(images: &[&[f64]]) -> Library {
        let labels: Vec<usize> = (1..=images.len()).collect();
        Library::new(&Matrix::from_column_slices(3, images), &labels).unwrap()
    }

    /// Two objects on two taxels whose gains are e^±a, all ratios exact. With the amplitude free, the difference of the
    /// two log gains has a prior of variance 2σ² and two measurements of variance 2(σ_c² + σₘ²): it is 2a · 2/(2 +
    /// (σ_c² + σₘ²)/σ²).
    #[test]
    fn gains_shrink_as_the_regression_says() {
        let a = 0.2_f64;
        let simulated = library(&[&[1.0, 1.0, 0.0], &[2.0, 2.0, 0.0]]);
        let skin = library(&[&[a.exp(), (-a).exp(), 0.0], &[a.exp(), (-a).exp(), 0.5]]);
        let found = SkinGains::estimate(&skin, &simulated, &three(), MOUNTED).unwrap();
        let ridge = (found.contact_log_sd.powi(2) + 0.1_f64.powi(2)) / found.spread_log_sd.powi(2);
        let mean = &found.gains.log_mean;
        let expected = 2.0 * a * 2.0 / (2.0 + ridge);
        let got = mean[0] - mean[1];
        assert!((got - expected).abs() < 1e-12, "{got}, expected {expected}");
        assert!(mean[2].abs() < 1e-15, "nothing has touched it");
        assert!((found.gains.log_sd[2] - found.spread_log_sd).abs() < 1e-12);
        assert!(found.gains.log_sd[0] < found.spread_log_sd);
        assert_eq!(found.sessions, [2, 2, 0]);
    }

    #[test]
    fn what_has_no_pair_is_refused() {
        let one = library(&[&[1.0, 0.0, 0.0]]);
        let other = Library::new(&Matrix::from_column_slices(3, &[&[1.0, 0.0, 0.0]]), &[7]).unwrap();
        let said = |simulated| SkinGains::estimate(&one, simulated, &three(), MOUNTED).unwrap_err().to_string();
        assert!(said(&other).contains("no object has both"));
        let larger = Library::new(&Matrix::from_column_slices(4, &[&[1.0; 4]]), &[1]).unwrap();
        assert!(said(&larger).contains("have 3 taxels, simulated ones 4, and the skin 3"));
    }

    /// A pair of presses has opposite deviations: the geometric mean of their images is that of the mean gains.
    #[test]
    fn pairs_of_skins_have_the_mean_gains() {
        let gains = TaxelGains {
            shape: None,
            log_mean: vec![0.4, -0.2, 0.0],
            log_sd: vec![0.1, 0.3, 0.0],
            mounting: Mounting { log_sd: 0.1, tilt_log_sd: 0.2 },
        };
        let layout = SkinLayout::new(1, 3, 5e-3, 3e-3).unwrap();
        let info = RecordingInfo::new(layout, Weights::new(WeightMode::Raster, Seeding::Mixed, 3), 64_300.0);
        let block = |k: u64| Block { frame_position: 100 * k, idle_frames: Some(0), volts: vec![1.0; 3 * 20] };
        let raster = Recording::new(info, (1..=2).map(block).collect()).unwrap();
        let session = Session {
            hold_s: Some([0.0, 1e-3]),
            raster: Some(Recorded::new(raster)),
            ..Session::new("rec", Event::Press)
        };
        let session = ScoredSession::new(session, 1);
        let shown = on_skins_with(&gains, std::slice::from_ref(&session), Streams::new(4)).unwrap();
        let [before, after] = [&session, &shown[0]].map(|s| s.raster.as_ref().unwrap().clone());
        for (taxel, mean) in gains.log_mean.iter().enumerate() {
            let log = |press: usize| (after.volts(press, 3)[taxel] / before.volts(press, 3)[taxel]).ln();
            let (first, second) = (log(0), log(1));
            assert!((f64::midpoint(first, second) - mean).abs() < 1e-12, "{taxel}");
            assert!((first - second).abs() > 1e-3, "{taxel}: skins differ");
        }
    }

    /// Sessions of objects on taxels with gains, contacts and mountings of these effects; every object touches two
    /// thirds of the taxels, and the last is pressed in two sessions.
    fn planted(effects: Effects, taxels: usize, objects: usize, seed: u64) -> (Vec<Ratio>, Vec<f64>) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let gains: Vec<f64> = (0..taxels).map(|_| effects.gain * normal()).collect();
        let layout = SkinLayout::new(taxels / 5, 5, 15e-3, 10e-3).unwrap();
        let mut ratios = Vec::new();
        for object in 0..objects {
            let sessions = object..object + 1 + usize::from(object + 1 == objects);
            let levels = [normal(), normal()];
            let slopes = [[normal(), normal()], [normal(), normal()]];
            for (taxel, gain) in gains.iter().enumerate() {
                if (taxel + object) % 3 == 0 {
                    continue;
                }
                let contact = effects.contact * normal();
                for session in sessions.clone() {
                    let place = layout.share_of_half(taxel);
                    let slope: f64 = slopes[session - object].iter().zip(place).map(|(slope, x)| slope * x).sum();
                    let mounting = effects.mounting.log_sd * normal() + effects.mounting.tilt_log_sd * slope;
                    let log = levels[session - object] + gain + contact + mounting;
                    ratios.push(Ratio { session, object, taxel, place, log });
                }
            }
        }
        (ratios, gains)
    }

    /// Generalised least squares with dense matrices (Searle and others, chapter 7): l̂ = σ² Zᵀ P r, and the restricted
    /// likelihood −½(log|V| + log|Xᵀ V⁻¹ X| + rᵀ P r).
    #[test]
    fn the_solution_is_that_of_dense_matrices() {
        let effects = Effects { gain: 0.3, contact: 0.35, mounting: Mounting { log_sd: 0.1, tilt_log_sd: 0.4 } };
        let (taxels, sessions) = (10, 5);
        let (ratios, _) = planted(effects, taxels, sessions - 1, 5);
        let model = MixedModel::new(ratios, taxels, sessions);
        let (r, n) = (&model.ratios, model.ratios.len());
        let same = |a: bool, sd: f64| if a { sd * sd } else { 0.0 };
        let v = DMatrix::from_fn(n, n, |i, j| {
            let taxel = r[i].taxel == r[j].taxel;
            same(taxel, effects.gain)
                + same(taxel && r[i].object == r[j].object, effects.contact)
                + same(i == j, effects.mounting.log_sd)
                + same(r[i].session == r[j].session, effects.mounting.tilt_log_sd)
                    * (r[i].place[0] * r[j].place[0] + r[i].place[1] * r[j].place[1])
        });
        let x = DMatrix::from_fn(n, sessions, |i, s| f64::from(u8::from(r[i].session == s)));
        let z = DMatrix::from_fn(n, taxels, |i, k| f64::from(u8::from(r[i].taxel == k)));
        let y = DVector::from_fn(n, |i, _| r[i].log);
        let inverse = v.clone().try_inverse().unwrap();
        let xvx = x.transpose() * &inverse * &x;
        let p = &inverse - &inverse * &x * xvx.clone().try_inverse().unwrap() * x.transpose() * &inverse;
        let mean = z.transpose() * &p * &y * effects.gain.powi(2);
        let covariance =
            DMatrix::identity(taxels, taxels) * effects.gain.powi(2) - z.transpose() * &p * &z * effects.gain.powi(4);
        let found = model.solve(effects);
        for k in 0..taxels {
            // matrices of condition below 1e4
            assert!((found.mean[k] - mean[k]).abs() < 1e-11, "{k}");
            assert!((found.sd[k] - covariance[(k, k)].sqrt()).abs() < 1e-11, "{k}");
        }
        let likelihood = -0.5 * (v.determinant().ln() + xvx.determinant().ln() + y.dot(&(&p * &y)));
        assert!((found.log_likelihood - likelihood).abs() < 1e-9, "{likelihood}");
    }

    /// 400 taxels under 12 objects: a standard deviation is known to about 1/√(2n) = 4 %, less what the other effect
    /// hides; 15 % are allowed. The gains are known as well as their stated deviation says: χ² of 400 values is in
    /// 400 ± 5 √800.
    #[test]
    fn planted_effects_are_found() {
        let effects = |gain, contact| Effects { gain, contact, mounting: Mounting { log_sd: 0.1, tilt_log_sd: 0.2 } };
        let expected = effects(0.25, 0.45);
        let (ratios, gains) = planted(expected, 400, 12, 8);
        let model = MixedModel::new(ratios, 400, 13);
        let found = model.fitted(effects(0.3, 0.35));
        for (found, expected) in [(found.gain, expected.gain), (found.contact, expected.contact)] {
            assert!((found / expected - 1.0).abs() < 0.15, "{found} for {expected}");
        }
        let solution = model.solve(found);
        let level = gains.iter().sum::<f64>() / 400.0;
        let z = gains.iter().zip(&solution.mean).zip(&solution.sd).map(|((g, m), s)| ((g - level - m) / s).powi(2));
        let chi2: f64 = z.sum();
        assert!((chi2 - 400.0).abs() < 5.0 * 800.0_f64.sqrt(), "{chi2}");
    }
}
