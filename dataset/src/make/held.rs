//! Objects at rest on the skin under a force: each is an equilibrium, without time steps.

use super::error::RowCause;
use super::touch::{ATTEMPTS, Touch, of_attempt};
use crate::spec::{Choice, Spec, SpecError};
use spts_contact::{ContactField, EquilibriumError, Holder, Load, Patch, TaxelBins, build_contact};
use spts_models::{PressureMap, Streams};

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
    pub(super) fn new(spec: &Spec, choice: &Choice) -> Result<Self, RowCause> {
        let (model, parameters) = spec.contact();
        let mut field = build_contact(model, parameters.clone(), spec.skin()).map_err(SpecError::from)?;
        field.expect(&choice.mesh);
        Ok(Self {
            bins: TaxelBins::new(spec.skin(), field.cells_per_taxel()),
            field,
        })
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
    ) -> Result<Option<Held>, RowCause> {
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
            Some(source) => Err(RowCause::Balance {
                attempts: ATTEMPTS,
                source,
            }),
            None => Ok(None),
        }
    }

    fn balance(&mut self, spec: &Spec, choice: &Choice, touch: Touch) -> Result<Held, EquilibriumError> {
        let stiffness = spec.config().press.tilt_stiffness_nm_per_rad;
        let load = Load {
            force_n: touch.force_n,
            axis_m: touch.position_m,
            holder: Holder::Elastic {
                stiffness_nm_per_rad: [[stiffness, 0.0], [0.0, stiffness]],
                rest_rad: [0.0; 2],
            },
            from: None,
        };
        let Some(field) = self.field.quasi_static() else {
            unreachable!("a spec that is not followed in time has a field that finds balances");
        };
        let balance = field.carry(&touch.body(choice), &load)?;
        let patch = balance.response.patch.unwrap_or_default();
        let height_m = balance.seat.height_m;
        let [pressure, electrode_pressure] = self.bins.means(balance.response.pressure_pa, balance.response.patch);
        Ok(Held {
            touch,
            height_m,
            pressure,
            electrode_pressure,
            patch,
        })
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
