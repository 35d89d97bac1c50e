//! Cross-crate tests.
#[cfg(test)]
mod alignment;
#[cfg(test)]
mod any_skin;
#[cfg(test)]
mod anytime;
#[cfg(test)]
mod arm;
#[cfg(test)]
mod budget;
#[cfg(test)]
mod calibration;
#[cfg(test)]
mod circuit;
#[cfg(test)]
mod command;
#[cfg(test)]
mod contact_oracles;
#[cfg(test)]
mod dataset;
#[cfg(test)]
mod dataset_pictures;
#[cfg(test)]
mod dependencies;
#[cfg(test)]
mod design;
#[cfg(test)]
mod determinism;
#[cfg(test)]
mod docs;
#[cfg(test)]
mod dynamics;
#[cfg(test)]
mod evidence;
#[cfg(test)]
mod external;
#[cfg(test)]
mod extremes;
#[cfg(test)]
mod fidelity;
#[cfg(test)]
mod firmware;
#[cfg(test)]
mod firmware_command;
#[cfg(test)]
mod hostile;
#[cfg(test)]
mod in_time;
#[cfg(test)]
mod mujoco_contact;
#[cfg(test)]
mod mutations;
#[cfg(test)]
mod ngspice;
#[cfg(test)]
mod output;
#[cfg(test)]
mod place;
#[cfg(test)]
mod priors;
#[cfg(test)]
mod published;
#[cfg(test)]
mod readouts;
#[cfg(test)]
mod recordings;
#[cfg(test)]
mod reproduce;
#[cfg(test)]
mod rows;
#[cfg(test)]
mod score;
#[cfg(test)]
mod setup;
#[cfg(test)]
mod simulation_only;
#[cfg(test)]
mod style;
mod unseen;
#[cfg(test)]
mod weights;
