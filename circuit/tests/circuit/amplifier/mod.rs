//! The amplifier: helpers here, and a file for what it does over time, its response, its noise and its limits.

mod limits;
mod noise;
mod response;
mod transient;

use spts_circuit::amplifier::{Amplifier, BusLoad, Network, OpAmp};

fn amplifier(network: Network) -> Amplifier {
    Amplifier::new(OpAmp::default(), network).unwrap()
}

/// No 1/f noise.
fn white(network: Network) -> Amplifier {
    let op_amp = OpAmp {
        noise_corner_hz: 0.0,
        ..OpAmp::default()
    };
    Amplifier::new(op_amp, network).unwrap()
}

/// No slewing, no rails.
fn small_signal(network: Network) -> Amplifier {
    let op_amp = OpAmp {
        slew_v_per_s: 1e15,
        rail_v: 1e6,
        ..OpAmp::default()
    };
    Amplifier::new(op_amp, network).unwrap()
}

fn network(bus_f: f64, feedback_f: f64) -> Network {
    Network {
        bus_f,
        feedback_f,
        ..Network::default()
    }
}

fn load(conductance_s: f64, current_a: f64) -> BusLoad {
    BusLoad {
        conductance_s,
        current_a,
    }
}
