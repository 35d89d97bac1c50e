//! The simplest transducer.

use crate::check::in_interval;
use crate::layout::{ConductanceMap, PressureMap};
use crate::transducer::{Transducer, loaded_pa};
use serde::Deserialize;
use spts_input::Refusal;

/// Conductance proportional to pressure, without memory: G = k·P.
///
/// ```
/// use spts_models::{ConductanceMap, PressureMap, SkinLayout, Streams, build_transducer};
///
/// let parameters = toml::toml! { slope_s_per_pa = 2e-8 };
/// let mut linear = build_transducer("linear", parameters, &SkinLayout::default(), Streams::new(0))?;
/// let mut conductance = ConductanceMap::zeros(10, 10);
/// linear.step(&PressureMap::from_values(10, 10, vec![5e3; 100]), 0.0, &mut conductance);
/// assert!((conductance.values()[0] - 1e-4).abs() < 1e-15);
/// # Ok::<(), spts_input::Refusal>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, try_from = "LinearConfig")]
pub struct Linear {
    slope_s_per_pa: f64,
}

/// Parameters of [`Linear`].
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LinearConfig {
    /// k, S/Pa. Range (0, 1]. Default 1e-8: 0.4 V a taxel at 10 kPa with the default amplifier (4300 V/S), between the
    /// recorded responses of flat and of pointed objects.
    pub slope_s_per_pa: f64,
}

impl Default for LinearConfig {
    fn default() -> Self {
        Self { slope_s_per_pa: 1e-8 }
    }
}

impl TryFrom<LinearConfig> for Linear {
    type Error = Refusal;
    fn try_from(c: LinearConfig) -> Result<Self, Refusal> {
        in_interval("slope_s_per_pa", c.slope_s_per_pa, "(0, 1]")?;
        let slope_s_per_pa = c.slope_s_per_pa;
        Ok(Self { slope_s_per_pa })
    }
}

impl Transducer for Linear {
    fn step(&mut self, pressure: &PressureMap, _dt_s: f64, out: &mut ConductanceMap) {
        for (out, &p) in out.values_mut().iter_mut().zip(pressure.values()) {
            *out = self.slope_s_per_pa * loaded_pa(p);
        }
    }

    fn rest(&mut self, _dt_s: f64) {}

    fn start_session(&mut self, _session: u64) {}

    fn boxed(&self) -> Box<dyn Transducer> {
        Box::new(*self)
    }
}
