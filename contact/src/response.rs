//! Answer of a contact field.

use crate::frame::Wrench;
use crate::patch::Patch;

/// Answer of a contact field.
#[derive(Debug, Clone, Copy)]
pub struct Response<'a> {
    /// Wrench on the body; NaN if the field has no answer ([`ContactField::respond`](crate::ContactField::respond)).
    pub wrench: Wrench,
    /// Fine pressure field, Pa, shape `(rows · cells, cols · cells)`, row-major in the skin's row and column order.
    pub pressure_pa: &'a [f64],
    /// Cells outside which the pressure is 0, also after [`ContactField::refine`](crate::ContactField::refine). `None`
    /// if pressure may be anywhere.
    pub patch: Option<Patch>,
}
