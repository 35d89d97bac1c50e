//! The linear mixed model of log gains: amplitudes of sessions, gains of taxels, errors of contacts, and mountings.

use nalgebra::{Cholesky, DMatrix, DVector};

/// Logarithm of a session's image over the simulated one on one taxel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Ratio {
    /// Number of the session, from 0.
    pub(super) session: usize,
    /// Number of the pressed object.
    pub(super) object: usize,
    /// Taxel.
    pub(super) taxel: usize,
    /// log(v/m).
    pub(super) log: f64,
}

/// Standard deviations of the three random effects.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Effects {
    /// σ of the taxels' gains.
    pub(super) gain: f64,
    /// σ_c of the error of a simulated contact on a taxel.
    pub(super) contact: f64,
    /// σₘ of the change of a taxel's gain by mounting the skin.
    pub(super) mounting: f64,
}

/// What the ratios say under given effects.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Solution {
    /// Mean of every taxel's log gain.
    pub(super) mean: Vec<f64>,
    /// Its standard deviation.
    pub(super) sd: Vec<f64>,
    /// Restricted log-likelihood of the effects, up to a constant.
    pub(super) log_likelihood: f64,
}

/// Ratios of sessions and taxels, r = a_s + l_i + c_oi + m_si with a_s of a flat density, l_i ~ N(0, σ²), c_oi ~
/// N(0, σ_c²) shared by all sessions of an object, m_si ~ N(0, σₘ²), all independent.
///
/// Source: S. R. Searle, G. Casella and C. E. McCulloch, *Variance Components* (1992), chapters 6 and 7 (restricted
/// likelihood, prediction of random effects). Given the effects, the ratios of an object on a taxel have the covariance
/// σ_c² 11ᵀ + σₘ² I, whose inverse is (I − ρ 11ᵀ)/σₘ² with ρ = σ_c²/(σₘ² + n σ_c²). Every such group tells about one
/// taxel, so that the taxels' part of the normal equations is diagonal and is eliminated: O(taxels × sessions²).
pub(super) struct MixedModel {
    /// Ratios sorted by taxel and object.
    ratios: Vec<Ratio>,
    taxels: usize,
    sessions: usize,
}

/// Smallest standard deviation of a mounting, which keeps the inverse finite.
const SMALLEST: f64 = 1e-3;

impl MixedModel {
    /// The model of `ratios` on `taxels` taxels; every session from 0 to `sessions` has one at least.
    pub(super) fn new(mut ratios: Vec<Ratio>, taxels: usize, sessions: usize) -> Self {
        ratios.sort_by_key(|r| (r.taxel, r.object, r.session));
        Self {
            ratios,
            taxels,
            sessions,
        }
    }

    /// Posterior of the gains, and the likelihood of the effects.
    pub(super) fn solve(&self, effects: Effects) -> Solution {
        let s = self.sessions;
        let [prior, contact, mounting] =
            [effects.gain, effects.contact, effects.mounting].map(|sd| sd.max(SMALLEST).powi(2));
        let (mut h, mut b) = (DMatrix::zeros(s, s), DVector::zeros(s));
        // of every taxel: its own precision and right side, and its coupling with the sessions
        let mut own = vec![(1.0 / prior, 0.0); self.taxels];
        let mut coupling = vec![DVector::zeros(s); self.taxels];
        let (mut squares, mut log_determinant) = (0.0, 0.0);
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
                b[r.session] += weighted;
                coupling[taxel][r.session] += 1.0 / whole;
                h[(r.session, r.session)] += 1.0 / mounting;
                for other in group {
                    h[(r.session, other.session)] -= rho / mounting;
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
        Solution {
            mean,
            sd,
            log_likelihood: -0.5 * (log_determinant + squares),
        }
    }

    /// The spread of the gains and the error of a contact that make the restricted likelihood times a weak prior
    /// largest: log-normal about `start`, with a standard deviation of [`PRIOR_LOG_SD`]. The mounting is as given.
    pub(super) fn fitted(&self, start: Effects) -> Effects {
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
    use rand_distr::{Distribution as _, StandardNormal};

    /// Sessions of objects on taxels with gains, contacts and mountings of these effects; every object touches two
    /// thirds of the taxels, and the last is pressed in two sessions.
    fn planted(effects: Effects, taxels: usize, objects: usize, seed: u64) -> (Vec<Ratio>, Vec<f64>) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let gains: Vec<f64> = (0..taxels).map(|_| effects.gain * normal()).collect();
        let mut ratios = Vec::new();
        for object in 0..objects {
            let sessions = if object + 1 == objects {
                object..object + 2
            } else {
                object..object + 1
            };
            let amplitudes = [normal(), normal()];
            for (taxel, gain) in gains.iter().enumerate() {
                if (taxel + object) % 3 == 0 {
                    continue;
                }
                let contact = effects.contact * normal();
                for session in sessions.clone() {
                    let log = amplitudes[session - object] + gain + contact + effects.mounting * normal();
                    ratios.push(Ratio {
                        session,
                        object,
                        taxel,
                        log,
                    });
                }
            }
        }
        (ratios, gains)
    }

    /// Generalised least squares with dense matrices (Searle and others, chapter 7): l̂ = σ² Zᵀ P r, and the restricted
    /// likelihood −½(log|V| + log|Xᵀ V⁻¹ X| + rᵀ P r).
    #[test]
    fn the_solution_is_that_of_dense_matrices() {
        let effects = Effects {
            gain: 0.3,
            contact: 0.35,
            mounting: 0.1,
        };
        let (taxels, sessions) = (7, 5);
        let (ratios, _) = planted(effects, taxels, sessions - 1, 5);
        let model = MixedModel::new(ratios, taxels, sessions);
        let (r, n) = (&model.ratios, model.ratios.len());
        let same = |a: bool, sd: f64| if a { sd * sd } else { 0.0 };
        let v = DMatrix::from_fn(n, n, |i, j| {
            let taxel = r[i].taxel == r[j].taxel;
            same(taxel, effects.gain)
                + same(taxel && r[i].object == r[j].object, effects.contact)
                + same(i == j, effects.mounting)
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
        assert!(
            (found.log_likelihood - likelihood).abs() < 1e-9,
            "{} for {likelihood}",
            found.log_likelihood
        );
    }

    /// 400 taxels under 12 objects: a standard deviation is known to about 1/√(2n) = 4 %, less what the other effect
    /// hides; 15 % are allowed. The gains are known as well as their stated deviation says: χ² of 400 values is in
    /// 400 ± 5 √800.
    #[test]
    fn planted_effects_are_found() {
        let planted_effects = Effects {
            gain: 0.25,
            contact: 0.45,
            mounting: 0.1,
        };
        let (ratios, gains) = planted(planted_effects, 400, 12, 8);
        let model = MixedModel::new(ratios, 400, 13);
        let found = model.fitted(Effects {
            gain: 0.3,
            contact: 0.35,
            mounting: 0.1,
        });
        for (found, expected) in [
            (found.gain, planted_effects.gain),
            (found.contact, planted_effects.contact),
        ] {
            assert!((found / expected - 1.0).abs() < 0.15, "{found} for {expected}");
        }
        let solution = model.solve(found);
        let level = gains.iter().sum::<f64>() / 400.0;
        let z = gains
            .iter()
            .zip(&solution.mean)
            .zip(&solution.sd)
            .map(|((g, m), s)| ((g - level - m) / s).powi(2));
        let chi2: f64 = z.sum();
        assert!((chi2 - 400.0).abs() < 5.0 * 800.0_f64.sqrt(), "{chi2}");
    }
}
