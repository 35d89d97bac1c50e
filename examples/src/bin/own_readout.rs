//! A readout of your own: a profile that lists the effects of the electronics, here a quieter wire and a converter of
//! 14 bits, beside the readout that was fitted to the published skin.
//!
//! `cargo run --release --bin own_readout -- [PROFILE.toml]`; `spts simulate press/T --readout PROFILE.toml` takes the
//! same file.

use examples::{Result, decode, show, window};
use spts::chain::Acquisition;
use spts::{Mode, Profile, Scene, Twin};

/// An effect that is not listed is not there. `circuit/profiles` has those that ship, every line explained.
const PROFILE: &str = "
weights = 'binary'
sample_rate_hz = 64300.0
drive_v = 4.3
feedback_ohm = 1000.0

[compressive.idle_noise]
sd_v = 0.005

[compressive.rails]
limit_v = 32.0

[compressive.adc]
bits = 14
reference_v = 3.3
divider = 19.5438
offset_v = 32.0
";

fn main() -> Result<()> {
    let text = match std::env::args().nth(1) {
        Some(file) => std::fs::read_to_string(file)?,
        None => PROFILE.to_owned(),
    };
    let scene = Scene::from_toml("[press]\nobject = 'eraser'\npresses = 1", ".".as_ref())?;
    let twin = Twin::new(&scene)?;
    let press = &twin.presses(0..1, &|| ())?[0];
    let middle = press.frames.len() / 2;
    let acquisition = Acquisition::presses(Mode::Compressive, 0);

    let own = scene.chain().with_profile(Profile::from_toml(&text)?)?;
    for (name, chain) in [("as_built", scene.chain()), ("your own", &own)] {
        let recording = chain.record(&[&press.frames], scene.duration_s(), &acquisition)?;
        let volts = &recording.blocks()[0].volts[..10_000];
        let mean = volts.iter().sum::<f64>() / volts.len() as f64;
        let variance = volts.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / volts.len() as f64;
        println!("{name}: noise of the untouched skin {:.1} mV; from 40 measurements:", 1e3 * variance.sqrt());
        let image = decode(&window(&recording, press.frames[middle].time_s, 40)?)?;
        let truth = &chain.conductance_maps(&[&press.frames], 0)[0][middle];
        show(&image, truth.values(), scene.skin().cols());
    }
    Ok(())
}
