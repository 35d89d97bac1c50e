//! The readout against closed forms and against what was put into it.

// `cfg(test)` marks the helpers as test code for the lints, too
#[cfg(test)]
mod algebra;
#[cfg(test)]
mod dac;
#[cfg(test)]
mod effects;
#[cfg(test)]
mod faults;
#[cfg(test)]
mod readout;
#[cfg(test)]
mod weights;
