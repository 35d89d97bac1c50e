//! The readout against closed forms and against what was put into it.

// `cfg(test)` marks the helpers as test code for the lints, too
#[cfg(test)]
mod ablation;
#[cfg(test)]
mod amplifier;
#[cfg(test)]
mod codes;
#[cfg(test)]
mod conformance;
#[cfg(test)]
mod dac;
#[cfg(test)]
mod designed;
#[cfg(test)]
mod effects;
#[cfg(test)]
mod extremes;
#[cfg(test)]
mod faults;
#[cfg(test)]
mod readout;
#[cfg(test)]
mod recording;
#[cfg(test)]
mod weights;
