//! Simulates motion: an object pressed by the arm, or a falling ball.

use super::touch::{ATTEMPTS, Ball, Moving, Touch, of_attempt};
use crate::spec::{Choice, RecordKind, Spec};
use spts::Refusal;
use spts_contact::Frame;
use spts_models::Streams;
use spts_sim::mechanics::{DropConfig, GRAVITY_M_PER_S2, MechanicsConfig, PressConfig, Timestep};
use spts_sim::world::no_touch;
use spts_sim::{Mechanics, World};

/// Shortest time from the start to the touch that the arm takes, s.
const APPROACH_S: f64 = 0.25;
/// Shortest press that is simulated, s.
const SHORTEST_S: f64 = 0.5;
/// Time that a press goes on after its last window, so that the lift is no part of a hold, s.
const SPARE_S: f64 = 0.05;
/// Time after the touch of a ball in which it leaves the skin again, s.
const BOUNCE_S: f64 = 0.05;

impl Moving {
    /// Follows `choice` in press number `press`: poses are drawn until one can be pressed.
    pub(super) fn new(spec: &Spec, choice: &Choice, streams: Streams, press: u64) -> Result<Self, Refusal> {
        // no pose can be followed without MuJoCo
        spts_sim::engine::open()?;
        let mut attempt = 0;
        loop {
            let mut touch = Touch::draw(spec, choice, of_attempt(streams, attempt), press);
            touch.refused = attempt;
            attempt += 1;
            let followed = match touch.ball {
                Some(ball) => fall(spec, touch, ball),
                None => pressed(spec, choice, touch, streams, press),
            };
            match followed {
                Ok(moving) => return Ok(moving),
                Err(last) if attempt == ATTEMPTS => {
                    return Err(Refusal::new(format!(
                        "`pose`: none of {ATTEMPTS} poses can be pressed or dropped; the last: {last}"
                    )));
                }
                Err(_) => {}
            }
        }
    }
}

/// The contact of `spec` in a scene of the simulation, the step chosen by it.
fn scene(spec: &Spec) -> MechanicsConfig {
    let (model, parameters) = spec.contact();
    let mut contact = parameters.clone();
    contact.insert("model".to_owned(), model.into());
    MechanicsConfig { timestep_s: Some(Timestep::Auto), skin: *spec.skin(), contact, ..MechanicsConfig::default() }
}

fn pressed(spec: &Spec, choice: &Choice, touch: Touch, streams: Streams, press: u64) -> Result<Moving, Refusal> {
    let (config, timing) = (&spec.config().press, spec.timing());
    let drawn = |draw: &crate::spec::Draw, label: &str| draw.value(streams, label, press);
    let hold_s = drawn(&config.hold_s, "press.hold_s");
    let rise_s = drawn(&config.rise_s, "press.rise_s");
    let onset_s = APPROACH_S.max(timing.before_s);
    let steady_s = PressConfig::shortest_hold_s(rise_s) + SPARE_S;
    let (end_s, lift_s) = match timing.what {
        RecordKind::Course => (onset_s - timing.before_s + timing.span_s(), onset_s + hold_s),
        _ => {
            let end_s = onset_s + hold_s + timing.span_s();
            (end_s, end_s.max(onset_s + steady_s) + SPARE_S)
        }
    };
    let mechanics = MechanicsConfig {
        press: Some(PressConfig {
            position_m: Some(touch.position_m),
            rotation_deg: Some(touch.rotation_deg),
            tilt_deg: Some(touch.tilt_deg),
            stiffness_pa_per_m: touch.stiffness_pa_per_m.is_finite().then_some(touch.stiffness_pa_per_m),
            force_n: touch.force_n,
            presses: 1,
            duration_s: end_s.max(lift_s).max(SHORTEST_S),
            onset_s,
            onset_spread_s: 0.0,
            rise_s,
            lift_s,
            lift_spread_s: 0.0,
            fall_s: drawn(&config.fall_s, "press.fall_s"),
            position_sd_m: 0.0,
            rotation_sd_deg: 0.0,
            ..PressConfig::default()
        }),
        ..scene(spec)
    };
    let mechanics = Mechanics::of_mesh(mechanics, choice.mesh.clone())?;
    let mut world = World::new(&mechanics)?;
    Ok(Moving { frames: frames_until(&mut world, end_s)?, touch, touch_s: onset_s })
}

fn fall(spec: &Spec, mut touch: Touch, ball: Ball) -> Result<Moving, Refusal> {
    let timing = spec.timing();
    let falls_s = (2.0 * ball.height_m / GRAVITY_M_PER_S2).sqrt();
    let end_s = falls_s + (timing.span_s() - timing.before_s).max(BOUNCE_S);
    let mechanics = MechanicsConfig {
        drop: Some(DropConfig {
            height_m: ball.height_m,
            position_m: Some(touch.position_m),
            mass_kg: ball.mass_kg,
            radius_m: ball.radius_m,
            stiffness_pa_per_m: touch.stiffness_pa_per_m,
            drops: 1,
            duration_s: end_s,
            release_s: 0.0,
            release_spread_s: 0.0,
            position_sd_m: 0.0,
            ..DropConfig::default()
        }),
        ..scene(spec)
    };
    let mechanics = Mechanics::new(mechanics, "".as_ref())?;
    let mut world = World::new(&mechanics)?;
    let frames = frames_until(&mut world, f64::INFINITY)?;
    let Some(bounce) = world.first_bounce() else {
        return Err(no_touch(end_s));
    };
    touch.ball = Some(Ball { speed_m_per_s: bounce.speed_in_m_per_s, ..ball });
    Ok(Moving { touch, touch_s: bounce.start_s, frames })
}

/// The frames of `world` up to the first one at or after `end_s`.
fn frames_until(world: &mut World, end_s: f64) -> Result<Vec<Frame>, Refusal> {
    let mut frames = Vec::new();
    for frame in world.frames() {
        frames.push(frame?);
        if frames.last().is_some_and(|frame: &Frame| frame.time_s >= end_s) {
            break;
        }
    }
    Ok(frames)
}
