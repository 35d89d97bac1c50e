//! A ball that lands on the edge of the skin.

use super::{GRAVITY_M_PER_S2, read};
use spts_contact::Frame;
use spts_sim::World;
use spts_sim::mechanics::Task;

/// Over the rim the ball is pushed off; what it gains in speed sideways and in spin it has lost in height. Energy in
/// flight from pairs of frames: the mean velocity between them is that of their middle, the turn is exact for a free
/// sphere. The heights of a pair are known to g T²/8 = 5 µm (T = 2 ms) and the step's own error is m g dt v: 1 % of the
/// energy allows for both.
#[test]
fn no_energy_from_the_rim() {
    for friction in ["0.0", "0.6"] {
        for col in ["-0.5", "9.2", "9.5"] {
            let scene = read(&format!(
                "[contact]\nfriction = {friction}\ndamping_s = 0.0\n[drop]\ncol = {col}\nrelease_s = 0.0\n\
                 release_spread_s = 0.0\nposition_sd_m = 0.0\nduration_s = 0.7"
            ))
            .unwrap();
            let Task::Drop(ball) = scene.task() else { unreachable!() };
            let start_j = ball.mass_kg * GRAVITY_M_PER_S2 * ball.height_m;
            let frames: Vec<Frame> = World::new(&scene).unwrap().frames().map(Result::unwrap).collect();
            let mut sideways_m = 0.0_f64;
            for pair in frames.windows(2) {
                if pair.iter().all(|f| f.wrench.force_n[2] <= 0.0) {
                    let energy_j = flight_energy_j(pair, ball.mass_kg, ball.radius_m);
                    assert!(energy_j < 1.01 * start_j, "{friction} {col}: {energy_j} of {start_j} J");
                }
                sideways_m = sideways_m.max(pair[1].pose.position_m[0].abs());
            }
            assert!(sideways_m > 0.1, "{friction} {col}: the ball stays, {sideways_m} m");
        }
    }
}

/// Kinetic energy, spin included, and height above the release's lowest point, of a free shell between two frames.
fn flight_energy_j(pair: &[Frame], mass_kg: f64, radius_m: f64) -> f64 {
    let dt_s = pair[1].time_s - pair[0].time_s;
    let [a, b] = [pair[0].pose, pair[1].pose];
    let speed2: f64 = (0..3).map(|i| ((b.position_m[i] - a.position_m[i]) / dt_s).powi(2)).sum();
    let cosine: f64 = (0..4).map(|i| a.quaternion[i] * b.quaternion[i]).sum();
    let spin = 2.0 * cosine.abs().min(1.0).acos() / dt_s;
    let height_m = 0.5 * (a.position_m[2] + b.position_m[2]) - radius_m;
    mass_kg * (0.5 * speed2 + GRAVITY_M_PER_S2 * height_m + radius_m * radius_m / 3.0 * spin * spin)
}
