//! Answer of a contact field.

use crate::frame::Wrench;
use crate::patch::Patch;

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
