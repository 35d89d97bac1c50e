//! The summing amplifier, modelled from its parts: its step response, its noise, and how it scales with the number of
//! taxels.
//!
//! Every taxel k is a conductance Gk between its own drive Vk and the bus, the inverting input of an operational
//! amplifier with Rf ∥ Cf from output to bus and Cb from bus to ground. With v the bus, o the output, S = ΣGk and I =
//! ΣGk·Vk,
//!
//! (Cb + Cf) v′ = Cf o′ − (S + 1/Rf) v + o/Rf + I,  o′ = ωt (Vos − v) − ωp o,  |o′| ≤ slew rate, |o| ≤ rail,
//!
//! where ωt = 2π·GBW and ωp = ωt/A0. [`Transient`] solves these equations. [`AmplifierResponse`] and [`AmplifierNoise`]
//! are the small-signal properties in closed form. [`Budget`] compares them with a skin, a converter and a clock, and
//! [`Remedy`] lists what larger skins need.
//!
//! ```
//! use spts_circuit::amplifier::{Amplifier, BusLoad, Network, OpAmp, AmplifierResponse, Transient};
//!
//! let amplifier = Amplifier::new(OpAmp::default(), Network::default())?;
//! // a hundred taxels of 20 µS between them and 3 V on one: −1 kΩ · 20 µS · 3 V
//! let load = BusLoad { conductance_s: 100.0 * 20e-6, current_a: 20e-6 * 3.0 };
//! let mut transient = Transient::new(amplifier);
//! transient.advance(load, 10e-6);
//! assert!((transient.output_v() + 0.06).abs() < 1e-6);
//! assert!((AmplifierResponse::new(&amplifier, load.conductance_s).noise_gain() - 3.0).abs() < 1e-12);
//! # Ok::<(), spts_input::Refusal>(())
//! ```

mod budget;
mod motion;
mod parts;
mod response;
mod transient;

pub use budget::{Budget, Limit, Remedied, Remedy, Setting, Skin, fewest_wires, remedied};
pub use parts::{Amplifier, BusLoad, Network, OpAmp};
pub use response::{AmplifierNoise, AmplifierResponse};
pub use transient::Transient;
