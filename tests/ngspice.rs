//! The amplifier against ngspice, an independent circuit simulator. Where it is not installed the tests say so and
//! pass.
//!
//! ngspice gets the circuit as elements and solves it with its own numerics; nothing of the model's solution goes into
//! it.

mod netlist;
mod readout;
mod ringing;
mod simulator;

use netlist::{Drive, Limits, netlist};
use rand::RngExt as _;
use ringing::ringing;
use simulator::{found, interpolate, run};
use spts_circuit::amplifier::{Amplifier, AmplifierNoise, AmplifierResponse, BusLoad, Network, OpAmp, Transient};
use spts_models::Streams;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A tenth of the finer converter's step, V: 3.3/1023 · 508/165 / 10.
const TENTH_LSB_V: f64 = 0.993e-3;
/// When the drives change, s.
const EDGE_S: f64 = 1e-6;

/// One circuit: random taxels of 25 … 300 µS, and random drives before and after the edge.
struct Case {
    amplifier: Amplifier,
    drives: Vec<Drive>,
}

impl Case {
    /// Load before the edge, or after it.
    fn load(&self, edge: usize) -> BusLoad {
        BusLoad {
            conductance_s: self.drives.iter().map(|d| d.conductance_s).sum(),
            current_a: self.drives.iter().map(|d| d.conductance_s * d.edges[edge].1).sum(),
        }
    }
}

fn case(taxels: usize, feedback_ohm: f64, bus_f: f64, feedback_f: f64, op_amp: OpAmp, index: u64) -> Case {
    let mut rng = Streams::new(4).rng("ngspice", index);
    let mut between = |low: f64, high: f64| low + (high - low) * rng.random::<f64>();
    let drives = (0..taxels).map(|_| Drive {
        conductance_s: between(25e-6, 300e-6),
        edges: vec![(0.0, between(-3.3, 3.3)), (EDGE_S, between(-3.3, 3.3))],
    });
    let network = Network { feedback_ohm, feedback_f, bus_f, offset_v: 0.4e-3, temperature_k: 300.0 };
    Case { drives: drives.collect(), amplifier: Amplifier::new(op_amp, network).unwrap() }
}

/// Every number of taxels, feedback and capacitance, without slewing and rails.
fn cases() -> Vec<Case> {
    let op_amp = OpAmp {
        slew_v_per_s: 1e15,
        rail_v: 1e6,
        // the netlist's noise is thermal, and white
        noise_corner_hz: 0.0,
        ..OpAmp::default()
    };
    let mut cases = Vec::new();
    for taxels in [1, 10, 100] {
        for feedback_ohm in [300.0, 1e3, 3e3] {
            for (bus_f, feedback_f) in [(0.0, 0.0), (5e-9, 0.0), (5e-9, 100e-12)] {
                cases.push(case(taxels, feedback_ohm, bus_f, feedback_f, op_amp, cases.len() as u64));
            }
        }
    }
    cases
}

/// Runs `check` on every case, as many at a time as there are cores.
fn in_parallel(cases: &[Case], check: impl Fn(&Case) + Sync) {
    let next = AtomicUsize::new(0);
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                while let Some(case) = cases.get(next.fetch_add(1, Ordering::Relaxed)) {
                    check(case);
                }
            });
        }
    });
}

#[track_caller]
fn assert_within(what: &str, found: f64, expected: f64, tolerance: f64, case: &Case) {
    let error = (found - expected).abs();
    assert!(
        error <= tolerance,
        "{what}: {found:e}, ngspice has {expected:e}, {error:e} apart, more than {tolerance:e}; {} taxels, {:?}",
        case.drives.len(),
        case.amplifier.network()
    );
}

#[test]
fn operating_point_noise_and_bandwidth() {
    if !found() {
        return;
    }
    in_parallel(&cases(), |case| {
        // 1 Hz … 1 THz: outside is less than 1e-5 of the noise; 1500 points a decade resolve a peak of Q = 20
        let control = "op\nprint v(out)\nnoise v(out) Vd0 dec 1500 1 1e12\nsetplot noise1\nwrdata noise.dat onoise_spectrum\n\
                       setplot noise2\nprint onoise_total\nac dec 1000 100 1e8\nwrdata ac.dat vdb(out)";
        let spice = run(&netlist(&case.amplifier, &case.drives, Limits::None, "reltol=1e-6 gmin=1e-15", control));
        let load = case.load(0);
        let mut rest = Transient::new(case.amplifier);
        rest.settle(load);
        assert_within("output", rest.output_v(), spice.printed("v(out)"), TENTH_LSB_V, case);

        let total_v = spice.printed("onoise_total");
        let rms_v = AmplifierNoise::rms(&case.amplifier, load.conductance_s).total();
        assert_within("noise", rms_v, total_v, 1e-3 * total_v, case);
        for (hz, density) in spice.data("noise.dat").into_iter().step_by(150) {
            let found = AmplifierNoise::density(&case.amplifier, load.conductance_s, hz).total();
            assert_within("noise density", found, density, 1e-3 * density, case);
        }

        let response = AmplifierResponse::new(&case.amplifier, load.conductance_s);
        let decibels = spice.data("ac.dat");
        let down = decibels[0].1 - 20.0 * 2_f64.sqrt().log10();
        let end = decibels.iter().rposition(|(_, db)| *db >= down).unwrap();
        let ((a, u), (b, v)) = (decibels[end], decibels[end + 1]);
        let hz = a * (b / a).powf((down - u) / (v - u));
        assert_within("bandwidth", response.bandwidth_hz(), hz, 1e-3 * hz, case);
    });
}

#[test]
fn step_response_and_ringing() {
    if !found() {
        return;
    }
    let rang = AtomicUsize::new(0);
    in_parallel(&cases(), |case| {
        let (before, after) = (case.load(0), case.load(1));
        let response = AmplifierResponse::new(&case.amplifier, after.conductance_s);
        // steps of a 300th of the fastest turn or time constant, until a millionth of the step is left
        let long_s = response.settle_s(1e-6);
        let step_s = response.ringing_hz().unwrap_or(response.bandwidth_hz()).recip() / 300.0;
        let control = format!("tran {step_s:e} {:e} 0 {step_s:e}\nwrdata tran.dat v(out)", EDGE_S + long_s);
        let options = "reltol=1e-6 abstol=1e-15 vntol=1e-9 gmin=1e-15";
        let spice = run(&netlist(&case.amplifier, &case.drives, Limits::None, options, &control));
        let wave = spice.data("tran.dat");
        let mut transient = Transient::new(case.amplifier);
        transient.settle(before);
        transient.advance(after, long_s);
        let settled_v = wave[wave.len() - 1].1;
        assert_within("settled step", transient.output_v(), settled_v, TENTH_LSB_V, case);

        if response.quality() > 1.0 {
            let (hz, damping_per_s) = ringing(&wave, EDGE_S, settled_v);
            rang.fetch_add(1, Ordering::Relaxed);
            assert_within("ringing", response.ringing_hz().unwrap(), hz, 0.02 * hz, case);
            assert_within("damping", response.damping_per_s(), damping_per_s, 0.02 * damping_per_s, case);
        }
    });
    assert!(rang.into_inner() >= 6, "hardly any case rings");
}

/// From one rail to the other at the slew rate, and back between them, along the whole wave. The edges take 0.1 ns here
/// and none in the model: at the slew rate that is 2.5 mV over a tenth of a step of the compressive converter, 6.3 mV,
/// which is the tolerance.
#[test]
fn slewing_and_rails() {
    if !found() {
        return;
    }
    let op_amp = OpAmp { rail_v: 5.0, ..OpAmp::default() };
    let capacitances = [(0.0, 0.0), (5e-9, 0.0), (20e-9, 0.0), (5e-9, 100e-12)];
    let cases: Vec<Case> = (0_u64..)
        .zip(capacitances)
        .map(|(i, (bus_f, feedback_f))| {
            let mut case = case(40, 1e3, bus_f, feedback_f, op_amp, 100 + i);
            for drive in &mut case.drives {
                // 40 · 160 µS · 1.65 V on 1 kΩ is 10 V, beyond either rail; a tenth of the random volts is within them
                let (high_v, last_v) = (drive.edges[0].1.abs(), 0.1 * drive.edges[1].1);
                drive.edges = vec![(0.0, high_v), (EDGE_S, -high_v), (EDGE_S + 10e-6, last_v)];
            }
            case
        })
        .collect();
    in_parallel(&cases, |case| {
        let control = "tran 1n 21u 0 1n\nwrdata tran.dat v(out)";
        let options = "reltol=1e-5 abstol=1e-12 vntol=1e-7 gmin=1e-15";
        let spice = run(&netlist(&case.amplifier, &case.drives, Limits::All, options, control));
        let wave = spice.data("tran.dat");
        let mut transient = Transient::new(case.amplifier);
        transient.settle(case.load(0));
        let (mut volts, mut theirs) = (vec![transient.output_v()], vec![wave[0].1]);
        for k in 1..=400_u32 {
            transient.advance(case.load(if k <= 200 { 1 } else { 2 }), 50e-9);
            let expected = interpolate(&wave, EDGE_S + 50e-9 * f64::from(k));
            assert_within("output", transient.output_v(), expected, 6.3e-3, case);
            volts.push(transient.output_v());
            theirs.push(expected);
        }
        // both rails, to the margin of the switch, 1e-9, and the way back between them
        let [lowest_v, highest_v] = [f64::min, f64::max].map(|f| volts.iter().copied().fold(0.0, f));
        assert_within("lower rail", lowest_v, -5.0, 1e-8, case);
        assert_within("upper rail", highest_v, 5.0, 1e-8, case);
        assert!(volts[200..].iter().any(|v| v.abs() < 2.5), "stays at a rail");
        // 1.25 V in 50 ns, which nothing exceeds; ngspice's own error on a straight line of 1.25 V is below 1 mV.
        // Behind 20 nF the sum turns too slowly to ask for all of it for 50 ns before the rail is there
        let fastest = |volts: &[f64]| volts.windows(2).map(|v| (v[1] - v[0]).abs()).fold(0.0, f64::max) / 50e-9;
        assert!(fastest(&volts) <= 25e6 * (1.0 + 1e-6), "faster than the slew rate");
        if case.amplifier.network().bus_f < 10e-9 {
            assert_within("slew rate", fastest(&volts), 25e6, 1e-6 * 25e6, case);
            assert_within("slew rate", 25e6, fastest(&theirs), 1e-3 * 25e6, case);
        }
    });
}
