//! One object on the skin.

use super::error::RowCause;
use crate::spec::{Choice, PoseOrigin, Spec};
use spts_contact::objects::Placement;
use spts_contact::{ContactField, EquilibriumError, Holder, Load, Patch, PosedMesh, TaxelBins, build_contact};
use spts_models::{PressureMap, SkinLayout, Streams};

/// Poses that are drawn for one object before the row is given up.
const ATTEMPTS: u64 = 32;

/// A shape with the contact field that presses it: the field keeps what it has prepared for the mesh.
pub(crate) struct Prepared {
    pub(crate) number: u64,
    pub(crate) choice: Choice,
    field: Box<dyn ContactField>,
    bins: TaxelBins,
}

/// Where an object lies, how hard it is pressed, and what the skin feels of it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Touch {
    /// Place of the object's origin from the middle of the sheet, m.
    pub(crate) position_m: [f64; 2],
    pub(crate) rotation_deg: f64,
    pub(crate) tilt_deg: [f64; 2],
    pub(crate) force_n: f64,
    /// Depth of the object's origin below the height at which it would touch, m.
    pub(crate) height_m: f64,
    /// Poses that were drawn before this one.
    pub(crate) refused: u64,
    pub(crate) over_edge: bool,
    pub(crate) pressure: PressureMap,
    pub(crate) electrode_pressure: PressureMap,
    pub(crate) patch: Patch,
}

impl Prepared {
    pub(crate) fn new(spec: &Spec, number: u64) -> Result<Self, RowCause> {
        let (model, parameters) = spec.contact();
        let field = build_contact(model, parameters.clone(), spec.skin()).map_err(crate::spec::SpecError::from)?;
        Ok(Self {
            number,
            choice: spec.choices().shape(spec.streams(), number)?,
            bins: TaxelBins::new(spec.skin(), field.cells_per_taxel()),
            field,
        })
    }

    /// Presses it for press number `press`, beside the `others`: poses are drawn until one is a balance and keeps clear
    /// of them. `None` when none keeps clear.
    pub(crate) fn press(
        &mut self,
        spec: &Spec,
        streams: Streams,
        press: u64,
        others: &[Touch],
    ) -> Result<Option<Touch>, RowCause> {
        let mut failure = None;
        for attempt in 0..ATTEMPTS {
            let drawn = if attempt == 0 {
                streams
            } else {
                streams.child("attempt", attempt)
            };
            match self.attempt(spec, drawn, press) {
                Ok(touch) if others.iter().all(|other| apart(&other.patch, &touch.patch)) => {
                    return Ok(Some(Touch {
                        refused: attempt,
                        ..touch
                    }));
                }
                Ok(_) => failure = None,
                Err(error) => failure = Some(error),
            }
        }
        match failure {
            Some(source) => Err(RowCause::Balance {
                attempts: ATTEMPTS,
                source,
            }),
            None => Ok(None),
        }
    }

    fn attempt(&mut self, spec: &Spec, streams: Streams, press: u64) -> Result<Touch, EquilibriumError> {
        let config = spec.config();
        let (pose, skin) = (&config.pose, spec.skin());
        let draw = |draw: &crate::spec::Draw, label: &str| draw.value(streams, label, press);
        let [width_m, height_m] = skin.extent_m();
        let mut position_m = [
            width_m * draw(&pose.x_share, "pose.x_share") + draw(&pose.x_m, "pose.x_m"),
            height_m * draw(&pose.y_share, "pose.y_share") + draw(&pose.y_m, "pose.y_m"),
        ];
        let mut rotation_deg = draw(&pose.rotation_deg, "pose.rotation_deg");
        let mut tilt_deg = [
            draw(&pose.tilt_x_deg, "pose.tilt_x_deg"),
            draw(&pose.tilt_y_deg, "pose.tilt_y_deg"),
        ];
        if let (PoseOrigin::Placement, Some(object)) = (pose.about, self.choice.object) {
            // fitted on the published skin, and as far in metres from the middle of any other
            let place = object.placement;
            let fitted_m = SkinLayout::default().position_m(place.row, place.col);
            position_m = [0, 1].map(|k| position_m[k] + fitted_m[k]);
            rotation_deg += place.rotation_rad.to_degrees();
            tilt_deg = [
                tilt_deg[0] + place.tilt_x_rad.to_degrees(),
                tilt_deg[1] + place.tilt_y_rad.to_degrees(),
            ];
        }
        let placement = Placement {
            row: 0.0,
            col: 0.0,
            rotation_rad: rotation_deg.to_radians(),
            tilt_x_rad: tilt_deg[0].to_radians(),
            tilt_y_rad: tilt_deg[1].to_radians(),
        };
        let own = config
            .press
            .stiffness_pa_per_m
            .as_ref()
            .map(|k| draw(k, "press.stiffness_pa_per_m"));
        let mesh = &self.choice.mesh;
        let body = PosedMesh {
            rotation: placement.matrix(),
            stiffness_pa_per_m: match self.choice.object {
                Some(object) => object.stiffness_pa_per_m,
                None => own,
            }
            .unwrap_or(f64::INFINITY),
            ..PosedMesh::at_rest(mesh, [position_m[0], position_m[1], 0.0])
        };
        let stiffness = config.press.tilt_stiffness_nm_per_rad;
        let force_n = draw(&config.press.force_n, "press.force_n");
        let load = Load {
            force_n,
            axis_m: position_m,
            holder: Holder::Elastic {
                stiffness_nm_per_rad: [[stiffness, 0.0], [0.0, stiffness]],
                rest_rad: [0.0; 2],
            },
            from: None,
        };
        let over_edge = over_edge(&body, skin);
        let Some(field) = self.field.quasi_static() else {
            return Err(EquilibriumError::Beside { depth_m: 0.0 });
        };
        let balance = field.carry(&body, &load)?;
        let patch = balance.response.patch.unwrap_or_default();
        let height_m = balance.seat.height_m;
        let [pressure, electrode_pressure] = self.bins.means(balance.response.pressure_pa, balance.response.patch);
        Ok(Touch {
            position_m,
            rotation_deg,
            tilt_deg,
            force_n,
            height_m,
            refused: 0,
            over_edge,
            pressure,
            electrode_pressure,
            patch,
        })
    }
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

/// Whether two patches have no cell in common.
fn apart(a: &Patch, b: &Patch) -> bool {
    let along = |a: [usize; 2], b: [usize; 2]| a[1] <= b[0] || b[1] <= a[0];
    along(a.rows, b.rows) || along(a.cols, b.cols)
}
