//! Surface compliance of an elastic half-space and of a bonded layer, in the Fourier domain.

/// Elastic body below the skin's surface; linear and frictionless.
///
/// A pressure p̂(k) lowers the surface by û(k) = C(|k|) p̂(k).
///
/// ```
/// use spts_contact::{ElasticKernel, confined_stiffness_pa_per_m};
///
/// let (modulus_pa, poisson, thickness_m) = (150e3, 0.2, 10e-3);
/// let layer = ElasticKernel::Layer { modulus_pa, poisson, thickness_m };
/// let half_space = ElasticKernel::HalfSpace { modulus_pa, poisson };
/// // fine patterns do not feel the base; uniform pressure does
/// let fine = layer.compliance_m_per_pa(1e4) / half_space.compliance_m_per_pa(1e4);
/// assert!((fine - 1.0).abs() < 1e-6);
/// let uniform = layer.compliance_m_per_pa(0.0) * confined_stiffness_pa_per_m(modulus_pa, poisson, thickness_m);
/// assert!((uniform - 1.0).abs() < 1e-12);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum ElasticKernel {
    /// Half-space (Boussinesq).
    HalfSpace {
        /// E, Young's modulus, Pa; > 0.
        modulus_pa: f64,
        /// ν, Poisson's ratio; [0, 0.5].
        poisson: f64,
    },
    /// Layer of finite thickness, bonded to a rigid base.
    Layer {
        /// E, Young's modulus, Pa; > 0.
        modulus_pa: f64,
        /// ν, Poisson's ratio; [0, 0.5).
        poisson: f64,
        /// h, thickness, m; > 0.
        thickness_m: f64,
    },
}

impl ElasticKernel {
    /// E, Pa, and ν.
    pub(crate) fn constants(&self) -> (f64, f64) {
        match *self {
            Self::HalfSpace { modulus_pa, poisson }
            | Self::Layer {
                modulus_pa, poisson, ..
            } => (modulus_pa, poisson),
        }
    }

    /// 1/E* = (1 − ν²)/E, 1/Pa.
    #[must_use]
    pub fn inverse_reduced_modulus_per_pa(&self) -> f64 {
        let (modulus_pa, poisson) = self.constants();
        (1.0 - poisson * poisson) / modulus_pa
    }

    /// C(k), m/Pa, at the wave number `wave_per_m` (k > 0; for the layer also 0).
    ///
    /// Half-space: 2/(E* k). Layer: C = (2/(E* k)) · [(3−4ν) sinh 2x − 2x] / [(3−4ν) cosh 2x + 2x² + 5 − 12ν + 8ν²]
    /// with x = k h (plane-strain elasticity of a bonded layer; K. L. Johnson, *Contact Mechanics* (1985), §5.8). Both
    /// parts of the fraction are scaled by exp(−2x), so that no x overflows. C(0) = 1/K, see
    /// [`confined_stiffness_pa_per_m`].
    #[must_use]
    pub fn compliance_m_per_pa(&self, wave_per_m: f64) -> f64 {
        let half_space = 2.0 * self.inverse_reduced_modulus_per_pa() / wave_per_m;
        match *self {
            Self::HalfSpace { .. } => half_space,
            Self::Layer {
                modulus_pa,
                poisson,
                thickness_m,
            } => {
                let x = wave_per_m * thickness_m;
                if x <= 0.0 {
                    return 1.0 / confined_stiffness_pa_per_m(modulus_pa, poisson, thickness_m);
                }
                let rising = -0.5 * (3.0 - 4.0 * poisson) * (-4.0 * x).exp_m1() - 2.0 * x * (-2.0 * x).exp();
                half_space * rising / layer_denominator(x, poisson)
            }
        }
    }
}

/// exp(−2x) [(3−4ν) cosh 2x + 2x² + 5 − 12ν + 8ν²].
fn layer_denominator(x: f64, poisson: f64) -> f64 {
    let decay = (-2.0 * x).exp();
    0.5 * (3.0 - 4.0 * poisson) * (1.0 + decay * decay) + (2.0 * x * x + constant(poisson)) * decay
}

fn constant(poisson: f64) -> f64 {
    5.0 - 12.0 * poisson + 8.0 * poisson * poisson
}

/// D(x) = C_layer/C_half-space − 1 at x = k h: −1 at 0, decaying as x² exp(−2x), without cancellation.
pub(crate) fn layer_deficit(x: f64, poisson: f64) -> f64 {
    let decay = (-2.0 * x).exp();
    let rest = (3.0 - 4.0 * poisson) * decay * decay + (2.0 * x * (1.0 + x) + constant(poisson)) * decay;
    -rest / layer_denominator(x, poisson)
}

/// K, stiffness of a bonded layer under uniform pressure, Pa/m: E (1−ν) / ((1+ν) (1−2ν) h).
#[must_use]
pub fn confined_stiffness_pa_per_m(modulus_pa: f64, poisson: f64, thickness_m: f64) -> f64 {
    modulus_pa * (1.0 - poisson) / ((1.0 + poisson) * (1.0 - 2.0 * poisson) * thickness_m)
}

/// Young's modulus of a layer of stiffness K under uniform pressure, Pa: the inverse of
/// [`confined_stiffness_pa_per_m`].
#[must_use]
pub fn modulus_of_confined_pa(stiffness_pa_per_m: f64, poisson: f64, thickness_m: f64) -> f64 {
    stiffness_pa_per_m * thickness_m * (1.0 + poisson) * (1.0 - 2.0 * poisson) / (1.0 - poisson)
}
