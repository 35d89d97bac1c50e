//! The object on the skin: a force is asked for, a pressure is answered.

use crate::object::LiveObject;
use crate::settings::Press;
use spts::Refusal;
use spts_contact::{ContactField, EquilibriumError, Holder, Load, PosedMesh, TaxelBins, build_contact};
use spts_models::{PressureMap, SkinLayout};

/// Time in which the force follows what is asked for, s.
const FOLLOW_S: f64 = 0.05;
/// A force below this is none, N.
const NO_FORCE_N: f64 = 0.01;
/// Share of the largest force that an object is pressed with where it carries no more.
const NEARLY: f64 = 0.95;

/// The skin and an object that is pressed onto it.
pub(crate) struct Presser {
    field: Box<dyn ContactField>,
    bins: TaxelBins,
    object: LiveObject,
    degrees: f64,
    force_n: f64,
    pressure: PressureMap,
    electrode_pressure: PressureMap,
    note: Option<String>,
}

impl Presser {
    pub(crate) fn new(skin: &SkinLayout, object: LiveObject) -> Result<Self, Refusal> {
        let field = build_contact("footprint", toml::Table::new(), skin)?;
        let zeros = || PressureMap::zeros(skin.rows(), skin.cols());
        let mut presser = Self {
            bins: TaxelBins::new(skin, field.cells_per_taxel()),
            field,
            degrees: object.degrees,
            object,
            force_n: 0.0,
            pressure: zeros(),
            electrode_pressure: zeros(),
            note: None,
        };
        presser.field.expect(&presser.object.mesh);
        Ok(presser)
    }

    /// Takes `object` in place of the one before.
    pub(crate) fn take(&mut self, object: LiveObject) {
        self.field.expect(&object.mesh);
        self.degrees = object.degrees;
        self.object = object;
    }

    pub(crate) fn object(&self) -> &LiveObject {
        &self.object
    }

    pub(crate) fn turn(&mut self, degrees: f64) -> Result<(), Refusal> {
        spts_models::within("degrees", degrees, -360.0, 360.0, "[−360, 360]")?;
        self.degrees = degrees;
        Ok(())
    }

    /// Presses for `dt_s`; the force follows what is asked for.
    pub(crate) fn step(&mut self, asked: &Press, dt_s: f64) {
        self.force_n += (asked.force_n - self.force_n) * -(-dt_s / FOLLOW_S).exp_m1();
        if asked.force_n < NO_FORCE_N && self.force_n < NO_FORCE_N {
            self.force_n = 0.0;
        }
        self.note = None;
        let mut carried = Ok(());
        if self.force_n > 0.0 {
            carried = self.carry(asked.at_m, self.force_n);
            if let Err(EquilibriumError::Force { reached_n, .. }) = carried
                && NEARLY * reached_n > NO_FORCE_N
            {
                self.force_n = NEARLY * reached_n;
                self.note = Some(format!(
                    "more than {reached_n:.0} N cannot be pressed here: too little of the object is over the skin"
                ));
                carried = self.carry(asked.at_m, self.force_n);
            }
        }
        if carried.is_err() || self.force_n <= 0.0 {
            self.pressure.values_mut().fill(0.0);
            self.electrode_pressure.values_mut().fill(0.0);
        }
        if let Err(error) = carried {
            self.force_n = 0.0;
            self.note = Some(error.to_string());
        }
    }

    fn carry(&mut self, [x_m, y_m]: [f64; 2], force_n: f64) -> Result<(), EquilibriumError> {
        let (sin, cos) = self.degrees.to_radians().sin_cos();
        let body = PosedMesh {
            rotation: [[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]],
            stiffness_pa_per_m: self.object.stiffness_pa_per_m,
            ..PosedMesh::at_rest(&self.object.mesh, [x_m, y_m, 0.0])
        };
        let load = Load { force_n, axis_m: [x_m, y_m], holder: Holder::Rigid, from: None };
        // the field is one that balances a load
        let Some(field) = self.field.quasi_static() else {
            return Err(EquilibriumError::load(force_n));
        };
        let response = field.carry(&body, &load)?.response;
        [self.pressure, self.electrode_pressure] = self.bins.means(response.pressure_pa, response.patch);
        Ok(())
    }

    /// Force on the object, N.
    pub(crate) fn force_n(&self) -> f64 {
        self.force_n
    }

    /// Mean pressure over every taxel's area, Pa.
    pub(crate) fn pressure(&self) -> &PressureMap {
        &self.pressure
    }

    /// Mean pressure over every taxel's electrode, Pa.
    pub(crate) fn electrode_pressure(&self) -> &PressureMap {
        &self.electrode_pressure
    }

    /// Why the object is not pressed as asked.
    pub(crate) fn note(&self) -> Option<&str> {
        self.note.as_deref()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use spts_contact::objects::OBJECTS;

    fn pressed(name: &str, asked: Press, steps: usize) -> Presser {
        let mut presser = Presser::new(&SkinLayout::default(), LiveObject::named(name).unwrap()).unwrap();
        (0..steps).for_each(|_| presser.step(&asked, 0.025));
        presser
    }

    /// Every object carries the force that is asked for, and the taxels carry it too. What lies beside the skin carries
    /// none: the plates and the ball are smaller than the skin.
    #[test]
    fn the_taxels_carry_the_force() {
        let skin = SkinLayout::default();
        for spec in OBJECTS {
            let press = Press::new(&skin, 0.0, 0.0, 30.0).unwrap();
            let presser = pressed(spec.name, press, 40);
            let carried = presser.pressure().sum() * skin.cell_area_m2();
            // after 40 steps of half the time in which the force follows, e⁻²⁰ of it is missing
            assert!((carried - 30.0).abs() < 1e-6 * 30.0, "{}: {carried} N", spec.name);
            assert!(presser.note().is_none(), "{}: {:?}", spec.name, presser.note());
        }
    }

    #[test]
    fn a_lifted_object_presses_nothing() {
        let skin = SkinLayout::default();
        let mut presser = pressed("T", Press::new(&skin, 10.0, -10.0, 20.0).unwrap(), 10);
        assert!(presser.electrode_pressure().max() > 1e3);
        (0..40).for_each(|_| presser.step(&Press::default(), 0.025));
        assert!(presser.force_n() <= 0.0 && presser.electrode_pressure().max() <= 0.0);
    }

    /// At the corner a ball of 33 mm is over the skin with a quarter of itself; the largest force is found there too.
    #[test]
    fn the_corner_and_the_largest_force_have_an_answer() {
        let skin = SkinLayout::default();
        for name in ["tennis", "T", "comb", "finger"] {
            for at in [-75.0, 75.0] {
                let presser = pressed(name, Press::new(&skin, at, at, 200.0).unwrap(), 40);
                assert!(presser.pressure().values().iter().all(|p| p.is_finite()), "{name}");
                let carried = presser.pressure().sum() * skin.cell_area_m2();
                assert!((carried - presser.force_n()).abs() < 1e-6 * 200.0, "{name}: {carried} N");
            }
        }
    }
}
