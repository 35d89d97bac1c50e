//! The summing amplifier as a netlist.

use spts_circuit::amplifier::Amplifier;
use std::f64::consts::TAU;
use std::fmt::Write as _;

/// Boltzmann's constant, J/K.
const BOLTZMANN_J_PER_K: f64 = 1.380_649e-23;
/// Transconductance of the operational amplifier's first stage, S; any value does.
const STAGE_S: f64 = 1e-3;
/// Rise time of every edge, s: short beside all time constants, and the simulator steps over it.
pub(crate) const RISE_S: f64 = 1e-10;

/// A taxel's drive.
pub(crate) struct Drive {
    pub(crate) conductance_s: f64,
    /// Times of the edges, s, and the volts from there on; the first is the operating point.
    pub(crate) edges: Vec<(f64, f64)>,
}

/// Which limits the operational amplifier has.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Limits {
    /// None: linear.
    None,
    /// Slew rate and rails.
    All,
}

/// The circuit of the model's equations, element by element, with `control` as its commands. Nodes: d0, d1, …, sum, p,
/// x, out.
pub(crate) fn netlist(amplifier: &Amplifier, drives: &[Drive], limits: Limits, options: &str, control: &str) -> String {
    let (op_amp, network) = (amplifier.op_amp(), amplifier.network());
    let mut text = format!("* summing amplifier\n.options temp={} {options}\n", network.temperature_k - 273.15);
    for (k, drive) in drives.iter().enumerate() {
        source(&mut text, k, drive);
        line(&mut text, format_args!("Rt{k} d{k} sum {:e}", 1.0 / drive.conductance_s));
    }
    if network.bus_f > 0.0 {
        line(&mut text, format_args!("Cb sum 0 {:e}", network.bus_f));
    }
    if network.feedback_f > 0.0 {
        line(&mut text, format_args!("Cf sum out {:e}", network.feedback_f));
    }
    line(&mut text, format_args!("Rf sum out {:e}", network.feedback_ohm));
    // en and in as thermal noise of resistors: en² = 4kT·R, in² = 4kT/R
    let thermal = 4.0 * BOLTZMANN_J_PER_K * network.temperature_k;
    line(&mut text, format_args!("Rn nn 0 {:e}", op_amp.noise_v_per_rthz.powi(2) / thermal));
    line(
        &mut text,
        format_args!("Rni ni 0 {:e}\nVni ni 0 0\nFni sum 0 Vni 1", thermal / op_amp.noise_a_per_rthz.powi(2)),
    );
    line(&mut text, format_args!("Vofs pa 0 dc {:e}\nEofs p pa nn 0 1", network.offset_v));
    let unity = TAU * op_amp.gain_bandwidth_hz;
    let (stage_ohm, stage_f) = (op_amp.dc_gain / STAGE_S, STAGE_S / unity);
    line(&mut text, format_args!("Cp x 0 {stage_f:e}\nEout out 0 x 0 1"));
    match limits {
        Limits::None => line(&mut text, format_args!("Gop 0 x p sum {STAGE_S:e}\nRp x 0 {stage_ohm:e} noisy=0")),
        Limits::All => {
            let most_a = op_amp.slew_v_per_s * stage_f;
            let rail_v = op_amp.rail_v;
            line(
                &mut text,
                format_args!(
                    "Bop 0 x I = max(-{most_a:e}, min({most_a:e}, {STAGE_S:e}*(V(p)-V(sum)) - V(x)/{stage_ohm:e}))\n\
                     Brail x 0 I = max(0, V(x)-{rail_v:e}) + min(0, V(x)+{rail_v:e})"
                ),
            );
        }
    }
    line(&mut text, format_args!(".control\nset noaskquit\nset numdgt=14\n{control}\nquit\n.endc\n.end"));
    text
}

fn line(text: &mut String, words: std::fmt::Arguments<'_>) {
    text.write_fmt(words).unwrap();
    text.push('\n');
}

/// The first source also carries the small signal.
fn source(text: &mut String, k: usize, drive: &Drive) {
    let (_, first_v) = drive.edges[0];
    let small = if k == 0 { " ac 1" } else { "" };
    write!(text, "Vd{k} d{k} 0 dc {first_v:e}{small}").unwrap();
    if drive.edges.len() > 1 {
        write!(text, " pwl(0 {first_v:e}").unwrap();
        let mut before_v = first_v;
        for (t, v) in &drive.edges[1..] {
            // no edge where nothing changes; half of the rise on either side of the edge
            if (v - before_v).abs() > 0.0 {
                let (from, to) = (t - 0.5 * RISE_S, t + 0.5 * RISE_S);
                write!(text, "\n+ {from:.14e} {before_v:e} {to:.14e} {v:e}").unwrap();
                before_v = *v;
            }
        }
        text.push(')');
    }
    text.push('\n');
}
