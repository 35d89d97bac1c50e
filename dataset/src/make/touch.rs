//! What touches the skin: random values of an object in a press; objects at rest under a force, each an equilibrium
//! without time steps; and contacts that are followed in time.

use crate::spec::{Choice, Draw, PoseOrigin, Spec};
use spts::Refusal;
use spts_contact::objects::Placement;
use spts_contact::{ContactField, EquilibriumError, Frame, Holder, Load, Patch, PosedMesh, TaxelBins, build_contact};
use spts_models::{PressureMap, SkinLayout, Streams};

/// Poses that are drawn for one object before the row is given up.
pub(super) const ATTEMPTS: u64 = 32;

/// Where an object lies or a ball falls, and how hard.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Touch {
    /// Position of the object's origin relative to the middle of the sheet, m.
    pub(crate) position_m: [f64; 2],
    pub(crate) rotation_deg: f64,
    pub(crate) tilt_deg: [f64; 2],
    /// Normal force, N: at the plateau if it varies; 0 for a drop.
    pub(crate) force_n: f64,
    /// Stiffness of the object's own surface, Pa/m; infinite for a rigid one.
    pub(crate) stiffness_pa_per_m: f64,
    /// Number of poses tried before this one.
    pub(crate) refused: u64,
    pub(crate) over_edge: bool,
    pub(crate) ball: Option<Ball>,
}

/// A ball that falls.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Ball {
    /// Height of the lowest point at release, m.
    pub(crate) height_m: f64,
    pub(crate) mass_kg: f64,
    pub(crate) radius_m: f64,
    /// Speed at the touch, m/s.
    pub(crate) speed_m_per_s: f64,
}

impl Touch {
    /// That of frames, which do not say where and how hard something was pressed.
    pub(super) const UNKNOWN: Self = Self {
        position_m: [f64::NAN; 2],
        rotation_deg: f64::NAN,
        tilt_deg: [f64::NAN; 2],
        force_n: f64::NAN,
        stiffness_pa_per_m: f64::NAN,
        refused: 0,
        over_edge: false,
        ball: None,
    };

    /// What is drawn from `streams` for press number `press` of `choice`.
    pub(super) fn draw(spec: &Spec, choice: &Choice, streams: Streams, press: u64) -> Self {
        let config = spec.config();
        let (pose, skin) = (&config.pose, spec.skin());
        let draw = |draw: &Draw, label: &str| draw.value(streams, label, press);
        let [width_m, height_m] = skin.extent_m();
        let mut touch = Self {
            position_m: [
                width_m * draw(&pose.x_share, "pose.x_share") + draw(&pose.x_m, "pose.x_m"),
                height_m * draw(&pose.y_share, "pose.y_share") + draw(&pose.y_m, "pose.y_m"),
            ],
            rotation_deg: draw(&pose.rotation_deg, "pose.rotation_deg"),
            tilt_deg: [draw(&pose.tilt_x_deg, "pose.tilt_x_deg"), draw(&pose.tilt_y_deg, "pose.tilt_y_deg")],
            force_n: draw(&config.press.force_n, "press.force_n"),
            stiffness_pa_per_m: f64::INFINITY,
            refused: 0,
            over_edge: false,
            ball: None,
        };
        if let (PoseOrigin::Placement, Some(object)) = (pose.about, choice.object) {
            // fitted on the published skin, and as far in metres from the middle of any other
            let place = object.placement;
            let fitted_m = SkinLayout::default().position_m(place.row, place.col);
            touch.position_m = [0, 1].map(|k| touch.position_m[k] + fitted_m[k]);
            touch.rotation_deg += place.rotation_rad.to_degrees();
            let [tilt_x_deg, tilt_y_deg] = touch.tilt_deg;
            touch.tilt_deg = [tilt_x_deg + place.tilt_x_rad.to_degrees(), tilt_y_deg + place.tilt_y_rad.to_degrees()];
        }
        if spec.drops() {
            let drop = config.drop.clone().unwrap_or_default();
            touch.force_n = 0.0;
            touch.stiffness_pa_per_m = draw(&drop.stiffness_pa_per_m, "drop.stiffness_pa_per_m");
            touch.ball = Some(Ball {
                height_m: draw(&drop.height_m, "drop.height_m"),
                mass_kg: draw(&drop.mass_kg, "drop.mass_kg"),
                radius_m: draw(&drop.radius_m, "drop.radius_m"),
                speed_m_per_s: 0.0,
            });
            return touch;
        }
        let own = match (&config.press.stiffness_pa_per_m, choice.object) {
            (_, Some(object)) => object.stiffness_pa_per_m,
            (own, None) => own.as_ref().map(|k| draw(k, "press.stiffness_pa_per_m")),
        };
        touch.stiffness_pa_per_m = own.unwrap_or(f64::INFINITY);
        touch.over_edge = over_edge(&touch.body(choice), skin);
        touch
    }

    /// The object as it is held, its origin at the height of the skin.
    pub(super) fn body<'a>(&self, choice: &'a Choice) -> PosedMesh<'a> {
        let [tilt_x_deg, tilt_y_deg] = self.tilt_deg;
        let placement = Placement {
            row: 0.0,
            col: 0.0,
            rotation_rad: self.rotation_deg.to_radians(),
            tilt_x_rad: tilt_x_deg.to_radians(),
            tilt_y_rad: tilt_y_deg.to_radians(),
        };
        let [x, y] = self.position_m;
        PosedMesh {
            rotation: placement.matrix(),
            stiffness_pa_per_m: self.stiffness_pa_per_m,
            ..PosedMesh::at_rest(&choice.mesh, [x, y, 0.0])
        }
    }
}

/// The streams of attempt number `attempt` at a pose.
pub(super) fn of_attempt(streams: Streams, attempt: u64) -> Streams {
    if attempt == 0 { streams } else { streams.child("attempt", attempt) }
}

/// Whether a part of `body` lies beside the sheet.
fn over_edge(body: &PosedMesh<'_>, skin: &SkinLayout) -> bool {
    let half_m = skin.extent_m().map(|side| 0.5 * side);
    let beside = |v: &[f64; 3], k: usize| {
        let [a, b, c] = body.rotation[k];
        (a * v[0] + b * v[1] + c * v[2] + body.position_m[k]).abs() > half_m[k]
    };
    body.mesh.vertices.iter().any(|v| beside(v, 0) || beside(v, 1))
}

/// A contact field that keeps what it has prepared for one mesh.
pub(super) struct Field {
    field: Box<dyn ContactField>,
    bins: TaxelBins,
}

/// One object in balance, and what the skin feels of it.
pub(super) struct Held {
    pub(super) touch: Touch,
    /// Height of the object's origin above the skin's free surface, m.
    pub(super) height_m: f64,
    pub(super) pressure: PressureMap,
    pub(super) electrode_pressure: PressureMap,
    patch: Patch,
}

impl Field {
    /// The field of `spec` for `choice`.
    pub(super) fn new(spec: &Spec, choice: &Choice) -> Result<Self, Refusal> {
        let (model, parameters) = spec.contact();
        let mut field = build_contact(model, parameters.clone(), spec.skin())?;
        field.expect(&choice.mesh);
        Ok(Self { bins: TaxelBins::new(spec.skin(), field.cells_per_taxel()), field })
    }

    /// Presses `choice` in press number `press`, beside the `others`: poses are drawn until one is a balance and keeps
    /// clear of them. `None` when none keeps clear.
    pub(super) fn press(
        &mut self,
        spec: &Spec,
        choice: &Choice,
        streams: Streams,
        press: u64,
        others: &[Held],
    ) -> Result<Option<Held>, Refusal> {
        let mut failure = None;
        for attempt in 0..ATTEMPTS {
            let mut touch = Touch::draw(spec, choice, of_attempt(streams, attempt), press);
            touch.refused = attempt;
            match self.balance(spec, choice, touch) {
                Ok(held) if others.iter().all(|other| apart(&other.patch, &held.patch)) => return Ok(Some(held)),
                Ok(_) => failure = None,
                Err(error) => failure = Some(error),
            }
        }
        match failure {
            Some(last) => {
                Err(Refusal::new(format!("`pose`: none of {ATTEMPTS} poses has an equilibrium; the last: {last}")))
            }
            None => Ok(None),
        }
    }

    fn balance(&mut self, spec: &Spec, choice: &Choice, touch: Touch) -> Result<Held, EquilibriumError> {
        let stiffness = spec.config().press.tilt_stiffness_nm_per_rad;
        let load = Load {
            force_n: touch.force_n,
            axis_m: touch.position_m,
            holder: Holder::Elastic { stiffness_nm_per_rad: [[stiffness, 0.0], [0.0, stiffness]], rest_rad: [0.0; 2] },
            from: None,
        };
        let Some(field) = self.field.quasi_static() else {
            unreachable!("a spec that is not followed in time has a field that finds balances");
        };
        let balance = field.carry(&touch.body(choice), &load)?;
        let patch = balance.response.patch.unwrap_or_default();
        let height_m = balance.seat.height_m;
        let [pressure, electrode_pressure] = self.bins.means(balance.response.pressure_pa, balance.response.patch);
        Ok(Held { touch, height_m, pressure, electrode_pressure, patch })
    }
}

/// The sum of the maps of all objects.
pub(super) fn sum(spec: &Spec, held: &[Held], of: fn(&Held) -> &PressureMap) -> PressureMap {
    let mut total = PressureMap::zeros(spec.skin().rows(), spec.skin().cols());
    for object in held {
        for (total, p) in total.values_mut().iter_mut().zip(of(object).values()) {
            *total += p;
        }
    }
    total
}

/// Whether two patches have no cell in common.
fn apart(a: &Patch, b: &Patch) -> bool {
    let along = |a: [usize; 2], b: [usize; 2]| a[1] <= b[0] || b[1] <= a[0];
    along(a.rows, b.rows) || along(a.cols, b.cols)
}

/// One object or ball over time.
pub(super) struct Moving {
    pub(super) touch: Touch,
    /// Frames in order of time, which counts from the start of the simulation.
    pub(super) frames: Vec<Frame>,
    /// Time of the touch, s.
    pub(super) touch_s: f64,
}

impl Moving {
    /// Mean pressure over every taxel's cell at `time_s`, Pa, and the height of the object's origin, m; between two
    /// frames on a straight line, as the conductance is.
    pub(super) fn at(&self, time_s: f64) -> (PressureMap, f64) {
        let after = self.frames.partition_point(|frame| frame.time_s <= time_s);
        let first = &self.frames[after.saturating_sub(1)];
        let second = &self.frames[after.min(self.frames.len() - 1)];
        let apart_s = second.time_s - first.time_s;
        let share = if apart_s > 0.0 { ((time_s - first.time_s) / apart_s).clamp(0.0, 1.0) } else { 0.0 };
        let mut pressure = first.pressure.clone();
        for (from, to) in pressure.values_mut().iter_mut().zip(second.pressure.values()) {
            *from += share * (to - *from);
        }
        let [from_m, to_m] = [first, second].map(|frame| frame.pose.position_m[2]);
        (pressure, from_m + share * (to_m - from_m))
    }
}
