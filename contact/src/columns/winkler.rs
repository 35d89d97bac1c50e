//! Independent columns of foam with damping, densification and friction.

use crate::balance::Column;
use crate::envelope::{Envelope, KnownBody, Part, split_cell};
use crate::field::{ContactField, Patch, PosedMesh, Response, Wrench};
use crate::foam::{Foam, FoamLaw, Most};
use crate::prepared::PreparedMesh;
use crate::surface::Solid;
use crate::traction::Tractions;
use parry3d_f64::math::Vector;
use spts_input::Refusal;
use spts_models::SkinLayout;

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
/// use spts_contact::{ContactField as _, PosedMesh, Foam, WinklerLayer, mesh::cuboid};
/// use spts_models::SkinLayout;
///
/// let config = Foam { friction: 0.5, ..Foam::default() };
/// let mut layer = WinklerLayer::new(config, &SkinLayout::default())?;
/// let block = cuboid([30e-3, 30e-3, 10e-3]);
/// let mut body = PosedMesh::at_rest(&block, [0.0, 0.0, -1e-3]);
/// body.velocity_m_per_s = [0.1, 0.0, 0.0]; // slides along x
/// let [x_n, _, z_n] = layer.respond(&body).wrench.force_n;
/// assert!((x_n / z_n + 0.5).abs() < 0.01, "friction opposes the motion");
/// # Ok::<(), spts_input::Refusal>(())
/// ```
#[derive(Debug, Clone)]
pub struct WinklerLayer {
    config: Foam,
    pub(super) envelope: Envelope,
    pub(crate) pressure_pa: Vec<f64>,
    pub(crate) patch: Patch,
    /// Whether the last body has gone through the foam; only [`WinklerLayer::respond_to`] a solid finds out.
    pub(crate) bottomed: bool,
    /// Initial compression of the columns, if there is any.
    pub(super) preload: Option<Preload>,
    /// x of the centres of a row's cells, m.
    pub(crate) x_m: Vec<f64>,
    /// Friction along x and y on the cells of one row, Pa.
    friction_pa: [Vec<f64>; 2],
}

impl WinklerLayer {
    /// A layer under `skin`.
    ///
    /// # Errors
    /// [`Refusal`] if a parameter is outside its range.
    pub fn new(config: Foam, skin: &SkinLayout) -> Result<Self, Refusal> {
        config.check_on(skin, MAX_CELLS)?;
        let envelope = Envelope::new(skin, config.cells_per_taxel);
        let [rows, cols] = envelope.shape();
        Ok(Self {
            config,
            pressure_pa: vec![0.0; rows * cols],
            patch: Patch::default(),
            bottomed: false,
            preload: None,
            x_m: (0..cols).map(|col| envelope.centre_m(0, col)[0]).collect(),
            friction_pa: [vec![0.0; cols], vec![0.0; cols]],
            envelope,
        })
    }

    /// Exchanges what is known of the present body, so that several can take turns.
    pub(crate) fn swap_known(&mut self, known: &mut KnownBody) {
        self.envelope.swap_known(known);
    }

    /// Whether a rim of the last body goes through a cell.
    #[cfg(test)]
    pub(crate) fn has_parts(&self, cell: usize) -> bool {
        self.envelope.has_parts(cell)
    }

    /// Clears the last pressure.
    pub(super) fn clear(&mut self) {
        let [_, width] = self.envelope.shape();
        for line in self.patch.lines(width) {
            self.pressure_pa[line].fill(0.0);
        }
        self.patch = Patch::default();
        self.bottomed = false;
    }

    /// As [`ContactField::respond`] for a body that may also be below the skin or come through it: `solid`, made from
    /// its mesh, presses only the columns that it enters from above.
    pub(crate) fn respond_to(&mut self, body: &PosedMesh<'_>, solid: Option<&Solid>) -> Response<'_> {
        self.clear();
        let wrench = if body.is_finite() { self.press(body, solid) } else { Wrench::UNKNOWN };
        Response { wrench, pressure_pa: &self.pressure_pa, patch: Some(self.patch) }
    }

    /// The columns under a body and up to `gap_m` below it. Clears the last pressure.
    pub(crate) fn columns_under(&mut self, body: &PosedMesh<'_>, solid: &Solid, gap_m: f64, out: &mut Vec<Column>) {
        self.clear();
        out.clear();
        let h = self.config.thickness_m;
        // lower by the gap, so that the map of what is below the surface has it
        let mut lower = *body;
        lower.position_m[2] -= gap_m;
        let sampled = self.envelope.sample(&solid.standing(&lower));
        self.patch = sampled.unwrap_or_else(|| self.envelope.rasterise(&lower));
        let standing = solid.standing(body);
        let front = |[x_m, y_m]: [f64; 2]| standing.front_m(Vector::new(x_m, y_m, -h), Vector::Z, h, gap_m);
        self.envelope.deeper_than(h + gap_m, |place| front(place).map_or(0.0, |depth_m| depth_m + gap_m));
        let [_, width] = self.envelope.shape();
        let area_m2 = self.envelope.cell_m().powi(2);
        for (row, line) in (self.patch.rows[0]..).zip(self.patch.lines(width)) {
            let [_, y_m] = self.envelope.centre_m(row, 0);
            let mut parts = self.envelope.parts(&line);
            for index in line {
                let own = split_cell(&mut parts, index);
                for part in own.iter().filter(|part| part.depth_m > 0.0) {
                    let [x_m, y_m] = self.envelope.place_m(part);
                    let point_m = Vector::new(x_m, y_m, 0.0);
                    let whole = Column::new(index, point_m, Vector::Z, part.share * area_m2, part.depth_m - gap_m);
                    out.push(Column { share: part.share, ..whole });
                }
                let depth_m = self.envelope.depth_m()[index];
                if own.is_empty() && depth_m > 0.0 {
                    let point_m = Vector::new(self.x_m[index % width], y_m, 0.0);
                    out.push(Column::new(index, point_m, Vector::Z, area_m2, depth_m - gap_m));
                }
            }
        }
    }

    /// The area under pressure of the cells that `is_new` of their number, in cells: what a cell's parts have of it.
    pub(crate) fn pressed_cells(&self, mut is_new: impl FnMut(usize) -> bool) -> f64 {
        let [_, width] = self.envelope.shape();
        let mut cells = 0.0;
        for line in self.patch.lines(width) {
            let mut parts = self.envelope.parts(&line);
            for index in line {
                let own = split_cell(&mut parts, index);
                if self.pressure_pa[index] > 0.0 && is_new(index) {
                    let under = own.iter().filter(|part| part.depth_m > 0.0);
                    cells += if own.is_empty() { 1.0 } else { under.map(|part| part.share).sum() };
                }
            }
        }
        cells
    }

    /// The column nearest to a place, which becomes the only one of the cleared layer.
    pub(crate) fn column_at(&mut self, [x_m, y_m]: [f64; 2]) -> Column {
        let [rows, cols] = self.envelope.shape();
        let [first_x_m, first_y_m] = self.envelope.centre_m(0, 0);
        let cell_m = self.envelope.cell_m();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a number of a row or column")]
        let number = |at_m: f64, count: usize| (at_m / cell_m).round().clamp(0.0, count as f64 - 1.0) as usize;
        let (row, col) = (number(first_y_m - y_m, rows), number(x_m - first_x_m, cols));
        self.patch = Patch { rows: [row, row + 1], cols: [col, col + 1] };
        let [x_m, y_m] = self.envelope.centre_m(row, col);
        Column::new(row * cols + col, Vector::new(x_m, y_m, 0.0), Vector::Z, cell_m * cell_m, 0.0)
    }

    /// Presses `body` into the cleared layer.
    fn press(&mut self, body: &PosedMesh<'_>, solid: Option<&Solid>) -> Wrench {
        let [_, width] = self.envelope.shape();
        let standing = solid.map(|solid| solid.standing(body));
        let sampled = standing.as_ref().and_then(|standing| self.envelope.sample(standing));
        self.patch = sampled.unwrap_or_else(|| self.envelope.rasterise(body));
        let c = &self.config;
        if let Some(standing) = standing {
            let h = c.thickness_m;
            let at = |[x_m, y_m]: [f64; 2]| standing.depth_m(Vector::new(x_m, y_m, -h), Vector::Z, h);
            self.bottomed = self.envelope.deeper_than(h, at);
        }
        let law = c.law(body.stiffness_pa_per_m);
        let mut tractions = Tractions::new(body, c);
        // a patch may be wider than the contact: sums that start at fours of the grid's columns do not feel it
        let cols = [self.patch.cols[0] / 4 * 4, self.patch.cols[1]];
        let patch = Patch { cols, ..self.patch };
        let x_m = &self.x_m[cols[0]..cols[1]];
        let [tx, ty] = &mut self.friction_pa;
        for (row, line) in (patch.rows[0]..).zip(patch.lines(width)) {
            let [_, y_m] = self.envelope.centre_m(row, 0);
            let depth_m = &self.envelope.depth_m()[line.clone()];
            let p = &mut self.pressure_pa[line.clone()];
            let parts = self.envelope.parts(&line);
            let shares = Shares { parts, first: line.start };
            let preload = self.preload.as_ref();
            let preload = preload.map(|preload| preload.row(line, body.stiffness_pa_per_m));
            match preload {
                None => press(c.damping_s, body, y_m, [x_m, depth_m], shares, |_, d| law.pressure_pa(d), p),
                Some(row) => {
                    let of = |k, d| row.pressure_and_slope(k, &law, d).0;
                    press(c.damping_s, body, y_m, [x_m, depth_m], shares, of, p);
                }
            }
            tractions.add(y_m, x_m, depth_m, p, [tx, ty]);
        }
        tractions.wrench(self.envelope.cell_m() * self.envelope.cell_m())
    }
}

/// Most fine cells a layer may have.
pub(super) const MAX_CELLS: Most = (16_777_216.0, "[1, 2^24]");

/// Parts of the cells of a row that begins with the cell `first`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shares<'a> {
    pub(super) parts: &'a [Part],
    pub(super) first: usize,
}

impl Shares<'_> {
    /// Every cell that has parts gets the sum of what `of` gives for them and their places in the row, each with its
    /// share.
    #[inline]
    pub(super) fn fill<const N: usize>(self, mut out: [&mut [f64]; N], of: impl Fn(usize, f64) -> [f64; N]) {
        for parts in self.parts.chunk_by(|p, q| p.cell == q.cell) {
            let k = parts[0].cell - self.first;
            let mut sums = [0.0; N];
            for part in parts {
                sums.iter_mut().zip(of(k, part.depth_m)).for_each(|(sum, value)| *sum += part.share * value);
            }
            out.iter_mut().zip(sums).for_each(|(out, sum)| out[k] = sum);
        }
    }
}

/// Pressure on a row of cells at `y_m`: the law `pressure_of` of cell k at δ + τ δ′ where the body is below the
/// surface.
#[inline]
fn press(
    damping_s: f64,
    body: &PosedMesh<'_>,
    y_m: f64,
    [x_m, depth_m]: [&[f64]; 2],
    shares: Shares<'_>,
    pressure_of: impl Fn(usize, f64) -> f64,
    pressure_pa: &mut [f64],
) {
    let (v, w, c) = (body.velocity_m_per_s, body.angular_velocity_rad_per_s, body.centre_of_mass_m);
    let sink_m = -damping_s * (v[2] + w[0] * (y_m - c[1]) + w[1] * c[0]);
    let slope = damping_s * w[1];
    for (k, ((p, &depth), &x)) in pressure_pa.iter_mut().zip(depth_m).zip(x_m).enumerate() {
        let loaded_m = depth + (sink_m + slope * x);
        *p = pressure_of(k, if depth > 0.0 { loaded_m } else { 0.0 });
    }
    shares.fill([pressure_pa], |k, depth| {
        let loaded_m = depth + (sink_m + slope * x_m[k]);
        [pressure_of(k, if depth > 0.0 { loaded_m } else { 0.0 })]
    });
}

impl ContactField for WinklerLayer {
    fn expect(&mut self, mesh: &PreparedMesh) {
        self.envelope.expect(mesh);
    }

    fn respond(&mut self, body: &PosedMesh<'_>) -> Response<'_> {
        self.respond_to(body, None)
    }

    fn preload(&mut self, strain: &[f64]) -> Option<Vec<f64>> {
        let c = &self.config;
        let law = c.law(f64::INFINITY);
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

/// Initial compression of the columns, as under the taut cover of a bent skin.
///
/// With p₀ = f(δ₀) from the foam's law f, a body that sinks in by d meets p = g(D₀ + d), where g is the law of foam and
/// body in series and D₀ = δ₀ + p₀/K_b the compression at which that series carries p₀ (K_b: stiffness of the body's
/// surface). The electrode feels p; the body feels p − p₀, since the cover carries p₀ with or without it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Preload {
    /// δ₀ of every fine cell, m.
    depth_m: Vec<f64>,
    /// p₀ of every fine cell, Pa.
    rest_pa: Vec<f64>,
}

/// Preload of the fine cells `start..start + n` of one row, for one body.
#[derive(Debug, Clone, Copy)]
pub(super) struct PreloadedRow<'a> {
    depth_m: &'a [f64],
    rest_pa: &'a [f64],
    /// 1/K_b, m/Pa.
    body_m_per_pa: f64,
}

impl Preload {
    /// Preload of a skin whose taxels are compressed by `taxel_depth_m`, row by row, on the fine cells of `envelope`;
    /// and the pressure of every taxel then, Pa. `law` is that of the foam under a rigid body.
    pub(super) fn new(
        taxel_depth_m: &[f64],
        cells_per_taxel: usize,
        law: &FoamLaw,
        envelope: &Envelope,
    ) -> (Self, Vec<f64>) {
        let [rows, cols] = envelope.shape();
        let taxel_cols = cols / cells_per_taxel;
        let rest_pa: Vec<f64> = taxel_depth_m.iter().map(|d| law.pressure_pa(*d)).collect();
        let fine = |values: &[f64]| -> Vec<f64> {
            let cell = |k: usize| values[k / cols / cells_per_taxel * taxel_cols + k % cols / cells_per_taxel];
            (0..rows * cols).map(cell).collect()
        };
        let preload = Self { depth_m: fine(taxel_depth_m), rest_pa: fine(&rest_pa) };
        (preload, rest_pa)
    }

    /// The cells `line` of the grid under a body of surface stiffness `body_pa_per_m`.
    pub(super) fn row(&self, line: std::ops::Range<usize>, body_pa_per_m: f64) -> PreloadedRow<'_> {
        PreloadedRow {
            depth_m: &self.depth_m[line.clone()],
            rest_pa: &self.rest_pa[line],
            body_m_per_pa: 1.0 / body_pa_per_m,
        }
    }
}

impl PreloadedRow<'_> {
    /// Pressure on the body above cell `k`, Pa, and its slope, Pa/m, where it sinks in by `depth_m`; both 0 above the
    /// surface. Never tensile.
    #[inline]
    pub(super) fn pressure_and_slope(&self, k: usize, law: &FoamLaw, depth_m: f64) -> (f64, f64) {
        if depth_m <= 0.0 {
            return (0.0, 0.0);
        }
        let rest_pa = self.rest_pa[k];
        let start_m = self.depth_m[k] + rest_pa * self.body_m_per_pa;
        let (p, slope) = law.pressure_and_slope(start_m + depth_m);
        ((p - rest_pa).max(0.0), slope)
    }
}
