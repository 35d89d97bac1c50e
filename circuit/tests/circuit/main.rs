//! The readout against closed forms and against what was put into it.

mod algebra;
mod effects;
mod readout;
mod weights;
