//! Section `[bend]`: the skin is wrapped round a cylinder, such as a robot's arm, and its cover presses on the foam.

use rand::RngExt as _;
use rand_distr::{Distribution as _, Exp1, StandardNormal};
use serde::{Deserialize, Serialize};
use spts_contact::mesh::TriMesh;
use spts_input::Refusal;
use spts_models::{SkinLayout, Streams, in_interval};

/// Section `[bend]`: the skin is wrapped round a cylinder along its columns, so that its rows run round the cylinder.
///
/// A cover under the tension T presses on the foam with T/R. It is taut over some taxels and slack over the others.
/// Under the taut cover the foam of each taxel is compressed by a log-normal strain. The pressure of a touch adds to it
/// by the foam's own law. Beside a touch the cover slackens, because the touch pulls it in. The defaults were fitted to
/// the output of the published skin round an arm, without and with a touch (`spts compare --arm`): a strain of 0.0028
/// of 6 mm foam is 260 Pa, and at R = 50 mm a tension of 13 N/m; one taxel in forty has twenty times as much.
///
/// An object meets the skin along the radii of the cylinder: its mesh is unrolled about the line of contact.
///
/// ```
/// use spts_models::SkinLayout;
/// use spts_sim::mechanics::BendConfig;
///
/// let bend = BendConfig { taut_share: 1.0, ..BendConfig::default() };
/// let strain = bend.strain(&SkinLayout::default(), 1, 0);
/// assert_eq!(strain.len(), 100);
/// assert!(strain.iter().all(|&s| s > 0.0 && s < 1.0), "the cover is taut everywhere");
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct BendConfig {
    /// R, radius of the cylinder at the skin's surface, m; [0.02, 10].
    pub radius_m: f64,
    /// Share of the taxels under taut cover; [0, 1].
    pub taut_share: f64,
    /// Median strain of the foam under the taut cover, relative to its thickness; [0, 0.3].
    pub strain: f64,
    /// Standard deviation of the logarithm of that strain from taxel to taxel; [0, 2].
    pub strain_log_sd: f64,
    /// Standard deviation of the logarithm by which a taxel's strain varies from press to press, because the cover
    /// slides; [0, 1].
    pub press_log_sd: f64,
    /// Mean decrease of the logarithm of the cover's pressure on an untouched taxel at the full force of a press;
    /// exponentially distributed over taxels and presses; [0, 2].
    pub touch_slack: f64,
}

impl Default for BendConfig {
    fn default() -> Self {
        Self {
            radius_m: 0.05,
            taut_share: 0.35,
            strain: 0.0028,
            strain_log_sd: 1.4,
            press_log_sd: 0.15,
            touch_slack: 0.8,
        }
    }
}

/// Largest strain: the log-normal has no end, and the foam has one.
const MOST_STRAIN: f64 = 0.6;
/// Longest edge of an unrolled mesh along the bend, as a share of R: a chord lies e²/8R = R/5000 inside its arc.
const EDGE_SHARE: f64 = 0.04;

impl BendConfig {
    /// Checks every value.
    ///
    /// # Errors
    /// [`Refusal`] for the first one outside its range.
    pub(super) fn check(&self) -> Result<(), Refusal> {
        in_interval("bend.radius_m", self.radius_m, "[0.02, 10] m")?;
        in_interval("bend.taut_share", self.taut_share, "[0, 1]")?;
        in_interval("bend.strain", self.strain, "[0, 0.3]")?;
        in_interval("bend.strain_log_sd", self.strain_log_sd, "[0, 2]")?;
        in_interval("bend.press_log_sd", self.press_log_sd, "[0, 1]")?;
        in_interval("bend.touch_slack", self.touch_slack, "[0, 2]")
    }

    /// Strain of the foam under every taxel of `skin` before press `index`; 0 where the cover is slack. It depends only
    /// on the arguments.
    pub fn strain(&self, skin: &SkinLayout, seed: u64, index: u64) -> Vec<f64> {
        let streams = Streams::new(seed);
        let (mut taxels, mut press) = (streams.rng("bend", 0), streams.rng("bend/press", index));
        let mut strain = || {
            let slack = taxels.random::<f64>() >= self.taut_share;
            let (fixed, moved): (f64, f64) = (StandardNormal.sample(&mut taxels), StandardNormal.sample(&mut press));
            let log = self.strain_log_sd * fixed + self.press_log_sd * moved;
            if slack { 0.0 } else { (self.strain * log.exp()).min(MOST_STRAIN) }
        };
        (0..skin.taxels()).map(|_| strain()).collect()
    }

    /// Decrease of the logarithm of the cover's pressure on every untouched taxel of `skin` at the full force of press
    /// `index`. It depends only on the arguments.
    pub fn slack(&self, skin: &SkinLayout, seed: u64, index: u64) -> Vec<f64> {
        let mut rng = Streams::new(seed).rng("bend/slack", index);
        let mut drawn = || {
            let unit: f64 = Exp1.sample(&mut rng);
            self.touch_slack * unit
        };
        (0..skin.taxels()).map(|_| drawn()).collect()
    }

    /// `mesh` as the bent skin meets it, in the axes of the flat one: a point at x across the line of contact and at
    /// the height z over the tangent plane is at R·atan(x/(R + z)) along the skin and √(x² + (R + z)²) − R above it.
    /// `body` turns body axes into those of the skin; the lowest point stays where it is.
    pub(super) fn unroll(&self, mesh: &TriMesh, body: [[f64; 3]; 3]) -> TriMesh {
        let back = [0, 1, 2].map(|i| [0, 1, 2].map(|j| body[j][i]));
        let longest_m = EDGE_SHARE * self.radius_m;
        let across = |a: [f64; 3], b: [f64; 3]| (a[0] - b[0]).abs() > longest_m;
        let on_skin = mesh.clone().rotated(body).refined(longest_m, across);
        let low_m = on_skin.bounds().map_or(0.0, |(low, _)| low[2]);
        let met = on_skin.mapped(|[x, y, z]| {
            let height_m = self.radius_m + (z - low_m);
            let along_m = self.radius_m * x.atan2(height_m);
            [along_m, y, x.hypot(height_m) - self.radius_m + low_m]
        });
        met.rotated(back)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use spts_contact::mesh::{cuboid, sphere};

    /// Share, median and spread of 90,000 taxels, within five standard errors: √(q(1−q)/n), 1.25 σ/√m, σ/√(2m) of the
    /// m taut ones.
    #[test]
    fn strains_are_drawn_as_written() {
        let skin = SkinLayout::new(300, 300, 15e-3, 10e-3).unwrap();
        let bend = BendConfig::default();
        let strain = bend.strain(&skin, 3, 0);
        let mut logs: Vec<f64> = strain.iter().filter(|s| **s > 0.0).map(|s| s.ln()).collect();
        logs.sort_by(f64::total_cmp);
        let (n, m) = (strain.len() as f64, logs.len() as f64);
        let share_error = (bend.taut_share * (1.0 - bend.taut_share) / n).sqrt();
        assert_relative_eq!(m / n, bend.taut_share, epsilon = 5.0 * share_error);
        let sd = bend.strain_log_sd.hypot(bend.press_log_sd);
        assert_relative_eq!(logs[logs.len() / 2], bend.strain.ln(), epsilon = 5.0 * 1.25 * sd / m.sqrt());
        let mean = logs.iter().sum::<f64>() / m;
        let found = (logs.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / m).sqrt();
        assert_relative_eq!(found, sd, epsilon = 5.0 * sd / (2.0 * m).sqrt());
        // the same taxels are taut in the next press, by another strain
        let next = bend.strain(&skin, 3, 1);
        assert!(strain.iter().zip(&next).all(|(a, b)| (*a > 0.0) == (*b > 0.0)));
        assert_ne!(strain, next);
        assert_ne!(strain, bend.strain(&skin, 4, 0));
    }

    /// A flat face of half width a that touches a cylinder ends a²/2R above it, to a³ terms of a share (a/R)²/4 = 1 %;
    /// along the cylinder nothing changes.
    #[test]
    fn a_flat_face_lifts_from_a_cylinder() {
        let bend = BendConfig::default();
        let half_m = 10e-3;
        let mesh = cuboid([2.0 * half_m, 30e-3, 4e-3]);
        let met = bend.unroll(&mesh, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        let edge = met.vertices.iter().filter(|v| v[2] < 2e-3).max_by(|a, b| a[0].total_cmp(&b[0])).unwrap();
        assert_relative_eq!(edge[2], half_m.powi(2) / (2.0 * bend.radius_m), max_relative = 0.02);
        let lowest = met.vertices.iter().map(|v| v[2]).fold(f64::INFINITY, f64::min);
        assert_relative_eq!(lowest, 0.0, epsilon = 1e-12);
        assert_eq!(met.open_edges(), 0);
        // turned by a quarter, the other side bends
        let quarter = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
        let met = bend.unroll(&mesh, quarter);
        let edge = met.vertices.iter().filter(|v| v[2] < 2.5e-3).max_by(|a, b| a[1].total_cmp(&b[1])).unwrap();
        assert_relative_eq!(edge[2], 15e-3_f64.powi(2) / (2.0 * bend.radius_m), max_relative = 0.03);
    }

    /// A sphere of radius r on a cylinder has the curvature 1/r + 1/R across it.
    #[test]
    fn a_sphere_has_the_relative_curvature() {
        let (r_m, bend) = (8e-3, BendConfig::default());
        let met = bend.unroll(&sphere(r_m, 64, 96), [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        let near = met.vertices.iter().filter(|v| v[1].abs() < 1e-9 && v[2] < 1e-4 && v[0] > 1e-6);
        let curvature: Vec<f64> = near.map(|v| 2.0 * v[2] / v[0].powi(2)).collect();
        assert!(!curvature.is_empty());
        for found in curvature {
            assert_relative_eq!(found, 1.0 / r_m + 1.0 / bend.radius_m, max_relative = 0.02);
        }
    }
}
