//! What the wire of a skin says of a box: 40 measurements and a raster scan as hexadecimal bytes. The Python package
//! has to say the same (python/tests/test_wire.py).

use spts::contact::mesh::cuboid;
use spts::contact::{PosedMesh, PreparedMesh, TouchBody, TouchSkin, WinklerConfig};
use spts::{Chain, ChainConfig, Mode, SkinLayout, Wire};
use std::io::Write as _;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let layout = SkinLayout::new(10, 10, 0.015, 0.01)?;
    let mut skin = TouchSkin::flat(layout, WinklerConfig::default())?;
    let mesh = cuboid([0.04, 0.05, 0.03]).translated([0.0, 0.0, -0.015]);
    let block = TouchBody::from(PreparedMesh::from(mesh));
    let chain = Chain::new(&ChainConfig::default(), &layout, 7, ".".as_ref())?;
    let mut wire = Wire::new(&chain, 0)?;
    let mut wrenches = Vec::new();
    for k in 0..3 {
        let position_m = [0.01, -0.02, 0.014 - 1e-3 * f64::from(k)];
        let posed = PosedMesh {
            velocity_m_per_s: [0.0, 0.0, -0.01],
            ..PosedMesh::at_rest(&block.mesh, position_m)
        };
        skin.touch(&[(&block, posed)], &mut wrenches);
        wire.feel(skin.electrode_pressure(), 0.1)?;
    }
    for (mode, count) in [(Mode::Compressive, 40), (Mode::Raster, 100)] {
        let mut volts = vec![0.0; count];
        wire.measure(mode, &mut volts)?;
        let hex: String = volts
            .iter()
            .flat_map(|v| v.to_le_bytes())
            .map(|b| format!("{b:02x}"))
            .collect();
        writeln!(std::io::stdout(), "{hex}")?;
    }
    Ok(())
}
