//! What contact fields are asked and answer: posed bodies, pressures and wrenches, loads and balances.

use crate::mesh::TriMesh;
use crate::prepared::PreparedMesh;
use spts_input::Refusal;
use spts_models::PressureMap;

/// A mesh with its pose and velocity in world axes.
///
/// ```
/// use spts_contact::{PosedMesh, mesh::sphere};
///
/// let ball = sphere(33.4e-3, 24, 48); // stands on its origin
/// let mut falling = PosedMesh::at_rest(&ball, [0.0, 0.0, 0.1]);
/// falling.velocity_m_per_s = [0.0, 0.0, -2.0];
/// assert!((falling.heights_m()[1] - 66.8e-3).abs() < 1e-9);
/// assert!(falling.is_finite());
/// ```
#[derive(Debug, Clone, Copy)]
pub struct PosedMesh<'a> {
    /// The mesh, body axes.
    pub mesh: &'a TriMesh,
    /// Rotation matrix, row-major: world = R · body + position.
    pub rotation: [[f64; 3]; 3],
    /// Position of the body origin, m.
    pub position_m: [f64; 3],
    /// Centre of mass in world axes, m. Torques are about this point.
    pub centre_of_mass_m: [f64; 3],
    /// Velocity of the centre of mass, m/s.
    pub velocity_m_per_s: [f64; 3],
    /// Angular velocity, world axes, rad/s.
    pub angular_velocity_rad_per_s: [f64; 3],
    /// Stiffness of the body's own surface in series with the skin, Pa/m; `f64::INFINITY` for a rigid body.
    pub stiffness_pa_per_m: f64,
}

impl<'a> PosedMesh<'a> {
    /// A rigid body at rest without rotation. Its origin and its centre of mass are at `position_m`.
    pub fn at_rest(mesh: &'a TriMesh, position_m: [f64; 3]) -> Self {
        Self {
            mesh,
            rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            position_m,
            centre_of_mass_m: position_m,
            velocity_m_per_s: [0.0; 3],
            angular_velocity_rad_per_s: [0.0; 3],
            stiffness_pa_per_m: f64::INFINITY,
        }
    }

    /// Heights of the lowest and the highest vertex above the body's origin in world axes, m. Without a vertex, the
    /// lowest is above the highest.
    pub fn heights_m(&self) -> [f64; 2] {
        let [_, _, up] = self.rotation;
        let mut ends = [f64::INFINITY, f64::NEG_INFINITY];
        for v in &self.mesh.vertices {
            let z = up[0] * v[0] + up[1] * v[1] + up[2] * v[2];
            ends = [ends[0].min(z), ends[1].max(z)];
        }
        ends
    }

    /// Whether pose and velocity are finite, and the stiffness is not NaN.
    pub fn is_finite(&self) -> bool {
        let vectors = [self.position_m, self.centre_of_mass_m, self.velocity_m_per_s, self.angular_velocity_rad_per_s];
        let mut parts = self.rotation.iter().chain(&vectors).flatten();
        parts.all(|v| v.is_finite()) && !self.stiffness_pa_per_m.is_nan()
    }
}

/// Position and orientation of the pressing body in world axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Position of the body origin, m.
    pub position_m: [f64; 3],
    /// Orientation, unit quaternion (w, x, y, z).
    pub quaternion: [f64; 4],
}

/// Force and torque on the pressing body about its centre of mass, world axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wrench {
    /// Force, N.
    pub force_n: [f64; 3],
    /// Torque, N m.
    pub torque_nm: [f64; 3],
}

impl Wrench {
    /// Nothing touches.
    pub const NONE: Self = Self { force_n: [0.0; 3], torque_nm: [0.0; 3] };

    /// The answer of a contact field that has none: NaN everywhere.
    pub const UNKNOWN: Self = Self { force_n: [f64::NAN; 3], torque_nm: [f64::NAN; 3] };
}

/// State of the contact at one instant.
///
/// ```
/// use spts_contact::{Frame, Pose, Wrench};
/// use spts_models::PressureMap;
///
/// let pressure = PressureMap::from_values(1, 2, vec![8e3, 2e3]);
/// let frame = Frame {
///     time_s: 0.1,
///     electrode_pressure: pressure.clone(),
///     pressure,
///     wrench: Wrench { force_n: [0.0, 0.0, 2.25], torque_nm: [0.0; 3] },
///     pose: Pose { position_m: [0.0; 3], quaternion: [1.0, 0.0, 0.0, 0.0] },
/// };
/// assert!(frame.imbalance(15e-3 * 15e-3) < 1e-12);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Time since the start of the scene, s.
    pub time_s: f64,
    /// Mean pressure over each taxel's whole area (pitch × pitch), Pa. Its sum × pitch² is the normal contact force.
    pub pressure: PressureMap,
    /// Mean pressure over each taxel's electrode (centred in that area), Pa, as the transducer sees it. It includes a
    /// preload of the skin, which `pressure` does not.
    pub electrode_pressure: PressureMap,
    /// Contact wrench on the body.
    pub wrench: Wrench,
    /// Pose of the body.
    pub pose: Pose,
}

impl Frame {
    /// Relative difference between force and pressure: |F_z − Σ p A| / F_z, where A is the area of a taxel's whole
    /// cell; 0 without a force.
    pub fn imbalance(&self, cell_area_m2: f64) -> f64 {
        let force_n = self.wrench.force_n[2];
        if force_n <= 0.0 {
            return 0.0;
        }
        (force_n - self.pressure.sum() * cell_area_m2).abs() / force_n
    }
}

/// Rectangle of squares of the grid on which contact is computed: rows `rows[0]..rows[1]` and columns
/// `cols[0]..cols[1]`.
///
/// ```
/// use spts_contact::Patch;
///
/// let patch = Patch { rows: [1, 3], cols: [2, 5] };
/// assert_eq!((patch.height(), patch.width()), (2, 3));
/// // where its squares are in a grid of 10 columns
/// assert_eq!(patch.lines(10).collect::<Vec<_>>(), [12..15, 22..25]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Patch {
    /// First and one-past-last row.
    pub rows: [usize; 2],
    /// First and one-past-last column.
    pub cols: [usize; 2],
}

impl Patch {
    /// Whether the patch has no grid squares.
    pub fn is_empty(&self) -> bool {
        self.rows[0] >= self.rows[1] || self.cols[0] >= self.cols[1]
    }

    /// Number of columns.
    pub fn width(&self) -> usize {
        self.cols[1].saturating_sub(self.cols[0])
    }

    /// Number of rows.
    pub fn height(&self) -> usize {
        self.rows[1].saturating_sub(self.rows[0])
    }

    /// The grid squares of each row of the patch, as index ranges of a row-major grid with `grid_cols` columns.
    pub fn lines(&self, grid_cols: usize) -> impl Iterator<Item = std::ops::Range<usize>> + use<> {
        let Self { rows, cols } = *self;
        (rows[0]..rows[1]).map(move |row| row * grid_cols + cols[0]..row * grid_cols + cols[1])
    }

    /// All of a grid of `[rows, cols]`.
    pub(crate) fn whole([rows, cols]: [usize; 2]) -> Self {
        Self { rows: [0, rows], cols: [0, cols] }
    }

    /// Number of rows and columns.
    pub(crate) fn shape(&self) -> [usize; 2] {
        [self.height(), self.width()]
    }

    /// Whether all of `other` is in the patch.
    pub(crate) fn holds(&self, other: Self) -> bool {
        let holds = |own: [usize; 2], other: [usize; 2]| own[0] <= other[0] && other[1] <= own[1];
        holds(self.rows, other.rows) && holds(self.cols, other.cols)
    }

    /// Smallest patch with every square for which `inside` holds, by its index in a grid of `grid_cols` columns; empty
    /// if there is none.
    pub(crate) fn shrunk(&self, grid_cols: usize, inside: impl Fn(usize) -> bool) -> Self {
        let mut out = Self::default();
        for (row, line) in (self.rows[0]..).zip(self.lines(grid_cols)) {
            let mut found = line.filter(|square| inside(*square));
            if let Some(first) = found.next() {
                let last = found.next_back().unwrap_or(first);
                out.include(Self { rows: [row, row + 1], cols: [first - row * grid_cols, last + 1 - row * grid_cols] });
            }
        }
        out
    }

    /// Grows to the smallest rectangle that has `other` too.
    pub(crate) fn include(&mut self, other: Self) {
        if self.is_empty() {
            *self = other;
        } else if !other.is_empty() {
            self.rows = [self.rows[0].min(other.rows[0]), self.rows[1].max(other.rows[1])];
            self.cols = [self.cols[0].min(other.cols[0]), self.cols[1].max(other.cols[1])];
        }
    }
}

/// Answer of a contact field to one posed body.
#[derive(Debug, Clone, Copy)]
pub struct Response<'a> {
    /// Wrench on the body; NaN if there is no answer ([`ContactField::respond`](crate::ContactField::respond)).
    pub wrench: Wrench,
    /// Pressure on every grid square, Pa, shape `(rows · cells_per_taxel, cols · cells_per_taxel)`, row-major in the
    /// skin's row and column order.
    pub pressure_pa: &'a [f64],
    /// Grid squares outside which the pressure is 0, also after [`ContactField::refine`](crate::ContactField::refine).
    /// `None` if pressure may be anywhere.
    pub patch: Option<Patch>,
}

/// A contact model at work: the skin's foam, which answers a posed body with the pressure on the skin and the wrench on
/// the body.
///
/// ```
/// use spts_contact::{PosedMesh, build_contact, mesh::cuboid};
/// use spts_models::SkinLayout;
///
/// let mut field = build_contact("winkler", toml::Table::new(), &SkinLayout::default())?;
/// let block = cuboid([30e-3, 30e-3, 10e-3]);
/// let mut force_n = |depth_m: f64| field.respond(&PosedMesh::at_rest(&block, [0.0, 0.0, -depth_m])).wrench.force_n[2];
/// assert_eq!(force_n(0.0), 0.0);
/// assert!(force_n(1e-3) > 2.0 * force_n(0.5e-3), "the foam densifies");
/// # Ok::<(), spts_input::Refusal>(())
/// ```
pub trait ContactField: Send {
    /// Pressure on the skin and wrench on the body for the given pose and velocity.
    ///
    /// The normal force of the wrench equals the sum of pressure × area over all grid squares. Pressure is finite and
    /// never negative, at any depth and for any mesh with finite vertices and valid indices.
    ///
    /// A wrench of NaN means that there is no answer: pose or velocity is not finite, or a solver failed. The pressure
    /// then has no meaning, and a simulation stops with an error.
    fn respond(&mut self, body: &PosedMesh<'_>) -> Response<'_>;

    /// Announces the mesh of the following bodies, so that it is prepared once and not compared at each call. It
    /// changes no answer.
    fn expect(&mut self, _mesh: &PreparedMesh) {}

    /// Sets a preload: `strain` is the compression of the foam under every taxel while nothing touches the skin, as a
    /// share of its thickness, in [0, 1) and in row-major order. Returns the resulting pressure of every taxel, Pa;
    /// `None`, and nothing changes, for a contact model without preloads.
    ///
    /// Answers are the addition due to the body: it meets the surface at the same height, on foam that its compression
    /// has made stiffer. An electrode is under the answer plus the preload. A preload of 0 changes no answer.
    ///
    /// # Panics
    /// If the number of strains differs from that of the taxels.
    fn preload(&mut self, _strain: &[f64]) -> Option<Vec<f64>> {
        None
    }

    /// Why the last call had no answer; `None` if it had one, or if the reason is not known.
    fn failure(&self) -> Option<String> {
        None
    }

    /// Pressure for a frame, Pa, with the shape of that in [`Response`], if it is more accurate than the answer for the
    /// dynamics. It has the same normal force `force_n`. `None` if the answer itself is the best, or if there is none:
    /// then [`ContactField::failure`] gives the reason, and a simulation stops with an error.
    ///
    /// Called after [`ContactField::respond`] with the same body, for frames only, in their order: a frame of a slow
    /// press may be interpolated between earlier ones.
    fn refine(&mut self, _body: &PosedMesh<'_>, _force_n: f64) -> Option<&[f64]> {
        None
    }

    /// The same contact field as one that finds the pose under a prescribed force, so that a press needs no dynamics;
    /// `None` for a contact model that cannot.
    fn quasi_static(&mut self) -> Option<&mut dyn QuasiStatic> {
        None
    }

    /// Relative accuracy of an answer whose iteration starts from the last pressure, so that earlier poses affect it. 0
    /// if the answer depends only on the body, bit for bit.
    fn tolerance(&self) -> f64 {
        0.0
    }

    /// Grid squares along one side of a taxel: the resolution of the pressure.
    fn cells_per_taxel(&self) -> usize;

    /// All parameters, defaults included, as a scene would write them. They are enough to build the same contact field
    /// again.
    fn parameters(&self) -> toml::Table;

    /// Damping time of the layer, s: the viscous part of the pressure is this time × the rate of the elastic part.
    /// Together with the stiffness it limits the time step. 0 if answers do not depend on speed.
    fn damping_s(&self) -> f64 {
        0.0
    }

    /// Thickness of the layer, m.
    fn thickness_m(&self) -> f64;
}

/// How the holder lets a body tilt about the skin's axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Holder {
    /// The body cannot tilt.
    Rigid,
    /// An elastic holder exerts the moment k (θ₀ − θ) about the point where the load's axis meets z = 0.
    Elastic {
        /// k, symmetric and positive definite, N m/rad, about world x and y.
        stiffness_nm_per_rad: [[f64; 2]; 2],
        /// θ₀, tilts without a moment, rad, caused by the force on the holder.
        rest_rad: [f64; 2],
    },
}

/// What presses a body onto the skin: a force along a vertical axis, through a holder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load {
    /// Normal force, N; positive.
    pub force_n: f64,
    /// Position (x, y) of the vertical axis of the load, m.
    pub axis_m: [f64; 2],
    /// The holder of the body.
    pub holder: Holder,
    /// Pose from which the iteration starts. The pose of a similar load saves time, and changes the result by round-off
    /// only.
    pub from: Option<Seat>,
}

/// How a pressed body lies in the skin: its height and its small tilts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seat {
    /// Height of the body's origin before tilting, m.
    pub height_m: f64,
    /// Small tilts about world x and y through the load's axis at z = 0, rad.
    pub tilt_rad: [f64; 2],
}

/// A body that lies in equilibrium under a load: its pose, and the pressure under it.
#[derive(Debug, Clone, Copy)]
pub struct Balance<'a> {
    /// Height and tilts.
    pub seat: Seat,
    /// Rotation matrix including the tilts, row-major.
    pub rotation: [[f64; 3]; 3],
    /// Position of the body's origin, m.
    pub position_m: [f64; 3],
    /// Pressure, and wrench about the centre of mass. The normal force is that of the load.
    pub response: Response<'a>,
}

/// A contact field that computes the equilibrium under a load.
///
/// ```
/// use spts_contact::{Holder, Load, PosedMesh, build_contact, mesh::cuboid};
/// use spts_models::SkinLayout;
///
/// let mut field = build_contact("footprint", toml::Table::new(), &SkinLayout::default())?;
/// let block = cuboid([30e-3, 30e-3, 10e-3]);
/// let load = Load { force_n: 20.0, axis_m: [0.0, 0.0], holder: Holder::Rigid, from: None };
/// let quasi_static = field.quasi_static().expect("`footprint` is quasi-static");
/// let balance = quasi_static.carry(&PosedMesh::at_rest(&block, [0.0; 3]), &load)?;
/// assert!((balance.response.wrench.force_n[2] - 20.0).abs() < 1e-6);
/// assert!(balance.seat.height_m < 0.0, "the block sinks into the skin");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait QuasiStatic {
    /// Finds the height and the small tilts at which the pressure under `body` carries `load`: Σ p A = F, and Σ (r × p)
    /// A about the load's axis equals the holder's moment up to its sign. The body's height and velocities are ignored.
    ///
    /// # Errors
    /// [`EquilibriumError`] if no part of the body lies over the skin, the force is not reached within 5 cm beyond the
    /// body's height, or the body tips over.
    fn carry(&mut self, body: &PosedMesh<'_>, load: &Load) -> Result<Balance<'_>, EquilibriumError>;
}

/// Why a body has no equilibrium under the given load.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EquilibriumError {
    /// There is contact, but not enough force.
    #[error("the contact carries at most {reached_n:.4e} N, at {depth_m:.4} m depth; {wanted_n:.4e} N are needed, {:.1e} N more", wanted_n - reached_n)]
    Force {
        /// Largest force found, N.
        reached_n: f64,
        /// Required force, N.
        wanted_n: f64,
        /// Depth at which the search ended, m.
        depth_m: f64,
    },
    /// There is no contact at any depth.
    #[error("the body meets nothing down to {depth_m:.4} m depth: it lies beside the skin")]
    Beside {
        /// Depth at which the search ended, m.
        depth_m: f64,
    },
    /// Any other reason: a tilt that is not small, no convergence, no answer of the contact
    /// field, a load that is no force, an energy that is not absorbed.
    #[error(transparent)]
    Refused(#[from] Refusal),
}

impl EquilibriumError {
    /// The load is not a positive force.
    pub fn load(force_n: f64) -> Self {
        Refusal::new(format!("`force_n` = {force_n} is outside (0, ∞) N")).into()
    }

    /// The contact field returned a wrench that is NaN.
    pub(crate) fn no_answer(depth_m: f64) -> Self {
        Refusal::new(format!("the contact field has no answer at {depth_m:.4e} m depth")).into()
    }
}

/// How much deeper than the body is high a force is looked for, m.
const EXTRA_DEPTH_M: f64 = 0.05;

/// Depth below the touch down to which a force is looked for: the body's height and 5 cm, m.
pub(crate) fn depth_limit_m(body: &PosedMesh<'_>) -> f64 {
    let [low_m, high_m] = body.heights_m();
    high_m - low_m + EXTRA_DEPTH_M
}
