//! Several bodies on one skin, flat or curved.

use crate::balance::{Balance, Column};
use crate::columns::WinklerLayer;
use crate::envelope::KnownBody;
use crate::field::{ContactField as _, PosedMesh, Wrench};
use crate::foam::{Foam, FoamLaw};
use crate::prepared::PreparedMesh;
use crate::support::{self, Support};
use crate::surface::{Part, Solid, SurfaceField, SurfacePoints};
use crate::taxels::TaxelBins;
use parry3d_f64::math::Vector;
use spts_input::Refusal;
use spts_models::{PressureMap, SkinLayout, in_range};

/// A body that may touch a skin: its mesh, prepared for any skin.
#[derive(Debug, Clone)]
pub struct TouchBody {
    /// The mesh, body axes, m.
    pub mesh: PreparedMesh,
    solid: Solid,
}

impl TouchBody {
    /// A body of convex parts. Flat skins take the parts if all are ellipsoids or capsules, none sharper than a square
    /// of the grid; else `mesh`, which must have the same surface.
    pub fn of_parts(mesh: PreparedMesh, parts: Vec<Part>) -> Self {
        Self { solid: Solid::of_parts(parts), mesh }
    }

    /// Its convex parts; empty if it is its mesh alone.
    pub fn parts(&self) -> &[Part] {
        self.solid.parts()
    }
}

impl From<PreparedMesh> for TouchBody {
    fn from(mesh: PreparedMesh) -> Self {
        Self { solid: Solid::new(&mesh), mesh }
    }
}

/// A body that something else carries, such as the contact of a physics engine, and its load on a skin.
#[derive(Debug, Clone, Copy)]
pub struct Carried<'a> {
    /// The body.
    pub body: &'a TouchBody,
    /// Where it is, in the skin's axes.
    pub posed: PosedMesh<'a>,
    /// Normal force between it and the skin, N.
    pub normal_n: f64,
    /// Where the force acts, m.
    pub centre_m: [f64; 3],
    /// Direction of that force, if the pressures shall add up to it as vectors: Σ p A (n · along) = F. Without it,
    /// Σ p A = F.
    pub along: Option<[f64; 3]>,
    /// Thickness of what the body wears, as another skin, m.
    pub lining_m: f64,
}

/// A skin that any number of bodies can touch at once. Input: poses and velocities. Output: pressures and wrenches.
///
/// A flat skin is a [`WinklerLayer`], any other a [`SurfaceField`]. Foam acts in the columns between the link's surface
/// and the skin's: what is behind them, or comes through them from behind, touches nothing. Pressures of several bodies
/// at one place add up.
///
/// ```
/// use spts_contact::{PosedMesh, PreparedMesh, TouchBody, TouchSkin, Foam, mesh::cylinder};
/// use spts_models::SkinLayout;
///
/// let mut skin = TouchSkin::flat(SkinLayout::default(), Foam::default())?;
/// let finger = TouchBody::from(PreparedMesh::from(cylinder(8e-3, 30e-3, 32)));
/// let at = |x_m| (&finger, PosedMesh::at_rest(&finger.mesh, [x_m, 0.0, -1e-3]));
/// let mut wrenches = Vec::new();
/// skin.touch(&[at(-40e-3), at(40e-3)], &mut wrenches);
/// let cell_area_m2 = 15e-3 * 15e-3;
/// let sum_n = skin.pressure().sum() * cell_area_m2;
/// assert!((sum_n - wrenches[0].force_n[2] - wrenches[1].force_n[2]).abs() < 1e-9 * sum_n);
/// # Ok::<(), spts_input::Refusal>(())
/// ```
#[derive(Debug, Clone)]
pub struct TouchSkin {
    layout: SkinLayout,
    foam: Foam,
    surface: Surface,
    /// Columns under a body that is carried.
    columns: Vec<Column>,
    balance: Balance,
    pressure: PressureMap,
    electrode_pressure: PressureMap,
    /// Taxels that may have a pressure, in their order.
    touched: Vec<usize>,
    touched_m2: f64,
    bottomed: bool,
}

#[derive(Debug, Clone)]
enum Surface {
    Flat(Box<FlatSkin>),
    Curved(Box<SurfaceField>),
}

/// Acceleration with which a body that is beside the foam may come into it within a step, m/s².
const MOST_M_PER_S2: f64 = 200.0;

/// A flat skin, and what makes the next touch fast.
#[derive(Debug, Clone)]
struct FlatSkin {
    layer: WinklerLayer,
    bins: TaxelBins,
    /// Lowest and highest corner of the foam, m.
    bounds_m: [[f64; 3]; 2],
    cell_area_m2: f64,
    /// What the layer knows of the body at each place of the list: one that only moves up and down is not rasterised
    /// again.
    known: Vec<KnownBody>,
    /// Number of the touch in which each square of the grid was pressed last: one that two bodies press counts once.
    pressed: Vec<u64>,
    touches: u64,
}

impl TouchSkin {
    /// A flat skin in the plane z = 0, with its middle at the origin. Bodies touch it from above.
    ///
    /// # Errors
    /// [`Refusal`] if a parameter is outside its range.
    pub fn flat(layout: SkinLayout, foam: Foam) -> Result<Self, Refusal> {
        let cells = foam.cells_per_taxel;
        let cell_m = layout.pitch_m() / cells as f64;
        let [half_x, half_y] = [layout.cols(), layout.rows()].map(|n| 0.5 * n as f64 * layout.pitch_m());
        let flat = FlatSkin {
            bounds_m: [[-half_x, -half_y, -foam.thickness_m], [half_x, half_y, 0.0]],
            layer: WinklerLayer::new(foam, &layout)?,
            bins: TaxelBins::new(&layout, cells),
            cell_area_m2: cell_m * cell_m,
            known: Vec::new(),
            pressed: vec![0; layout.taxels() * cells * cells],
            touches: 0,
        };
        Ok(Self::with(layout, foam, Surface::Flat(Box::new(flat))))
    }

    /// A skin of any shape, such as one round a robot's arm or on the surface of a mesh. `points` are sample points on
    /// its surface, each with its normal, area and taxel ([`SurfacePoints`]), and `foam` is what is under them.
    ///
    /// `layout` says into how many rows and columns the taxels are arranged: taxel i of `points` is number i of
    /// `layout`, counted row by row. Its pitch and electrodes have no influence on the pressures: areas are those of
    /// the points.
    ///
    /// # Errors
    /// [`Refusal`] if a parameter is outside its range, or `points` do not have rows × columns taxels.
    pub fn curved(layout: SkinLayout, points: SurfacePoints, foam: Foam) -> Result<Self, Refusal> {
        let (found, needed) = (points.taxels(), layout.taxels());
        in_range("taxels", found as f64, found == needed, "rows × cols")?;
        let field = SurfaceField::new(foam, points)?;
        Ok(Self::with(layout, foam, Surface::Curved(Box::new(field))))
    }

    fn with(layout: SkinLayout, foam: Foam, surface: Surface) -> Self {
        let pressure = PressureMap::zeros(layout.rows(), layout.cols());
        let electrode_pressure = match surface {
            Surface::Flat(_) => pressure.clone(),
            Surface::Curved(_) => PressureMap::zeros(0, 0),
        };
        Self {
            pressure,
            electrode_pressure,
            touched: Vec::new(),
            touched_m2: 0.0,
            bottomed: false,
            columns: Vec::new(),
            balance: Balance::default(),
            layout,
            foam,
            surface,
        }
    }

    /// Rows, columns, pitch and electrodes of the taxels.
    pub fn layout(&self) -> &SkinLayout {
        &self.layout
    }

    /// Centre of every taxel on the free surface, m, and the normal there, in row-major order.
    pub fn taxel_centres(&self) -> Vec<([f64; 3], [f64; 3])> {
        match &self.surface {
            Surface::Curved(field) => field.points().taxel_centres(),
            Surface::Flat(_) => {
                let flat = SurfacePoints::flat(&self.layout, 1);
                flat.map(|points| points.taxel_centres()).unwrap_or_default()
            }
        }
    }

    /// Its foam.
    pub fn foam(&self) -> &Foam {
        &self.foam
    }

    /// Sample points of a skin that is not flat.
    pub fn points(&self) -> Option<&SurfacePoints> {
        match &self.surface {
            Surface::Curved(field) => Some(field.points()),
            Surface::Flat(_) => None,
        }
    }

    /// Whether a place, m, lies in the foam, or beside it within half a thickness along the normal.
    ///
    /// Where a body is pushed there, `along` tells in which direction (length 1): the foam must be able to push it so.
    pub fn covers(&self, place_m: [f64; 3], along: Option<[f64; 3]>) -> bool {
        match &self.surface {
            Surface::Curved(field) => field.covers(place_m, along),
            Surface::Flat(_) => {
                let [x, y, z] = place_m;
                // what touches right on the rim is on the foam
                let half = |n: usize| (0.5 * n as f64 + 0.05) * self.layout.pitch_m();
                let within = (-1.5 * self.foam.thickness_m..=0.5 * self.foam.thickness_m).contains(&z);
                let up = along.is_none_or(|[_, _, z]| z > 0.2);
                x.abs() <= half(self.layout.cols()) && y.abs() <= half(self.layout.rows()) && within && up
            }
        }
    }

    /// Area of every taxel, m², in row-major order.
    pub fn taxel_areas_m2(&self) -> Vec<f64> {
        match &self.surface {
            Surface::Curved(field) => field.points().taxel_areas_m2().to_vec(),
            Surface::Flat(_) => vec![self.layout.pitch_m().powi(2); self.layout.taxels()],
        }
    }

    /// Mean pressure over every taxel's area, Pa.
    pub fn pressure(&self) -> &PressureMap {
        &self.pressure
    }

    /// Mean pressure over every taxel's electrode, Pa, as the transducer sees it. On a curved skin it is the mean over
    /// the taxel's area.
    pub fn electrode_pressure(&self) -> &PressureMap {
        match self.surface {
            Surface::Flat(_) => &self.electrode_pressure,
            Surface::Curved(_) => &self.pressure,
        }
    }

    /// The taxels that may have a pressure, in their order; all others have none.
    pub fn touched(&self) -> &[usize] {
        &self.touched
    }

    /// Area of the skin under pressure, m².
    pub fn touched_m2(&self) -> f64 {
        self.touched_m2
    }

    /// Whether a body has gone through the foam, down to the link. Its force then is that of solid polymer, which
    /// stands for the link, and the pressure is no measured one.
    pub fn bottomed(&self) -> bool {
        self.bottomed
    }

    /// Removes everything from the skin and places `bodies` on it, each with the mesh of its [`TouchBody`]. Writes the
    /// wrench on each body about its centre of mass into `wrenches`, in the same order. A body whose pose or velocity
    /// is not finite gets a wrench of NaN and presses nothing.
    pub fn touch(&mut self, bodies: &[(&TouchBody, PosedMesh<'_>)], wrenches: &mut Vec<Wrench>) {
        wrenches.clear();
        self.clear();
        match &mut self.surface {
            Surface::Flat(flat) => {
                let maps = [&mut self.pressure, &mut self.electrode_pressure];
                (self.touched_m2, self.bottomed) = flat.touch(bodies, wrenches, maps, &mut self.touched);
            }
            Surface::Curved(field) => {
                wrenches.extend(bodies.iter().map(|(body, posed)| field.press(&body.solid, posed)));
            }
        }
        self.finish();
    }

    /// Removes everything from the skin.
    fn clear(&mut self) {
        let electrodes = Some(&mut self.electrode_pressure).filter(|map| !map.values().is_empty());
        for map in electrodes.into_iter().chain([&mut self.pressure]) {
            self.touched.iter().for_each(|k| map.values_mut()[*k] = 0.0);
        }
        self.touched.clear();
        (self.touched_m2, self.bottomed) = (0.0, false);
        if let Surface::Curved(field) = &mut self.surface {
            field.clear();
        }
    }

    /// Brings what is known of the taxels up to date.
    fn finish(&mut self) {
        if let Surface::Curved(field) = &self.surface {
            field.add_means(self.pressure.values_mut());
            self.touched.extend(field.touched_taxels());
            (self.touched_m2, self.bottomed) = (field.touched_m2(), field.bottomed());
        }
        self.touched.sort_unstable();
        self.touched.dedup();
    }

    /// Removes everything from the skin and reads `loads`: what it feels of bodies that something else carries. The
    /// force of each spreads over the foam as it would at balance, under the body's own shape, so that the sum of
    /// pressure × area is the sum of the forces to 1e-9 of it. Loads that are not positive, or not finite, are passed
    /// over.
    pub fn read(&mut self, loads: &[Carried<'_>]) {
        self.clear();
        for (number, load) in loads.iter().enumerate() {
            let finite = load.posed.is_finite() && load.centre_m.iter().all(|v| v.is_finite());
            if !(finite && load.normal_n > 0.0 && load.normal_n < f64::INFINITY) {
                continue;
            }
            let centre = Vector::from(load.centre_m);
            let columns = &mut self.columns;
            self.surface.columns_under(number, load.body, &load.posed, load.lining_m, self.foam.thickness_m, columns);
            if let Some(along) = load.along {
                columns.retain_mut(|c| {
                    let share = c.normal.dot(Vector::from(along));
                    c.area_m2 *= share;
                    share > 0.05
                });
            }
            if columns.is_empty() {
                // it touches the rim
                columns.extend(self.surface.column_at(centre));
            }
            let away = |c: &Column| (c.point_m - centre).length_squared();
            let nearest = || columns.iter().min_by(|a, b| away(a).total_cmp(&away(b))).map(|c| c.normal);
            let Some(up) = load.along.map(Vector::from).or_else(nearest) else { continue };
            let u = up.any_orthonormal_vector();
            let v = up.cross(u);
            for c in columns.iter_mut() {
                c.across_m = [(c.point_m - centre).dot(u), (c.point_m - centre).dot(v)];
            }
            let law = self.foam.law(load.posed.stiffness_pa_per_m);
            self.balance.settle(&law, columns, load.normal_n);
            match &mut self.surface {
                Surface::Flat(flat) => {
                    self.bottomed |= columns.iter().any(|c| c.depth_m > self.foam.thickness_m);
                    let maps = [&mut self.pressure, &mut self.electrode_pressure];
                    // two bodies in one place count twice
                    self.touched_m2 += flat.carry(columns, &law, maps, &mut self.touched);
                }
                Surface::Curved(field) => field.carry(columns, &law),
            }
        }
        self.finish();
    }

    /// Springs that stand for the foam under a body for one step of `step_s`, with what it wears, `lining_m` thick.
    /// Adds them to `out`; they are about `posed`'s velocity, which is that at the end of the step as far as it is
    /// known.
    ///
    /// Returns the normal force, N, that the foam has at that velocity; `None` if the body is nowhere near.
    pub fn supports(
        &mut self,
        body: &TouchBody,
        posed: &PosedMesh<'_>,
        lining_m: f64,
        step_s: f64,
        out: &mut Vec<Support>,
    ) -> Option<f64> {
        let lag_s = step_s + self.foam.damping_s;
        // what may come into the foam in this step
        let speed = Vector::from(posed.velocity_m_per_s).length();
        let spin = Vector::from(posed.angular_velocity_rad_per_s).length() * body.solid.radius_m();
        let gap_m = (1.5 * lag_s * (speed + spin)).clamp(self.foam.thickness_m, 10.0);
        self.surface.columns_under(0, body, posed, lining_m, gap_m, &mut self.columns);
        if self.columns.is_empty() {
            return None;
        }
        let law = self.foam.law(posed.stiffness_pa_per_m);
        let near_m = MOST_M_PER_S2 * step_s * step_s;
        Some(support::of(&law, &self.columns, posed, lag_s, near_m, out))
    }
}

impl Surface {
    /// The columns under the body at place `number` of a list, and up to `gap_m` below it.
    fn columns_under(
        &mut self,
        number: usize,
        body: &TouchBody,
        posed: &PosedMesh<'_>,
        lining_m: f64,
        gap_m: f64,
        out: &mut Vec<Column>,
    ) {
        let gap_m = gap_m + lining_m;
        match self {
            Self::Flat(flat) => {
                flat.known.resize_with(flat.known.len().max(number + 1), KnownBody::default);
                flat.layer.swap_known(&mut flat.known[number]);
                flat.layer.expect(&body.mesh);
                flat.layer.columns_under(posed, &body.solid, gap_m, out);
                flat.layer.swap_known(&mut flat.known[number]);
            }
            Self::Curved(field) => field.columns_under(posed, &body.solid, gap_m, out),
        }
        out.iter_mut().for_each(|c| c.depth_m += lining_m);
    }

    /// The column nearest to a place, m.
    fn column_at(&mut self, place_m: Vector) -> Option<Column> {
        match self {
            Self::Flat(flat) => Some(flat.layer.column_at([place_m.x, place_m.y])),
            Self::Curved(field) => field.column_at(place_m),
        }
    }
}

impl FlatSkin {
    /// Adds the pressures of `columns` at their depths to `maps`, and their taxels to `taxels`. The area under
    /// pressure, m².
    fn carry(
        &mut self,
        columns: &[Column],
        law: &FoamLaw,
        maps: [&mut PressureMap; 2],
        taxels: &mut Vec<usize>,
    ) -> f64 {
        let mut touched = 0.0;
        for c in columns {
            let p = law.pressure_pa(c.depth_m);
            self.layer.pressure_pa[c.index] += c.share * p;
            touched += if p > 0.0 { c.share } else { 0.0 };
        }
        self.bins.add(&self.layer.pressure_pa, self.layer.patch, maps);
        taxels.extend(self.bins.taxels(self.layer.patch));
        touched * self.cell_area_m2
    }

    /// Adds the pressures under `bodies` to `maps`, and their taxels to `taxels`. The area under pressure, m², and
    /// whether a body has gone through.
    fn touch(
        &mut self,
        bodies: &[(&TouchBody, PosedMesh<'_>)],
        wrenches: &mut Vec<Wrench>,
        [pressure, electrode_pressure]: [&mut PressureMap; 2],
        taxels: &mut Vec<usize>,
    ) -> (f64, bool) {
        self.touches += 1;
        self.known.resize_with(bodies.len().max(self.known.len()), KnownBody::default);
        let (mut cells, mut bottomed) = (0.0, false);
        for ((body, posed), known) in bodies.iter().zip(&mut self.known) {
            if posed.is_finite() && body.solid.standing(posed).is_apart(self.bounds_m) {
                wrenches.push(Wrench::NONE);
                continue;
            }
            self.layer.swap_known(known);
            self.layer.expect(&body.mesh);
            wrenches.push(self.layer.respond_to(posed, Some(&body.solid)).wrench);
            let maps = [&mut *pressure, &mut *electrode_pressure];
            self.bins.add(&self.layer.pressure_pa, self.layer.patch, maps);
            taxels.extend(self.bins.taxels(self.layer.patch));
            cells += self.layer.pressed_cells(|index| {
                let last = std::mem::replace(&mut self.pressed[index], self.touches);
                last != self.touches
            });
            bottomed |= self.layer.bottomed;
            self.layer.swap_known(known);
        }
        (cells * self.cell_area_m2, bottomed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{cuboid, sphere};
    use crate::surface::Primitive;

    fn body(mesh: crate::mesh::TriMesh) -> TouchBody {
        TouchBody::from(PreparedMesh::from(mesh))
    }

    /// Two bodies that go up and down and sideways, on a skin that knows them and on a fresh one: the same bits.
    #[test]
    fn what_is_known_of_a_body_does_not_show() {
        let fresh = || TouchSkin::flat(SkinLayout::default(), Foam::default()).unwrap();
        let (ball, block) = (body(sphere(20e-3, 16, 32)), body(cuboid([30e-3, 30e-3, 10e-3])));
        let mut used = fresh();
        let steps = [(0.0, -1e-3), (0.0, -1.2e-3), (0.0, -1.2e-3), (2e-3, -1.2e-3), (2e-3, 1e-3), (2e-3, -2e-3)];
        for (k, (x_m, z_m)) in steps.into_iter().enumerate() {
            let mut bodies = vec![
                (&ball, PosedMesh::at_rest(&ball.mesh, [x_m, 0.0, z_m])),
                (&block, PosedMesh::at_rest(&block.mesh, [-40e-3, 0.0, 0.5 * z_m])),
            ];
            // the list in another order, and one body alone
            bodies.rotate_left(k / 4);
            bodies.truncate(2 - k / 5);
            let mut other = fresh();
            let (mut found, mut expected) = (Vec::new(), Vec::new());
            used.touch(&bodies, &mut found);
            other.touch(&bodies, &mut expected);
            assert_eq!(found, expected, "step {k}");
            assert_eq!(used.pressure(), other.pressure(), "step {k}");
            assert_eq!(used.electrode_pressure(), other.electrode_pressure(), "step {k}");
            assert_eq!(used.touched_m2().to_bits(), other.touched_m2().to_bits(), "step {k}");
        }
    }

    /// Where closed forms are said to end below a flat skin, in random poses, is on their surface by its own equation:
    /// of an ellipsoid Σ (x/a)² = 1, of a capsule the radius from its axis. A ball presses as its mesh does.
    #[test]
    fn closed_forms_end_on_their_surface() {
        use rand::RngExt as _;
        use spts_models::Streams;
        let mut layer = WinklerLayer::new(Foam::default(), &SkinLayout::default()).unwrap();
        let (mesh, mut rng, mut columns) = (sphere(20e-3, 64, 128), Streams::new(3).rng("poses", 0), Vec::new());
        let mut found = 0;
        for number in 0..400 {
            let [a, b, c, capsule_m, half_m] = [(); 5].map(|()| rng.random_range(12e-3..40e-3));
            let shape =
                if number % 2 == 0 { Primitive::Ellipsoid([a, b, c]) } else { Primitive::Capsule(capsule_m, half_m) };
            let [u, v, w]: [f64; 3] = [(); 3].map(|()| rng.random_range(-3.0..3.0));
            let ((su, cu), (sv, cv), (sw, cw)) = (u.sin_cos(), v.sin_cos(), w.sin_cos());
            let rotation = [
                [cu * cv, cu * sv * sw - su * cw, cu * sv * cw + su * sw],
                [su * cv, su * sv * sw + cu * cw, su * sv * cw - cu * sw],
                [-sv, cv * sw, cv * cw],
            ];
            let solid = Solid::of_parts(vec![Part { shape, rotation, position_m: [0.0; 3] }]);
            let [x, y] = [(); 2].map(|()| rng.random_range(-50e-3..50e-3));
            let pose = PosedMesh::at_rest(&mesh, [x, y, rng.random_range(5e-3..25e-3)]);
            layer.columns_under(&pose, &solid, 1e-3, &mut columns);
            found += columns.len();
            for c in columns.iter().filter(|c| c.depth_m < Foam::default().thickness_m) {
                let at = c.point_m - Vector::Z * c.depth_m - Vector::from(pose.position_m);
                let own = [0, 1, 2].map(|j| (0..3).map(|i| rotation[i][j] * at[i]).sum::<f64>());
                let off = match shape {
                    Primitive::Ellipsoid(half) => (0..3).map(|k| (own[k] / half[k]).powi(2)).sum::<f64>() - 1.0,
                    _ => {
                        let along = own[2] - own[2].clamp(-half_m, half_m);
                        (own[0] * own[0] + own[1] * own[1] + along * along).sqrt() / capsule_m - 1.0
                    }
                };
                // where the vertical line grazes the surface, the depth feels the root of the round-off
                assert!(off.abs() < 1e-7, "{shape:?}: {off}");
            }
        }
        assert!(found > 10_000, "{found}");
        let mut skin = TouchSkin::flat(SkinLayout::default(), Foam::default()).unwrap();
        let part = Part {
            shape: Primitive::Ellipsoid([20e-3; 3]),
            rotation: PosedMesh::at_rest(&mesh, [0.0; 3]).rotation,
            // the mesh stands on its origin
            position_m: [0.0, 0.0, 20e-3],
        };
        let both = [TouchBody::of_parts(PreparedMesh::from(mesh.clone()), vec![part]), body(mesh)];
        let forces = [&both[0], &both[1]].map(|body| {
            let mut wrenches = Vec::new();
            skin.touch(&[(body, PosedMesh::at_rest(&body.mesh, [3e-3, -20e-3, -1.5e-3]))], &mut wrenches);
            wrenches[0].force_n[2]
        });
        // along either direction the faces are inside the ball by 20 mm (1 − cos π/128) = 6 µm at most, together by
        // 0.8 % of the depth; the force goes with its square
        assert!(forces[0] > forces[1] && forces[0] < 1.02 * forces[1], "{forces:?}");
    }

    /// A block in one place twice presses twice as hard on the same area; beside itself, as hard on twice the area.
    #[test]
    fn area_under_two_bodies_counts_once() {
        let mut skin = TouchSkin::flat(SkinLayout::default(), Foam::default()).unwrap();
        let block = body(cuboid([30e-3, 30e-3, 10e-3]));
        let mut touched_m2 = |places: &[f64]| {
            let at = |x_m: &f64| (&block, PosedMesh::at_rest(&block.mesh, [*x_m, 0.0, -1e-3]));
            skin.touch(&places.iter().map(at).collect::<Vec<_>>(), &mut Vec::new());
            skin.touched_m2()
        };
        // whole cells of 2.5 mm
        assert!((touched_m2(&[0.0]) - 9e-4).abs() < 1e-12);
        assert!((touched_m2(&[0.0, 0.0]) - 9e-4).abs() < 1e-12);
        assert!((touched_m2(&[0.0, 15e-3]) - 13.5e-4).abs() < 1e-12);
        assert!((touched_m2(&[-30e-3, 30e-3]) - 18e-4).abs() < 1e-12);
        assert!(touched_m2(&[]) <= 0.0);
    }
}
