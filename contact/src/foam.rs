//! The foam: its parameters and their ranges, and its pressure as a function of its compression.

use serde::{Deserialize, Serialize};
use spts_input::Refusal;
use spts_models::{SkinLayout, in_interval, in_range};

/// Parameters of the foam and of friction on it, as the contact fields `winkler` and `footprint` take them from a
/// scene. A missing one takes its value in [`Foam::default`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Foam {
    /// K, initial stiffness of the skin, Pa/m; [1e4, 1e9]. K h is the modulus of the foam.
    pub stiffness_pa_per_m: f64,
    /// τ, damping time of the Kelvin–Voigt element, s; [0, 0.02].
    pub damping_s: f64,
    /// h, thickness of the foam, m; [1e-4, 10].
    pub thickness_m: f64,
    /// ε_max, strain at which no pores are left (1 − relative density); [0.3, 1].
    pub max_strain: f64,
    /// Squares of the grid on which contact is computed, along one side of a taxel; [1, 64]. A skin
    /// of sample points ([`SurfaceField`](crate::SurfaceField)) has its own points and does not use it.
    pub cells_per_taxel: usize,
    /// μ, friction coefficient; [0, 5].
    pub friction: f64,
    /// v_reg, sliding speed below which friction is regularised, m/s; [1e-6, 1].
    pub friction_speed_m_per_s: f64,
}

impl Default for Foam {
    /// K = 15 MPa/m over 6 mm is a modulus of 90 kPa, inside ASTM D1056 grade 2C1 (55–140 kPa secant modulus at 25 %
    /// strain). In series with a tennis ball it makes the 8.3 ms contact recorded on the real skin; the thickness
    /// itself is not published. ε_max = 0.85 is neoprene foam of relative density 0.15. μ = 0.6, rubber on plastic
    /// (estimate).
    fn default() -> Self {
        Self {
            stiffness_pa_per_m: 1.5e7,
            damping_s: 0.5e-3,
            thickness_m: 6e-3,
            max_strain: 0.85,
            cells_per_taxel: 6,
            friction: 0.6,
            friction_speed_m_per_s: 0.01,
        }
    }
}

impl Foam {
    /// Checks the range of everything but the grid.
    pub(crate) fn check(&self) -> Result<(), Refusal> {
        parameter("stiffness_pa_per_m", self.stiffness_pa_per_m, "[1e4, 1e9] Pa/m")?;
        parameter("thickness_m", self.thickness_m, "[1e-4, 10] m")?;
        parameter("damping_s", self.damping_s, "[0, 0.02] s")?;
        parameter("max_strain", self.max_strain, "[0.3, 1]")?;
        parameter("friction", self.friction, "[0, 5]")?;
        parameter("friction_speed_m_per_s", self.friction_speed_m_per_s, "[1e-6, 1] m/s")
    }

    /// Checks every range, for a grid over `skin` of at most `most` squares.
    pub(crate) fn check_on(&self, skin: &SkinLayout, most: Most) -> Result<(), Refusal> {
        self.check()?;
        check_cells(skin, self.cells_per_taxel, most)
    }

    /// Compression at which no pores are left, m.
    pub(crate) fn max_depth_m(&self) -> f64 {
        self.max_strain * self.thickness_m
    }

    /// The law of this foam under a body of surface stiffness `body_pa_per_m`, Pa/m; ∞ for a rigid one.
    pub(crate) fn law(&self, body_pa_per_m: f64) -> FoamLaw {
        FoamLaw::new(self.stiffness_pa_per_m, self.max_depth_m(), body_pa_per_m)
    }
}

/// Checks that `contact.field` lies in `range`.
pub(crate) fn parameter(field: &str, value: f64, range: &'static str) -> Result<(), Refusal> {
    in_interval(&format!("contact.{field}"), value, range)
}

/// Most squares of a grid, and the range of their number as text.
pub(crate) type Most = (f64, &'static str);

/// Checks that there is at least one square along a side of a taxel and at most 64, and that there are at most `most`
/// over `skin`.
pub(crate) fn check_cells(skin: &SkinLayout, cells_per_taxel: usize, most: Most) -> Result<(), Refusal> {
    let cells = cells_per_taxel as f64;
    parameter("cells_per_taxel", cells, "[1, 64]")?;
    let count = skin.taxels() as f64 * cells * cells;
    in_range("rows × cols × contact.cells_per_taxel²", count, count <= most.0, most.1).map(drop)
}

/// Elastic foam with densification, in series with the surface of the body that presses it.
///
/// The foam follows the gas-compression term of a closed-cell foam, σ(ε) = E ε / (1 − ε/ε_max), with ε = δ_f / h,
/// E = K h and ε_max = 1 − relative density (L. J. Gibson and M. F. Ashby, *Cellular Solids*, 2nd ed. (1997), ch. 5:
/// gas hardening p₀ ε / (1 − ε − ρ_rel), here with the pre-factor left free): linear at first, stiffening towards
/// ε_max, where only solid polymer is left. Solid polymer, backing and body answer as a linear spring K_s in series,
/// which keeps the law finite at any depth:
///
/// δ = δ_f + p/K_s,  p = K_f δ_f / (1 − δ_f/δ_m),  δ_m = ε_max h
///
/// Eliminating δ_f leaves a p² + b p − K_f δ = 0 with a = 1/(K_s δ_m) and b = 1 + K_f/K_s − δ/δ_m. The positive root is
/// smooth and strictly increasing in δ; its slope is K at δ = 0 for a rigid body and tends to K_s for δ ≫ δ_m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FoamLaw {
    foam_pa_per_m: f64,
    quadratic: f64,
    offset: f64,
    inverse_depth_per_m: f64,
}

impl FoamLaw {
    /// Stiffness of the fully densified layer, in units of its initial stiffness. Solid elastomer is 50 to 1000 times
    /// stiffer than a foam of relative density 0.1–0.2 (E/E_s ≈ ρ_rel²); the low end is enough to stop any press of the
    /// arm and does not tighten the time step of the ball.
    pub(crate) const SOLID_RATIO: f64 = 50.0;

    /// Law for a layer of initial stiffness `stiffness_pa_per_m` (K) whose foam vanishes at the compression
    /// `max_depth_m` (δ_m), pressed by a body of surface stiffness `body_pa_per_m` (∞ for a rigid one). All positive.
    pub(crate) fn new(stiffness_pa_per_m: f64, max_depth_m: f64, body_pa_per_m: f64) -> Self {
        let solid = Self::SOLID_RATIO * stiffness_pa_per_m;
        // the foam alone is a little softer than foam and solid in series, so that K is the slope of the whole
        let foam = stiffness_pa_per_m / (1.0 - 1.0 / Self::SOLID_RATIO);
        let series = 1.0 / (1.0 / solid + 1.0 / body_pa_per_m);
        Self {
            foam_pa_per_m: foam,
            quadratic: 1.0 / (series * max_depth_m),
            offset: 1.0 + foam / series,
            inverse_depth_per_m: 1.0 / max_depth_m,
        }
    }

    /// Pressure at the total compression `depth_m` (foam plus body), Pa; 0 for a negative depth.
    #[inline]
    pub(crate) fn pressure_pa(&self, depth_m: f64) -> f64 {
        self.root(if depth_m > 0.0 { depth_m } else { 0.0 }).0
    }

    /// Pressure, Pa, and its slope dp/dδ, Pa/m, at the total compression `depth_m`; both 0 for a negative depth.
    #[inline(always)]
    pub(crate) fn pressure_and_slope(&self, depth_m: f64) -> (f64, f64) {
        let (p, root) = self.root(if depth_m > 0.0 { depth_m } else { 0.0 });
        // 2 a p p′ + b p′ + b′ p − K_f = 0 with 2 a p + b = √(b² + 4 a K_f δ)
        let slope = (self.foam_pa_per_m + p * self.inverse_depth_per_m) / root;
        (p, if depth_m > 0.0 { slope } else { 0.0 })
    }

    /// Positive root p of the quadratic and √(b² + 4 a K_f δ). Without branches: a row of cells becomes vector
    /// instructions.
    #[inline(always)]
    fn root(&self, depth_m: f64) -> (f64, f64) {
        let b = self.offset - depth_m * self.inverse_depth_per_m;
        let load = self.foam_pa_per_m * depth_m;
        let root = (b * b + 4.0 * self.quadratic * load).sqrt();
        // the form of the root without cancellation
        let (above, below) = if b >= 0.0 { (2.0 * load, b + root) } else { (root - b, 2.0 * self.quadratic) };
        (above / below, root)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    const K: f64 = 1e7;

    /// A rigid body on a very thick layer: p = K δ. The neglected curvature is δ/δ_m = 1e-6; twice that is allowed.
    #[test]
    fn linear_when_thin_compression() {
        let law = FoamLaw::new(K, 1e3, f64::INFINITY);
        assert_relative_eq!(law.pressure_pa(1e-3), K * 1e-3, max_relative = 2e-6);
    }

    /// The root fulfils both springs: δ = δ_f + p/K_s with the foam's own law, to round-off amplified by the
    /// stiffening (1/(1 − δ_f/δ_m) ≤ 1e4 here, × 2^-52 ≈ 2e-12).
    #[test]
    fn fulfils_both_springs() {
        let (max_depth_m, body) = (2.5e-3, 2e7);
        let law = FoamLaw::new(K, max_depth_m, body);
        let series = 1.0 / (1.0 / (FoamLaw::SOLID_RATIO * K) + 1.0 / body);
        for depth_m in [1e-6, 1e-4, 1e-3, 3e-3, 8e-3, 2e-2] {
            let p = law.pressure_pa(depth_m);
            let foam_m = depth_m - p / series;
            assert!(foam_m > 0.0 && foam_m < max_depth_m);
            let foam = K / (1.0 - 1.0 / FoamLaw::SOLID_RATIO);
            assert_relative_eq!(p * (1.0 - foam_m / max_depth_m), foam * foam_m, max_relative = 1e-9);
        }
    }

    /// Slope against central differences of step h: h² p‴/6 and round-off ε p/h, together below 1e-6 of the slope for
    /// h = 1e-8 m, where p changes over 1e-3 m.
    #[test]
    fn slope_is_the_derivative() {
        let law = FoamLaw::new(K, 2.5e-3, 2e7);
        for depth_m in [1e-6, 1e-4, 1e-3, 3e-3, 8e-3, 2e-2] {
            let h = 1e-8;
            let (p, slope) = law.pressure_and_slope(depth_m);
            assert_relative_eq!(p, law.pressure_pa(depth_m));
            let numeric = (law.pressure_pa(depth_m + h) - law.pressure_pa(depth_m - h)) / (2.0 * h);
            assert_relative_eq!(slope, numeric, max_relative = 1e-6);
        }
        assert_relative_eq!(FoamLaw::new(K, 1e3, f64::INFINITY).pressure_and_slope(1e-9).1, K, max_relative = 1e-9);
        let (p, slope) = FoamLaw::new(K, 1e3, 1e9).pressure_and_slope(-1.0);
        assert!(p.abs() + slope.abs() < f64::MIN_POSITIVE);
    }

    /// Increasing and convex where the foam rules, finite at absurd depths, slope bounded by the solid's.
    #[test]
    fn monotone_and_finite() {
        let law = FoamLaw::new(K, 2.5e-3, f64::INFINITY);
        let mut last = 0.0;
        for i in 1..2000 {
            let p = law.pressure_pa(f64::from(i) * 1e-5);
            assert!(p > last && p - last <= FoamLaw::SOLID_RATIO * K * 1e-5 * (1.0 + 1e-9));
            last = p;
        }
        assert!(law.pressure_pa(1e3).is_finite());
        assert!(law.pressure_pa(-1.0).abs() < f64::MIN_POSITIVE);
    }
}
