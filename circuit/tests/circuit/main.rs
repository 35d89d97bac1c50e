//! The readout against closed forms and against what was put into it.

// `cfg(test)` marks the helpers as test code for the lints, too
#[cfg(test)]
mod amplifier;
#[cfg(test)]
mod codes;
#[cfg(test)]
mod effects;
#[cfg(test)]
mod faults;
#[cfg(test)]
mod readout;
#[cfg(test)]
mod weights;
