//! Gains of a skin's taxels, estimated from its raster images and simulated images of the same contacts.

mod mixed;
#[cfg(test)]
mod tests;

use crate::session::ScoredSession;
use mixed::{Effects, MixedModel, Ratio};
use rand_distr::{Distribution, StandardNormal};
use serde::Serialize;
use spts_circuit::Block;
use spts_input::Refusal;
use spts_models::{Streams, TaxelGains, VelostatConfig};
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
/// the same in all sessions. c ~ N(0, σ_c²) is the error of this object's simulated contact. e ~ N(0, σₘ²) is the
/// change by this mounting of the skin. σ and σ_c are fitted to the ratios; σₘ is given.
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

/// Why gains cannot be estimated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SkinGainsError {
    /// No object has both an image of the skin and a simulated one.
    #[error("no object has both an image of the skin and a simulated one")]
    NoPair,
    /// Images of different sizes.
    #[error("images of the skin have {skin} taxels, simulated ones {simulated}")]
    Shape {
        /// Taxels of the skin.
        skin: usize,
        /// Taxels of the simulation.
        simulated: usize,
    },
}

impl SkinGains {
    /// Estimates the gains from `skin`, one image for each session, and `simulated`, one image of the contact at gain 1
    /// for each label. Labels that are not in both are ignored. `mounting_log_sd` is σₘ.
    ///
    /// # Errors
    /// [`SkinGainsError`] if no label is in both, or the image sizes differ.
    pub fn estimate(skin: &Library, simulated: &Library, mounting_log_sd: f64) -> Result<Self, SkinGainsError> {
        let taxels = skin.images().nrows();
        if taxels != simulated.images().nrows() {
            return Err(SkinGainsError::Shape {
                skin: taxels,
                simulated: simulated.images().nrows(),
            });
        }
        let (mut ratios, mut count, mut sessions) = (Vec::new(), vec![0; taxels], 0);
        for (k, &label) in skin.labels().iter().enumerate() {
            let Some(l) = simulated.labels().iter().position(|s| *s == label) else {
                continue;
            };
            let logs = logs(&skin.images().column(k), &simulated.images().column(l));
            if logs.is_empty() {
                continue;
            }
            for &(taxel, log) in &logs {
                count[taxel] += 1;
                ratios.push(Ratio {
                    session: sessions,
                    object: label,
                    taxel,
                    log,
                });
            }
            sessions += 1;
        }
        if sessions == 0 {
            return Err(SkinGainsError::NoPair);
        }
        let mut fitted: Vec<usize> = ratios.iter().map(|r| r.object).collect();
        fitted.sort_unstable();
        fitted.dedup();
        let model = MixedModel::new(ratios, taxels, sessions);
        let effects = model.fitted(Effects {
            gain: VelostatConfig::default().spread_log_sd,
            contact: CONTACT_LOG_SD,
            mounting: mounting_log_sd,
        });
        let solution = model.solve(effects);
        Ok(Self {
            gains: TaxelGains {
                shape: None,
                log_mean: solution.mean,
                log_sd: solution.sd,
                mounting_log_sd,
            },
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
    /// one value a taxel. `None` if fewer than two taxels are touched.
    #[must_use]
    pub fn check(&self, skin: &[f64], simulated: &[f64]) -> Option<GainCheck> {
        let with_gains: Vec<f64> = simulated
            .iter()
            .zip(&self.gains.log_mean)
            .map(|(v, log)| v * log.exp())
            .collect();
        let logs = logs(skin, simulated);
        // what is left of a ratio without the gain, and its variance
        let left: Vec<(f64, f64)> = logs
            .iter()
            .map(|&(i, log)| {
                let sd = self.gains.log_sd[i]
                    .hypot(self.contact_log_sd)
                    .hypot(self.gains.mounting_log_sd);
                (log - self.gains.log_mean[i], sd * sd)
            })
            .collect();
        // one alone is its own amplitude
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
    let session_gains = TaxelGains {
        log_sd: gains.session_log_sd().collect(),
        ..gains.clone()
    };
    let with_gains = |session: &ScoredSession| {
        let Some(raster) = &session.raster else {
            return Ok(session.clone());
        };
        let blocks = raster.blocks().iter().enumerate().map(|(k, block)| {
            let mut rng = streams.rng("gains/skin", (k / 2) as u64);
            let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
            let normal =
                std::iter::repeat_with(|| -> f64 { sign * Distribution::<f64>::sample(&StandardNormal, &mut rng) });
            let of_taxels: Vec<f64> = session_gains.at(normal).collect();
            Block {
                frame_position: block.frame_position,
                idle_frames: block.idle_frames,
                volts: block
                    .volts
                    .iter()
                    .zip(of_taxels.iter().cycle())
                    .map(|(v, g)| v * g)
                    .collect(),
            }
        });
        Ok(ScoredSession {
            raster: Some(raster.with_blocks(blocks.collect())?),
            compressive: None,
            ..session.clone()
        })
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
    if scale > 0.0 && scale.is_finite() {
        touched.iter().map(log).collect()
    } else {
        Vec::new()
    }
}

/// γ of every taxel of a skin with these `gains` in one session: the relative standard deviation √(exp(σ²) − 1) of its
/// log-normal gain.
#[must_use]
pub fn gain_sds(gains: &TaxelGains) -> Vec<f64> {
    gains.session_log_sd().map(relative_sd).collect()
}

/// γ of an unknown skin: the relative standard deviation of its taxels' log-normal gains in one session, √(exp(σ² +
/// σₛ²) − 1), with the transducer's σ = `spread_log_sd` and σₛ = `session_log_sd`.
#[must_use]
pub fn simulated_gain_sd() -> f64 {
    let sheet = VelostatConfig::default();
    relative_sd(sheet.spread_log_sd.hypot(sheet.session_log_sd))
}

/// Relative standard deviation √(exp(σ²) − 1) of a log-normal value whose logarithm has the standard deviation σ =
/// `log_sd`.
fn relative_sd(log_sd: f64) -> f64 {
    (log_sd * log_sd).exp_m1().sqrt()
}
