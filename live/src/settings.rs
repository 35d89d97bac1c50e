//! What was chosen, always valid.

use crate::error::LiveError;
use crate::options::{self, FORCE_N, MEASUREMENTS, NOISE_FACTOR};
use spts_eval::decoders::DecoderSpec;
use spts_models::{SkinLayout, in_range, within};
use spts_recon::rows::Designer;
use std::collections::BTreeMap;

/// Where and how hard is pressed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Press {
    /// Place on the skin, m.
    pub(crate) at_m: [f64; 2],
    /// Force, N.
    pub(crate) force_n: f64,
}

impl Press {
    pub(crate) fn new(skin: &SkinLayout, x_mm: f64, y_mm: f64, force_n: f64) -> Result<Self, LiveError> {
        let [width_m, height_m] = skin.extent_m();
        for (field, value, extent_m) in [("x_mm", x_mm, width_m), ("y_mm", y_mm, height_m)] {
            in_range(field, value, value.abs() <= 500.0 * extent_m, "the skin")?;
        }
        within("force_n", force_n, FORCE_N[0], FORCE_N[1], "[0, 200] N")?;
        Ok(Self {
            at_m: [1e-3 * x_mm, 1e-3 * y_mm],
            force_n,
        })
    }
}

/// Decoder and rows of one of the two images.
#[derive(Clone, Copy)]
pub(crate) struct Panel {
    pub(crate) decoder: &'static DecoderSpec,
    /// Who designs the rows; `None` for random ones.
    pub(crate) rows: Option<&'static Designer>,
}

impl Panel {
    pub(crate) fn named(decoder: &str, rows: &str) -> Result<Self, LiveError> {
        Ok(Self {
            decoder: options::decoder(decoder)?,
            rows: options::rows(rows)?,
        })
    }

    /// Name of the rows.
    pub(crate) fn rows_name(&self) -> &'static str {
        self.rows.map_or(options::RANDOM, |designer| designer.name)
    }
}

/// Everything that the wire depends on, and the decoders behind it.
#[derive(Clone)]
pub(crate) struct Settings {
    /// M.
    pub(crate) measurements: usize,
    pub(crate) panels: [Panel; 2],
    pub(crate) readout: &'static str,
    pub(crate) noise: f64,
    /// Fault of every broken cell, by its taxel.
    pub(crate) faults: BTreeMap<u32, &'static str>,
}

impl Settings {
    /// What a page begins with: the published pursuit on random rows beside the network on designed ones.
    pub(crate) fn usual() -> Result<Self, LiveError> {
        Ok(Self {
            measurements: 20,
            panels: [
                Panel::named("matched", options::RANDOM)?,
                Panel::named("amortised", "cosine_signs")?,
            ],
            readout: spts::chain::DEFAULT_READOUT,
            noise: 1.0,
            faults: BTreeMap::new(),
        })
    }

    pub(crate) fn measure(&mut self, count: usize) -> Result<(), LiveError> {
        let [least, most] = MEASUREMENTS;
        in_range("count", count as f64, (least..=most).contains(&count), "[5, 100]")?;
        self.measurements = count;
        Ok(())
    }

    pub(crate) fn read_out(&mut self, profile: &str, noise: f64) -> Result<(), LiveError> {
        within("noise", noise, NOISE_FACTOR[0], NOISE_FACTOR[1], "[0, 10]")?;
        (self.readout, self.noise) = (options::readout(profile)?, noise);
        Ok(())
    }

    pub(crate) fn show(&mut self, panel: usize, decoder: &str, rows: &str) -> Result<(), LiveError> {
        let chosen = Panel::named(decoder, rows)?;
        let last = self.panels.len() - 1;
        in_range("panel", panel as f64, panel <= last, "[0, 1]")?;
        self.panels[panel] = chosen;
        Ok(())
    }

    pub(crate) fn fault(&mut self, taxel: u32, name: Option<&str>, taxels: usize) -> Result<(), LiveError> {
        in_range(
            "taxel",
            f64::from(taxel),
            (taxel as usize) < taxels,
            "the taxels of the skin",
        )?;
        if let Some(name) = name {
            self.faults.insert(taxel, options::fault(name)?);
        } else {
            self.faults.remove(&taxel);
        }
        Ok(())
    }
}
