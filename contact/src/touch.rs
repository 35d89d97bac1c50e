//! Several bodies on one skin, flat or curved.

use crate::body::PosedMesh;
use crate::columns::{FoamLaw, WinklerConfig, WinklerLayer};
use crate::field::ContactField as _;
use crate::frame::Wrench;
use crate::prepared::PreparedMesh;
use crate::surface::{Solid, SurfaceConfig, SurfaceField, SurfacePoints};
use crate::taxels::TaxelBins;
use spts_models::{ConfigError, PressureMap, SkinLayout};

/// A body that may touch a skin: its mesh, prepared for any skin.
#[derive(Debug, Clone)]
pub struct TouchBody {
    /// The mesh, body axes, m.
    pub mesh: PreparedMesh,
    solid: Solid,
}

impl From<PreparedMesh> for TouchBody {
    fn from(mesh: PreparedMesh) -> Self {
        Self {
            solid: Solid::new(&mesh),
            mesh,
        }
    }
}

/// A skin that any number of bodies can touch at once. Input: poses and velocities. Output: pressures and wrenches.
///
/// A flat skin is a [`WinklerLayer`], any other a [`SurfaceField`]. Pressures of several bodies at one place add up.
///
/// ```
/// use spts_contact::{PosedMesh, PreparedMesh, TouchBody, TouchSkin, WinklerConfig, mesh::cylinder};
/// use spts_models::SkinLayout;
///
/// let mut skin = TouchSkin::flat(SkinLayout::default(), WinklerConfig::default())?;
/// let finger = TouchBody::from(PreparedMesh::from(cylinder(8e-3, 30e-3, 32)));
/// let at = |x_m| (&finger, PosedMesh::at_rest(&finger.mesh, [x_m, 0.0, -1e-3]));
/// let mut wrenches = Vec::new();
/// skin.touch(&[at(-40e-3), at(40e-3)], &mut wrenches);
/// let cell_area_m2 = 15e-3 * 15e-3;
/// let sum_n = skin.pressure().sum() * cell_area_m2;
/// assert!((sum_n - wrenches[0].force_n[2] - wrenches[1].force_n[2]).abs() < 1e-9 * sum_n);
/// # Ok::<(), spts_models::ConfigError>(())
/// ```
#[derive(Debug, Clone)]
pub struct TouchSkin {
    layout: SkinLayout,
    foam: Foam,
    pressure: PressureMap,
    electrode_pressure: PressureMap,
    touched_m2: f64,
    stiffness_pa_per_m: f64,
    /// Depth at which no pores are left, m.
    max_depth_m: f64,
    damping_s: f64,
}

#[derive(Debug, Clone)]
enum Foam {
    Flat {
        layer: Box<WinklerLayer>,
        bins: TaxelBins,
        cell_area_m2: f64,
    },
    Curved(Box<SurfaceField>),
}

impl TouchSkin {
    /// A flat skin in the plane z = 0, with its middle at the origin. Bodies touch it from above.
    ///
    /// # Errors
    /// [`ConfigError`] if a parameter is outside its range.
    pub fn flat(layout: SkinLayout, config: WinklerConfig) -> Result<Self, ConfigError> {
        let layer = WinklerLayer::new(config, &layout)?;
        let cells = config.cells_per_taxel;
        let cell_m = layout.pitch_m() / cells as f64;
        let foam = Foam::Flat {
            bins: TaxelBins::new(&layout, cells),
            layer: Box::new(layer),
            cell_area_m2: cell_m * cell_m,
        };
        let max_depth_m = config.max_strain * config.thickness_m;
        Ok(Self::with(
            layout,
            foam,
            config.stiffness_pa_per_m,
            max_depth_m,
            config.damping_s,
        ))
    }

    /// A skin of any shape, such as one round a robot's arm or on the surface of a mesh. `points` are sample points on
    /// its surface, each with its normal, area and taxel ([`SurfacePoints`]), and `config` is the foam under them.
    ///
    /// `layout` says into how many rows and columns the taxels are arranged: taxel i of `points` is number i of
    /// `layout`, counted row by row. Its pitch and electrodes have no influence on the pressures: areas are those of
    /// the points.
    ///
    /// # Errors
    /// [`ConfigError`] if a parameter is outside its range, or `points` do not have rows × columns taxels.
    pub fn curved(layout: SkinLayout, points: SurfacePoints, config: SurfaceConfig) -> Result<Self, ConfigError> {
        let (found, needed) = (points.taxels(), layout.taxels());
        spts_models::in_range("taxels", found as f64, found == needed, "rows × cols")?;
        let field = SurfaceField::new(config, points)?;
        let foam = Foam::Curved(Box::new(field));
        let max_depth_m = config.max_strain * config.thickness_m;
        Ok(Self::with(
            layout,
            foam,
            config.stiffness_pa_per_m,
            max_depth_m,
            config.damping_s,
        ))
    }

    fn with(layout: SkinLayout, foam: Foam, stiffness_pa_per_m: f64, max_depth_m: f64, damping_s: f64) -> Self {
        let zeros = || PressureMap::zeros(layout.rows(), layout.cols());
        Self {
            pressure: zeros(),
            electrode_pressure: zeros(),
            touched_m2: 0.0,
            stiffness_pa_per_m,
            max_depth_m,
            damping_s,
            layout,
            foam,
        }
    }

    /// Rows, columns, pitch and electrodes of the taxels.
    #[must_use]
    pub fn layout(&self) -> &SkinLayout {
        &self.layout
    }

    /// Centre of every taxel on the free surface, m, and the normal there, in row-major order.
    #[must_use]
    pub fn taxel_centres(&self) -> Vec<([f64; 3], [f64; 3])> {
        match &self.foam {
            Foam::Curved(field) => field.points().taxel_centres(),
            Foam::Flat { .. } => {
                let flat = SurfacePoints::flat(&self.layout, 1);
                flat.map(|points| points.taxel_centres()).unwrap_or_default()
            }
        }
    }

    /// Area of every taxel, m², in row-major order.
    #[must_use]
    pub fn taxel_areas_m2(&self) -> Vec<f64> {
        match &self.foam {
            Foam::Curved(field) => field.points().taxel_areas_m2().to_vec(),
            Foam::Flat { .. } => vec![self.layout.pitch_m().powi(2); self.layout.taxels()],
        }
    }

    /// Mean pressure over every taxel's area, Pa.
    #[must_use]
    pub fn pressure(&self) -> &PressureMap {
        &self.pressure
    }

    /// Mean pressure over every taxel's electrode, Pa, as the transducer sees it. On a curved skin it is the mean over
    /// the taxel's area.
    #[must_use]
    pub fn electrode_pressure(&self) -> &PressureMap {
        &self.electrode_pressure
    }

    /// Area of the skin under pressure, m².
    #[must_use]
    pub fn touched_m2(&self) -> f64 {
        self.touched_m2
    }

    /// Upper bound of the foam's stiffness in the contact, N/m: the value under the taxel with the largest pressure is
    /// used everywhere. The slope of p = K δ/(1 − δ/δ_m) at the pressure p is K (1 + p/(K δ_m))².
    #[must_use]
    pub fn stiffness_n_per_m(&self) -> f64 {
        let share = self.pressure.max() / (self.stiffness_pa_per_m * self.max_depth_m);
        self.touched_m2 * self.stiffness_pa_per_m * (1.0 + share).powi(2).min(FoamLaw::SOLID_RATIO)
    }

    /// Damping time of the foam, s.
    #[must_use]
    pub fn damping_s(&self) -> f64 {
        self.damping_s
    }

    /// Removes everything from the skin and places `bodies` on it, each with the mesh of its [`TouchBody`]. Writes the
    /// wrench on each body about its centre of mass into `wrenches`, in the same order. A body whose pose or velocity
    /// is not finite gets a wrench of NaN and presses nothing.
    pub fn touch(&mut self, bodies: &[(&TouchBody, PosedMesh<'_>)], wrenches: &mut Vec<Wrench>) {
        wrenches.clear();
        match &mut self.foam {
            Foam::Flat {
                layer,
                bins,
                cell_area_m2,
            } => {
                self.pressure.values_mut().fill(0.0);
                self.electrode_pressure.values_mut().fill(0.0);
                let mut cells = 0;
                for (body, posed) in bodies {
                    layer.expect(&body.mesh);
                    let answer = layer.respond(posed);
                    wrenches.push(answer.wrench);
                    let maps = bins.means(answer.pressure_pa, answer.patch);
                    for (sum, map) in [&mut self.pressure, &mut self.electrode_pressure]
                        .into_iter()
                        .zip(&maps)
                    {
                        for (sum, p) in sum.values_mut().iter_mut().zip(map.values()) {
                            *sum += p;
                        }
                    }
                    cells += answer.pressure_pa.iter().filter(|p| **p > 0.0).count();
                }
                self.touched_m2 = cells as f64 * *cell_area_m2;
            }
            Foam::Curved(field) => {
                field.clear();
                wrenches.extend(bodies.iter().map(|(body, posed)| field.press(&body.solid, posed)));
                field.points().means(field.pressure_pa(), self.pressure.values_mut());
                self.electrode_pressure
                    .values_mut()
                    .copy_from_slice(self.pressure.values());
                self.touched_m2 = field.touched_m2();
            }
        }
    }
}
