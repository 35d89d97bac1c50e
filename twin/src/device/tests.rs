//! Both ends of the port, against each other.

use super::{BlockSource as _, Host, Pressed, PressedConfig, VirtualDevice};
use crate::{Chain, ChainConfig};
use spts_circuit::Mode;
use spts_contact::objects::by_name;
use spts_models::SkinLayout;
use std::os::unix::net::UnixStream;

fn pressed(mode: Mode, blocks: u64) -> Pressed {
    let config = ChainConfig {
        readout: Some("as_built".to_owned()),
        ..ChainConfig::default()
    };
    let chain = Chain::new(&config, &SkinLayout::default(), 3, "".as_ref()).unwrap();
    let config = PressedConfig {
        object: by_name("T").unwrap(),
        force_n: 20.0,
        mode,
        blocks: Some(blocks),
        session: 0,
    };
    Pressed::new(&chain, config).unwrap()
}

#[test]
fn a_host_reads_what_the_device_measures() {
    for mode in [Mode::Raster, Mode::Compressive] {
        let mut same = pressed(mode, 2);
        let (near, far) = UnixStream::pair().unwrap();
        let device = std::thread::spawn(move || {
            let mut counted = 0;
            let count = VirtualDevice::new(far, false).serve(&mut pressed(mode, 2), |_| counted += 1);
            (count.unwrap(), counted)
        });
        let mut host = Host::greet(near).unwrap();
        let mut last = 0;
        for _ in 0..2 {
            let (found, mut made) = (host.block(100_000).unwrap(), same.next_block().unwrap().unwrap());
            made.codes.pop();
            assert_eq!(found, made);
            assert!(found.frame_position > last + 1000);
            last = found.frame_position;
        }
        assert_eq!(device.join().unwrap(), (2, 2));
        assert!(same.next_block().unwrap().is_none());
    }
}

/// In a raster scan, the taxel that the object presses most reads lowest, and only while it is held.
#[test]
fn a_press_is_seen_while_it_lasts() {
    let block = pressed(Mode::Raster, 1).next_block().unwrap().unwrap();
    let least = |frame: usize| *block.codes[frame * 100..][..100].iter().min().unwrap();
    let idle = least(100);
    // four times what the device itself takes for a touch
    assert!(least(600) + 20 < idle, "{} of {idle}", least(600));
    assert!(least(990).abs_diff(idle) < 20);
}
