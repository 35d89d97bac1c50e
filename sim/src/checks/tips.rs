//! From a posed body to the pressure on the cells under it, for any material below the tips.

use super::engine::{Engine, EngineError, Skin};
use spts_contact::mesh::TriMesh;
use spts_contact::{PosedMesh, Response, Wrench};

/// Cells of a skin, each with a tip at its centre.
pub(super) struct Tips {
    rows: usize,
    cols: usize,
    cell_m: f64,
    skin: Skin,
    /// The last mesh and its model; the model is `None` if the mesh cannot touch anything.
    loaded: Option<(TriMesh, Option<Engine>)>,
    pressure_pa: Vec<f64>,
    /// Why the last call had no answer.
    failure: Option<EngineError>,
}

impl std::fmt::Debug for Tips {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let shape = [self.rows, self.cols];
        f.debug_struct("Tips")
            .field("shape", &shape)
            .field("failure", &self.failure)
            .finish_non_exhaustive()
    }
}

impl Tips {
    /// Tips of `rows` × `cols` cells of side `cell_m` on `skin`, centred on the origin.
    pub(super) fn new(rows: usize, cols: usize, cell_m: f64, skin: Skin) -> Self {
        Self {
            rows,
            cols,
            cell_m,
            skin,
            loaded: None,
            pressure_pa: vec![0.0; rows * cols],
            failure: None,
        }
    }

    /// Centre of a cell, (x, y), in units of `cell_m`.
    pub(super) fn centre([rows, cols]: [usize; 2], row: usize, col: usize) -> [f64; 2] {
        [
            col as f64 + 0.5 - 0.5 * cols as f64,
            0.5 * rows as f64 - row as f64 - 0.5,
        ]
    }

    /// Static answer to `body`, columns having the stiffness `stiffness_pa_per_m`. When there is none, the wrench is
    /// NaN, which stops a world with an error, the pressure 0, and [`Tips::failure`] says why.
    pub(super) fn respond(&mut self, body: &PosedMesh<'_>, stiffness_pa_per_m: f64) -> Response<'_> {
        self.pressure_pa.fill(0.0);
        self.failure = self.press(body, stiffness_pa_per_m * self.cell_m).err();
        let wrench = if self.failure.is_none() {
            self.wrench(body.centre_of_mass_m)
        } else {
            Wrench::UNKNOWN
        };
        Response {
            wrench,
            pressure_pa: &self.pressure_pa,
            patch: None,
        }
    }

    /// Why the last answer was none.
    pub(super) fn failure(&self) -> Option<String> {
        self.failure.as_ref().map(EngineError::to_string)
    }

    fn press(&mut self, body: &PosedMesh<'_>, pressure_unit_pa: f64) -> Result<(), EngineError> {
        if !body.is_finite() {
            return Err(EngineError::NotFinite);
        }
        let Some(depth_m) = self.depth_m(body) else {
            return Ok(());
        };
        if self.loaded.as_ref().is_none_or(|(mesh, _)| mesh != body.mesh) {
            let engine = Engine::compile(&self.skin, body.mesh, self.cell_m)?;
            self.loaded = Some((body.mesh.clone(), engine));
        }
        let Some((_, Some(engine))) = &mut self.loaded else {
            return Ok(());
        };
        engine.settle(&self.skin, body, self.cell_m, depth_m / self.cell_m)?;
        let forces = engine.contact_forces();
        for (cell_pa, &dof) in self.pressure_pa.iter_mut().zip(&self.skin.cell_dofs) {
            *cell_pa = (-forces[dof] * pressure_unit_pa).max(0.0);
        }
        Ok(())
    }

    /// Depth of the lowest vertex; `None` when the body is above or beside the skin.
    fn depth_m(&self, body: &PosedMesh<'_>) -> Option<f64> {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for v in &body.mesh.vertices {
            for axis in 0..3 {
                let r = body.rotation[axis];
                let x = r[0] * v[0] + r[1] * v[1] + r[2] * v[2] + body.position_m[axis];
                (low[axis], high[axis]) = (low[axis].min(x), high[axis].max(x));
            }
        }
        let half = [self.cols, self.rows].map(|n| 0.5 * n as f64 * self.cell_m);
        let beside = (0..2).any(|i| low[i] >= half[i] || high[i] <= -half[i]);
        (low[2] < 0.0 && !beside).then_some(-low[2])
    }

    fn wrench(&self, centre_of_mass_m: [f64; 3]) -> Wrench {
        let (mut force_pa, mut moment) = (0.0, [0.0; 2]);
        for (i, p) in self.pressure_pa.iter().enumerate() {
            let [x, y] = Self::centre([self.rows, self.cols], i / self.cols, i % self.cols);
            force_pa += p;
            moment[0] += (y * self.cell_m - centre_of_mass_m[1]) * p;
            moment[1] -= (x * self.cell_m - centre_of_mass_m[0]) * p;
        }
        let area_m2 = self.cell_m * self.cell_m;
        Wrench {
            force_n: [0.0, 0.0, force_pa * area_m2],
            torque_nm: [moment[0] * area_m2, moment[1] * area_m2, 0.0],
        }
    }
}
