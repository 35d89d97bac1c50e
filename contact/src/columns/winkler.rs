//! Independent columns of foam with damping, densification and friction.

use super::foam::FoamLaw;
use super::preload::Preload;
use crate::body::PosedMesh;
use crate::envelope::Envelope;
use crate::field::ContactField;
use crate::frame::Wrench;
use crate::limits::{self, Most, parameter};
use crate::patch::Patch;
use crate::prepared::PreparedMesh;
use crate::response::Response;
use crate::traction::{Friction, Tractions};
use serde::{Deserialize, Serialize};
use spts_models::{ConfigError, SkinLayout};

/// Parameters of [`WinklerLayer`]. A missing one takes its value in [`WinklerConfig::default`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct WinklerConfig {
    /// K, initial stiffness of the skin, Pa/m; [1e4, 1e9]. K h is the modulus of the foam.
    pub stiffness_pa_per_m: f64,
    /// τ, damping time of the Kelvin–Voigt element, s; [0, 0.02].
    pub damping_s: f64,
    /// h, thickness of the foam, m; [1e-4, 10].
    pub thickness_m: f64,
    /// ε_max, strain at which no pores are left (1 − relative density); [0.3, 1].
    pub max_strain: f64,
    /// Squares of the grid on which contact is computed, along one side of a taxel; [1, 64].
    pub cells_per_taxel: usize,
    /// μ, friction coefficient; [0, 5].
    pub friction: f64,
    /// v_reg, sliding speed below which friction is regularised, m/s; [1e-6, 1].
    pub friction_speed_m_per_s: f64,
}

impl Default for WinklerConfig {
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

/// Bed of independent springs and dampers (Winkler foundation with Kelvin–Voigt columns) under the mesh's lower
/// envelope.
///
/// A column at depth δ, approached with the speed δ′ = −v_z, has the pressure p = f(max(0, δ + τ δ′)). f is the
/// densifying law (`FoamLaw`) with f′(0) = K. To first order this is K (δ − τ v_z), a Kelvin–Voigt element that is
/// never in tension. Friction is regularised Coulomb friction: t = −μ p v_t / √(|v_t|² + v_reg²).
///
/// Validity: a compressible layer (ν ≤ 0.3) and features wider than about 2π h. Narrower features have an edge effect
/// of 10–30 %, which independent columns lack (K. L. Johnson, *Contact Mechanics* (1985), §4.3, §5.8).
///
/// ```
/// use spts_contact::{ContactField as _, PosedMesh, WinklerConfig, WinklerLayer, mesh::cuboid};
/// use spts_models::SkinLayout;
///
/// let config = WinklerConfig { friction: 0.5, ..WinklerConfig::default() };
/// let mut layer = WinklerLayer::new(config, &SkinLayout::default())?;
/// let block = cuboid([30e-3, 30e-3, 10e-3]);
/// let mut body = PosedMesh::at_rest(&block, [0.0, 0.0, -1e-3]);
/// body.velocity_m_per_s = [0.1, 0.0, 0.0]; // slides along x
/// let [x_n, _, z_n] = layer.respond(&body).wrench.force_n;
/// assert!((x_n / z_n + 0.5).abs() < 0.01, "friction opposes the motion");
/// # Ok::<(), spts_models::ConfigError>(())
/// ```
#[derive(Debug, Clone)]
pub struct WinklerLayer {
    config: WinklerConfig,
    pub(super) envelope: Envelope,
    pub(super) pressure_pa: Vec<f64>,
    pub(super) patch: Patch,
    /// Initial compression of the columns, if there is any.
    pub(super) preload: Option<Preload>,
    /// x of the centres of a row's cells, m.
    pub(super) x_m: Vec<f64>,
    /// Friction along x and y on the cells of one row, Pa.
    friction_pa: [Vec<f64>; 2],
}

impl WinklerLayer {
    /// A layer under `skin`.
    ///
    /// # Errors
    /// [`ConfigError`] if a parameter is outside its range.
    pub fn new(config: WinklerConfig, skin: &SkinLayout) -> Result<Self, ConfigError> {
        Self::check(&config, skin)?;
        let envelope = Envelope::new(skin, config.cells_per_taxel);
        let [rows, cols] = envelope.shape();
        Ok(Self {
            config,
            pressure_pa: vec![0.0; rows * cols],
            patch: Patch::default(),
            preload: None,
            x_m: (0..cols).map(|col| envelope.centre_m(0, col)[0]).collect(),
            friction_pa: [vec![0.0; cols], vec![0.0; cols]],
            envelope,
        })
    }

    /// Clears the last pressure.
    pub(super) fn clear(&mut self) {
        let [_, width] = self.envelope.shape();
        for line in self.patch.lines(width) {
            self.pressure_pa[line].fill(0.0);
        }
        self.patch = Patch::default();
    }

    /// Presses `body` into the cleared layer.
    fn press(&mut self, body: &PosedMesh<'_>) -> Wrench {
        let [_, width] = self.envelope.shape();
        self.patch = self.envelope.rasterise(body);
        let c = &self.config;
        let law = FoamLaw::new(
            c.stiffness_pa_per_m,
            c.max_strain * c.thickness_m,
            body.stiffness_pa_per_m,
        );
        let friction = Friction {
            coefficient: c.friction,
            speed_m_per_s: c.friction_speed_m_per_s,
        };
        let mut tractions = Tractions::new(body, friction);
        // a patch may be wider than the contact: sums that start at fours of the grid's columns do not feel it
        let cols = [self.patch.cols[0] / 4 * 4, self.patch.cols[1]];
        let patch = Patch { cols, ..self.patch };
        let x_m = &self.x_m[cols[0]..cols[1]];
        let [tx, ty] = &mut self.friction_pa;
        for (row, line) in (patch.rows[0]..).zip(patch.lines(width)) {
            let [_, y_m] = self.envelope.centre_m(row, 0);
            let depth_m = &self.envelope.depth_m()[line.clone()];
            let p = &mut self.pressure_pa[line.clone()];
            let preload = self.preload.as_ref();
            let preload = preload.map(|preload| preload.row(line, body.stiffness_pa_per_m));
            match preload {
                None => press(c.damping_s, body, y_m, [x_m, depth_m], |_, d| law.pressure_pa(d), p),
                Some(row) => {
                    let of = |k, d| row.pressure_and_slope(k, &law, d).0;
                    press(c.damping_s, body, y_m, [x_m, depth_m], of, p);
                }
            }
            tractions.add(y_m, x_m, depth_m, p, [tx, ty]);
        }
        tractions.wrench(self.envelope.cell_m() * self.envelope.cell_m())
    }

    /// Whether every parameter is in its range.
    pub(crate) fn check(c: &WinklerConfig, skin: &SkinLayout) -> Result<(), ConfigError> {
        limits::foam(c.stiffness_pa_per_m, c.thickness_m)?;
        parameter("damping_s", c.damping_s, [0.0, 0.02], "[0, 0.02] s")?;
        parameter("max_strain", c.max_strain, [0.3, 1.0], "[0.3, 1]")?;
        parameter("friction", c.friction, [0.0, 5.0], "[0, 5]")?;
        let speed = c.friction_speed_m_per_s;
        parameter("friction_speed_m_per_s", speed, [1e-6, 1.0], "[1e-6, 1] m/s")?;
        limits::cells(skin, c.cells_per_taxel, (64.0, "[1, 64]"), MAX_CELLS)
    }
}

/// Most fine cells a layer may have.
const MAX_CELLS: Most = (16_777_216.0, "[1, 2^24]");

/// Pressure on a row of cells at `y_m`: the law `pressure_of` of cell k at δ + τ δ′ where the body is below the
/// surface.
#[inline]
fn press(
    damping_s: f64,
    body: &PosedMesh<'_>,
    y_m: f64,
    [x_m, depth_m]: [&[f64]; 2],
    pressure_of: impl Fn(usize, f64) -> f64,
    pressure_pa: &mut [f64],
) {
    let (v, w, c) = (
        body.velocity_m_per_s,
        body.angular_velocity_rad_per_s,
        body.centre_of_mass_m,
    );
    let sink_m = -damping_s * (v[2] + w[0] * (y_m - c[1]) + w[1] * c[0]);
    let slope = damping_s * w[1];
    for (k, ((p, &depth), &x)) in pressure_pa.iter_mut().zip(depth_m).zip(x_m).enumerate() {
        let loaded_m = depth + (sink_m + slope * x);
        *p = pressure_of(k, if depth > 0.0 { loaded_m } else { 0.0 });
    }
}

impl ContactField for WinklerLayer {
    fn expect(&mut self, mesh: &PreparedMesh) {
        self.envelope.expect(mesh);
    }

    fn respond(&mut self, body: &PosedMesh<'_>) -> Response<'_> {
        self.clear();
        let wrench = if body.is_finite() {
            self.press(body)
        } else {
            Wrench::UNKNOWN
        };
        Response {
            wrench,
            pressure_pa: &self.pressure_pa,
            patch: Some(self.patch),
        }
    }

    fn preload(&mut self, strain: &[f64]) -> Option<Vec<f64>> {
        let c = &self.config;
        let law = FoamLaw::new(c.stiffness_pa_per_m, c.max_strain * c.thickness_m, f64::INFINITY);
        let depth_m: Vec<f64> = strain.iter().map(|strain| strain * c.thickness_m).collect();
        let (preload, rest_pa) = Preload::new(&depth_m, c.cells_per_taxel, &law, &self.envelope);
        self.preload = Some(preload);
        Some(rest_pa)
    }

    fn cells_per_taxel(&self) -> usize {
        self.config.cells_per_taxel
    }

    fn parameters(&self) -> toml::Table {
        // a struct of plain numbers always serialises to a table
        toml::Table::try_from(self.config).unwrap_or_default()
    }

    fn damping_s(&self) -> f64 {
        self.config.damping_s
    }

    fn thickness_m(&self) -> f64 {
        self.config.thickness_m
    }
}
