//! The converter of the published recordings, found from their volts.

use spts_circuit::{Block, CodeScale, Converter, ConverterConfig, Mode};

/// Largest constant that the publication subtracted from a raster scan before it set negative volts to 0, hundredths of
/// a volt; all are whole hundredths, of either sign.
const MOST_SUBTRACTED: i32 = 20;

/// Scale that made the volts of `blocks`, every one of them bit for bit; `None` when it is not the published one. From
/// a raster scan a constant was subtracted that differs between sessions, and negative volts were set to 0.
pub(super) fn published_converter(mode: Mode, blocks: &[Block]) -> Option<Converter> {
    let (offset_v, numerator, denominator) = match mode {
        Mode::Raster => (4.3, 508.0, 165.0),
        Mode::Compressive => (32.0, 11_140.0, 570.0),
    };
    let constants = (0..=MOST_SUBTRACTED)
        .flat_map(|k| [k, -k])
        .map(|k| Some(f64::from(k) / 100.0));
    let constants: Vec<Option<f64>> = match mode {
        Mode::Raster => std::iter::once(None).chain(constants).collect(),
        Mode::Compressive => vec![None],
    };
    let converters = constants.into_iter().filter_map(|subtract_v| {
        let scale = CodeScale::Divider {
            reference_v: 3.3,
            numerator,
            denominator,
        };
        Converter::new(ConverterConfig {
            offset_v,
            scale,
            max_code: 1023,
            subtract_v,
        })
        .ok()
    });
    converters
        .into_iter()
        .find(|c| blocks.iter().all(|block| c.made(&block.volts)))
}
